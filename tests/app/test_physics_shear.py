"""The large granular shear, with friction and without slip: plastic work, the energy book, and in the whole run the
grains and the profile of displacement (Bardenhagen, Brackbill and Sulsky 2000, section 4.2).

    test_physics_shear.py CAIRN SCRATCH [--full]

Stops at 25 % shear; --full: at 80 %, as the cases are shipped.
"""

import statistics
import sys
from pathlib import Path

from harness import Program, fresh_folder, load_compare_runs
from physics import LIMIT, Check, at_time, below, history, report, run_case

CELL, SIDE = 8e-6, 1.2e-3  # of a cell and of the domain [m]
SPEED = 100.0  # of the right side [m/s]
RANKS = 2
CHECK_TIME, BAND_TIME = 3.0e-6, 9.0e-6  # 25 and 75 % shear [s]
QUIET = {"output.grains": "{}", "output.contacts": "{}", "output.checkpoint": "{}"}
POINTS = '{ interval = 3.0e-6, fields = ["body", "id", "mass", "image"] }'


class Points:
    """Positions of the material points of a file, in the order of their ids, with periodic crossings undone."""

    def __init__(self, file: Path):
        import h5py
        import numpy as np
        with h5py.File(file) as data:
            order = np.argsort(data["id"][:])
            self.id, self.body, self.mass = (data[name][:][order] for name in ("id", "body", "mass"))
            self.x = data["position"][:, :2][order]
            self.x[:, 1] += data["image"][:, 1][order] * SIDE
            self.time = float(data.attrs["time"])


def pieces(x) -> int:
    """How many pieces a grain is in: groups of cells that hold its points and touch, if only at a corner."""
    left = {(int(i), int(j)) for i, j in x // CELL}
    count = 0
    while left:
        count += 1
        front = [left.pop()]
        while front:
            i, j = front.pop()
            near = {(i + di, j + dj) for di in (-1, 0, 1) for dj in (-1, 0, 1)} & left
            left -= near
            front += near
    return count


def displacement_at(points: Points, start: Points, low: float, high: float) -> float:
    """Mean vertical displacement of the material that now lies between two shares of the width, as a share of the
    right side's."""
    inside = (points.x[:, 0] >= low * SIDE) & (points.x[:, 0] < high * SIDE)
    moved = (points.x[:, 1] - start.x[:, 1])[inside]
    mass = points.mass[inside]
    return float((mass * moved).sum() / mass.sum() / (SPEED * points.time))


def reach(points: Points):  # an array
    """For each grain, the largest distance of a point from the grain's centre."""
    import numpy as np
    count = np.bincount(points.body)
    centre = np.stack([np.bincount(points.body, points.x[:, k]) / count for k in range(2)], axis=1)
    farthest = np.zeros(len(count))
    np.maximum.at(farthest, points.body, np.hypot(*(points.x - centre[points.body]).T))
    return farthest


def whole_run(name: str, folder: Path) -> tuple[list[Check], list, list[Points]]:
    """Checks that no point is lost; how far each grain reaches at the end, over the start; and the points over time."""
    files = [Points(file) for file in sorted(folder.glob("particles_*.vtkhdf"))]
    start, last = files[0], files[-1]
    lost = sum(p.id.tolist() != start.id.tolist() or p.body.tolist() != start.body.tolist() for p in files)
    growth = list(reach(last) / reach(start))
    return [Check(f"{name}: files of points", len(files), 5, 5),
            below(f"{name}: files in which points are lost or change grains", lost, 0),
            Check(f"{name}: grains", len(growth), 369, 369)], growth, files


def frictional_grains(growth: list, files: list[Points]) -> list[Check]:
    """With friction the grains stay whole, most of them round, and shear gathers near the moving side."""
    start, last = files[0], files[-1]
    broken = sum(pieces(last.x[last.body == body]) > 1 for body in range(len(growth)))
    band = min(files, key=lambda p: abs(p.time - BAND_TIME))
    # Of the width, from and to, and the most displacement there, as a share of the right side's.
    profile = ((0.0, 0.25, 0.03), (0.45, 0.55, 0.35), (0.5, 0.75, 0.55))
    return [below("shear: grains in pieces", broken, 0),
            Check("shear: reach of the median grain, end/start", statistics.median(growth), 0.95, 1.1),
            Check("shear: reach of the most stretched grain, end/start", max(growth), 1.0, 3.5)] + [
        Check(f"shear: displacement from {low} to {high} of the width, over uniform at 75 %",
              displacement_at(band, start, low, high) / ((low + high) / 2), 0.0, most / ((low + high) / 2))
        for low, high, most in profile]


def main() -> int:
    program, scratch, full = Program(sys.argv[1]), fresh_folder(sys.argv[2]), "--full" in sys.argv[3:]
    settings = QUIET | {"output.particles": "{}", "time.end": CHECK_TIME}
    if full:
        load_compare_runs()  # skips the test where numpy or h5py is missing
        settings = QUIET | {"output.particles": POINTS}
    checks, work, growth = [], {}, {}
    for name in ("shear", "shear_noslip"):
        folder = run_case(program, name, scratch / name, settings, RANKS, timeout=1700 if full else LIMIT)
        table = history(folder)
        work[name] = at_time(table, "plastic_dissipation", CHECK_TIME)
        checks.append(below(f"{name}: largest energy_error", max(map(abs, table["energy_error"])), 0.01))
        if full:
            kept, growth[name], files = whole_run(name, folder)
            checks += kept + (frictional_grains(growth[name], files) if name == "shear" else [])
    ratio = work["shear"] / work["shear_noslip"]
    checks.append(below("plastic work at 25 % shear, friction over no slip", ratio, 0.5))
    if full:
        stretch = max(growth["shear_noslip"]) / max(growth["shear"])
        checks.append(Check("reach of the most stretched grain, no slip over friction", stretch, 1.5, 1e3))
    return report(checks)


if __name__ == "__main__":
    sys.exit(main())
