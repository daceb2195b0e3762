"""Cracks through whole runs: the same bits on any number of ranks and after a restart on another, errors of the case.

    test_cracks.py CAIRN SCRATCH
"""

import subprocess
import sys
from pathlib import Path

from harness import ROOT, Program, fresh_folder, load_compare_runs, sets

compare_runs = load_compare_runs()
import h5py  # noqa: E402  after the check that it is there
import numpy as np  # noqa: E402

# Two disks that collide, each cut by a crack: one from side to side, one with a tip inside, and one within.
CRACKS = """
[[cracks]]
points = [[0.13, 0.36], [0.35, 0.363], [0.57, 0.35]]
law = "friction"
friction = 0.2
bodies = ["left"]

[[cracks]]
points = [[0.6441, 0.86], [0.6441, 0.631]]
ends = ["open", "tip"]
law = "frictionless"

[[cracks]]
points = [[0.3213, 0.2731], [0.4137, 0.3127]]
ends = ["tip", "tip"]
"""
SETTINGS = {"time.steps": 60, "domain.cells": "[25, 25]", "domain.patch_cells": 5, "output.history": "{ every = 5 }",
            "output.particles": "{ every = 20 }", "output.contacts": "{ every = 20 }",
            "output.checkpoint": "{ every = 30, keep = 5 }", "output.grains": "{ every = 20 }",
            "bodies.0.shape.centre": "[0.3537, 0.3613]", "bodies.1.shape.centre": "[0.6441, 0.6329]",
            "bodies.0.velocity": "[2.0, 1.2]", "bodies.1.velocity": "[-2.0, -1.6]", "bodies.0.angular_velocity": 3.0,
            "bodies.0.group": '"left"'}
# One that grows with a cohesive law until it cuts the disk in two, an interface, and a cohesive one.
GROWING = """
[[cracks]]
points = [[0.13, 0.3611], [0.3, 0.3611]]
ends = ["open", "tip"]
bodies = ["left"]
cohesive = { shape = "exponential", strength = 300.0, energy = 0.2 }
growth = { criterion = "steady", speed = 2.0, cohesive = true }

[[cracks]]
points = [[0.6441, 0.86], [0.6441, 0.4]]
law = "interface"
normal_stiffness = 1.0e6
tangential_stiffness = 3.0e5

[[cracks]]
points = [[0.45, 0.5713], [0.85, 0.5713]]
law = "cohesive"
cohesive = { strength = [300.0, 200.0], energy = [1.0, 2.0], exponent = 1.0 }

[crack]
split = 20
"""
ERRORS = {  # what is wrong, and a part of the message
    "points = [[0.2, 0.3]]": "needs at least 2",
    "points = [[0.2, 0.3], [1.4, 0.3]]": "lies outside the domain",
    "points = [[0.2, 0.3], [0.2, 0.3]]": "are the same",
    'points = [[0.05, 0.3], [0.3, 0.3]]\nends = ["tip", "tip"]': "lies in no body",
    "points = [[0.2, 0.3], [0.3, 0.31]]": "lies inside a body",
    'points = [[0.05, 0.3], [0.6, 0.3]]\nends = ["open"]': "give two of",
    'points = [[0.05, 0.3], [0.6, 0.3]]\nlaw = "glue"': "is not a choice",
    'points = [[0.05, 0.3], [0.6, 0.3]]\nlaw = "stick"\nfriction = 0.1': "only for cracks with law",
    'points = [[0.05, 0.3], [0.6, 0.3]]\nbodies = ["nobody"]': "no body has the group",
    'points = [[0.05, 0.3], [0.6, 0.3]]\nids = [7]': "body 7 does not exist",
    'points = [[0.05, 0.3], [0.6, 0.3]]\nlaw = "interface"': "perfect in all directions",
    'points = [[0.05, 0.3], [0.6, 0.3]]\nlaw = "interface"\nclosing_stiffness = 1e6\ntangential_stiffness = 1e6':
        "needs normal_stiffness",
    "points = [[0.05, 0.3], [0.6, 0.3]]\nnormal_stiffness = 1e6": "only for cracks with law = \"interface\"",
    'points = [[0.05, 0.3], [0.6, 0.3]]\nlaw = "cohesive"': "cohesive: is missing",
    'points = [[0.05, 0.3], [0.6, 0.3]]\nlaw = "cohesive"\ncohesive = { strength = 1e3 }': "energy: is missing",
    'points = [[0.05, 0.3], [0.6, 0.3]]\nlaw = "cohesive"\ncohesive = { strength = 1e3, energy = -1.0 }': "energy",
    'points = [[0.05, 0.3], [0.6, 0.3]]\ngrowth = { criterion = "energy", energy = 1.0 }': "the crack has none",
    'points = [[0.05, 0.3], [0.3, 0.3]]\nends = ["open", "tip"]\ngrowth = { criterion = "energy" }': "energy",
    'points = [[0.05, 0.3], [0.3, 0.3]]\nends = ["open", "tip"]\ngrowth = { criterion = "hoop", energy = 1.0 }':
        "of \"hoop\" give the toughness",
    'points = [[0.05, 0.3], [0.3, 0.3]]\nends = ["open", "tip"]\n'
    'growth = { criterion = "energy", energy = 1.0, cohesive = true }': "needs the crack's cohesive law",
}

