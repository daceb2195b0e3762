"""The test programs of cases/laboratory: the book of momentum closes in every step, and what is known comes out.

    test_laboratory.py CAIRN SCRATCH
"""

import importlib.util
import subprocess
import sys
from pathlib import Path

from harness import PATIENCE, ROOT, SKIP, Program, expect, expect_code, fresh_folder, load_compare_runs, run_tests, sets

for package in ("numpy", "h5py", "matplotlib"):
    if importlib.util.find_spec(package) is None:
        print(f"Python lacks {package}")
        sys.exit(SKIP)

import numpy as np  # noqa: E402  after the check that they are there

sys.path.insert(0, str(ROOT / "scripts"))

from measuring.snapshot import Snapshot  # noqa: E402
from results import Run  # noqa: E402

CASES = ROOT / "cases" / "laboratory"
EVERY_STEP = {"output.forces": "{ every = 1 }", "output.history": "{ every = 1 }", "output.particles": "{}",
              "output.contacts": "{}", "output.grains": "{ every = 100000 }"}


def run(cairn: Program, here: Path, case: str, settings: dict, ranks: int = 1) -> Run:
    expect_code(cairn("run", CASES / f"{case}.toml", "--out", here / case, *sets(settings), ranks=ranks, timeout=400), 0)
    return Run(here / case)


def books(found: Run) -> tuple[np.ndarray, np.ndarray]:
    """Of each step: by how much momentum changed beyond what tools and gravity gave, over the sum of the sizes of all
    that acted in it; and the sum of the sizes of the tools' impulses so far."""
    history, tools = found.history(), found.forces()
    axes = "xyz"[: found.dimension]
    rigid = history["mass"][0] - Snapshot(found, 0).grains.mass.sum()
    mass = history["mass"] - rigid
    momentum = np.array([history[f"momentum_{a}"] + history[f"momentum_left_{a}"] for a in axes])
    impulses = np.array([[table[f"impulse_{a}"] for a in axes] for table in tools.values()])
    given = -np.diff(impulses, axis=2)
    weight = found.gravity[:, None] * mass[:-1] * np.diff(history["time"])
    rest = np.diff(momentum, axis=1) - given.sum(axis=0) - weight
    acted = np.abs(momentum).max() + np.abs(given).sum(axis=(0, 1)) + np.abs(weight).sum(axis=0)
    return np.abs(rest).max(axis=0) / acted, np.abs(given).sum(axis=(0, 1)).cumsum()


def test_momentum_of_each_step(cairn: Program, here: Path):
    """Forces of tools and gravity are the whole change of momentum to 1e-12, in each test program, in every step."""
    press = {"drive.0.velocity": "[0.0, -0.3]"}
    fall = {"grains.0.velocity": "[0.0, -3.0]", "domain.lower": "[-0.2, -0.42]", "domain.cells": "[50, 71]"}
    programs = {"oedometer": (200, press), "die": (200, press), "isotropic": (350, {}), "biaxial": (300, {}),
                "plane_shear": (200, {}), "soft_disks": (250, {"drive.0.velocity": "[0.0, -0.4]"}),
                "column_collapse": (300, {}), "hopper": (650, fall)}
    others = {"cell", "triaxial"}  # without tools: test_cell, test_triaxial
    expect(set(programs) | others == {path.stem for path in CASES.glob("*.toml")}, "cases")
    for name, (steps, more) in programs.items():
        found = run(cairn, here, name, EVERY_STEP | {"time.steps": steps} | more)
        rest, impulse = books(found)
        expect(rest.max() < 1e-12, f"{name}: {rest.max()} in step {rest.argmax()}")
        expect(impulse[-1] > 0, f"{name}: no tool was touched")
    history = found.history()  # the hopper's
    expect(history["mass_left"][-1] > 0, "nothing left the hopper")
    total = history["mass"] + history["mass_left"]
    expect(np.abs(total / total[0] - 1).max() < 1e-12, "mass was lost")


def test_cell(cairn: Program, here: Path):
    """A periodic domain without tools: compressed to a pressure, its stress held, then sheared; books close, and it goes
    on from a checkpoint on another number of ranks to the same bits."""
    settings = {"output.particles": "{}", "output.contacts": "{ interval = 0.05 }", "output.grains": "{ interval = 0.05 }",
                "output.checkpoint": "{ every = 700, keep = 9 }", "stage.2.until.strain": 0.05}
    found = run(cairn, here, "cell", settings)
    history = found.history()
    x, y = (history[f"length_{axis}"] for axis in "xy")
    held = (history["time"] > 0.45) & (history["time"] > history["time"][np.argmax(x < 0.56)] + 0.2)
    stress = history["stress_xx"][held]
    print(f"cell: sigma_xx {stress.mean():.0f} Pa, rms {np.sqrt(((stress / -2000 - 1)**2).mean()):.2%}, "
          f"energy error {np.abs(history['energy_error']).max():.1e}")
    expect(abs(stress.mean() / -2000 - 1) < 0.02, f"the stress held is {stress.mean()}")
    expect(y[-1] < 0.97 * 0.56 and x[-1] > x.min(), f"it was not sheared: {x[-1]}, {y[-1]}")
    expect(np.abs(history["energy_error"][10:]).max() < 1e-3, "the energy book")
    expect(np.abs([history["momentum_x"], history["momentum_y"]]).max() < 1e-9, "momentum")
    out = here / "again"
    expect_code(cairn("run", CASES / "cell.toml", "--out", out, "--restart", found.folder / "checkpoint_000000.h5",
                      *sets(settings), ranks=2, timeout=400), 0)
    last = sorted(found.folder.glob("grains_*.h5"))[-1].name
    different = load_compare_runs().compare_files(found.folder / last, out / last)
    expect(not different, f"after a restart {different}")


