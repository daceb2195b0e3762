"""A stress wave through five disks in a zig-zag, slipping and sticking: who is reached when, and the fringes.

A disk is reached when the mean difference of its principal stresses, the fringes, is 0.1 rho c v; a contact, when that
near it is.
"""

from __future__ import annotations

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

FRAME_TIMES = {"slip": (3.0, 6.0, 9.0), "stick": (1.4, 3.6, 5.8)}  # the paper's, in transit times
FRICTION = {"slip": 0.5, "stick": "inf"}
# The disks approach by a small share of a cell: contact as soon as they share a node, as in the paper, is recorded too.
EARLY = ", fill 0"
STEP = fronts.DIAMETER / 2**0.5  # between centres along x and y [m]
RADIUS = fronts.DIAMETER / 2
CENTRES = [(RADIUS + (4 - k) * STEP, RADIUS + (STEP if k % 2 else 0)) for k in range(5)]  # from the pin on
NEAR = 4 * fronts.CELL  # what counts as near a contact [m]


def runs(full: bool) -> dict[str, Run]:
    own = {name: Run("validation/five_disks", {"contact.friction": friction}, 16.0)
           for name, friction in FRICTION.items()}
    return own | ({name + EARLY: run.changed({"contact.fill": 0.0}) for name, run in own.items()} if full else {})


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
            if case == "slip":
                found.append(Check(case, f"disk {disk + 1}: the wall is loaded sooner by [transit times]",
                                   (contact - wall) / unit, 0.0, 100.0))
    for fill, band in (("", (1.5, 10.0)), (EARLY, ())):
        if {f"slip{fill}", f"stick{fill}"} <= set(duration):
            ratio = duration[f"slip{fill}"] / duration[f"stick{fill}"]
            found.append(Check(f"slip and stick{fill}", "speed, stick over slip", ratio, *band))
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
                  "Bardenhagen et al. 2001, section 3.3, Figs. 10 and 11", runs, checks, draw)
