#pragma once
/// The solver: the state of one rank and the step.

#include <functional>
#include <memory>
#include <optional>

#include "cairn/boundary/faces.hpp"
#include "cairn/contact/sweep.hpp"
#include "cairn/crack/faces.hpp"
#include "cairn/crack/j_integral.hpp"
#include "cairn/crack/traction.hpp"
#include "cairn/io/case.hpp"
#include "cairn/parallel/distribution.hpp"
#include "cairn/parallel/migration.hpp"
#include "cairn/parallel/node_exchange.hpp"
#include "cairn/solver/schedule.hpp"
#include "cairn/solver/simulation_state.hpp"
#include "cairn/solver/timers.hpp"
#include "cairn/transfer/transfer.hpp"

namespace cairn {

class Checkpoint;

/// The tools of a case; every rigid body learns which it belongs to.
std::vector<Tool> make_tools(const Case& c, std::vector<Body>& bodies);

template <int Dim>
class Simulation {
 public:
  /// Places the points of the case's bodies, or takes them from a checkpoint. Collective.
  /// \throws InputError on every rank for a body without points, a checkpoint that does not fit, or points for which
  /// this machine has too little memory
  Simulation(const Case& c, MPI_Comm comm, const Checkpoint* from = nullptr);

  /// Advances one step of at most `longest` seconds. Collective.
  /// \throws RunError on every rank, then or at the next call, when a point is lost, inverted or not finite, or the
  /// time step collapses
  void step(double longest);

  /// Waits for the speeds of the last step. Collective. \throws RunError on every rank where that step lost a point
  StepState step_state();
  /// Has every step ask `notice` what this rank tells the others.
  void ask(std::function<Notice()> notice) { ask_ = std::move(notice); }
  /// What the ranks told each other in the last step, the same on all of them. Collective; throws as step_state().
  Notice notice() {
    finish_speed_reduction();
    return {maxima_[3], maxima_[4]};
  }

  double time() const { return time_; }
  double dt() const { return dt_; }  // of the last step
  std::int64_t steps() const { return steps_; }
  std::int64_t total_points() const { return total_points_; }
  /// What set-up found that may not be meant; on rank 0.
  const std::vector<std::string>& warnings() const { return warnings_; }
  const Lattice<Dim>& lattice() const { return lattice_; }
  const TransferSettings<Dim>& transfer() const { return transfer_; }
  const std::vector<SolverMaterial>& materials() const { return materials_; }
  const std::vector<Body>& bodies() const { return bodies_; }
  const std::vector<Patch<Dim>>& patches() const { return patches_; }  // of this rank, ascending
  /// Likewise; points may be changed until the next step.
  std::vector<Patch<Dim>>& patches() {
    for (auto& patch : patches_)
      for (auto& piece : patch.pieces) piece.projected = false;
    return patches_;
  }
  const std::vector<Crack>& cracks() const { return cracks_; }
  /// Energy stored and dissipated by the law between the faces at a crack point [J].
  std::array<double, 2> energies_of(const CrackPoint<Dim>& point) const;
  const std::vector<Tool>& tools() const { return tools_; }
  /// Of faces those that hold something are tools.
  bool has_tool(int tool) const {
    if (tool >= tools_of_faces) return true;
    return tool < 2 * Dim &&
           (contact_.faces[tool].type == FaceType::wall || contact_.faces[tool].type == FaceType::fixed);
  }
  /// What bodies did to every tool so far and in the last step, summed in patch order; kept only where the case writes
  /// forces. Collective; the result is valid on rank 0.
  std::vector<ToolSum> tool_sums() const;
  /// What changes in a run of what every rank knows of cracks, Crack::state_size numbers for each.
  std::vector<double> crack_states() const;
  /// Bodies from which further ones were split off, in their order, and pairs of a crack and a body that it parted.
  const std::vector<double>& parts() const { return parts_; }
  std::vector<double> spared() const;
  /// The impulse on a tool since the start [N s], the same on every rank. Collective.
  std::vector<double> impulse_on(int tool) const;
  /// Of a face, between the other faces where they stand; in 2D for each metre of thickness [m2].
  double face_area(int face) const;
  /// From a face to the opposite one, where they stand [m].
  double face_distance(int face) const;
  /// Volume between the faces, where they stand [m^Dim].
  double room() const;
  /// Volume of all bodies over that between the faces. Collective.
  double packing_fraction() const;
  /// stress_of_points of all deformable bodies over room() [Pa]. Collective.
  std::array<double, 6> mean_stress() const;
  /// Has the steps from now on weigh forces for force_balance().
  void keep_balance(bool keep) { keep_balance_ = keep; }
  /// Of the last step, the same on every rank.
  const ForceBalance& force_balance() const { return balance_; }
  /// Where pouring stands: the next point's number, and for each [[insert]] how many of its bodies came, how often a
  /// place was drawn, and when the next body may come [s].
  std::vector<double> pouring() const;
  /// Goes on with what a stage changes: motions of tools, gravity, friction, damping, the length of steps, and what is
  /// kept for output. Collective.
  void change(const Case& c);
  /// Their states, tool_state_size numbers for each.
  std::vector<double> tool_states() const;
  const PatchTable<Dim>& table() const { return table_; }
  /// Patches that this rank computed so far, once for each stage between exchanges: empty ones are passed over.
  std::int64_t patches_computed() const { return patches_computed_; }
  MPI_Comm communicator() const { return comm_; }
  const StageTimers& timers() const { return timers_; }
  StageTimers& timers() { return timers_; }
  int times_balanced() const { return times_balanced_; }
  double seconds_balancing() const { return seconds_balancing_; }  // of this rank, while patches moved
  const Traffic& traffic() const { return messages_->traffic(); }
  /// What a step consists of, with what this rank sent for it so far.
  const std::vector<StepRound<Dim>>& schedule() const { return schedule_; }
  /// What this rank has to tell of points that were dropped since the last time, a line each.
  std::vector<std::string> take_notes() { return std::exchange(notes_, {}); }

