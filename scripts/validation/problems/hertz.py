"""An elastic sphere, pressed slowly by a plate and hitting a wall: a Lagrangian reference, and Hertz.

The approach counts from where the undeformed bodies touch. At 4 % of the radius Hertz's own force is 10 % too small, so
that force, radius and pressure over the approach are compared with finite elements that move with the body; the radius
and the pressure over the force with Hertz.

Points of equal volume make steps of a sphere's surface, and how wide the lowest one is changes with the sphere's place
in its cell: the duration of an impact is that over four places, an eighth of a cell apart.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from validation.checks import Check, holds, near, record
from validation.closed_forms import HertzSphere, plane_strain_modulus, swing_time
from validation.figures import Curve, Panel, draw_panels
from validation.lagrangian_contact import at_approach
from validation.problems import pressing
from validation.problems.pressing import RADIUS, SPEED
from validation.runs import Run
from validation.series import crossing, motion
from validation.suite import Folders, Problem

CELLS = (8, 16, 32)  # to a radius
GAP = 0.5  # under the sphere before the impact [cells]; with the others, places of it in its cell
GAPS = (GAP, 0.625, 0.75, 0.875)
HERTZ = HertzSphere(RADIUS, plane_strain_modulus(pressing.YOUNGS, pressing.POISSON))
FORCE = "force at the approach [N]"
FEW, BANDS = 7.0, (0.12, 0.08)  # cells across the contact; of the force, with fewer from 3 on, and with more
SPREAD = {16: 0.02}  # of an impact's duration over its places, over the mean, by cells to a radius
MASS, IMPACT_SPEED = 4 / 3 * math.pi * RADIUS**3, 0.0116  # [kg], [m/s]


def press(cells: int) -> Run:
    cell = RADIUS / cells
    # The plate ends 4 % of the radius below the top of the sphere, whatever the gap.
    return Run("validation/sphere_press", {
        "domain.cell_size": cell, "bodies.1.shape.lower": [0.0, RADIUS + cell / 2, 0.0],
        "time.end": (0.04 * RADIUS + cell / 2) / SPEED, "output.particles.interval": 4.0}, 0.0001 * cells**4)


def impact(cells: int, gap: float) -> Run:
    cell = RADIUS / cells
    end = cell * gap / IMPACT_SPEED + 1.3 * HERTZ.impact_time(MASS, IMPACT_SPEED)
    return Run("validation/sphere_impact", {
        "domain.cell_size": cell, "bodies.0.shape.centre": [0.0, RADIUS + cell * gap, 0.0], "time.end": end},
        0.00012 * cells**4)


def impact_label(cells: int, gap: float = GAP) -> str:
    return f"impact, R/{cells}{'' if gap == GAP else f', gap {gap:g} h'}"


def runs(full: bool) -> dict[str, Run]:
    cells = CELLS if full else CELLS[:2]
    return {f"press, R/{count}": press(count) for count in cells} | {
        impact_label(count, gap): impact(count, gap) for count in cells for gap in GAPS}


def pressed(folder: Path, cells: int) -> list[tuple[float, list[tuple[str, float, float]]]]:
    """At each output: the contact's radius in the reference, and what was measured, with what it should be."""
    found = []
    for state in pressing.states(folder, RADIUS / cells):
        if state.depth <= 0:
            continue
        force, radius = 4 * state.force, math.sqrt(2.5 * state.second_moment)  # a quarter of the contact
        right = at_approach(True, state.depth / RADIUS)  # in radii and Young's moduli
        found.append((right.width * RADIUS, [
            (FORCE, force, right.force * pressing.YOUNGS * RADIUS**2),
            ("contact radius a at the approach [m]", radius, right.width * RADIUS),
            ("peak pressure at the approach [Pa]", state.peak, right.peak * pressing.YOUNGS),
            ("contact radius a at the force [m]", radius, float(HERTZ.contact_radius(force))),
            ("peak pressure at the force [Pa]", state.peak, float(HERTZ.peak_pressure(force)))]))
    return found