# Two balls that collide in 3D: a round crack inside, one from side to side, and a surface from a file.
BALLS = """
title = "Cracked balls"

[domain]
dimension = 3
lower = [0.0, 0.0, 0.0]
upper = [1.0, 1.0, 1.0]
cells = [15, 15, 15]
patch_cells = 5

[time]
cfl = 0.3
steps = 40

[materials.soft]
model = "neo_hookean"
density = 1000.0
shear_modulus = 4.0e3
bulk_modulus = 8.0e3

[[bodies]]
shape = { type = "sphere", centre = [0.33, 0.41, 0.47], radius = 0.22 }
material = "soft"
velocity = [0.8, 0.1, 0.2]
angular_velocity = [0.0, 0.0, 2.0]
group = "left"

[[bodies]]
shape = { type = "sphere", centre = [0.69, 0.57, 0.56], radius = 0.2 }
material = "soft"
velocity = [-0.9, -0.2, 0.0]

[[cracks]]
disk = { centre = [0.33, 0.41, 0.48], normal = [0.2, 0.3, 1.0], radius = 0.13 }
law = "frictionless"
bodies = ["left"]

[[cracks]]
rectangle = { corner = [0.71, 0.25, 0.25], edges = [[0.0, 0.6, 0.0], [0.0, 0.0, 0.6]] }
law = "cohesive"
cohesive = { strength = [300.0, 200.0], energy = [1.0, 2.0] }

[[cracks]]
triangles = "surface.stl"
scale = 0.001
law = "friction"
friction = 0.2

[output]
history = { every = 5 }
particles = { every = 20 }
tips = { every = 20 }
checkpoint = { every = 20, keep = 5 }
"""
SURFACE = """solid crack
facet normal 0 0 0
outer loop
vertex 40 447 40
vertex 600 447 40
vertex 600 457 900
endloop
endfacet
facet normal 0 0 0
outer loop
vertex 40 447 40
vertex 600 457 900
vertex 40 457 900
endloop
endfacet
endsolid crack
"""
DISK = 'disk = { centre = [0.33, 0.41, 0.48], normal = [0.2, 0.3, 1.0], radius = 0.13 }'
ERRORS_3D = {
    "": "needs one of",
    "points = [[0.2, 0.3, 0.2], [0.4, 0.3, 0.2]]": "extrude: is missing",
    "points = [[0.2, 0.3, 0.2], [0.4, 0.3, 0.2]]\nextrude = [1.0, 0.0, 0.0]": "is parallel to the line",
    "rectangle = { corner = [0.7, 0.2, 0.2], edges = [[0.0, 0.6, 0.0], [0.0, 1.2, 0.0]] }": "not parallel",
    "rectangle = { corner = [0.7, 0.2, 0.2], edges = [[0.0, 0.6, 0.0], [0.0, 0.0, 0.9]] }": "outside the domain",
    "disk = { centre = [0.33, 0.41, 0.48], normal = [0.0, 0.0, 0.0], radius = 0.1 }": "must not be zero",
    "disk = { centre = [0.2, 0.8, 0.2], normal = [0.0, 0.0, 1.0], radius = 0.1 }": "lies in no body",
    'triangles = "nothing.stl"': "there is no file",
    DISK + '\nends = ["tip", "tip"]': "is for 2D",
    DISK + '\ngrowth = { criterion = "steady", speed = 1.0 }': 'must be "energy" or "hoop" in 3D',
    DISK + '\ngrowth = { criterion = "energy", energy = 1.0, cohesive = true }': "is for growth in 2D",
    DISK + '\nlaw = "cohesive"\ncohesive = { strength = 1e3, energy = 1.0, from = 0.1 }': "is for 2D",
    DISK + "\n[crack]\nsplit = 10": "is for 2D",
}


