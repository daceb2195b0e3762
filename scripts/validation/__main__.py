"""Runs the validation suite; see `scripts/validate --help`."""

from __future__ import annotations

import argparse
import datetime
import os
import subprocess
import sys
import time
from pathlib import Path

from benchmarking.runner import environment
from validation import ROOT, problems, report
from validation.runs import Runner
from validation.suite import all_runs, evaluate, execute


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="scripts/validate", description="Runs the papers' problems and others with known answers, compares, "
        "prints one table and draws the pictures; exit code 1 when a band is missed.",
        epilog="docs/validation.md describes the problems. Runs are kept until the program or the case changes, so "
        "that a repeat is fast.")
    level = parser.add_mutually_exclusive_group()
    level.add_argument("--quick", action="store_true", help="the cheap runs (the default)")
    level.add_argument("--full", action="store_true", help="all runs, also with the papers' own forms of contact")
    parser.add_argument("--only", nargs="+", metavar="NAME", choices=problems.NAMES, default=list(problems.NAMES),
                        help="these problems only")
    parser.add_argument("--list", action="store_true", help="list the problems and their runs; run nothing")
    parser.add_argument("--ranks", type=int, default=1, metavar="N", help="MPI ranks of each run; default 1")
    parser.add_argument("--jobs", type=int, metavar="N", help="runs at a time; default: one for each core")
    parser.add_argument("--out", type=Path, default=ROOT / "results" / "validation", metavar="DIR",
                        help="runs, pictures, results.md and results.json; default %(default)s")
    parser.add_argument("--program", type=Path, default=ROOT / "build" / "release" / "bin" / "cairn", metavar="FILE",
                        help="the program; default %(default)s, built first")
    parser.add_argument("--page", type=Path, metavar="FILE", help="also write the tables between this page's marks")
    parser.add_argument("--known", type=Path, metavar="FILE", help="exit code 0 although bands are missed that this list "
                        "names, each as 'problem | case | quantity' on a line of its own; the tables still say NO")
    parser.add_argument("--fresh", action="store_true", help="make every run again")
    arguments = parser.parse_args()
    cores = len(os.sched_getaffinity(0))
    arguments.jobs = arguments.jobs or max(1, cores // arguments.ranks)
    return arguments


def show_list(chosen: list, full: bool) -> None:
    for problem in chosen:
        print(f"{problem.name}: {problem.title} ({problem.source})")
        for (_, form, label) in all_runs([problem], full):
            print(f"  {label}{f' [{form}]' if form else ''}")


def command(arguments: argparse.Namespace) -> str:
    """The options on which the results depend."""
    words = ["scripts/validate", "--full" if arguments.full else "--quick"]
    if arguments.only != list(problems.NAMES):
        words += ["--only", *arguments.only]
    return " ".join(words)


def unexpected(outcomes: list, known: Path | None) -> list[str]:
    """Missed bands that the list does not name, as "problem | case | quantity"."""
    lines = known.read_text().splitlines() if known else []
    listed = {line.strip() for line in lines if line.strip() and not line.startswith("#")}
    missed = [f"{outcome.problem.name} | {check.case} | {check.quantity}"
              for outcome in outcomes for check in outcome.checks if not check.passed]
    return [line for line in missed if line not in listed]


def main() -> int:
    arguments = parse_arguments()
    chosen = problems.load(arguments.only)
    if arguments.list:
        show_list(chosen, arguments.full)
        return 0
    if not arguments.program.is_file():
        print(f"validate: there is no {arguments.program}; build first: scripts/build", file=sys.stderr)
        return 2
    start = time.monotonic()
    runner = Runner(arguments.program, arguments.out, arguments.ranks, arguments.fresh)
    runs = all_runs(chosen, arguments.full)
    folders, errors, processor = execute(runner, runs, arguments.jobs, lambda line: print(line, flush=True))
    outcomes = [evaluate(problem, folders, errors, arguments.out / "pictures") for problem in chosen]
    version = subprocess.run([arguments.program, "--version"], capture_output=True, text=True, check=False,
                             env=environment(1)).stdout.splitlines()
    about = {"command": command(arguments), "wall": time.monotonic() - start, "processor": processor,
             "runs": len(runs), "date": datetime.date.today().isoformat(),
             "program": version[0] if version else "unknown program", "program_sha256": runner.identity}
    report.write(outcomes, about, arguments.out, arguments.page)
    print("\n" + report.text(outcomes))
    for message in errors.values():
        print(f"\n{message}", file=sys.stderr)
    print(f"Tables: {arguments.out}/results.md, results.json; pictures: {arguments.out}/pictures")
    return 1 if unexpected(outcomes, arguments.known) else 0


if __name__ == "__main__":
    sys.exit(main())