def impact_checks(folders: Folders) -> list[Check]:
    found, errors = [], {}
    times, velocities = HERTZ.impact(MASS, IMPACT_SPEED)
    start, end = swing_time(times, velocities)
    whole = HERTZ.impact_time(MASS, IMPACT_SPEED)
    for cells in CELLS:
        across = 2 * math.sqrt(RADIUS * HERTZ.largest_approach(MASS, IMPACT_SPEED)) * cells / RADIUS
        for gap in GAPS:
            if (name := impact_label(cells, gap)) not in folders:
                continue
            path = motion(folders[name], 0)
            began, ended = swing_time(path["time"], path["vy"])
            lasts = (ended - began) / (end - start) * whole
            errors.setdefault(cells, []).append(lasts / whole - 1)
            case = f"{name}, {across:.1f} cells across"
            found += [record(case, "duration [s]", lasts, whole),
                      record(case, "parting/closing speed", path["vy"][-1] / IMPACT_SPEED, 1.0)]
            if gap == GAP:
                first = crossing(path["time"], path["vy"] + IMPACT_SPEED, 2e-3 * IMPACT_SPEED)
                since_first = float(np.interp(first, path["time"], path["y"])) - path["y"].min()
                deepest = HERTZ.largest_approach(MASS, IMPACT_SPEED)
                found += [record(case, "largest approach [m]", RADIUS - path["y"].min(), deepest),
                          record(case, "largest approach since the first force [m]", since_first, deepest)]
    for cells, of_cells in errors.items():
        spread = (max(of_cells) - min(of_cells)) / (1 + sum(of_cells) / len(of_cells))
        case = f"impact, R/{cells}, {len(of_cells)} places"
        found.append(Check(case, "spread of the duration, over the mean", spread,
                           *((0.0, SPREAD[cells]) if cells in SPREAD else ())))
    spread = {cells: float(np.sqrt(np.mean(np.square(of_cells)))) for cells, of_cells in errors.items()}
    found += [record(f"impact, R/{cells}, {len(errors[cells])} places", "root mean square error of the duration", value)
              for cells, value in spread.items()]
    if len(spread) > 1:
        by_size = list(spread.values())
        found.append(holds("impact", "error of the duration falls with h", by_size[-1] < by_size[0]))
    return found


def checks(folders: Folders) -> list[Check]:
    found, last, series = [], {}, {}
    for cells in CELLS:
        if f"press, R/{cells}" not in folders:
            continue
        for radius, rows in pressed(folders[f"press, R/{cells}"], cells):
            across = 2 * radius * cells / RADIUS
            for check in pressing.compare(f"press, R/{cells}", RADIUS / cells, radius, rows):
                if check.quantity == FORCE and across >= 3:
                    check = near(check.case, FORCE, check.value, check.expected, BANDS[across >= FEW])
                found.append(check)
            for name, value, expected in rows:
                series.setdefault(name, []).append((2 * radius * cells / RADIUS, value / expected - 1))
                last.setdefault(name, {})[cells] = abs(value / expected - 1)
    for name, errors in last.items():
        by_size = list(errors.values())
        if len(by_size) > 1:
            found.append(holds("press, largest force", f"error falls with h: {name}", by_size[-1] < by_size[0]))
        found.append(record("press", f"cells across the contact for 10 %: {name}",
                            pressing.cells_needed(series[name])))
    return found + impact_checks(folders)


def draw(folders: Folders, out: Path) -> list[Path]:
    depth = np.linspace(0, 0.04, 100)
    force = [Curve("Hertz", depth, HERTZ.force(depth), "k:"),
             Curve("Lagrangian", depth[1:], [at_approach(True, d / RADIUS).force for d in depth[1:]], "k--")]
    radius = [Curve("Hertz", HERTZ.force(depth), HERTZ.contact_radius(HERTZ.force(depth)), "k--")]
    times, velocities = HERTZ.impact(MASS, IMPACT_SPEED)
    speed = [Curve("Hertz", times, -velocities / IMPACT_SPEED, "k--")]
    for cells in CELLS:
        cell = RADIUS / cells
        if (name := f"press, R/{cells}") in folders:
            time, values = pressing.force_series(folders[name])
            force.append(Curve(f"h = R/{cells}", SPEED * time - cell / 2, 4 * values))
            states = pressing.states(folders[name], cell)
            radius.append(Curve(f"h = R/{cells}", [4 * state.force for state in states],
                                [math.sqrt(2.5 * state.second_moment) for state in states], "o-"))
        if (name := impact_label(cells)) in folders:
            path = motion(folders[name], 0)
            speed.append(Curve(f"h = R/{cells}", path["time"] - cell / 2 / IMPACT_SPEED, path["vy"] / IMPACT_SPEED))
    panels = [Panel("plate on a sphere", "approach [m]", "force [N]", force),
              Panel("plate on a sphere", "force [N]", "contact radius [m]", radius),
              Panel("sphere hits a wall", "time [s]", "velocity / impact velocity", speed)]
    return [draw_panels(out / "hertz.png", "Hertz contact", panels)]


PROBLEM = Problem("hertz", "Sphere: plate and impact",
                  "Lagrangian finite elements; Hertz; Johnson, Contact Mechanics, sections 4.2 and 11.4", runs, checks,
                  draw, literal=(*(f"press, R/{cells}" for cells in CELLS),
                                 *(impact_label(cells, gap) for cells in CELLS[:2] for gap in GAPS)),
                  forms=("whole", "stand-off"))
