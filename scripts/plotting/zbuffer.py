"""Finds what each pixel sees of surfaces, without a display or a graphics card: depth, normal and owner.

Every pixel's line of sight goes through the cells that it meets. In a cell the surface is d(x) = 0 with d linear along each
axis; along a line that is nearly a parabola, whose first root is taken.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camera import Camera
from skin import Skin
from surface import Plane

CHUNK = 1 << 14  # lines of sight through cells that are worked on at a time, in the cache
FAVOUR = np.float32(3e-4)  # of a cell, by which cut faces are nearer the deeper they lie in their body


@dataclass
class Buffers:
    """Pixels (rows from the top)."""

    depth: np.ndarray  # nearness to the viewer [m]; -inf: nothing
    normal: np.ndarray  # (rows x columns x 3), camera axes
    owner: np.ndarray  # whose surface is seen; -1: nothing
    cut: np.ndarray  # bool: on a cut face
    value: np.ndarray | None  # (rows x columns)

    @property
    def hit(self) -> np.ndarray:
        return self.owner >= 0


class _Rays:
    """Lines of sight in cells' own axes (0 to 1 along each): q = 1/2 + way_0 + z way_1, z towards the viewer from the
    cell's middle [m]."""

    def __init__(self, skin: Skin, camera: Camera, planes: list[Plane]):
        self.camera, self.planes = camera, planes
        place, self.towards, self.scale = (a.astype(np.float32) for a in camera.project(skin.centre))
        self.x, self.y = place.T
        self.per_cell = (camera.basis[None] / skin.size[:, None]).astype(np.float32)  # (C x axis of the camera x axis)
        self.equal = len(skin.size) > 0 and bool((skin.size == skin.size[0]).all())
        self.half = np.float32(0.5 * np.linalg.norm(skin.size, axis=1).max(initial=0))  # the nearest of a cell, from its middle [m]
        self.above = [plane.above(skin.centre).astype(np.float32) for plane in planes]
        terms = skin.level.reshape(-1, 2, 2, 2)
        for axis in (1, 2, 3):
            low, high = np.take(terms, 0, axis), np.take(terms, 1, axis)
            terms = np.stack([low, high - low], axis)
        self.terms = np.ascontiguousarray(terms.reshape(-1, 8).T)
        half = 0.5 * (abs(camera.basis[None]) * skin.size[:, None]).sum(axis=2) * self.scale[:, None]
        grow = 0.0 if np.isinf(camera.distance) else 0.25
        self.box = self._box(half[:, 0] * (1 + grow), half[:, 1] * (1 + grow))

    def _box(self, wide, high) -> np.ndarray:
        """First and last column and row (C x 4) of each cell, the last not within."""
        ends = [np.ceil(self.x - wide - 0.5), np.floor(self.x + wide - 0.5) + 1,
                np.ceil(self.y - high - 0.5), np.floor(self.y + high - 0.5) + 1]
        limits = (self.camera.width, self.camera.width, self.camera.height, self.camera.height)
        return np.stack([np.clip(e, 0, limit) for e, limit in zip(ends, limits)], 1).astype(np.int32)

    def pairs(self):
        """Chunks of cells and of pixels (column, row) in their boxes."""
        width = np.maximum(self.box[:, 1] - self.box[:, 0], 0)
        count = width * np.maximum(self.box[:, 3] - self.box[:, 2], 0)
        ends = np.cumsum(count, dtype=np.int64)
        first = 0
        while first < len(count):
            done = ends[first] - count[first]
            last = max(first + 1, int(np.searchsorted(ends, done + CHUNK, side="right")))
            number = count[first:last]
            cell = np.repeat(np.arange(first, last, dtype=np.int32), number)
            within = np.arange(len(cell), dtype=np.int32) - np.repeat((ends[first:last] - number - done).astype(np.int32), number)
            row, column = np.divmod(within, width[cell])
            yield cell, column + self.box[cell, 0], row + self.box[cell, 2]
            first = last

    def lines(self, cell, column, row) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """way_0 and way_1 (3 x N each), and the direction in camera axes (2 x N) where it is not straight ahead."""
        camera = self.camera
        axes = self.per_cell[:1] if self.equal else self.per_cell[cell]
        scale = self.scale[cell]
        right, up = (column + np.float32(0.5) - self.x[cell]) / scale, (self.y[cell] - row - np.float32(0.5)) / scale
        start = np.stack([right * axes[:, 0, k] + up * axes[:, 1, k] for k in range(3)])
        if np.isinf(camera.distance):
            return start, np.broadcast_to(axes[:, 2].T, start.shape), np.zeros((2, 1), np.float32)
        a = -((column + 0.5 - camera.width / 2) / camera.scale + camera.centre[0]) / camera.distance
        b = -((camera.height / 2 - row - 0.5) / camera.scale + camera.centre[1]) / camera.distance
        way = np.stack([axes[:, 2, k] + a * axes[:, 0, k] + b * axes[:, 1, k] for k in range(3)])
        return start, way.astype(np.float32), np.stack([a, b]).astype(np.float32)

    def spans(self, cell, column, row):
        """Lines that meet their cells: (which, start, way, nearest z, farthest z, whether a clip plane is what is nearest)."""
        start, way, ahead = self.lines(cell, column, row)
        near, far = np.full(len(cell), np.inf, np.float32), np.full(len(cell), -np.inf, np.float32)
        for k in range(3):
            step = np.where(abs(way[k]) < 1e-12, np.float32(1e-12), way[k])
            middle, half = -start[k] / step, np.float32(0.5) / abs(step)
            np.minimum(near, middle + half, out=near)
            np.maximum(far, middle - half, out=far)
        cut = np.zeros(len(cell), bool)
        tiny = np.float32(1e-3) * self.half
        for plane, above in zip(self.planes, self.above):
            normal = self.camera.turn(plane.normal)
            rise = normal[2] + normal[0] * ahead[0] + normal[1] * ahead[1]
            scale = self.scale[cell]
            right, up = (column + 0.5 - self.x[cell]) / scale, (self.y[cell] - row - 0.5) / scale
            here = above[cell] + normal[0] * right + normal[1] * up
            at = (-here / np.where(abs(rise) < 1e-9, 1e-9, rise)).astype(np.float32)
            rising = np.broadcast_to(rise > 0, at.shape)
            cut |= rising & (at < near + tiny)  # as near where the plane is a side of the cell
            near = np.where(rising, np.minimum(near, at), near)
            far = np.where(rising, far, np.maximum(far, at))
        chosen = np.flatnonzero(near > far)
        return chosen, start[:, chosen], way[:, chosen], near[chosen], far[chosen], cut[chosen]

    def level(self, terms, start, way, z) -> np.ndarray:
        """d at z on the lines."""
        x, y, w = (np.float32(0.5) + start[k] + z * way[k] for k in range(3))
        return (((terms[7] * w + terms[6]) * y + (terms[5] * w + terms[4])) * x
                + (terms[3] * w + terms[2]) * y + (terms[1] * w + terms[0]))


