"""The surface of bodies in space, as small discs (surfels) that overlap and lie on it.

Points' volumes are summed at the nodes of a lattice for each body, phi_i = sum_p N_ip V_p / h^3, which is the share of
space that the body fills there, and phi_p = sum_i N_ip phi_i back at the points. Beneath a flat surface that is a known
function of depth, the sum of cubic B-splines (tent on tent), so that phi_p tells how deep a point lies; the surface is
that far along -grad phi. Where a plane cuts a body, its points near the plane are moved onto it instead.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from lattice import SPACING_TO_CELL, Lattice

REACH = 1.15  # radius of a surfel, in spacings of points
CUT_REACH = 1.7  # likewise on a cut face: it must reach the edge, where it is trimmed
SHOWN = 0.93  # phi of points that lie deeper than the surface needs
LAYER = 1.0  # how deep beneath a cut points are moved onto it, in spacings
INSIDE = 0.985  # phi of points from which no surface is near


@dataclass
class Surfels:
    """Discs on the surface. A disc ends where `trim @ (x - position) > limit`, for each of its trims."""

    position: np.ndarray  # (N x 3) [m]
    normal: np.ndarray  # (N x 3), outwards; zero: faces the viewer
    point: np.ndarray  # (N) the material point whose colour it has
    trim: np.ndarray  # (N x planes x 3)
    limit: np.ndarray  # (N x planes) [m]
    cut: np.ndarray  # (N) bool: of a cut face
    radius: np.ndarray  # (N) [m]

    def __getitem__(self, chosen) -> Surfels:
        return Surfels(*[getattr(self, f.name)[chosen] for f in fields(self)])


@dataclass
class Plane:
    """A clip plane: what lies on the side of `normal` is cut away."""

    normal: np.ndarray  # (3), of length 1
    offset: float  # [m] along the normal

    def above(self, position: np.ndarray) -> np.ndarray:
        """Signed distance [m]; above 0: cut away."""
        return position @ self.normal - self.offset


def _depth_table() -> tuple[np.ndarray, np.ndarray]:
    """phi beneath a flat surface against depth in lattice cells: the integral of the cubic B-spline."""
    depth = np.linspace(-2, 2, 401)
    a = np.abs(depth)
    spline = np.where(a < 1, 2 / 3 - a**2 + a**3 / 2, (2 - a) ** 3 / 6)
    phi = np.concatenate(([0], np.cumsum((spline[1:] + spline[:-1]) / 2))) * (depth[1] - depth[0])
    return phi, depth


PHI, DEPTH = _depth_table()


def _unit(vectors: np.ndarray, least: float) -> np.ndarray:
    """Vectors of length 1; zero where they were shorter than `least`."""
    length = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
    return vectors * np.where(length > least, 1 / np.maximum(length, 1e-300), 0)[:, None]


def depths(lattice: Lattice, volume: np.ndarray, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """For each point the outward normal (N x 3) of the surface near it, and how deep it lies beneath [m]; zero and
    infinite where no surface is near."""
    phi_i = lattice.to_nodes(volume) / lattice.size.prod()
    phi = lattice.to_points(phi_i)
    near = np.flatnonzero(phi < INSIDE)
    normal, deep, _ = _planes(lattice, phi_i, phi, near, spacing)
    normals, all_deep = np.zeros((len(volume), 3)), np.full(len(volume), np.inf)
    normals[near], all_deep[near] = normal, deep
    return normals, all_deep


def _planes(lattice: Lattice, phi_i, phi, near, spacing: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Normals, and depths [m], of the surface near the points `near`, and how flat it is there (1: quite)."""
    normal = _unit(-lattice.gradient(phi_i, near), 0.05 / lattice.size.max())
    deep = np.interp(phi[near], PHI, DEPTH) * lattice.size.mean()
    normal, deep, agreed = _evened(lattice, near, normal, deep)
    return normal, np.maximum(deep, 0.2 * spacing), np.clip(2.9 * agreed - 1.4, 0.5, 1)


def _some(vectors: np.ndarray) -> np.ndarray:
    """Which are not zero."""
    return (vectors[:, 0] != 0) | (vectors[:, 1] != 0) | (vectors[:, 2] != 0)


