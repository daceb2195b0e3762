"""Paints material points as solid matter: every pixel takes the value of the nearest point that reaches it."""

from __future__ import annotations

import numpy as np

REACH = 0.80  # of a point, in point spacings: a little more than half the diagonal of its square

# Bright colours that stand apart from each other and from black.
PALETTE = np.array(
    [
        (230, 25, 75), (60, 180, 75), (255, 225, 25), (0, 130, 200), (245, 130, 48), (145, 60, 190),
        (70, 240, 240), (240, 50, 230), (210, 245, 60), (250, 190, 212), (0, 128, 128), (220, 190, 255),
        (170, 110, 40), (255, 250, 200), (165, 40, 40), (170, 255, 195), (128, 128, 0), (255, 215, 180),
        (80, 100, 255), (120, 220, 90),
    ],
    np.uint8,
)  # fmt: skip
DRIVEN = np.array((120, 120, 120), np.uint8)
BLACK = np.zeros(3, np.uint8)


def nearest_point(xy: np.ndarray, spacing: float, lower, upper, periodic, pixels: int) -> np.ndarray:
    """Index of the point that each pixel shows, -1 where there is none.

    xy (N x 2), spacing, lower and upper in metres; `pixels` is the length of the longer side.
    Rows run upwards, as imshow(origin="lower") has them.
    """
    lower, upper = np.asarray(lower, float), np.asarray(upper, float)
    size = (upper - lower).max() / pixels
    shape = np.maximum(np.rint((upper - lower) / size).astype(int), 1)
    place = (xy - lower) / size
    base = np.floor(place).astype(int)
    within = place - base - 0.5  # of the point, from the centre of its pixel
    reach = max(REACH * spacing / size, 0.71)
    owner = np.full(shape[::-1], -1, np.int64)
    radius = int(np.ceil(reach))
    offsets = [(i, j) for i in range(-radius, radius + 1) for j in range(-radius, radius + 1)]
    # The farthest offset is painted first, so that nearer points paint over it.
    for i, j in sorted(offsets, key=lambda o: -(o[0] ** 2 + o[1] ** 2)):
        target = base + (i, j)
        near = np.hypot(i - within[:, 0], j - within[:, 1]) <= reach
        for axis in range(2):
            if periodic[axis]:
                target[:, axis] %= shape[axis]
            else:
                near &= (target[:, axis] >= 0) & (target[:, axis] < shape[axis])
        chosen = np.flatnonzero(near)
        owner[target[chosen, 1], target[chosen, 0]] = chosen
    return owner


def body_colours(bodies: np.ndarray, driven: np.ndarray) -> np.ndarray:
    """Colour (N x 3, 0 to 255) of each body id: the same for the same id in every picture; driven bodies are grey."""
    mixed = (np.asarray(bodies).astype(np.uint64) + np.uint64(1)) * np.uint64(0x9E3779B97F4A7C15)
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):  # splitmix64: neighbouring ids part
        mixed = (mixed ^ (mixed >> np.uint64(shift))) * np.uint64(factor)
    colours = PALETTE[(mixed >> np.uint64(32)) % np.uint64(len(PALETTE))]
    colours[np.isin(bodies, driven)] = DRIVEN
    return colours


def paint_bodies(owner: np.ndarray, body: np.ndarray, driven: np.ndarray) -> np.ndarray:
    """Picture (rows x columns x 3) of bodies in colours on black, with a dark line where two bodies touch."""
    shown = np.where(owner >= 0, body[owner], -1)
    picture = body_colours(np.maximum(shown, 0).ravel(), driven).reshape(*owner.shape, 3)
    picture[shown < 0] = BLACK
    line = np.zeros(shown.shape, bool)
    line[:, :-1] |= (shown[:, :-1] != shown[:, 1:]) & (shown[:, 1:] >= 0)
    line[:-1] |= (shown[:-1] != shown[1:]) & (shown[1:] >= 0)
    picture[line & (shown >= 0)] //= 4
    return picture


def paint_values(owner: np.ndarray, value: np.ndarray, top: float) -> np.ndarray:
    """Picture (rows x columns, 0 to 1) of a scalar of the points: white at `top` and above, black where it is zero."""
    share = np.clip(value / top, 0, 1) if top > 0 else np.zeros(len(value))
    return np.where(owner >= 0, share[owner], 0.0)


def project(position: np.ndarray, up: int) -> tuple[np.ndarray, np.ndarray]:
    """View of points in space (N x 3) from above one corner, without perspective.

    Returns the place in the picture (N x 2) [m] and the distance towards the viewer (N) [m]. `up` is the vertical axis.
    """
    axes = [axis for axis in range(3) if axis != up]
    turn, tilt = np.radians(30), np.radians(22)
    a, b, c = position[:, axes[0]], position[:, axes[1]], position[:, up]
    right = np.cos(turn) * a + np.sin(turn) * b
    away = -np.sin(turn) * a + np.cos(turn) * b
    return np.column_stack((right, np.cos(tilt) * c + np.sin(tilt) * away)), np.sin(tilt) * c - np.cos(tilt) * away


def paint_space(position: np.ndarray, body: np.ndarray, driven, spacing: float, corners: np.ndarray, up: int,
                pixels: int) -> tuple[np.ndarray, tuple]:
    """Picture of bodies in space: the nearest point wins each pixel, colours darken with distance.

    Returns the picture and its extent (left, right, bottom, top) [m]. `corners` (8 x 3) are those of the domain.
    """
    frame, _ = project(corners, up)
    lower, upper = frame.min(axis=0), frame.max(axis=0)
    xy, towards = project(position, up)
    order = np.argsort(towards, kind="stable")
    size = (upper - lower).max() / pixels
    shape = np.maximum(np.rint((upper - lower) / size).astype(int), 1)
    base = np.floor((xy[order] - lower) / size).astype(int)
    radius = max(int(np.ceil(REACH * spacing / size)), 1)
    depth = np.full(shape[::-1], -np.inf)
    owner = np.full(shape[::-1], -1, np.int64)
    for i in range(-radius, radius + 1):
        for j in range(-radius, radius + 1):
            if i * i + j * j > radius * radius:
                continue
            target = base + (i, j)
            inside = ((target >= 0) & (target < shape)).all(axis=1)
            column, row = target[inside, 0], target[inside, 1]
            candidate = np.full(owner.shape, -1, np.int64)
            candidate[row, column] = order[inside]  # the last, that is nearest, wins
            nearness = np.where(candidate >= 0, towards[candidate], -np.inf)
            better = nearness > depth
            owner[better], depth[better] = candidate[better], nearness[better]
    picture = paint_bodies(owner, body, driven)
    span = max(np.ptp(towards), 1e-300)
    light = np.where(owner >= 0, 0.35 + 0.65 * (depth - towards.min()) / span, 0)
    return (picture * light[..., None]).astype(np.uint8), (lower[0], upper[0], lower[1], upper[1])
