"""The surface of bodies in space, as level sets on a lattice, and of these the cells that a viewer may see.

Points' volumes are summed at the nodes of a lattice for each body, phi_i = sum_p N_ip V_p / h^3, which is the share of
space that the body fills there. Beneath a flat surface it is a known function of depth, d_i = sigma Phi^-1(phi_i) with
Phi of the normal distribution and sigma = h / sqrt(6) of the tent N. A body is where d > 0, linear between nodes.
Convex bodies lose by both steps some h^2 / (3 R) of their radius R, which is added, with R of the whole body's volume.

The surface's normal is that of sum_p N_ip V_p (x_i - x_p), which points away from the matter around a node.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from camera import Camera
from lattice import SPACING_TO_CELL, Lattice
from surface import Plane

DEEPEST = 1.1  # of d [cells]; nodes without matter are as far outside
BIT = 0.1  # points whose nodes all have less d are drawn as balls
THIN = 0.9  # bodies that nowhere fill more than this are drawn on a lattice of half the size
BALL = 0.62  # radius of such a ball, in spacings


@dataclass
class Skin:
    """Cells (C) that surfaces or clip planes pass through."""

    centre: np.ndarray  # (C x 3) [m]
    size: np.ndarray  # (C x 3) [m]
    owner: np.ndarray  # body
    level: np.ndarray  # (C x 8) d at the corners [cells], x slowest
    corner: np.ndarray  # (C x 8) rows of `table`
    table: np.ndarray  # (nodes x 5) what points away from the matter, volume, volume times value
    ball: np.ndarray  # indices of points that are too few for a surface

    def nearest_first(self, camera: Camera) -> Skin:
        order = np.argsort(-camera.project(self.centre)[1])
        return Skin(self.centre[order], self.size[order], self.owner[order], self.level[order], self.corner[order], self.table,
                    self.ball)

    @staticmethod
    def joined(parts: list[Skin]) -> Skin:
        first = 0
        for part in parts:
            part.corner = part.corner + first
            first += len(part.table)
        return Skin(*[np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Skin)])


def _level_table() -> tuple[np.ndarray, np.ndarray]:
    """phi against d in cells."""
    depth = np.linspace(-DEEPEST, DEEPEST, 221)
    density = np.exp(-3 * depth**2)
    phi = np.concatenate(([0], np.cumsum((density[1:] + density[:-1]) / 2)))
    return phi / phi[-1], depth


PHI, LEVEL = _level_table()


class Front:
    """How near the nearest matter is, on tiles of the picture."""

    def __init__(self, camera: Camera, position: np.ndarray, spacing: float):
        """From points that are about `spacing` apart."""
        place, towards, scale = camera.project(position)
        self.camera = camera
        wide = spacing * float(scale.min(initial=np.inf))  # of the matter around a point [pixels]
        self.tile = max(1.0, wide / 4)  # three of them are less than a point's room, so that no gap between bodies is closed
        self.shape = (int(camera.height / self.tile) + 3, int(camera.width / self.tile) + 3)
        column, row = self._tiles(place)
        order = np.argsort(towards.astype(np.float32))
        tiles = np.full(self.shape, -np.inf)
        tiles[row[order], column[order]] = towards[order]  # the last, that is nearest, stays
        tiles[[0, -1]] = tiles[:, [0, -1]] = -np.inf  # what is outside the picture hides nothing
        self.near = _extreme(tiles, 1, np.maximum) if wide > 1.5 else tiles

    def _tiles(self, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return tuple(np.clip((place[:, k] / self.tile + 1).astype(np.int32), 0, self.shape[1 - k] - 1) for k in (0, 1))

    def seen(self, position: np.ndarray, reach: float) -> np.ndarray:
        """Which (bool) may be seen, of things that reach `reach` [m] from their positions."""
        place, towards, scale = self.camera.project(position)
        wide = int(np.ceil(reach * float(scale.max(initial=0)) / self.tile)) + 1
        least = _extreme(np.pad(self.near, wide, mode="edge"), wide, np.minimum)[wide:-wide, wide:-wide]
        column, row = self._tiles(place)
        inside = np.ones(len(place), bool)
        for k, size in enumerate((self.camera.width, self.camera.height)):
            inside &= (place[:, k] > -reach * scale) & (place[:, k] < size + reach * scale)
        return inside & (towards > least[row, column] - 1.5 * reach)


def _extreme(tiles: np.ndarray, wide: int, which) -> np.ndarray:
    """The largest or smallest within `wide` tiles along both axes."""
    for axis in (0, 1):
        size = tiles.shape[axis]
        result = tiles.copy()
        for k in range(1, min(wide, size - 1) + 1):
            low, high = [slice(None)] * 2, [slice(None)] * 2
            low[axis], high[axis] = slice(0, size - k), slice(k, size)
            which(result[tuple(low)], tiles[tuple(high)], out=result[tuple(low)])
            which(result[tuple(high)], tiles[tuple(low)], out=result[tuple(high)])
        tiles = result
    return tiles


def nearest(camera: Camera, position: np.ndarray, spacing: float, planes: list[Plane]) -> tuple[np.ndarray, Front]:
    """Points (indices) that have to do with what is seen, and what they hide."""
    kept = np.ones(len(position), bool)
    below = np.ones(len(position), bool)
    for plane in planes:
        above = plane.above(position)
        below &= above < 0
        kept &= above < 3.5 * SPACING_TO_CELL * spacing  # as far as nodes of cells on the plane see
    front = Front(camera, position[below] if planes else position, spacing)
    return np.flatnonzero(kept & front.seen(position, 2.8 * SPACING_TO_CELL * spacing)), front


def skin_of(position, volume, body, value, radius, spacing: float, domain, planes: list[Plane], front: Front) -> Skin:
    """The cells of what is seen, from points (N x 3) [m] that `nearest` chose, their volumes [m3], values, the radius [m]
    of the ball as large as their body, and the domain (lower, upper, periodic)."""
    size = SPACING_TO_CELL * spacing
    lattice = Lattice(position, body, size, *domain)
    level = _levels(lattice, volume, radius)
    owner = lattice.node_owner
    most = np.full(len(lattice.bodies), -DEEPEST)
    order = np.argsort(level)
    most[owner[order]] = level[order]
    thin = np.isin(body, lattice.bodies[most < np.interp(THIN, PHI, LEVEL)])
    parts = []
    if not thin.all():
        parts.append(_part(lattice, level, position, volume, value, planes, front, None if not thin.any() else ~thin))
    if thin.any():
        chosen = np.flatnonzero(thin)
        fine = Lattice(position[chosen], body[chosen], size / 2, *domain)
        part = _part(fine, _levels(fine, volume[chosen], radius[chosen]), position[chosen], volume[chosen],
                     None if value is None else value[chosen], planes, front, None)
        part.ball = chosen[part.ball]
        parts.append(part)
    return Skin.joined(parts)


def _levels(lattice: Lattice, volume: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """d at the nodes [cells]."""
    level = np.interp(lattice.to_nodes(volume) / lattice.size.prod(), PHI, LEVEL)
    of_body = np.zeros(len(lattice.bodies))
    of_body[lattice.owner] = np.minimum(lattice.size.mean() / (3 * radius), 0.4)
    return level + of_body[lattice.node_owner]


def _part(lattice: Lattice, level, position, volume, value, planes, front, chosen) -> Skin:
    """The cells of one lattice; `chosen` (bool): of the bodies of these points only."""
    inside = level > 0
    if chosen is not None:
        wanted = np.zeros(len(lattice.bodies), bool)
        wanted[lattice.owner[chosen]] = True
        inside &= wanted[lattice.node_owner]
    cells = lattice.cells_around(inside)
    half = 0.5 * np.linalg.norm(lattice.size)
    partly = cells.inside < 8
    cut = np.zeros(len(partly), bool)
    kept = np.ones(len(partly), bool)
    for plane in planes:
        above = plane.above(cells.centre)
        kept &= above < half
        cut |= abs(above) < half
    cells = cells[kept & (partly | cut)]
    cells = cells[front.seen(cells.centre, half)]
    corner = lattice.corners_of(cells)
    table = np.zeros((lattice.nodes + 1, 5), np.float32)
    table[:-1, :3] = lattice.away(volume)
    table[:-1, 3] = lattice.to_nodes(volume)
    table[:-1, 4] = 0 if value is None else lattice.to_nodes(volume * value)
    levels = np.append(level, -DEEPEST)
    full = levels[lattice.node_of_points]
    few = (full < BIT).all(axis=1)
    if chosen is not None:
        few &= chosen
    return Skin(cells.centre, np.broadcast_to(lattice.size, cells.centre.shape), lattice.bodies[cells.owner],
                levels[corner].astype(np.float32), corner, table, np.flatnonzero(few))


def depths(lattice: Lattice, volume: np.ndarray, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """For each point the outward normal (N x 3) of the surface near it, and how deep it lies beneath [m]; zero and
    infinite where no surface is near."""
    radius = np.cbrt(np.bincount(lattice.owner, volume) / (4 / 3 * np.pi))[lattice.owner]
    level = lattice.to_points(_levels(lattice, volume, radius))
    away = lattice.to_points(lattice.away(volume)) / lattice.size.prod()
    length = np.sqrt(np.einsum("ij,ij->i", away, away))
    near = (level < 0.9 * DEEPEST) & (length > 0.01)
    normal = np.where(near[:, None], away / np.maximum(length, 1e-300)[:, None], 0)
    return normal, np.where(near, np.maximum(level * lattice.size.mean(), 0.2 * spacing), np.inf)
