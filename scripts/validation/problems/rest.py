"""Bodies that are dropped and left alone come to rest: disks and spheres on walls, on each other, in corners, in heaps.

What must be so: the mean of the kinetic energy over a second falls from one to the next; contact gives no energy; no
point moves much faster than its body; steps stay as long as at the start; spheres do not sink into each other.
"""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import h5py
import numpy as np

from results import Run as Results
from validation.checks import Check, below, record
from validation.figures import Curve, Panel, draw_panels
from validation.problems.walls import gain_checks
from validation.runs import Run
from validation.series import Table, history
from validation.suite import Folders, Problem

RADIUS, DENSITY, GRAVITY = 0.05, 1000.0, 9.81  # SI
DROP = 0.005  # [m]
STILL = 1e-9  # of the largest kinetic energy: below it nothing need fall any more
LIMITS = {3.0: 1e-2, 20.0: 1e-3}  # of the largest kinetic energy, in the mean over a quarter of a second, by time [s]
FASTEST = 20.0  # fastest point over fastest body
OVERLAP = 0.1  # of two spheres, over the radius
MATERIALS = {
    "elastic": {},
    "plastic": {"materials.soft": '{ model = "von_mises", density = 1000.0, youngs_modulus = 1.0e5, '
                                  'poissons_ratio = 0.3, yield_stress = 1000.0 }'},
    "viscous": {"materials.soft": '{ model = "viscoelastic", density = 1000.0, shear_modulus = 2.0e4, '
                                  'bulk_modulus = 8.0e4, branch_moduli = [2.0e4], branch_times = [0.05] }'}}


@dataclasses.dataclass(frozen=True)
class Heap:
    """Bodies, the cells to a radius, and how long they are watched, quickly and fully [s]."""

    rows: tuple[int, ...]
    cells: int
    friction: float
    seconds: tuple[float, float]  # 0: not among the quick ones
    material: str = "elastic"
    spheres: bool = False
    cost: float = 1.0  # of a second [s]

    @property
    def count(self) -> int:
        return sum(self.rows)


# Spheres lie in layers, square ones, of so many; the others in rows.
HEAPS = {
    "one disk in the corner, R/4": Heap((1,), 4, 0.5, (3, 60), cost=0.2),
    "one disk in the corner, R/8": Heap((1,), 8, 0.5, (0, 20), cost=1.5),
    "5 disks, 1 row, mu 0": Heap((5,), 4, 0.0, (3, 60)),
    "5 disks, 1 row, mu 0.5": Heap((5,), 4, 0.5, (0, 60)),
    "5 disks, 2 rows, mu 0": Heap((3, 2), 4, 0.0, (0, 60)),
    "5 disks, 2 rows, mu 0.5": Heap((3, 2), 4, 0.5, (3, 60)),
    "5 disks, 2 rows, plastic": Heap((3, 2), 4, 0.5, (0, 20), "plastic"),
    "5 disks, 2 rows, viscous": Heap((3, 2), 4, 0.5, (0, 20), "viscous"),
    "30 disks, 6 rows, mu 0.5": Heap((5,) * 6, 4, 0.5, (3, 20), cost=6),
    "300 disks, mu 0.5": Heap((15,) * 20, 4, 0.5, (0, 6), cost=60),
    "8 spheres, mu 0.5": Heap((4, 4), 3, 0.5, (2, 20), spheres=True, cost=12),
    "30 spheres, mu 0.5": Heap((9, 9, 9, 3), 3, 0.5, (0, 20), spheres=True, cost=50),
    "60 spheres, mu 0.5": Heap((16, 16, 16, 12), 3, 0.5, (0, 5), spheres=True, cost=110),
}


