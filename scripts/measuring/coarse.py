"""Coarse-grained fields on a grid, and profiles across a direction. Formulas: docs/measures.md.

Lucy's kernel of radius c, normalised for each thing it spreads so that the sum over the grid is exactly that thing,
also where the kernel reaches beyond a wall: what belongs beyond is shared out within. The integrals of density and
momentum over the grid are therefore mass and momentum to round-off, and that of the contact stress is sum f_i l_j.
"""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np

from measuring.snapshot import Snapshot, tensors
from measuring.stress import branches
from results import MissingData

ALONG = 8  # places within a radius along a branch where its stress is put, midpoint rule
BLOCK = 1 << 21  # weights of the kernel that are held at a time


@dataclasses.dataclass
class Grid:
    """Cells of a box, whose middles carry the fields."""

    lower: np.ndarray  # [m]
    size: np.ndarray  # of a cell [m]
    cells: np.ndarray
    periodic: np.ndarray
    radius: float  # of the kernel [m]

    def __post_init__(self):
        if self.radius < np.linalg.norm(self.size) / 2:
            raise ValueError(f"the kernel's radius {self.radius:g} m must be at least half a cell's diagonal, "
                             f"{np.linalg.norm(self.size) / 2:g} m")
        if (self.periodic & (2 * self.radius > self.size * self.cells)).any():
            raise ValueError(f"the kernel's radius {self.radius:g} m must be at most half a period")

    @property
    def volume(self) -> float:
        """Of a cell [m3]."""
        return float(np.prod(self.size))

    def middles(self, axis: int) -> np.ndarray:
        return self.lower[axis] + (np.arange(self.cells[axis]) + 0.5) * self.size[axis]


def lucy(distance: np.ndarray, radius: float) -> np.ndarray:
    """Lucy's kernel without its factor, which the normalisation gives."""
    share = np.minimum(distance / radius, 1.0)
    return (1 + 3 * share) * (1 - share) ** 3


