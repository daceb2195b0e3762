"""Results are the same bit for bit on any number of ranks, however the patches are shared out, and when the resolved
case is run again.

    test_same_bits.py CAIRN SCRATCH
"""

import concurrent.futures
import itertools
import shutil
import sys
import threading
import time
import tomllib
from pathlib import Path

from harness import ROOT, Program, fresh_folder, load_compare_runs, sets

compare_runs = load_compare_runs()
import h5py  # noqa: E402  after the check that it is there
import numpy as np  # noqa: E402

# Every number of ranks and every partition. More ranks than cores are slow: the methods below have two, whose patches
# alternate, so that every one of them has all its neighbours on the other rank.
LAYOUTS = ((2, "metis"), (2, "round_robin"), (3, "curve"), (4, "metis"), (7, "round_robin"))
SHAPES = ("linear", "gimp", "bspline2")
STRESS_UPDATES = ("last", "first", "both", "modified_last")
RELEASES = ("approach", "traction", "reaction")
MOST_LINES = 8  # of differences between two runs
FIELDS = '["velocity", "stress", "body", "id", "volume", "mass", "deformation_gradient", "image", "stress_smooth"]'

# Shortened, with every output; the spheres on a coarser grid. In both, points cross patches and bodies collide.
CASES = {
    "shear_small": {"time.steps": 200, "domain.patch_cells": 8, "output.history": "{ every = 5 }",
                    "output.particles": f"{{ every = 40, fields = {FIELDS} }}", "output.grains": "{ every = 40 }",
                    "output.contacts": "{ every = 40 }", "output.track": "[0, 5, 20]"},
    "spheres_box": {"time.steps": 70, "domain.cell_size": 0.025, "domain.patch_cells": 8,
                    "output.history": "{ every = 2 }", "output.particles": f"{{ every = 20, fields = {FIELDS} }}",
                    "output.grains": "{ every = 20 }", "output.contacts": "{ every = 20 }",
                    "output.track": "[63, 0, 31]", "output.checkpoint": "{}"},
}
# The disks start where they nearly touch, so that a short run holds a collision with friction. Linear hats with stress
# update "last" do not stand it for longer.
DISKS = {"time.steps": 50, "domain.cells": "[25, 25]", "domain.patch_cells": 8, "output.history": "{ every = 5 }",
         "output.particles": f"{{ every = 25, fields = {FIELDS} }}", "output.contacts": "{ every = 25 }",
         "bodies.0.shape.centre": "[0.3537, 0.3613]", "bodies.1.shape.centre": "[0.6441, 0.6329]",
         "bodies.0.velocity": "[2.0, 1.2]", "bodies.1.velocity": "[-2.0, -1.6]", "bodies.0.angular_velocity": 3.0}

