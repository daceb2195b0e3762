"""Where the surface of bodies is, seen from their points: for the page of scripts/view, which draws discs; and clip planes.

Points' volumes are summed at the nodes of a lattice for each body, phi_i = sum_p N_ip V_p / h^3, which is the share of
space that the body fills there, and phi_p = sum_i N_ip phi_i back at the points. Beneath a flat surface that is a known
function of depth, the sum of cubic B-splines (tent on tent), so that phi_p tells how deep a point lies; the surface is
that far along -grad phi.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lattice import SPACING_TO_CELL, Lattice

INSIDE = 0.985  # phi of points from which no surface is near


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


def lattice_of(position: np.ndarray, body: np.ndarray, spacing: float, lower, upper, periodic) -> Lattice:
    """The lattice that pictures use."""
    return Lattice(position, body, SPACING_TO_CELL * spacing, lower, upper, periodic)