  /// Forgets the contacts summed so far. They are kept only where the case writes grains or contacts.
  void clear_contacts() {
    for (auto& patch : patches_) patch.contacts.clear();
  }

  /// Gives every piece's nodes the complete NodeStress, until the next step, which it does not change. Collective; not
  /// after a step that failed.
  void project_stress();

  /// The tips of cracks, in 3D the points of their rims, ascending in (crack, end), the same on every rank. The nodes
  /// are projected anew. Collective; not after a step that failed.
  std::vector<TipState<Dim>> tip_states();

  /// Energies, momentum and ledger. Collective; the result is valid on rank 0.
  Totals totals() const;

  const SolverMaterial& material_of(const Piece<Dim>& piece) const { return materials_[bodies_[piece.body].material]; }
  bool is_rigid(const Piece<Dim>& piece) const { return bodies_[piece.body].rigid; }

 private:
  // A step is choose_time_step, the rounds of its scheme, and receive_points.
  static std::vector<StepRound<Dim>> schedule_of(StressUpdate update);
  /// The stages of a round, patch by patch, and what is sent after them.
  void carry_out(StepRound<Dim>& round);
  void choose_time_step(double longest);
  void filter_noise();  // communicates, every so many steps
  // The stages, of the p-th patch of this rank; (*) begins with the sums over patches that the exchange before it
  // brought.
  void project_points(std::size_t p, Patch<Dim>& patch);         // of pieces that `finish_points` could not
  void contact_before_update(std::size_t p, Patch<Dim>& patch);  // (*)
  void strain_first(std::size_t p, Patch<Dim>& patch);
  void complete_forces(std::size_t p, Patch<Dim>& patch);  // (*)
  void contact_after_update(std::size_t p, Patch<Dim>& patch);
  void accelerate_points(std::size_t p, Patch<Dim>& patch);
  void project_again(std::size_t p, Patch<Dim>& patch);  // (*)
  void finish_points(std::size_t p, Patch<Dim>& patch);
  void receive_points();      // communicates
  void exchange_tractions();  // communicates, where faces of cracks pull each other; before complete_forces
  void move_cracks();         // communicates, where there are any
  void receive_cracks();      // likewise

