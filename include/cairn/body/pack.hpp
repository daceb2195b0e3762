#pragma once
/// Dense random packings of disks (2D) and spheres (3D): the grain tables that a case reads under [[grains]].
///
/// Method. The diameters are the quantiles of the size distribution, so that count, mean, least and largest diameter
/// are delivered and not left to chance; they are never changed afterwards. The grains are placed at random, large
/// ones first, and the energy of their overlaps is minimised (O'Hern, Silbert, Liu & Nagel, Phys. Rev. E 68, 011306,
/// 2003) by FIRE (Bitzek et al., Phys. Rev. Lett. 97, 170201, 2006) while they grow in stages to their full size.
/// Where a pack stays jammed, the most squeezed small grains move to the largest holes and the search goes on.
/// The same spec gives the same bits on the same machine. Serial: call it on one rank.
///
/// The keys of a spec file, SPEC.toml of `cairn pack`, are the names of the members:
///
///     [pack]
///     dimension = 2                  # 2 or 3
///     lower = [0.0, 0.0]             # corners of the box [m]
///     upper = [1.2e-3, 1.2e-3]
///     periodic = [false, true]
///     walls = "overlap"              # directions which are not periodic: inside | overlap
///     count = 369                    # leave out count or fraction and it follows from the other
///     fraction = 0.85                # area (2D) or volume (3D) fraction of the box
///     seed = 1
///     max_overlap = 0.001            # largest overlap allowed, of the smaller radius
///     effort = 1.0                   # how long to search
///     [sizes]                        # diameters [m]
///     type = "fit"                   # uniform { min, max } | lognormal { mean, sigma, min, max }
///     min = 31.0e-6                  # list { diameters, weights } | fit { min, max, mean }
///     max = 250.0e-6
///     mean = 57.0e-6
///     scale = false                  # true: diameters are relative, scaled so that count and fraction both hold

#include <cstdint>
#include <string>
#include <vector>

#include "cairn/core/types.hpp"

namespace cairn {

enum class SizeType {
  uniform,    // "uniform": equally likely from `min` to `max`
  lognormal,  // "lognormal": number mean `mean`, standard deviation `sigma` of the logarithm, cut to [min, max]
  list,       // "list": `diameters` with number `weights`
  fit,        // "fit": from `min` to `max` with number mean `mean`, its width such that count and fraction both hold
};

/// Distribution of the diameters, by number.
struct SizeSpec {
  SizeType type = SizeType::uniform;
  double min = 0, max = 0;        // least and largest diameter [m]; may be left 0 for "lognormal" (no cut)
  double mean = 0;                // number mean of the diameters delivered [m]: "lognormal", "fit"
  double sigma = 0;               // standard deviation of ln(diameter): "lognormal"
  std::vector<double> diameters;  // [m]: "list"
  std::vector<double> weights;    // share of each diameter, by number; empty: equal shares: "list"
  bool scale = false;             // diameters are relative: one factor makes count and fraction both hold; not "fit"
};

enum class PackWalls {
  inside,   // "inside": grains lie wholly inside
  overlap,  // "overlap": centres lie inside, grains may reach across; `fraction` counts the parts inside
};

struct PackSpec {
  int dimension = 2;
  Vec3 lower = Vec3::Zero(), upper = Vec3::Zero();  // corners of the box [m]; z is not read in 2D
  std::array<bool, 3> periodic{};                   // a periodic length must exceed twice the largest diameter
  PackWalls walls = PackWalls::inside;              // of every direction that is not periodic
  int count = 0;                                    // number of grains; 0: from `fraction`
  double fraction = 0;                              // area or volume fraction of the box; 0: from `count`
  std::uint64_t seed = 1;
  double max_overlap = 0.001;  // largest overlap of a pair, of its smaller radius; above 0, below 0.1
  double effort = 1;           // the search ends after 3e8, or 4e4 for each grain, grains times iterations times this
  SizeSpec sizes;
};

struct Pack {
  std::vector<Vec3> centre;    // [m], inside the box; z = 0 in 2D
  std::vector<double> radius;  // [m], largest first
  double fraction = 0;         // delivered, from the areas or volumes of the parts inside the box
  double max_overlap = 0;      // largest (r_a + r_b - distance) / min(r_a, r_b), checked after the search; 0: none
  double mean_diameter = 0;    // number mean [m]
  int iterations = 0;          // of the minimiser
};

/// What is wrong with the spec, one line for each error (key, value, remedy); empty where it can be tried.
/// Includes count, sizes, box and fraction that contradict each other, and grains for which there is too little memory.
std::vector<std::string> check_pack(const PackSpec& spec);

/// Makes the pack. Throws InputError with the lines of `check_pack`; RunError where the fraction is not reached
/// within the overlap allowed: the message gives what was reached.
Pack pack_grains(const PackSpec& spec);

/// The grain table as text: CSV with header `x,y,r` or `x,y,z,r` [m], shortest numbers that read back to the same bits,
/// and '#' comments with the spec and the figures delivered.
std::string pack_table(const Pack& pack, const PackSpec& spec);

/// Area (2D) or volume (3D) [m^2, m^3] of the part of a disk or sphere inside a box; directions marked in `whole` do
/// not cut. Closed form in 2D; in 3D by quadrature to about 1e-6 of the sphere.
double volume_inside(int dimension, const Vec3& centre, double radius, const Vec3& lower, const Vec3& upper,
                     const std::array<bool, 3>& whole);

}  // namespace cairn
