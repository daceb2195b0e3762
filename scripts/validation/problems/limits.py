"""What contact at nodes finds hard: bodies thinner than a cell, three bodies at a node, a sharp corner that rolls, and
friction that changes its sign; against rigid bodies."""

from __future__ import annotations

import functools
import math
from pathlib import Path

import numpy as np

from validation.checks import Check, holds, near
from validation.figures import Curve, Panel, draw_panels
from validation.runs import NO_PARTICLES, Run
from validation.series import Table, motion
from validation.suite import Folders, OF_FLAT_BODIES, Problem

GRAVITY, ANGLE, FRICTION = 9.81, math.pi / 6, 0.3
CELL = 0.05  # of the inclines [m]
PULL, BRAKE = GRAVITY * math.sin(ANGLE), GRAVITY * FRICTION * math.cos(ANGLE)  # [m/s2]
DOWN, UP = PULL - BRAKE, PULL + BRAKE  # accelerations of what slides down and up [m/s2]
SPEED = 3.0  # of the block pushed up [m/s]

# Thickness of plates and places of the plane's top [cells], by points a cell: each a number of rows of points.
PLATES = {4: ((0.5, 1.0), (0.0, 0.5)), 9: ((1 / 3,), (0.0, 1 / 3, 2 / 3)), 16: ((0.25,), (0.0, 0.25, 0.5, 0.75))}
BLOCKS = ((0.3, 0.0), (0.13, 0.11), (0.13, 0.61))  # left side and top of the plane [cells]
SIDE, TILT, FALLEN = 0.4, math.radians(10), math.radians(40)  # of the square [m], at the start, and when it is timed
ACROSS, TOPS = (8, 16, 32), (0.0, 0.3, 0.5)  # cells to its side; top of the ground [cells]


def box(lower: tuple[float, float], size: tuple[float, float]) -> dict[str, str]:
    return {"lower": f"[{lower[0]}, {lower[1]}]", "upper": f"[{lower[0] + size[0]}, {lower[1] + size[1]}]"}


def incline(case: str, top: float, boxes: dict[int, dict[str, str]], changes: dict) -> Run:
    """A case of cells of 5 cm with the plane's top moved up by some cells, and bodies on it."""
    shapes = {f"bodies.{body}.shape.{end}": value for body, ends in boxes.items() for end, value in ends.items()}
    return Run(f"validation/{case}", {"bodies.0.shape.upper": f"[3.2, {0.25 + top * CELL}]"} | shapes | changes, 3.0)


def plates(full: bool) -> dict[str, Run]:
    return {f"plate of {thickness:.2g} cells, {points} points, top {top:.2g}": incline(
        "thin_plate", top, {1: box((0.465, 0.25 + top * CELL), (1.0, thickness * CELL))},
        {"solver.points_per_cell": points})
        for points, (sizes, tops) in PLATES.items() if full or points < 16 for thickness in sizes for top in tops}


def blocks(full: bool) -> dict[str, Run]:
    runs = {}
    for left, top in BLOCKS if full else BLOCKS[::2]:
        x, y = 0.45 + left * CELL, 0.25 + top * CELL
        runs[f"two blocks, shift {left}, {top}"] = incline(
            "two_blocks", top, {1: box((x, y), (0.5, 0.25)), 2: box((x + 0.5, y), (0.5, 0.25))}, {})
        runs[f"uphill, shift {left}, {top}"] = incline("uphill", top, {1: box((x + 1.0, y), (1.0, 0.25))}, {})
    return runs


def square(across: int, top: float) -> Run:
    cell = SIDE / across
    reach, y = SIDE / math.sqrt(2), 0.2 + top * cell
    centre = (0.6 + reach * math.sin(TILT), y + reach * math.cos(TILT))
    return Run("validation/tipping_square", NO_PARTICLES | {
        "domain.cells": f"[{4 * across}, {5 * across // 2}]", "bodies.0.shape.upper": f"[1.6, {y}]"} | {
        f"bodies.1.shape.{end}": value
        for end, value in box((centre[0] - SIDE / 2, centre[1] - SIDE / 2), (SIDE, SIDE)).items()}, across / 4)


def tip_label(across: int, top: float) -> str:
    return f"square tips, {across} cells, top {top:.2g}"


def runs(full: bool) -> dict[str, Run]:
    squares = {tip_label(across, top): square(across, top) for across in (ACROSS if full else ACROSS[:2])
               for top in TOPS}
    return plates(full) | blocks(full) | squares


