"""What a newcomer meets beside `run`: --version, --help, init, keys, the scripts as commands; and run.json.

    test_commands.py CAIRN SCRATCH
"""

import datetime
import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

from harness import ROOT, Program, expect, fresh_folder, sets

DISKS = ROOT / "cases" / "two_disks.toml"
FEW = {"time.steps": 6, "output.history": "{ every = 1 }", "output.checkpoint": "{ every = 3 }",
       "output.particles": "{ every = 3 }"}

FAILING = {"bodies.0.angular_velocity": 5.0, "solver.energy_limit": 1e-15}  # turning gives it some error


def expect_code(done, code: int, *words):
    expect(done.code == code, f"exit code {done.code} instead of {code}\n{done.out}\n{done.err}")
    for word in words:
        expect(word in done.out + done.err, f"'{word}' was not said:\n{done.out}\n{done.err}")


def runs(folder: Path) -> list[dict]:
    return json.loads((folder / "run.json").read_text())["runs"]


def facts(cairn: Program) -> dict:
    """What --version says, by name."""
    return dict(re.split(r"  +", line, maxsplit=1) for line in cairn("--version").out.splitlines()[1:])


def test_commit(cairn: Program, here: Path):
    """--version names the commit of the source that was built, where that is a clone."""
    head = subprocess.run(["git", "-C", ROOT, "rev-parse", "--short=12", "HEAD"], capture_output=True, text=True,
                          check=False)
    commit = facts(cairn)["commit"]
    expect(re.fullmatch(r"[0-9a-f]{12,40}\+?|unknown", commit), commit)
    expect((commit == "unknown") == (head.returncode != 0), f"{commit} although git says {head.stdout}{head.stderr}")


def test_help(cairn: Program, here: Path):
    out = cairn("--help").out
    for code, word in ((0, "done"), (2, "wrong"), (3, "failed"), (4, "stopped")):
        expect(re.search(rf"{code} [^;]*{word}", out), f"exit code {code} is not explained:\n{out}")
    pages = re.search(r"^Manual: (.*)$", out, re.MULTILINE)
    expect(pages and (Path(pages[1]) / "README.md").is_file(), f"the manual is not there:\n{out}")


def test_record(cairn: Program, here: Path):
    """run.json says which program ran, where, when and how; a restart is added, --overwrite starts anew."""
    before = datetime.datetime.now(datetime.timezone.utc).replace(microsecond=0, tzinfo=None)
    expect_code(cairn("run", DISKS, "--out", "out", *sets(FEW), ranks=2, cwd=here), 0)
    after = datetime.datetime.now(datetime.timezone.utc).replace(tzinfo=None)
    (run,) = runs(here / "out")
    said = facts(cairn)
    expect(run["version"] == cairn("--version").out.split()[1], run)
    for key, name in (("commit", "commit"), ("compiler", "compiler"), ("instruction_set", "instruction set"),
                      ("mpi", "MPI"), ("hdf5", "HDF5"), ("metis", "METIS")):
        expect(run[key] == said[name], f"{key}: {run[key]} and {said[name]}")
    expect((run["ranks"], sum(run["hosts"].values()), run["first_step"], run["exit_code"]) == (2, 2, 0, 0), run)
    start, end = (datetime.datetime.strptime(run[key], "%Y-%m-%dT%H:%M:%SZ") for key in ("start", "end"))
    expect(before <= start <= end <= after, f"{before} {run} {after}")
    expect(run["command"].startswith("mpirun -n 2 ") and f"--set {'time.steps=6'}" in run["command"], run)

    expect_code(cairn("run", DISKS, "--out", "out", *sets(FEW | {"time.steps": 9}), "--restart", "latest", cwd=here), 0)
    first, second = runs(here / "out")
    expect(first == run, f"the first entry has changed: {first}")
    expect((second["first_step"], second["ranks"], second["exit_code"]) == (6, 1, 0), second)
    expect("--restart latest" in second["command"], second)

    expect_code(cairn("run", DISKS, "--out", "out", *sets(FEW), "--overwrite", cwd=here), 0)
    (only,) = runs(here / "out")
    expect(only["first_step"] == 0 and "--overwrite" in only["command"], only)


