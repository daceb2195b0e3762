"""A sphere on a deformable incline, against a rigid sphere: rolling without slip, and sliding as it rolls.

A sphere that starts above the plane falls freely first, lands and bounces: it does not roll meanwhile, and gets further
than one that rolls all the time. Two references know of that. About the point of contact the angular momentum of a
rigid sphere grows by gravity alone, m R v + 2/5 m R^2 w = m g R sin(a) t, however it is pushed there; with the slip
s = v - R w that is
    x = 5/14 g sin(a) t^2 + 2/7 int s dt,
so that x less 2/7 of the way slipped is that of pure rolling for any gap, friction and bounce. And `DroppedSphere`
follows a sphere that falls the gap onto an elastic contact.

Where within a cell the sphere starts decides which of its points land first, and bounces carry that on: without slip, x
differs by 3 % of it between places. The bands are for the mean over four of them, a quarter of a cell apart.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from validation.checks import Check, holds, near, record
from validation.closed_forms import DroppedSphere, Rigid
from validation.figures import convergence, draw_panels
from validation.problems import rolling
from validation.runs import Run
from validation.series import Table, motion
from validation.suite import Folders, Problem

RADIUS, GRAVITY, END = 1.6, 10.0, 2.0  # [m], [m/s2], [s]
SIZE = (20.0, 2.0)  # of the plane along x and z [m]
RUBBER = {"density": 1000.0, "youngs": 54e6 / 7, "poisson": 2 / 7}  # K = 6 MPa, G = 3 MPa
DROPPED = DroppedSphere(RADIUS, **RUBBER, softness=1.1)  # the plane is ten times as stiff
CELLS = (2, 4, 8)  # to a radius
GAPS = ("h/2", "0")  # between sphere and plane at the start
PLACE = 0.37  # of the centre along x within its cell
PLACES = (0.12, PLACE, 0.62, 0.87)  # of the spheres that do not slip, with 4 cells
# Friction, incline [degrees], allowed error of x at 1 and 2 s and of the spin, with 4 cells.
CASES = {"no slip": (0.495, 45, 0.05, None), "slip": (0.286, 60, 0.03, 0.10)}


def label(kind: str, cells: int, gap: str, place: float = PLACE) -> str:
    return f"{kind}, R/{cells}, gap {gap}{'' if place == PLACE else f', place {place}'}"


def rigid_sphere(kind: str) -> Rigid:
    friction, degrees, *_ = CASES[kind]
    return Rigid(RADIUS, 2 / 5, GRAVITY, math.radians(degrees), friction)


def run(kind: str, cells: int, gap: str, place: float = PLACE) -> Run:
    """The plane is half a radius thick, but at least two cells."""
    friction, degrees, *_ = CASES[kind]
    cell, angle = RADIUS / cells, math.radians(degrees)
    top = max(RADIUS / 2, 2 * cell)
    height = top + RADIUS + (cell / 2 if gap == "h/2" else 0)
    upper = [math.ceil(length / cell - 1e-9) * cell for length in (SIZE[0], top + 2 * RADIUS + 1.0, SIZE[1])]
    return Run("validation/sphere_plane", {
        "domain.upper": upper, "domain.cell_size": cell, "contact.friction": friction,
        "domain.gravity": [GRAVITY * math.sin(angle), -GRAVITY * math.cos(angle), 0.0],
        "bodies.0.shape.upper": [upper[0], top, upper[2]],
        "bodies.1.shape.centre": [2.4 + place * cell, height, 0.0]}, 0.02 * cells**4)


def runs(full: bool) -> dict[str, Run]:
    cells, gaps = (CELLS, GAPS) if full else (CELLS[:2], GAPS[:1])
    found = {label(kind, count, gap): run(kind, count, gap) for kind in CASES for count in cells for gap in gaps}
    return found | {label("no slip", 4, gap, place): run("no slip", 4, gap, place) for gap in gaps for place in PLACES}


def slipped(path: Table, time: float) -> float:
    """The way slipped: the integral of v - R w, with the spin w in the sense of rolling."""
    inside = path["time"] <= time
    return float(np.trapz((path["vx"] + RADIUS * path["wz"])[inside], path["time"][inside]))


def beside_the_drop(name: str, kind: str, gap: float, path: Table, share: float | None) -> list[Check]:
    """Against pure rolling, with the way slipped taken off, and against a sphere that falls the gap and bounces."""
    friction, degrees, *_ = CASES[kind]
    times, way = DROPPED.path(GRAVITY, math.radians(degrees), friction, gap, END)
    rolling_alone, found = 5 / 14 * GRAVITY * math.sin(math.radians(degrees)), []
    for time in (1.0, END):
        travelled = rolling.travelled(path, time)
        row = (name, f"x less 2/7 of the way slipped, at {time:g} s [m]", travelled - 2 / 7 * slipped(path, time),
               rolling_alone * time**2)
        found.append(record(*row) if share is None else near(*row, share))
        found.append(record(name, f"x at {time:g} s, elastic drop [m]", travelled,
                            float(np.interp(time, times, way))))
    return found


def over_places(folders: Folders) -> list[Check]:
    """Without slip, with 4 cells: x in the mean over the places, and its range."""
    found, rigid, share = [], rigid_sphere("no slip"), CASES["no slip"][2]
    for gap in GAPS:
        names = [label("no slip", 4, gap, place) for place in PLACES]
        if not set(names) <= set(folders):
            continue
        paths = [motion(folders[name], 1) for name in names]
        for time in (1.0, END):
            x = [rolling.travelled(path, time) for path in paths]
            row = f"no slip, R/4, gap {gap}, {len(x)} places"
            found += [near(row, f"mean x at {time:g} s [m]", np.mean(x), rigid.distance(time), share),
                      record(row, f"smallest x at {time:g} s [m]", min(x), rigid.distance(time)),
                      record(row, f"largest x at {time:g} s [m]", max(x), rigid.distance(time))]
    return found


def checks(folders: Folders) -> list[Check]:
    found = over_places(folders)
    for kind, (_, _, share, spin_share) in CASES.items():
        rigid = rigid_sphere(kind)
        for gap in GAPS:
            errors = {}
            for cells in CELLS:
                if (name := label(kind, cells, gap)) not in folders:
                    continue
                bands = (share, spin_share) if gap == "h/2" and cells == 4 else (None, None)
                path, x_band = motion(folders[name], 1), None if kind == "no slip" else bands[0]
                found += rolling.checks(name, path, rigid, 1.0, x_band, None, 0.5)
                found += rolling.checks(name, path, rigid, END, x_band, bands[1], END / 2)
                errors[cells] = abs(found[-2].error)
                height = RADIUS / cells / 2 if gap == "h/2" else 0.0
                found += beside_the_drop(name, kind, height, path, bands[0] if kind == "no slip" else None)
            if gap == "h/2" and 8 in errors and 4 in errors:
                found.append(holds(kind, "x at 2 s better at R/8 than at R/4", errors[8] < errors[4]))
    return found


def draw(folders: Folders, out: Path) -> list[Path]:
    """Position, velocity and spin (the paper's Figs. 3 to 6), and the error of x against the cells."""
    groups, errors = {}, {}
    for kind in CASES:
        rigid = rigid_sphere(kind)
        tables = {cells: motion(folders[name], 1) for cells in CELLS if (name := label(kind, cells, "h/2")) in folders}
        groups[kind] = (rigid, {f"h = R/{cells}": table for cells, table in tables.items()})
        errors[kind] = ([1 / cells for cells in tables],
                        [rolling.travelled(table, END) / rigid.distance(END) - 1 for table in tables.values()])
    panel = convergence("Sphere, x at 2 s", "relative error", errors, "h / R")
    return [rolling.draw(out / "sphere.png", "Sphere on an inclined plane", groups, END),
            draw_panels(out / "sphere_convergence.png", "", [panel])]


PROBLEM = Problem("sphere", "Sphere on a deformable incline", "Bardenhagen et al. 2001, section 3.1, eqs. 23 and 24",
                  runs, checks, draw,
                  literal=(*(label("no slip", 4, "h/2", place) for place in PLACES), label("slip", 4, "h/2")))
