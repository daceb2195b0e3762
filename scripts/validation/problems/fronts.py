"""What the rows of disks share: where a stress wave is when, and the photoelastic sheets."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from photoelastic import fringe_sheet, nearest_frames
from results import Run as Results
from results import principal_stress_difference
from validation.series import crossing

DIAMETER = 0.01  # [m]
DENSITY, SHEAR, BULK = 1900.0, 72.0e9, 102.0e9  # SI
PIN_SPEED = 20.7  # [m/s]
FRINGE = 4.0e7  # the fringe parameter of all sheets [Pa]
CELL = DIAMETER / 80
LEVEL = 0.1  # of the impact stress: where the front is


def wave_speed() -> float:
    """Of longitudinal waves [m/s]."""
    return ((BULK + 4 / 3 * SHEAR) / DENSITY) ** 0.5


def transit_time() -> float:
    """Of the longitudinal wave across one disk: the unit of the paper's frame times [s]."""
    return DIAMETER / wave_speed()


def impact_stress() -> float:
    """rho c v [Pa]"""
    return DENSITY * wave_speed() * PIN_SPEED


class Probes:
    """Stress over time near given places, in the material that was there at the start."""

    def __init__(self, folder: Path, places: list[tuple[float, float]], bodies: list[int], reach: float):
        """Place k is watched in body k of `bodies`, in all points within `reach` [m], or the nearest one."""
        frames = Results(folder).frames
        start = frames[0].field("position")[:, :2]
        ids, owner = frames[0].field("id"), frames[0].field("body")
        order = np.argsort(ids)
        chosen = []
        for place, body in zip(places, bodies):
            distance = np.where(owner == body, np.hypot(*(start - place).T), np.inf)
            chosen.append(ids[distance <= max(reach, distance.min())])
        self.times = np.array([frame.time for frame in frames])
        stress = []
        for frame in frames:
            order = np.argsort(frame.field("id"))  # ids count from 0 without gaps
            values = frame.field("stress")[order]
            stress.append([values[wanted].mean(axis=0) for wanted in chosen])
        self.stress = np.array(stress)  # frames x places x 6

    def arrivals(self, quantity, level: float) -> np.ndarray:
        """When a quantity of the stress (N x 6 -> N) first reaches a level at each place [s]; NaN for never."""
        return np.array([crossing(self.times, quantity(self.stress[:, k]), level)
                         for k in range(self.stress.shape[1])])


def pressure_along(direction: tuple[float, float]):
    """Minus the normal stress on a plane with this normal."""
    x, y = np.array(direction) / np.hypot(*direction)
    return lambda stress: -(x * x * stress[:, 0] + y * y * stress[:, 1] + 2 * x * y * stress[:, 3])


shear_level = principal_stress_difference


def sheet(runs: dict[str, Path], frame_times: dict[str, tuple[float, ...]], path: Path, title: str) -> Path:
    """The frames of each run at its non-dimensional times, one column for each run."""
    columns = [[(f"{name}, t = {time}", results, frame) for time, frame in zip(
        frame_times[name], nearest_frames(results, [time * transit_time() for time in frame_times[name]]))]
        for name, folder in runs.items() for results in [Results(folder)]]
    path.parent.mkdir(parents=True, exist_ok=True)
    return fringe_sheet([picture for row in zip(*columns) for picture in row], FRINGE, path, title, len(columns))
