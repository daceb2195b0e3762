"""A stress wave through four disks in a row: its speed, how that falls with Poisson's ratio, and the fringes.

The front is where the difference of the principal stresses, which photoelasticity shows, first reaches 0.1 rho c v.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from validation.checks import Check, record
from validation.figures import Curve, Panel, draw_panels
from validation.problems import fronts
from validation.runs import Run
from validation.suite import Folders, Problem

FRAME_TIMES = (2.2, 5.5, 7.7)  # the paper's, in transit times
RATIOS = (0.22, 0.30, 0.35, 0.40, 0.45, 0.48)  # Poisson's, with the longitudinal wave kept
CENTRES = (0.035, 0.025, 0.015, 0.005)  # of the disks, along x [m]
PAPER = "nu = 0.2143"


def moduli(ratio: float) -> tuple[float, float]:
    """Shear and bulk modulus of a Poisson's ratio with the same longitudinal wave [Pa]."""
    longitudinal = fronts.BULK + 4 / 3 * fronts.SHEAR
    shear = longitudinal * (1 - 2 * ratio) / (2 * (1 - ratio))
    return shear, longitudinal - 4 / 3 * shear


def run(ratio: float) -> Run:
    shear, bulk = moduli(ratio)
    return Run("validation/four_disks", {
        "materials.plexiglas.shear_modulus": shear, "materials.plexiglas.bulk_modulus": bulk, "time.end": 1.4e-5,
        "output.particles.interval": 2e-7}, 20.0)


def runs(full: bool) -> dict[str, Run]:
    ratios = RATIOS if full else (RATIOS[0], RATIOS[-1])
    paper = Run("validation/four_disks", {}, 12.0)
    early = {f"{PAPER}, fill 0": paper.changed({"contact.fill": 0.0})} if full else {}
    return {PAPER: paper} | early | {f"nu = {ratio}": run(ratio) for ratio in ratios}


def probes(folder: Path) -> fronts.Probes:
    """The disks' centres, each the mean over the points within a cell and a half."""
    return fronts.Probes(folder, [(x, 0.006) for x in CENTRES], list(range(4)), 1.5 * fronts.CELL)


def speed(arrivals: np.ndarray) -> float:
    """From the centre of the first disk to that of the fourth [cm/us]."""
    return 1e-4 * (CENTRES[0] - CENTRES[3]) / (arrivals[3] - arrivals[0])


def checks(folders: Folders) -> list[Check]:
    found, speeds, level = [], {}, fronts.LEVEL * fronts.impact_stress()
    for case, folder in folders.items():
        seen = probes(folder)
        arrivals = seen.arrivals(fronts.shear_level, level)
        speeds[case] = speed(arrivals)
        band = (0.72, 0.82) if case == PAPER else ()
        found.append(Check(case, "speed of the fringes' front, disk 1 to 4 [cm/us]", speeds[case], *band))
        found.append(record(case, "speed of the front of the pressure [cm/us]",
                            speed(seen.arrivals(fronts.pressure_along((1, 0)), level))))
        found += [record(case, f"fringes arrive at the centre of disk {k + 1} [transit times]",
                         time / fronts.transit_time()) for k, time in enumerate(arrivals)]
    fast, slow = (speeds.get(f"nu = {ratio}") for ratio in (RATIOS[0], RATIOS[-1]))
    if fast and slow:
        found.append(Check("nu = 0.22 to 0.48", "ratio of the fringes' speeds", fast / slow, 2.1, 10.0))
    return found


def draw(folders: Folders, out: Path) -> list[Path]:
    """The paper's Fig. 9; and the pressure at the disks' centres over time."""
    pictures, panels = [], []
    if PAPER in folders:
        pictures.append(fronts.sheet({PAPER: folders[PAPER]}, {PAPER: FRAME_TIMES}, out / "collinear_fringes.png",
                                     "Four collinear disks, time in transit times of the longitudinal wave"))
    for case, folder in folders.items():
        seen = probes(folder)
        curves = [Curve(f"disk {k + 1}", seen.times / fronts.transit_time(),
                        fronts.pressure_along((1, 0))(seen.stress[:, k]) / fronts.impact_stress()) for k in range(4)]
        panels.append(Panel(case, "time [transit times]", "pressure at the centre / (rho c v)", curves))
    return pictures + [draw_panels(out / "collinear_pressure.png", "Four collinear disks", panels, 4)]


PROBLEM = Problem("collinear", "Stress wave in four collinear disks", "Bardenhagen et al. 2001, section 3.3, Fig. 9",
                  runs, checks, draw, literal=(PAPER,))
