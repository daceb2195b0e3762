"""Paints surfels into a z-buffer: depth, normal and owner of each pixel, without a display or a graphics card."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camera import Camera
from surface import Surfels

EDGE_ON = 0.12  # least cosine between a disc and the viewer for its slope; steeper ones are taken as this steep


@dataclass
class Buffers:
    """Pixels (rows from the top)."""

    depth: np.ndarray  # nearness to the viewer [m]; -inf: nothing
    normal: np.ndarray  # (rows x columns x 3), camera axes
    surfel: np.ndarray  # index of the nearest surfel; -1: nothing
    value: np.ndarray | None  # (rows x columns), smooth over surfels

    @property
    def hit(self) -> np.ndarray:
        return self.surfel >= 0


@dataclass
class _Discs:
    """Surfels in camera axes, the farthest first."""

    column: np.ndarray
    row: np.ndarray
    x: np.ndarray  # pixels
    y: np.ndarray
    towards: np.ndarray  # nearness to the viewer [m]
    scale: np.ndarray  # pixels per metre
    normal: np.ndarray
    slope: np.ndarray  # (N x 2) of depth along right and up
    trim: np.ndarray
    limit: np.ndarray
    radius: np.ndarray  # [m]
    source: np.ndarray  # index of the surfel

    def __getitem__(self, chosen):
        return _Discs(*[getattr(self, name)[chosen] for name in self.__dataclass_fields__])


def _prepare(surface: Surfels, camera: Camera) -> _Discs:
    place, towards, scale = camera.project(surface.position)
    normal, eye = camera.turn(surface.normal), camera.towards_eye(surface.position)
    speck = (surface.normal == 0).sum(axis=1) == 3
    normal[speck] = eye[speck]
    radius = surface.radius * scale
    facing = np.einsum("ij,ij->i", normal, eye) > 0.02
    inside = (place[:, 0] > -radius) & (place[:, 0] < radius + camera.width)
    inside &= (place[:, 1] > -radius) & (place[:, 1] < radius + camera.height)
    chosen = np.flatnonzero(facing & inside)
    chosen = chosen[np.argsort(towards[chosen], kind="stable")]
    normal = normal[chosen]
    steep = np.maximum(normal[:, 2], EDGE_ON)
    trim = np.stack([camera.turn(surface.trim[chosen, k]) for k in range(surface.trim.shape[1])], 1) \
        if surface.trim.shape[1] else surface.trim[chosen]
    cell = np.floor(place[chosen]).astype(np.int32)
    columns = (place[chosen, 0], place[chosen, 1], towards[chosen], scale[chosen], normal,
               -normal[:, :2] / steep[:, None], trim, surface.limit[chosen], surface.radius[chosen])
    return _Discs(cell[:, 0], cell[:, 1], *[column.astype(np.float32) for column in columns], source=chosen)


def _hidden(discs: _Discs, camera: Camera) -> np.ndarray:
    """Discs that lie well behind others: all tiles of about half a disc around them are covered by nearer ones."""
    if not len(discs.x):
        return np.zeros(0, bool)
    radius = discs.radius.min()
    tile = 0.45 * radius * np.median(discs.scale)
    if tile < 1.5:
        return np.zeros(len(discs.x), bool)
    shape = (int(camera.height / tile) + 5, int(camera.width / tile) + 5)
    row, column = (np.clip((v / tile).astype(int) + 2, 1, n - 2) for v, n in ((discs.y, shape[0]), (discs.x, shape[1])))
    front = np.full(shape, -np.inf)
    covering = np.flatnonzero(discs.normal[:, 2] > 0.5)
    for i in (-1, 0, 1):
        for j in (-1, 0, 1):
            if i and j:
                continue
            tiles = np.full(shape, -np.inf)
            tiles[row[covering] + i, column[covering] + j] = discs.towards[covering]  # the last, that is nearest, stays
            np.maximum(front, tiles, out=front)
    around = front.copy()
    for i in (-1, 0, 1):
        for j in (-1, 0, 1):
            beside = front[1 + i : shape[0] - 1 + i, 1 + j : shape[1] - 1 + j]
            around[1:-1, 1:-1] = np.minimum(around[1:-1, 1:-1], beside)
    return discs.towards < around[row, column] - 3 * radius


def _painted(discs: _Discs, camera: Camera):
    """For each offset of pixels, what it paints: (pixel, depth, squared share of the radius, of which disc)."""
    radius = discs.radius * discs.scale
    trimmed = (discs.limit < discs.radius[:, None]).any(axis=0)
    reach = int(np.ceil(radius.max(initial=0)))
    size, right_slope, up_slope = 1 / discs.scale, discs.slope[:, 0].copy(), discs.slope[:, 1].copy()
    squared = discs.radius**2
    least = 0.75  # pixels, so that small discs leave no holes
    for i in range(-reach, reach + 1):
        for j in range(-reach, reach + 1):
            if max(abs(i) - 1, 0) ** 2 + max(abs(j) - 1, 0) ** 2 > max(reach, 1) ** 2:
                continue
            column, row = discs.column + j, discs.row + i
            right, up = (column + np.float32(0.5) - discs.x) * size, (discs.y - row - np.float32(0.5)) * size
            deeper = right * right_slope + up * up_slope
            within = (right * right + up * up + deeper * deeper) / squared
            keep = within < 1
            if reach < 3:
                keep |= np.maximum(abs(right), abs(up)) < least * size
            keep &= (column >= 0) & (column < camera.width) & (row >= 0) & (row < camera.height)
            keep = np.flatnonzero(keep)
            deeper = deeper[keep]
            for k in np.flatnonzero(trimmed):
                m = discs.trim[keep, k]
                inside = m[:, 0] * right[keep] + m[:, 1] * up[keep] + m[:, 2] * deeper <= discs.limit[keep, k]
                keep, deeper = keep[inside], deeper[inside]
            yield row[keep] * camera.width + column[keep], discs.towards[keep] + deeper, within[keep], keep


def paint(surface: Surfels, camera: Camera, value: np.ndarray | None = None, owner: np.ndarray | None = None) -> Buffers:
    """What is seen. `value` (one for each surfel) is blended between discs of the same `owner` (as are normals)."""
    pixels = camera.height * camera.width
    depth, nearest = np.full(pixels, -np.inf, np.float32), np.full(pixels, -1, np.int32)
    discs = _prepare(surface, camera)
    discs = discs[~_hidden(discs, camera)]
    for pixel, towards, _, disc in _painted(discs, camera):
        better = np.flatnonzero(towards > depth[pixel])
        pixel = pixel[better]
        depth[pixel] = towards[better]
        nearest[pixel] = disc[better]
    seen, nearest = np.unique(nearest, return_inverse=True)  # the others are not blended in, either
    if len(seen) and seen[0] < 0:
        seen, nearest = seen[1:], nearest - 1
    discs = discs[seen]
    total = np.zeros((pixels, 6), np.float32)  # weight, normal, depth, value
    mine = owner[discs.source] if owner is not None else np.zeros(len(seen), int)
    what = np.ones((len(seen), 6), np.float32)
    what[:, 1:4] = discs.normal
    what[:, 5] = 0 if value is None else value[discs.source]
    shown = np.append(mine, -1)[nearest]
    thick = 0.7 * discs.radius.min(initial=np.inf)
    for pixel, towards, within, disc in _painted(discs, camera):
        same = np.flatnonzero((towards > depth[pixel] - thick) & (mine[disc] == shown[pixel]))
        pixel, disc = pixel[same], disc[same]
        weight = (np.float32(1.0001) - np.minimum(within[same], 1)) ** 2
        part = what[disc]
        part[:, 4] = towards[same]
        total[pixel] += weight[:, None] * part
    return _blended(total, nearest, discs, value is not None, (camera.height, camera.width))


def _blended(total: np.ndarray, nearest: np.ndarray, discs: _Discs, valued: bool, shape: tuple[int, int]) -> Buffers:
    hit = nearest >= 0
    mean = total.astype(float)
    mean[hit] /= np.maximum(mean[hit, :1], 1e-30)
    normal = mean[:, 1:4]
    normal[hit] /= np.maximum(np.sqrt(np.einsum("ij,ij->i", normal[hit], normal[hit])), 1e-30)[:, None]
    depth = np.where(hit, mean[:, 4], -np.inf)
    surfel = np.where(hit, np.append(discs.source, -1)[nearest], -1)
    value = mean[:, 5].reshape(shape) if valued else None
    return Buffers(depth.reshape(shape), normal.reshape(*shape, 3), surfel.reshape(shape), value)


def paint_balls(position: np.ndarray, radius: np.ndarray, camera: Camera) -> Buffers:
    """What is seen of spheres (N x 3) [m]; `surfel` is the sphere's index."""
    pixels = camera.height * camera.width
    depth, nearest = np.full(pixels, -np.inf), np.full(pixels, -1)
    place, towards, scale = camera.project(position)
    order = np.argsort(towards, kind="stable")
    place, towards, scale, radius = place[order], towards[order], scale[order], radius[order]
    column, row = np.floor(place).astype(int).T
    reach = int(np.ceil((radius * scale).max(initial=0)))
    normal = np.zeros((pixels, 3))
    for i in range(-reach, reach + 1):
        for j in range(-reach, reach + 1):
            right, up = (column + j + 0.5 - place[:, 0]) / scale, (place[:, 1] - row - i - 0.5) / scale
            bulge = radius**2 - right**2 - up**2
            inside = (column + j >= 0) & (column + j < camera.width) & (row + i >= 0) & (row + i < camera.height)
            # The middle of a ball that is thinner than a pixel is seen, too.
            ball = np.flatnonzero(inside & ((bulge > 0) | ((i == 0) & (j == 0))))
            up_front = np.sqrt(np.maximum(bulge[ball], 0))
            pixel = (row[ball] + i) * camera.width + column[ball] + j
            better = np.flatnonzero(towards[ball] + up_front > depth[pixel])
            ball, pixel, up_front = ball[better], pixel[better], up_front[better]
            depth[pixel] = towards[ball] + up_front
            nearest[pixel] = order[ball]
            normal[pixel] = np.column_stack([right[ball], up[ball], np.maximum(up_front, 1e-30)]) / radius[ball, None]
    shape = (camera.height, camera.width)
    length = np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    return Buffers(depth.reshape(shape), (normal / length).reshape(*shape, 3), nearest.reshape(shape), None)