@functools.cache
def pendulum() -> tuple[np.ndarray, np.ndarray]:
    """Times and angles of a rigid square that turns about its corner, to 45 degrees (leapfrog) [s], [rad]."""
    step, angles, speed = 1e-4, [TILT], 0.0
    while angles[-1] < math.pi / 4:
        middle = angles[-1] + 0.5 * step * speed
        speed += step * 3 / (2 * math.sqrt(2)) * GRAVITY / SIDE * math.sin(middle)
        angles.append(middle + 0.5 * step * speed)
    return step * np.arange(len(angles)), np.array(angles)


def turned(path: Table) -> np.ndarray:
    """Angle of the square over time, from its spin [rad]."""
    steps = np.diff(path["time"]) * (path["wz"][1:] + path["wz"][:-1]) / 2
    return TILT - np.concatenate(([0.0], np.cumsum(steps)))


def time_to_fall(path: Table) -> float:
    angle = turned(path)
    rising = slice(0, int(np.argmax(angle)) + 1)
    return float(np.interp(FALLEN, angle[rising], path["time"][rising]))


def check_one(case: str, folder: Path) -> list[Check]:
    paths = [motion(folder, body) for body in ((1, 2) if case.startswith("two") else (1,))]
    if case.startswith("square"):
        times, angles = pendulum()
        return [near(case, "time to 40 degrees [s]", time_to_fall(paths[0]), np.interp(FALLEN, angles, times),
                     {8: 0.15, 16: 0.1, 32: 0.05}[int(case.split()[2])])]
    if case.startswith("uphill"):
        x, top, turn = paths[0]["x"] - paths[0]["x"][0], SPEED**2 / (2 * UP), SPEED / UP
        return [near(case, "highest point [m]", -x.min(), top, 0.01),
                near(case, "way back to 1 s [m]", x[-1] - x.min(), DOWN / 2 * (1 - turn)**2, 0.03)]
    share = 0.03 if case.startswith("two") else 0.01
    names = ("upper", "lower") if len(paths) == 2 else ("plate",)
    return [near(case, f"x of the {name} at 1 s [m]", path["x"][-1] - path["x"][0], DOWN / 2, share)
            for name, path in zip(names, paths)]


def checks(folders: Folders) -> list[Check]:
    found = [check for case, folder in folders.items() for check in check_one(case, folder)]
    errors = [[check.error for top in TOPS for check in found if check.case == tip_label(across, top)]
              for across in ACROSS]
    sizes = [float(np.sqrt(np.mean(np.square(error)))) for error in errors if len(error) == len(TOPS)]
    if len(sizes) > 1:
        found.append(holds("square tips", "error of the time, rms over places, falls with the cells",
                           all(a > b for a, b in zip(sizes, sizes[1:]))))
    return found


def draw(folders: Folders, out: Path) -> list[Path]:
    panels = []
    times = np.linspace(0, 1, 200)
    stop = SPEED / UP
    up_and_down = np.where(times < stop, UP / 2 * times**2 - SPEED * times,
                           -SPEED**2 / (2 * UP) + DOWN / 2 * (times - stop)**2)
    for kind, rigid in (("plate", DOWN / 2 * times**2), ("two", DOWN / 2 * times**2), ("uphill", up_and_down)):
        curves = [Curve("rigid", times, 0 * times, "k--")]
        for case, folder in folders.items():
            if case.startswith(kind):
                path = motion(folder, 1)
                difference = path["x"] - path["x"][0] - np.interp(path["time"], times, rigid)
                curves.append(Curve(case, path["time"], 1e3 * difference))
        title = {"plate": "thin plates", "two": "two blocks, the upper one", "uphill": "block pushed up"}[kind]
        panels.append(Panel(title, "time [s]", "x less that of the rigid body [mm]", curves))
    exact, angles = pendulum()
    curves = [Curve("rigid", exact, np.degrees(angles), "k--")]
    for case, folder in folders.items():
        if case.startswith("square"):
            path = motion(folder, 1)
            curves.append(Curve(case, path["time"], np.degrees(turned(path))))
    panels.append(Panel("square on its corner", "time [s]", "angle of the diagonal [degrees]", curves))
    return [draw_panels(out / "limits.png", "What contact finds hard", panels, 2)]


PROBLEM = Problem("limits", "Thin bodies, three bodies at a node, rolling corners, turning friction",
                  "rigid bodies with Coulomb friction", runs, checks, draw,
                  literal=("plate of 0.33 cells, 9 points, top 0", "two blocks, shift 0.3, 0.0",
                           "uphill, shift 0.3, 0.0", tip_label(16, 0.0)),
                  forms=OF_FLAT_BODIES)
