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


WALL = SPRING[:SPRING.index("[[bodies]]\nshape = { type = \"box\", lower = [0.0, 1.0]")] + """
[contact]
friction = 0.0
[boundary]
left = { type = "symmetry" }
right = { type = "symmetry" }
bottom = { type = "symmetry" }
top = { type = "wall", position = 1.0 }
[output]
forces = { every = 1 }
history = { every = 10 }
"""
MODULUS = 1e5 * (1 - 0.3) / ((1 + 0.3) * (1 - 2 * 0.3))  # of the column, in uniaxial strain


def test_a_wall_is_a_piston_too(cairn: Program, here: Path):
    """The same mass on the same spring, with a wall that moves through the cells: period and swing."""
    (here / "wall.toml").write_text(WALL)
    expect_code(cairn("run", here / "wall.toml", "--out", here / "out",
                      *sets({"boundary.top.piston": "{ mass = 40.0, force = 200.0 }"}), timeout=300), 0)
    rows = rows_of(here / "out", "top")
    down = [(row["time"], -row["vy"]) for row in rows]
    turns = [a[0] - a[1] * (b[0] - a[0]) / (b[1] - a[1]) for a, b in zip(down, down[1:]) if a[1] > 0 >= b[1]]
    period = 2 * math.pi * math.sqrt((40 + 10 * 0.1 / 3) / (MODULUS * 0.1 / 1.0))
    measured = (turns[-1] - turns[0]) / (len(turns) - 1)
    assert abs(measured / period - 1) < 0.01, (measured, period)
    assert abs((1.0 - min(row["y"] for row in rows)) / (2 * 200 / (MODULUS * 0.1)) - 1) < 0.02
    with open(here / "out" / "history.csv", encoding="utf-8") as file:
        assert abs(float(list(csv.DictReader(file))[-1]["energy_error"])) < 1e-3


def test_a_servo_holds_its_pressure(cairn: Program, here: Path):
    """A step of the pressure on a column that damps its waves: no overshoot of 5 %, then held within half a per cent."""
    text = WALL.replace('model = "hypoelastic"', 'model = "viscoelastic"').replace(
        "poissons_ratio = 0.3", "poissons_ratio = 0.3\nbranch_moduli = [1.0e5]\nbranch_times = [2.0e-3]")
    (here / "wall.toml").write_text(text.replace("cells = [4, 48]", "cells = [2, 48]")
                                    .replace("upper = [0.1, 1.2]", "upper = [0.05, 1.2]"))
    pressure, width = 1.0e4, 0.05
    force = pressure * width
    expect_code(cairn("run", here / "wall.toml", "--out", here / "out",
                      *sets({"boundary.top.servo": f"{{ pressure = {pressure} }}", "time.end": 0.5}), timeout=300), 0)
    rows = rows_of(here / "out", "top")
    crossing = math.sqrt(10 / MODULUS)  # of a wave through the column [s]
    window = next(i for i, row in enumerate(rows) if row["time"] > crossing)  # steps have the jolts of single nodes
    means = [(row["time"], (row["impulse_y"] - before["impulse_y"]) / (row["time"] - before["time"]))
             for before, row in zip(rows, rows[window:])]
    assert max(f for _, f in means) < 1.05 * force, max(f for _, f in means)
    held = [f / force - 1 for t, f in means if t > 30 * crossing]
    assert len(held) > 100 and math.sqrt(sum(h * h for h in held) / len(held)) < 0.005, held[:5]
    assert abs((1.0 - rows[-1]["y"]) / (pressure / MODULUS) - 1) < 0.1, rows[-1]["y"]  # large strain


def test_a_block_gives_back_what_it_took(cairn: Program, here: Path):
    """Pressed through two cells by a wall that it sticks to, let go and pressed again, each time brought to rest: the same
    force to 1e-5."""
    turns = []
    for way in (-1, 1, -1):
        turns.append(f'[[stage]]\nuntil = {{ duration = 0.5 }}\n'
                     f'set.boundary.top.velocity = [0.0, "{way} * 0.05 * pi * sin(2 * pi * t)"]\nset.damping.viscous = 20.0\n')
        turns.append('[[stage]]\nuntil = { duration = 0.4 }\nset.boundary.top.velocity = [0.0, 0.0]\n'
                     'set.damping.viscous = 200.0\n')
    stick = '[[contact.pair]]\nmaterials = ["rubber", "wall"]\nlaw = "stick"\n'
    (here / "wall.toml").write_text(WALL.replace("cells = [4, 48]", "cells = [2, 24]") + stick + "".join(turns))
    expect_code(cairn("run", here / "wall.toml", "--out", here / "out", *sets({"time.end": 3.0}), timeout=600), 0)
    rows = rows_of(here / "out", "top")
    first, between, again = ([row for row in rows if row["time"] < t][-5] for t in (0.9, 1.8, 2.7))
    assert abs(again["y"] - first["y"]) < 1e-4, (first["y"], again["y"])
    assert abs(again["fy"] / first["fy"] - 1) < 1e-5, (again["fy"], first["fy"])
    assert abs(between["fy"] / first["fy"]) < 2e-5, (between["fy"], first["fy"])


