"""A block on an inclined plane: sliding, with and without friction, stopping and sticking, against the closed forms
of a rigid block.

    test_physics_block.py CAIRN SCRATCH
"""

import concurrent.futures
import math
import sys

from harness import Program, fresh_folder
from physics import NO_PARTICLES, Check, at_time, motion, near, report, run_case

GRAVITY = 9.81  # [m/s2]
CELL = 0.05  # [m]
BLOCK = (1.0, 0.5)  # [m]

# Where, within their cells, the block's left side and the plane's top lie. Points sit at the quarters of a cell, so
# that these four fill the border cells differently, and none lies on a face of the grid.
SHIFTS = ((0.13, 0.11), (0.13, 0.61), (0.63, 0.11), (0.63, 0.61))


def settings(shift: tuple, angle: float, friction: float, speed: float, end: float) -> dict:
    """Changes to the case: the shift [cells], the incline [rad], and the initial speed along it [m/s]."""
    left, top = 0.45 + shift[0] * CELL, 0.25 + shift[1] * CELL
    right, upper = left + BLOCK[0], top + BLOCK[1]
    return NO_PARTICLES | {
        "time.end": end, "domain.upper": "[4.0, 1.0]", "domain.cells": "[80, 20]",
        "domain.gravity": f"[{GRAVITY * math.sin(angle)}, {-GRAVITY * math.cos(angle)}]",
        "contact.friction": friction, "bodies.1.velocity": f"[{speed}, 0.0]",
        "bodies.0.shape.upper": f"[4.0, {top}]",
        "bodies.1.shape.lower": f"[{left}, {top}]", "bodies.1.shape.upper": f"[{right}, {upper}]"}


def slides(program: Program, scratch, shift: tuple | None) -> list[Check]:
    """30 degrees, friction 0.3, for a second; without a shift, the case as it is shipped."""
    angle, friction, end = math.pi / 6, 0.3, 1.0
    name = f"slide {shift}" if shift else "slide as shipped"
    changes = settings(shift, angle, friction, 0.0, end) if shift else NO_PARTICLES
    path = motion(run_case(program, "block_incline", scratch / name.replace(" ", "_"), changes), 1)
    acceleration = GRAVITY * (math.sin(angle) - friction * math.cos(angle))
    distance = at_time(path, "x", end) - path["x"][0]
    return [near(f"{name}: x [m]", distance, acceleration * end**2 / 2, 0.01),
            near(f"{name}: v [m/s]", at_time(path, "vx", end), acceleration * end, 0.01)]


def slides_freely(program: Program, scratch, shift: tuple) -> list[Check]:
    """30 degrees without friction."""
    angle, end = math.pi / 6, 1.0
    changes = settings(shift, angle, 0.0, 0.0, end)
    path = motion(run_case(program, "block_incline", scratch / f"free_{shift[0]}_{shift[1]}", changes), 1)
    return [near(f"no friction {shift}: v [m/s]", path["vx"][-1], GRAVITY * math.sin(angle) * path["time"][-1], 1e-4)]


def stops(program: Program, scratch, shift: tuple) -> list[Check]:
    """A flat plane: friction brakes the block to rest."""
    friction, speed = 0.3, 2.0
    changes = settings(shift, 0.0, friction, speed, 1.0)
    path = motion(run_case(program, "block_incline", scratch / f"stop_{shift[0]}_{shift[1]}", changes), 1)
    distance = path["x"][-1] - path["x"][0]
    return [near(f"stopping {shift}: distance [m]", distance, speed**2 / (2 * friction * GRAVITY), 0.01),
            Check(f"stopping {shift}: final v [m/s]", path["vx"][-1], -0.01 * speed, 0.01 * speed, 0.0)]


def sticks(program: Program, scratch, shift: tuple) -> list[Check]:
    """Friction 0.7 holds the block on a slope of 0.2 rad."""
    changes = settings(shift, 0.2, 0.7, 0.0, 1.0)
    path = motion(run_case(program, "block_incline", scratch / f"stick_{shift[0]}_{shift[1]}", changes), 1)
    drift = max(abs(x - path["x"][0]) for x in path["x"])
    return [Check(f"sticking {shift}: drift [m]", drift, 0.0, 5e-4, 0.0)]


def main() -> int:
    program, scratch = Program(sys.argv[1]), fresh_folder(sys.argv[2])
    jobs = [(slides, None)] + [(what, shift) for what in (slides, slides_freely) for shift in SHIFTS]
    jobs += [(what, shift) for what in (stops, sticks) for shift in SHIFTS[1:3]]
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        waiting = [pool.submit(what, program, scratch, shift) for what, shift in jobs]
    return report([check for job in waiting for check in job.result()])


if __name__ == "__main__":
    sys.exit(main())
