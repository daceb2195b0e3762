"""Standing waves in a bar and in a ring, against linear elasticity: how the error of the displacement falls with h.

The initial velocity varies in space, which one body cannot have: bar and ring are cut into slabs and rings, a body
each, which `law = "none"` joins again into one velocity field. The step falls with h^2, so that the error of the time
stepping, of first order, falls as fast as that of the space.
"""

from __future__ import annotations

import functools
import math
from pathlib import Path

import numpy as np

from results import Run as Results
from validation.checks import Check, observed_order, record
from validation.figures import convergence, draw_panels
from validation.runs import Run
from validation.suite import Folders, Problem

SHAPES = ("linear", "gimp", "bspline2")
SPEED = 1e-5  # largest, over the wave speed: strains are as small
SHARE = 1.1  # of a period, after which displacements are compared
BAR_CELLS = (16, 32, 64, 128)  # to the wave, 1 m long
RING_CELLS = (12, 24, 36)  # to the outer radius, 1 m
INNER = 0.5  # radius of the ring [m]
SHEAR_SPEED = 1.0  # in the ring [m/s]
ORDER = {"gimp": (1.8, 3.0), "bspline2": (1.8, 3.0)}  # bands, for the bar


def slabs(cells: int) -> str:
    """Bodies of the bar: a slab for each column of points, with v = V sin(2 pi x) at its middle."""
    width, height = 0.5 / cells, 4 / cells
    rows = []
    for k in range(2 * cells):
        speed = SPEED * math.sin(2 * math.pi * (k + 0.5) * width)
        rows.append(f'{{ shape = {{ type = "box", lower = [{k * width!r}, 0.0], upper = [{(k + 1) * width!r}, '
                    f'{height!r}] }}, material = "bar", velocity = [{speed!r}, 0.0] }}')
    return f"[{', '.join(rows)}]"


def shoot(wave_number: float, steps: int = 400) -> tuple[np.ndarray, np.ndarray, float]:
    """Radii, amplitude R and shear R' - R/r at the outer side, of R'' + R'/r + (k^2 - 1/r^2) R = 0 with R' = R/r = 1
    at the inner side: no shear there. Runge and Kutta's method of fourth order."""
    def slope(r, y):
        return np.array([y[1], -y[1] / r + (1 / r**2 - wave_number**2) * y[0]])

    h = (1 - INNER) / steps
    radii, y, values = INNER + h * np.arange(steps + 1), np.array([INNER, 1.0]), [INNER]
    for r in radii[:-1]:
        a = slope(r, y)
        b = slope(r + h / 2, y + h / 2 * a)
        c = slope(r + h / 2, y + h / 2 * b)
        y = y + h / 6 * (a + 2 * b + 2 * c + slope(r + h, y + h * c))
        values.append(y[0])
    return radii, np.array(values), y[1] - y[0]


@functools.cache
def ring_mode() -> tuple[float, np.ndarray, np.ndarray]:
    """Wave number [1/m], radii and amplitude (largest: 1) of the first torsional mode of a ring with free sides."""
    low, high = 5.0, 8.0  # around pi over the width
    for _ in range(50):
        middle = (low + high) / 2
        if shoot(low)[2] * shoot(middle)[2] <= 0:
            high = middle
        else:
            low = middle
    radii, values, _ = shoot(low)
    return low, radii, values / np.abs(values).max()


def amplitude(r):
    _, radii, values = ring_mode()
    return np.interp(r, radii, values)


def rings(cells: int) -> str:
    """Bodies of the ring: rings an eighth of a cell wide, each spinning as the mode does at its middle."""
    count = round((1 - INNER) * 8 * cells)
    rows = []
    for k in range(count):
        inner, outer = INNER + (1 - INNER) * k / count, INNER + (1 - INNER) * (k + 1) / count
        spin = SPEED * float(amplitude((inner + outer) / 2)) / ((inner + outer) / 2)
        disks = ", ".join(f'{{ type = "disk", centre = [0.0, 0.0], radius = {r!r} }}' for r in (outer, inner))
        rows.append(f'{{ shape = {{ type = "difference", of = [{disks}] }}, material = "ring", '
                    f"angular_velocity = {spin!r} }}")
    return f"[{', '.join(rows)}]"


