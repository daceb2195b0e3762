"""A stress wave through five disks in a zig-zag, slipping and sticking: who is reached when, and the fringes.

A disk is reached when the mean difference of its principal stresses, the fringes, is 0.1 rho c v; a contact, when that
near it is.

The paper's experiment glued the disks of the sticking chain together, its simulation gave them an infinite friction.
Both are made: glue holds from the start and over all nodes that disks share; with friction alone a contact must be
pressed before it carries shear, and grows with its load. One point a cell, as in the paper, leaves surfaces in steps,
on which disks slide less easily; all is repeated with nine.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from results import Run as Results
from results import principal_stress_difference
from validation.checks import Check, record
from validation.figures import Curve, Panel, draw_panels
from validation.problems import fronts
from validation.runs import Run
from validation.series import crossing
from validation.suite import Folders, Problem

STUCK = (1.4, 3.6, 5.8)
FRAME_TIMES = {"slip": (3.0, 6.0, 9.0), "stick": STUCK, "glued": STUCK}  # the paper's, in transit times
GLUE = '[{materials=["plexiglas","plexiglas"],law="stick"}]'  # between disks, not to the pin
KINDS = {"slip": {"contact.friction": 0.5}, "stick": {"contact.friction": "inf"}, "glued": {"contact.pair": GLUE}}
FINE = ", 9 points"  # a cell
# The disks approach by a small share of a cell: contact as soon as they share a node, as in the paper, is recorded too.
EARLY = ", fill 0"
STEP = fronts.DIAMETER / 2**0.5  # between centres along x and y [m]
RADIUS = fronts.DIAMETER / 2
CENTRES = [(RADIUS + (4 - k) * STEP, RADIUS + (STEP if k % 2 else 0)) for k in range(5)]  # from the pin on
NEAR = 4 * fronts.CELL  # what counts as near a contact [m]


def runs(full: bool) -> dict[str, Run]:
    own = {name: Run("validation/five_disks", settings, 16.0) for name, settings in KINDS.items()}
    if not full:
        return own
    early = {name + EARLY: own[name].changed({"contact.fill": 0.0}) for name in ("slip", "stick")}
    fine = {name + FINE: dataclasses.replace(run.changed({"solver.points_per_cell": 9}), cost=60.0)
            for name, run in own.items()}
    return own | early | fine


def mean_fringes(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Times, and the mean difference of the principal stresses of each disk (frames x disks) [Pa]."""
    times, values = [], []
    for frame in Results(folder).frames:
        body, difference = frame.field("body"), principal_stress_difference(frame.field("stress"))
        times.append(frame.time)
        values.append(np.bincount(body, difference)[:5] / np.bincount(body)[:5])
    return np.array(times), np.array(values)


def loads(folder: Path, disk: int) -> tuple[float, float]:
    """When the fringes reach a disk's contact with its wall, and that with the next disk [s]."""
    centre = np.array(CENTRES[disk])
    up = 1.0 if disk % 2 else -1.0
    ways = ((0.0, up), (-1.0, -up))
    places = [tuple(centre + (RADIUS - NEAR) * np.array(way) / np.hypot(*way)) for way in ways]
    seen = fronts.Probes(folder, places, [disk, disk], NEAR)
    level = fronts.LEVEL * fronts.impact_stress()
    return tuple(seen.arrivals(fronts.shear_level, level))


def checks(folders: Folders) -> list[Check]:
    found, duration, unit = [], {}, fronts.transit_time()
    level = fronts.LEVEL * fronts.impact_stress()
    for case, folder in folders.items():
        times, values = mean_fringes(folder)
        arrivals = [crossing(times, values[:, k], level) for k in range(5)]
        duration[case] = arrivals[4] - arrivals[0]
        found += [record(case, f"arrival at disk {k + 1} [transit times]", time / unit)
                  for k, time in enumerate(arrivals)]
        found.append(record(case, "speed, disk 1 to 5, along the zig-zag [cm/us]",
                            1e-4 * 4 * fronts.DIAMETER / duration[case]))
        for disk in (1, 2, 3):
            wall, contact = loads(folder, disk)
            found += [record(case, f"disk {disk + 1}: load at the wall [transit times]", wall / unit),
                      record(case, f"disk {disk + 1}: load at the next contact [transit times]", contact / unit)]
            if case in ("slip", "slip" + FINE):
                found.append(Check(case, f"disk {disk + 1}: the wall is loaded sooner by [transit times]",
                                   (contact - wall) / unit, 0.0, 100.0))
    for how, band in (("", (1.5, 10.0)), (FINE, (1.5, 10.0)), (EARLY, ())):
        for kind in ("stick", "glued"):
            if {"slip" + how, kind + how} <= set(duration):
                ratio = duration["slip" + how] / duration[kind + how]
                found.append(Check(f"slip and {kind}{how}", f"speed, {kind} over slip", ratio, *band))
    return found


def draw(folders: Folders, out: Path) -> list[Path]:
    """The paper's Figs. 10 and 11; and the disks' mean principal stress difference over time."""
    panels = []
    for case, folder in folders.items():
        times, values = mean_fringes(folder)
        curves = [Curve(f"disk {k + 1}", times / fronts.transit_time(), values[:, k] / fronts.impact_stress())
                  for k in range(5)]
        panels.append(Panel(case, "time [transit times]", "mean (s1 - s2) / (rho c v)", curves))
    shown = {name: folder for name, folder in folders.items() if name in FRAME_TIMES}
    return [fronts.sheet(shown, FRAME_TIMES, out / "zigzag_fringes.png",
                         "Five disks in a zig-zag, time in transit times of the longitudinal wave"),
            draw_panels(out / "zigzag_arrivals.png", "Five disks in a zig-zag", panels)]


PROBLEM = Problem("zigzag", "Stress wave in five disks in a zig-zag",
                  "Bardenhagen et al. 2001, section 3.3, Figs. 10 and 11", runs, checks, draw,
                  literal=(*KINDS, *(name + FINE for name in KINDS)), forms=("whole", "stand-off"))
