"""Loading in stages, coming to rest, pouring and taking away: what ends a run and when, books that stay closed, and the same
bytes on any number of ranks and after a restart.

    test_loading.py CAIRN SCRATCH
"""

import csv
import sys
from pathlib import Path

from harness import Program, expect_code, fresh_folder, load_compare_runs, run_tests, sets

compare_runs = load_compare_runs()
import h5py  # noqa: E402  after the check that it is there
import numpy as np  # noqa: E402

HEAD = """
[domain]
upper = [0.6, 0.6]
cells = [36, 36]
gravity = [0.0, -9.81]
patch_cells = 12
[time]
end = 4.0
[contact]
friction = 0.3
[materials.rubber]
model = "neo_hookean"
density = 1000.0
shear_modulus = 2.0e4
bulk_modulus = 8.0e4
[boundary]
left = { type = "wall", friction = 0.3 }
right = { type = "wall", friction = 0.3 }
bottom = { type = "wall", friction = 0.3 }
top = { type = "wall", friction = 0.3, position = 0.55 }
[output]
history = { every = 10 }
forces = { every = 10 }
"""
DISKS = "".join(f"""
[[bodies]]
shape = {{ type = "disk", centre = [{x}, {y}], radius = 0.078 }}
material = "rubber"
""" for x, y in ((0.085, 0.085), (0.25, 0.082), (0.42, 0.085), (0.17, 0.23), (0.34, 0.23), (0.51, 0.24)))
STAGES = """
[[stage]]
name = "settle"
until = { rest = 8.0e-2, duration = 1.0 }
set.damping.local = 0.6
[[stage]]
name = "press"
until = { pressure = 600.0, of = "top", every = 5 }
set.boundary.top.velocity = [0.0, -0.4]
[[stage]]
name = "hold"
until = { duration = 0.03 }
set.boundary.top.velocity = [0.0, 0.0]
set.boundary.top.servo.pressure = 600.0
set.output.forces.every = 3
[[stage]]
until = { strain = 0.005, of = "top" }
set.boundary.top.velocity = [0.0, "-0.3 * sin(pi * t / 0.02)"]
set.damping.local = 0.0
"""
POURED = """
[[insert]]
radius = [0.03, 0.05]
count = 12
material = "rubber"
region = { lower = [0.05, 0.3], upper = [0.55, 0.55] }
velocity = [0.0, -1.0]
interval = 0.004
seed = 7
[[insert]]
shape = { type = "box", lower = [0.25, 0.05], upper = [0.35, 0.15] }
material = "rubber"
start = 0.01
[[remove]]
region = { type = "box", lower = [0.0, 0.0], upper = [0.6, 0.25] }
start = 0.08
every = 20
"""


def history_of(folder: Path) -> list[dict]:
    with open(folder / "history.csv", encoding="utf-8") as file:
        return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]


def ends_of(out: str) -> list[str]:
    return [line for line in out.splitlines() if line.startswith(("stage ", "ended "))]


def same_files(a: Path, b: Path):
    for name in ("history.csv", "forces.csv"):
        assert (a / name).read_bytes() == (b / name).read_bytes(), (a, b, name)


def test_stages_end_at_the_same_step_everywhere(cairn: Program, here: Path):
    (here / "case.toml").write_text(HEAD + DISKS + STAGES)
    low = sets({"boundary.top.position": 0.36, "parallel.balance_every": 20})
    settings = sets({"output.checkpoint": "{ every = 7, keep = 1000000 }"})
    runs = {}
    for ranks in (1, 2, 3):
        more = settings if ranks == 2 else []
        runs[ranks] = cairn("run", here / "case.toml", "--out", here / str(ranks), *low, *more, ranks=ranks, timeout=600)
        expect_code(runs[ranks], 0)
    ends = ends_of(runs[1].out)
    assert [line.split(" ended")[0] for line in ends[:3]] == ["stage settle", "stage press", "stage hold"] and len(ends) == 4, ends
    assert all(ends_of(run.out) == ends for run in runs.values()), {k: ends_of(r.out) for k, r in runs.items()}
    same_files(here / "1", here / "2")
    same_files(here / "1", here / "3")
    steps = [int(line.split("at step ")[1].split(",")[0]) for line in ends]
    # Again from the last checkpoint before each stage's end.
    files = {int(h5py.File(f).attrs["step"]): f for f in (here / "2").glob("checkpoint_*.h5")}
    for end in steps:
        step = max(at for at in files if at < end)
        file = files[step]
        again = cairn("run", here / "case.toml", "--out", here / f"from{step}", *low, "--restart", file, timeout=600)
        expect_code(again, 0)
        left = [line for line, at in zip(ends, steps) if at > step]
        assert ends_of(again.out) == left, (step, again.out, left)


