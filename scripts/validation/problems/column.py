"""A column of disks is let go: how far the disks go in the mean, against a plain discrete element method of the same.

Disks that roll away alone are stopped by nothing, so that the way is compared at fixed times, while the heap still
moves. Its restitution hardly matters: energy goes in sliding.
"""

from __future__ import annotations

import functools
import math
from pathlib import Path

import h5py
import numpy as np

from validation.checks import Check, near, record
from validation.dem import Disks, Wall
from validation.figures import Curve, Panel, draw_panels
from validation.runs import CASES, Run
from validation.suite import Folders, Problem

TABLE = CASES / "validation" / "column_disks.csv"
DIAMETER, SPREAD, ROWS, COLUMNS = 0.1, 0.15, 12, 8  # mean [m]; radii differ by so much either way
DENSITY, STIFFNESS, FRICTION, GRAVITY = 1000.0, 4.0e6, 0.5, 9.81
TIMES = (0.5, 0.7, 1.0)  # [s]
RESTITUTION = 0.5
RESTITUTIONS = (0.1, RESTITUTION, 0.8)
CELLS = (5, 12)  # to a diameter
BAND = {12: 0.10}  # of the mean way, by cells


def pack(seed: int = 1) -> Disks:
    """A column at rest between smooth walls: disks dropped from a lattice."""
    random, count, width = np.random.default_rng(seed), ROWS * COLUMNS, COLUMNS * DIAMETER
    radius = DIAMETER / 2 * (1 + SPREAD * random.uniform(-1, 1, count))
    pitch = DIAMETER * (1 + SPREAD) * 1.001
    along = int(width // pitch)
    places = [(pitch * (k % along + 0.5), pitch * (k // along + 0.5)) for k in range(count)]
    walls = (Wall((0, 0), (0, 1)), Wall((0, 0), (1, 0)), Wall((width, 0), (-1, 0)))
    disks = Disks(places, radius, DENSITY, STIFFNESS, 0.0, 0.2, (0, -GRAVITY), walls)
    disks.v[:] = random.uniform(-0.3, 0.3, (count, 2))
    for _ in range(60):
        disks.advance(0.1)
        disks.v *= 0.7
    return disks


def write_table(file: Path = TABLE) -> None:
    """Writes the table that the case reads."""
    disks = pack()
    rows = [f"{x:.6f},{y:.6f},{r:.6f}" for (x, y), r in zip(disks.x, disks.radius)]
    head = (f"# {len(rows)} disks at rest in {COLUMNS * DIAMETER:g} m between smooth walls; "
            f"mean diameter {DIAMETER} m, radii +-{100 * SPREAD:.0f} %")
    file.write_text("\n".join([head, "x,y,r", *rows]) + "\n", encoding="utf-8")


def table() -> np.ndarray:
    """x, y, r of the disks [m]."""
    return np.loadtxt(TABLE, delimiter=",", skiprows=2)


@functools.cache
def reference(restitution: float = RESTITUTION) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and the mean way along the floor [m] that the discrete element method gives."""
    start = table()
    walls = (Wall((0, 0), (0, 1), FRICTION), Wall((0, 0), (1, 0)))
    disks = Disks(start[:, :2], start[:, 2], DENSITY, STIFFNESS, FRICTION, restitution, (0, -GRAVITY), walls)
    times, ways = np.linspace(0, TIMES[-1], 11), [0.0]
    for duration in np.diff(times):
        disks.advance(duration)
        ways.append(float((disks.x - start[:, :2])[:, 0].mean()))
    return times, np.array(ways)


def measured(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """The same of a run."""
    times, ways, start = [], [], None
    for path in sorted(folder.glob("grains_*.h5")):
        with h5py.File(path) as file:
            centre = file["centre"][()][np.argsort(file["body"][()]), 0]
            start = centre if start is None else start
            times.append(float(np.ravel(file.attrs["time"])[0]))
            ways.append(float((centre - start).mean()))
    return np.array(times), np.array(ways)


def label(cells: int) -> str:
    return f"{cells} cells a diameter"


def runs(full: bool) -> dict[str, Run]:
    return {label(cells): Run("validation/column", {"domain.cell_size": DIAMETER / cells}, 0.25 * cells**3)
            for cells in (CELLS if full else CELLS[:1])}


def checks(folders: Folders) -> list[Check]:
    found, errors = [], {}
    for cells in CELLS:
        if label(cells) not in folders:
            continue
        path = measured(folders[label(cells)])
        for time in TIMES:
            way, right = float(np.interp(time, *path)), float(np.interp(time, *reference()))
            name = f"mean way at {time} s [m]"
            found.append(near(label(cells), name, way, right, BAND[cells]) if cells in BAND and time == TIMES[-1]
                         else record(label(cells), name, way, right))
        errors[cells] = found[-1].error
    if len(errors) > 1:
        worst = max(errors, key=lambda cells: abs(errors[cells]))
        found.append(Check("all", "cells a diameter of the largest error at the end", worst, CELLS[0], CELLS[0]))
    for restitution in RESTITUTIONS if len(errors) > 1 else ():
        found.append(record("discrete elements", f"mean way at {TIMES[-1]} s, restitution {restitution} [m]",
                            reference(restitution)[1][-1], reference()[1][-1]))
    return found


def draw(folders: Folders, out: Path) -> list[Path]:
    curves = [Curve("discrete elements", *reference(), "k--")]
    curves += [Curve(name, *measured(folder)) for name, folder in folders.items()]
    return [draw_panels(out / "column.png", "Column of disks", [Panel("a = 1.5", "time [s]", "mean way [m]", curves)])]


PROBLEM = Problem("column", "Column of disks collapses", "plain discrete element method of the same disks", runs,
                  checks, draw, literal=(label(CELLS[0]),), forms=("whole", "stand-off"))
