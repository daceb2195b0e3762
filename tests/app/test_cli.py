"""The command line as users and scripts meet it: exit codes, the last line, versions, overrides, folders, failures.

    test_cli.py CAIRN SCRATCH
"""

import concurrent.futures
import os
import re
import resource
import shutil
import subprocess
import sys
import time
from pathlib import Path

from harness import PATIENCE, ROOT, Program, expect, expect_code, fresh_folder, sets

DISKS = ROOT / "cases" / "two_disks.toml"
SHEAR = ROOT / "cases" / "shear_small.toml"
NUMBER = r"-?(?:\d+(?:\.\d*)?(?:e[+-]?\d+)?)"
DONE = re.compile(rf"done steps=(?P<steps>\d+) points=(?P<points>\d+) time=(?P<time>{NUMBER}) wall=(?P<wall>{NUMBER}) "
                  rf"step_wall=(?P<step_wall>{NUMBER}) point_steps_per_s=(?P<rate>{NUMBER}) "
                  rf"energy_error=(?P<error>{NUMBER}) ranks=(?P<ranks>\d+)")
PROGRESS = re.compile(rf" *{NUMBER} %  t {NUMBER} s  step \d+  dt {NUMBER} s  \d+ points  "
                      rf"{NUMBER} M point-steps/s/rank  energy error {NUMBER}  left \S+")
ALL_OUTPUTS = {"output.particles": "{ every = 2 }", "output.grains": "{ every = 2 }",
               "output.contacts": "{ every = 2 }", "output.track": "[0]"}
FAST = {"bodies.1.velocity": "[20.0, 0.0]", "output.history": "{ every = 1 }",
        "boundary.right": '{ type = "free", leaving = "stop" }'}  # ends at the right face


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_version_and_help(cairn: Program, here: Path):
    for ranks in (1, 2):
        done = cairn("--version", ranks=ranks, cwd=here)
        expect_code(done, 0)
        lines = done.out.splitlines()
        expect(re.fullmatch(r"cairn \d+\.\d+\.\d+", lines[0]), done.out)
        fields = dict(re.split(r"  +", line, maxsplit=1) for line in lines[1:])
        expect(list(fields) == ["commit", "compiler", "MPI", "HDF5", "METIS", "instruction set"], done.out)
        expect(all(fields.values()) and re.fullmatch(r"\d+\.\d+\.\d+", fields["HDF5"]), done.out)
    done = cairn("--help", cwd=here)
    expect_code(done, 0)
    for command in ("run", "check", "info", "pack"):
        expect(re.search(rf"^ +{command} ", done.out, re.MULTILINE), done.out)
    expect(names(here) == [], "something was created")


def test_last_line(cairn: Program, here: Path):
    for ranks in (1, 2):
        done = cairn("run", DISKS, "--out", f"out{ranks}", *sets({"time.steps": 7}), ranks=ranks, cwd=here)
        expect_code(done, 0)
        found = DONE.fullmatch(done.last)
        expect(found, done.last)
        expect((found["steps"], found["ranks"]) == ("7", str(ranks)), done.last)
        rows = (here / f"out{ranks}" / "history.csv").read_text().splitlines()
        expect(rows[-1].split(",")[1] == found["time"], "the time differs from that in history.csv")
        expect(0 < float(found["step_wall"]) <= float(found["wall"]), done.last)
        rate = 7 * int(found["points"]) / float(found["step_wall"])
        expect(abs(float(found["rate"]) / rate - 1) < 0.5, f"{done.last}: not {rate}")  # the wall time is rounded


def test_check(cairn: Program, here: Path):
    before = names(DISKS.parent)
    done = cairn("check", DISKS, cwd=here)
    expect_code(done, 0)
    expect(f"{DISKS}: ok" in done.out and "cells      50 x 50" in done.out, done.out)
    done = cairn("check", DISKS, *sets({"domain.cells": "[30, 40]"}), cwd=here)
    expect_code(done, 0)
    expect("cells      30 x 40" in done.out, done.out)
    expect_code(cairn("check", DISKS, *sets({"time.end": -1}), cwd=here), 2, "--set time.end: -1", "greater than 0")
    expect_code(cairn("check", DISKS, "--set", "time.end", cwd=here), 2, "--set time.end", "KEY=VALUE")
    expect(names(here) == [] and names(DISKS.parent) == before, "check created something")


