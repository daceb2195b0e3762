#include "cairn/solver/simulation.hpp"

namespace cairn {

template <int Dim>
void Simulation<Dim>::project_stress() {
  finish_speed_reduction();  // patches that points entered have their neighbours then
  exchange_->begin_with_boxes({{&NodeBox<Dim>::sums, NodeStress<Dim>::width, NodeStress<Dim>::used}});
  exchange_after([&](std::size_t, Patch<Dim>& patch) {
    find_cracks(patch);
    for (auto& piece : patch.pieces) {
      piece.projected = false;
      lay_out(patch, piece);
      cairn::project_stress(piece, lattice_, transfer_);
    }
  });
  for_patches([&](std::size_t p, Patch<Dim>& patch) {
    exchange_->add(patch, p);
    mirror_stress(patch, lattice_, contact_.faces);
  });
}

template void Simulation<2>::project_stress();
template void Simulation<3>::project_stress();

}  // namespace cairn