def centres(heap: Heap) -> np.ndarray:
    """Where the bodies start: every other row, or layer, is shifted, and nothing touches."""
    pitch, random = 2.1 * RADIUS, np.random.default_rng(7)
    found = []
    for level, count in enumerate(heap.rows):
        side = math.ceil(math.sqrt(heap.rows[0])) if heap.spheres else count
        for k in range(count):
            shift = (level % 2) * (0.2 if heap.spheres else 0.5)
            along = [k % side, k // side] if heap.spheres else [k]
            place = [RADIUS * 1.1 + pitch * (place + shift) for place in along]
            place.insert(1, RADIUS + DROP + level * pitch)
            if heap.spheres or len(heap.rows) > 6:  # a lattice would stand
                place = [x + random.uniform(0, 0.05) * RADIUS for x in place]
            found.append(place)
    return np.array(found)


def run(heap: Heap, seconds: float) -> Run:
    """A box just wide enough; on a rigid floor, whose force is known, where many are poured."""
    cell, places, dimension = RADIUS / heap.cells, centres(heap), 3 if heap.spheres else 2
    upper = [math.ceil(round((x + 1.15 * RADIUS) / cell, 6)) * cell for x in places.max(axis=0)]
    kind, poured = ("sphere" if heap.spheres else "disk"), heap.count > 50
    lower = [0.0] * dimension
    bodies = [f'{{ shape = {{ type = "{kind}", centre = {[round(float(x), 6) for x in place]}, radius = {RADIUS} }}, '
              'material = "soft" }' for place in places]
    changes = dict(MATERIALS[heap.material])
    walls = ["left", "right", "bottom", *(("back", "front") if heap.spheres else ())]
    if poured:
        lower[1] = -4 * cell
        changes["materials.floor"] = '{ model = "rigid", density = 1000.0 }'
        end = [upper[0], 0.0, *upper[2:]]
        bodies.append(f'{{ shape = {{ type = "box", lower = {lower}, upper = {end} }}, material = "floor" }}')
        walls.remove("bottom")
    faces = [f'{face} = {{ type = "wall", friction = {heap.friction} }}' for face in walls]
    changes["boundary"] = f"{{ {', '.join(faces)} }}"
    return Run("validation/rest_spheres" if heap.spheres else "validation/rest", changes | {
        "domain.lower": lower, "domain.upper": upper, "domain.cell_size": cell, "time.end": seconds,
        "contact.friction": heap.friction, "bodies": f"[{', '.join(bodies)}]"}, heap.cost * seconds)


def runs(full: bool) -> dict[str, Run]:
    chosen = {name: heap.seconds[full] for name, heap in HEAPS.items()}
    return {name: run(HEAPS[name], seconds) for name, seconds in chosen.items() if seconds}


def mean_over(table: Table, start: float, end: float) -> float:
    """The mean kinetic energy of the rows between two times [J]."""
    inside = (table["time"] >= start) & (table["time"] < end)
    return float(table["kinetic_energy"][inside].mean())


def energy_checks(case: str, table: Table) -> list[Check]:
    largest, last = table["kinetic_energy"].max(), table["time"][-1]
    means = np.array([mean_over(table, second, second + 1) for second in range(int(last))]) / largest
    growth = [after / before for before, after in zip(means, means[1:]) if after > STILL]
    found = [below(case, "kinetic energy, a second's mean over that of the one before: largest",
                   max(growth, default=0.0), 1.0)]
    for time, limit in LIMITS.items():
        if time <= last + 1e-9:
            found.append(below(case, f"kinetic energy at {time:g} s over its largest",
                               mean_over(table, time - 0.25, time + 1e-9) / largest, limit))
    start = np.median(table["dt"][1:6])
    return found + [Check(case, "least dt over that at the start", table["dt"][1:-1].min() / start, 0.9, 1.1),
                    # Before bodies land all energies are small, and errors relative to them large.
                    below(case, "largest energy_error after 0.1 s",
                          np.abs(table["energy_error"][table["time"] > 0.1]).max(), 0.01)]


def body_table(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Centres and speeds of the bodies of a grain file, by body."""
    with h5py.File(path) as file:
        order = np.argsort(file["body"][()])
        return file["centre"][()][order], np.linalg.norm(file["velocity"][()][order], axis=1)


def speeds(folder: Path, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """At every output: time, fastest point, fastest body [m/s]."""
    rows = []
    for frame, path in zip(Results(folder).frames, sorted(folder.glob("grains_*.h5"))):
        speed = np.linalg.norm(frame.field("velocity"), axis=1)[frame.field("body") < count]
        rows.append((frame.time, speed.max(), body_table(path)[1][:count].max()))
    return tuple(np.array(rows).T)


def speed_checks(case: str, folder: Path, count: int) -> list[Check]:
    """After the first two seconds, in which bodies still fall and roll."""
    time, points, bodies = speeds(folder, count)
    late = time >= 2 - 1e-6
    found = [record(case, f"fastest body at {time[-1]:.3g} s [m/s]", bodies[-1]),
             record(case, f"fastest point at {time[-1]:.3g} s [m/s]", points[-1])]
    at = int(np.argmin(np.abs(time - 3.0)))
    if time[-1] >= 3 - 1e-6:
        found.append(below(case, "fastest point over fastest body at 3 s", points[at] / bodies[at], FASTEST))
        found.append(below(case, "fastest point, last over that at 2 s", points[-1] / points[late][0], 1.0))
    return found


def overlaps(folder: Path, count: int) -> float:
    """The largest overlap of two bodies that touch, from their centres, over the radius."""
    centre = body_table(max(folder.glob("grains_*.h5")))[0][:count]
    distance = np.linalg.norm(centre[:, None] - centre[None], axis=2) + 4 * RADIUS * np.eye(count)
    return float(2 - distance.min() / RADIUS)


def heap_checks(case: str, folder: Path, heap: Heap) -> list[Check]:
    """What a poured heap must show: it lies within its bodies, on its floor, and its stress is smooth."""
    frame = Results(folder).frames[-1]
    body = frame.field("body")
    centre = body_table(max(folder.glob("grains_*.h5")))[0]
    mine = body < heap.count
    reach = np.linalg.norm(frame.field("position") - centre[body], axis=1)[mine].max() / RADIUS
    with h5py.File(max(folder.glob("contacts_*.h5"))) as file:
        sign = np.where(file["body_a"][()] == heap.count, 1.0, np.where(file["body_b"][()] == heap.count, -1.0, 0.0))
        floor = -float((sign * file["force"][()][:, 1]).sum())
    with h5py.File(max(folder.glob("grains_*.h5"))) as file:
        mass = file["mass"][()][file["body"][()] < heap.count].sum()
    walls_hold = heap.friction > 0  # the side walls carry a part of the weight
    weight = mass * GRAVITY
    force = record(case, "force on the floor over the weight", floor / weight) if walls_hold else Check(
        case, "force on the floor over the weight", floor / weight, 0.999, 1.001, 1.0)
    return [below(case, "farthest point of a body from its centre, over R", reach, 1.3), force,
            below(case, "scatter of the pressure within a cell, over its mean",
                  scatter(frame, mine, RADIUS / heap.cells), 0.2)]


def scatter(frame, mine: np.ndarray, cell: float) -> float:
    """Standard deviation of the pressure of one body's points in a cell, in the root mean square over all of them, over
    the mean pressure."""
    pressure = -frame.field("stress")[mine, :3].mean(axis=1)
    place = np.floor(frame.field("position")[mine] / cell).astype(int)
    key = np.unique(np.column_stack([place, frame.field("body")[mine]]), axis=0, return_inverse=True)[1].ravel()
    count = np.bincount(key)
    mean = np.bincount(key, pressure) / count
    square = np.bincount(key, (pressure - mean[key]) ** 2) / np.maximum(count - 1, 1)
    return float(math.sqrt(square[count > 1].mean()) / abs(pressure.mean()))


def checks(folders: Folders) -> list[Check]:
    found = []
    for case, folder in folders.items():
        heap, table = HEAPS[case], history(folder)
        found += energy_checks(case, table) + gain_checks(case, table, table["kinetic_energy"].max())
        found += speed_checks(case, folder, heap.count)
        if heap.spheres:
            found.append(below(case, "largest overlap of two spheres, over R",
                               max(overlaps(folder, heap.count), 0.0), OVERLAP))
        if heap.count > 50:
            found += heap_checks(case, folder, heap)
    return found


def draw(folders: Folders, out: Path) -> list[Path]:
    energies, points = [], []
    for case, folder in folders.items():
        table = history(folder)
        energy = table["kinetic_energy"] / table["kinetic_energy"].max()
        energies.append(Curve(case, table["time"], np.maximum(energy, 1e-12)))
        time, fastest, _ = speeds(folder, HEAPS[case].count)
        points.append(Curve(case, time, fastest, "o-"))
    panels = [Panel("kinetic energy", "time [s]", "over its largest", energies, log_from=1e-9),
              Panel("fastest point", "time [s]", "speed [m/s]", points, log_from=1e-6)]
    return [draw_panels(out / "rest.png", "Bodies left alone", panels)]


PROBLEM = Problem("rest", "Bodies at rest", "what is left alone comes to rest", runs, checks, draw,
                  literal=("5 disks, 2 rows, mu 0.5",),
                  forms=("approach", "traction", "whole", "stand-off", "no filter"))
