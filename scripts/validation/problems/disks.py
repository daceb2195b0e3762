"""Two elastic disks collide, head on and obliquely: energy, momentum, and what the releases of contact do to them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from validation.checks import Check, below, holds
from validation.figures import Curve, Panel, draw_panels
from validation.runs import NO_PARTICLES, Run
from validation.series import Table, history, motion
from validation.suite import LITERAL, Folders, Problem

RADIUS, DENSITY = 0.2, 1000.0  # [m], [kg/m3]
MASS = DENSITY * math.pi * RADIUS**2  # of one disk, per metre of thickness
RUN_UP = 0.02  # what the disks lack of touching at the start [m]
# Seconds after the first touch, by closing speed [m/s]: contact is over, the slower the later.
AFTER = {0.2: 1.5, 0.04: 2.5}
# Bands of kinetic and strain energy after over before, by release.
BANDS = {"reaction": (0.99, 1.005), "traction": (0.97, 1.02), "approach": (1.01, 1.5)}


def settings(closing: float, across: int) -> dict:
    """The disks of cases/two_disks.toml side by side, `across` cells wide, off the grid by odd shares of a cell."""
    cell = 2 * RADIUS / across
    y = (0.3 + 0.213 * cell, 0.3 + 0.371 * cell)
    x = (0.49 + 0.137 * cell, 0.91 + 0.137 * cell)
    return NO_PARTICLES | {
        "domain.upper": "[1.4, 0.6]", "domain.cells": f"[{round(1.4 / cell)}, {round(0.6 / cell)}]",
        "time.end": RUN_UP / closing + AFTER[closing],
        "bodies.0.shape.centre": f"[{x[0]}, {y[0]}]", "bodies.1.shape.centre": f"[{x[1]}, {y[1]}]",
        "bodies.0.velocity": f"[{closing / 2}, 0.0]", "bodies.1.velocity": f"[{-closing / 2}, 0.0]",
        "output.history": "{ every = 5 }"}


def head_on(closing: float, across: int) -> str:
    return f"head on, {closing} m/s, {across} cells"


def runs(full: bool) -> dict[str, Run]:
    """Head on at two speeds on two grids; the two papers' releases; and the case as shipped, on 1 and 2 ranks."""
    found = {}
    for across in (20, 40):
        for closing in AFTER:
            run = Run("two_disks", settings(closing, across), 3.0 * (across / 40) ** 3)
            found[head_on(closing, across)] = run
            for release in ("traction", "approach"):
                if full or across == 20:
                    found[f"{head_on(closing, across)}, {release}"] = run.changed(LITERAL[release])
    oblique = Run("two_disks", NO_PARTICLES, 3.0)
    found |= {f"oblique, {ranks} ranks": Run("two_disks", NO_PARTICLES, 3.0, ranks) for ranks in (1, 2)}
    if full:
        finer = {"domain.cells": "[100, 100]"}
        found |= {"oblique, 40 cells": oblique.changed(finer), "oblique, 40 cells, traction": oblique.changed(
            finer | LITERAL["traction"])}
    return found


def elastic_energy(table: Table) -> np.ndarray:
    return table["kinetic_energy"] + table["strain_energy"]


def momentum_change(table: Table, speed: float) -> float:
    """The largest change of the momentum, as a share of one body's."""
    return max(np.abs(table[name] - table[name][0]).max() for name in ("momentum_x", "momentum_y")) / (MASS * speed)


def check_head_on(case: str, folder: Path) -> list[Check]:
    table, closing = history(folder), float(case.split(",")[1].split()[0])
    release = case.rsplit(", ", 1)[-1]
    energy = elastic_energy(table)
    found = [Check(case, "energy after/before", energy[-1] / energy[0], *BANDS.get(release, BANDS["reaction"]), 1.0),
             below(case, "momentum change", momentum_change(table, closing / 2), 1e-12)]
    if release in BANDS:
        return found
    rebound = (motion(folder, 1)["vx"][-1] - motion(folder, 0)["vx"][-1]) / closing
    return found + [Check(case, "parting/closing speed", rebound, 0.9, 1.005, 1.0),
                    Check(case, "contact nodes at the end", table["contact_nodes"][-1], 0.0, 0.0, 0.0)]


def angular_momentum(folder: Path) -> np.ndarray:
    """About the origin, of both disks, over one disk's mass [m2/s]."""
    paths = [motion(folder, body) for body in (0, 1)]
    return sum(path["x"] * path["vy"] - path["y"] * path["vx"] + RADIUS**2 / 2 * path["wz"] for path in paths)


def check_oblique(case: str, folder: Path) -> list[Check]:
    """The disks meet off centre, rub and turn."""
    table = history(folder)
    energy, heat = elastic_energy(table), table["contact_dissipation"]
    turn = angular_momentum(folder)
    return [Check(case, "energy after/before", energy[-1] / energy[0], 0.9, 0.995),
            Check(case, "all energies after/before", (energy[-1] + heat[-1]) / energy[0], 0.995, 1.005, 1.0),
            below(case, "largest fall of contact_dissipation", max(-np.diff(heat).min(), 0) / energy[0], 1e-4),
            below(case, "momentum change", momentum_change(table, math.hypot(0.1, 0.06)), 1e-12),
            below(case, "change of angular momentum", abs(turn[-1] - turn[0]) / (RADIUS * 0.1), 0.01),
            Check(case, "spin of body 0 [rad/s]", motion(folder, 0)["wz"][-1], 0.05, 0.5),
            below(case, "largest energy_error", np.abs(table["energy_error"]).max(), 5e-3)]


def checks(folders: Folders) -> list[Check]:
    found = []
    for case, folder in folders.items():
        found += (check_head_on if case.startswith("head on") else check_oblique)(case, folder)
    pair = [folders.get(f"oblique, {ranks} ranks") for ranks in (1, 2)]
    if all(pair):
        same = (pair[0] / "bodies.csv").read_bytes() == (pair[1] / "bodies.csv").read_bytes()
        found.append(holds("oblique", "same motion on 1 and 2 ranks", same))
    return found


def draw(folders: Folders, out: Path) -> list[Path]:
    panels = []
    for closing in AFTER:
        curves = []
        for case, folder in folders.items():
            if case.startswith(f"head on, {closing} m/s"):
                table = history(folder)
                energy = elastic_energy(table)
                curves.append(Curve(case.split(", ", 2)[2], table["time"], energy / energy[0]))
        panels.append(Panel(f"closing at {closing} m/s", "time [s]", "kinetic + strain energy / initial", curves))
    return [draw_panels(out / "disks.png", "Two elastic disks, head on", panels)]


PROBLEM = Problem("disks", "Two elastic disks", "conservation of energy and momentum", runs, checks, draw,
                  literal=tuple(head_on(closing, 40) for closing in AFTER))
