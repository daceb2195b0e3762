#pragma once
/// The minimiser of the packing method: soft grains relaxed by FIRE.

#include "pack_detail.hpp"

namespace cairn::pack_detail {

/// Soft grains, each pair with energy 1/2 (overlap)^2, their radii scaled by a factor below or near one.
template <int Dim>
class Minimiser {
 public:
  Minimiser(Grains<Dim>& grains, double scale, double skin);

  enum class End { clear, stuck, spent };
  /// Runs until no overlap of the unscaled or scaled radii, whichever are smaller, exceeds `tolerance` of the smaller
  /// radius, the energy stands still, or `most` iterations are spent.
  End run(double tolerance, int most, int& iterations, double& budget);

  /// Sum of the squares of the relative overlaps of each grain.
  Column squeeze();
  double energy();

 private:
  void build_list();
  void add_forces();
  void fire_step();
  void move(double mixing, double turn);
  bool list_is_stale() const;
  Overlap check() const;

  Grains<Dim>& grains_;
  double scale_, skin_;
  std::array<Column, Dim> v_, f_, built_;
  Column inverse_mass_;
  std::vector<int> first_, second_;  // pairs of the neighbour list
  std::vector<double> reach_;        // sum of their scaled radii
  double dt_ = 0.1, mixing_ = 0.1;
  int downhill_ = 0;
};

}  // namespace cairn::pack_detail
