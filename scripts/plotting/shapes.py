"""Bodies as ellipsoids: centre, semi-axes, orientation and mean stress of each, from its material points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from results import Frame, MissingData, Run

ROUND = 1.02  # largest over smallest semi-axis at the start below which a body has no axes of its own


@dataclass
class Bodies:
    """One row for each body that has points."""

    body: np.ndarray
    centre: np.ndarray  # (N x 3) [m], within the domain where it is periodic
    velocity: np.ndarray  # (N x 3) [m/s]
    mass: np.ndarray  # [kg], in 2D [kg/m]
    volume: np.ndarray  # [m3], in 2D [m2]
    semi_axes: np.ndarray  # (N x 3) [m]; in 2D the third is the mean of the others
    quaternion: np.ndarray  # (N x 4: x y z w) turns the axes at the start, x y z, to where they are
    stress: np.ndarray | None  # (N x 6: xx yy zz xy yz xz) [Pa], mean over the volume
    dimension: int

    @property
    def radius(self) -> np.ndarray:
        """Of the sphere (disk) of the same volume [m]."""
        return (3 * self.volume / (4 * np.pi)) ** (1 / 3) if self.dimension == 3 else np.sqrt(self.volume / np.pi)


class Shapes:
    """Follows bodies through the frames of a run: their orientation is that at the start, turned as their points turned."""

    def __init__(self, run: Run):
        if not run.frames:
            raise MissingData("there are no particles_*.vtkhdf files (see output.particles)")
        self.run = run
        first = run.frames[0]
        self._matched = first.has("id") and first.points > 0
        bodies, which, away, weight, _ = self._relative(first)
        self._axes = dict(zip(bodies.tolist(), _own_axes(_second_moments(which, away, weight, len(bodies)), run.dimension)))
        if self._matched:
            order = np.argsort(first.field("id"))
            self._ids, self._away = first.field("id")[order], away[order]

    def at(self, frame: Frame) -> Bodies:
        """The bodies at the time of a frame."""
        bodies, which, away, weight, centre = self._relative(frame)
        count, dimension = len(bodies), self.run.dimension
        moments = _second_moments(which, away, weight, count)
        turned = self._rotations(frame, which, away, weight, count)
        axes = turned @ np.array([self._axes.get(int(b), np.eye(3)) for b in bodies]).reshape(-1, 3, 3)
        extent = np.einsum("nji,njk,nki->ni", axes, moments, axes)  # q_i . C q_i
        semi = np.sqrt(np.maximum(extent, 0) * (dimension + 2))
        if dimension == 2:
            semi[:, 2] = semi[:, :2].mean(axis=1)
        mass = frame.field("mass") if frame.has("mass") else weight
        velocity = frame.field("velocity") if frame.has("velocity") else np.zeros((frame.points, 3))
        stress = frame.field("stress") if frame.has("stress") else None
        total, volume = (np.bincount(which, weights=values, minlength=count) for values in (mass, weight))
        return Bodies(bodies, centre, _means(which, velocity, mass, count), total, volume, semi, quaternions(axes),
                      None if stress is None else _means(which, stress, weight, count), dimension)

    def _relative(self, frame: Frame):
        """Bodies, that of each point, points' places from its middle, their volumes, and the middles."""
        if not frame.points:
            raise MissingData(f"{frame.path.name} holds no points")
        run = self.run
        bodies, which = np.unique(frame.field("body"), return_inverse=True)
        weight = frame.field("volume") if frame.has("volume") else np.full(frame.points, run.point_spacing**run.dimension)
        position = frame.field("position").astype(float)
        first = np.zeros(len(bodies), int)
        first[which[::-1]] = np.arange(len(which))[::-1]
        for axis in np.flatnonzero(run.periodic):  # as seen from one of its points, so that no body is torn
            period = run.upper[axis] - run.lower[axis]
            position[:, axis] -= period * np.rint((position[:, axis] - position[first[which], axis]) / period)
        centre = _means(which, position, weight, len(bodies))
        away = position - centre[which]
        for axis in np.flatnonzero(run.periodic):
            period = run.upper[axis] - run.lower[axis]
            centre[:, axis] -= period * np.floor((centre[:, axis] - run.lower[axis]) / period)
        return bodies, which, away, weight, centre

    def _rotations(self, frame: Frame, which, away, weight, count) -> np.ndarray:
        """Rotation (N x 3 x 3) of each body since the start: the polar part of sum_p V_p (x - x_mean) (X - X_mean)^T."""
        if not (self._matched and frame.has("id")):
            return np.broadcast_to(np.eye(3), (count, 3, 3))
        at = np.minimum(np.searchsorted(self._ids, frame.field("id")), len(self._ids) - 1)
        known = self._ids[at] == frame.field("id")
        before = np.where(known[:, None], self._away[at], 0)
        mixed = np.stack([[np.bincount(which, weights=weight * away[:, i] * before[:, j], minlength=count)
                           for j in range(3)] for i in range(3)]).transpose(2, 0, 1)
        if self.run.dimension == 2:
            mixed[:, 2, 2] = np.maximum(np.abs(mixed[:, :2, :2]).max(axis=(1, 2)), 1e-300)
        left, _, right = np.linalg.svd(mixed)
        turn = np.sign(np.linalg.det(left @ right))
        left[:, :, 2] *= np.where(turn == 0, 1, turn)[:, None]
        return left @ right


