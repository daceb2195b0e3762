"""Tools as users meet them: forces.csv, motions by tables, pistons; the same bytes on any number of ranks and after restart.

    test_tools.py CAIRN SCRATCH
"""

import csv
import math
import sys
from pathlib import Path

from harness import ROOT, Program, expect_code, fresh_folder, run_tests, sets

COLUMNS = ("step,time,tool,name,x,y,z,vx,vy,vz,wx,wy,wz,fx,fy,fz,mx,my,mz,impulse_x,impulse_y,impulse_z,work")
# A weight on an elastic column between rollers: a mass on a spring.
SPRING = """
[domain]
upper = [0.1, 1.2]
cells = [4, 48]
[time]
end = 1.0
[materials.rubber]
model = "hypoelastic"
density = 10.0
youngs_modulus = 1.0e5
poissons_ratio = 0.3
[materials.steel]
model = "rigid"
[[bodies]]
shape = { type = "box", lower = [0.0, 0.0], upper = [0.1, 1.0] }
material = "rubber"
[[bodies]]
shape = { type = "box", lower = [0.0, 1.0], upper = [0.1, 1.1] }
material = "steel"
[[drive]]
ids = [1]
piston = { mass = 40.0, along = [0.0, -1.0], force = 200.0 }
[contact]
friction = 0.0
[boundary]
left = { type = "symmetry" }
right = { type = "symmetry" }
bottom = { type = "symmetry" }
[output]
forces = { every = 1 }
history = { every = 10 }
"""


def rows_of(folder: Path, name: str) -> list[dict]:
    text = (folder / "forces.csv").read_text()
    assert text.splitlines()[0] == COLUMNS, text[:200]
    return [{key: value if key == "name" else float(value) for key, value in row.items()}
            for row in csv.DictReader(text.splitlines()) if row["name"] == name]


def test_a_piston_on_a_column_swings(cairn: Program, here: Path):
    """Its period is that of a mass on a spring, a third of the spring's mass with it, and its swing does not grow."""
    (here / "spring.toml").write_text(SPRING)
    expect_code(cairn("run", here / "spring.toml", "--out", here / "out", timeout=300), 0)
    rows = rows_of(here / "out", "drive0")
    down = [(row["time"], -row["vy"]) for row in rows]
    turns = [a[0] - a[1] * (b[0] - a[0]) / (b[1] - a[1]) for a, b in zip(down, down[1:]) if a[1] > 0 >= b[1]]
    assert len(turns) >= 2, turns
    modulus = 1e5 * (1 - 0.3) / ((1 + 0.3) * (1 - 2 * 0.3))
    stiffness = modulus * 0.1 / 1.0
    period = 2 * math.pi * math.sqrt((40 + 10 * 0.1 / 3) / stiffness)
    measured = (turns[-1] - turns[0]) / (len(turns) - 1)
    assert abs(measured / period - 1) < 0.01, (measured, period)
    # From rest it goes down twice the static way, and back to where it began.
    lowest, first = min(row["y"] for row in rows), rows[0]["y"]
    assert abs((first - lowest) / (2 * 200 / stiffness) - 1) < 0.02, first - lowest
    swings = [max(y for t, y in ((r["time"], r["y"]) for r in rows) if a <= t <= b) for a, b in zip(turns, turns[1:])]
    assert all(abs(top - first) < 0.02 * (first - lowest) for top in swings), (swings, first)


def test_the_floor_bears_the_weight(cairn: Program, here: Path):
    """Disks of rubber come to rest in a box: what floor and walls bear is their weight."""
    case = ROOT / "cases" / "press.toml"
    text = case.read_text()
    text = text[:text.index("[[bodies]]")] + text[text.index("[boundary]"):]
    (here / "heap.toml").write_text(text.replace("press_disks.csv", str(case.parent / "press_disks.csv")))
    expect_code(cairn("run", here / "heap.toml", "--out", here / "out", *sets({"time.end": 1.5, "output.particles": "{}"}),
                      timeout=300), 0)
    with open(here / "out" / "history.csv", encoding="utf-8") as file:
        history = list(csv.DictReader(file))
    weight = 9.81 * float(history[0]["mass"])
    bottom, left, right = (rows_of(here / "out", name) for name in ("bottom", "left", "right"))
    assert [row["time"] for row in bottom] == [float(row["time"]) for row in history]
    pressed = [sum(row["impulse_y"] for row in rows) for rows in zip(bottom, left, right)]
    for impulse, row in zip(pressed, history):  # momentum is what gravity gave and the walls took
        balance = float(row["momentum_y"]) + weight * float(row["time"]) + impulse
        assert abs(balance) < 1e-10 * weight, (row["time"], balance)
    half = next(i for i, row in enumerate(bottom) if row["time"] > 0.75)
    mean = -(pressed[-1] - pressed[half]) / (bottom[-1]["time"] - bottom[half]["time"])
    assert abs(mean / weight - 1) < 0.02, (mean, weight)


def test_same_bytes_on_any_ranks_and_after_restart(cairn: Program, here: Path):
    settings = sets({"time.steps": 120, "output.forces": "{ every = 5 }", "output.particles": "{}",
                     "output.checkpoint": "{ every = 50 }", "parallel.balance_every": 20, "domain.patch_cells": 16})
    case = ROOT / "cases" / "press.toml"
    for ranks in (1, 2, 3):
        expect_code(cairn("run", case, "--out", here / str(ranks), *settings, ranks=ranks, timeout=300), 0)
    texts = {ranks: (here / str(ranks) / "forces.csv").read_bytes() for ranks in (1, 2, 3)}
    assert texts[1] == texts[2] == texts[3]
    (here / "2" / "checkpoint_000001.h5").unlink()
    expect_code(cairn("run", case, "--out", here / "2", *settings, "--restart", "latest", ranks=3, timeout=300), 0)
    assert (here / "2" / "forces.csv").read_bytes() == texts[1]


def test_bad_tools_are_refused(cairn: Program, here: Path):
    (here / "spring.toml").write_text(SPRING)

    def refused(change: dict, *words: str):
        expect_code(cairn("check", here / "spring.toml", *sets(change)), 2, *words)

    refused({"solver.stress_update": "last"}, "needs solver.stress_update")
    refused({"drive.0.piston.mass": 0.0}, "drive.0.piston.mass")
    refused({"drive.0.piston.along": "[0.0, 0.0]"}, "has no direction")
    refused({"drive.0.piston.force": "[[0.0, 1.0], [0.0, 2.0]]"}, "times must ascend")
    refused({"drive.0.velocity": "[[0.0, 1.0]]"}, "must have rows of 3 numbers")
    refused({"drive.0.piston.speed": 1.0}, "unknown key")


def main() -> int:
    return run_tests(globals(), Program(sys.argv[1]), fresh_folder(sys.argv[2]))


if __name__ == "__main__":
    sys.exit(main())