# Everything else that changes what ranks tell each other, one at a time.
VARIATIONS = {
    "no_slip": {"contact.law": '"none"'},
    "stick": {"contact.law": '"stick"'},
    "frictionless": {"contact.law": '"frictionless"'},
    "density_normals": {"contact.normals": '"density"'},
    "mass_normals": {"contact.normals": '"mass_gradient"'},
    "own_normals": {"contact.normal_choice": '"own"'},
    "gate_body": {"contact.gate": '"body"', "contact.release": '"traction"'},
    "departing_coulomb": {"contact.departing_friction": '"coulomb"', "contact.release": '"traction"'},
    "departing_printed": {"contact.departing_friction": '"printed"', "contact.release": '"traction"'},
    "pass_before": {"contact.passes": '"before"'},
    "pass_after": {"contact.passes": '"after"'},
    "no_fill": {"contact.fill": 0.0},
    "fill": {"contact.fill": 0.8},
    "cpdi": {"solver.shape": '"cpdi"', "solver.motion": '"projected"'},
    "no_filter": {"solver.noise_filter": '"off"'},
    "xpic": {"solver.noise_filter": '"xpic"', "solver.noise_order": 2},
    "impulse_limit": {"contact.impulse_limit": 0.1},
    "separation": {"contact.separation": 0.8},
    "half_pic": {"solver.flip": 0.5},
    "whole_surface": {"solver.surface": '"whole"'},
    "nine_points": {"solver.points_per_cell": 9},
    "hypoelastic": {"materials.soft.model": '"hypoelastic"'},
    "plane_stress": {"materials.soft.plane": '"stress"'},
    "viscoelastic": {"materials.soft.model": '"viscoelastic"', "materials.soft.branch_moduli": "[300.0, 200.0, 100.0]",
                     "materials.soft.branch_times": "[0.001, 0.01, 1.0]"},
    "viscoelastic_plane_stress": {"materials.soft.model": '"viscoelastic"', "materials.soft.plane": '"stress"',
                                  "materials.soft.branch_moduli": "[300.0]", "materials.soft.branch_times": "[0.01]"},
    "initial_pressure": {"bodies.0.initial_pressure": 50.0, "bodies.1.initial_pressure": -20.0},
    "driven": {"drive": "[{ ids = [1], velocity = [-1.0, 0.0], angular_velocity = 2.0 }]"},
    "periodic": {"domain.periodic": "[true, true]", "domain.upper": "[0.8, 0.8]", "domain.cells": "[20, 20]"},
    "deforming": {"domain.periodic": "[true, true]", "domain.upper": "[0.8, 0.8]", "domain.cells": "[20, 20]",
                  "domain.deform": "{ x = { strain_rate = -1.0 }, y = { stress = -200.0 } }"},
    "gravity_on_wall": {"boundary.bottom": '{ type = "wall", friction = 0.3 }', "domain.gravity": "[0.0, -9.0]",
                        "bodies.0.shape.centre": "[0.3537, 0.2013]"},
    "fixed_and_symmetry": {"boundary": '{ bottom = { type = "fixed", velocity = [0.5, 0.0] }, '
                                       'left = { type = "symmetry" } }', "bodies.0.shape.centre": "[0.1537, 0.1613]"},
}

hdf5_lock = threading.Lock()


def run(program: Program, case: Path, settings: dict, out: Path, ranks: int) -> list[str]:
    """Runs a case; returns what went wrong."""
    done = program("run", case, "--out", out, *sets(settings), ranks=ranks)
    if done.code == 0 and f"ranks={ranks}" in done.last:
        return []
    return [f"{out.name}: exit code {done.code}\n{done.err or done.out[-500:]}"]


def differences(a: Path, b: Path) -> list[str]:
    """How the results in folder b differ from those in a."""
    in_a, in_b = compare_runs.result_files(a), compare_runs.result_files(b)
    if in_a != in_b or not in_a:
        return [f"{b.name}: files {sorted(in_a ^ in_b)} are in one of {a.name} and {b.name} only"]
    with hdf5_lock:  # HDF5 serves one thread at a time
        found = [(name, compare_runs.compare_files(a / name, b / name)) for name in sorted(in_a)]
    return [f"{b.name}: {name}: {line}" for name, lines in found for line in lines][:MOST_LINES]


def run_and_compare(program: Program, case: Path, settings: dict, reference: Path, out: Path, ranks: int) -> list[str]:
    problems = run(program, case, settings, out, ranks) or differences(reference, out)
    if not problems:
        shutil.rmtree(out)
    return problems


def column(file: Path, name: str) -> np.ndarray:
    """A column of a CSV table with a header."""
    lines = file.read_text().splitlines()
    place = lines[0].split(",").index(name)
    return np.array([float(line.split(",")[place]) for line in lines[1:]])


