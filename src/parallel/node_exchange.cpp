#include "cairn/parallel/node_exchange.hpp"

#include <algorithm>

namespace cairn {
namespace {

/// Calls f with how many numbers of a node are used, as a constant: loops of a few numbers are unrolled.
template <class F>
void with_constant(int used, F&& f) {
  switch (used) {
    case 2:  // a vector in 2D
      return f(std::integral_constant<int, 2>{});
    case 3:
      return f(std::integral_constant<int, 3>{});
    case 6:  // sums in 2D
      return f(std::integral_constant<int, 6>{});
    case 8:
      return f(std::integral_constant<int, 8>{});
    default:
      return f(used);
  }
}

/// Copies `used` of every `width` numbers of the nodes of `box` to a message.
template <int Dim>
void pack(const NodeBox<Dim>& nodes, const Box<Dim>& box, const NodeQuantity<Dim>& q, double* to) {
  const double* values = (nodes.*q.values).data();
  with_constant(q.used, [&](auto used) {
    for_each_row(box, nodes.box, [&](int first, int n) {
      const double* from = values + static_cast<std::size_t>(first) * q.width;
      for (int i = 0; i < n; ++i, from += q.width, to += used)
        for (int c = 0; c < used; ++c) to[c] = from[c];
    });
  });
}

/// Adds what `pack` made to the nodes of `box`; returns the end of what it read.
template <int Dim>
const double* unpack(NodeBox<Dim>& nodes, const Box<Dim>& box, const NodeQuantity<Dim>& q, const double* from) {
  double* values = (nodes.*q.values).data();
  with_constant(q.used, [&](auto used) {
    for_each_row(box, nodes.box, [&](int first, int n) {
      double* to = values + static_cast<std::size_t>(first) * q.width;
      for (int i = 0; i < n; ++i, from += used, to += q.width)
        for (int c = 0; c < used; ++c) to[c] += from[c];
    });
  });
  return from;
}

/// Makes room for the nodes of `box`, which holds that of the nodes; the new ones have zeros.
template <int Dim>
void widen(NodeBox<Dim>& nodes, const Box<Dim>& box, const std::vector<NodeQuantity<Dim>>& quantities) {
  for (const auto& q : quantities) {
    AlignedDoubles& values = nodes.*q.values;
    const AlignedDoubles old = values;
    const double* from = old.data();
    values.assign(box.size() * q.width, 0.0);
    for_each_row(nodes.box, box, [&](int first, int n) {
      std::copy_n(from, static_cast<std::size_t>(n) * q.width,
                  values.data() + static_cast<std::size_t>(first) * q.width);
      from += static_cast<std::size_t>(n) * q.width;
    });
  }
  nodes.box = box;
}

template <int Dim>
Index<Dim> negated(Index<Dim> shift) {
  for (auto& s : shift) s = -s;
  return shift;
}

}  // namespace

template <int Dim>
NodeExchange<Dim>::NodeExchange(NeighbourExchange& messages, const PatchTable<Dim>& table,
                                const std::vector<Patch<Dim>>& patches)
    : messages_(messages), sent_(patches.size()), parts_(patches.size()) {
  for (const auto& patch : patches) {
    ids_.push_back(patch.id);
    auto& ranks = ranks_.emplace_back();
    for (const auto& link : patch.links) ranks.push_back(table.find(link.patch) < 0 ? -1 : table.owner(link.patch));
  }
}

template <int Dim>
bool NodeExchange<Dim>::beside_others(std::size_t p) const {
  return std::ranges::any_of(ranks_[p], [&](int rank) { return rank >= 0 && rank != messages_.rank(); });
}

template <int Dim>
std::vector<typename NodeExchange<Dim>::Part>& NodeExchange<Dim>::parts_of(PatchId patch) {
  return parts_[std::ranges::lower_bound(ids_, patch) - ids_.begin()];
}

template <int Dim>
void NodeExchange<Dim>::begin_sums(bool extras) {
  using B = NodeBox<Dim>;
  std::vector<NodeQuantity<Dim>> quantities = {{&B::sums, NodeSums<Dim>::width, NodeSums<Dim>::used},
                                               {&B::force, vector_width, Dim}};
  if (extras) quantities.push_back({&B::extras, NodeExtras<Dim>::width, NodeExtras<Dim>::used});
  begin_with_boxes(std::move(quantities));
}

template <int Dim>
void NodeExchange<Dim>::begin_with_boxes(std::vector<NodeQuantity<Dim>> quantities) {
  out_ = {std::move(quantities), true};
  for (auto& list : sent_) list.clear();
  messages_.begin();
}

template <int Dim>
void NodeExchange<Dim>::begin(AlignedDoubles NodeBox<Dim>::*values) {
  out_ = {{{values, vector_width, Dim}}, false};
  messages_.begin();
}

template <int Dim>
void NodeExchange<Dim>::put(Patch<Dim>& patch, std::size_t p) {
  if (out_.with_boxes) return put_with_boxes(patch, p);
  for (const Sent& sent : sent_[p])
    pack(patch.piece_of(sent.body, 0).nodes, sent.box, out_.quantities[0],
         messages_.outgoing(sent.rank).extend(sent.box.size() * out_.quantities[0].used));
}

template <int Dim>
void NodeExchange<Dim>::put_with_boxes(Patch<Dim>& patch, std::size_t p) {
  for (std::size_t l = 0; l < patch.links.size(); ++l) {
    const Link<Dim>& link = patch.links[l];
    const int rank = ranks_[p][l];
    for (const auto& piece : patch.pieces) {
      const Box<Dim> box = intersection(patch.overlaps[l], piece.nodes.own);
      if (box.empty()) continue;
      Message& message = messages_.outgoing(rank);
      sent_[p].push_back({piece.body, box, rank});
      const Box<Dim> theirs = box.shifted(negated<Dim>(link.shift));
      message.put(std::int64_t{link.patch});
      message.put(std::int64_t{link.mirror});
      message.put(std::int64_t{piece.body});
      for (int d = 0; d < Dim; ++d)
        message.put(std::int64_t{theirs.lower[d]}), message.put(std::int64_t{theirs.upper[d]});
      for (const auto& q : out_.quantities) pack(piece.nodes, box, q, message.extend(box.size() * q.used));
    }
  }
}

template <int Dim>
void NodeExchange<Dim>::start() {
  messages_.start();
  in_ = out_;
  if (!in_.with_boxes) return;
  for (auto& list : parts_) list.clear();
  parse(messages_.rank());
}

template <int Dim>
void NodeExchange<Dim>::receive() {
  if (messages_.receive() && in_.with_boxes)
    for (int rank : messages_.neighbours()) parse(rank);
}

template <int Dim>
void NodeExchange<Dim>::parse(int rank) {
  const Message& message = messages_.incoming(rank);
  std::size_t nodes = 0;
  for (std::size_t at = 0; at < message.size();) {
    Part part;
    const auto patch = message.integer(at++);
    part.link = static_cast<int>(message.integer(at++));
    part.body = static_cast<int>(message.integer(at++));
    for (int d = 0; d < Dim; ++d) {
      part.box.lower[d] = static_cast<int>(message.integer(at++));
      part.box.upper[d] = static_cast<int>(message.integer(at++));
    }
    part.rank = rank, part.at = at, part.nodes_before = nodes;
    nodes += part.box.size();
    for (const auto& q : in_.quantities) at += part.box.size() * q.used;
    parts_of(patch).push_back(part);
  }
}

template <int Dim>
void NodeExchange<Dim>::add(Patch<Dim>& patch, std::size_t p) {
  auto& parts = parts_[p];
  if (in_.with_boxes) renew_ghosts(patch, parts);
  for (std::size_t i = 0; i < parts.size();) {
    std::size_t end = i;
    while (end < parts.size() && parts[end].body == parts[i].body) ++end;
    Piece<Dim>& piece = patch.piece_of(parts[i].body, 0);
    if (in_.with_boxes && piece.points.size() == 0) piece.nodes.own = piece.nodes.box = {};
    add_to_piece(piece, patch.links_before, {&parts[i], end - i});
    i = end;
  }
}

/// Orders the parts for adding. Ghosts of the step before that nobody speaks of any more go; new ones come.
template <int Dim>
void NodeExchange<Dim>::renew_ghosts(Patch<Dim>& patch, std::vector<Part>& parts) const {
  std::sort(parts.begin(), parts.end(),
            [](const Part& a, const Part& b) { return std::pair(a.body, a.link) < std::pair(b.body, b.link); });
  std::erase_if(patch.pieces, [&](const Piece<Dim>& piece) {
    return piece.points.size() == 0 &&
           !std::binary_search(parts.begin(), parts.end(), Part{0, piece.body, {}, 0, 0, 0},
                               [](const Part& a, const Part& b) { return a.body < b.body; });
  });
}

template <int Dim>
void NodeExchange<Dim>::add_to_piece(Piece<Dim>& piece, int links_before, std::span<const Part> parts) const {
  NodeBox<Dim>& nodes = piece.nodes;
  Box<Dim> box = nodes.box;
  if (in_.with_boxes)
    for (const Part& part : parts) box = hull(box, part.box);
  if (!(box == nodes.box)) widen(nodes, box, in_.quantities);
  const auto own_place =
      std::find_if(parts.begin(), parts.end(), [&](const Part& p) { return p.link >= links_before; });
  const auto meets_another = [&](const Part& p) {
    return std::any_of(parts.begin(), own_place,
                       [&](const Part& other) { return &other != &p && !intersection(p.box, other.box).empty(); });
  };
  std::vector<AlignedDoubles> own;
  // a + own = own + a: only where several contributions come before the own one, which is there already, does it have
  // to wait.
  const bool own_waits = std::any_of(parts.begin(), own_place, meets_another);
  if (own_waits)
    for (const auto& q : in_.quantities) {
      own.emplace_back(nodes.own.size() * q.used);
      pack(nodes, nodes.own, q, own.back().data());
      std::fill((nodes.*q.values).begin(), (nodes.*q.values).end(), 0.0);
    }
  for (auto part = parts.begin(); part != own_place; ++part) add_part(nodes, *part);
  if (own_waits)
    for (std::size_t i = 0; i < own.size(); ++i) unpack(nodes, nodes.own, in_.quantities[i], own[i].data());
  for (auto part = own_place; part != parts.end(); ++part) add_part(nodes, *part);
}

template <int Dim>
void NodeExchange<Dim>::add_part(NodeBox<Dim>& nodes, const Part& part) const {
  const std::size_t at = in_.with_boxes ? part.at : part.nodes_before * in_.quantities[0].used;
  const double* from = messages_.incoming(part.rank).data(at);
  for (const auto& q : in_.quantities) from = unpack(nodes, part.box, q, from);
}

template class NodeExchange<2>;
template class NodeExchange<3>;

}  // namespace cairn
