"""Made-up results in the layout of real ones: balls in a box with contacts, for tests of what reads them."""

import math
from pathlib import Path

import h5py
import numpy as np

from harness import expect

R, DENSITY = 0.05, 1000.0  # of the balls, SI


def close(value, right, tolerance: float = 1e-12, what: str = ""):
    error = np.abs(np.asarray(value) - right).max()
    expect(error <= tolerance * max(np.abs(right).max(), 1.0 if np.abs(right).max() == 0 else 0.0),
           f"{what} {value} instead of {right}")


def case_text(upper, periodic, more: str = "") -> str:
    lower = [0.0] * len(upper)
    cells = [4] * len(upper)
    words = [str(p).lower() for p in periodic]
    return f"""[domain]
dimension = {len(upper)}
lower = {lower}
upper = {[float(x) for x in upper]}
cells = {cells}
periodic = [{', '.join(words)}]
[contact]
friction = 0.5
[materials.rubber]
model = "neo_hookean"
density = {DENSITY}
youngs_modulus = 1.0e6
poissons_ratio = 0.3
[[grains]]
file = "grains.csv"
material = "rubber"
{more}"""


def write_rows(path: Path, time: float, position: np.ndarray, columns: dict) -> None:
    with h5py.File(path, "w") as file:
        group = file.create_group("VTKHDF")
        group.attrs["time"], group.attrs["step"] = time, int(1000 * time)
        group["Points"] = padded(position)
        for name, values in columns.items():
            group[f"PointData/{name}"] = values


def padded(rows: np.ndarray) -> np.ndarray:
    rows = np.asarray(rows, float)
    return np.hstack([rows, np.zeros((len(rows), 3 - rows.shape[1]))])


def moments(point, force, spread) -> np.ndarray:
    whole = padded(force)[:, :, None] * padded(point)[:, None, :]
    d = spread.shape[1]
    whole[:, :d, :d] += spread
    return whole.reshape(-1, 9)


def voigt(tensors: np.ndarray) -> np.ndarray:
    whole = np.zeros((len(tensors), 3, 3))
    whole[:, : tensors.shape[1], : tensors.shape[1]] = tensors
    return np.stack([whole[:, i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))], axis=1)


def write_grains(folder: Path, number: int, time: float, centre: np.ndarray, radius=R, velocity=None, spin=None,
                 stresses=None, second=None) -> None:
    count, d = centre.shape
    radius = np.broadcast_to(radius, count)
    volume = math.pi * radius**2 if d == 2 else 4 / 3 * math.pi * radius**3
    if second is None:
        second = (radius**2 / (d + 2))[:, None, None] * np.eye(d)
    write_rows(folder / f"grains_{number:06d}.h5", time, centre, {
        "body": np.arange(count), "material": np.zeros(count, int), "points": np.ones(count, int),
        "mass": DENSITY * volume, "volume": volume, "centre": padded(centre),
        "velocity": padded(np.zeros((count, d)) if velocity is None else velocity),
        "angular_velocity": np.zeros((count, 3)) if spin is None else spin,
        "mean_stress": voigt(np.zeros((count, d, d)) if stresses is None else stresses), "second_moment": voigt(second),
        "contact_count": np.zeros(count, int)})


def write_contacts(folder: Path, number: int, time: float, a, b, point, normal, force, spread=None) -> None:
    """`spread`: sum over the nodes of force (x) position, less that of the force at the point."""
    write_rows(folder / f"contacts_{number:06d}.h5", time, point, {
        "body_a": np.asarray(a), "body_b": np.asarray(b), "point": padded(point), "normal": padded(normal),
        "force": padded(force)} | ({} if spread is None else {"moment": moments(point, force, spread)}))


def start_run(folder: Path, upper, periodic, centre: np.ndarray, more: str = "") -> None:
    folder.mkdir(parents=True)
    (folder / "case.toml").write_text(case_text(upper, periodic, more))
    axes = "xyz"[: len(upper)]
    rows = [f"{','.join(axes)},r", *(f"{','.join(map(repr, map(float, c)))},{R}" for c in centre)]
    (folder / "grains.csv").write_text("\n".join(rows) + "\n")