def _first_root(near, middle, far) -> np.ndarray:
    """Where (0 to 1) a parabola through values at 0, 1/2, 1 rises through 0; NaN where it does not."""
    bend, slope = 2 * (near - 2 * middle + far), -3 * near + 4 * middle - far
    square = slope * slope - 4 * bend * near
    below = slope + np.sqrt(np.maximum(square, 0))
    root = -2 * near / np.where(below > 0, below, 1)
    return np.where((square >= 0) & (below > 0) & (near <= 0) & (root <= 1), root, np.float32(np.nan))


def _nearer(depth: np.ndarray, which: np.ndarray, pixel: np.ndarray, towards: np.ndarray, number: np.ndarray) -> None:
    """Keeps in each pixel the nearest depth, and what it is of."""
    left = np.flatnonzero(towards > depth[pixel])
    while len(left):
        at = pixel[left]
        depth[at], which[at] = towards[left], number[left]
        left = left[towards[left] > depth[at]]


def paint(skin: Skin, camera: Camera, planes: list[Plane], valued: bool) -> Buffers:
    """What is seen of the cells."""
    pixels = camera.height * camera.width
    depth, which = np.full(pixels, -np.inf, np.float32), np.full(pixels, -1, np.int64)
    skin = skin.nearest_first(camera)
    rays = _Rays(skin, camera, planes)
    for cell, column, row in rays.pairs():
        open_ = np.flatnonzero(rays.towards[cell] + rays.half > depth[row * camera.width + column])
        cell, column, row = cell[open_], column[open_], row[open_]
        chosen, start, way, near, far, cut = rays.spans(cell, column, row)
        cell, pixel = cell[chosen], row[chosen] * camera.width + column[chosen]
        terms = rays.terms[:, cell]
        first = rays.level(terms, start, way, near)
        root = _first_root(first, rays.level(terms, start, way, 0.5 * (near + far)), rays.level(terms, start, way, far))
        face = cut & (first > 0)
        root[face] = 0
        near = near + face * (FAVOUR * rays.half * first)  # of bodies that overlap on a cut, each pixel is that of the deeper
        seen = np.flatnonzero(root == root)
        z = (near[seen] + root[seen] * (far[seen] - near[seen])).astype(np.float32)  # exactly what the buffer holds
        _nearer(depth, which, pixel[seen], rays.towards[cell[seen]] + z, 2 * cell[seen].astype(np.int64) + face[seen])
    return _filled(skin, camera, planes, rays, depth, which, valued)


