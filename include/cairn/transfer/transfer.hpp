#pragma once
/// Transfers between the points of one piece and its nodes. No function here communicates; each works on one piece, and
/// its arithmetic depends on that piece alone. Equations: Bardenhagen, Brackbill & Sulsky 2000, section 2.

#include "cairn/body/piece.hpp"
#include "cairn/core/options.hpp"
#include "cairn/grid/lattice.hpp"
#include "cairn/material/registry.hpp"

namespace cairn {

/// How normals are summed: with which weights, and whether by mass or by volume.
struct NormalSettings {
  enum class Weights { of_shape, gimp, cell_density } weights = Weights::of_shape;
  bool by_mass = false;
};

/// What every transfer of a run shares.
template <int Dim>
struct TransferSettings {
  ShapeFunction shape = ShapeFunction::gimp;
  std::array<double, 3> half_size{};  // half a point's extent in cells, for GIMP
  Vec<Dim> gravity = Vec<Dim>::Zero();
  double flip = 1;
  bool spin = false;  // points carry spin
  // Share of the grid's spin that points take on for each cell width they move. A point's inertia changes as it moves
  // through the cells; what the nodes do not see of spin, a noise, feeds on that: without relaxation a disk gains
  // 10 % of its energy in 30 turns.
  double spin_relaxation = 0.03;
  NormalSettings normals;
  std::array<std::array<bool, 2>, Dim> mirrored{};  // sides that are symmetry planes
  std::array<std::array<bool, 2>, Dim> walled{};    // sides that are walls, which no point crosses
  // Where these stand at the start and the end of the step [m].
  std::array<std::array<double, 2>, Dim> wall_from{}, wall_to{};
  bool extras = false;  // stress and position sums are needed
  bool normals_needed = true;
  std::vector<double> stretch;  // of bodies at the start, the measure of their domains with CPDI; empty: all 1