def spread(grid: Grid, place: np.ndarray, values: np.ndarray) -> np.ndarray:
    """The density on the grid of `values` (N x k) at places (N x d) [m]: cells x k, its sum times the cell's volume is
    the sum of the values. Places up to a cell beyond the box count as at its border; those farther out are left out."""
    cells = grid.cells
    local = (place - grid.lower) / grid.size
    near = (grid.periodic | (local > -1) & (local < cells + 1)).all(axis=1)
    local, values = local[near], values[near]
    local = np.where(grid.periodic, local % cells, np.clip(local, 0, cells * (1 - 1e-15)))
    reach = np.ceil(grid.radius / grid.size).astype(int)
    offsets = np.array(list(itertools.product(*(range(-r, r + 1) for r in reach))))
    field = np.zeros((values.shape[1], int(np.prod(cells))))
    block = max(1, BLOCK // len(offsets))
    for first in range(0, len(local), block):
        rows = slice(first, first + block)
        flat, weight = weights(grid, local[rows], offsets)
        scaled = values[rows] / weight.sum(axis=1)[:, None]
        for k, column in enumerate(scaled.T):
            field[k] += np.bincount(flat.ravel(), (weight * column[:, None]).ravel(), field.shape[1])
    return (field.T / grid.volume).reshape(*cells, values.shape[1])


def weights(grid: Grid, local: np.ndarray, offsets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The cells around each place, which is in units of cells, and the kernel there, 0 beyond a border."""
    cell = np.floor(local).astype(int)[:, None, :] + offsets
    distance = np.sqrt((((cell + 0.5 - local[:, None, :]) * grid.size) ** 2).sum(axis=2))
    inside = (grid.periodic | (cell >= 0) & (cell < grid.cells)).all(axis=2)
    cell = np.where(grid.periodic, cell % grid.cells, np.clip(cell, 0, grid.cells - 1))
    flat = np.ravel_multi_index(tuple(np.moveaxis(cell, 2, 0)), tuple(grid.cells))
    return flat, np.where(inside, lucy(distance, grid.radius), 0.0)


@dataclasses.dataclass
class Fields:
    """On the cells of a grid; arrays of cells, vectors and tensors behind them. NaN where there is nothing."""

    grid: Grid
    density: np.ndarray  # [kg/m3]
    momentum: np.ndarray  # [kg/(m2 s)]
    velocity: np.ndarray  # [m/s]
    fraction: np.ndarray  # volume of grains [1]
    contact_stress: np.ndarray | None  # [Pa]
    kinetic_stress: np.ndarray  # [Pa]
    temperature: np.ndarray  # [m2/s2]


def fields(snapshot: Snapshot, grid: Grid, by_points: bool = False) -> Fields:
    """Fields of the grains: mass, momentum and volume at their centres, contact forces along their branches. By points:
    everything from the material points, and the stress within the grains."""
    d = snapshot.dimension
    if by_points:
        place, mass, velocity, volume, stress = of_points(snapshot)
    else:
        grains = snapshot.grains
        place, mass, velocity, volume = snapshot.wrapped(grains.centre), grains.mass, grains.velocity, grains.volume
        stress = None
    flux = mass[:, None, None] * velocity[:, :, None] * velocity[:, None, :]
    columns = [mass[:, None], mass[:, None] * velocity, flux.reshape(-1, d * d), volume[:, None]]
    if stress is not None:
        columns.append((volume[:, None, None] * stress).reshape(-1, d * d))
    spreaded = np.split(spread(grid, place, np.hstack(columns)), np.cumsum([c.shape[1] for c in columns])[:-1], axis=-1)
    density, momentum, flux, fraction = spreaded[0][..., 0], spreaded[1], spreaded[2], spreaded[3][..., 0]
    there = np.where(density > 0, density, np.nan)
    mean = momentum / there[..., None]
    kinetic = -(flux.reshape(*grid.cells, d, d) - np.nan_to_num(mean[..., :, None] * momentum[..., None, :]))
    heat = -np.trace(kinetic, axis1=-2, axis2=-1) / (d * there)
    if stress is not None:
        contact = spreaded[4].reshape(*grid.cells, d, d)
    else:
        contact = contact_field(snapshot, grid)
    return Fields(grid, density, momentum, mean, fraction, contact, kinetic, heat)


def of_points(snapshot: Snapshot) -> tuple[np.ndarray, ...]:
    """Place, mass, velocity, volume and stress of the points of the grains."""
    frame, d = snapshot.points, snapshot.dimension
    keep = np.isin(frame.field("body"), snapshot.grains.body)
    return (frame.field("position")[keep][:, :d].astype(float), frame.field("mass")[keep],
            frame.field("velocity")[keep][:, :d], frame.field("volume")[keep], tensors(frame.field("stress")[keep], d))


def contact_field(snapshot: Snapshot, grid: Grid) -> np.ndarray | None:
    """f_i l_j of each contact, spread evenly along its branch; None where there are no contact files."""
    try:
        contacts, grains = snapshot.contacts, snapshot.grains
    except MissingData:
        return None
    d = snapshot.dimension
    branch = branches(snapshot, grains, contacts)
    longest = np.linalg.norm(branch, axis=1).max(initial=0.0)
    along = int(np.clip(np.ceil(ALONG * longest / grid.radius), 1, 64))
    share = (np.arange(along) + 0.5) / along
    place = grains.centre[contacts.a][:, None, :] + share[None, :, None] * branch[:, None, :]
    moment = contacts.force[:, :, None] * branch[:, None, :]
    moment += np.where(contacts.b < 0, 1.0, 0.0)[:, None, None] * contacts.moment  # that of a pair cancels
    moment = moment.reshape(-1, 1, d * d) / along
    moment = np.broadcast_to(moment, (len(contacts), along, d * d))
    return spread(grid, snapshot.wrapped(place.reshape(-1, d)), moment.reshape(-1, d * d)).reshape(*grid.cells, d, d)


def grid_of(snapshot: Snapshot, box: tuple[np.ndarray, np.ndarray], radius: float | None = None,
            cell: float | None = None) -> Grid:
    """A grid over a box [m]; by default the kernel's radius is a mean diameter and a cell at most half of that."""
    radius = radius or float(snapshot.grains.diameter.mean())
    cells = np.maximum(np.ceil((box[1] - box[0]) / (cell or radius / 2) * (1 - 1e-12)), 1).astype(int)
    whole = np.isclose(box[0], snapshot.run.lower) & np.isclose(box[1], snapshot.upper)
    return Grid(np.asarray(box[0], float), (box[1] - box[0]) / cells, cells, snapshot.run.periodic & whole, radius)


def profile(found: Fields, axis: int) -> dict[str, np.ndarray]:
    """Means over the slices across an axis; velocity and temperature are weighted with mass."""
    others = tuple(k for k in range(len(found.grid.cells)) if k != axis)
    density, momentum = found.density.mean(axis=others), found.momentum.mean(axis=others)
    there = np.where(density > 0, density, np.nan)
    heat = np.nan_to_num(found.temperature * found.density).mean(axis=others)
    names = "xyz"[: momentum.shape[-1]]
    table = {names[axis]: found.grid.middles(axis), "density": density,
             "packing_fraction": found.fraction.mean(axis=others)}
    table |= {f"velocity_{name}": momentum[:, i] / there for i, name in enumerate(names)}
    table["temperature"] = heat / there
    for kind in ("contact", "kinetic"):
        stress = getattr(found, f"{kind}_stress")
        if stress is not None:
            mean = stress.mean(axis=others)
            table |= {f"{kind}_stress_{a}{b}": mean[:, i, j] for i, a in enumerate(names) for j, b in enumerate(names)}
    return table
