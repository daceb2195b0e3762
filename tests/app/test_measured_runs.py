"""scripts/measure on results of the program: Love and Weber's stress is the mean over the points, at rest and in motion.

    test_measured_runs.py CAIRN SCRATCH
"""

import importlib.util
import sys
from pathlib import Path

from harness import ROOT, SKIP, Program, expect, expect_code, fresh_folder, run_tests, sets

for package in ("numpy", "h5py", "matplotlib"):
    if importlib.util.find_spec(package) is None:
        print(f"Python lacks {package}")
        sys.exit(SKIP)

import numpy as np  # noqa: E402  after the check that they are there

sys.path.insert(0, str(ROOT / "scripts"))

from made_up_runs import close  # noqa: E402
from measuring import collect, stress  # noqa: E402
from measuring.snapshot import Snapshot  # noqa: E402
from results import Run  # noqa: E402

STILL = """
[domain]
upper = [0.45, 0.45]
cells = [36, 36]
gravity = [0.0, -9.81]
[time]
end = 0.8
[contact]
friction = 0.3
[materials.rubber]
model = "viscoelastic"
density = 1000.0
shear_modulus = 2.0e4
bulk_modulus = 8.0e4
branch_moduli = [4.0e4]
branch_times = [0.02]
[materials.steel]
model = "rigid"
[[grains]]
file = "still.csv"
material = "rubber"
[[bodies]]
shape = { type = "box", lower = [0.055, 0.375], upper = [0.395, 0.425] }
material = "steel"
[[bodies]]
shape = { type = "box", lower = [0.0, 0.0], upper = [0.45, 0.05] }
material = "steel"
[[bodies]]
shape = { type = "box", lower = [0.0, 0.05], upper = [0.05, 0.45] }
material = "steel"
[[bodies]]
shape = { type = "box", lower = [0.4, 0.05], upper = [0.45, 0.45] }
material = "steel"
[[drive]]
ids = [0]
velocity = [[0.0, 0.0, 0.0], [0.05, 0.0, -0.2], [0.2, 0.0, -0.2], [0.25, 0.0, 0.0]]
[output]
forces = { every = 50 }
grains = { interval = 0.4 }
contacts = { interval = 0.4 }
particles = { interval = 0.4 }
"""
PLACES = ((0.107, 0.1065), (0.225, 0.1065), (0.343, 0.1065), (0.166, 0.203), (0.284, 0.203), (0.107, 0.3), (0.225, 0.3),
          (0.343, 0.3))


def test_stress_of_contacts_is_that_of_the_volume(cairn: Program, here: Path):
    """Eight disks pressed by a lid, at rest: Love and Weber's stress is the mean over the points, of each and of all;
    the columns of the grain file are sums over the points."""
    (here / "still.csv").write_text("x,y,r\n" + "".join(f"{x},{y},0.056\n" for x, y in PLACES))
    (here / "still.toml").write_text(STILL)
    expect_code(cairn("run", here / "still.toml", "--out", here / "out", timeout=400), 0)
    snapshot = Snapshot(Run(here / "out"), -1)
    grains, points = snapshot.grains, snapshot.points
    expect(len(grains) == 8 and (grains.body >= 4).all(), f"grains {grains.body}")
    size = np.linalg.norm(grains.stress, axis=(1, 2))
    of_contacts = stress.grain_moments(snapshot) / grains.volume[:, None, None]
    errors = np.abs(of_contacts - grains.stress).max(axis=(1, 2)) / size
    expect(errors.max() < 0.01, f"grains: {errors}")
    box = snapshot.box
    close(np.concatenate(box), np.array([0.05, 0.05, 0.4, 0.335]), 1e-3, "the box")
    volume = float(np.prod(box[1] - box[0]))
    of_volume = stress.cell_volume_stress(grains, volume)
    for of_contacts in (stress.cell_contact_stress(snapshot, volume), stress.boundary_moment(snapshot) / volume):
        error = np.abs(of_contacts - of_volume).max() / np.linalg.norm(of_volume)
        limit = 1e-3 if snapshot.run.contacts[-1].has("moment") else 2e-3
        expect(error < limit, f"cell: {error}")
    expect(stress.unbalance(snapshot).max() < 1e-3, f"unbalance {stress.unbalance(snapshot)}")
    body, mass, V = points.field("body"), points.field("mass"), points.field("volume")
    for k, number in enumerate(grains.body):
        mine = body == number
        close(grains.volume[k], V[mine].sum(), 1e-10)
        r = points.field("position")[mine][:, :2] - grains.centre[k]
        second = np.einsum("p,pi,pj->ij", mass[mine], r, r) + np.eye(2) * (mass[mine] * V[mine] / 12).sum()
        close(grains.second_moment[k], second / mass[mine].sum(), 1e-10)
    found, _ = collect.measures(snapshot, collect.Options())
    close(found["packing_fraction"], grains.volume.sum() / volume)
    expect(0.8 < found["least_aspect"] < 0.99 and 0.97 < found["least_circularity"] < 1.001, found)
    expect(found["rattlers"] == 0 and found["granular_temperature"] < 1e-5, found)