def test_record_of_ends(cairn: Program, here: Path):
    """How a run ended: failed, stopped, killed; one that was refused is not recorded."""
    expect_code(cairn("run", DISKS, "--out", "failed", *sets(FEW | FAILING), cwd=here), 3)
    expect([run["exit_code"] for run in runs(here / "failed")] == [3], runs(here / "failed"))
    expect_code(cairn("run", DISKS, "--out", "stopped", *sets({"time.wall_limit": 0.01}), cwd=here), 4)
    expect([run["exit_code"] for run in runs(here / "stopped")] == [4], runs(here / "stopped"))
    was = (here / "stopped" / "run.json").read_bytes()
    expect_code(cairn("run", DISKS, "--out", "stopped", *sets({"domain.cells": 40}), "--restart", "latest", cwd=here), 2)
    expect((here / "stopped" / "run.json").read_bytes() == was, "a run that was refused has changed run.json")
    process = subprocess.Popen(cairn.command("run", DISKS, "--out", "killed", *sets({"time.end": 1e6})), cwd=here,
                               stdout=subprocess.DEVNULL)
    while not (here / "killed" / "history.csv").is_file() or not (here / "killed" / "run.json").is_file():
        expect(process.poll() is None, "the run has ended")
    process.kill()
    process.wait()
    (run,) = runs(here / "killed")
    expect(run["end"] is None and run["exit_code"] is None, run)


def test_record_names(cairn: Program, here: Path):
    """Odd names are kept as they are; a run.json of somebody else is left alone."""
    name = "a \"quoted\" \\ 'name' ü"
    expect_code(cairn("run", DISKS, "--out", name, *sets(FEW), cwd=here), 0)
    (run,) = runs(here / name)
    words = subprocess.run(["sh", "-c", f"for w in {run['command']}; do printf '%s\\n' \"$w\"; done"],
                           capture_output=True, text=True, check=True).stdout.splitlines()
    expect(name in words, f"{run['command']} gives {words}")
    (here / "other").mkdir()
    (here / "other" / "run.json").write_text('{"mine": 1}\n')
    for more in ([], ["--overwrite"]):
        expect_code(cairn("run", DISKS, "--out", "other", *sets(FEW), *more, cwd=here), 2, "run.json", "not written by")
    expect((here / "other" / "run.json").read_text() == '{"mine": 1}\n', "it was changed")
    (here / name / "run.json").write_text((here / name / "run.json").read_text() + "more\n")
    done = cairn("run", DISKS, "--out", name, *sets(FEW | {"time.steps": 9}), "--restart", "latest", cwd=here)
    expect_code(done, 3, "run.json", "move it away")


def test_first_case(cairn: Program, here: Path):
    """`cairn init` writes a case that checks without a warning and runs, and replaces nothing."""
    expect_code(cairn("init", cwd=here), 0, "first.toml")
    expect((here / "first.toml").read_bytes() == (ROOT / "cases" / "first.toml").read_bytes(), "another case")
    expect_code(cairn("init", cwd=here), 2, "is there already")
    expect_code(cairn("init", "mine.toml", ranks=2, cwd=here), 0)
    (here / "link.toml").symlink_to("nowhere.toml")
    expect_code(cairn("init", "link.toml", cwd=here), 2)
    expect(not (here / "nowhere.toml").exists(), "a link was followed")
    expect_code(cairn("init", "no/such/folder.toml", cwd=here), 2, "cannot be made")
    checked = cairn("check", "first.toml", cwd=here)
    expect_code(checked, 0)
    expect(checked.err == "", checked.err)
    done = cairn("run", "first.toml", ranks=2, cwd=here)
    expect_code(done, 0)
    rows = (here / "first" / "history.csv").read_text().splitlines()
    contacts = [int(row.split(",")[rows[0].split(",").index("contact_nodes")]) for row in rows[1:]]
    expect(max(contacts) > 0, "nothing meets anything in it")