def test_set_forms(cairn: Program, here: Path):
    """Dotted keys, entries of arrays, inline tables; a later one wins over an earlier one."""
    values = {"time.steps": 3, "output.history": "{ every = 1 }", "bodies.1.velocity": "[0.0, 0.5]",
              "contact": '{ law = "frictionless", pair = [{ materials = ["soft", "soft"], friction = 0.5 }] }',
              "contact.fill": 0.25, "parallel.partition": "round_robin", "solver.shape": '"linear"', "title": '"a = b"'}
    done = cairn("run", DISKS, "--out", "out", *sets(values), "--set=time.steps=4", cwd=here)
    expect_code(done, 0)
    expect(" steps=4 " in done.last, done.last)
    expect(len((here / "out" / "history.csv").read_text().splitlines()) == 6, "not one row for each step")
    resolved = (here / "out" / "case.toml").read_text()
    for text in ('title = "a = b"', "steps = 4", "velocity = [0.0, 0.5]", 'law = "frictionless"', "fill = 0.25",
                 "friction = 0.5", 'partition = "round_robin"', 'shape = "linear"', "history = { every = 1 }"):
        expect(text in resolved, f"'{text}' is not in the resolved case:\n{resolved}")


def test_default_folder(cairn: Program, here: Path):
    (here / "two.disks.toml").write_text(DISKS.read_text())
    expect_code(cairn("run", "two.disks.toml", *sets({"time.steps": 1}), cwd=here), 0)
    expect(names(here) == ["two.disks", "two.disks.toml"], names(here))
    expect(set(names(here / "two.disks")) >= {"case.toml", "history.csv", "bodies.csv"}, names(here / "two.disks"))


def test_info(cairn: Program, here: Path):
    expect_code(cairn("run", SHEAR, "--out", "out", *sets(ALL_OUTPUTS | {"time.steps": 4}), cwd=here), 0)
    kinds = {"particles_000002.vtkhdf": ("material points", "velocity", "stress", "position"),
             "grains_000002.h5": ("bodies", "centre", "angular_velocity", "contact_count"),
             "contacts_000002.h5": ("contacts", "body_a", "normal", "force")}
    for file, words in kinds.items():
        done = cairn("info", here / "out" / file, cwd=here)
        expect_code(done, 0)
        expect(re.search(rf"^time {NUMBER} s, step 4, \d+ rows$", done.out, re.MULTILINE), done.out)
        for word in words:
            expect(word in done.out, f"{file}: '{word}' is not in\n{done.out}")
    expect_code(cairn("info", here / "out" / "history.csv", cwd=here), 2, "history.csv")
    cut = here / "cut.h5"
    cut.write_bytes((here / "out" / "grains_000002.h5").read_bytes()[:-1000])
    expect_code(cairn("info", cut, cwd=here), 2, "cut.h5")


def test_progress_into_a_file(cairn: Program, here: Path):
    with open(here / "log", "w") as log:
        done = subprocess.run(cairn.command("run", DISKS, "--out", "out", *sets({"time.steps": 200})), cwd=here,
                              stdout=log, stderr=subprocess.STDOUT, timeout=120 * PATIENCE, check=False)
    text = (here / "log").read_text()
    lines = text.splitlines()
    expect(done.returncode == 0 and DONE.fullmatch(lines[-1]), text)
    shown = [line for line in lines if PROGRESS.fullmatch(line)]
    seconds = float(DONE.fullmatch(lines[-1])["wall"])
    expect(1 <= len(shown) <= 1 + seconds / 10, f"{len(shown)} lines in {seconds} s:\n{text}")
    expect("\r" not in text and "\x1b" not in text, "a file got a terminal's control characters")


def test_overwrite(cairn: Program, here: Path):
    out, few = here / "out", sets({"time.steps": 2})
    out.mkdir()
    (out / "notes.txt").write_text("mine\n")
    run = ("run", DISKS, "--out", "out")
    expect_code(cairn(*run, *sets(ALL_OUTPUTS), *few, cwd=here), 0)  # the notes are no result
    shutil.copy(out / "grains_000000.h5", out / "checkpoint_000009.h5")  # of an earlier run
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    for ranks in (1, 2):
        done = cairn(*run, *few, ranks=ranks, cwd=here)
        expect_code(done, 2, "--out: out: holds results", "another folder", "--overwrite")
        expect_code(cairn(*run, *few, "--overwrite", *sets({"time.end": -1}), ranks=ranks, cwd=here), 2, "time.end")
        tiny = sets({"bodies.0.shape.radius": 1e-5})  # found out only when the points are made
        expect_code(cairn(*run, *few, "--overwrite", *tiny, ranks=ranks, cwd=here), 2, "no material point")
        expect(before == {path.name: path.read_bytes() for path in out.iterdir()}, "a refused run changed results")
    expect_code(cairn(*run, "--overwrite", "--restart", "latest", cwd=here), 2, "--overwrite", "--restart")
    earlier = (out / "grains_000000.h5").read_bytes()
    for ranks in (1, 2):
        (out / "grains_000077.h5").write_bytes(earlier)
        plain = {"output.particles": "{}", "output.track": "[]"}
        expect_code(cairn(*run, *few, "--overwrite", *sets(plain), ranks=ranks, cwd=here), 0)
        expect(names(out) == ["case.toml", "history.csv", "notes.txt", "run.json"], names(out))
    expect((out / "notes.txt").read_text() == "mine\n", "a file that is no result was changed")