def patches_of_points(folder: Path, file: Path, patch_cells: int) -> dict[int, tuple]:
    """The patch of every point, by id."""
    domain = tomllib.loads((folder / "case.toml").read_text())["domain"]
    lower, upper, cells = (np.array(domain[key], float) for key in ("lower", "upper", "cells"))
    with h5py.File(file) as data:
        x, ids = data["position"][:, : len(lower)], data["id"][:]
    patch = ((x - lower) / (upper - lower) * cells // patch_cells).astype(int)
    return dict(zip(ids.tolist(), map(tuple, patch.tolist())))


def check_content(name: str, folder: Path, settings: dict) -> list[str]:
    """A comparison says something only if the run holds migration, contact and motion."""
    problems = []
    particles = sorted(folder.glob("particles_*.vtkhdf"))
    cells = settings["domain.patch_cells"]
    start, end = (patches_of_points(folder, file, cells) for file in (particles[0], particles[-1]))
    crossed = sum(start[point] != end[point] for point in start)
    if sorted(start) != sorted(end) or len(set(start)) != len(start):
        problems.append("points were lost, or ids are not unique")
    if crossed < 100:
        problems.append(f"only {crossed} points crossed patches")
    if column(folder / "history.csv", "contact_nodes").max() < 20:
        problems.append("there was hardly any contact")
    if column(folder / "history.csv", "contact_dissipation")[-1] <= 0:
        problems.append("contact dissipated nothing")
    with h5py.File(sorted(folder.glob("contacts_*.h5"))[-1]) as data:
        if len(data["body_a"]) < 5:
            problems.append("the last contacts file holds fewer than 5 pairs")
    if len(set(column(folder / "bodies.csv", "body"))) != 3:
        problems.append("bodies.csv does not hold the three tracked bodies")
    return [f"{name}: {p}" for p in problems]


def whole_cases(program: Program, scratch: Path, pool) -> list[str]:
    """Both cases on all layouts, and their resolved text again."""
    problems, waiting = [], []
    for name, settings in CASES.items():
        case, reference = ROOT / "cases" / f"{name}.toml", scratch / f"{name}_1"
        failed = run(program, case, settings, reference, 1)
        problems += failed or check_content(name, reference, settings)
        if failed:
            continue
        resolved = reference / "case.toml"
        waiting.append(pool.submit(run_and_compare, program, resolved, {}, reference, scratch / f"{name}_again", 2))
        for ranks, partition in LAYOUTS:
            changed = settings | {"parallel.partition": f'"{partition}"'}
            out = scratch / f"{name}_{ranks}_{partition}"
            waiting.append(pool.submit(run_and_compare, program, case, changed, reference, out, ranks))
    return problems + [line for job in waiting for line in job.result()]


def methods() -> dict[str, dict]:
    """Every combination of shape functions, stress update and release, and the variations."""
    result = {f"{shape}_{update}_{release}": {"solver.shape": f'"{shape}"', "solver.stress_update": f'"{update}"',
                                              "contact.release": f'"{release}"'}
              for shape, update, release in itertools.product(SHAPES, STRESS_UPDATES, RELEASES)}
    return result | VARIATIONS


def one_method(program: Program, scratch: Path, name: str, changes: dict) -> list[str]:
    """Two disks with one choice of method, on 1 and 2 ranks."""
    case, settings = ROOT / "cases" / "two_disks.toml", DISKS | changes
    reference = scratch / f"{name}_1"
    problems = run(program, case, settings, reference, 1)
    if not problems and changes.get("contact.law") != '"none"':
        if column(reference / "history.csv", "contact_nodes").max() < 3:
            problems.append(f"{name}: the disks did not meet")
    alternating = settings | {"parallel.partition": '"round_robin"'}
    return problems or run_and_compare(program, case, alternating, reference, scratch / f"{name}_2", 2)


def same_results(scratch: Path, names) -> list[str]:
    """Methods whose results are those of another one: the option had no effect, or the collision did not show it."""
    seen, problems = {}, []
    for name in names:
        if name == "stick":
            continue  # bodies that are held together throughout move as with no_slip
        history = (scratch / f"{name}_1" / "history.csv").read_bytes()
        if history in seen:
            problems.append(f"{name} gave the same as {seen[history]}")
        seen.setdefault(history, name)
    return problems


def main() -> int:
    program, scratch = Program(sys.argv[1]), fresh_folder(sys.argv[2])
    start = time.monotonic()
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        problems = whole_cases(program, scratch, pool)
        middle = time.monotonic()
        jobs = [pool.submit(one_method, program, scratch, *method) for method in methods().items()]
        failed = [line for job in jobs for line in job.result()]
    problems += failed or same_results(scratch, methods())
    print("\n".join(problems))
    print(f"{len(problems)} problems; cases {middle - start:.0f} s, methods {time.monotonic() - middle:.0f} s")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
