"""Light on what a z-buffer holds: diffuse light with soft shadows, ambient light that crevices lack, dark silhouettes."""

from __future__ import annotations

import numpy as np

from camera import Camera
from zbuffer import Buffers

LIGHT = np.array((-0.38, 0.58, 0.72)) / np.linalg.norm((-0.38, 0.58, 0.72))  # towards the light, camera axes
AMBIENT, DIFFUSE, GLOSS = 0.52, 0.55, 0.10
SHADOW = 0.55  # of the diffuse light, taken by a full shadow
CREVICE = 0.75  # of the ambient light, taken where nothing of the sky is seen
REACH = 6.0  # of crevices, in spacings
LINE = 0.45  # brightness of silhouettes
TURN = 2.399963  # the golden angle: directions spread evenly however many there are
RING = [(np.cos(TURN * k), np.sin(TURN * k), (k + 1) / 12) for k in range(12)]  # and the share of the reach there


def box_blur(picture: np.ndarray, radius: int) -> np.ndarray:
    """Mean over squares of 2 radius + 1 pixels, of a picture (rows x columns); twice, which is nearly round."""
    for _ in range(2):
        for axis in (0, 1):
            wide = [(radius + 1, radius) if a == axis else (0, 0) for a in (0, 1)]
            sums = np.pad(picture, wide, mode="edge").cumsum(axis=axis)
            n, size = 2 * radius + 1, picture.shape[axis]
            upper, lower = np.take(sums, range(n, n + size), axis), np.take(sums, range(size), axis)
            picture = (upper - lower) / n
    return picture


def crevices(buffers: Buffers, camera: Camera, reach: float) -> np.ndarray:
    """Share of the sky (0 to 1) that matter within `reach` [m] hides, for each pixel. Found for each second pixel along
    both axes, as it varies slowly."""
    depth = np.where(buffers.hit, buffers.depth, -1e30)[::2, ::2].astype(np.float32)
    normal = buffers.normal[::2, ::2].astype(np.float32)
    rows, columns = depth.shape
    hidden = np.zeros(depth.shape, np.float32)
    slope_right, slope_up = (-normal[..., k] / np.maximum(normal[..., 2], np.float32(0.25)) for k in (0, 1))
    for right, up, share in RING:
        far = np.float32(reach * share)
        j, i = int(round(0.5 * far * right * camera.scale)), int(round(-0.5 * far * up * camera.scale))
        if not (i or j) or abs(i) >= rows or abs(j) >= columns:
            continue
        here = (slice(max(0, -i), rows - max(0, i)), slice(max(0, -j), columns - max(0, j)))
        there = (slice(max(0, i), rows - max(0, -i)), slice(max(0, j), columns - max(0, -j)))
        rise = (depth[there] - depth[here]) / far - np.float32(right) * slope_right[here] - np.float32(up) * slope_up[here]
        hidden[here] += np.minimum(np.maximum(rise - np.float32(0.15), 0), 1) * np.minimum(np.maximum(3 - rise, 0), 1)
    blurred = box_blur(hidden / np.float32(0.4 * len(RING)), 2)
    whole = np.repeat(np.repeat(blurred, 2, axis=0), 2, axis=1)[: buffers.depth.shape[0], : buffers.depth.shape[1]]
    return np.clip(box_blur(whole, 1), 0, 1)


class Shadows:
    """What lies in the shadow of matter, with soft edges."""

    def __init__(self, position: np.ndarray, spacing: float):
        """`position` (N x 3) [m] of all points, in camera axes."""
        side = np.cross(LIGHT, (0.0, 1.0, 0.0))
        self.basis = np.stack([side / np.linalg.norm(side), np.cross(side / np.linalg.norm(side), LIGHT), LIGHT])
        self.spacing = spacing
        self.tile = 0.8 * spacing
        turned = position @ self.basis.T
        self.low = turned[:, :2].min(axis=0) - 3 * spacing if len(turned) else np.zeros(2)
        place = ((turned[:, :2] - self.low) / self.tile).astype(np.int32)
        shape = place.max(axis=0, initial=0) + 5
        order = np.argsort(turned[:, 2].astype(np.float32))
        tiles = np.full(shape, -np.inf)
        tiles[place[order, 0], place[order, 1]] = turned[order, 2]
        self.map = tiles.copy()
        for axis in (0, 1):
            for way in (-1, 1):  # tiles at the edges are empty
                np.maximum(self.map, np.roll(tiles, way, axis) - 0.3 * spacing, out=self.map)

    def share(self, position: np.ndarray) -> np.ndarray:
        """How much (0 to 1) of the light is kept from positions (N x 3) in camera axes."""
        turned = position @ self.basis.T
        place = (turned[:, :2] - self.low) / self.tile
        limit = turned[:, 2] + 2.2 * self.spacing
        total = np.zeros(len(position), np.float32)
        offsets = (-1.2, -0.4, 0.4, 1.2)
        wide, flat = self.map.shape[1], self.map.ravel()
        rows = [np.clip((place[:, 0] + a).astype(np.int32), 0, self.map.shape[0] - 1) * wide for a in offsets]
        columns = [np.clip((place[:, 1] + b).astype(np.int32), 0, wide - 1) for b in offsets]
        for i in rows:
            for j in columns:
                total += flat[i + j] > limit
        return total / len(offsets) ** 2


