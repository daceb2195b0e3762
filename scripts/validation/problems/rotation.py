"""Turning: a free elastic disk keeps its angular momentum, and a stressed disk that is turned by a ring its stress."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from results import Run as Results
from validation.checks import Check, below, record
from validation.figures import Curve, Panel, draw_panels
from validation.runs import Run
from validation.series import at_time, motion
from validation.suite import Folders, Problem

RADIUS, SPIN, TURNS = 0.5, 10.0, 10  # [m], [rad/s]
PERIOD = 2 * math.pi / SPIN
CELLS = (4, 8, 16)  # to the radius; the bands are for the second
STRESS = 3000.0 * SPIN**2 * 0.375**2  # rho w^2 R^2 of the disk in the ring [Pa]
LAWS = ("neo_hookean", "hypoelastic")
INVARIANTS = ("pressure / (rho w^2 R^2)", "von Mises stress / (rho w^2 R^2)", "det F")


def free(cells: int) -> Run:
    cell = RADIUS / cells
    return Run("validation/spinning_disk", {"domain.cell_size": cell}, 0.01 * cells**3)


def turned(law: str) -> Run:
    return Run("validation/turning_disk", {"materials.rubber.model": f'"{law}"'}, 8.0)


def runs(full: bool) -> dict[str, Run]:
    return {f"free, R/{cells}": free(cells) for cells in (CELLS if full else CELLS[:2])} | {
        f"turned, {law}": turned(law) for law in LAWS}


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


def invariants(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Times, and means over the disk's points of pressure and von Mises stress [Pa] and of det F (frames x 3)."""
    times, values = [], []
    for frame in Results(folder).frames:
        disk = frame.field("body") == 0
        s, F = frame.field("stress")[disk], frame.field("deformation_gradient")[disk].reshape(-1, 3, 3)
        mean = s[:, :3].mean(axis=1)
        mises = np.sqrt(1.5 * (((s[:, :3] - mean[:, None]) ** 2).sum(axis=1) + 2 * (s[:, 3:] ** 2).sum(axis=1)))
        times.append(frame.time)
        values.append((-mean.mean(), mises.mean(), np.linalg.det(F).mean()))
    return np.array(times), np.array(values)


def by_turn(folder: Path) -> np.ndarray:
    """Their means over each turn (turns x 3): the disk breathes, as it starts without stress."""
    times, values = invariants(folder)
    turn = np.floor(times / PERIOD).astype(int)
    return np.array([values[turn == k].mean(axis=0) for k in range(TURNS)])


def checks(folders: Folders) -> list[Check]:
    found = []
    for cells in CELLS:
        if (name := f"free, R/{cells}") in folders:
            _, values = angular_momentum(folders[name])
            quantity = f"change of angular momentum over {TURNS} turns"
            drift = float(np.abs(values - 1).max())
            found.append(below(name, quantity, drift, 1e-3) if cells == CELLS[1] else record(name, quantity, drift))
            found += [record(name, "change of angular momentum in the first turn", values[1] - 1),
                      record(name, f"farthest point from the centre after {TURNS} turns / radius",
                             farthest(folders[name]))]
    for law in LAWS:
        name = f"turned, {law}"
        if name in folders:
            means = by_turn(folders[name])
            change = np.abs(means[-1] - means[1]) / (STRESS, STRESS, 1.0)
            found += [below(name, f"{what}: change of the mean from turn 2 to {TURNS}", value, 1e-3)
                      for what, value in zip(INVARIANTS, change)]
            found += [record(name, f"{what}: mean in turn {TURNS}", value)
                      for what, value in zip(INVARIANTS, means[-1] / (STRESS, STRESS, 1.0))]
    return found


def draw(folders: Folders, out: Path) -> list[Path]:
    momentum, change = [], []
    for name, folder in folders.items():
        if name.startswith("free"):
            times, values = angular_momentum(folder)
            momentum.append(Curve(name, times / PERIOD, values))
        else:
            times, values = invariants(folder)
            change += [Curve(f"{name}: {what}", times / PERIOD, values[:, k] / STRESS)
                       for k, what in enumerate(INVARIANTS[:2])]
    panels = [Panel("free disk", "turns", "angular momentum / initial", momentum),
              Panel("disk turned in a ring", "turns", "mean over the points / (rho w^2 R^2)", change)]
    return [draw_panels(out / "rotation.png", "Rotation", panels)]


PROBLEM = Problem("rotation", "Rotation", "conservation of angular momentum; objectivity", runs, checks, draw)