def dotted(value, path: str = "") -> set[str]:
    """The keys of a case as `cairn keys` writes them."""
    if isinstance(value, dict):
        return {key for name, inner in value.items() for key in dotted(inner, f"{path}.{name}" if path else name)}
    if isinstance(value, list) and value and isinstance(value[0], dict):
        return {key for inner in value for key in dotted(inner, path + ".N")}
    return {path}


def test_keys(cairn: Program, here: Path):
    """`cairn keys` explains every key that a case with all defaults filled in has, and finds what is asked for."""
    listed = set(re.split(r", |\n", cairn("keys").out.strip()))
    cases = [ROOT / "cases" / f"{name}.toml"
             for name in ("two_disks", "shear_small", "rolling_disk", "block_incline", "spheres_box", "first")]
    unknown = set()
    for case in cases:
        expect_code(cairn("run", case, "--out", case.stem, *sets({"time.steps": 1}), cwd=here), 0)
        for key in dotted(tomllib.loads((here / case.stem / "case.toml").read_text())):
            if ".shape." in key:
                continue
            key = re.sub(r"^materials\.\w+", "materials.NAME", key)
            key = key.replace("drive.N.bodies.", "drive.N.")
            key = re.sub(r"^boundary\.\w+", "boundary.FACE", key)
            key = re.sub(r"^output\.\w+\.(every|interval|interval_wall)$", r"output.KIND.\1", key)
            unknown |= {key} - listed
    expect(not unknown, f"not explained: {sorted(unknown)}")
    done = cairn("keys", "FLIP")
    expect_code(done, 0, "solver.flip", "PIC", "default: 1.0")
    expect_code(cairn("keys", "simulated time"), 0, "time.end")  # a word of the explanation
    expect_code(cairn("keys", "no such thing"), 2, "no key")


TINY = {"disk_on_a_point": "type = 'disk', centre = [0.5125, 0.5125], radius = 0.004",
        "disk_between_points": "type = 'disk', centre = [0.5, 0.5], radius = 0.004",
        "small_disk": "type = 'disk', centre = [0.5, 0.5], radius = 0.03",
        "disk_beyond_a_corner": "type = 'disk', centre = [1.06, 1.06], radius = 0.086",
        "disk_past_a_face": "type = 'disk', centre = [1.095, 0.5], radius = 0.1",
        "plate": "type = 'box', lower = [0.2, 0.505], upper = [0.8, 0.510]",
        "plate_on_points": "type = 'box', lower = [0.2, 0.511], upper = [0.8, 0.515]",
        "thin_ellipse": "type = 'ellipse', centre = [0.5, 0.5], radii = [0.3, 0.004], angle = 0.5",
        "flat_ellipse": "type = 'ellipse', centre = [0.5, 0.5], radii = [0.3, 0.004]",
        "lens": "type = 'intersection', of = [{ type = 'disk', centre = [0.3, 0.5], radius = 0.2 }, "
                "{ type = 'disk', centre = [0.697, 0.5], radius = 0.2 }]",
        "thick_lens": "type = 'intersection', of = [{ type = 'disk', centre = [0.3, 0.5], radius = 0.2 }, "
                      "{ type = 'disk', centre = [0.62, 0.5], radius = 0.2 }]",
        "thin_ring": "type = 'difference', of = [{ type = 'disk', centre = [0.5, 0.5], radius = 0.2 }, "
                     "{ type = 'disk', centre = [0.5, 0.5], radius = 0.1999 }]"}