def crack_rows(folder: Path, name: str) -> np.ndarray:
    with h5py.File(folder / name) as file:
        rows = np.column_stack([file["crack"][:], file["index"][:], file["lower"][:], file["upper"][:]])
    return rows[np.lexsort((rows[:, 1], rows[:, 0]))]


def differences(a: Path, b: Path) -> list[str]:
    in_a, in_b = compare_runs.result_files(a), compare_runs.result_files(b)
    lines = [f"{name} is in one folder only" for name in sorted(in_a ^ in_b)]
    for name in sorted(in_a & in_b):
        lines += [f"{name}: {line}" for line in compare_runs.compare_files(a / name, b / name)]
    return lines


def run_on_ranks(cairn: Program, case: Path, out: Path, settings: dict, ranks: tuple) -> list[str]:
    """Runs a case into OUT_N on each number N of ranks, the first of them 1; what went wrong or differs."""
    failures = []
    for n in ranks:
        folder = out.with_name(f"{out.name}_{n}")
        done = cairn("run", case, "--out", folder, *sets(settings), ranks=n, timeout=300)
        if done.code != 0:
            return [f"{out.name} on {n} ranks: exit code {done.code}: {done.err}"]
        if n > 1:
            different = differences(out.with_name(f"{out.name}_1"), folder)
            failures += [f"{out.name} on {n} ranks: {line}" for line in different[:5]]
    return failures


def check_growth(cairn: Program, case: Path, scratch: Path) -> list[str]:
    """Laws, growth and split on several ranks, and from a checkpoint in the middle of them on another number."""
    settings = SETTINGS | {"time.steps": 160, "output.checkpoint": "{ every = 40, keep = 5 }",
                           "output.tips": "{ every = 10 }"}
    failures = run_on_ranks(cairn, case, scratch / "growing", settings, (1, 2, 5))
    if failures:
        return failures
    one = scratch / "growing_1"
    with h5py.File(one / "particles_000008.vtkhdf") as file:
        bodies = np.unique(file["VTKHDF/PointData/body"][:] if "VTKHDF" in file else file["body"][:])
    if len(bodies) < 3:
        failures.append(f"what was cut through is one body still: {bodies}")
    with h5py.File(one / "cracks_000008.h5") as file:
        if not (file["bond"][:] == 2).any() or not (file["dissipated"][:].sum() > 0):
            failures.append("no cohesive law broke")
    tips = (one / "tips.csv").read_text().splitlines()
    if len(tips) < 5 or float(tips[4].split(",")[8]) <= 0:
        failures.append(f"tips.csv: {tips[:5]}")
    for ranks, checkpoint in ((3, 0), (2, 2)):
        out = scratch / f"growing_on_{ranks}"
        done = cairn("run", case, "--out", out, "--restart", one / f"checkpoint_{checkpoint:06}.h5", *sets(settings),
                     ranks=ranks, timeout=300)
        if done.code != 0:
            return [*failures, f"restart in growth: exit code {done.code}: {done.err}"]
        for name in ("particles_000008.vtkhdf", "cracks_000008.h5"):
            failures += [f"restart in growth: {name}: {line}"
                         for line in compare_runs.compare_files(one / name, out / name)]
    return failures


def check_pictures(folder: Path) -> list[str]:
    done = subprocess.run([ROOT / "scripts" / "plot", folder], capture_output=True, text=True, check=False, timeout=300)
    missing = [name for name in ("cracks.png", "tips.png") if not (folder / "pictures" / name).is_file()]
    return [f"scripts/plot: {missing} are missing: {done.stdout}{done.stderr}"] if missing else []


def check_same_bits(cairn: Program, case: Path, scratch: Path) -> list[str]:
    failures = run_on_ranks(cairn, case, scratch / "ranks", SETTINGS, (1, 3, 5))
    if failures:
        return failures
    first, last = (crack_rows(scratch / "ranks_1", f"cracks_{n:06}.h5") for n in (0, 3))
    if len(last) < len(first):  # segments longer than a cell divide
        failures.append("crack points went")
    short_first, short_last = (rows[rows[:, 0] == 2, 2:] for rows in (first, last))  # none of its segments divides
    if not 1e-4 < np.abs(short_first - short_last).max() < 0.5:
        failures.append("the cracks did not go with the disks")
    if not np.abs(last[:, 2:5] - last[:, 5:8]).max() > 1e-5:
        failures.append("no crack opened or slipped")
    with h5py.File(scratch / "ranks_1" / "tips_000003.h5") as file:
        if file["crack"].shape != (3,) or not np.isfinite(file["J"][:]).all():
            failures.append(f"tips: {file['crack'][:]}, J {file['J'][:]}")
    return failures