def test_formulas_and_tables_say_the_same(cairn: Program, here: Path):
    """A motion as a formula, and gravity as one, against tables of the same lines; and what changing gravity does is in the
    book."""
    (here / "wall.toml").write_text(WALL)
    by_table = {"boundary.top.velocity": "[[0.0, 0.0, 0.0], [10.0, 0.0, -1.0]]",
                "domain.gravity": "[[0.0, 0.0, 0.0], [10.0, 0.0, -300.0]]"}
    by_formula = {"boundary.top.velocity": '[0.0, "-0.1 * t"]', "domain.gravity": '[0.0, "-30 * t"]'}
    for name, motion in (("table", by_table), ("formula", by_formula)):
        expect_code(cairn("run", here / "wall.toml", "--out", here / name, *sets({**motion, "time.end": 0.5}), timeout=300), 0)
    a, b = rows_of(here / "table", "top"), rows_of(here / "formula", "top")
    assert len(a) == len(b) and abs(a[-1]["y"] - b[-1]["y"]) < 1e-12 and abs(a[-1]["fy"] - b[-1]["fy"]) < 1e-6 * a[-1]["fy"]
    with open(here / "formula" / "history.csv", encoding="utf-8") as file:
        history = list(csv.DictReader(file))
    assert max(abs(float(row["energy_error"])) for row in history) < 5e-3, max(float(row["energy_error"]) for row in history)


def test_bodies_turn_about_a_point(cairn: Program, here: Path):
    """Two blades on one shaft: after a quarter turn each is where the other axis was."""
    (here / "blades.toml").write_text("""
[domain]
upper = [1.0, 1.0]
cells = [40, 40]
[time]
end = 1.0
[materials.rubber]
model = "neo_hookean"
density = 1000.0
shear_modulus = 2.0e4
bulk_modulus = 8.0e4
[materials.steel]
model = "rigid"
[[bodies]]
shape = { type = "disk", centre = [0.1, 0.1], radius = 0.06 }
material = "rubber"
[[bodies]]
shape = { type = "box", lower = [0.55, 0.45], upper = [0.85, 0.55] }
material = "steel"
group = "blades"
[[bodies]]
shape = { type = "box", lower = [0.15, 0.45], upper = [0.45, 0.55] }
material = "steel"
group = "blades"
[[drive]]
bodies = { group = "blades" }
about = [0.5, 0.5]
angular_velocity = "pi / 2"
[output]
forces = { every = 50 }
track = [1, 2]
""")
    expect_code(cairn("run", here / "blades.toml", "--out", here / "out", timeout=300), 0)
    with open(here / "out" / "bodies.csv", encoding="utf-8") as file:
        last = {int(row["body"]): row for row in csv.DictReader(file)}
    for body, y in ((1, 0.7), (2, 0.3)):
        assert abs(float(last[body]["x"]) - 0.5) < 1e-9 and abs(float(last[body]["y"]) - y) < 1e-9, last[body]
    assert abs(rows_of(here / "out", "blades")[-1]["x"] - 0.5) < 1e-15


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
    refused({"drive.0.servo": "{ force = 1.0, along = [0.0, -1.0] }"}, "beside piston")
    refused({"drive.0.piston.pressure": 1.0}, "beside force")
    refused({"boundary.bottom.piston": "{ mass = 1.0, force = 1.0 }"}, "only for faces of type wall")
    refused({"drive.0.piston.force": '"3 +"'}, "is no formula of t")


def main() -> int:
    return run_tests(globals(), Program(sys.argv[1]), fresh_folder(sys.argv[2]))


if __name__ == "__main__":
    sys.exit(main())
