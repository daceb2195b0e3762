#pragma once
/// Good checkpoints, and ways to make them wrong.

#include <filesystem>
#include <random>
#include <string>

#include "../../src/solver/stage_keeper.hpp"
#include "cairn/solver/checkpoint.hpp"
#include "cairn/solver/simulation.hpp"

namespace cairn::fuzz {

/// The same numbers everywhere for a seed.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  /// A number below n > 0.
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(engine_() % n); }
  template <class T>
  const T& any(const std::vector<T>& all) {
    return all[below(all.size())];
  }

 private:
  std::mt19937_64 engine_;
};

/// A run that stopped in mid-contact, across patches and a periodic boundary.
template <int Dim>
struct Seed {
  Case spec;
  RunState state;
  std::filesystem::path file;  // the checkpoint
  std::string bytes;           // of it, its seal left out
  std::uint64_t digest = 0;
};
/// \param name  of a case in tests/fuzz/seeds; empty: one of materials and contact alone
template <int Dim>
Seed<Dim> make_seed(const std::filesystem::path& scratch, const std::string& name = {});

/// A simulation among the stages of its case, as a run has it.
template <int Dim>
struct Resumed {
  Case spec;  // as it is in the stage under way
  StageKeeper stages;
  Simulation<Dim> simulation;
  Resumed(const Case& c, const Checkpoint* from);
  void step();

 private:
  const Case& brought_up();
};

/// Checksum of all that a run goes on from.
template <int Dim>
std::uint64_t digest_of(const Resumed<Dim>& run, const RunState& state, const std::string& case_text);

/// What a form must lead to: an error; an error, or the state that was; anything but a crash.
enum class Expectation { refused, unchanged, any };

/// Writes the bytes to a file, edits one or two of its data sets and attributes, and seals it. Says what was done.
std::string edit_file(const std::string& bytes, const std::filesystem::path& file, Random& random);

/// Changes one thing of the state and writes it, with all checksums right. Says what was done.
template <int Dim>
std::string change_state(const Seed<Dim>& seed, const std::filesystem::path& file, Random& random,
                         Expectation& expected);

}  // namespace cairn::fuzz
