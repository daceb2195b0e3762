"""Paints material points as solid matter: every pixel takes the value of the nearest point that reaches it."""

from __future__ import annotations

import numpy as np

REACH = 0.80  # of a point, in point spacings: a little more than half the diagonal of its square

BLEND = 1.4  # likewise, of a point's value
VOID = np.array((255, 255, 255), np.uint8)
EMPTY = np.array((205, 212, 220), np.uint8)  # where there is no matter in a picture of values: no colour of a scale


class Pixels:
    """Pixels of the domain, rows upwards as imshow(origin="lower") has them, and the points that reach them."""

    def __init__(self, xy: np.ndarray, spacing: float, lower, upper, periodic, pixels: int):
        """xy (N x 2), spacing, lower and upper in metres; `pixels` is the length of the longer side."""
        lower, upper = np.asarray(lower, float), np.asarray(upper, float)
        size = (upper - lower).max() / pixels
        self.shape = np.maximum(np.rint((upper - lower) / size).astype(int), 1)
        place = (xy - lower) / size
        self._base = np.floor(place).astype(int)
        self._within = place - self._base - 0.5  # of the point, from the centre of its pixel
        self._spacing, self._periodic = spacing / size, periodic

    def reached(self, reach: float):
        """For each offset, the farthest first: rows, columns, points, and their distances in spacings."""
        reach = max(reach * self._spacing, 0.71)
        radius = int(np.ceil(reach))
        offsets = [(i, j) for i in range(-radius, radius + 1) for j in range(-radius, radius + 1)]
        for i, j in sorted(offsets, key=lambda o: -(o[0] ** 2 + o[1] ** 2)):
            target = self._base + (i, j)
            distance = np.hypot(i - self._within[:, 0], j - self._within[:, 1])
            near = distance <= reach
            for axis in range(2):
                if self._periodic[axis]:
                    target[:, axis] %= self.shape[axis]
                else:
                    near &= (target[:, axis] >= 0) & (target[:, axis] < self.shape[axis])
            chosen = np.flatnonzero(near)
            yield target[chosen, 1], target[chosen, 0], chosen, distance[chosen] / reach

    def nearest(self) -> np.ndarray:
        """Index of the point that each pixel shows, -1 where there is none."""
        owner = np.full(self.shape[::-1], -1, np.int64)
        for row, column, point, _ in self.reached(REACH):  # nearer points paint over those farther away
            owner[row, column] = point
        return owner

    def blended(self, owner: np.ndarray, body: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Mean of the values of points near each pixel, of the body that it shows."""
        shown = np.where(owner >= 0, body[owner], -1)
        total, weights = np.zeros(owner.shape), np.zeros(owner.shape)
        for row, column, point, distance in self.reached(BLEND):
            weight = (1.0001 - distance**2) ** 2 * (shown[row, column] == body[point])
            total[row, column] += weight * values[point]
            weights[row, column] += weight
        return np.where(weights > 0, total / np.maximum(weights, 1e-300), values[owner] if len(values) else 0)


def nearest_point(xy: np.ndarray, spacing: float, lower, upper, periodic, pixels: int) -> np.ndarray:
    """Index of the point that each pixel shows, -1 where there is none."""
    return Pixels(xy, spacing, lower, upper, periodic, pixels).nearest()


def outlines(shown: np.ndarray) -> np.ndarray:
    """Where a picture of bodies (rows x columns, -1: none) changes from one to another, or to none."""
    line = np.zeros(shown.shape, bool)
    line[:, :-1] |= shown[:, :-1] != shown[:, 1:]
    line[:-1] |= shown[:-1] != shown[1:]
    return line


def paint_bodies(owner: np.ndarray, body: np.ndarray, colour) -> np.ndarray:
    """Picture (rows x columns x 3) of bodies on white, with a dark line around each; `colour`: of bodies, 0 to 1."""
    picture = np.broadcast_to(VOID, (*owner.shape, 3)).copy()
    matter = owner >= 0
    bodies, which = np.unique(body, return_inverse=True)
    picture[matter] = (255 * colour(bodies) + 0.5).astype(np.uint8).reshape(-1, 3)[which[owner[matter]]]
    picture[outlines(np.where(matter, body[owner], -1))] //= 4
    return picture


def paint_values(owner: np.ndarray, body: np.ndarray, colour: np.ndarray) -> np.ndarray:
    """Picture (rows x columns x 3) of the colours of pixels (0 to 1), with a thin line around each body."""
    matter = owner >= 0
    picture = np.where(matter[..., None], (255 * colour + 0.5).astype(np.uint8), EMPTY)
    line = outlines(np.where(matter, body[owner], -1))
    picture[line] = (0.6 * picture[line]).astype(np.uint8)
    return picture