def test_point_leaves(cairn: Program, here: Path):
    """The run fails with one report, the same on any number of ranks; what was written stays readable."""
    reports = []
    for ranks in (1, 2, 3):
        settings = sets(FAST | {"domain.patch_cells": 8})
        done = cairn("run", DISKS, "--out", f"out{ranks}", *settings, ranks=ranks, cwd=here, timeout=60)
        expect_code(done, 3)
        found = re.fullmatch(r"cairn failed: step (\d+): point \d+ of body 1 left the domain: x = \S+ m, .*", done.err)
        expect(found, done.err)
        reports.append(done.err)
        rows = (here / f"out{ranks}" / "history.csv").read_text().splitlines()
        expect(len(rows) == int(found[1]) + 1, f"{len(rows)} lines in history.csv; {done.err}")
        expect(rows[-1].count(",") == rows[0].count(","), "the last line of history.csv is not whole")
        for file in (here / f"out{ranks}").glob("*.vtkhdf"):
            expect_code(cairn("info", file, cwd=here), 0)
    expect(len(set(reports)) == 1, "\n".join(reports))


def test_folder_not_writable(cairn: Program, here: Path):
    if os.geteuid() != 0:
        (here / "closed").mkdir(mode=0o555)
        expect_code(cairn("run", DISKS, "--out", "closed", cwd=here), 2, "closed", "cannot be written to")
        return
    for ranks in (1, 2):  # root may write everywhere, but nobody can make a file there
        done = cairn("run", DISKS, "--out", "/proc", *sets({"time.steps": 1}), ranks=ranks, cwd=here, timeout=60)
        expect(done.code in (2, 3) and "/proc" in done.err, f"exit code {done.code}\n{done.err}")
    expect(names(here) == [], "something was created")


def test_file_size_limit(cairn: Program, here: Path):
    """A file that cannot grow is reported; the signal does not end the program."""
    large = {"time.steps": 3, "domain.cells": "[250, 250]", "solver.points_per_cell": 9}
    limit = 8 << 20  # above what MPI itself needs, below the size of the first file
    for ranks in (1, 2):
        done = cairn("run", DISKS, "--out", f"out{ranks}", *sets(large), ranks=ranks, cwd=here, timeout=60,
                     preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
        expect_code(done, 3, "particles_000000.vtkhdf", "File too large")
        expect(not list((here / f"out{ranks}").glob("*particles*")), "an unfinished file was left behind")


def test_reader_goes_away(cairn: Program, here: Path):
    """Nobody reads what the run says: it goes on to its end all the same."""
    without_buffer = ["stdbuf", "-o0"] if shutil.which("stdbuf") else []  # as some MPIs have it
    for name, target, before in (("pipe", None, []), ("full", "/dev/full", []), ("raw", None, without_buffer)):
        end = os.open(target, os.O_WRONLY) if target else closed_pipe()
        done = subprocess.run(before + cairn.command("run", DISKS, "--out", name, *sets({"time.steps": 20})), cwd=here,
                              stdout=end, stderr=subprocess.PIPE, timeout=60 * PATIENCE, check=False)
        os.close(end)
        expect(done.returncode >= 0, f"{name}: ended by signal {-done.returncode}")
        rows = (here / name / "history.csv").read_text().splitlines()
        expect(rows[-1].startswith("20,"), f"{name}: the history ends with {rows[-1]}")


def closed_pipe() -> int:
    """The writing end of a pipe that nobody reads."""
    reading, writing = os.pipe()
    os.close(reading)
    return writing


def main() -> int:
    cairn, scratch = Program(sys.argv[1]), fresh_folder(sys.argv[2])
    tests = {name: function for name, function in globals().items() if name.startswith("test_")}
    start = time.monotonic()

    def attempt(item):
        name, function = item
        here = scratch / name
        here.mkdir()
        try:
            function(cairn, here)
        except AssertionError as failure:
            return f"{name}: {failure}"
        return None

    with concurrent.futures.ThreadPoolExecutor(4) as pool:
        failures = [failure for failure in pool.map(attempt, tests.items()) if failure]
    print("\n".join(failures))
    print(f"{len(tests)} tests, {len(failures)} failed, {time.monotonic() - start:.0f} s")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