def _means(which: np.ndarray, values: np.ndarray, weight: np.ndarray, count: int) -> np.ndarray:
    total = np.maximum(np.bincount(which, weights=weight, minlength=count), 1e-300)
    return np.stack([np.bincount(which, weights=weight * column, minlength=count) / total for column in values.T], 1)


def _second_moments(which, away, weight, count) -> np.ndarray:
    """Mean of (x - x_mean) (x - x_mean)^T by volume (N x 3 x 3) [m2]."""
    pairs = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)]
    columns = _means(which, np.stack([away[:, i] * away[:, j] for i, j in pairs], 1), weight, count)
    moments = np.zeros((count, 3, 3))
    for k, (i, j) in enumerate(pairs):
        moments[:, i, j] = moments[:, j, i] = columns[:, k]
    return moments


def _own_axes(moments: np.ndarray, dimension: int) -> np.ndarray:
    """Principal axes as columns (N x 3 x 3), a rotation, the longest first; x y z for bodies that are round."""
    axes = np.broadcast_to(np.eye(3), moments.shape).copy()
    values, vectors = np.linalg.eigh(moments[:, :dimension, :dimension])
    values, vectors = values[:, ::-1], vectors[:, :, ::-1]
    axes[:, :dimension, :dimension] = vectors
    axes[:, :, dimension - 1] *= np.sign(np.linalg.det(axes))[:, None]
    axes[values[:, 0] <= ROUND**2 * values[:, -1]] = np.eye(3)
    return axes


def quaternions(rotation: np.ndarray) -> np.ndarray:
    """x y z w (N x 4) of rotations (N x 3 x 3), w not negative: the eigenvector of the largest eigenvalue of Bar-Itzhack's
    matrix (J. Guid. Control Dyn. 23 (2000) 1085-1087), which is exact and has no special cases."""
    r = rotation
    k = np.empty((len(r), 4, 4))
    k[:, 0, 0], k[:, 1, 1] = r[:, 0, 0] - r[:, 1, 1] - r[:, 2, 2], r[:, 1, 1] - r[:, 0, 0] - r[:, 2, 2]
    k[:, 2, 2], k[:, 3, 3] = r[:, 2, 2] - r[:, 0, 0] - r[:, 1, 1], np.trace(r, axis1=1, axis2=2)
    for (i, j), value in {(0, 1): r[:, 0, 1] + r[:, 1, 0], (0, 2): r[:, 0, 2] + r[:, 2, 0],
                          (1, 2): r[:, 1, 2] + r[:, 2, 1], (0, 3): r[:, 2, 1] - r[:, 1, 2], (1, 3): r[:, 0, 2] - r[:, 2, 0],
                          (2, 3): r[:, 1, 0] - r[:, 0, 1]}.items():
        k[:, i, j] = k[:, j, i] = value
    vectors = np.linalg.eigh(k)[1][:, :, 3]
    return vectors * np.where(vectors[:, 3:] < 0, -1, 1)
