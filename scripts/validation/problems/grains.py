"""Grains sheared, with friction and without slip, on two grids: plastic work, the shear band, the grains themselves.

What should not depend on the grid is the order of things: far more plastic work without slip, and a band of shear near
the moving side with friction. Plastic work itself falls with the cell size, as contacts come to be resolved.
"""

from __future__ import annotations

import functools
import statistics
from pathlib import Path

import numpy as np

from figures import column_profile, shear_band
from results import Run as Results
from validation.checks import Check, below, record
from validation.figures import Curve, Panel, draw_panels
from validation.runs import Run
from validation.series import at_time, history
from validation.suite import Folders, Problem

SPEED = 100.0  # of the right side [m/s]
KINDS = ("slip", "no slip")
# By number of grains: side of the domain [m], cells along it, and the case of each kind.
SIZES = {36: (0.4e-3, (50, 100), ("shear_small", "shear_small")),
         369: (1.2e-3, (75, 150), ("shear", "shear_noslip"))}
PAPER_GRID = 150
STAGES = (0.25, 0.50, 0.75)  # of shear
BANDS = {"two thirds": 2 / 3, "nine tenths": 0.90}  # of the displacement, carried by the shear band
QUIET = {"output.grains": "{}", "output.contacts": "{}", "output.checkpoint": "{}"}


def label(count: int, kind: str, cells: int, shear: float) -> str:
    return f"{count} grains, {kind}, {cells} cells, {100 * shear:.0f} %"


def run(count: int, kind: str, cells: int, shear: float) -> Run:
    side, _, cases = SIZES[count]
    quarter = STAGES[0] * side / SPEED
    changes = QUIET | {
        "domain.cells": [cells, cells], "time.end": shear * side / SPEED,
        "drive.0.bodies.within": 8.0e-6, "drive.1.bodies.within": 8.0e-6,
        "output.particles.interval": quarter,
        "output.particles.fields": '["body", "id", "mass", "volume", "velocity", "image"]'}
    if kind == "no slip" and cases[1] == cases[0]:
        changes["contact.law"] = '"none"'
    return Run(cases[KINDS.index(kind)], changes, 120 * shear * (cells / 150) ** 3)


def runs(full: bool) -> dict[str, Run]:
    """Without --full only a quarter of the shear, on the paper's grid, and on the small case's own."""
    if not full:
        return {label(count, kind, cells, STAGES[0]): run(count, kind, cells, STAGES[0])
                for count, cells in ((36, SIZES[36][1][0]), (369, PAPER_GRID)) for kind in KINDS}
    return {label(count, kind, cells, shear): run(count, kind, cells, shear)
            for count, (_, grids, _) in SIZES.items() for shear in (0.80 if count == 369 else STAGES[-1],)
            for cells in grids for kind in KINDS}


class Points:
    """Positions of the material points of a frame, in the order of their ids, with periodic crossings undone."""

    def __init__(self, frame, side: float):
        order = np.argsort(frame.field("id"))
        self.id, self.body, self.mass = (frame.field(name)[order] for name in ("id", "body", "mass"))
        self.x = frame.field("position")[order, :2]
        self.x[:, 1] += frame.field("image")[order, 1] * side
        self.time = frame.time