def _filled(skin: Skin, camera: Camera, planes: list[Plane], rays: _Rays, depth, which, valued: bool) -> Buffers:
    """Normals and values of what was found."""
    shape = (camera.height, camera.width)
    pixel = np.flatnonzero(which >= 0)
    row, column = np.divmod(pixel, camera.width)
    cell, cut = which[pixel] // 2, (which[pixel] % 2).astype(bool)
    start, way, _ = rays.lines(cell, column, row)
    within = np.clip(0.5 + start + (depth[pixel] - rays.towards[cell]) * way, 0, 1)
    table = skin.table if valued else skin.table[:, :3]
    rows, mean = skin.corner[cell], np.zeros((len(pixel), table.shape[1]), np.float32)
    for corner in range(8):
        weight = np.prod([within[k] if corner >> (2 - k) & 1 else 1 - within[k] for k in range(3)], axis=0)
        mean += weight[:, None].astype(np.float32) * table[rows[:, corner]]
    normal = camera.turn(mean[:, :3])
    normal /= np.maximum(np.sqrt(np.einsum("ij,ij->i", normal, normal)), 1e-30)[:, None]
    if cut.any():
        position = camera.unproject(column[cut] + 0.5, row[cut] + 0.5, depth[pixel[cut]]) @ camera.basis + camera.target
        on = np.argmin([abs(plane.above(position)) for plane in planes], axis=0)
        normal[cut] = camera.turn(np.array([plane.normal for plane in planes]))[on]
    normals, owner, faces = np.zeros((*shape, 3)), np.full(shape, -1), np.zeros(shape, bool)
    normals.reshape(-1, 3)[pixel], owner.flat[pixel], faces.flat[pixel] = normal, skin.owner[cell], cut
    value = None
    if valued:
        value = np.zeros(shape)
        value.flat[pixel] = mean[:, 4] / np.where(mean[:, 3] > 0, mean[:, 3], 1)
    return Buffers(depth.reshape(shape).astype(float), normals, owner, faces, value)


def paint_balls(position: np.ndarray, radius: np.ndarray, camera: Camera) -> Buffers:
    """What is seen of spheres (N x 3) [m]; `owner` is the sphere's index."""
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
    return Buffers(depth.reshape(shape), (normal / length).reshape(*shape, 3), nearest.reshape(shape), np.zeros(shape, bool), None)


def add_balls(seen: Buffers, balls: Buffers, owner: np.ndarray, value: np.ndarray | None) -> None:
    """Balls (of these owners and values) before what is seen."""
    front = balls.depth > seen.depth
    of = balls.owner[front]
    seen.depth[front], seen.normal[front], seen.owner[front], seen.cut[front] = balls.depth[front], balls.normal[front], owner[of], False
    if seen.value is not None:
        seen.value[front] = value[of]
