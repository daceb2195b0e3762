"""Values of material points that pictures show in colour: what they are called, their unit, and how they are had."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from results import COMPONENTS, Frame, MissingData, Run, principal_stress_difference


ROUNDING = 1e-12  # of the stiffness: stress that is none


@dataclass
class Scalar:
    """One value for each point."""

    title: str
    unit: str
    values: Callable[[Run, Frame], np.ndarray]
    signed: bool = False  # negative and positive values mean opposite things

    def lacking(self, run: Run, frame: Frame) -> np.ndarray:
        """The bodies that have no such value, which are grey."""
        return run.unstressed(frame) if self.unit == "Pa" and frame.has("body") else np.zeros(0, int)

    def noise(self, run: Run) -> float:
        """Below this a value is the rounding error of another."""
        return ROUNDING * run.stiffness if self.unit == "Pa" else 0.0


def mean_pressure(stress: np.ndarray) -> np.ndarray:
    """-trace / 3 [Pa] of stresses (N x 6: xx yy zz xy yz xz)."""
    return -stress[:, :3].mean(axis=1)


def mises(stress: np.ndarray) -> np.ndarray:
    """Von Mises stress [Pa]."""
    a, b, c = stress[:, 0], stress[:, 1], stress[:, 2]
    normal = ((a - b) ** 2 + (b - c) ** 2 + (c - a) ** 2) / 2
    return np.sqrt(normal + 3 * (stress[:, 3:] ** 2).sum(axis=1))


def _speed(run: Run, frame: Frame) -> np.ndarray:
    return np.linalg.norm(frame.field("velocity"), axis=1)


def _velocity(axis: int):
    return lambda run, frame: frame.field("velocity")[:, axis]


def _stress(component: int):
    return lambda run, frame: run.stress(frame)[:, component]


SCALARS = {
    "pressure": Scalar("pressure", "Pa", lambda run, frame: mean_pressure(run.stress(frame)), signed=True),
    "mises": Scalar("von Mises stress", "Pa", lambda run, frame: mises(run.stress(frame))),
    "difference": Scalar("principal stress difference", "Pa",
                         lambda run, frame: principal_stress_difference(run.stress(frame))),
    "speed": Scalar("speed", "m/s", _speed),
    **{f"velocity_{name}": Scalar(f"velocity {name}", "m/s", _velocity(i), True) for i, name in enumerate("xyz")},
    **{f"stress_{name}": Scalar(f"stress {name}", "Pa", _stress(i), True)
       for i, name in enumerate(("xx", "yy", "zz", "xy", "yz", "xz"))},
}
UNITS = {"volume": "m\N{SUPERSCRIPT THREE}", "mass": "kg", "plastic_strain": "1", "stress_work": "J/m\N{SUPERSCRIPT THREE}",
         "plastic_work": "J/m\N{SUPERSCRIPT THREE}", "viscous_dissipation": "J/m\N{SUPERSCRIPT THREE}"}


def scalar(run: Run, frame: Frame, name: str) -> Scalar:
    """The value called `name`: one of SCALARS, or any field of the file with one component."""
    if name in SCALARS:
        return SCALARS[name]
    if name in COMPONENTS or name in ("body", "id") or not frame.has(name):
        known = [*SCALARS, *sorted(frame.names - set(COMPONENTS) - {"body", "id"})]
        raise MissingData(f"there is no value '{name}' to colour by; there are body, {', '.join(known)}")
    return Scalar(name.replace("_", " "), UNITS.get(name, ""), lambda run, frame: frame.field(name).astype(float))


def scale(run: Run, frames: list[Frame], shown: Scalar, wanted: tuple[float, float] | None) -> tuple[float, float, str]:
    """Ends of one colour scale for all frames, and the name of its map (colours.MAPS)."""
    sample = frames[:: -(-len(frames) // 8)] if frames else []
    low, high = wanted or limits([shown.values(run, frame) for frame in sample], shown.signed, shown.noise(run))
    return low, high, "diverging" if low < 0 < high else "sequential"


def limits(values: list[np.ndarray], signed: bool, least: float = 0.0) -> tuple[float, float]:
    """Ends of the colour scale: 99 of 100 points lie between them; zero in the middle where values have signs. Where all
    are below `least`, it ends there, so that rounding errors are not seen as a pattern."""
    values = np.concatenate([np.ravel(v) for v in values]) if values else np.zeros(0)
    if not len(values):
        return 0.0, 1.0
    if np.abs(values).max() < least:
        return (-least, least) if signed else (0.0, least)
    if signed and values.min() < 0:
        top = float(np.percentile(np.abs(values), 99))
        return (-top, top) if top > 0 else (-1.0, 1.0)
    low, high = 0.0, float(np.percentile(values, 99))
    if values.min() < 0:
        low = float(np.percentile(values, 1))
    return (low, high) if high > low else (low, low + 1.0)