def test_stages_change_every_output(cairn: Program, here: Path):
    """What a stage turns on is written from then on."""
    crack = '[[cracks]]\npoints = [[0.0, 0.08], [0.08, 0.08]]\nends = ["open", "tip"]\nbodies = ["cracked"]\n'
    case = HEAD + DISKS.replace('material = "rubber"', 'material = "rubber"\ngroup = "cracked"', 1) + crack
    kinds = ("particles", "grains", "contacts", "forces", "tips", "history", "checkpoint")
    silent = {f"output.{kind}": "{}" for kind in kinds}
    stages = "[[stage]]\nuntil = { duration = 1e-9 }\n[[stage]]\n" + "".join(
        f"set.output.{kind} = {{ every = 2 }}\n" for kind in kinds)
    (here / "case.toml").write_text(case + stages)
    done = cairn("run", here / "case.toml", "--out", here / "out", *sets({**silent, "time.steps": 6}), timeout=300)
    expect_code(done, 0)
    for kind in ("forces", "tips", "history"):
        rows = (here / "out" / f"{kind}.csv").read_text().splitlines()
        assert any(row.startswith("4,") for row in rows), (kind, rows[-3:])
    for kind in ("particles", "grains", "contacts", "checkpoint"):
        steps = {int(h5py.File(f).attrs["step"]) for f in (here / "out").glob(f"{kind}_*")}
        assert 4 in steps, (kind, steps)


def test_what_ends_a_run(cairn: Program, here: Path):
    """Strain, pressure and packing are what they say."""
    (here / "case.toml").write_text(HEAD + DISKS)
    push = {"boundary.top.velocity": "[0.0, -0.5]", "output.forces": "{ every = 1 }"}

    def run(until: str, **more) -> tuple[str, list[dict]]:
        out = here / "out"
        done = cairn("run", here / "case.toml", "--out", out, "--overwrite", *sets({**push, "time.until": until, **more}),
                     timeout=300)
        expect_code(done, 0)
        with open(out / "forces.csv", encoding="utf-8") as file:
            rows = [row for row in csv.DictReader(file) if row["name"] == "top"]
        return done.out, rows

    out, rows = run('{ strain = 0.1, of = "top", every = 1 }')
    assert abs(float(rows[-1]["y"]) - (0.55 - 0.055)) < 0.5 * 1e-3, rows[-1]
    assert "the strain by top is 0.1" in out
    out, rows = run('{ force = 50.0, of = "top", every = 1 }')
    assert float(rows[-1]["fy"]) >= 50 and all(float(row["fy"]) < 50 for row in rows[:-1]), out
    out, rows = run("{ packing = 0.45, every = 1 }")
    filled = 6 * np.pi * 0.078**2
    assert abs(filled / (0.6 * float(rows[-1]["y"])) - 0.45) < 0.005, rows[-1]
    out, rows = run("{ duration = 0.01 }")
    assert abs(float(rows[-1]["time"]) - 0.01) < 1e-15, rows[-1]


def test_damping_brings_rest_and_keeps_the_book(cairn: Program, here: Path):
    (here / "case.toml").write_text(HEAD + DISKS)
    errors = {}
    for name, damping in (("local", "{ local = 0.7 }"), ("viscous", "{ viscous = 40.0 }"), ("relax", "{ relax = true }"),
                          ("none", "{}")):
        expect_code(cairn("run", here / "case.toml", "--out", here / name, *sets({"damping": damping, "time.end": 0.6}),
                          timeout=600), 0)
        rows = history_of(here / name)
        gains = [b["damping_dissipation"] - a["damping_dissipation"] for a, b in zip(rows, rows[1:])]
        assert min(gains) >= 0, (name, min(gains))
        errors[name] = max(abs(row["energy_error"]) for row in rows)
        if name == "none":
            assert rows[-1]["damping_dissipation"] == 0
            continue
        largest = max(row["kinetic_energy"] for row in rows)
        assert rows[-1]["kinetic_energy"] < 1e-2 * largest, (name, rows[-1]["kinetic_energy"], largest)
        assert rows[-1]["unbalanced_force"] < 0.05, (name, rows[-1]["unbalanced_force"])
    assert all(error < max(2e-3, 1.5 * errors["none"]) for error in errors.values()), errors


def test_poured_bodies_keep_the_books_and_the_bits(cairn: Program, here: Path):
    (here / "case.toml").write_text(HEAD + POURED)
    settings = sets({"time.end": 0.12, "output.grains": "{ interval = 0.02 }", "output.contacts": "{ interval = 0.02 }",
                     "output.checkpoint": "{ interval = 0.03, keep = 10 }", "parallel.balance_every": 20})
    for ranks in (1, 2, 4):
        expect_code(cairn("run", here / "case.toml", "--out", here / str(ranks), *settings, ranks=ranks, timeout=600), 0)
    for ranks in (2, 4):
        same_files(here / "1", here / str(ranks))
        for file in sorted((here / "1").glob("grains_*.h5")):
            with h5py.File(file) as a, h5py.File(here / str(ranks) / file.name) as b:
                for column in ("body", "mass", "centre", "velocity"):
                    assert np.array_equal(a[column], b[column]), (file.name, column)
    rows = history_of(here / "1")
    assert rows[0]["mass"] == 0 and max(row["mass"] for row in rows) > 30
    largest = max(row["mass"] for row in rows)
    assert all(abs(row["mass"] + row["mass_left"]) < 1e-12 * largest for row in rows)
    assert max(abs(row["energy_error"]) for row in rows) < 0.02, max(abs(row["energy_error"]) for row in rows)
    assert rows[-1]["mass"] < largest and rows[-1]["points_left"] > 0
    for file in list((here / "4").glob("checkpoint_*.h5"))[1:]:
        file.unlink()
    left = next((here / "4").glob("checkpoint_*.h5"))
    with h5py.File(left) as file:
        assert 0 < file.attrs["time"] < 0.1
    expect_code(cairn("run", here / "case.toml", "--out", here / "4", *settings, "--restart", left, ranks=3, timeout=600), 0)
    same_files(here / "1", here / "4")