def test_triaxial(cairn: Program, here: Path):
    """Spheres in a domain that shortens along all axes: the lengths are those of the rate, stresses are pressures."""
    found = run(cairn, here, "triaxial", {"output": "{ history = { every = 10 } }", "domain.deform.y.strain_rate": -1.0,
                                          "time.end": 0.1})
    history = found.history()
    for axis, rate in zip("xyz", (-0.5, -1.0, -0.5)):
        length = 0.4 * np.exp(rate * history["time"])
        expect(np.abs(history[f"length_{axis}"] / length - 1).max() < 1e-6, f"length_{axis}")
        expect(history[f"stress_{axis}{axis}"][-1] < -30, f"stress_{axis}{axis}")
    expect(np.abs(history["energy_error"][-5:]).max() < 5e-3, f"{history['energy_error']}")


YOUNGS, POISSON, SIDE, MOST, LEAST = 2.0e5, 0.3, 0.6, 0.009, 0.003  # of a block in the oedometer, and the lid's ways
MODULUS = YOUNGS * (1 - POISSON) / ((1 + POISSON) * (1 - 2 * POISSON))
SWING = 4 * SIDE * (1000.0 / MODULUS) ** 0.5  # of the block by itself [s]: what takes as long does not excite it


def block(cairn: Program, here: Path, cells: int) -> list[np.ndarray]:
    """A block in place of the disks, pressed, let go by a part, pressed again, and held each time: strain, pressure on
    the lid and on the right wall, in the mean over a swing."""
    rows, time = [[0.0, 0.0, 0.0]], 0.0
    for way in (-MOST, MOST - LEAST, LEAST - MOST):
        speed = way / (2 * SWING)
        rows += [[time + n * SWING, 0.0, v] for n, v in ((1, speed), (2, speed), (3, 0.0), (5, 0.0))]
        time += 5 * SWING
    bodies = ["{ shape = { type = 'box', lower = [0.0, 0.0], upper = [0.6, 0.6] }, material = 'grain' }",
              "{ shape = { type = 'box', lower = [0.0, 0.6], upper = [0.6, 0.75] }, material = 'steel', group = 'lid' }"]
    settings = {"grains": "[]", "bodies": f"[{', '.join(bodies)}]", "materials.grain": "{ model = 'hypoelastic', "
                f"density = 1000.0, youngs_modulus = {YOUNGS}, poissons_ratio = {POISSON} }}", "contact.friction": 0.0,
                "domain.cells": [cells, cells * 5 // 4], "time.end": time, "drive.0.velocity": rows,
                "output.forces": "{ every = 5 }", "output.particles": "{}", "output.grains": "{}", "output.contacts": "{}"}
    (here / str(cells)).mkdir()
    tools = run(cairn, here / str(cells), "oedometer", settings).forces()
    found = []
    for when in (np.array([5 * n - 1.25, 5 * n - 0.25]) * SWING for n in (1, 2, 3)):
        lid = tools["lid"]
        strain = (lid["y"][0] - np.interp(when[1], lid["time"], lid["y"])) / SIDE
        force, lateral = (abs(np.diff(np.interp(when, tools[name]["time"], tools[name][f"impulse_{axis}"]))[0]) / SWING
                          for name, axis in (("lid", "y"), ("right", "x")))
        found.append(np.array([strain, force / SIDE, lateral / (SIDE * (1 - strain))]))
    return found


def test_oedometer_modulus(cairn: Program, here: Path):
    """The stiffness of an elastic block is E (1 - nu) / ((1 + nu) (1 - 2 nu)), and the walls bear nu / (1 - nu) of it. A
    wall feels the block's strain a share of a cell within: that error goes with the size of the cells and is taken
    away by two of them. After it was let go and pressed again the force is the same."""
    moduli, ratios = [], []
    for cells in (16, 32):
        pressed, released, again = block(cairn, here, cells)
        moduli.append((pressed[1] - released[1]) / (pressed[0] - released[0]) / MODULUS)
        ratios.append(pressed[2] / pressed[1] / (POISSON / (1 - POISSON)))
    print(f"oedometer: moduli {moduli}, lateral {ratios}, again {again[1] / pressed[1] - 1:.1e}")
    expect(abs(again[1] / pressed[1] - 1) < 1e-3, f"{again[1]} Pa after {pressed[1]} Pa")
    for values, bar in ((moduli, 0.01), (ratios, 0.02)):
        expect(abs(2 * values[1] - values[0] - 1) < bar and abs(values[1] - 1) < 0.05, f"{values}")


def test_pictures(cairn: Program, here: Path):
    """One command draws what a test program is for."""
    interval = "{ interval = 0.02 }"
    found = run(cairn, here, "isotropic", {"time.end": 0.2, "output.grains": interval, "output.contacts": interval})
    done = subprocess.run([ROOT / "scripts" / "plot", found.folder], capture_output=True, text=True, check=False,
                          timeout=300 * PATIENCE)
    expect(done.returncode == 0 and "Warning" not in done.stderr, done.stdout + done.stderr)
    for name in ("force_displacement", "stress_strain", "coordination", "force_distribution", "fabric_rose", "profiles"):
        expect((found.folder / "pictures" / f"{name}.png").stat().st_size > 10_000, f"{name}: {done.stdout}")


def main() -> int:
    return run_tests(globals(), Program(sys.argv[1]), fresh_folder(sys.argv[2]))


if __name__ == "__main__":
    sys.exit(main())
