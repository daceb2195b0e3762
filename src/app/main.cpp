// The command line: parses the arguments and calls the command.

#include <fmt/format.h>
#include <mpi.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <iostream>
#include <sstream>

#include "cairn/core/error.hpp"
#include "cairn/io/program_facts.hpp"
#include "commands.hpp"
#include "installed.hpp"
#include "report.hpp"

namespace cairn::app {
namespace {

struct Arguments {
  std::filesystem::path file;
  RunArguments run;
  PackArguments pack;
  std::vector<std::string> sets;
  std::string pattern;
};

constexpr const char* exit_codes =
    "Exit codes: 0 done; 2 the input is wrong; 3 the run failed; 4 stopped by a signal after a checkpoint";

/// "KEY=VALUE" to its parts. \throws CLI::ValidationError
Override parse_override(const std::string& text) {
  const auto equals = text.find('=');
  if (equals == std::string::npos || equals == 0)
    throw CLI::ValidationError("--set " + text, "not of the form KEY=VALUE, such as --set time.steps=100");
  return {text.substr(0, equals), text.substr(equals + 1)};
}

/// Adds --set; parse_override serves its values.
void add_sets(CLI::App* command, Arguments& a) {
  command
      ->add_option(
          "--set", a.sets,
          "KEY=VALUE: override a key by its dotted path; VALUE is TOML, a word needs no quotes; may be repeated")
      ->allow_extra_args(false);
}

/// Defines the commands; `command` will hold the one to call.
void define(CLI::App& app, Arguments& a, std::function<int()>& command) {
  app.require_subcommand(1);
  app.set_version_flag("--version", version_text);
  const std::string pages = manual();
  app.footer(fmt::format("{}\nManual: {}", exit_codes, pages.empty() ? "README.md and docs of the source" : pages));

  CLI::App* run = app.add_subcommand("run", "Run a case");
  run->add_option("CASE.toml", a.file, "the case file")->required();
  run->add_option("--out", a.run.out, "folder of the results; default: the case file's name");
  add_sets(run, a);
  run->add_option("--restart", a.run.restart,
                  "go on from a checkpoint FILE, or from the 'latest' in the folder of the results");
  run->add_flag("--allow-changes", a.run.allow_changes, "with --restart: go on although the case has changed");
  run->add_flag("--overwrite", a.run.overwrite, "remove the results that the folder already holds");
  run->add_flag("--profile", a.run.profile, "report where the time went");
  run->add_flag("--explain", a.run.explain, "print what a step of this case consists of, and write nothing");
  run->callback([&] {
    for (const auto& text : a.sets) a.run.overrides.push_back(parse_override(text));
    a.run.file = a.file;
    command = [&a] { return command_run(a.run); };
  });

  CLI::App* check = app.add_subcommand("check", "Report every error of a case file; creates nothing");
  check->add_option("CASE.toml", a.file, "the case file")->required();
  add_sets(check, a);
  check->callback([&] {
    for (const auto& text : a.sets) a.run.overrides.push_back(parse_override(text));
    command = [&a] { return command_check(a.file, a.run.overrides); };
  });

  CLI::App* info = app.add_subcommand("info", "Say what a result or checkpoint holds");
  info->add_option("FILE.h5", a.file, "the file")->required();
  info->callback([&] { command = [&a] { return command_info(a.file); }; });

  CLI::App* pack = app.add_subcommand("pack", "Make a dense packing of grains");
  pack->add_option("SPEC.toml", a.pack.spec, "the specification")->required();
  pack->add_option("-o", a.pack.out, "the grain table to write")->required();
  pack->callback([&] { command = [&a] { return command_pack(a.pack); }; });

  CLI::App* init = app.add_subcommand("init", "Write a commented first case");
  init->add_option("CASE.toml", a.file, "the file to write; default: first.toml");
  init->callback([&] { command = [&a] { return command_init(a.file.empty() ? "first.toml" : a.file); }; });

  CLI::App* keys = app.add_subcommand("keys", "Explain the keys of a case file");
  keys->add_option("PATTERN", a.pattern, "a part of a key, or a word of its explanation; default: list all keys");
  keys->callback([&] { command = [&a] { return command_keys(a.pattern); }; });

  // become_tool has started these; here they are for the help.
  for (const Tool& tool : tools()) app.add_subcommand(tool.name, tool.purpose);
}

int dispatch(int argc, char** argv) {
  if (const std::string reason = program_disagreement(MPI_COMM_WORLD); !reason.empty())
    return on_first_rank([&] { throw InputError(reason); });
  CLI::App app("Cairn: Material Point Method for many bodies in frictional contact", "cairn");
  Arguments arguments;
  arguments.run.program = argv[0];
  std::function<int()> command;
  define(app, arguments, command);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    std::ostringstream out, err;
    const int code = app.exit(error, out, err);
    if (rank() == 0) {
      std::cout << out.str() << std::flush;
      std::cerr << err.str() << std::flush;
    }
    return code == 0 ? done : wrong_input;
  }
  return command();
}

}  // namespace

std::string version_text() {
  const ProgramFacts& f = program_facts();
  std::string text = "cairn " + f.version;
  for (const auto& [name, value] : {std::pair("commit", &f.commit),
                                    {"compiler", &f.compiler},
                                    {"MPI", &f.mpi},
                                    {"HDF5", &f.hdf5},
                                    {"METIS", &f.metis},
                                    {"instruction set", &f.instruction_set}})
    text += fmt::format("\n{:<15}  {}", name, *value);
  return text;
}

}  // namespace cairn::app

int main(int argc, char** argv) {
  // A file at its size limit and a reader that went away are errors of the call that writes, not the program's end.
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
  cairn::app::become_tool(argc, argv);
  MPI_Init(&argc, &argv);
  cairn::app::prepare_for_failures();
  int code = cairn::app::done;
  const auto failure = cairn::app::attempt([&] { code = cairn::app::dispatch(argc, argv); });
  if (failure) code = cairn::app::settle(failure);
  MPI_Finalize();
  return code;
}
