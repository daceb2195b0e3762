"""Two elastic disks collide, head on and obliquely: energy and momentum.

    test_physics_disks.py CAIRN SCRATCH
"""

import concurrent.futures
import math
import sys

from harness import Program, fresh_folder
from physics import NO_PARTICLES, Check, below, history, motion, report, run_case

RADIUS, DENSITY = 0.2, 1000.0  # [m], [kg/m3]
MASS = DENSITY * math.pi * RADIUS**2  # of one disk, per metre of thickness
RUN_UP = 0.02  # what the disks lack of touching at the start [m]
# Seconds after the first touch, for a closing speed of 0.2 and 0.04 m/s: contact is over, the slower the later.
AFTER = {0.2: 1.5, 0.04: 2.5}


def settings(closing: float, across: int, **changes) -> dict:
    """The disks of cases/two_disks.toml side by side, `across` cells wide, off the grid by odd shares of a cell."""
    cell = 2 * RADIUS / across
    y = (0.3 + 0.213 * cell, 0.3 + 0.371 * cell)
    x = (0.49 + 0.137 * cell, 0.91 + 0.137 * cell)
    end = RUN_UP / closing + AFTER[closing]
    return NO_PARTICLES | {
        "domain.upper": "[1.4, 0.6]", "domain.cells": f"[{round(1.4 / cell)}, {round(0.6 / cell)}]", "time.end": end,
        "bodies.0.shape.centre": f"[{x[0]}, {y[0]}]", "bodies.1.shape.centre": f"[{x[1]}, {y[1]}]",
        "bodies.0.velocity": f"[{closing / 2}, 0.0]", "bodies.1.velocity": f"[{-closing / 2}, 0.0]",
        "output.history": "{ every = 5 }"} | changes


def elastic_energy(table: dict) -> list[float]:
    return [kinetic + strain for kinetic, strain in zip(table["kinetic_energy"], table["strain_energy"])]


def momentum_change(table: dict, speed: float) -> float:
    """The largest change of the momentum, as a share of one body's."""
    drifts = [abs(value - table[name][0]) for name in ("momentum_x", "momentum_y") for value in table[name]]
    return max(drifts) / (MASS * speed)


def head_on(program: Program, scratch, closing: float, across: int) -> list[Check]:
    name = f"{closing} m/s, {across} cells"
    folder = run_case(program, "two_disks", scratch / f"{closing}_{across}", settings(closing, across))
    table = history(folder)
    energy = elastic_energy(table)
    rebound = (motion(folder, 1)["vx"][-1] - motion(folder, 0)["vx"][-1]) / closing
    return [Check(f"{name}: energy after/before", energy[-1] / energy[0], 0.98, 1.01, 1.0),
            below(f"{name}: momentum change", momentum_change(table, closing / 2), 1e-12),
            Check(f"{name}: parting/closing speed", rebound, 0.9, 1.005, 1.0),
            Check(f"{name}: contact nodes at the end", table["contact_nodes"][-1], 0.0, 0.0, 0.0)]


def head_on_approach(program: Program, scratch, closing: float, across: int) -> list[Check]:
    """The release of 2000 makes energy: the test would notice a method that does."""
    changes = settings(closing, across, **{"contact.release": '"approach"'})
    table = history(run_case(program, "two_disks", scratch / f"approach_{closing}_{across}", changes))
    energy = elastic_energy(table)
    return [Check(f"release approach, {closing} m/s, {across} cells: energy after/before", energy[-1] / energy[0],
                  1.01, 1.5)]


def angular_momentum(folder) -> list[float]:
    """About the origin, of both disks, over one disk's mass, at the start and the end [m2/s]."""
    paths = [motion(folder, body) for body in (0, 1)]
    return [sum(path["x"][row] * path["vy"][row] - path["y"][row] * path["vx"][row]
                + RADIUS**2 / 2 * path["wz"][row] for path in paths) for row in (0, -1)]


def oblique(program: Program, scratch, ranks: int) -> list[Check]:
    """The case as shipped: the disks meet off centre, rub and turn."""
    folder = run_case(program, "two_disks", scratch / f"oblique_{ranks}", NO_PARTICLES, ranks)
    table, name = history(folder), f"oblique, {ranks} ranks"
    energy, heat = elastic_energy(table), table["contact_dissipation"]
    fall = max(before - after for before, after in zip(heat, heat[1:])) / energy[0]
    turn = angular_momentum(folder)
    return [Check(f"{name}: energy after/before", energy[-1] / energy[0], 0.9, 0.995),
            Check(f"{name}: all energies after/before", (energy[-1] + heat[-1]) / energy[0], 0.995, 1.005, 1.0),
            below(f"{name}: largest fall of contact_dissipation", max(fall, 0.0), 1e-4),
            below(f"{name}: momentum change", momentum_change(table, math.hypot(0.1, 0.06)), 1e-12),
            below(f"{name}: change of angular momentum", abs(turn[1] - turn[0]) / (RADIUS * 0.1), 0.01),
            Check(f"{name}: spin of body 0 [rad/s]", motion(folder, 0)["wz"][-1], 0.05, 0.5),
            below(f"{name}: largest energy_error", max(map(abs, table["energy_error"])), 5e-3)]


def main() -> int:
    program, scratch = Program(sys.argv[1]), fresh_folder(sys.argv[2])
    jobs = [(head_on, closing, across) for across in (40, 20) for closing in (0.04, 0.2)]
    jobs += [(head_on_approach, closing, 20) for closing in (0.04, 0.2)] + [(oblique, 1), (oblique, 2)]
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        waiting = [pool.submit(what, program, scratch, *values) for what, *values in jobs]
    checks = [check for job in waiting for check in job.result()]
    same = (scratch / "oblique_1" / "bodies.csv").read_bytes() == (scratch / "oblique_2" / "bodies.csv").read_bytes()
    return report(checks + [Check("oblique: same motion on 1 and 2 ranks", float(same), 1.0, 1.0, 1.0)])


if __name__ == "__main__":
    sys.exit(main())
