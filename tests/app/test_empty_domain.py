"""Domains that are nearly empty: time and memory follow the points, results are those of a small domain.

    test_empty_domain.py CAIRN SCRATCH
"""

import csv
import os
import subprocess
import sys
import time
from pathlib import Path

from harness import PATIENCE, Program, fresh_folder, load_compare_runs, sets

compare_runs = load_compare_runs()

CASE = """
[domain]
dimension = {dim}
upper = {upper}
cells = {cells}
patch_cells = 8
gravity = {gravity}
[time]
steps = 60
[materials.m]
model = "neo_hookean"
density = 1000.0
youngs_modulus = 1.0e6
poissons_ratio = 0.3
[[bodies]]
shape = {{ type = "{ball}", centre = {a}, radius = 1.0 }}
material = "m"
velocity = {v}
[[bodies]]
shape = {{ type = "{ball}", centre = {b}, radius = 1.0 }}
material = "m"
velocity = {w}
[output]
history = {{ every = 5 }}
particles = {{ every = 20 }}
grains = {{ every = 20 }}
contacts = {{ every = 20 }}
checkpoint = {{ every = 40, keep = 9 }}
[parallel]
balance_every = 15
imbalance = 1.0
"""
SMALL = {2: 512, 3: 128}
LARGE = {2: 1_000_000, 3: 10_000}
# A checkpoint knows its case and how many patches there is room for, and with that its numbers and their checksum.
OF_DOMAIN = ("/case", "numbers_checksum", "attribute patches", "patch_id", "checksums", "attribute upper_",
             "attribute history_")
COLUMNS_OF_DOMAIN = ("length_", "stress_", "inertial_number")  # of history.csv: how large it is, and means over it


def case(scratch: Path, dim: int, cells: int, far: bool = False) -> Path:
    """Two balls that meet; with `far` they lie at opposite corners."""
    file = scratch / f"{dim}d_{cells}{'_far' * far}.toml"
    length = cells / 8  # cells of the same size to the last bit
    vector = lambda value: str([float(value)] * dim)  # noqa: E731
    other = [length - 3.0] * dim if far else [6.1] * (dim - 1) + [4.0]
    file.write_text(CASE.format(dim=dim, upper=vector(length), cells=[cells] * dim, gravity=vector(-3),
                                ball="disk" if dim == 2 else "sphere", a=vector(4.0), b=str(other),
                                v=vector(9), w=vector(-6)), encoding="utf-8")
    return file


def measured(cairn: Program, *arguments) -> tuple[int, float, float]:
    """Exit code, wall time [s] and most memory [MB] of a run on one rank."""
    began = time.monotonic()
    process = subprocess.Popen(cairn.command(*arguments), stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    return os.waitstatus_to_exitcode(status), time.monotonic() - began, usage.ru_maxrss / 1e3


def history_differs(a: Path, b: Path) -> list[str]:
    """Rows of history.csv that differ in more than what is of the domain."""
    rows = [list(csv.DictReader(file.open(encoding="utf-8"))) for file in (a, b)]
    lines = [f"{len(rows[0])} and {len(rows[1])} rows"] * (len(rows[0]) != len(rows[1]))
    for one, two in zip(*rows):
        lines += [f"{key}: {one[key]} and {two[key]}" for key in one
                  if not key.startswith(COLUMNS_OF_DOMAIN) and one[key] != two[key]]
    return lines


def compare(a: Path, b: Path, same_domain: bool) -> list[str]:
    names = compare_runs.result_files(a)
    lines = [f"files {names ^ compare_runs.result_files(b)}"] * (names != compare_runs.result_files(b))
    for name in sorted(names):
        if not same_domain and name == "case.toml":
            continue
        if not same_domain and name == "history.csv":
            lines += [f"{name}: {line}" for line in history_differs(a / name, b / name)]
            continue
        lines += [f"{name}: {line}" for line in compare_runs.compare_files(a / name, b / name)
                  if same_domain or not any(word in line for word in OF_DOMAIN)]
    return lines


def check(cairn: Program, scratch: Path, dim: int) -> list[str]:
    small, large = case(scratch, dim, SMALL[dim]), case(scratch, dim, LARGE[dim])
    problems = []
    folders = {name: scratch / f"{dim}d_{name}" for name in ("small", "large", "far_small", "far_large")}
    numbers = {}
    for name, file in (("small", small), ("large", large), ("far_small", case(scratch, dim, SMALL[dim], True)),
                       ("far_large", case(scratch, dim, LARGE[dim], True))):
        code, wall, memory = measured(cairn, "run", file, "--out", folders[name])
        numbers[name] = wall, memory
        if code != 0:
            return [f"{dim}D {name}: exit code {code}"]
    print(f"{dim}D: wall [s], memory [MB]: { {k: (round(w, 2), round(m, 1)) for k, (w, m) in numbers.items()} }")
    for kind in ("", "far_"):
        if numbers[kind + "large"][1] > 1.05 * numbers[kind + "small"][1]:
            problems.append(f"memory: {numbers}")
        if numbers[kind + "large"][0] > 2 * numbers[kind + "small"][0] + 1:  # the work is counted by tests/mpi
            problems.append(f"time: {numbers}")
    problems += [f"small and large: {p}" for p in compare(folders["small"], folders["large"], False)]
    for ranks in (2, 3, 4):
        out = scratch / f"{dim}d_{ranks}"
        done = cairn("run", large, "--out", out, ranks=ranks)
        problems += [f"{ranks} ranks: {done.code} {done.err}"] if done.code else [
            f"{ranks} ranks: {p}" for p in compare(folders["large"], out, True)]
    # Stopped at the first checkpoint, and on from there.
    out = scratch / f"{dim}d_restarted"
    cairn("run", large, "--out", out, *sets({"time.steps": 40}), ranks=2)
    done = cairn("run", large, "--out", out, "--restart", "latest", ranks=3)
    # The checkpoint that was there knows a case of fewer steps.
    problems += [f"restart: {done.code} {done.err}"] if done.code else [
        f"restart: {p}" for p in compare(folders["large"], out, True)
        if not p.startswith(("checkpoint_000000.h5: /case", "checkpoint_000000.h5: / attribute numbers_checksum"))]
    return [f"{dim}D: {p}" for p in problems]


def main() -> int:
    cairn, scratch = Program(sys.argv[1]), fresh_folder(sys.argv[2])
    problems = check(cairn, scratch, 2) + check(cairn, scratch, 3)
    print("\n".join(problems))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
