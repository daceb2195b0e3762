"""What rolling disks and spheres share: checks of position and spin against a rigid body, and their pictures."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from validation.checks import Check, near, record
from validation.closed_forms import Rigid
from validation.figures import Curve, Panel, draw_panels
from validation.series import Table, at_time, mean


def travelled(path: Table, time: float) -> float:
    return at_time(path, "x", time) - path["x"][0]


def checks(case: str, path: Table, rigid: Rigid, time: float, share: float | None, spin_share: float | None,
           since: float) -> list[Check]:
    """Distance at a time; and the mean spin between two times, which hops leave steadier than that at one time.

    Shares are the bands; None only records.
    """
    distance, expected = travelled(path, time), rigid.distance(time)
    spin, rigid_spin = -mean(path, "wz", since, time), rigid.spin_up * (since + time) / 2
    names = f"x at {time:g} s [m]", f"mean spin, {since:g} to {time:g} s [rad/s]"
    rows = [(distance, expected, share), (spin, rigid_spin, spin_share)]
    return [record(case, name, value, right) if band is None else near(case, name, value, right, band)
            for name, (value, right, band) in zip(names, rows)]


def draw(path: Path, title: str, groups: dict[str, tuple[Rigid, dict[str, Table]]], end: float) -> Path:
    """Position, velocity and spin of several runs over time, one row for each group, with the rigid body's."""
    panels, times = [], np.linspace(0, end, 100)
    for name, (rigid, runs) in groups.items():
        exact = (rigid.distance(times), rigid.acceleration * times, rigid.spin_up * times)
        measured = [(label, table["time"], (table["x"] - table["x"][0], table["vx"], -table["wz"]))
                    for label, table in runs.items()]
        for k, quantity in enumerate(("x [m]", "velocity [m/s]", "spin [rad/s]")):
            curves = [Curve("rigid", times, exact[k], "k--")]
            curves += [Curve(label, time, values[k]) for label, time, values in measured]
            panels.append(Panel(name, "time [s]", quantity, curves))
    return draw_panels(path, title, panels)
