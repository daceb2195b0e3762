"""Cracks: a double cantilever beam drawn apart, at rest and growing, a plate under a sudden tension, plates at rest, discs
that are pressed until they split, a round crack in 3D."""

from __future__ import annotations

import math
import re
from pathlib import Path

import h5py
import numpy as np

from validation.checks import Check, below, near
from validation.closed_forms import plane_strain_modulus
from validation.figures import Curve, Panel, draw_panels
from validation.problems import brazilian, cracks_at_rest
from validation.runs import Run
from validation.series import history, read_table
from validation.suite import Folders, Problem

# Of cases/dcb.toml.
ARM, LOAD, TIP = 3e-3, 0.75e-3, 13.05e-3  # height [m]; where the ties are, and the tip at the start [m]
MODULUS = plane_strain_modulus(70e9, 0.22)
TOUGHNESS = 60.0  # J_c [J/m2]
PERIOD = 2 * np.pi / 3.516 * (TIP - LOAD) ** 2 / np.sqrt(MODULUS * ARM**2 / 12 / 2500)  # of an arm [s]
CHEN = 400e6 * np.sqrt(np.pi * 2.4e-3)
# Unit tests that print what they measure.
SUDDEN, PENNY = "half-infinite crack", "penny"
TESTS = {SUDDEN: "Cracks.StressIntensityOfASuddenlyLoadedCrack", PENNY: "SlowRims.StressIntensityOfAPennyShapedCrack"}


def runs(full: bool) -> dict[str, Run]:
    slow = {"output.particles": '{ interval = 1e-5, fields = ["velocity"] }'}
    still = {"cracks": '[{ points = [[0.4e-3, 8.05e-3], [13.05e-3, 8.05e-3]], ends = ["open", "tip"], '
                       'law = "frictionless" }]'}
    found = {"beam": Run("dcb", slow | still | {"time.end": 2.5e-4}, 60), "growing beam": Run("dcb", slow, 90),
             "plate": Run("validation/chen_plate", {}, 20)}
    if full:
        found |= {name: Run(tool=("tests/test_solver", f"--gtest_filter={test}"), cost=60) for name, test in TESTS.items()}
    return found | cracks_at_rest.runs(full) | brazilian.runs(full)


def check_tests(folders: Folders) -> list[Check]:
    """Freund, Dynamic Fracture Mechanics (1990), section 2.5; Sneddon, Proc. R. Soc. A 187 (1946)."""
    found = []
    if SUDDEN in folders:
        log = (folders[SUDDEN] / "log.txt").read_text(encoding="utf-8")
        errors = re.findall(r"aside (\S+): K_I off by (\S+)", log) or [("-", "nan")]
        found += [below(SUDDEN, f"rms error of K_I, {aside} from a grid line, cells of 0.5", float(error), 0.03)
                  for aside, error in errors]
    if PENNY in folders:
        log = (folders[PENNY] / "log.txt").read_text(encoding="utf-8")
        numbers = re.search(r"penny: K_I (\S+) \((\S+) to (\S+)\)", log)
        mean, low, high = map(float, numbers.groups()) if numbers else (math.nan,) * 3
        found += [near(PENNY, "mean of K_I / (2 s sqrt(a/pi))", mean, 1, 0.06),
                  Check(PENNY, "least along the rim", low, 0.94, 1.06), Check(PENNY, "most", high, 0.94, 1.06),
                  below(PENNY, "range over the mean", (high - low) / mean, 0.05)]
    return found


