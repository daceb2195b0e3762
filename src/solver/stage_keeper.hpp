#pragma once
/// Where a run stands among its stages, and whether one ends.

#include "cairn/solver/run_state.hpp"

namespace cairn {

/// Puts what a stage changes into a case. A motion that it gives anew counts its time from `since` [s].
void apply_stage(Case& c, const RunStage& stage, double since);

class StageKeeper {
 public:
  /// \param from  of a checkpoint, or null
  /// \throws InputError where it is no state of the case's stages
  StageKeeper(const Case& c, const RunState* from);

  /// The stage under way; 0 where the case has none.
  int stage() const { return stage_; }
  /// Makes the case as it is in the stage under way.
  void bring_up(Case& c) const;
  /// Time up to which the next step may go at most [s].
  double end() const;
  /// Whether the next step's forces have to be weighed.
  bool weighs(std::int64_t next_step) const;
  std::vector<double> state() const;

  /// What has ended with the last step: nothing, or why. Collective, the same on every rank.
  template <int Dim>
  std::string ended(const Simulation<Dim>& simulation);
  /// Whether it was the run, not a stage before the last.
  bool run_ended() const { return run_ended_; }
  /// Begins the next stage.
  void begin_next(double time);
  /// Notes from where strains count.
  template <int Dim>
  void note_start(const Simulation<Dim>& simulation);

 private:
  /// What has to be remembered of one set of conditions.
  struct Look {
    double since = 0;                          // of the stage [s]
    double time = 0;                           // of the last look [s]
    double rests = 0;                          // looks in a row at which all was at rest
    std::array<double, 3> impulse{}, place{};  // of the tool then, and when the stage began
    double length = 0;                         // of the face from the opposite one when the stage began [m]

    bool may_be_at(double now) const { return since >= 0 && since <= time && time <= now && rests >= 0; }
  };
  static constexpr int look_size = 10;
  template <int Dim>
  std::string met(const Until& until, Look& look, const Simulation<Dim>& simulation);
  template <int Dim>
  std::string domain_met(const Until& until, const Look& look, const Simulation<Dim>& simulation);
  template <int Dim>
  std::string force_met(const Until& until, Look& look, const Simulation<Dim>& simulation, int tool);
  const Until* of_stage() const { return case_.stages.empty() ? nullptr : &case_.stages[stage_].until; }

  const Case& case_;
  int stage_ = 0;
  bool run_ended_ = false, noted_ = false;
  std::vector<double> begun_;  // when each stage but the first began [s]
  Look of_run_, of_stage_;
};

}  // namespace cairn
