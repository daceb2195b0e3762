"""Where a picture in space is seen from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

FIELD_OF_VIEW = 30.0  # degrees, with perspective
MARGIN = 0.06  # of the picture, free on each side


@dataclass
class View:
    """What a user may choose."""

    azimuth: float = 35.0  # degrees: about the vertical axis
    elevation: float = 22.0  # degrees: above the horizon
    zoom: float = 1.0  # 1: all is seen
    perspective: bool = False


class Camera:
    """Turns metres into pixels. Camera axes: right, up, towards the viewer."""

    def __init__(self, view: View, up_axis: int, lower, upper, width: int, height: int, margin: float = MARGIN):
        """Looks at the box from `lower` to `upper` (3) [m] so that all of it is seen with `zoom` 1."""
        self.width, self.height = width, height
        first, second = (up_axis + 1) % 3, (up_axis + 2) % 3
        a, e = np.radians(view.azimuth), np.radians(view.elevation)
        basis = np.zeros((3, 3))
        basis[0, [first, second]] = -np.sin(a), np.cos(a)
        basis[1, [first, second, up_axis]] = -np.sin(e) * np.cos(a), -np.sin(e) * np.sin(a), np.cos(e)
        basis[2, [first, second, up_axis]] = np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)
        self.basis = basis
        ends = np.array([lower, upper], float)
        corners = np.array([[ends[i, 0], ends[j, 1], ends[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
        self.target = ends.mean(axis=0)
        turned = (corners - self.target) @ basis.T
        size = max(np.linalg.norm(ends[1] - ends[0]), 1e-300)
        self.distance = 0.5 * size / np.tan(np.radians(FIELD_OF_VIEW / 2)) if view.perspective else np.inf
        free = (1 - 2 * margin) * np.array([width, height])
        nearness = self._nearness(turned[:, 2])
        seen = turned[:, :2] * nearness[:, None]
        self.centre = (seen.max(axis=0) + seen.min(axis=0)) / 2
        self.scale = view.zoom * (free / np.maximum(np.ptp(seen, axis=0), 1e-300)).min()  # pixels per metre at the target

    def _nearness(self, towards: np.ndarray) -> np.ndarray:
        """How much larger than at the target things look there."""
        if np.isinf(self.distance):
            return np.ones_like(towards)
        return self.distance / np.maximum(self.distance - towards, 0.05 * self.distance)

    def turn(self, vectors: np.ndarray) -> np.ndarray:
        """Directions in camera axes."""
        return vectors @ self.basis.T

    def project(self, position: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Place in the picture (N x 2) [pixels, x to the right, y downwards], nearness to the viewer (N) [m], and
        pixels per metre there (N)."""
        turned = (position - self.target) @ self.basis.T
        nearness = self._nearness(turned[:, 2])
        place = (turned[:, :2] * nearness[:, None] - self.centre) * self.scale
        place = np.column_stack([self.width / 2 + place[:, 0], self.height / 2 - place[:, 1]])
        return place, turned[:, 2], nearness * self.scale

    def towards_eye(self, position: np.ndarray) -> np.ndarray:
        """Direction (N x 3, camera axes) in which the viewer is."""
        if np.isinf(self.distance):
            return np.broadcast_to((0.0, 0.0, 1.0), position.shape)
        eye = np.array([0, 0, self.distance]) - (position - self.target) @ self.basis.T
        return eye / np.linalg.norm(eye, axis=1, keepdims=True)

    def unproject(self, x: np.ndarray, y: np.ndarray, towards: np.ndarray) -> np.ndarray:
        """Camera coordinates (N x 3) [m] of pixels at a nearness."""
        nearness = self._nearness(towards)
        right = ((x - self.width / 2) / self.scale + self.centre[0]) / nearness
        up = ((self.height / 2 - y) / self.scale + self.centre[1]) / nearness
        return np.stack([right, up, towards], -1)
