// Checkpoints forged at random: data sets and attributes are edited and the file is sealed again (an unknowing forger,
// whose edits the inner checksums must tell), or a state is changed in memory and written with all checksums right (a
// knowing one, whom only the checks of what is read can stop). Then the run goes on from the file. Whatever it holds,
// the answer is an error of the input with a message, or the run goes on from the same state as before: no crash, no
// hang, nothing wrong accepted.
//
//     forge_checkpoints SCRATCH [COUNT [FIRST]]
//
// Form i depends on i alone: a failure of form i is repeated by COUNT = 1, FIRST = i. The last form is left in SCRATCH.

#include <fmt/format.h>
#include <mpi.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>

#include "cairn/core/error.hpp"
#include "cairn/io/case_changes.hpp"
#include "forger.hpp"

#if defined(__SANITIZE_ADDRESS__)
constexpr unsigned patience = 300;  // seconds for one form
#else
constexpr unsigned patience = 60;
#endif

namespace cairn::fuzz {
namespace {

namespace fs = std::filesystem;

/// What became of the forms.
struct Tally {
  std::int64_t refused = 0, unchanged = 0, harmless = 0, failed_later = 0;
};

/// Goes on from a file as a run does; returns what is wrong with that, empty if nothing.
template <int Dim>
std::string try_form(const Seed<Dim>& seed, const fs::path& file, Expectation expected, Tally& tally) {
  std::uint64_t digest = 0;
  try {
    const Checkpoint checkpoint(file, MPI_COMM_SELF);
    case_changes(checkpoint.case_text(), seed.spec.resolved);
    Resumed<Dim> run(seed.spec, &checkpoint);
    digest = digest_of(run, checkpoint.state(), checkpoint.case_text());
    const bool same = digest == seed.digest;
    if (!same && expected != Expectation::any)
      return expected == Expectation::refused ? "a wrong state was accepted" : "another state was accepted";
    ++(same ? tally.unchanged : tally.harmless);
    try {
      for (int i = 0; i < 3; ++i) run.step();
    } catch (const RunError&) {
      ++tally.failed_later;
    }
  } catch (const InputError& error) {
    ++tally.refused;
    return std::string_view(error.what()).empty() ? "refused without a message" : "";
  }
  return {};
}

template <int Dim>
std::string run_form(const Seed<Dim>& seed, std::uint64_t number, const fs::path& scratch, Tally& tally) {
  Random random(number);
  const fs::path file = scratch / "checkpoint_000001.h5";
  Expectation expected = Expectation::unchanged;
  std::string what;
  if (random.below(3) > 0) {
    what = edit_file(seed.bytes, file, random);
  } else {
    what = change_state(seed, file, random, expected);
  }
  const std::string problem = try_form(seed, file, expected, tally);
  return problem.empty() ? "" : fmt::format("{}: {}: {}", seed.file.stem().string(), what, problem);
}

int run(const fs::path& scratch, std::uint64_t count, std::uint64_t first) {
  fs::create_directories(scratch);
  // Materials and contact; cracks; stages, bodies that come and go, tools.
  const Seed<2> seeds_2[] = {make_seed<2>(scratch), make_seed<2>(scratch, "forge_cracks"),
                             make_seed<2>(scratch, "forge_stages_2d")};
  const Seed<3> seeds_3[] = {make_seed<3>(scratch), make_seed<3>(scratch, "forge_stages_3d")};
  Tally tally;
  std::uint64_t failures = 0;
  for (std::uint64_t number = first; number < first + count; ++number) {
    std::FILE* note = std::fopen((scratch / "number.txt").c_str(), "w");  // says which, where the program is ended
    fmt::print(note, "{}\n", number);
    std::fclose(note);
    alarm(patience);
    std::string problem;
    try {
      const std::size_t seed = number % 6;  // those with cracks twice as often
      problem = seed < 2   ? run_form(seeds_3[seed], number, scratch, tally)
                : seed < 5 ? run_form(seeds_2[seed - 2], number, scratch, tally)
                           : run_form(seeds_2[1], number, scratch, tally);
    } catch (const std::exception& error) {
      problem = fmt::format("ended with an error of another kind: {}", error.what());
    }
    alarm(0);
    if (problem.empty()) continue;
    ++failures;
    fmt::print("form {}: {}\n", number, problem);
  }
  fmt::print(
      "{} forms: {} refused, {} left the state as it was, {} changed it within what a state may be, {} failed in the "
      "steps that followed; {} problems\n",
      count, tally.refused, tally.unchanged, tally.harmless, tally.failed_later, failures);
  return failures == 0 ? 0 : 1;
}

}  // namespace
}  // namespace cairn::fuzz

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  MPI_Init(&argc, &argv);
  const auto number = [&](int i, std::uint64_t otherwise) { return argc > i ? std::stoull(argv[i]) : otherwise; };
  const int code = cairn::fuzz::run(argv[1], number(2, 400), number(3, 0));
  MPI_Finalize();
  return code;
}