  // Between the stages: how tools move in the step (tools.cpp).
  void begin_tools();
  void push_tools();  // communicates where there are pistons or rotors
  void end_tools();
  void set_velocities_of_tools();
  void keep_what_is_asked(const Case& c);
  void aim_walls();
  void place_walls();
  void pull_by(const Vec3& gravity);

  // Bodies that come and go (pour.cpp).
  void define_pouring(const Case& c);
  void insert_bodies();  // communicates, where there are some to come
  void remove_bodies();  // likewise
  bool has_room(const Shape& shape) const;
  void place_body(int body, const Shape& shape);
  void restore_pouring(const std::vector<double>& state);

  // A periodic domain that deforms (deform.cpp).
  void deform();  // communicates, where a stress is asked for
  Vec<Dim> strain_rates();
  void deform_by(const Vec<Dim>& strain);
  void place_corner(const Vec<Dim>& upper);

  // What takes motion away, and what is left over of forces (damping.cpp).
  void weigh_forces(Patch<Dim>& patch);
  ForceBalance weigh_bodies() const;  // communicates
  void damp(Patch<Dim>& patch, Piece<Dim>& piece);
  void relax();  // communicates, where it is asked for
  void restore_tools(const std::vector<double>& states);
  /// Sums of this rank's patches over the tools that are wanted.
  template <class Wanted>
  std::vector<double> tool_records(Wanted&& wanted) const;

  void place_points(const Case& c);
  void restore(const Checkpoint& from);
  /// Makes the table of all patches, given those with points and others to keep, and this rank's patches, empty.
  void make_patches(const std::vector<PatchId>& filled, const std::vector<std::int64_t>& points,
                    const std::vector<PatchId>& kept);
  void connect_patches();       // after patches came or went
  void add_new_patches();       // communicates; around patches that points entered
  void forget_blank_patches();  // (*); those far from points
  void balance();               // (*)

