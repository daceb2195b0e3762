"""Two equal bars meet end on: how long they touch, the stress between them, and the speed at which they part."""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np

from results import Run as Results
from validation.checks import Check, near, record
from validation.closed_forms import bar_against_wall, pulse_length
from validation.figures import Curve, Panel, draw_panels
from validation.runs import Run
from validation.series import motion
from validation.suite import Folders, OF_FLAT_BODIES, Problem

LENGTH, SPEED_OF_SOUND, DENSITY, MODULUS = 1.0, 1.0, 1.0, 1.0  # SI
BULK, SHEAR = 1 / 3, 1 / 2  # [Pa]
JOINT = 1.2  # [m]
CLOSING = (0.01, 0.1)  # over the speed of sound
CELLS = (50, 100, 200)  # to a bar; the bands are for the second
GAPS = ("h/2", "0")  # between the bars at the start; the bands are for the first
REGION = 0.1  # from the joint, over which the stress is averaged [m]


def label(closing: float, cells: int, gap: str) -> str:
    return f"v = {closing} c, {cells} cells a bar, gap {gap}"


def run(closing: float, cells: int, gap: str) -> Run:
    """The gap is between the bars' ends, half of it on either side of the joint: they move towards each other."""
    cell = LENGTH / cells
    half = {"h/2": cell / 4, "0": 0.0}[gap]
    end = 2 * half / closing + 3.2
    return Run("validation/two_bars", {
        "domain.cell_size": cell, "domain.upper": f"[2.4, {4 * cell}]", "time.end": end,
        "bodies.0.shape": f'{{ type = "box", lower = [{JOINT - half - LENGTH}, 0.0], '
                          f'upper = [{JOINT - half}, {4 * cell}] }}',
        "bodies.1.shape": f'{{ type = "box", lower = [{JOINT + half}, 0.0], '
                          f'upper = [{JOINT + half + LENGTH}, {4 * cell}] }}',
        "output.particles": '{ interval = 0.1, fields = ["stress"] }',
        "bodies.0.velocity": f"[{closing / 2}, 0.0]", "bodies.1.velocity": f"[{-closing / 2}, 0.0]"}, 1.0)


def runs(full: bool) -> dict[str, Run]:
    return {label(closing, cells, gap): run(closing, cells, gap) for closing in CLOSING
            for cells in (CELLS if full else CELLS[1:2]) for gap in (GAPS if full else GAPS[:1])}


def nominal_stress(stretch):
    """Neo-Hookean, uniaxial strain: P = K/2 (a - 1/a) + 2 G/3 (a^(1/3) - a^(-5/3)) [Pa]."""
    return BULK / 2 * (stretch - 1 / stretch) + 2 / 3 * SHEAR * (stretch ** (1 / 3) - stretch ** (-5 / 3))


@functools.cache
def finite_strain(closing: float) -> tuple[np.ndarray, np.ndarray]:
    """Times from the first touch on, and the mean velocity of a bar: with a flight before it."""
    times, velocities = bar_against_wall(nominal_stress, closing / 2, MODULUS, DENSITY, LENGTH)
    flight = np.array([-0.5, -1e-9])
    return np.concatenate((flight, times)), np.concatenate(([-closing / 2] * 2, velocities))


@functools.cache
def exact_duration(closing: float) -> float:
    """Of the fine grid's contact, measured like that of the bars [s]: 2 L/c less 3 % at 0.1 c, 0.5 % at 0.01 c. In the
    limit of small strains it is 0.3 % short, from the measure itself."""
    start, end = pulse_length(*finite_strain(closing))
    return end - start


def joint_stress(folder: Path, time: float) -> float:
    """Mean pressure along x of the points within REGION of the joint [Pa], at the nearest output."""
    frame = min(Results(folder).frames, key=lambda frame: abs(frame.time - time))
    inside = np.abs(frame.field("position")[:, 0] - JOINT) < REGION
    return float(-frame.field("stress")[inside, 0].mean())


def check_one(case: str, folder: Path) -> list[Check]:
    closing = float(case.split()[2])
    path = motion(folder, 1)
    start, end = pulse_length(path["time"], path["vx"])
    rebound = 2 * path["vx"][-1] / closing
    found = [near(case, "contact lasts [L/c]", end - start, exact_duration(closing), 0.005),
             record(case, "contact lasts [L/c], linear", end - start, 2 * LENGTH / SPEED_OF_SOUND)]
    if closing < 0.05:
        stress = joint_stress(folder, start + 0.6 * LENGTH / SPEED_OF_SOUND)
        found.append(near(case, "stress at the joint, 0.6 L/c after touch / (rho c v/2)",
                          stress / (DENSITY * SPEED_OF_SOUND * closing / 2), 1.0, 0.01))
    exact = 1.0 if closing < 0.05 else 2 * finite_strain(closing)[1][-1] / closing
    found.append(Check(case, "parting/closing speed", rebound, 0.96, 1.005, exact))
    if case != label(closing, CELLS[1], GAPS[0]):
        found = [Check(check.case, check.quantity, check.value, expected=check.expected) for check in found]
    return found


def checks(folders: Folders) -> list[Check]:
    return [check for case, folder in folders.items() for check in check_one(case, folder)]


def draw(folders: Folders, out: Path) -> list[Path]:
    panels = []
    for closing in CLOSING:
        curves = []
        for case, folder in folders.items():
            if case.startswith(f"v = {closing} c"):
                path = motion(folder, 1)
                start, _ = pulse_length(path["time"], path["vx"])
                curves.append(Curve(case.split(", ", 1)[1], path["time"] - start, 2 * path["vx"] / closing))
        if closing < 0.05:
            curves.append(Curve("exact, linear", np.array([-0.2, 0, 2, 2.6]), np.array([-1, -1, 1, 1]), "k--"))
        else:
            times, velocities = finite_strain(closing)
            curves.append(Curve("fine grid, finite strain", times, 2 * velocities / closing, "k--"))
        panels.append(Panel(f"v = {closing} c", "time after touch [L/c]", "mean velocity / (v/2)", curves))
    return [draw_panels(out / "bars.png", "Two bars", panels)]


PROBLEM = Problem("bars", "Two equal bars", "one-dimensional waves; Johnson, Contact Mechanics, section 11.1", runs,
                  checks, draw, literal=tuple(label(closing, CELLS[1], GAPS[0]) for closing in CLOSING),
                  forms=OF_FLAT_BODIES)
