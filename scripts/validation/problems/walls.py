"""Walls of the domain: what slumps there moves as on rollers or a rigid body, what bounces, splashes or mushrooms loses
no point, and contact gives no energy.

`contact_gain` of history.csv is what contact gave since the start. Where it is missing, the largest fall of
contact_dissipation stands for it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from results import Run as Results
from validation.checks import Check, below, near, record
from validation.figures import Curve, Panel, draw_panels
from validation.runs import Run
from validation.series import Table, history
from validation.suite import Folders, Problem

FLOORS = ("wall", "rollers", "slab")
SLUMPS = {2: (0.02, 0.01), 3: (0.05, 0.025)}  # cell sizes [m], by dimension
RELEASES = ("reaction", "approach", "traction")
BOUNCES = tuple((modulus, points, release) for modulus in (1e4, 1e5) for points in (4, 16) for release in RELEASES)
TAYLOR_CELLS = (6, 8)  # to a radius
TAYLOR_SPEED, TAYLOR_LENGTH = 227.0, 21.4e-3  # [m/s], at the end [m]


def slump(dimension: int, cell: float, floor: str) -> Run:
    lower, upper, column = [0.0, 0.0], [1.2, 0.6], [0.25, 0.4]
    changes = {}
    if dimension == 3:
        lower, upper, column = [0.0, 0.0, 0.0], [0.8, 0.5, 0.8], [0.25, 0.4, 0.25]
        changes = {"domain.dimension": 3, "domain.gravity": [0.0, -9.81, 0.0], "boundary.back": '{ type = "symmetry" }'}

    def body(low: list, high: list, material: str) -> str:
        return f'{{ shape = {{ type = "box", lower = {low}, upper = {high} }}, material = "{material}" }}'

    bodies = [body(list(lower), column, "clay")]
    if floor == "rollers":
        changes["boundary.bottom"] = '{ type = "symmetry" }'
    if floor == "slab":
        lower[1] = -4 * cell
        changes["boundary.bottom"] = '{ type = "free" }'
        bodies.append(body(lower, [upper[0], 0.0, *upper[2:]], "slab"))
    changes["bodies"] = f"[{', '.join(bodies)}]"
    cells = [round((high - low) / cell) for low, high in zip(lower, upper)]
    return Run("validation/slump", changes | {"domain.lower": lower, "domain.upper": upper, "domain.cells": cells},
               4e-5 / cell**3 if dimension == 2 else 1.5e-4 / cell**4 / 4)


def slump_label(dimension: int, cell: float, floor: str) -> str:
    return f"slump {dimension}D, {1000 * cell:g} mm, {floor}"


def bounce(modulus: float, points: int, release: str, end: float) -> Run:
    return Run("validation/bounce", {"materials.soft.youngs_modulus": modulus, "solver.points_per_cell": points,
                                     "contact.release": f'"{release}"', "time.end": end},
               0.01 * end * points * (modulus / 1e4) ** 0.5)


def bounce_label(modulus: float, points: int, release: str) -> str:
    return f"bounce, E {modulus:g} Pa, {points} points a cell, {release}"


def taylor(cells: int) -> Run:
    return Run("validation/taylor_bar", {"domain.cell_size": 3.2e-3 / cells}, 0.1 * cells**4 / 6)


def runs(full: bool) -> dict[str, Run]:
    found = {}
    for dimension, sizes in SLUMPS.items():
        found |= {slump_label(dimension, cell, floor): slump(dimension, cell, floor)
                  for cell in (sizes if full else sizes[:1]) for floor in FLOORS}
    bounces = BOUNCES if full else BOUNCES[:1]
    found |= {bounce_label(*which): bounce(*which, 60.0 if full else 12.0) for which in bounces}
    found["nine putty disks"] = Run("validation/putty", {}, 5.0)
    return found | {f"Taylor bar, R/{cells}": taylor(cells) for cells in (TAYLOR_CELLS if full else TAYLOR_CELLS[:1])}


def gain_checks(case: str, table: Table, scale: float, limit: float = 1e-9) -> list[Check]:
    """What contact gave, as a share of an energy [J]."""
    heat = table["contact_dissipation"]
    fall = max(float((np.maximum.accumulate(heat) - heat).max()), 0.0) / scale
    if "contact_gain" in table:
        gain = np.abs(table["contact_gain"]).max() / scale
        return [below(case, "energy that contact gave, over the largest kinetic", gain, limit),
                record(case, "largest fall of contact_dissipation, over the largest kinetic", fall)]
    return [below(case, "largest fall of contact_dissipation, over the largest kinetic", fall, limit)]


def slump_checks(folders: Folders) -> list[Check]:
    """Kinetic energy at every time against that on rollers and on a slab, as a share of its largest."""
    found = []
    for dimension, sizes in SLUMPS.items():
        for cell in sizes:
            tables = {floor: history(folders[name]) for floor in FLOORS
                      if (name := slump_label(dimension, cell, floor)) in folders}
            if "wall" not in tables:
                continue
            case, wall = slump_label(dimension, cell, "wall"), tables["wall"]
            for floor, table in tables.items():
                largest = table["kinetic_energy"].max()
                found.append(record(slump_label(dimension, cell, floor), "largest kinetic energy [J]", largest))
                if floor != "wall":
                    here = np.interp(table["time"], wall["time"], wall["kinetic_energy"])
                    found.append(below(case, f"kinetic energy off that on the {floor}, over its largest",
                                       np.abs(here - table["kinetic_energy"]).max() / largest, 0.01))
            found += gain_checks(case, wall, wall["kinetic_energy"].max())
    return found


def alone(folder: Path, cell: float) -> tuple[int, int]:
    """Points lost, and points more than a cell and a half from all others of their body, at the last output."""
    first, *_, last = Results(folder).frames
    x, body = last.field("position"), last.field("body")
    count = 0
    for which in np.unique(body):
        mine = x[body == which]
        for start in range(0, len(mine), 500):
            distance = np.linalg.norm(mine[start:start + 500, None] - mine[None], axis=2)
            count += int((np.partition(distance, 1, axis=1)[:, 1] > 1.5 * cell).sum())
    return len(first.field("body")) - len(body), count


def taylor_checks(folders: Folders) -> list[Check]:
    found = []
    for cells in TAYLOR_CELLS:
        case = f"Taylor bar, R/{cells}"
        if case not in folders:
            continue
        table, frames = history(folders[case]), Results(folders[case]).frames
        energy = table["kinetic_energy"][0]
        half_point = 3.2e-3 / cells / 4
        length = frames[-1].field("position")[:, 1].max() + half_point
        speed = max(float(np.linalg.norm(frame.field("velocity"), axis=1).max()) for frame in frames)
        found += gain_checks(case, table, energy, 1e-3)
        found += [below(case, "largest energy_error", np.abs(table["energy_error"]).max(), 3e-3),
                  near(case, "final length [m]", length, TAYLOR_LENGTH, 0.3 / 21.4),
                  below(case, "fastest point over the impact's speed", speed / TAYLOR_SPEED, 1.5)]
    return found


def checks(folders: Folders) -> list[Check]:
    found = slump_checks(folders)
    for which in BOUNCES:
        if (case := bounce_label(*which)) in folders:
            table = history(folders[case])
            found.append(below(case, "points lost", alone(folders[case], 0.025)[0], 0))
            found.append(record(case, "largest energy_error", np.abs(table["energy_error"]).max()))
            if which[2] == "reaction":
                found += gain_checks(case, table, table["kinetic_energy"].max())
    if (case := "nine putty disks") in folders:
        lost, single = alone(folders[case], 0.0125)
        table = history(folders[case])
        found += [below(case, "points lost", lost, 0),
                  below(case, "points apart from the rest of their body", single, 0)]
        found += gain_checks(case, table, table["kinetic_energy"].max())
    return found + taylor_checks(folders)


def draw(folders: Folders, out: Path) -> list[Path]:
    panels = []
    for dimension, sizes in SLUMPS.items():
        curves = []
        for cell in sizes:
            for floor in FLOORS:
                if (name := slump_label(dimension, cell, floor)) in folders:
                    table = history(folders[name])
                    curves.append(Curve(name, table["time"], table["kinetic_energy"]))
        panels.append(Panel(f"clay column, {dimension}D", "time [s]", "kinetic energy [J]", curves))
    bars = []
    for cells in TAYLOR_CELLS:
        if (name := f"Taylor bar, R/{cells}") in folders:
            table = history(folders[name])
            heat = table["contact_dissipation"]
            bars.append(Curve(name, 1e6 * table["time"], heat / table["kinetic_energy"][0]))
    panels.append(Panel("Taylor bar", "time [us]", "contact dissipation / impact energy", bars))
    return [draw_panels(out / "walls.png", "Walls", panels)]


PROBLEM = Problem("walls", "Walls: slump, bounce, putty, Taylor bar",
                  "rollers, a rigid slab; Taylor's bar as Lagrangian codes have it", runs, checks, draw,
                  literal=tuple(slump_label(2, 0.02, floor) for floor in FLOORS),
                  forms=("approach", "traction"))
