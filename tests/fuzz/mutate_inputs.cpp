// Case files, grain tables and specifications of packs, changed at random, go through what `cairn check` and
// `cairn pack` do. Whatever they hold, the answer is a result or an error of the input with a message: no crash, no
// hang, no more than 1 GiB.
//
//     mutate_inputs CASES SEEDS SCRATCH [COUNT [FIRST]]
//
// Input i depends on i alone: a failure of input i is repeated by COUNT = 1, FIRST = i. The last input is left in
// SCRATCH, with its number.

#include <fcntl.h>
#include <fmt/format.h>
#include <mpi.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "../../src/app/commands.hpp"
#include "../../src/app/report.hpp"
#include "cairn/body/pack.hpp"
#include "cairn/core/error.hpp"
#include "cairn/io/pack_spec.hpp"
#include "mutator.hpp"

#if defined(__SANITIZE_ADDRESS__)
constexpr bool sanitized = true;
#else
constexpr bool sanitized = false;
#endif

namespace cairn::fuzz {
namespace {

namespace fs = std::filesystem;

constexpr rlim_t most_memory = rlim_t{1} << 30;
constexpr double most_grains = 3e4;                  // of a pack that is made
constexpr unsigned patience = sanitized ? 300 : 60;  // seconds for one input
constexpr std::size_t most_rows = 40;                // of the grain tables that are changed
constexpr double effort = 1e-3;                      // of a pack

struct Text {
  std::string name, text;
};

std::vector<Text> read_all(const fs::path& folder, const std::string& ending) {
  std::vector<Text> all;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (!entry.is_regular_file() || entry.path().extension() != ending) continue;
    std::ostringstream text;
    text << std::ifstream(entry.path()).rdbuf();
    all.push_back({entry.path().filename().string(), text.str()});
  }
  std::ranges::sort(all, {}, &Text::name);
  return all;
}

/// What is changed.
struct Corpus {
  std::vector<Text> cases, packs, tables;
  std::vector<std::string> words, texts;

  Corpus(const fs::path& shipped, const fs::path& seeds) {
    const auto add = [](std::vector<Text>& to, std::vector<Text> more) {
      to.insert(to.end(), more.begin(), more.end());
    };
    add(cases, read_all(shipped, ".toml"));
    for (Text& t : read_all(shipped / "laboratory", ".toml")) {
      constexpr std::string_view up = "../";  // they lie a folder further down
      for (std::size_t at = t.text.find(up); at != std::string::npos; at = t.text.find(up)) t.text.erase(at, up.size());
      cases.push_back(std::move(t));
    }
    add(packs, read_all(shipped / "packs", ".toml"));
    for (Text& t : read_all(seeds, ".toml")) (t.name.starts_with("pack_") ? packs : cases).push_back(t);
    add(tables, read_all(shipped / "packs", ".csv"));
    add(tables, read_all(seeds, ".csv"));
    for (Text& table : tables) {  // large tables would only take time
      std::size_t end = 0;
      for (std::size_t row = 0; row < most_rows && end < table.text.size(); ++row)
        end = std::min(table.text.find('\n', end), table.text.size() - 1) + 1;
      table.text.resize(end);
    }
    for (const auto* all : {&cases, &packs, &tables})
      for (const Text& t : *all) {
        texts.push_back(t.text);
        for (auto& word : words_of(t.text)) words.push_back(std::move(word));
      }
    std::ranges::sort(words);
    words.erase(std::unique(words.begin(), words.end()), words.end());
  }
};

class Driver {
 public:
  Driver(const Corpus& corpus, const fs::path& scratch) : corpus_(corpus), scratch_(scratch) {
    fs::create_directories(scratch / "packs");
    for (const Text& table : corpus.tables) write("packs/" + table.name, table.text);
    report_ = fmt::format("{}/report.txt", scratch.string());
  }

  /// Exit codes seen, by code.
  std::size_t results[4] = {};

  bool try_input(std::uint64_t number) {
    Mutator mutator(number, corpus_.words, corpus_.texts);
    write("number.txt", std::to_string(number));  // says which, where the program is ended
    redirect();
    alarm(patience);
    const std::size_t kind = mutator.below(4);
    const std::string problem = kind == 0 ? try_pack(mutator) : kind == 1 ? try_table(mutator) : try_case(mutator);
    alarm(0);
    restore();
    if (!problem.empty()) fmt::print("input {}: {}\n", number, problem);
    return problem.empty();
  }

 private:
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(scratch_ / name, std::ios::binary) << text;
  }

  std::string try_case(Mutator& mutator) {
    write("case.toml", mutator.mutate(mutator.any(corpus_.cases).text));
    std::vector<Override> overrides;
    if (mutator.one_in(6))
      overrides.push_back({mutator.mutate(mutator.any(corpus_.words) + "." + mutator.any(corpus_.words)),
                           mutator.one_in(2) ? mutator.number() : mutator.mutate("[1.0, \"a\"]")});
    return check_case(overrides);
  }

