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

/// Lays the nodes out anew, over `box` and with the further rows given, which hold what there is; the new ones have
/// zeros.
template <int Dim>
void lay_out(NodeBox<Dim>& nodes, const Box<Dim>& box, std::vector<FurtherRow<Dim>> rows,
             const std::vector<NodeQuantity<Dim>>& quantities) {
  FurtherRows<Dim>& further = nodes.further;
  const Box<Dim> old_box = nodes.box;
  std::vector<int> moved;  // where each of the rows is now
  for (std::size_t k = 0, at = 0; k < further.rows.size(); ++k) {
    while (!(rows[at] == further.rows[k])) ++at;
    moved.push_back(static_cast<int>(at));
  }
  further.rows = std::move(rows);
  nodes.box = box;
  const auto move_rows = [&](const double* from, AlignedDoubles& to, int width, std::size_t before) {
    for (std::size_t k = 0; k < moved.size(); ++k, from += width)
      std::copy_n(from, width, to.data() + (before + moved[k]) * width);
  };
  for (const auto& q : quantities) {
    AlignedDoubles& values = nodes.*q.values;
    const AlignedDoubles old = values;
    const double* from = old.data();
    values.assign(nodes.storage() * q.width, 0.0);
    for_each_row(old_box, box, [&](int first, int n) {
      std::copy_n(from, static_cast<std::size_t>(n) * q.width,
                  values.data() + static_cast<std::size_t>(first) * q.width);
      from += static_cast<std::size_t>(n) * q.width;
    });
    move_rows(from, values, q.width, box.size());
  }
  const AlignedDoubles crossings = further.crossings;
  further.crossings.assign(further.rows.size() * NodeCrossings<Dim>::width, 0.0);
  move_rows(crossings.data(), further.crossings, NodeCrossings<Dim>::width, 0);
  for (auto& point : further.points)
    for (int& row : point.row)
      if (row >= 0) row = moved[row];
}

/// Positions of the further rows that the piece's own points gave it at the nodes of `box`.
template <int Dim>
std::vector<int> own_rows(const NodeBox<Dim>& nodes, const Box<Dim>& box) {
  std::vector<int> rows;
  for (std::size_t k = 0; k < nodes.further.rows.size(); ++k)
    if (nodes.further.rows[k].own && box.contains(nodes.further.rows[k].place)) rows.push_back(static_cast<int>(k));
  return rows;
}

template <int Dim>
void pack_rows(const NodeBox<Dim>& nodes, const std::vector<int>& rows, const NodeQuantity<Dim>& q, Message& message) {
  for (const int k : rows)
    std::copy_n((nodes.*q.values).data() + static_cast<std::size_t>(nodes.row_of(k)) * q.width, q.used,
                message.extend(q.used));
}

template <int Dim>
Index<Dim> negated(Index<Dim> shift) {
  for (auto& s : shift) s = -s;
  return shift;
}

/// Numbers that a further row has in the message of the sums before its quantities: node, side set, crossings.
template <int Dim>
constexpr std::size_t row_head = Dim + 1 + NodeCrossings<Dim>::width;

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
  for (const Sent& sent : sent_[p]) {
    const NodeBox<Dim>& nodes = patch.piece_of(sent.body, 0).nodes;
    Message& message = messages_.outgoing(sent.rank);
    pack(nodes, sent.box, out_.quantities[0], message.extend(sent.box.size() * out_.quantities[0].used));
    pack_rows(nodes, own_rows(nodes, sent.box), out_.quantities[0], message);
  }
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
      const std::vector<int> further = own_rows(piece.nodes, box);
      message.put(static_cast<std::int64_t>(further.size()));
      for (const auto& q : out_.quantities) pack(piece.nodes, box, q, message.extend(box.size() * q.used));
      for (const int k : further) {
        const FurtherRow<Dim>& row = piece.nodes.further.rows[k];
        for (int d = 0; d < Dim; ++d) message.put(std::int64_t{row.place[d] - link.shift[d]});
        message.put(row.sides.key());
        constexpr int width = NodeCrossings<Dim>::width;
        std::copy_n(piece.nodes.further.crossings.data() + static_cast<std::size_t>(k) * width, width,
                    message.extend(width));
      }
      for (const auto& q : out_.quantities) pack_rows(piece.nodes, further, q, message);
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
    part.further.resize(message.integer(at++));
    part.rank = rank, part.at = at, part.nodes_before = nodes;
    nodes += part.box.size() + part.further.size();
    for (const auto& q : in_.quantities) at += part.box.size() * q.used;
    part.rows_at = at;
    at += part.further.size() * row_head<Dim>;
    for (const auto& q : in_.quantities) at += part.further.size() * q.used;
    parts_of(patch).push_back(std::move(part));
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
    if (in_.with_boxes && piece.points.size() == 0) piece.nodes.own = piece.nodes.box = {}, piece.nodes.further.clear();
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
           !std::binary_search(parts.begin(), parts.end(), Part{0, piece.body, {}, 0, 0, 0, 0, {}},
                               [](const Part& a, const Part& b) { return a.body < b.body; });
  });
}

