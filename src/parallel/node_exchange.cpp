#include "cairn/parallel/node_exchange.hpp"

#include <algorithm>

namespace cairn {
namespace {

/// Copies `used` of every `width` numbers of the nodes of `box` to a message.
template <int Dim>
void pack(const NodeBox<Dim>& nodes, const Box<Dim>& box, const NodeQuantity<Dim>& q, double* to) {
  const double* values = (nodes.*q.values).data();
  for_each_row(box, nodes.box, [&](int first, int n) {
    for (int i = 0; i < n; ++i, to += q.used)
      std::copy_n(values + static_cast<std::size_t>(first + i) * q.width, q.used, to);
  });
}

template <int Dim>
Index<Dim> negated(Index<Dim> shift) {
  for (auto& s : shift) s = -s;
  return shift;
}

}  // namespace

template <int Dim>
bool NodeExchange<Dim>::shares_nodes(const Patch<Dim>& patch, const Piece<Dim>& piece) {
  return std::any_of(patch.overlaps.begin(), patch.overlaps.end(),
                     [&](const Box<Dim>& overlap) { return !intersection(overlap, piece.nodes.own).empty(); });
}

template <int Dim>
void NodeExchange<Dim>::start_sums(std::vector<Patch<Dim>>& patches, bool extras) {
  using B = NodeBox<Dim>;
  quantities_ = {{&B::sums, NodeSums<Dim>::width, NodeSums<Dim>::used}, {&B::force, vector_width, Dim}};
  if (extras) quantities_.push_back({&B::extras, NodeExtras<Dim>::width, NodeExtras<Dim>::used});
  messages_.begin();
  sent_.clear();
  for (std::size_t p = 0; p < patches.size(); ++p) {
    const Patch<Dim>& patch = patches[p];
    for (std::size_t l = 0; l < patch.links.size(); ++l) {
      const Link<Dim>& link = patch.links[l];
      Message& message = messages_.outgoing(owner_[link.patch]);
      for (const auto& piece : patch.pieces) {
        const Box<Dim> box = intersection(patch.overlaps[l], piece.nodes.own);
        if (box.empty()) continue;
        sent_.push_back({static_cast<int>(p), piece.body, box, owner_[link.patch]});
        const Box<Dim> theirs = box.shifted(negated<Dim>(link.shift));
        message.put(std::int64_t{link.patch});
        message.put(std::int64_t{link.mirror});
        message.put(std::int64_t{piece.body});
        for (int d = 0; d < Dim; ++d)
          message.put(std::int64_t{theirs.lower[d]}), message.put(std::int64_t{theirs.upper[d]});
        for (const auto& q : quantities_) pack(piece.nodes, box, q, message.extend(box.size() * q.used));
      }
    }
  }
  messages_.start();
}

template <int Dim>
void NodeExchange<Dim>::finish_sums(std::vector<Patch<Dim>>& patches) {
  messages_.finish();
  position_.assign(owner_.size(), -1);
  for (std::size_t p = 0; p < patches.size(); ++p) position_[patches[p].id] = static_cast<int>(p);
  parts_.assign(patches.size(), {});
  parse(messages_.rank());
  for (int rank : messages_.neighbours()) parse(rank);
  for (std::size_t p = 0; p < patches.size(); ++p) add_parts(patches[p], parts_[p]);
}

template <int Dim>
void NodeExchange<Dim>::parse(int rank) {
  const Message& message = messages_.incoming(rank);
  for (std::size_t at = 0; at < message.size();) {
    Part part;
    const auto patch = message.integer(at++);
    part.link = static_cast<int>(message.integer(at++));
    part.body = static_cast<int>(message.integer(at++));
    for (int d = 0; d < Dim; ++d) {
      part.box.lower[d] = static_cast<int>(message.integer(at++));
      part.box.upper[d] = static_cast<int>(message.integer(at++));
    }
    part.rank = rank, part.at = at;
    for (const auto& q : quantities_) at += part.box.size() * q.used;
    parts_[position_[patch]].push_back(part);
  }
}

template <int Dim>
void NodeExchange<Dim>::add_parts(Patch<Dim>& patch, std::vector<Part>& parts) {
  std::sort(parts.begin(), parts.end(),
            [](const Part& a, const Part& b) { return std::pair(a.body, a.link) < std::pair(b.body, b.link); });
  // Ghosts of the step before that nobody speaks of any more go; new ones come.
  std::erase_if(patch.pieces, [&](const Piece<Dim>& piece) {
    return piece.points.size() == 0 &&
           !std::binary_search(parts.begin(), parts.end(), Part{0, piece.body, {}, 0, 0},
                               [](const Part& a, const Part& b) { return a.body < b.body; });
  });
  for (std::size_t i = 0; i < parts.size();) {
    std::size_t end = i;
    while (end < parts.size() && parts[end].body == parts[i].body) ++end;
    Piece<Dim>& piece = patch.piece_of(parts[i].body, 0);
    if (piece.points.size() == 0) piece.nodes.own = piece.nodes.box = {};
    add_to_piece(piece, patch.links_before, &parts[i], &parts[i] + (end - i), quantities_, true);
    i = end;
  }
}

template <int Dim>
void NodeExchange<Dim>::add_to_piece(Piece<Dim>& piece, int links_before, const Part* begin, const Part* end,
                                     const Quantities& quantities, bool grow) {
  NodeBox<Dim>& nodes = piece.nodes;
  Box<Dim> box = nodes.box;
  if (grow)
    for (const Part* part = begin; part != end; ++part) box = hull(box, part->box);
  const bool in_place = box == nodes.box && begin->link >= links_before;
  if (in_place) {  // nothing comes before the own contribution, which is there already
    for (const Part* part = begin; part != end; ++part) add_part(nodes, *part, quantities);
    return;
  }
  Part own{-1, piece.body, nodes.own, messages_.rank(), 0};
  std::vector<AlignedDoubles> kept;
  for (const auto& q : quantities) {
    kept.emplace_back(own.box.size() * q.used);
    pack(nodes, own.box, q, kept.back().data());
    (nodes.*q.values).assign(box.size() * q.width, 0.0);
  }
  nodes.box = box;
  const auto add_own = [&] {
    for (std::size_t i = 0; i < quantities.size(); ++i) {
      const auto& q = quantities[i];
      const double* from = kept[i].data();
      double* values = (nodes.*q.values).data();
      for_each_row(own.box, nodes.box, [&](int first, int n) {
        for (int k = 0; k < n; ++k)
          for (int c = 0; c < q.used; ++c) values[static_cast<std::size_t>(first + k) * q.width + c] += *from++;
      });
    }
  };
  const Part* part = begin;
  for (; part != end && part->link < links_before; ++part) add_part(nodes, *part, quantities);
  add_own();
  for (; part != end; ++part) add_part(nodes, *part, quantities);
}

template <int Dim>
void NodeExchange<Dim>::add_part(NodeBox<Dim>& nodes, const Part& part, const Quantities& quantities) const {
  const double* from = messages_.incoming(part.rank).data(part.at);
  for (const auto& q : quantities) {
    double* values = (nodes.*q.values).data();
    for_each_row(part.box, nodes.box, [&](int first, int n) {
      for (int k = 0; k < n; ++k)
        for (int c = 0; c < q.used; ++c) values[static_cast<std::size_t>(first + k) * q.width + c] += *from++;
    });
  }
}

template <int Dim>
void NodeExchange<Dim>::sum(std::vector<Patch<Dim>>& patches, AlignedDoubles NodeBox<Dim>::*values) {
  const Quantities quantity = {{values, vector_width, Dim}};
  messages_.begin();
  for (const Sent& sent : sent_) {
    const Piece<Dim>& piece = patches[sent.patch].piece_of(sent.piece_body, 0);
    pack(piece.nodes, sent.box, quantity[0], messages_.outgoing(sent.rank).extend(sent.box.size() * Dim));
  }
  messages_.start();
  messages_.finish();
  // The same parts come in the same order as with the sums, without their headers.
  std::vector<std::pair<std::size_t, Part*>> order;
  for (auto& parts : parts_)
    for (auto& part : parts) order.emplace_back(part.at, &part);
  std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) {
    return std::pair(a.second->rank, a.first) < std::pair(b.second->rank, b.first);
  });
  std::size_t at = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    Part& part = *order[i].second;
    if (i == 0 || order[i - 1].second->rank != part.rank) at = 0;
    part.at = at;
    at += part.box.size() * Dim;
  }
  for (std::size_t p = 0; p < patches.size(); ++p)
    for (std::size_t i = 0; i < parts_[p].size();) {
      std::size_t end = i;
      while (end < parts_[p].size() && parts_[p][end].body == parts_[p][i].body) ++end;
      add_to_piece(patches[p].piece_of(parts_[p][i].body, 0), patches[p].links_before, &parts_[p][i],
                   &parts_[p][i] + (end - i), quantity, false);
      i = end;
    }
}

template class NodeExchange<2>;
template class NodeExchange<3>;

}  // namespace cairn