  /// A table that some case reads.
  std::string try_table(Mutator& mutator) {
    const Text& table = mutator.any(corpus_.tables);
    std::string text;
    for (const Text& c : corpus_.cases)
      if (c.text.find(table.name) != std::string::npos && (text.empty() || mutator.one_in(2))) text = c.text;
    if (text.empty()) return fmt::format("no case reads {}", table.name);
    write("case.toml", text);
    write("packs/" + table.name, mutator.mutate(table.text));
    const std::string problem = check_case({});
    if (problem.empty()) write("packs/" + table.name, table.text);
    return problem;
  }

  std::string check_case(const std::vector<Override>& overrides) {
    const int code = app::command_check(scratch_ / "case.toml", overrides);
    ++results[code & 3];
    if (code != app::done && code != app::wrong_input) return fmt::format("exit code {}: {}", code, report());
    return code == app::wrong_input && report().find("error") == std::string::npos ? "no message" : "";
  }

  /// As command_pack, but that no pack is searched for long.
  std::string try_pack(Mutator& mutator) {
    write("spec.toml", mutator.mutate(mutator.any(corpus_.packs).text));
    const auto failure = app::attempt([&] {
      PackSpec spec = read_pack_spec(scratch_ / "spec.toml");
      spec.effort = std::min(spec.effort, effort);
      // A box that is far longer than its grains is no fault: it only takes long.
      const double largest = std::max({spec.sizes.max, spec.sizes.mean, 1e-300});
      double room = 1;  // in grains
      for (int d = 0; d < spec.dimension; ++d) room *= (spec.upper[d] - spec.lower[d]) / largest;
      if (spec.count == 0 && room > most_grains) throw InputError("too many grains for this test; not reached");
      write("pack.csv", pack_table(pack_grains(spec), spec));
    });
    ++results[failure ? failure->code & 3 : 0];
    if (!failure || failure->text.find("not reached") != std::string::npos) return "";
    if (failure->code != app::wrong_input) return fmt::format("exit code {}: {}", failure->code, failure->text);
    return failure->text.empty() ? "no message" : "";
  }

  /// What goes to the terminal goes into a file meanwhile.
  void redirect() {
    std::fflush(stdout), std::fflush(stderr);
    out_ = ::dup(1), err_ = ::dup(2);
    const int file = ::open(report_.c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_APPEND, 0600);
    const int nothing = ::open("/dev/null", O_WRONLY);
    ::dup2(nothing, 1), ::dup2(file, 2);
    ::close(file), ::close(nothing);
  }
  void restore() const {
    std::fflush(stdout), std::fflush(stderr);
    ::dup2(out_, 1), ::dup2(err_, 2);
    ::close(out_), ::close(err_);
  }
  std::string report() const {
    std::fflush(stderr);
    std::ostringstream text;
    text << std::ifstream(report_).rdbuf();
    return text.str();
  }

  const Corpus& corpus_;
  fs::path scratch_;
  std::string report_;
  int out_ = -1, err_ = -1;
};

/// Largest memory this process has held [bytes].
std::size_t peak_memory() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::size_t>(usage.ru_maxrss) * 1024;
}

/// The program under test refuses what needs more (ulimit -m); where it does not, the system does (ulimit -v), which
/// the sanitizer cannot bear.
void limit_memory() {
  const rlimit limit{most_memory, most_memory};
  setrlimit(RLIMIT_RSS, &limit);
  if (!sanitized) setrlimit(RLIMIT_AS, &limit);
}

int run(int argc, char** argv) {
  const std::uint64_t count = argc > 4 ? std::stoull(argv[4]) : 3000, first = argc > 5 ? std::stoull(argv[5]) : 0;
  const Corpus corpus(argv[1], argv[2]);
  Driver driver(corpus, argv[3]);
  std::size_t failures = 0;
  for (std::uint64_t i = first; i < first + count && failures < 10; ++i) failures += !driver.try_input(i);
  fmt::print("{} inputs: {} good, {} refused, {} packs not reached; {} failures; peak memory {} MiB\n", count,
             driver.results[0], driver.results[2], driver.results[3], failures, peak_memory() >> 20);
  const std::size_t slack = sanitized ? 3 : 1;  // the sanitizer's own memory
  if (peak_memory() > slack * most_memory) fmt::print("too much memory\n"), ++failures;
  return failures == 0 ? 0 : 1;
}

}  // namespace
}  // namespace cairn::fuzz

int main(int argc, char** argv) {
  if (argc < 4) {
    fmt::print("mutate_inputs CASES SEEDS SCRATCH [COUNT [FIRST]]\n");
    return 2;
  }
  MPI_Init(&argc, &argv);
  cairn::fuzz::limit_memory();
  const int code = cairn::fuzz::run(argc, argv);
  MPI_Finalize();
  return code;
}