template <int Dim>
void NodeExchange<Dim>::add_to_piece(Piece<Dim>& piece, int links_before, std::span<Part> parts) const {
  NodeBox<Dim>& nodes = piece.nodes;
  Box<Dim> box = nodes.box;
  if (in_.with_boxes)
    for (const Part& part : parts) box = hull(box, part.box);
  const bool rows_come =
      std::any_of(parts.begin(), parts.end(), [](const Part& part) { return !part.further.empty(); });
  if (in_.with_boxes && rows_come)
    receive_rows(nodes, box, parts);
  else if (!(box == nodes.box))
    lay_out(nodes, box, nodes.further.rows, in_.quantities);
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
      std::fill_n((nodes.*q.values).begin(), nodes.box.size() * q.width, 0.0);
    }
  for (auto part = parts.begin(); part != own_place; ++part) add_part(nodes, *part);
  if (own_waits)
    for (std::size_t i = 0; i < own.size(); ++i) unpack(nodes, nodes.own, in_.quantities[i], own[i].data());
  for (auto part = own_place; part != parts.end(); ++part) add_part(nodes, *part);
  if (rows_come) add_rows(nodes, parts, own_place - parts.begin());
}

/// Makes the further rows that neighbours speak of, over `box`, and notes where those of each part are.
template <int Dim>
void NodeExchange<Dim>::receive_rows(NodeBox<Dim>& nodes, const Box<Dim>& box, std::span<Part> parts) const {
  std::vector<FurtherRow<Dim>> rows = nodes.further.rows;
  const auto read = [&](const Part& part, std::size_t k) {
    const Message& message = messages_.incoming(part.rank);
    const std::size_t at = part.rows_at + k * row_head<Dim>;
    FurtherRow<Dim> row{{}, SideSet(message.integer(at + Dim)), false};
    for (int d = 0; d < Dim; ++d) row.place[d] = static_cast<int>(message.integer(at + d));
    return row;
  };
  for (const Part& part : parts)
    for (std::size_t k = 0; k < part.further.size(); ++k) rows.push_back(read(part, k));
  std::stable_sort(rows.begin(), rows.end());  // own ones stay before others of the same place and set
  rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
  lay_out(nodes, box, std::move(rows), in_.quantities);
  for (Part& part : parts)
    for (std::size_t k = 0; k < part.further.size(); ++k) {
      const auto row = read(part, k);
      part.further[k] = nodes.further.find(row.place, row.sides);
    }
}

/// Adds the further rows of the parts in order, with the piece's own after the first `parts_before`.
template <int Dim>
void NodeExchange<Dim>::add_rows(NodeBox<Dim>& nodes, std::span<const Part> parts, std::size_t parts_before) const {
  const auto add = [&](double* rows, int width, int used, auto&& first_of, std::size_t step) {
    const std::size_t size = nodes.further.rows.size() * width;
    const std::vector<double> own(rows, rows + size);
    std::fill_n(rows, size, 0.0);
    for (std::size_t i = 0; i <= parts.size(); ++i) {
      if (i == parts_before)
        for (std::size_t c = 0; c < size; ++c) rows[c] += own[c];
      if (i == parts.size()) break;
      const double* from = first_of(parts[i]);
      for (const int k : parts[i].further) {
        for (int c = 0; c < used; ++c) rows[static_cast<std::size_t>(k) * width + c] += from[c];
        from += step;
      }
    }
  };
  const auto message = [&](const Part& part, std::size_t at) { return messages_.incoming(part.rank).data(at); };
  constexpr int width = NodeCrossings<Dim>::width;
  if (in_.with_boxes)
    add(
        nodes.further.crossings.data(), width, width,
        [&](const Part& part) { return message(part, part.rows_at + Dim + 1); }, row_head<Dim>);
  std::size_t before = 0;  // numbers of the quantities before, for each row
  for (const auto& q : in_.quantities) {
    const auto first_of = [&](const Part& part) {
      const std::size_t n = part.further.size();
      return in_.with_boxes ? message(part, part.rows_at + n * (row_head<Dim> + before))
                            : message(part, (part.nodes_before + part.box.size()) * q.used);
    };
    add((nodes.*q.values).data() + nodes.box.size() * q.width, q.width, q.used, first_of, q.used);
    before += q.used;
  }
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
