"""Pictures of a run in space: bodies as smooth lit surfaces, coloured by body or by a value, and cut open."""

from __future__ import annotations

import numpy as np

import colours
import shading
from camera import Camera, View
from chains import STRONG, WEAK, Network, widest
from canvas import Sheet, box_lines
from look import Look
from results import Frame, MissingData, Run
from scalars import scalar, scale
from skin import BALL, nearest, skin_of
from surface import Plane
from zbuffer import Buffers, add_balls, paint, paint_balls


def _horizontal(planes: list[Plane], up: int) -> np.ndarray:
    """The planes' normals seen from above, summed."""
    return np.sum([plane.normal[[(up + 1) % 3, (up + 2) % 3]] for plane in planes], axis=0) if planes else np.zeros(2)


def view_of(planes: list[Plane], up: int, azimuth: float | None, elevation: float | None, zoom: float,
            perspective: bool) -> View:
    """What the user chose; else cut faces are turned towards the viewer."""
    view = View(zoom=zoom, perspective=perspective)
    across = _horizontal(planes, up)
    if across.any():
        one = np.count_nonzero(across) == 1
        view.azimuth = float(np.degrees(np.arctan2(across[1], across[0]))) + (35 if one else 0)
    if any(plane.normal[up] > 0 for plane in planes):
        view.elevation = 45.0
    elif any(plane.normal[up] < 0 for plane in planes):
        view.elevation = -30.0
    view.azimuth = view.azimuth if azimuth is None else azimuth
    view.elevation = view.elevation if elevation is None else elevation
    return view


def clip_plane(text: str, run: Run) -> Plane:
    """The plane of "x<0.3", "z>0.1" (what is kept, [m]), or "x<" (up to the middle of the domain)."""
    name, sign, value = text[:1], text[1:2], text[2:].strip()
    if name not in ("x", "y", "z")[: run.dimension] or sign not in ("<", ">"):
        raise MissingData(f"--clip {text}: wants what is kept, as in x<0.3 or z>0.1 (in metres), or x< for half")
    axis = "xyz".index(name)
    try:
        offset = float(value) if value else float(run.lower[axis] + run.upper[axis]) / 2
    except ValueError as error:
        raise MissingData(f"--clip {text}: '{value}' is not a number of metres") from error
    if not np.isfinite(offset):
        raise MissingData(f"--clip {text}: '{value}' is not a number of metres")
    normal = np.zeros(3)
    normal[axis] = 1.0 if sign == "<" else -1.0
    return Plane(normal, offset * normal[axis])


def middle_plane(run: Run) -> Plane:
    """Cuts the matter in halves, so that the standard view looks at the cut."""
    axis = (up_axis(run) + 1) % 3
    normal = np.eye(3)[axis]
    lower, upper = matter_box(run)
    return Plane(normal, float(lower[axis] + upper[axis]) / 2)


def matter_box(run: Run) -> tuple[np.ndarray, np.ndarray]:
    """The box (lower, upper) [m] of all points at the start and at the end, so that a film does not sway."""
    ends = [frame.field("position") for frame in (run.frames[0], run.frames[-1]) if frame.points]
    if not ends:
        raise MissingData("there are no points")
    lower = np.min([x.min(axis=0) for x in ends], axis=0) - run.point_spacing
    upper = np.max([x.max(axis=0) for x in ends], axis=0) + run.point_spacing
    return lower, upper


def _kept(lower, upper, planes: list[Plane], least: float) -> tuple[np.ndarray, np.ndarray]:
    """The part of a box that clip planes leave, not thinner than `least` [m]."""
    for plane in planes:
        axis = int(np.abs(plane.normal).argmax())
        if plane.normal[axis] > 0:
            upper[axis] = max(min(upper[axis], plane.offset), lower[axis] + least)
        else:
            lower[axis] = min(max(lower[axis], -plane.offset), upper[axis] - least)
    return lower, upper


def up_axis(run: Run) -> int:
    """The vertical axis: against gravity, or z."""
    gravity = np.abs(run.gravity)
    return int(gravity.argmax()) if gravity.max() > 0 else 2


