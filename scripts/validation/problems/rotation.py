"""Turning: a free elastic disk keeps its angular momentum; stressed points and bodies keep stress and volume.

Stress and volume are looked at in four ways. A single point under each law is turned in 1000 steps a turn. Bodies of
which every point is driven go through whole steps of the solver: by the program under pressure, and in a unit test
under random strains of 3 %. A disk that spins freely, its breathing damped, carries the stress of its own spin,
rho w^2 R^2. A disk that is put under pressure and glued to a ring, turned slowly, is held by it: its inertia is a
thousandth of the pressure.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np

from results import Run as Results
from validation.checks import Check, below, record
from validation.figures import Curve, Panel, draw_panels
from validation.runs import Run
from validation.series import at_time, motion
from validation.suite import SETTINGS, Folders, Problem

RADIUS, SPIN, TURNS = 0.5, 10.0, 10  # [m], [rad/s]
PERIOD = 2 * math.pi / SPIN
CELLS = (4, 8, 16)  # to the radius; the bands are for the second
CELL = RADIUS / CELLS[1]  # of the disks under stress [m]
LAWS = ("neo_hookean", "hypoelastic")
INVARIANTS = ("pressure", "von Mises stress", "det F")
MANY = f"spinning, {LAWS[0]}, 16 points a cell"
SLOW = 2.0  # spin of the disk in the ring [rad/s]
SAMPLES = 25  # outputs in a turn
# Unit tests that print how far stressed points, alone and in driven bodies, drift.
POINT, STRAINED = "material point", "driven, strained at random"
TOOLS = {POINT: ("tests/test_material", "--gtest_filter=Objectivity.*"),
         STRAINED: ("tests/test_solver", "--gtest_filter=DrivenStress.*")}
# A line for each law in 2D, 3D and plane stress, at strains of 0.01 and 3 %.
DRIFT = re.compile(r"^\d-D (\w+) .*: det F (\S+), pressure (\S+), deviator (\S+), det (\S+)$", re.M)


def free(cells: int) -> Run:
    return Run("validation/spinning_disk", {"domain.cell_size": RADIUS / cells}, 0.01 * cells**3)


def spinning(law: str, points: int = 4) -> Run:
    """After two turns in which a share of PIC damps the breathing, ten with the defaults."""
    two = 2 * PERIOD
    start = {"materials.rubber.model": f'"{law}"', "solver.points_per_cell": points, "output.particles": "{}",
             "solver.flip": 0.9, "time.end": two, "output.checkpoint": f"{{ interval = {0.999 * two} }}"}
    interval = f'{{ interval = {PERIOD / SAMPLES}, fields = ["stress", "id", "deformation_gradient"] }}'
    return Run("validation/spinning_disk", start | {
        "solver.flip": 1.0, "time.end": two + TURNS * PERIOD, "output.particles": interval,
        "output.checkpoint": "{}"}, 1.0 * points, after=Run("validation/spinning_disk", start))


def pressed(cfl: float) -> Run:
    return Run("validation/turning_disk", {"time.cfl": cfl}, 4.0 / cfl)


def driven(law: str) -> Run:
    """Every point is driven: the disk as well as the ring."""
    return Run("validation/turning_disk", {"drive.0.ids": [0, 1], "materials.rubber.model": f'"{law}"'}, 0.2)


def runs(full: bool) -> dict[str, Run]:
    found = {name: Run(tool=tool) for name, tool in TOOLS.items()}
    found |= {f"driven, {law}": driven(law) for law in LAWS}
    found |= {f"free, R/{cells}": free(cells) for cells in (CELLS if full else CELLS[:2])}
    found |= {f"spinning, {law}": spinning(law) for law in LAWS}
    if full:
        found[MANY] = spinning(LAWS[0], 16)
        found |= {f"pressed, cfl {cfl}": pressed(cfl) for cfl in (0.4, 0.1)}
    return found


def angular_momentum(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Times of the outputs, and spin times moment of inertia there, over its value at the start."""
    path, times, values = motion(folder, 0), [], []
    for frame in Results(folder).frames:
        x, mass = frame.field("position")[:, :2], frame.field("mass")
        r = x - np.average(x, axis=0, weights=mass)
        inertia = float((mass * (r**2).sum(axis=1)).sum())
        times.append(frame.time)
        values.append(inertia * at_time(path, "wz", frame.time))
    return np.array(times), np.array(values) / values[0]


def farthest(folder: Path) -> float:
    """Largest distance of a point from the disk's centre at the end, over the radius: surface points may tear off."""
    frame = Results(folder).frames[-1]
    x = frame.field("position")[:, :2]
    return float(np.hypot(*(x - x.mean(axis=0)).T).max() / RADIUS)


