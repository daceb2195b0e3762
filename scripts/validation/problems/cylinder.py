"""A plate pressed on a cylinder, in plane strain: width of the contact and pressure there.

Over the load, against Hertz; over the approach from where the undeformed bodies touch, which in plane strain depends on
the whole body, against finite elements that move with it.
"""

from __future__ import annotations

import math
from pathlib import Path

from validation.checks import Check, holds, near, observed_order, record
from validation.closed_forms import HertzCylinder, plane_strain_modulus
from validation.figures import Curve, Panel, draw_panels
from validation.lagrangian_contact import at_approach
from validation.problems import pressing
from validation.runs import Run
from validation.suite import Folders, Problem

CELLS = (16, 32, 64)  # to a radius
ACROSS, BAND = 4.5, 0.12  # of the half-width at the approach, from so many cells across the contact on
HERTZ = HertzCylinder(pressing.RADIUS, plane_strain_modulus(pressing.YOUNGS, pressing.POISSON))


def run(cells: int) -> Run:
    cell = pressing.RADIUS / cells
    low = pressing.RADIUS + cell / 2
    return Run("validation/cylinder_press", {
        "domain.cell_size": cell, "bodies.1.shape.lower": [0.0, low], "time.end": 30.0 + cell / 2 / pressing.SPEED,
        "output.particles.interval": 5.0}, 0.00006 * cells**3)


def runs(full: bool) -> dict[str, Run]:
    return {f"R/{cells}": run(cells) for cells in (CELLS if full else CELLS[:2])}


def measured(folders: Folders) -> dict[int, list[tuple[pressing.State, float, float, float]]]:
    """By cells to a radius: the state, the load P, and the errors of half-width and peak pressure."""
    found = {}
    for cells in CELLS:
        if f"R/{cells}" not in folders:
            continue
        rows = []
        for state in pressing.states(folders[f"R/{cells}"], pressing.RADIUS / cells):
            load = 2 * state.force  # the model is half of the contact
            half_width = 2 * math.sqrt(state.second_moment)  # the mean square of Hertz's pressure is b^2 / 4
            rows.append((state, load, half_width / HERTZ.half_width(load) - 1,
                         state.peak / HERTZ.peak_pressure(load) - 1))
        found[cells] = rows
    return found


def at_the_approach(cells: int, state: pressing.State) -> list[Check]:
    """Load and half-width against the Lagrangian reference."""
    if not state.depth > 0:
        return []
    radius, right = pressing.RADIUS, at_approach(False, state.depth / pressing.RADIUS)
    across = 2 * right.width * cells
    case = f"R/{cells}, {across:.1f} cells across"
    width = 2 * math.sqrt(state.second_moment)
    return [near(case, "half-width b at the approach [m]", width, right.width * radius, BAND) if across >= ACROSS
            else record(case, "half-width b at the approach [m]", width, right.width * radius),
            record(case, "load P at the approach [N/m]", 2 * state.force, right.force * pressing.YOUNGS * radius)]


def checks(folders: Folders) -> list[Check]:
    found, series = [], measured(folders)
    widths, peaks, depths = [], [], []
    for cells, rows in series.items():
        for state, load, width_error, peak_error in rows:
            found += at_the_approach(cells, state)
            right = HERTZ.half_width(load)
            found += pressing.compare(f"R/{cells}", pressing.RADIUS / cells, right, [
                ("half-width b [m]", right * (1 + width_error), right),
                ("peak pressure p0 [Pa]", HERTZ.peak_pressure(load) * (1 + peak_error), HERTZ.peak_pressure(load))])
            widths.append((2 * right * cells / pressing.RADIUS, width_error))
            peaks.append((2 * right * cells / pressing.RADIUS, peak_error))
            depths.append((state.depth * cells / pressing.RADIUS, width_error))
    ends = {cells: rows[-1] for cells, rows in series.items() if rows}
    for name, index in (("half-width", 2), ("peak pressure", 3)):
        errors = [abs(row[index]) for row in ends.values()]
        if len(errors) > 1:
            found += [holds("largest load", f"error of the {name} falls with h", errors[-1] < errors[0]),
                      record("largest load", f"order of the error of the {name}",
                             observed_order([1 / cells for cells in ends], errors))]
    return found + [record("all", f"cells for 10 % of the {name}", pressing.cells_needed(errors))
                    for name, errors in (("half-width: across the contact", widths),
                                         ("half-width: of approach", depths),
                                         ("peak pressure: across the contact", peaks))]


def draw(folders: Folders, out: Path) -> list[Path]:
    width, peak, depth = [], [], []
    for cells, rows in measured(folders).items():
        across = [2 * HERTZ.half_width(load) * cells / pressing.RADIUS for _, load, _, _ in rows]
        width.append(Curve(f"h = R/{cells}", across, [row[2] for row in rows], "o-"))
        peak.append(Curve(f"h = R/{cells}", across, [row[3] for row in rows], "o-"))
        depth.append(Curve(f"h = R/{cells}", [row[0].depth * cells / pressing.RADIUS for row in rows],
                           [row[2] for row in rows], "o-"))
    panels = [Panel("half-width", "cells across the contact", "relative error", width),
              Panel("half-width", "cells of approach", "relative error", depth),
              Panel("peak pressure", "cells across the contact", "relative error", peak)]
    return [draw_panels(out / "cylinder.png", "Cylinder pressed by a plate, against Hertz", panels)]


PROBLEM = Problem("cylinder", "Plate on a cylinder",
                  "Lagrangian finite elements; Hertz, plane strain; Johnson, Contact Mechanics, section 4.2", runs,
                  checks, draw, literal=tuple(f"R/{cells}" for cells in CELLS), forms=("whole", "stand-off"))