def beam(folder: Path) -> dict[str, np.ndarray]:
    """Opening at the ties, crack length a + .67 d, J and the force on the upper tie over time."""
    tips, forces = read_table(folder / "tips.csv"), {}
    with open(folder / "forces.csv", encoding="utf-8") as text:
        names = text.readline().strip().split(",")
        rows = [line.split(",") for line in text if line.split(",")[names.index("name")] == "top"]
    for name in ("time", "fy"):
        forces[name] = np.array([float(row[names.index(name)]) for row in rows])
    times, openings = [], []
    for path in sorted(folder.glob("cracks_*.h5")):
        with h5py.File(path) as file:
            times.append(float(np.ravel(file.attrs["time"])[0]))
            here = np.argmin(abs(file["position"][:, 0] - LOAD))
            openings.append(file["opening"][here, 1])
    time = tips["time"]
    return {"time": time, "length": tips["x"] - LOAD + 0.67 * ARM, "J": tips["J"],
            "opening": np.interp(time, times, openings), "force": -np.interp(time, forces["time"], forces["fy"])}


def ratio(values: np.ndarray, expected: np.ndarray, chosen: np.ndarray) -> float:
    return float(values[chosen].mean() / expected[chosen].mean())


def checks(folders: Folders) -> list[Check]:
    found = []
    if "beam" in folders:
        b = beam(folders["beam"])
        last = b["time"] > b["time"][-1] - 2 * PERIOD  # the mean of two periods
        inertia = ARM**3 / 12
        opening = 2 * b["force"] * b["length"] ** 3 / (3 * MODULUS * inertia)
        J = b["force"] ** 2 * b["length"] ** 2 / (MODULUS * inertia)
        found += [near("beam", "opening / 2 F (a + .67 d)^3/(3 E' I)", ratio(b["opening"], opening, last), 1, 0.04),
                  near("beam", "J / (F^2 (a + .67 d)^2/(E' I))", ratio(b["J"], J, last), 1, 0.05)]
    if "growing beam" in folders:
        b = beam(folders["growing beam"])
        grown = b["length"] > b["length"][0] + 4e-3
        expected = (3 * MODULUS * ARM**3 * b["opening"] ** 2 / (16 * TOUGHNESS)) ** 0.25
        book = history(folders["growing beam"])
        found += [near("growing beam", "(a + .67 d) / (3 E' d^3 w^2/(16 J_c))^(1/4)",
                       ratio(b["length"], expected, grown), 1, 0.06),
                  below("growing beam", "largest error of the energy book", np.abs(book["energy_error"]).max(), 0.01)]
    if "plate" in folders:
        tips = read_table(folders["plate"] / "tips.csv")
        right = tips["end"] == 1
        K, time = tips["K_I"][right] / CHEN, tips["time"][right]
        found += [Check("plate", "largest K_I/(s sqrt(pi a))", K.max(), 2.65, 2.85),
                  Check("plate", "its time [us]", 1e6 * time[K.argmax()], 6.2, 6.6)]
    return found + check_tests(folders) + cracks_at_rest.checks(folders) + brazilian.checks(folders)


def draw(folders: Folders, out: Path) -> list[Path]:
    panels = []
    if "growing beam" in folders:
        b = beam(folders["growing beam"])
        expected = (3 * MODULUS * ARM**3 * b["opening"] ** 2 / (16 * TOUGHNESS)) ** 0.25
        panels.append(Panel("growing beam", "time [us]", "a + .67 d [mm]",
                            [Curve("Cairn", 1e6 * b["time"], 1e3 * b["length"]),
                             Curve("beam theory, J = J_c", 1e6 * b["time"], 1e3 * expected)]))
    if "plate" in folders:
        tips = read_table(folders["plate"] / "tips.csv")
        right = tips["end"] == 1
        panels.append(Panel("Chen's plate", "time [us]", "K_I/(s sqrt(pi a))",
                            [Curve("Cairn", 1e6 * tips["time"][right], tips["K_I"][right] / CHEN)]))
    panels += brazilian.panels(folders)
    return [draw_panels(out / "cracks.png", "Cracks", panels, columns=2)] if panels else []


PROBLEM = Problem("cracks", "Cracks", "beam theory; Chen 1975; Freund 1990; Sneddon 1946; Feddersen 1966; "
                  "Gross, Srawley & Brown 1964; Atkinson, Smelser & Sanchez 1982", runs, checks, draw)