def surfels(lattice: Lattice, position: np.ndarray, volume: np.ndarray, spacing: float, planes: list[Plane]) -> Surfels:
    """The surface of what the planes leave, from points (N x 3) [m] and their volumes [m3]."""
    phi_i = lattice.to_nodes(volume) / lattice.size.prod()
    phi = lattice.to_points(phi_i)
    above = np.array([plane.above(position) for plane in planes]).reshape(len(planes), len(position))
    at_surface = (phi < SHOWN) & (above < REACH * spacing).all(axis=0)
    near_cut = (above < 0.25 * spacing).all(axis=0) & (above > -LAYER * spacing).any(axis=0)
    near = np.flatnonzero(at_surface | near_cut)
    normal, deep, even = _planes(lattice, phi_i, phi, near, spacing)
    outer = np.flatnonzero(at_surface[near] & (deep < 1.4 * spacing))
    parts = [_outer(position, near[outer], normal[outer], deep[outer], spacing, planes, even[outer])]
    for k, plane in enumerate(planes):
        here = np.flatnonzero(near_cut[near] & (above[k, near] > -LAYER * spacing))
        parts.append(_cut_face(position, near[here], normal[here], deep[here], phi[near[here]], spacing, planes, k))
    return Surfels(*[np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Surfels)])


def _evened(lattice: Lattice, chosen, normal, deep) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Normals and depths with less of the stairs that points make of a slope: the planes that points take for their
    surface, seen from the nodes, are averaged there, and the means at the points. And how well normals agree, 0 to 1."""
    with_normal = _some(normal).astype(float)
    weight_i = np.maximum(lattice.to_nodes(with_normal, chosen), 1e-12)
    mean = lattice.to_points(lattice.to_nodes(normal, chosen) / weight_i[:, None], chosen)
    agreed = np.sqrt(np.einsum("ij,ij->i", mean, mean))
    mean = _unit(mean, 1e-3)
    level_i = np.zeros(lattice.nodes)
    for weight, node, away in lattice.from_nodes(chosen):
        level = with_normal * (deep + np.einsum("ij,ij->i", normal, away))
        level_i += np.bincount(node, weights=weight * level, minlength=lattice.nodes)
    level_i /= weight_i
    evened = 0
    for weight, node, away in lattice.from_nodes(chosen):
        evened = evened + weight * (level_i[node] - np.einsum("ij,ij->i", mean, away))
    return mean, np.where(_some(mean), evened, deep), agreed


def _against(planes: list[Plane], position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Trims of discs at these positions by the clip planes."""
    trim = np.array([np.broadcast_to(plane.normal, position.shape) for plane in planes])
    limit = np.array([-plane.above(position) for plane in planes])
    shape = (len(planes), len(position))
    return trim.reshape(*shape, 3).transpose(1, 0, 2).copy(), limit.reshape(shape).T.copy()


def _outer(position, chosen, normal, deep, spacing, planes, even) -> Surfels:
    """Discs on the bodies' own surface, smaller at edges; what has no normal is a speck of its own."""
    placed = position[chosen] + normal * deep[:, None]
    kept = np.ones(len(chosen), bool)
    for plane in planes:
        kept &= plane.above(placed) < REACH * spacing
    trim, limit = _against(planes, placed)
    surface = Surfels(placed, normal, chosen, trim, limit, np.zeros(len(chosen), bool),
                      REACH * spacing * np.where(_some(normal), even, 1))
    return surface[kept]


def _cut_face(position, chosen, normal, deep, phi, spacing, planes, k) -> Surfels:
    """Discs on the k-th plane where it cuts bodies, which end at the bodies' surface."""
    plane = planes[k]
    placed = position[chosen] - plane.above(position[chosen])[:, None] * plane.normal
    trim, limit = _against(planes, placed)
    # The distance to the surface, had from the point, at the place on the plane.
    trim[:, k] = normal
    limit[:, k] = deep - np.einsum("ij,ij->i", placed - position[chosen], normal)
    trim[phi >= INSIDE, k] = 0
    limit[phi >= INSIDE, k] = spacing
    facing = np.broadcast_to(plane.normal, placed.shape).copy()
    kept = limit[:, k] > -0.5 * spacing
    face = Surfels(placed, facing, chosen, trim, limit, np.ones(len(chosen), bool),
                   np.full(len(chosen), CUT_REACH * spacing))
    return face[kept]


def lattice_of(position: np.ndarray, body: np.ndarray, spacing: float, lower, upper, periodic) -> Lattice:
    """The lattice that pictures use."""
    return Lattice(position, body, SPACING_TO_CELL * spacing, lower, upper, periodic)
