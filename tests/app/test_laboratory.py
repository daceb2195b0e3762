"""The test programs of cases/laboratory: the book of momentum closes in every step, and what is known comes out.

    test_laboratory.py CAIRN SCRATCH
"""

import importlib.util
import subprocess
import sys
from pathlib import Path

from harness import PATIENCE, ROOT, SKIP, Program, expect, expect_code, fresh_folder, run_tests, sets

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
                "plane_shear": (200, {}), "column_collapse": (300, {}), "hopper": (650, fall)}
    expect(set(programs) == {path.stem for path in CASES.glob("*.toml")}, "cases")
    for name, (steps, more) in programs.items():
        found = run(cairn, here, name, EVERY_STEP | {"time.steps": steps} | more)
        rest, impulse = books(found)
        expect(rest.max() < 1e-12, f"{name}: {rest.max()} in step {rest.argmax()}")
        expect(impulse[-1] > 0, f"{name}: no tool was touched")
    history = found.history()  # the hopper's
    expect(history["mass_left"][-1] > 0, "nothing left the hopper")
    total = history["mass"] + history["mass_left"]
    expect(np.abs(total / total[0] - 1).max() < 1e-12, "mass was lost")


def test_oedometer_modulus(cairn: Program, here: Path):
    """With an elastic block in place of the disks: the stiffness is E (1 - nu) / ((1 + nu) (1 - 2 nu)), loaded, let go
    and loaded again, and the walls bear nu / (1 - nu) of it."""
    E, nu, width, height, down = 2.0e5, 0.3, 0.6, 0.6, 0.006
    settings = {"grains": "[]", "bodies": "[{ shape = { type = 'box', lower = [0.0, 0.0], upper = [0.6, 0.6] }, material = 'grain' }, "
                "{ shape = { type = 'box', lower = [0.0, 0.6], upper = [0.6, 0.675] }, material = 'steel', group = 'lid' }]",
                "materials.grain": f"{{ model = 'hypoelastic', density = 1000.0, youngs_modulus = {E}, poissons_ratio = {nu} }}",
                "domain.cells": "[16, 20]", "contact.friction": 0.0, "time.end": 1.2, "output.forces": "{ every = 5 }",
                "drive.0.velocity": f"[[0.0, 0.0, 0.0], [0.2, 0.0, {-down / 0.2}], [0.3, 0.0, {-down / 0.2}], [0.5, 0.0, 0.0], "
                f"[0.6, 0.0, {down / 0.2}], [0.7, 0.0, {down / 0.2}], [0.8, 0.0, 0.0], [0.9, 0.0, {-down / 0.2}], "
                f"[1.0, 0.0, {-down / 0.2}], [1.1, 0.0, 0.0]]", "output.particles": "{}", "output.grains": "{}",
                "output.contacts": "{}"}
    tools = run(cairn, here, "oedometer", settings).forces()
    lid, side = tools["lid"], tools["right"]
    strain = (lid["y"][0] - lid["y"]) / height
    modulus = E * (1 - nu) / ((1 + nu) * (1 - 2 * nu))
    for start, end in ((0.45, 0.5), (1.15, 1.2)):  # held, after the first and the second loading
        chosen = (lid["time"] >= start) & (lid["time"] <= end)
        pressure = np.mean(lid["fy"][chosen]) / width
        expect(abs(pressure / (modulus * strain[chosen].mean()) - 1) < 0.01, f"{pressure} Pa at {strain[chosen].mean()}")
        ratio = np.mean(side["fx"][chosen]) / (height * (1 - strain[chosen].mean())) / pressure
        expect(abs(ratio / (nu / (1 - nu)) - 1) < 0.02, f"lateral stress {ratio}")


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