def silhouettes(buffers: Buffers, step: float) -> np.ndarray:
    """Darkness (0 to 1) of lines between bodies, against the background, and where depth jumps by `step` [m]."""
    shown = buffers.owner
    depth = np.where(buffers.hit, buffers.depth, -1e30)
    steep = step / np.maximum(buffers.normal[..., 2], 0.15)  # a slope is no jump
    line = np.zeros(shown.shape)
    for axis in (0, 1):
        near = (slice(None, -1), slice(None)) if axis == 0 else (slice(None), slice(None, -1))
        far = (slice(1, None), slice(None)) if axis == 0 else (slice(None), slice(1, None))
        allowed = np.maximum(steep[near], steep[far])
        edge = (shown[near] != shown[far]) | (np.abs(depth[near] - depth[far]) > allowed)
        line[near] = np.maximum(line[near], edge & buffers.hit[near])
        line[far] = np.maximum(line[far], edge & buffers.hit[far] & ~buffers.hit[near])
    return line


def shade(buffers: Buffers, camera: Camera, colour: np.ndarray, shadows: Shadows, line: np.ndarray, spacing: float,
          exact: bool) -> np.ndarray:
    """Picture (rows x columns x 3, 0 to 1) from the colour of each pixel and the silhouettes (`line`).

    `exact`: colours are values, to be read against a scale, so that light changes them little and cut faces not at all.
    """
    hit = buffers.hit
    row, column = np.nonzero(hit)
    normal = buffers.normal[hit]
    position = camera.unproject(column + 0.5, row + 0.5, buffers.depth[hit])
    bright = np.clip(normal @ LIGHT, 0, 1)
    shadow = np.zeros(hit.shape, np.float32)
    shadow[hit] = shadows.share(position + normal * spacing)
    shadow = box_blur(shadow, int(np.clip(0.45 * spacing * camera.scale, 1, 6)))[hit]
    hidden = crevices(buffers, camera, REACH * spacing)[hit]
    light = AMBIENT * (0.8 + 0.2 * normal[:, 1]) * (1 - CREVICE * hidden) + DIFFUSE * bright * (1 - SHADOW * shadow)
    gloss = GLOSS * np.clip(normal @ _halfway(), 0, 1) ** 40 * (1 - shadow)
    if exact:
        light, gloss = 0.35 + 0.65 * light, 0
        light = np.where(buffers.cut[hit], 1.0, light)
    picture = np.ones((*hit.shape, 3))
    picture[hit] = np.clip(colour[hit] * light[:, None] + np.reshape(gloss, (-1, 1)), 0, 1)
    return soften(picture * (1 - (1 - LINE) * line)[..., None], line)


def _halfway() -> np.ndarray:
    half = LIGHT + (0.0, 0.0, 1.0)
    return half / np.linalg.norm(half)


def soften(picture: np.ndarray, line: np.ndarray) -> np.ndarray:
    """Blends pixels at lines with their neighbours, so that lines are no stairs."""
    rows, columns = line.shape
    wide = np.pad(line, 1, mode="edge")
    near = np.max([wide[i : i + rows, j : j + columns] for i in range(3) for j in range(3)], axis=0) > 0
    around = np.pad(picture, ((1, 1), (1, 1), (0, 0)), mode="edge")
    weights = np.outer((1, 2, 1), (1, 2, 1)) / 16
    row, column = np.nonzero(near)
    mean = sum(weights[i, j] * around[row + i, column + j] for i in range(3) for j in range(3))
    softened = picture.copy()
    softened[row, column] = mean
    return softened