def test_check_refuses(cairn: Program, here: Path):
    """`check` says of bodies that may be too small for a point what `run` says."""
    case = (ROOT / "cases" / "two_disks.toml").read_text()
    shape = re.search(r"^shape = \{ (.*) \}$", case, re.MULTILINE)[1]
    outcomes = []
    for surface in ("cut", "whole"):
        for name, small in TINY.items():
            (here / "case.toml").write_text(case.replace(shape, small, 1))
            more = sets({"domain.cells": "[20, 20]", "solver.surface": surface, "time.steps": 1, "solver.shape": "linear"})
            checked = cairn("check", "case.toml", *more, cwd=here)
            ran = cairn("run", "case.toml", "--out", f"{surface}_{name}", *more, cwd=here)
            expect(checked.code == ran.code, f"{name}, {surface}: check {checked.code}, run {ran.code}: {ran.err}")
            expect(checked.code in (0, 2) and (checked.code == 0 or "holds no material point" in checked.err), checked.err)
            outcomes.append(checked.code)
    expect(min(outcomes.count(0), outcomes.count(2)) >= 5, f"one-sided: {outcomes}")


def test_scripts(cairn: Program, here: Path):
    """The scripts as commands of the program; their exit codes are passed on."""
    for name, code in (("plot", 2), ("measure", 2), ("compare-runs", 1), ("convert-grains", 2),
                       ("convert-labels", 2), ("convert-cells", 2)):
        expect_code(cairn(name, "--help", cwd=here), 0, "usage")
        told = cairn(name, "--help", cwd=here).out
        expect("exec" not in told and re.search(r"^[A-Z][^.]+\.", told, re.MULTILINE), f"{name} --help says:\n{told}")
        arguments = ["nothing"] * (2 if name == "compare-runs" else 1)
        expect_code(cairn(name, *arguments, cwd=here), code, "nothing")


def test_explain(cairn: Program, here: Path):
    """--explain names the stages of each scheme and what is sent, and writes nothing."""
    stages = {"last": 4, "first": 6, "both": 8, "modified_last": 6}
    passes = {"last": 2, "first": 3, "both": 4, "modified_last": 3}
    for update, count in stages.items():
        for ranks in (1, 2):
            done = cairn("run", ROOT / "cases" / "shear_small.toml", "--explain", *sets({"solver.stress_update": update}),
                         ranks=ranks, cwd=here)
            expect_code(done, 0)
            out = done.out
            expect(len(re.findall(r"^  [a-z]", out, re.MULTILINE)) == count + 2, out)  # with the step's length and the end
            rounds = [int(n) for n in re.findall(r"-> (\d+) message", out)]
            total, words = re.search(r"^(\d+) passes .*; (\d+) messages", out, re.MULTILINE).groups()
            expect(int(total) == passes[update] and int(words) == sum(rounds), out)
            expect((sum(rounds) > 0) == (ranks > 1), out)
    expect(not list(here.iterdir()), f"--explain wrote {list(here.iterdir())}")


def test_same_files(cairn: Program, here: Path):
    """Result files name the program and nothing of the run; another program's name makes no difference to results."""
    import h5py

    for ranks in (1, 3):
        expect_code(cairn("run", DISKS, "--out", f"out{ranks}", *sets(FEW), ranks=ranks, cwd=here), 0)
    said = facts(cairn)
    for file in sorted((here / "out1").glob("*_*.*")):
        if file.suffix not in (".h5", ".vtkhdf"):
            continue
        with h5py.File(file) as table:
            expect(table.attrs["commit"].decode() == said["commit"], f"{file}: {dict(table.attrs)}")
        expect(file.read_bytes() == (here / "out3" / file.name).read_bytes(), f"{file.name} differs on 3 ranks")
    expect_code(cairn("info", "out1/particles_000000.vtkhdf", cwd=here), 0, f"commit {said['commit']}")
    with h5py.File(here / "out3" / "particles_000000.vtkhdf", "r+") as table:
        table.attrs["commit"] = "another"
    expect_code(cairn("compare-runs", "out1", "out3", cwd=here), 0, "the same bits")


def main():
    cairn, scratch = Program(sys.argv[1]), fresh_folder(sys.argv[2])
    os.chdir(scratch)
    problems = []
    for name, test in list(globals().items()):
        if not name.startswith("test_"):
            continue
        here = scratch / name
        here.mkdir()
        try:
            test(cairn, here)
            print(f"passed {name}")
            shutil.rmtree(here)
        except AssertionError as error:
            problems.append(name)
            print(f"FAILED {name}: {error}")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