def check_restart(cairn: Program, case: Path, scratch: Path) -> list[str]:
    """From the checkpoint at step 30 of one rank, on three."""
    settings = sets(SETTINGS)
    checkpoint = scratch / "ranks_1" / "checkpoint_000000.h5"
    done = cairn("run", case, "--out", scratch / "restarted", "--restart", checkpoint, *settings, ranks=3, timeout=300)
    if done.code != 0:
        return [f"restart: exit code {done.code}: {done.err}"]
    failures = []
    for name in ("particles_000003.vtkhdf", "cracks_000003.h5", "tips_000003.h5"):
        with h5py.File(scratch / "ranks_1" / name) as a, h5py.File(scratch / "restarted" / name) as b:
            for key in a:
                if isinstance(a[key], h5py.Dataset) and a[key][()].tobytes() != b[key][()].tobytes():
                    failures.append(f"restart: {name}: {key} differs")
    return failures


def check_balls(cairn: Program, scratch: Path) -> list[str]:
    """Surfaces in 3D on several ranks, and from a checkpoint on another number."""
    case = scratch / "balls.toml"
    case.write_text(BALLS)
    (scratch / "surface.stl").write_text(SURFACE)
    failures = run_on_ranks(cairn, case, scratch / "balls", {}, (1, 2, 3))
    if failures:
        return failures
    out = scratch / "balls_restarted"
    done = cairn("run", case, "--out", out, "--restart", scratch / "balls_1" / "checkpoint_000000.h5", ranks=2,
                 timeout=300)
    if done.code != 0:
        return [*failures, f"balls: restart: exit code {done.code}: {done.err}"]
    for name in ("particles_000002.vtkhdf", "cracks_000002.h5", "tips_000002.h5"):
        failures += [f"balls: restart: {name}: {line}"
                     for line in compare_runs.compare_files(scratch / "balls_1" / name, out / name)]
    again = cairn("check", scratch / "balls_1" / "case.toml")
    if again.code != 0:
        failures.append(f"balls: the case beside the results: {again.err}")
    with h5py.File(scratch / "balls_1" / "cracks_000000.h5") as file:
        corners, crack = file["VTKHDF/Connectivity"][:].reshape(-1, 3), file["crack"][:]
        x = file["position"][:]
        area = 0.5 * np.linalg.norm(np.cross(x[corners[:, 1]] - x[corners[:, 0]], x[corners[:, 2]] - x[corners[:, 0]]),
                                    axis=1)
        of_disk = area[crack[corners[:, 0]] == 0].sum() / (np.pi * 0.13**2)
        if not (crack[corners] == crack[corners[:, :1]]).all() or abs(of_disk - 1) > 0.02:
            failures.append(f"the triangles of the round crack have {of_disk} of its area")
    with h5py.File(scratch / "balls_1" / "cracks_000002.h5") as file:
        if not np.linalg.norm(file["opening"][:], axis=1).max() > 1e-4:
            failures.append("no crack of a ball opened or slipped")
    with h5py.File(scratch / "balls_1" / "tips_000002.h5") as file:  # the surface from the file ends in the other ball
        if set(file["crack"][:]) != {0, 2} or not np.isfinite(file["J"][:]).all() or len(file["index"][:]) < 20:
            failures.append(f"rims: {file['crack'][:]}")
    return failures


def check_errors(cairn: Program, plain: str, scratch: Path, errors: dict) -> list[str]:
    failures = []
    for text, message in errors.items():
        case = scratch / "wrong.toml"
        case.write_text(plain + "\n[[cracks]]\n" + text + "\n")
        done = cairn("check", case)
        if done.code != 2 or message not in done.err + done.out:
            failures.append(f"{text!r}: exit code {done.code}, {done.err or done.out}")
    return failures


def main() -> int:
    cairn, scratch = Program(sys.argv[1]), fresh_folder(sys.argv[2])
    plain = (ROOT / "cases" / "two_disks.toml").read_text()
    case = scratch / "cracked_disks.toml"
    case.write_text(plain + CRACKS)
    failures = check_same_bits(cairn, case, scratch)
    failures = failures or check_restart(cairn, case, scratch)
    case.write_text(plain + GROWING)
    failures += check_growth(cairn, case, scratch) or check_pictures(scratch / "growing_1")
    failures += check_errors(cairn, plain, scratch, ERRORS)
    failures += check_balls(cairn, scratch)
    bare = BALLS[:BALLS.index("[[cracks]]")] + "[output]\nhistory = { every = 5 }\n"
    failures += check_errors(cairn, bare, scratch, ERRORS_3D)
    for failure in failures:
        print(failure)
    print("FAILED" if failures else "passed")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