  double stretch_of(int body) const { return stretch.empty() ? 1.0 : stretch[body]; }
  static TransferSettings make(const SolverOptions& solver, const ContactOptions& contact, const Vec<Dim>& gravity);
};

/// Highest speeds met, for the time step [m/s]; infinite where a point is inverted or not finite.
struct SpeedLimits {
  double wave = 0, point = 0;
  std::int64_t stopped = 0;  // times that a point was kept from crossing a wall
};

/// Domains of points for CPDI (grid/cpdi.hpp): half vectors half_size F e_j in cells, F from the body's stretch at the
/// start on; shortened along a direction in which they would reach further than half a cell.
template <int Dim>
AlignedDoubles domains_of(const Points<Dim>& points, double stretch, const Lattice<Dim>& lattice,
                          const TransferSettings<Dim>& settings);
inline std::ptrdiff_t domain_stride(int points) { return (points + lane_count - 1) / lane_count * lane_count; }

/// With CPDI, sets the domains of a piece's points. They hold for a whole step, in which F changes: `project` sets
/// them; whoever changes the order of points after it does so again.
template <int Dim>
void freeze_domains(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings);

/// Sets the node box of a piece to what its points touch. Comes before `project`.
template <int Dim>
void lay_out_nodes(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings);

/// points -> nodes: sums (mass, momentum, volume, gradient), force -sum V sigma . grad N + m g, and the extras
/// (eqs. 5-8).
template <int Dim>
void project(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings, double density);

/// points -> nodes: NodeStress, in the place of the sums. The piece has to be projected again before its next step.
template <int Dim>
void project_stress(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings);

/// nodes -> points: sum N s, where s is the mean stress at a node, from complete NodeStress (xx yy zz xy | xx yy zz xy
/// yz xz) [Pa]. What points differ by where the nodes see nothing of it is gone; a linear field stays as it is but
/// within a point's reach of a surface, where it is drawn to the mean of the material there.
template <int Dim>
std::vector<std::array<double, symmetric_size<Dim>>> smooth_stress(const Piece<Dim>& piece, const Lattice<Dim>& lattice,
                                                                   const TransferSettings<Dim>& settings);

/// nodes -> points: strain over `strain_dt` from the nodal velocity, deformation gradient and stress; then
/// x_p += dt sum N v with the velocity of the motion (eq. 10). Raises `speeds`.
template <int Dim>
void update_stress_and_move(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings,
                            const Law& law, double density, double strain_dt, double dt, SpeedLimits& speeds);

/// nodes -> points: strain over `dt` from the nodal velocity, deformation gradient and stress, and nothing else.
template <int Dim>
void update_stress(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings,
                   const Law& law, double density, double dt, SpeedLimits& speeds);

/// Points: deformation gradient and stress of a strain that is the same everywhere, F <- (1 + diag(strain)) F. Raises
/// `speeds.wave`.
template <int Dim>
void strain_alike(Piece<Dim>& piece, const Law& law, double density, const Vec<Dim>& strain, double dt,
                  SpeedLimits& speeds);

/// nodes -> points: strain over `dt`, deformation gradient and stress; points -> nodes: the force of the new stress, in
/// the same pass. Raises `speeds.wave`.
template <int Dim>
void update_stress_and_force(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings,
                             const Law& law, double density, double dt, SpeedLimits& speeds);

/// nodes -> points: v_p += dt sum N a (eq. 11, FLIP; blended with PIC), and spin likewise.
///
/// Spin (docs/spin.md): with lumped masses the velocity p/m of a turning body is that of the material near a node, not
/// at the node, and too slow at its surface. Points that carry an angular velocity w give the nodes
/// m N (v + w x arm), arm = node minus point, which is exact for rigid motion (as in APIC, Jiang et al. 2015); they
/// take it up as FLIP does, by the transpose of that sum, so that neither energy nor angular momentum is lost.
/// Returns the energy [J] that blending with PIC takes from the velocities and the nodes give to the spins.
template <int Dim>
double accelerate(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings, double density,
                  double dt);

/// As accelerate, then x_p += dt sum N v (eq. 10), in the same pass; raises `speeds.point`.
template <int Dim>
double accelerate_and_move(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings,
                           double density, double dt, SpeedLimits& speeds);

/// points -> nodes: momentum alone, at the positions of the last projection, into NodeBox::velocity [kg m/s].
template <int Dim>
void project_momentum(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings,
                      double density);

/// accelerate and project_momentum in one pass.
template <int Dim>
double accelerate_and_project(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings,
                              double density, double dt);

/// nodes: NodeMotion from sums and force: a = f/m, v = p/m + dt a (eq. 9).
template <int Dim>
void integrate(Piece<Dim>& piece, double dt);

/// nodes: velocity = p/m from the momentum in the sums.
template <int Dim>
void velocity_from_sums(Piece<Dim>& piece);
/// nodes: velocity = p/m where the velocity array holds momentum projected again.
template <int Dim>
void velocity_from_momentum(Piece<Dim>& piece);
/// nodes: the motion's velocity becomes the mean of itself and of that projected again. Points that move with it
/// keep their angular momentum to second order in dt.
template <int Dim>
void centre_motion(Piece<Dim>& piece);
/// nodes: the motion's velocity becomes that projected again.
template <int Dim>
void follow_projected(Piece<Dim>& piece);
/// nodes -> points: velocities and spins less what NodeBox::velocity [m/s] shows of them, the adjoint of how they gave
/// it momentum: v -= sum N u, w -= sum N arm x u / sum N arm^2.
template <int Dim>
void subtract_seen(Piece<Dim>& piece, const Lattice<Dim>& lattice, const TransferSettings<Dim>& settings);

/// nodes -> points: acceleration sum N a, velocity gradient sum v (x) grad N (row by row), of NodeMotion, for each
/// point.
template <int Dim>
std::vector<std::array<double, Dim + Dim * Dim>> point_kinematics(const Piece<Dim>& piece, const Lattice<Dim>& lattice,
                                                                  const TransferSettings<Dim>& settings);

/// nodes: velocity = that of the motion, after the momentum update.
template <int Dim>
void velocity_from_motion(Piece<Dim>& piece);

/// sum N (arm^2 - arm_s^2) of each point [m2]: mass times it is what a point's spin about axis s adds to the inertia of
/// the body. Zeros where points carry no spin.
template <int Dim>
std::vector<std::array<double, spin_size<Dim>>> spin_inertia(const Piece<Dim>& piece, const Lattice<Dim>& lattice,
                                                             const TransferSettings<Dim>& settings);

}  // namespace cairn