def invariants(folder: Path, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Times since the first output, and means of pressure and von Mises stress [Pa] and of det F (frames x 3) over the
    points that are within `radius` of the middle then."""
    times, values, inside = [], [], None
    for frame in Results(folder).frames:
        order = np.argsort(frame.field("id"))
        x = frame.field("position")[order, :2]
        if inside is None:
            inside = np.hypot(*(x - x.mean(axis=0)).T) < radius
        s, F = (frame.field(name)[order][inside] for name in ("stress", "deformation_gradient"))
        mean = s[:, :3].mean(axis=1)
        mises = np.sqrt(1.5 * (((s[:, :3] - mean[:, None]) ** 2).sum(axis=1) + 2 * (s[:, 3:] ** 2).sum(axis=1)))
        times.append(frame.time)
        values.append((-mean.mean(), mises.mean(), np.linalg.det(F.reshape(-1, 3, 3)).mean()))
    return np.array(times) - times[0], np.array(values)


def in_ring(name: str) -> bool:
    return name.startswith(("pressed", "driven"))


def stressed(name: str, folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Turns, and the invariants there of the points that are more than a cell from the edge."""
    slow = in_ring(name)
    times, values = invariants(folder, (0.375 if slow else RADIUS) - CELL)
    return times * (SLOW if slow else SPIN) / (2 * math.pi), values


def scale_of(name: str, first: np.ndarray) -> np.ndarray:
    """Over what changes are given: the first turn's values; in a disk under pressure that is the stress."""
    return first[[0, 0, 2]] if in_ring(name) else first


def means(name: str, folder: Path) -> np.ndarray:
    """The invariants' means over each turn (turns x 3)."""
    turns, values = stressed(name, folder)
    return np.array([values[(turns >= k) & (turns < k + 1)].mean(axis=0) for k in range(TURNS)])


def check_stressed(name: str, folder: Path) -> list[Check]:
    """Changes of the means over a turn, from the first to the tenth. The band is for rigid rotation: of bodies all of
    whose points are driven."""
    first, *_, last = means(name, folder)
    scale = scale_of(name, first)
    check = below if name.startswith("driven") else record
    found = [record(name, f"{what} in turn 1{'' if k == 2 else ' [Pa]'}", first[k])
             for k, what in enumerate(INVARIANTS)]
    for k, what in enumerate(INVARIANTS):
        limit = (1e-3,) if check is below else ()
        change = abs((last[k] - first[k]) / scale[k])
        found.append(check(name, f"change of the {what}, turn 1 to {TURNS}", change, *limit))
    return found


def check_tool(name: str, folder: Path) -> list[Check]:
    """Largest changes on the way for each law, of the stress over its norm, as the unit test prints them."""
    worst: dict[str, list[float]] = {}
    for law, *values in DRIFT.findall((folder / "log.txt").read_text(encoding="utf-8")):
        volume, *stress = map(float, values)
        most = worst.setdefault(law, [0.0, 0.0])
        worst[law] = [max(most[0], volume), max(most[1], *stress)]
    if not worst:
        return [Check(name, "the unit test printed no changes", math.nan)]
    return [below(f"{name}, {law}", f"change of {what} over {TURNS} turns", value, 1e-3)
            for law, most in worst.items() for what, value in zip(("det F", "the stress's invariants"), most)]


def checks(folders: Folders) -> list[Check]:
    found = []
    for name, folder in folders.items():
        if name in TOOLS:
            found += check_tool(name, folder)
        elif not name.startswith("free"):
            found += check_stressed(name, folder)
        else:
            _, values = angular_momentum(folder)
            quantity = f"change of angular momentum over {TURNS} turns"
            drift = float(np.abs(values - 1).max())
            found.append(below(name, quantity, drift, 1e-3) if name == f"free, R/{CELLS[1]}" else record(
                name, quantity, drift))
            found += [record(name, "change of angular momentum in the first turn", values[1] - 1),
                      record(name, f"farthest point from the centre after {TURNS} turns / radius", farthest(folder))]
    return found


def draw(folders: Folders, out: Path) -> list[Path]:
    momentum, change = [], {what: [] for what in INVARIANTS}
    for name, folder in folders.items():
        if name.startswith("free"):
            times, values = angular_momentum(folder)
            momentum.append(Curve(name, times / PERIOD, values))
        elif name not in TOOLS:
            first, *later = means(name, folder)
            changes = np.abs((np.array(later) - first) / scale_of(name, first))
            for k, what in enumerate(INVARIANTS):
                change[what].append(Curve(name, np.arange(2, TURNS + 1), changes[:, k], "o-"))
    panels = [Panel("free disk", "turns", "angular momentum / initial", momentum)]
    for what, curves in change.items():
        curves.append(Curve("band", np.array([2, TURNS]), np.array([1e-3, 1e-3]), "k--"))
        panels.append(Panel(f"{what} of disks under stress", "turn", "change of the mean since turn 1", curves,
                            log_from=1e-12))
    return [draw_panels(out / "rotation.png", "Rotation", panels, 2)]


PROBLEM = Problem("rotation", "Rotation", "conservation of angular momentum; objectivity", runs, checks, draw,
                  literal=(f"free, R/{CELLS[1]}", f"spinning, {LAWS[0]}", MANY), forms=tuple(SETTINGS))