class Scene:
    """A run, ready to be drawn frame after frame with one camera, one set of colours and one scale."""

    def __init__(self, run: Run, look: Look, frames: list[Frame]):
        """The colour scale is for all of `frames`."""
        if run.dimension != 3:
            raise MissingData("drawn for three dimensions only")
        self.run, self.look = run, look
        lower, upper = _kept(*matter_box(run), look.planes, run.point_spacing)
        up = up_axis(run)
        view = view_of(look.planes, up, look.azimuth, look.elevation, look.zoom, look.perspective)
        self.camera = Camera(view, up, lower, upper, look.width, look.height)
        self.box = np.array(_kept(run.lower.copy(), run.upper.copy(), look.planes, run.point_spacing))
        self.scalar = None
        if look.colour != "body":
            self.scalar = scalar(run, frames[0], look.colour)
            self.low, self.high, self.map = scale(run, frames, self.scalar, look.range)
        else:
            self.colour = colours.of_run(run)

    def buffers(self, frame: Frame) -> Buffers:
        """What is seen; owners are bodies."""
        return self._seen(frame)[0]

    def _seen(self, frame: Frame) -> tuple[Buffers, np.ndarray]:
        """What is seen, and the points' positions."""
        run, planes = self.run, self.look.planes
        if frame.points == 0:
            raise MissingData(f"{frame.path.name} holds no points")
        position = frame.field("position").astype(float)
        body = frame.field("body") if frame.has("body") else np.zeros(len(position), int)
        volume = frame.field("volume") if frame.has("volume") else np.full(len(position), run.point_spacing**3)
        value = self.scalar.values(run, frame) if self.scalar else None
        chosen, front = nearest(self.camera, position, run.point_spacing, planes)
        radius = np.cbrt(np.bincount(body, volume)[body[chosen]] / (4 / 3 * np.pi))
        place, value = position[chosen], value if value is None else value[chosen]
        skin = skin_of(place, volume[chosen], body[chosen], value, radius, run.point_spacing,
                       (run.lower, run.at(frame).upper, run.periodic), planes, front)
        seen = paint(skin, self.camera, planes, self.scalar is not None)
        left = skin.ball[np.all([np.ones(len(skin.ball)), *[plane.above(place[skin.ball]) < 0 for plane in planes]], axis=0)]
        if len(left):
            size = np.full(len(left), BALL * run.point_spacing)
            add_balls(seen, paint_balls(place[left], size, self.camera), body[chosen[left]], None if value is None else value[left])
        return seen, position

    def _pixel_colours(self, seen: Buffers, frame: Frame) -> np.ndarray:
        if self.scalar:
            picture = colours.mapped(seen.value, self.low, self.high, self.map)
            picture[seen.hit & np.isin(seen.owner, self.scalar.lacking(self.run, frame))] = colours.DRIVEN
            return picture
        picture = np.zeros((*seen.owner.shape, 3))
        picture[seen.hit] = self.colour(seen.owner[seen.hit])
        return picture

    def picture(self, frame: Frame) -> np.ndarray:
        """The picture alone (rows x columns x 3, 0 to 1)."""
        seen, position = self._seen(frame)
        camera, spacing = self.camera, self.run.point_spacing
        for plane in self.look.planes:
            position = position[plane.above(position) < 0]
        shadows = shading.Shadows(camera.turn(position - camera.target), spacing)
        line = shading.silhouettes(seen, spacing)
        picture = shading.shade(seen, camera, self._pixel_colours(seen, frame), shadows, line, spacing, exact=self.scalar is not None)
        return box_lines(picture, camera, seen.depth, self.box)

    def sheet(self, frame: Frame, title: str) -> Sheet:
        """The picture with all that is needed to read it."""
        sheet = Sheet(self.picture(frame), title, self.run.failed, scale=self.scalar is not None)
        if self.scalar:
            sheet.colour_scale(self.low, self.high, self.map, self.scalar.title, self.scalar.unit)
        sheet.scale_bar(self.camera, self.look.perspective)
        sheet.axes(self.camera)
        return sheet

    def with_chains(self, frame: Frame, net: Network, title: str) -> Sheet:
        """The contact network as rods, all of which are seen, before pale bodies."""
        camera, spacing, look = self.camera, self.run.point_spacing, self.look
        picture = 1 - 0.3 * (1 - self.picture(frame))
        kept = np.ones(len(net.lines), bool)
        for plane in look.planes:
            kept &= plane.above(net.lines[:, 1]) < 0
        most = widest(self.run)
        radius = np.maximum(0.5 * most * net.share[kept], 0.7 / camera.scale)
        ball, size, line = _rods(net.lines[kept], radius)
        inside = ((ball >= self.run.lower - spacing) & (ball <= self.run.upper + spacing)).all(axis=1)
        ball, size, line = ball[inside], size[inside], line[inside]
        seen = paint_balls(ball, size, camera)
        colour = np.where(net.strong[kept][:, None], STRONG, WEAK)[line] if len(line) else np.zeros((1, 3))
        light = 0.5 + 0.5 * np.clip(seen.normal @ shading.LIGHT, 0, 1)
        rods = colour[seen.owner] * light[..., None]
        picture[seen.hit] = rods[seen.hit]
        seen.owner[seen.hit] = line[seen.owner[seen.hit]]
        edge = shading.silhouettes(seen, 2 * most)
        sheet = Sheet(shading.soften(picture * (1 - 0.35 * edge)[..., None], edge), title, self.run.failed)
        sheet.scale_bar(camera, look.perspective)
        sheet.axes(camera)
        sheet.widths(net.top, net.mean, most * camera.scale, "N", net.title)
        return sheet


def _rods(lines: np.ndarray, radius: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Spheres along lines (N x 3 x 3): their centres, radii and lines."""
    balls, sizes, owners = [], [], []
    for half in (lines[:, :2], lines[:, 1:]):
        length = np.linalg.norm(half[:, 1] - half[:, 0], axis=1)
        count = np.ceil(length / (0.4 * np.maximum(radius, 1e-300))).astype(int) + 1
        owner = np.repeat(np.arange(len(lines)), count)
        first = np.repeat(np.cumsum(count) - count, count)
        along = (np.arange(len(owner)) - first) / np.maximum(count[owner] - 1, 1)
        balls.append(half[owner, 0] + along[:, None] * (half[owner, 1] - half[owner, 0]))
        sizes.append(radius[owner])
        owners.append(owner)
    return np.concatenate(balls), np.concatenate(sizes), np.concatenate(owners)
