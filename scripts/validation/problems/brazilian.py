"""The Brazilian test: stresses in the middle of a pressed disc, and the load at which a crack there splits it."""

from __future__ import annotations

import math
from pathlib import Path

import h5py
import numpy as np

from validation.checks import Check, near
from validation.figures import Curve, Panel
from validation.runs import Run
from validation.suite import Folders

DIAMETER, CRACK, SHAPE = 64e-3, 6.4e-3, 1.060  # of cases/brazilian_disc.toml: D, a [m], N(a = D/10)
TOUGHNESS = 1.5e6  # K_Ic [Pa m^1/2]
SPLITS = TOUGHNESS * math.pi * DIAMETER / 2 / (math.sqrt(math.pi * CRACK) * SHAPE)  # the load [N/m]
CELLS = (48, 64)  # in the diameter
SMOOTH = 10  # rows of forces.csv, of a microsecond each, over which the load is averaged


def split(cells: int) -> Run:
    return Run("brazilian_disc", {"domain.cells": [80 * cells // 64] * 2}, 0.00025 * cells**3)


def runs(full: bool) -> dict[str, Run]:
    found = {"pressed disc": Run("validation/pressed_disc", {}, 50)}
    return found | {f"Brazilian, {cells} cells": split(cells) for cells in (CELLS if full else CELLS[:1])}


def load(folder: Path, rows: int) -> tuple[np.ndarray, np.ndarray]:
    """Times, and the mean force of the plates on the disc between that many rows of forces.csv [N/m]."""
    with open(folder / "forces.csv", encoding="utf-8") as text:
        names = text.readline().strip().split(",")
        table = [line.strip().split(",") for line in text]
    def column(tool: str, name: str) -> np.ndarray:
        return np.array([float(row[names.index(name)]) for row in table if row[names.index("name")] == tool])
    time, impulse = column("top", "time"), 0.5 * (column("top", "impulse_y") - column("bottom", "impulse_y"))
    return 0.5 * (time[rows:] + time[:-rows]), (impulse[rows:] - impulse[:-rows]) / (time[rows:] - time[:-rows])


def last_file(folder: Path, *fields: str) -> list[np.ndarray]:
    with h5py.File(sorted(folder.glob("particles_*.vtkhdf"))[-1]) as file:
        return [file[f"VTKHDF/{field}"][()] for field in fields]


def check_pressed(folder: Path) -> list[Check]:
    """Means over the points within two cells of the middle, at rest."""
    place, stress, volume = last_file(folder, "Points", "PointData/stress", "PointData/volume")
    middle = np.hypot(place[:, 0], place[:, 1]) < DIAMETER / 32
    found = np.average(stress[middle], axis=0, weights=volume[middle])
    tension = 2 * load(folder, SMOOTH)[1][-1] / (math.pi * DIAMETER)
    return [near("pressed disc", "stress across in the middle / (2 P/(pi D))", found[0] / tension, 1, 0.02),
            near("pressed disc", "stress along in the middle / (-6 P/(pi D))", found[1] / (-3 * tension), 1, 0.02)]


def checks(folders: Folders) -> list[Check]:
    found, peaks = [], []
    if "pressed disc" in folders:
        found += check_pressed(folders["pressed disc"])
    for cells in CELLS:
        if (name := f"Brazilian, {cells} cells") not in folders:
            continue
        peaks.append(load(folders[name], SMOOTH)[1].max() / SPLITS)
        bodies = len(np.unique(last_file(folders[name], "PointData/body")[0]))
        found += [near(name, "largest load / (K_Ic pi D/(2 sqrt(pi a) N))", peaks[-1], 1, 0.08),
                  Check(name, "bodies at the end", bodies, 2, 2)]
    if len(peaks) == len(CELLS):
        found.append(near("Brazilian", "largest load of the finer grid over that of the other", peaks[1] / peaks[0], 1,
                          0.05))
    return found


def panels(folders: Folders) -> list[Panel]:
    curves = []
    for cells in CELLS:
        if (name := f"Brazilian, {cells} cells") in folders:
            time, force = load(folders[name], SMOOTH)
            curves.append(Curve(f"{cells} cells", 1e6 * time, force / SPLITS))
    return [Panel("Brazilian disc", "time [us]", "load / load of the toughness", curves)] if curves else []
