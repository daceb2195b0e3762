"""Stretch and shear: a rubber bar is pulled, or sheared between two grips, and its points follow.

F11 is averaged over the points of the bar's middle half, where the grips do not hold its width, and compared with the
stretch of that half: the distance of its outermost points over that at the start, which needs no stress. The points
have parted where two neighbours along the bar are far further apart than the others.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from results import Run as Results
from validation.checks import Check, below, record
from validation.figures import Curve, Panel, draw_panels
from validation.runs import Run
from validation.suite import Folders, Problem

# Dimension, points a cell, law, stretch at the end; with CPDI, and as it is by default. In 3D, and under a law whose stress
# grows with the logarithm of the stretch, bars tear further on.
BARS = ((2, 4, "neo_hookean", 2.2), (2, 9, "neo_hookean", 3.0), (3, 8, "neo_hookean", 2.0), (2, 4, "hypoelastic", 2.0),
        (2, 9, "hypoelastic", 2.0))
CELL = 0.025  # [m]
SHAPES = {"cpdi": {"solver.shape": '"cpdi"', "solver.motion": '"projected"'},
          "default": {"solver.shape": '"gimp"', "solver.motion": '"centred"'}}


def pull(dimension: int, points: int, stretch: float, shape: str, law: str) -> Run:
    changes = SHAPES[shape] | {"solver.points_per_cell": points, "time.end": stretch - 1,
                               "materials.rubber.model": f'"{law}"'}
    if dimension == 3:
        def body(low: float, high: float, rest: str) -> str:
            return (f'{{ shape = {{ type = "box", lower = [{low}, 0.1, 0.1], upper = [{high}, 0.2, 0.2] }}, {rest} }}')

        changes |= {"domain.dimension": 3, "domain.upper": [3.0, 0.3, 0.3], "bodies": "[" + ", ".join((
            body(1.1, 1.9, 'material = "rubber"'), body(0.9, 1.1, 'material = "grip", group = "left"'),
            body(1.9, 2.1, 'material = "grip", group = "right"'))) + "]",
            "drive.0.velocity": [-0.4, 0.0, 0.0], "drive.1.velocity": [0.4, 0.0, 0.0]}
    return Run("validation/stretched_bar", changes, 1.0 * points if dimension == 2 else 30.0)


def label(dimension: int, points: int, shape: str, law: str) -> str:
    return f"bar, {dimension}D, {points} points a cell, {law}, {shape}"


def runs(full: bool) -> dict[str, Run]:
    return {label(dimension, points, shape, law): pull(dimension, points, stretch, shape, law)
            for dimension, points, law, stretch in (BARS if full else BARS[:1]) for shape in SHAPES}


WANTED = {label(dimension, points, shape, law): stretch for dimension, points, law, stretch in BARS for shape in SHAPES}


def history_of(folder: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stretch of the middle half, mean F11 there, and the largest gap between neighbours along it over the mean one, of
    each output."""
    stretch, mean, gap = [], [], []
    middle, length = None, 0.0
    for frame in Results(folder).frames:
        bar = frame.field("body") == 0
        order = np.argsort(frame.field("id")[bar])
        x = frame.field("position")[bar][order, 0]
        F = frame.field("deformation_gradient")[bar][order, 0]
        if middle is None:
            centre, half = (x.max() + x.min()) / 2, (x.max() - x.min()) / 4
            middle = np.abs(x - centre) < half
            ends = np.argsort(x[middle])
            low, high = ends[:4], ends[-4:]
            length = x[middle][high].mean() - x[middle][low].mean()
        inside = x[middle]
        stretch.append((inside[high].mean() - inside[low].mean()) / length)
        mean.append(F[middle].mean())
        places = np.sort(inside)
        gap.append(np.diff(places).max() / CELL)
    return np.array(stretch), np.array(mean), np.array(gap)


def lost_at(stretch: np.ndarray, mean: np.ndarray) -> float:
    """The stretch from which the mean F11 is more than 2 % off; the last one where it never is."""
    off = np.flatnonzero(np.abs(mean / stretch - 1) > 0.02)
    return float(stretch[off[0]] if len(off) else stretch[-1])


def checks(folders: Folders) -> list[Check]:
    found = []
    for name, folder in folders.items():
        stretch, mean, gap = history_of(folder)
        wanted = WANTED[name]
        error = float(np.abs(mean / stretch - 1).max())
        if name.endswith("cpdi"):
            found += [below(name, "largest error of the mean F11", error, 0.02),
                      Check(name, "stretch at the end", stretch[-1], 0.97 * wanted)]
        else:
            found += [record(name, "largest error of the mean F11", error),
                      record(name, "stretch at which it is 2 % off", lost_at(stretch, mean))]
        found.append(record(name, "largest gap between points, cells", float(gap.max())))
    return found


def draw(folders: Folders, out: Path) -> list[Path]:
    curves = [Curve(name, *history_of(folder)[:2]) for name, folder in folders.items()]
    panel = Panel("middle half of the bar", "stretch", "mean F11 of its points", curves)
    return [draw_panels(out / "stretch.png", "Stretched rubber bars", [panel])]


PROBLEM = Problem("stretch", "Stretch: a rubber bar is pulled", "the bar's own ends", runs, checks, draw)