def bar(shape: str, cells: int) -> Run:
    end = SHARE
    return Run("validation/standing_wave", {
        "domain.cell_size": 1 / cells, "domain.upper": [1.0, 4 / cells], "solver.shape": f'"{shape}"',
        "bodies": slabs(cells), "time.end": end, "time.dt": 1 / cells**2,
        "output.particles.interval": end}, 0.0003 * cells**2)


def ring(shape: str, cells: int) -> Run:
    end = SHARE * 2 * math.pi / (ring_mode()[0] * SHEAR_SPEED)
    return Run("validation/torsion_ring", {
        "domain.cell_size": 1 / cells, "domain.lower": [-1.25, -1.25], "domain.upper": [1.25, 1.25],
        "solver.shape": f'"{shape}"', "bodies": rings(cells), "time.end": end, "time.dt": 1 / cells**2,
        "output.particles.interval": end}, 0.00002 * cells**4)


def runs(full: bool) -> dict[str, Run]:
    bars = {f"bar, {shape}, L/{cells}": bar(shape, cells) for shape in SHAPES
            for cells in (BAR_CELLS if full else BAR_CELLS[:3])}
    return bars | {f"ring, {shape}, R/{cells}": ring(shape, cells) for shape in (SHAPES if full else ("gimp",))
                   for cells in (RING_CELLS if full else RING_CELLS[:2])}


def moved(folder: Path) -> tuple[np.ndarray, np.ndarray, float]:
    """Positions at the start, displacements since, and the time."""
    frames = Results(folder).frames
    first, last = frames[0], frames[-1]
    orders = [np.argsort(frame.field("id")) for frame in (first, last)]
    start, end = (frame.field("position")[order, :2] for frame, order in zip((first, last), orders))
    return start, end - start, last.time


def bar_error(folder: Path) -> float:
    """Root mean square of the error of the displacement, over that of the exact one."""
    x, u, time = moved(folder)
    frequency = 2 * math.pi
    exact = SPEED / frequency * np.sin(2 * math.pi * x[:, 0]) * math.sin(frequency * time)
    error = np.hypot(u[:, 0] - exact, u[:, 1])
    return float(np.sqrt((error**2).mean() / (exact**2).mean()))


def ring_error(folder: Path) -> float:
    x, u, time = moved(folder)
    r = np.hypot(*x.T)
    frequency = ring_mode()[0] * SHEAR_SPEED
    along = SPEED / frequency * amplitude(r) * math.sin(frequency * time)
    exact = np.column_stack((-x[:, 1], x[:, 0])) * (along / r)[:, None]
    return float(np.sqrt(((u - exact) ** 2).sum() / (exact**2).sum()))


def errors(folders: Folders, kind: str) -> dict[str, tuple[list[float], list[float]]]:
    """By shape function: cell sizes and errors."""
    all_cells, letter, measure = (BAR_CELLS, "L", bar_error) if kind == "bar" else (RING_CELLS, "R", ring_error)
    found = {}
    for shape in SHAPES:
        cells = [count for count in all_cells if f"{kind}, {shape}, {letter}/{count}" in folders]
        if cells:
            found[shape] = ([1 / count for count in cells],
                            [measure(folders[f"{kind}, {shape}, {letter}/{count}"]) for count in cells])
    return found


def checks(folders: Folders) -> list[Check]:
    found = []
    for kind in ("bar", "ring"):
        for shape, (sizes, values) in errors(folders, kind).items():
            found += [record(f"{kind}, {shape}", f"error of the displacement, h = 1/{round(1 / size)}", value)
                      for size, value in zip(sizes, values)]
            if len(sizes) > 1:
                band = ORDER.get(shape, ()) if kind == "bar" else ()
                found.append(Check(f"{kind}, {shape}", "observed order", observed_order(sizes, values), *band))
    return found


def draw(folders: Folders, out: Path) -> list[Path]:
    panels = [convergence(title, "relative error of the displacement", errors(folders, kind), "h / size")
              for kind, title in (("bar", "standing wave in a bar"), ("ring", "torsion of a ring"))]
    return [draw_panels(out / "waves_convergence.png", "Standing waves", panels)]


PROBLEM = Problem("waves", "Standing waves in a bar and a ring", "linear elasticity", runs, checks, draw)