def pieces(x: np.ndarray, cell: float) -> int:
    """How many pieces a grain is in: groups of cells that hold its points and touch, if only at a corner."""
    left = {(int(i), int(j)) for i, j in x // cell}
    count = 0
    while left:
        count += 1
        front = [left.pop()]
        while front:
            i, j = front.pop()
            close = {(i + di, j + dj) for di in (-1, 0, 1) for dj in (-1, 0, 1)} & left
            left -= close
            front += close
    return count


def displacement_at(points: Points, start: Points, side: float, low: float, high: float) -> float:
    """Mean vertical displacement of the material that now lies between two shares of the width, as a share of the
    right side's."""
    inside = (points.x[:, 0] >= low * side) & (points.x[:, 0] < high * side)
    moved = (points.x[:, 1] - start.x[:, 1])[inside]
    mass = points.mass[inside]
    return float((mass * moved).sum() / mass.sum() / (SPEED * points.time))


def reach(points: Points) -> np.ndarray:
    """For each grain, the largest distance of a point from the grain's centre."""
    count = np.bincount(points.body)
    centre = np.stack([np.bincount(points.body, points.x[:, k]) / count for k in range(2)], axis=1)
    farthest = np.zeros(len(count))
    np.maximum.at(farthest, points.body, np.hypot(*(points.x - centre[points.body]).T))
    return farthest


@functools.cache
def points_of(folder: Path, side: float) -> list[Points]:
    return [Points(frame, side) for frame in Results(folder).frames]


def whole(case: str, folder: Path, count: int, side: float, cell: float) -> list[Check]:
    """No point is lost; with friction grains stay whole, most of them round, and shear gathers at the moving side."""
    files = points_of(folder, side)
    start, last = files[0], files[-1]
    lost = sum(not (np.array_equal(p.id, start.id) and np.array_equal(p.body, start.body)) for p in files)
    growth = reach(last) / reach(start)
    found = [below(case, "files in which points are lost or change grains", lost, 0),
             Check(case, "grains", len(growth), count, count)]
    if "no slip" in case:
        return found + [record(case, "reach of the most stretched grain, end/start", growth.max())]
    broken = sum(pieces(last.x[last.body == body], cell) > 1 for body in range(len(growth)))
    middle = min(files, key=lambda p: abs(p.time - STAGES[-1] * side / SPEED))
    # Of the width, from and to, and the most displacement there, as a share of the right side's.
    profile = ((0.0, 0.25, 0.03), (0.45, 0.55, 0.35), (0.5, 0.75, 0.55))
    return found + [
        below(case, "grains in pieces", broken, 0),
        Check(case, "reach of the median grain, end/start", statistics.median(growth), 0.95, 1.1),
        Check(case, "reach of the most stretched grain, end/start", growth.max(), 1.0, 3.5)] + [
        Check(case, f"displacement from {low} to {high} of the width, over uniform at 75 %",
              displacement_at(middle, start, side, low, high) / ((low + high) / 2), 0.0, most / ((low + high) / 2))
        for low, high, most in profile]


def plastic_work(folder: Path, side: float, shear: float) -> float:
    """[J/m]"""
    return at_time(history(folder), "plastic_dissipation", shear * side / SPEED)


def band_width(folder: Path, side: float, share: float) -> float:
    """Width that carries a share of the displacement at 75 %, in mean diameters of the grains; NaN where none does."""
    results = Results(folder)
    frame = min(results.frames, key=lambda frame: abs(frame.time - STAGES[-1] * side / SPEED))
    band = shear_band(*column_profile(results, frame), SPEED * frame.time, share)
    return (band[1] - band[0]) / results.mean_diameter() if band else float("nan")


def compare_kinds(case: str, pair: dict[str, Path], side: float, shear: float, band: tuple) -> list[Check]:
    """Plastic work with friction over that without slip, at every stage that was reached."""
    found = []
    for stage in (stage for stage in STAGES if stage <= shear):
        work = [plastic_work(pair[kind], side, stage) for kind in KINDS]
        limits = band if stage == STAGES[0] else ()
        found += [record(case, f"plastic work, {kind}, {100 * stage:.0f} % [J/m]", value)
                  for kind, value in zip(KINDS, work)]
        found.append(Check(case, f"plastic work at {100 * stage:.0f} %, slip over no slip", work[0] / work[1], *limits))
    return found


def checks(folders: Folders) -> list[Check]:
    found, work = [], {}
    for count, (side, grids, _) in SIZES.items():
        for cells in grids:
            for shear in (STAGES[0], STAGES[-1], 0.80):
                pair = {kind: folders[name] for kind in KINDS
                        if (name := label(count, kind, cells, shear)) in folders}
                for kind, folder in pair.items():
                    case = label(count, kind, cells, shear)
                    error = np.abs(history(folder)["energy_error"]).max()
                    found.append(below(case, "largest energy_error", error, 0.01))
                    if shear > STAGES[0]:
                        found += [record(case, f"{name} of the displacement at 75 % within [mean diameters]",
                                         band_width(folder, side, share)) for name, share in BANDS.items()]
                        work[count, kind, cells] = plastic_work(folder, side, STAGES[-1])
                    if shear > STAGES[0] and (count, cells) == (369, PAPER_GRID):
                        found += whole(case, folder, count, side, side / cells)
                if len(pair) == 2:
                    band = (0.0, 0.5) if (count, cells) == (369, PAPER_GRID) else ()
                    found += compare_kinds(f"{count} grains, {cells} cells", pair, side, shear, band)
        found += [record(f"{count} grains, {kind}", f"plastic work at 75 %, {grids[1]} over {grids[0]} cells",
                         work[count, kind, grids[1]] / work[count, kind, grids[0]])
                  for kind in KINDS if (count, kind, grids[0]) in work and (count, kind, grids[1]) in work]
    return found


def draw(folders: Folders, out: Path) -> list[Path]:
    work, profiles = [], []
    for case, folder in folders.items():
        side = SIZES[int(case.split()[0])][0]
        table, results = history(folder), Results(folder)
        work.append(Curve(case, SPEED * table["time"] / side, table["plastic_dissipation"] / side**2))
        if len(results.frames) > 3:
            x, u = column_profile(results, results.frames[3])
            profiles.append(Curve(case, x / side, u / (SPEED * results.frames[3].time)))
    panels = [Panel("plastic work", "shear", "plastic work / area [J/m3]", work)]
    if profiles:
        panels.append(Panel("75 % shear (Fig. 8)", "x / width", "mean displacement / side's", profiles))
    return [draw_panels(out / "grains.png", "Grains sheared", panels)]


PROBLEM = Problem("grains", "Grains sheared", "Bardenhagen, Brackbill & Sulsky 2000, section 4.2", runs, checks, draw)