def test_contacts_make_the_stress_of_grains(cairn: Program, here: Path):
    """At rest, with walls: the sum over a grain's contacts of force (x) position is its volume times its mean stress, and
    the forces bear its weight."""
    (here / "case.toml").write_text(HEAD + DISKS)
    expect_code(cairn("run", here / "case.toml", "--out", here / "out",
                      *sets({"time.end": 1.2, "damping.local": 0.7, "domain.cells": "[72, 72]",
                             "output.contacts": "{ interval = 0.3 }", "output.grains": "{ interval = 0.3 }"}),
                      timeout=900), 0)
    number = len(list((here / "out").glob("contacts_*.h5"))) - 1
    with h5py.File(here / "out" / f"contacts_{number:06}.h5") as file:
        contacts = {name: np.array(file[name]) for name in
                    ("body_a", "body_b", "force", "point", "moment", "sticking", "slip", "friction_work")}
    with h5py.File(here / "out" / f"grains_{number:06}.h5") as file:
        grains = {name: np.array(file[name]) for name in ("body", "mass", "centre", "mean_stress")}
    assert {-1, -2, -3} >= set(contacts["body_b"][contacts["body_b"] < 0]) and -3 in contacts["body_b"]
    assert np.all((contacts["sticking"] >= 0) & (contacts["sticking"] <= 1)) and np.all(contacts["slip"] >= 0)
    worst = 0.0
    for body, mass, centre, stress in zip(*grains.values()):
        force, moment = np.zeros(3), np.zeros((3, 3))
        for side, sign in (("body_a", 1), ("body_b", -1)):
            mine = contacts[side] == body
            force += sign * contacts["force"][mine].sum(axis=0)
            moment += sign * contacts["moment"][mine].sum(axis=0).reshape(3, 3)
        assert np.linalg.norm(force - [0, 9.81 * mass, 0]) < 0.01 * 9.81 * mass, (body, force, 9.81 * mass)
        sides = moment - np.outer(force, centre)
        volume = mass / 1000.0  # nearly
        made, is_there = np.array([sides[0, 0], sides[1, 1], sides[0, 1]]) / volume, stress[[0, 1, 3]]
        worst = max(worst, np.abs(made - is_there).max() / np.abs(is_there).max())
    assert worst < 0.05, worst


def test_bad_laboratories_are_refused(cairn: Program, here: Path):
    (here / "case.toml").write_text(HEAD + DISKS + STAGES)

    def refused(change: dict, *words: str):
        expect_code(cairn("check", here / "case.toml", *sets(change)), 2, *words)

    refused({"stage.0.set.contact.law": '"stick"'}, "contact.law cannot change in a run")
    refused({"stage.1.until.of": '"lid"'}, "stage.1.until.of", "feels no force")
    refused({"stage.1.set.boundary.top.velocity": "[0.0]"}, "must have 2 numbers")
    refused({"stage.0.until": "{}"}, "says nothing")
    refused({"stage.0.until.rest": 2.0}, "stage.0.until.rest")
    refused({"stage.2.set.drive.0.velocity": "[0.0, 1.0]"}, "drive")
    refused({"damping.local": 1.0}, "damping.local")
    refused({"boundary.top.position": 0.7}, "boundary.top.position")
    refused({"boundary.top.velocity": '[0.0, "sin(x)"]'}, "boundary.top.velocity", "is no formula of t")
    refused({"domain.gravity": '[0.0, "1 / t"]'}, "domain.gravity")
    (here / "case.toml").write_text(HEAD + POURED)
    refused({"insert.0.radius": "[0.05, 0.03]"}, "insert.0.radius")
    refused({"insert.0.region.upper": "[0.1, 0.32]"}, "is too small")
    refused({"insert.1.shape": '{ type = "disk", centre = [2.0, 0.0], radius = 0.1 }'}, "outside the domain")
    refused({"remove.0.region": '{ type = "disc" }'}, "remove.0.region")


def main() -> int:
    return run_tests(globals(), Program(sys.argv[1]), fresh_folder(sys.argv[2]))


if __name__ == "__main__":
    sys.exit(main())
