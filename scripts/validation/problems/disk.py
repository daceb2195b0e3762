"""A disk on a rigid incline, against a rigid disk: sliding as it rolls, or rolling without slip."""

from __future__ import annotations

import math
from pathlib import Path

from validation.checks import Check, holds
from validation.closed_forms import Rigid
from validation.figures import convergence, draw_panels
from validation.problems import rolling
from validation.runs import NO_PARTICLES, Run
from validation.series import motion
from validation.suite import SETTINGS, Folders, Problem

RADIUS, GRAVITY, END = 0.5, 9.8, 2.0  # [m], [m/s2], [s]
CELLS = (2, 4, 8)  # to a radius
# Friction, incline [degrees], and the error of x at 2 s that is allowed with 2, 4 and 8 cells.
CASES = ((0.3, 60, (0.01, 0.01, 0.01)), (0.5, 30, (0.22, 0.07, 0.02)), (0.5, 60, (0.03, 0.03, 0.03)),
         (0.9, 60, (0.13, 0.03, 0.03)))
GAPS = ("h/2", "0")  # between disk and wall at the start; the bands are for the first
SPIN_SHARE = 0.10  # with 8 cells, where the disk sticks


def label(friction: float, degrees: int, cells: int, gap: str) -> str:
    return f"mu {friction}, {degrees} deg, R/{cells}, gap {gap}"


def rigid_disk(friction: float, degrees: int) -> Rigid:
    return Rigid(RADIUS, 1 / 2, GRAVITY, math.radians(degrees), friction)


def run(friction: float, degrees: int, cells: int, gap: str) -> Run:
    cell, angle = RADIUS / cells, math.radians(degrees)
    length = 2.5 + 1.1 * rigid_disk(friction, degrees).distance(END)
    height = RADIUS + (cell / 2 if gap == "h/2" else 0)
    return Run("rolling_disk", NO_PARTICLES | {
        "domain.upper": f"[{math.ceil(length / cell) * cell}, 1.5]", "domain.cell_size": cell, "time.end": END,
        "domain.gravity": f"[{GRAVITY * math.sin(angle)}, {-GRAVITY * math.cos(angle)}]",
        "boundary.bottom.friction": friction, "bodies.0.shape.centre": f"[0.75, {height}]",
        "output.history": "{ every = 5 }"}, cost=0.05 * cells**2)


def runs(full: bool) -> dict[str, Run]:
    gaps = GAPS if full else GAPS[:1]
    return {label(friction, degrees, cells, gap): run(friction, degrees, cells, gap)
            for friction, degrees, _ in CASES for cells in CELLS for gap in gaps}


def checks(folders: Folders) -> list[Check]:
    found = []
    for friction, degrees, shares in CASES:
        rigid = rigid_disk(friction, degrees)
        for gap in GAPS:
            banded, errors = gap == GAPS[0], []
            for cells, share in zip(CELLS, shares):
                name = label(friction, degrees, cells, gap)
                if name not in folders:
                    continue
                spin = SPIN_SHARE if banded and cells == 8 and not rigid.slips else None
                found += rolling.checks(name, motion(folders[name], 0), rigid, END, share if banded else None, spin,
                                        END / 2)
                errors.append(abs(found[-2].error))
            if banded and (friction, degrees) == (0.5, 30) and len(errors) == 3:
                found.append(holds(f"mu {friction}, {degrees} deg", "error of x falls with the cells",
                                   errors[0] > errors[1] > errors[2]))
    return found


def draw(folders: Folders, out: Path) -> list[Path]:
    """Position, velocity and spin (the paper's Figs. 2 to 4), and the error of x against the cells."""
    groups, errors = {}, {}
    for friction, degrees, _ in CASES:
        rigid, tables = rigid_disk(friction, degrees), {}
        for cells in CELLS:
            name = label(friction, degrees, cells, "h/2")
            if name in folders:
                tables[f"h = R/{cells}"] = motion(folders[name], 0)
        groups[f"mu = {friction}, {degrees} deg"] = (rigid, tables)
        errors[f"mu = {friction}, {degrees} deg"] = ([1 / cells for cells in CELLS], [
            rolling.travelled(table, END) / rigid.distance(END) - 1 for table in tables.values()])
    complete = {name: pair for name, pair in errors.items() if len(pair[1]) == len(CELLS)}
    pictures = [rolling.draw(out / "disk.png", "Disk on an incline", groups, END)]
    if complete:
        panel = convergence("Disk on an incline, x at 2 s", "relative error", complete, "h / R")
        pictures.append(draw_panels(out / "disk_convergence.png", "", [panel]))
    return pictures


PROBLEM = Problem(
    "disk", "Disk on a rigid incline", "Bardenhagen, Brackbill & Sulsky 2000, section 4.1, eq. 25", runs, checks, draw,
    literal=tuple(label(friction, degrees, cells, "h/2") for friction, degrees, _ in CASES for cells in (4, 8)),
    forms=("approach", "A as printed", *SETTINGS))  # at a wall the papers' others come to these, or to the default
