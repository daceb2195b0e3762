"""A block on an inclined plane: sliding, with and without friction, stopping and sticking, against a rigid block."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from validation.checks import Check, near
from validation.figures import Curve, Panel, draw_panels
from validation.runs import NO_PARTICLES, Run
from validation.series import at_time, motion
from validation.suite import Folders, OF_FLAT_BODIES, Problem

GRAVITY, END = 9.81, 1.0  # [m/s2], [s]
CELL = 0.05  # [m]
BLOCK = (1.0, 0.5)  # [m]
ANGLE, FRICTION = math.pi / 6, 0.3  # of the sliding block
SPEED = 2.0  # of the stopping block at the start [m/s]

# Where, within their cells, the block's left side and the plane's top lie. Points sit at the quarters of a cell, so
# that these four fill the border cells differently, and none lies on a face of the grid.
SHIFTS = ((0.13, 0.11), (0.13, 0.61), (0.63, 0.11), (0.63, 0.61))
SOME = SHIFTS[1:3]


def settings(shift: tuple, angle: float, friction: float, speed: float = 0.0) -> dict:
    """Changes to the case: the shift [cells], the incline [rad], and the initial speed along it [m/s]."""
    left, top = 0.45 + shift[0] * CELL, 0.25 + shift[1] * CELL
    right, upper = left + BLOCK[0], top + BLOCK[1]
    return NO_PARTICLES | {
        "domain.upper": "[4.0, 1.0]", "domain.cells": "[80, 20]",
        "domain.gravity": f"[{GRAVITY * math.sin(angle)}, {-GRAVITY * math.cos(angle)}]",
        "contact.friction": friction, "bodies.1.velocity": f"[{speed}, 0.0]",
        "bodies.0.shape.upper": f"[4.0, {top}]",
        "bodies.1.shape.lower": f"[{left}, {top}]", "bodies.1.shape.upper": f"[{right}, {upper}]"}


KINDS = {"slides": ((ANGLE, FRICTION), SHIFTS), "slides freely": ((ANGLE, 0.0), SHIFTS),
         "stops": ((0.0, FRICTION, SPEED), SOME), "sticks": ((0.2, 0.7), SOME)}


def label(kind: str, shift: tuple | None) -> str:
    return f"{kind}, {f'shift {shift[0]}, {shift[1]}' if shift else 'as shipped'}"


def runs(_full: bool) -> dict[str, Run]:
    shifted = {label(kind, shift): Run("block_incline", settings(shift, *values), 3.0)
               for kind, (values, shifts) in KINDS.items() for shift in shifts}
    return {label("slides", None): Run("block_incline", NO_PARTICLES, 3.0)} | shifted


def check_one(kind: str, case: str, path: dict) -> list[Check]:
    moved = path["x"] - path["x"][0]
    if kind == "slides":
        acceleration = GRAVITY * (math.sin(ANGLE) - FRICTION * math.cos(ANGLE))
        return [near(case, "x at 1 s [m]", at_time(path, "x", END) - path["x"][0], acceleration * END**2 / 2, 0.01),
                near(case, "v at 1 s [m/s]", at_time(path, "vx", END), acceleration * END, 0.01)]
    if kind == "slides freely":
        return [near(case, "v at 1 s [m/s]", path["vx"][-1], GRAVITY * math.sin(ANGLE) * path["time"][-1], 1e-4)]
    if kind == "stops":
        return [near(case, "stopping distance [m]", moved[-1], SPEED**2 / (2 * FRICTION * GRAVITY), 0.01),
                Check(case, "final v [m/s]", path["vx"][-1], -0.01 * SPEED, 0.01 * SPEED, 0.0)]
    return [Check(case, "drift in 1 s [m]", np.abs(moved).max(), 0.0, 5e-4, 0.0)]


def checks(folders: Folders) -> list[Check]:
    return [check for case, folder in folders.items()
            for check in check_one(case.split(",")[0], case, motion(folder, 1))]


def draw(folders: Folders, out: Path) -> list[Path]:
    times = np.linspace(0, END, 1001)
    panels = []
    for kind, (values, shifts) in KINDS.items():
        angle, friction, speed = (*values, 0.0)[:3]
        pull = GRAVITY * (math.sin(angle) - friction * math.cos(angle))
        rigid = np.maximum(speed + pull * times, 0) if pull < 0 else pull * times
        way = np.concatenate(([0.0], np.cumsum((rigid[1:] + rigid[:-1]) / 2 * np.diff(times))))
        paths = {shift: motion(folders[name], 1) for shift in shifts if (name := label(kind, shift)) in folders}
        if way[-1] > 0:
            panels.append(Panel(kind, "time [s]", "x [m]", [Curve("rigid", times, way, "k--")] + [
                Curve(f"shift {shift}", path["time"], path["x"] - path["x"][0]) for shift, path in paths.items()]))
        panels.append(Panel(kind, "time [s]", "x less that of the rigid block [mm]", [
            Curve("rigid", times, 0 * times, "k--")] + [Curve(
                f"shift {shift}", path["time"], 1e3 * (path["x"] - path["x"][0] - np.interp(path["time"], times, way)))
                for shift, path in paths.items()]))
    return [draw_panels(out / "block.png", "Block on an incline", panels, 4)]


PROBLEM = Problem("block", "Block on an incline", "rigid block with Coulomb friction", runs, checks, draw,
                  literal=tuple(label(kind, SOME[0]) for kind in KINDS), forms=OF_FLAT_BODIES)
