"""Stress intensities at rest: cracks in the middle, at the side and inclined, open and pressed; the direction of growth."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from validation.checks import Check, near
from validation.closed_forms import plane_strain_modulus
from validation.runs import Run
from validation.series import Table, read_table
from validation.suite import Folders

# Of cases/validation/crack_at_rest.toml.
WIDTH, STRESS = 30e-3, 10e6  # of the plate [m], of the tension [Pa]
MODULUS = plane_strain_modulus(70e9, 0.22)
CENTRE = {6: 0.04, 12: 0.03}  # band of K_I by cells in half a crack
CENTRE_J = {6: 0.10, 12: 0.06}
EDGE = 9e-3  # length of the crack at the side [m]
SLANTED, SLANTED_WIDTH = 3e-3, 45e-3  # half of the inclined one, its plate [m]
PULLED_AGAIN = 1.5e-4  # when its force rises beyond STRESS [s]
FRICTION = (0.0, 0.3)


def centre(cells: int) -> Run:
    return Run("validation/crack_at_rest", {"domain.cells": f"[{32 * cells // 6}, {78 * cells // 6}]"}, 0.05 * cells**3)


def edge() -> Run:
    """Caps that turn freely, and are drawn apart by as much as makes about STRESS. The plate bends, more slowly than it
    stretches: damped as strongly it would not be at rest by the end."""
    def cap(group: str, sign: int) -> str:
        steps = [[0, 0], [3e-5, 0.2 * sign], [6e-5, 0]]
        rows = ", ".join(f"[{time}, 0.0, {speed}]" for time, speed in steps)
        return (f'{{ bodies = {{ group = "{group}" }}, about = [0.0, {sign * 37.5e-3}], velocity = [{rows}], '
                "rotor = { inertia = 1.0e-4 } }")
    return Run("validation/crack_at_rest", {
        "cracks": f'[{{ points = [[{-WIDTH / 2 - 0.3e-3}, 0.13e-3], [{EDGE - WIDTH / 2}, 0.13e-3]], '
                  'ends = ["open", "tip"], law = "friction" }]',
        "drive": f"[{cap('bottom', -1)}, {cap('top', 1)}]", "damping.viscous": 1.6e5, "output.forces.interval": 2e-6,
        "time.end": 2.6e-4}, 20)


def slanted(force: list, crack: str) -> Run:
    """A crack at 45 degrees in a plate 7.5 times as wide as it, with twice the cells; force over time, in shares of STRESS."""
    half, high, cap = SLANTED_WIDTH / 2, 33.5e-3, 1.5e-3
    along = SLANTED * math.sqrt(0.5)
    box = {name: f"[{low}, {up}]" for name, low, up in (
        ("bodies.0.shape.lower", -half, -high), ("bodies.0.shape.upper", half, high),
        ("bodies.1.shape.lower", -half, -high - cap), ("bodies.1.shape.upper", half, -high),
        ("bodies.2.shape.lower", -half, high), ("bodies.2.shape.upper", half, high + cap),
        ("domain.lower", -24e-3, -high - cap), ("domain.upper", 24e-3, high + cap))}
    rows = str([[time, share * STRESS * SLANTED_WIDTH] for time, share in force])
    return Run("validation/crack_at_rest", box | {
        "domain.cells": "[96, 140]", "drive.0.piston.force": rows, "drive.1.piston.force": rows,
        "cracks": f'[{{ points = [[{0.1e-3 - along}, {0.03e-3 - along}], [{0.1e-3 + along}, {0.03e-3 + along}]], '
                  f'ends = ["tip", "tip"], {crack} }}]', "output.tips.interval": 1e-6, "time.end": force[-1][0],
        "damping.viscous": 5.3e5}, 100)  # nearer to critical: friction remembers what is overshot


def runs(full: bool) -> dict[str, Run]:
    found = {"centre crack, a/h 6": centre(6), "edge crack": edge()}
    if not full:
        return found
    growth = 'law = "friction", growth = { criterion = "hoop", toughness = 1.1e6 }'
    pulled = [[0.0, 0.0], [3e-5, 1.0], [PULLED_AGAIN, 1.0], [2.1e-4, 2.0]]
    pressed = [[0.0, 0.0], [4.5e-5, -1.0], [1.8e-4, -1.0]]
    found |= {"centre crack, a/h 12": centre(12), "crack at 45 degrees": slanted(pulled, growth)}
    return found | {f"pressed, mu {mu}": slanted(pressed, f'law = "friction", friction = {mu}') for mu in FRICTION}


def last_tips(folder: Path, before: float = math.inf) -> Table:
    """The rows of tips.csv of the last time before another."""
    table = read_table(folder / "tips.csv")
    chosen = table["time"] == table["time"][table["time"] <= before].max()
    return {name: column[chosen] for name, column in table.items()}


def check_centre(folder: Path, cells: int) -> list[Check]:
    tips, name = last_tips(folder), f"centre crack, a/h {cells}"
    K = STRESS * math.sqrt(math.pi * 6e-3 / math.cos(math.pi * 6e-3 / WIDTH))
    return [near(name, "K_I / (s sqrt(pi a sec(pi a/W)))", tips["K_I"].mean() / K, 1, CENTRE[cells]),
            near(name, "J / (K_I^2/E')", tips["J"].mean() / (K**2 / MODULUS), 1, CENTRE_J[cells])]


def check_edge(folder: Path) -> list[Check]:
    """Gross, Srawley & Brown 1964: F = 1.12 - .231 x + 10.55 x^2 - 21.72 x^3 + 30.39 x^4, x = a/W."""
    with open(folder / "forces.csv", encoding="utf-8") as text:
        names = text.readline().strip().split(",")
        rows = [line.split(",") for line in text]
    force = [abs(float(row[names.index("fy")])) for row in rows if row[names.index("name")] == "top"][-1]
    shape = np.polynomial.Polynomial([1.12, -0.231, 10.55, -21.72, 30.39])(EDGE / WIDTH)
    K = force / WIDTH * math.sqrt(math.pi * EDGE) * shape
    return [near("edge crack", "K_I / (1.66 s sqrt(pi a)) at a/W = 0.3", last_tips(folder)["K_I"].mean() / K, 1, 0.03)]


def check_slanted(folders: Folders) -> list[Check]:
    found, name, K = [], "crack at 45 degrees", 0.5 * STRESS * math.sqrt(math.pi * SLANTED)
    if name in folders:
        tips = last_tips(folders[name], PULLED_AGAIN)
        found += [near(name, f"{mode} / (s/2 sqrt(pi a))", np.abs(tips[mode]).mean() / K, 1, 0.05)
                  for mode in ("K_I", "K_II")]
        table = read_table(folders[name] / "tips.csv")
        last = (table["end"] == 1) & (table["grown"] > 0)
        if not last.any():
            return [*found, Check(name, "it does not grow", math.nan)]
        turned = math.atan2(table["ahead_y"][last][0], table["ahead_x"][last][0]) - math.pi / 4
        found.append(Check(name, "direction of the first growth [degrees]", abs(math.degrees(turned)), 50, 56))
    for mu in FRICTION:
        if (name := f"pressed, mu {mu}") in folders:
            tips = last_tips(folders[name])
            found += [Check(name, "K_I / (s/2 sqrt(pi a))", tips["K_I"].mean() / K, -0.1, 0.1),
                      near(name, "K_II / ((1 - mu) s/2 sqrt(pi a))", np.abs(tips["K_II"]).mean() / ((1 - mu) * K), 1,
                           0.08)]
    return found


def checks(folders: Folders) -> list[Check]:
    found = []
    for cells in CENTRE:
        if (name := f"centre crack, a/h {cells}") in folders:
            found += check_centre(folders[name], cells)
    if "edge crack" in folders:
        found += check_edge(folders["edge crack"])
    return found + check_slanted(folders)