SPHERE = """
[domain]
dimension = 3
upper = [0.15, 0.1875, 0.15]
cells = [12, 15, 12]
[time]
end = 0.4
[contact]
friction = 0.3
[materials.rubber]
model = "viscoelastic"
density = 1000.0
shear_modulus = 2.0e4
bulk_modulus = 8.0e4
branch_moduli = [4.0e4]
branch_times = [0.02]
[materials.steel]
model = "rigid"
[[bodies]]
shape = { type = "box", lower = [0.0, 0.0, 0.0], upper = [0.15, 0.0375, 0.15] }
material = "steel"
[[bodies]]
shape = { type = "box", lower = [0.0, 0.1375, 0.0], upper = [0.15, 0.175, 0.15] }
material = "steel"
[[bodies]]
shape = { type = "sphere", centre = [0.077, 0.0875, 0.074], radius = 0.05 }
material = "rubber"
[[drive]]
ids = [1]
velocity = [[0.0, 0.0, 0.0, 0.0], [0.05, 0.0, -0.12, 0.0], [0.1, 0.0, -0.12, 0.0], [0.15, 0.0, 0.0, 0.0]]
[output]
grains = { interval = 0.1 }
contacts = { interval = 0.1 }
"""


def test_stress_of_a_pressed_sphere(cairn: Program, here: Path):
    """The same in three dimensions: a sphere between plates, its stress, shape and volume."""
    (here / "sphere.toml").write_text(SPHERE)
    expect_code(cairn("run", here / "sphere.toml", "--out", here / "out", timeout=400), 0)
    run = Run(here / "out")
    first, snapshot = Snapshot(run, 0), Snapshot(run, -1)
    grains = snapshot.grains
    expect(list(grains.body) == [2] and len(snapshot.contacts) == 2, f"{grains.body}, {snapshot.contacts}")
    difference = stress.grain_moments(snapshot)[0] / grains.volume[0] - grains.stress[0]
    if not snapshot.run.contacts[-1].has("moment"):  # friction that draws a wide contact together is in no force at a point
        difference = difference[1, 1]
    error = np.abs(difference).max() / np.linalg.norm(grains.stress)
    expect(error < 0.01, f"{error}")
    start, _ = collect.measures(first, collect.Options(), ("shape", "packing"))
    found, _ = collect.measures(snapshot, collect.Options())
    expect(abs(start["mean_circularity"] - 1) < 0.01 and start["mean_aspect"] > 0.99, start)
    close(start["volume"], 4 / 3 * np.pi * 0.05**3, 0.01)
    expect(0.8 < found["mean_aspect"] < 0.97 and found["mean_circularity"] < start["mean_circularity"], found)
    close(found["box_upper_y"] - found["box_lower_y"], 0.1 - 0.012, 1e-3, "the gap between the plates")


def test_stress_in_motion(cairn: Program, here: Path):
    """Two disks collide: what contact and volume differ by is the inertia and the motion within, within 1 %."""
    case = ROOT / "cases" / "two_disks.toml"
    every = "{ every = 1 }"
    found = cairn("run", case, "--out", here / "first", *sets({"output.particles": "{}", "output.checkpoint": "{}",
                                                               "output.grains": "{ every = 10 }"}), timeout=300)
    expect_code(found, 0)
    run = Run(here / "first")
    pressed = [np.abs(Snapshot(run, k).grains.stress).max() for k in range(len(run.grains))]
    peak = run.grains[int(np.argmax(pressed))].step
    settings = {"time.steps": peak + 20, "output.particles": every, "output.grains": every, "output.contacts": every,
                "output.checkpoint": "{}"}
    expect_code(cairn("run", case, "--out", here / "second", *sets(settings), timeout=300), 0)
    run = Run(here / "second")
    snapshots = [Snapshot(run, k) for k in range(peak - 60, len(run.grains))]
    of_volume, of_contacts, flux = (np.mean(rows, axis=0) for rows in (
        [s.grains.volume[:, None, None] * s.grains.stress for s in snapshots],
        [stress.grain_moments(s) for s in snapshots[1:]], [stress.motion_within(s)[1] for s in snapshots]))
    change = stress.motion_within(snapshots[-1])[0] - stress.motion_within(snapshots[0])[0]
    whole = of_contacts - change / (snapshots[-1].time - snapshots[0].time) + flux

    def symmetric(tensor):
        return (tensor + np.swapaxes(tensor, 1, 2)) / 2

    size = np.linalg.norm(of_volume, axis=(1, 2))
    bare = np.abs(symmetric(of_contacts) - of_volume).max(axis=(1, 2)) / size
    error = np.abs(symmetric(whole) - of_volume).max(axis=(1, 2)) / size
    expect(error.max() < 0.01, f"{error}, of the contacts alone {bare}")
    expect(bare.max() > 2 * error.max(), f"inertia plays no part: {bare}, {error}")


def main() -> int:
    return run_tests(globals(), Program(sys.argv[1]), fresh_folder(sys.argv[2]))


if __name__ == "__main__":
    sys.exit(main())
