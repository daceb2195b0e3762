"""A spinning sphere is set down on a plane, against a rigid sphere: it slips, then rolls.

It lands late, is too fast then and too slow later, so that x at one time may be right by chance: whether smaller
cells are better is asked of the error over the whole way.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from validation.checks import Check, holds, near, record
from validation.closed_forms import Backspin
from validation.figures import Curve, Panel, draw_panels
from validation.problems.rolling import travelled
from validation.runs import Run
from validation.series import Table, mean, motion
from validation.suite import Folders, Problem

RADIUS, END, SETTLED = 1.0, 1.0, 0.6  # [m], [s], from when on the velocity is averaged [s]
CELLS = (4, 8)  # to a radius, as in the paper
GAPS = ("h/2", "0")  # between sphere and plane at the start
BANDS = {8: (0.05, 0.15)}  # of x and of the velocity, by cells


def label(cells: int, gap: str) -> str:
    return f"R/{cells}, gap {gap}"


def run(cells: int, gap: str) -> Run:
    cell, top = RADIUS / cells, 0.5
    height = top + RADIUS + (cell / 2 if gap == "h/2" else 0)
    upper = [math.ceil(length / cell) * cell for length in (5.0, top + 2 * RADIUS + 0.75, 1.25)]
    return Run("validation/backspin", {
        "domain.upper": upper, "domain.cell_size": cell, "bodies.0.shape.upper": [upper[0], top, upper[2]],
        "bodies.1.shape.centre": [1.5 + 0.37 * cell, height, 0.0]}, 0.004 * cells**4)


def runs(full: bool) -> dict[str, Run]:
    return {label(cells, gap): run(cells, gap) for cells in CELLS for gap in (GAPS if full else GAPS[:1])}


def path_error(path: Table) -> float:
    """Root of the mean square error of x over time [m]."""
    error = path["x"] - path["x"][0] - Backspin().distance(path["time"])
    return float(np.sqrt(np.trapz(error**2, path["time"]) / (path["time"][-1] - path["time"][0])))


def checks(folders: Folders) -> list[Check]:
    exact, found = Backspin(), []
    for gap in GAPS:
        errors = []
        for cells in CELLS:
            if (name := label(cells, gap)) not in folders:
                continue
            path = motion(folders[name], 1)
            rows = [("x at 1 s [m]", travelled(path, END), float(exact.distance(END))),
                    ("mean v, 0.6 to 1 s [m/s]", mean(path, "vx", SETTLED, END), exact.speed)]
            bands = BANDS.get(cells) if gap == "h/2" else None
            found += [near(name, *row, band) for row, band in zip(rows, bands)] if bands else [
                record(name, *row) for row in rows]
            found.append(record(name, "mean spin, 0.6 to 1 s [rad/s]", -mean(path, "wz", SETTLED, END),
                                float(exact.spin_at(END))))
            errors.append(path_error(path))
            found.append(record(name, "root mean square error of x, 0 to 1 s [m]", errors[-1]))
        if gap == "h/2" and len(errors) == 2:
            found.append(holds("gap h/2", "x over 0 to 1 s better at R/8 than at R/4", errors[1] < errors[0]))
    return found


def draw(folders: Folders, out: Path) -> list[Path]:
    """Position and velocity (the paper's Figs. 7 and 8), and spin."""
    exact, times = Backspin(), np.linspace(0, END, 200)
    rigid = (exact.distance(times), exact.velocity(times), exact.spin_at(times))
    panels = []
    for k, quantity in enumerate(("x [m]", "velocity [m/s]", "spin [rad/s]")):
        curves = [Curve("rigid", times, rigid[k], "k--")]
        for name, folder in folders.items():
            path = motion(folder, 1)
            curves.append(Curve(name, path["time"], (path["x"] - path["x"][0], path["vx"], -path["wz"])[k]))
        panels.append(Panel("", "time [s]", quantity, curves))
    return [draw_panels(out / "backspin.png", "Backspin", panels)]


PROBLEM = Problem("backspin", "Backspin", "Bardenhagen et al. 2001, section 3.2, eqs. 25 and 26", runs, checks, draw,
                  literal=(label(8, GAPS[0]),))