  /// Computes every patch: first those among patches of this rank, while the messages of the exchange before travel.
  template <class F>
  void for_patches(F&& compute) {
    for (const bool beside_others : {false, true}) {
      if (beside_others) {
        const auto time = timers_.measure(Stage::exchange);
        exchange_->receive();
      }
      for (std::size_t p = 0; p < patches_.size(); ++p)
        if (beside_others_[p] == beside_others && !is_idle(p)) ++patches_computed_, compute(p, patches_[p]);
    }
  }
  /// Nothing is or comes there: nothing to do.
  bool is_idle(std::size_t p) {
    if (!patches_[p].pieces.empty() || !exchange_->is_quiet(p)) return false;
    patches_[p].forget_last_step();
    return true;
  }
  /// Notes the processor time that a patch takes.
  template <class F>
  void timed(std::size_t p, F&& f) {
    const bool empty = patches_[p].pieces.empty();
    const double start = empty ? 0.0 : processor_seconds();
    f(p, patches_[p]);
    if (!empty) patches_[p].seconds += processor_seconds() - start;
  }
  /// Computes every patch, and sends what it shares with its neighbours.
  template <class F>
  void exchange_after(F&& compute) {
    for_patches([&](std::size_t p, Patch<Dim>& patch) {
      timed(p, compute);
      const auto time = timers_.measure(Stage::exchange);
      exchange_->put(patch, p);
    });
    const auto time = timers_.measure(Stage::exchange);
    exchange_->start();
  }
  /// Computes every patch for the last time in a step, and sends the points that left it.
  template <class F>
  void migrate_after(F&& compute) {
    migration_->begin();
    for_patches([&](std::size_t p, Patch<Dim>&) { timed(p, compute); });
    const auto time = timers_.measure(Stage::migrate);
    migration_->start();
  }
  /// Then velocities and motions of nodes wait for an exchange; else they are lent to a patch while it is computed.
  bool projects_again() const {
    return solver_.stress_update == StressUpdate::both || solver_.stress_update == StressUpdate::modified_last;
  }
  /// Of a step, of each of its strains.
  double strain_share() const { return solver_.stress_update == StressUpdate::both ? 0.5 : 1.0; }
  void lay_out(Patch<Dim>& patch, Piece<Dim>& piece);
  void project_piece(Patch<Dim>& patch, Piece<Dim>& piece);
  void project_ahead(Patch<Dim>& patch, Piece<Dim>& piece);
  // solver/cracks.cpp
  void define_cracks(const Case& c);
  template <class F>
  void for_crack_points(const Case& c, F&& f) const;
  std::vector<PatchId> patches_of_cracks(const Case& c) const;  // that hold a point of a crack
  void place_cracks(const Case& c);
  void restore_cracks(const std::vector<double>& states);
  void find_cracks(Patch<Dim>& patch);  // their segments, where they are now
  void check_points_on_cracks(const Case& c);
  // solver/tractions.cpp
  void define_tractions(const Case& c);
  void check_bonds() const;  // after they were read
  void bind_faces(const Case& c);
  void find_tractions(std::size_t p);
  // solver/split.cpp
  void split_bodies();
  int add_part(int of);
  void spare_parted(const std::vector<int>& bodies);
  void tell_contact_of_cracks();
  void restore_parts(const std::vector<double>& parts, const std::vector<double>& spared);
  // solver/growth.cpp
  struct Advance;  // of a tip
  void grow_cracks();
  std::vector<Advance> find_advances();
  void meet_obstacles(std::vector<Advance>& advances);
  void advance(const Advance& to);
  // solver/rim_growth.cpp
  void grow_rims();
  std::vector<bool> find_material(const std::vector<int>& cracks, const std::vector<Vec<Dim>>& places);
  void follow_openings();
  // solver/tips.cpp
  std::vector<CrackTip<Dim>> own_tips(const Patch<Dim>& patch) const;
  std::vector<CrackTip<Dim>> find_tips() const;
  double find_motion();
  void add_face_terms(std::size_t p, const std::vector<CrackTip<Dim>>& tips, double dt,
                      std::vector<TipSums>& sums) const;
  void add_tip_terms(const Patch<Dim>& patch, const std::vector<CrackTip<Dim>>& tips, std::vector<TipSums>& sums) const;
  CrackSegments<Dim>& segments_of(const Patch<Dim>& patch) { return segments_[&patch - patches_.data()]; }
  CrackSurroundings<Dim> surroundings_of(const Patch<Dim>& patch) {
    return {patch, lattice_, segments_of(patch), cracks_, crack_densities_, solver_.stress_update};
  }
  void finish_piece(Patch<Dim>& patch, Piece<Dim>& piece);
  void turn_stress(Piece<Dim>& piece);
  void move_rigid(Piece<Dim>& piece);
  bool turns_rigidly(const Piece<Dim>& piece) const {
    return is_rigid(piece) && tools_[bodies_[piece.body].tool].turns();
  }
  /// Points of rigid bodies that turn always carry spin, so that nodes have exactly the body's motion.
  const TransferSettings<Dim>& transfer_of(const Piece<Dim>& piece) const {
    return turns_rigidly(piece) ? transfer_of_turning_ : transfer_;
  }
  void look_for_fault(const StepRound<Dim>& round, int urgency);
  /// Updates a piece by update(share of the step, speeds). Where lost points are dropped, those that it turned inside
  /// out are marked and put to rest, and the update is made once more for no time, for forces and speeds without them.
  template <class F>
  void update_guarded(Piece<Dim>& piece, F&& update) {
    const SpeedLimits before = speeds_;
    update(1.0, speeds_);
    if (solver_.lost_points == LostPoints::stop || (std::isfinite(speeds_.wave) && std::isfinite(speeds_.point)))
      return;
    mark_faults(piece);
    speeds_ = before;
    update(0.0, speeds_);
  }
  void mark_faults(Piece<Dim>& piece);
  void book_departures(Patch<Dim>& patch, const Piece<Dim>& piece, std::span<const Departure> departing);
  void start_speed_reduction();
  void finish_speed_reduction();

