"""What cylinder and sphere under a plate share: force, size of the contact and pressure there, over time."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import h5py
import numpy as np

from results import Run as Results
from validation.checks import Check, record

YOUNGS, POISSON, RADIUS = 1.0, 0.3, 1.0  # SI
SPEED = 0.002  # of the plate [m/s]


@dataclasses.dataclass
class State:
    """The contact at one time: force of the modelled part of the body; means over its points near the plate."""

    time: float
    depth: float  # of the plate below the place where the undeformed body ends [m]
    force: float  # [N], 2D: per metre
    second_moment: float  # mean square distance from the axis, weighted with the pressure [m2]
    peak: float  # mean pressure of the points on the axis [Pa]


def force_series(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Force on the body along y, at the middles of the intervals over which the files average it."""
    times, forces = [0.0], [0.0]
    before = 0.0
    for path in sorted(folder.glob("contacts_*.h5"))[1:]:
        with h5py.File(path) as file:
            now, force = float(np.ravel(file.attrs["time"])[0]), file["force"][()]
            times.append((before + now) / 2)
            forces.append(-float(force[:, 1].sum()) if len(force) else 0.0)
            before = now
    return np.array(times), np.array(forces)


def states(folder: Path, cell: float) -> list[State]:
    """At every output of points but the first; near the plate is within a cell of it, on the axis within one of it."""
    times, forces = force_series(folder)
    found = []
    for frame in Results(folder).frames[1:]:
        plate = RADIUS + cell / 2 - SPEED * frame.time
        x, body = frame.field("position"), frame.field("body")
        pressure, volume = -frame.field("stress")[:, 1], frame.field("volume")
        near = (body == 0) & (x[:, 1] > plate - cell)
        square = x[:, 0] ** 2 + x[:, 2] ** 2
        weight = np.maximum(pressure, 0) * volume
        force = float(np.interp(frame.time, times, forces))
        if not force > 0 or not weight[near].sum() > 0:
            continue
        found.append(State(frame.time, RADIUS - plate, force,
                           float((weight * square)[near].sum() / weight[near].sum()),
                           float(pressure[near & (square < cell**2)].mean())))
    return found


def compare(case: str, cell: float, width: float, rows: list[tuple[str, float, float | None]]) -> list[Check]:
    """Values beside the closed form's, with the number of cells across the contact, `width` [m] wide in the latter."""
    return [record(f"{case}, {2 * width / cell:.1f} cells across", *row) for row in rows]


def cells_needed(errors: list[tuple[float, float]], share: float = 0.10) -> float:
    """The least number of cells, across the contact or of approach, from which on all errors are within a share; of
    (cells, error)."""
    bad = [cells for cells, error in errors if abs(error) > share]
    good = [cells for cells, error in errors if not bad or cells > max(bad)]
    return min(good, default=math.inf)