  MPI_Comm comm_;
  int rank_ = 0, ranks_ = 1;
  SolverOptions solver_;
  std::vector<StepRound<Dim>> schedule_;
  ParallelOptions parallel_;
  Time limits_;
  Lattice<Dim> lattice_;
  TransferSettings<Dim> transfer_, transfer_of_turning_;
  ContactSettings<Dim> contact_;
  std::vector<SolverMaterial> materials_;
  std::vector<Body> bodies_;
  std::vector<Tool> tools_;
  std::vector<int> moved_bodies_;  // of tools whose velocity changes
  bool pushed_tools_ = false;      // there are pistons or rotors
  Case pouring_;  // of the case, what placing a body asks for, and the bodies that come; elsewhere nothing
  struct Pouring {
    int placed = 0, drawn = 0;
    double next = 0;
  };
  std::vector<Pouring> poured_;  // of each [[insert]]
  int first_poured_ = 0;         // body
  std::int64_t next_id_ = 0;     // of points
  MotionTable gravity_;
  DampingOptions damping_;
  Deformation deformation_;
  Vec3 needed_rates_ = Vec3::Zero();   // StepState::needed_rates
  Vec<Dim> rates_ = Vec<Dim>::Zero();  // at which the domain deformed in the last step
  bool keep_balance_ = false;
  ForceBalance balance_;
  std::array<double, 2> kinetic_{};  // StepState::kinetic, the latest first
  std::vector<Patch<Dim>> patches_;
  PatchTable<Dim> table_;
  std::vector<bool> beside_others_;        // for each patch: a neighbour lives on another rank
  std::vector<ContactSweep<Dim>> sweeps_;  // for each patch
  std::vector<Crack> cracks_;
  std::vector<CrackSegments<Dim>> segments_;                      // for each patch
  std::vector<std::vector<FaceMotion<Dim>>> face_motions_;        // for each patch: of its neighbours' crack points
  std::vector<std::optional<TractionLaw>> traction_laws_;         // for each crack; empty where none has one
  std::vector<std::vector<RowForce<Dim>>> row_forces_;            // for each patch: of tractions
  double traction_dt_ = std::numeric_limits<double>::infinity();  // longest step for which they are stable [s]
  int split_every_ = 0;                                           // steps; 0: parts stay in their body
  std::vector<double> parts_;                                     // bodies that those behind the case's came from
  std::vector<GrowthSpec> growth_;                                // of each crack
  std::vector<Material> specs_;                                   // of materials, where there are cracks
  std::array<double, 2> j_radius_{};                              // [cells]
  std::vector<double> crack_densities_;                           // of bodies; 0 for rigid ones [kg/m3]
  std::unique_ptr<NeighbourExchange> messages_, traction_messages_;
  std::unique_ptr<NodeExchange<Dim>> exchange_;
  std::unique_ptr<Migration<Dim>> migration_;
  ArrayPool velocities_, motions_;  // of nodes, where nothing is projected again
  StageTimers timers_;

  double time_ = 0, dt_ = 0;
  std::int64_t steps_ = 0, total_points_ = 0;
  std::vector<std::string> warnings_;
  std::int64_t patches_computed_ = 0;
  std::size_t blank_before_ = 0;  // patches without points or history when they were last forgotten
  int times_balanced_ = 0, looks_to_skip_ = 0, looks_skipped_ = 0;
  double seconds_balancing_ = 0;
  SpeedLimits speeds_;  // of this rank, in the step under way
  static constexpr int speed_size = 6;
  MaximumReduction maxima_{speed_size};  // wave, point, failure, stop, wall, whether points entered new patches
  int fault_urgency_ = 0;                // of this rank's first fault: the earlier its stage in the step, the more
  std::string fault_;
  bool marked_ = false;             // points of this rank were marked as lost in the step under way
  std::vector<std::string> notes_;  // of points that were dropped
  std::function<Notice()> ask_;
};

}  // namespace cairn
