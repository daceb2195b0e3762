"""One output of a run as the measures see it: grains, their contacts, and the box around them.

Vectors have as many components as the run has dimensions, tensors are dimension x dimension, tension is positive, and
in two dimensions volumes are areas, per metre of thickness.
"""

from __future__ import annotations

import dataclasses
from functools import cached_property

import numpy as np

from bodies import FACES
from results import Frame, MissingData, Run, varies

VOIGT = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2]])  # xx yy zz xy yz xz
MOST = 0.95  # of the centres, on whose far side a tool bounds the box
SAME_TIME = 1e-9  # relative to the time of the last output


def tensors(components: np.ndarray, dimension: int) -> np.ndarray:
    """Rows of xx yy zz xy yz xz as tensors."""
    return components[:, VOIGT][:, :dimension, :dimension]


def moves(wall: dict) -> bool:
    """Whether a wall may stand elsewhere than its face."""
    return any(key in wall for key in ("position", "piston", "servo")) or bool(wall.get("velocity")) and (
        varies(wall["velocity"]) or any(wall["velocity"]))


@dataclasses.dataclass
class Grains:
    """Bodies that are neither rigid nor driven."""

    body: np.ndarray  # number of the body
    material: np.ndarray  # index in the order of [materials]
    mass: np.ndarray  # [kg]
    centre: np.ndarray  # [m], continuous across periodic faces
    velocity: np.ndarray  # [m/s]
    spin: np.ndarray  # [rad/s], N x 3
    volume: np.ndarray  # [m3]
    stress: np.ndarray  # mean over the volume [Pa]
    second_moment: np.ndarray  # mean of r r over the mass [m2]

    def __len__(self) -> int:
        return len(self.body)

    @property
    def diameter(self) -> np.ndarray:
        """Of the disk or sphere of the same volume [m]."""
        dimension = self.centre.shape[1]
        return ({2: 4, 3: 6}[dimension] / np.pi * self.volume) ** (1 / dimension)


@dataclasses.dataclass
class Contacts:
    """Pairs that touch; `a` is always a grain. What is not a grain, a tool or a wall, has the row -1 in `b`."""

    a: np.ndarray  # rows among the grains
    b: np.ndarray
    partner: np.ndarray  # number of the other body; below 0: a wall
    point: np.ndarray  # [m]
    normal: np.ndarray  # unit, out of a
    force: np.ndarray  # on a [N]
    moment: np.ndarray  # sum over the contact's nodes of f_i (x_j - point_j), on a [N m]

    def __len__(self) -> int:
        return len(self.a)

    @property
    def normal_force(self) -> np.ndarray:
        """[N], positive where the pair is pressed."""
        return -(self.force * self.normal).sum(axis=1)

    @property
    def tangential_force(self) -> np.ndarray:
        """On a [N], N x dimension."""
        return self.force + self.normal_force[:, None] * self.normal

    def chosen(self, rows: np.ndarray) -> Contacts:
        return Contacts(*(getattr(self, field.name)[rows] for field in dataclasses.fields(self)))


class Snapshot:
    """Grains, contacts and points of one output, read when asked for. Raises MissingData, which names the output."""

    def __init__(self, run: Run, index: int, threshold: float = 0.0):
        self.run, self.dimension = run, run.dimension
        self.threshold = threshold  # contacts below this share of the mean force are left out
        self.frame = run.grains[index]
        self.time, self.step = self.frame.time, self.frame.step
        self.upper = run.upper_at(self.time)  # corner of the domain
        self.period = np.where(run.periodic, self.upper - run.lower, 0.0)

    def same_time(self, frames: list[Frame], what: str) -> Frame:
        """The output of another kind at this time."""
        scale = SAME_TIME * max(frames[-1].time, 1e-300)
        for frame in frames:
            if abs(frame.time - self.time) <= scale:
                return frame
        raise MissingData(f"there are no {what} at {self.time:g} s: give output.{what} the conditions of output.grains")

    @cached_property
    def all_bodies(self) -> np.ndarray:
        return self.frame.field("body")

    @cached_property
    def is_grain(self) -> np.ndarray:
        """Of each row of the grain file."""
        table, body = self.run.bodies, self.all_bodies
        rigid = np.array([m.get("model") == "rigid" for m in self.run.case["materials"].values()])
        tool = rigid[self.frame.field("material")]
        known = body < len(table)
        tool[known] |= table.tool[body[known]]
        return ~tool

    @cached_property
    def grains(self) -> Grains:
        frame, keep, d = self.frame, self.is_grain, self.dimension
        if not keep.any():
            raise MissingData(f"{frame.path.name} holds no grain: all bodies are rigid or driven")
        if not (frame.has("volume") and frame.has("second_moment")):
            raise MissingData(f"{frame.path.name} holds no field 'volume', as older programs wrote it; run the case again")
        def column(name):
            return frame.field(name)[keep]
        return Grains(column("body"), column("material"), column("mass"), column("centre")[:, :d],
                      column("velocity")[:, :d], column("angular_velocity"), column("volume"),
                      tensors(column("mean_stress"), d), tensors(column("second_moment"), d))

    def wrapped(self, place: np.ndarray) -> np.ndarray:
        """Places brought back into the domain across periodic faces [m]."""
        length = np.where(self.period > 0, self.period, 1.0)
        return place - np.where(self.period > 0, np.floor((place - self.run.lower) / length) * length, 0.0)

    def shortest(self, way: np.ndarray) -> np.ndarray:
        """A vector between two places, or the one to the nearest periodic image."""
        length = np.where(self.period > 0, self.period, 1.0)
        return way - np.where(self.period > 0, np.rint(way / length) * length, 0.0)

    @cached_property
    def contact_file(self) -> Frame:
        return self.same_time(self.run.contacts, "contacts")

    @cached_property
    def contacts(self) -> Contacts:
        """All contacts of grains, the force averaged since the contact file before."""
        frame, d = self.contact_file, self.dimension
        number_of = np.full(max(int(self.all_bodies.max(initial=0)), 0) + 2, -1)
        number_of[self.grains.body] = np.arange(len(self.grains))
        first, second = frame.field("body_a").astype(int), frame.field("body_b").astype(int)

        def row_of(body):
            return np.where((body >= 0) & (body < len(number_of)), number_of[np.clip(body, 0, len(number_of) - 1)], -1)
        a, b = row_of(first), row_of(second)
        point, force, moment = frame.field("point")[:, :d], frame.field("force")[:, :d], np.zeros((len(a), d, d))
        if frame.has("moment"):
            moment = frame.field("moment").reshape(-1, 3, 3)[:, :d, :d] - force[:, :, None] * point[:, None, :]
        swap = (a < 0) & (b >= 0)  # the grain first
        sign = np.where(swap, -1.0, 1.0)[:, None]
        found = Contacts(np.where(swap, b, a), np.where(swap, a, b), np.where(swap, first, second), point,
                         sign * frame.field("normal")[:, :d], sign * force, sign[:, :, None] * moment)
        found = found.chosen(found.a >= 0)
        size = np.linalg.norm(found.force, axis=1)
        return found.chosen(size > self.threshold * size.mean() if len(size) else np.zeros(0, bool))

    def faces(self, kind: str) -> list[str]:
        """Faces of the domain of a type."""
        return [name for name, face in self.run.case.get("boundary", {}).items()
                if isinstance(face, dict) and face.get("type") == kind]

    @property
    def unseen_faces(self) -> list[str]:
        """Faces that push and have no rows in the contact file: fixed ones, and walls in files of older programs."""
        rows = self.contact_file.has("moment") or bool((self.contacts.partner < 0).any())
        return self.faces("fixed") + ([] if rows else self.faces("wall"))

    @property
    def contact_interval(self) -> tuple[float, float]:
        """From when to when the contacts' forces are averaged [s]."""
        times = [frame.time for frame in self.run.contacts if frame.time < self.time * (1 - SAME_TIME)]
        return (times[-1] if times else 0.0), self.time

    @cached_property
    def points(self) -> Frame:
        """The material points at this time."""
        if not self.run.frames:
            raise MissingData("there are no particles_*.vtkhdf files (see output.particles)")
        return self.same_time(self.run.frames, "particles")

    @cached_property
    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Between walls and tools: the domain, cut where a wall stands now, or where a tool lies wholly on one side of
        nearly all the grains' centres."""
        lower, upper = self.run.lower.copy(), self.upper.copy()
        for face in self.faces("wall"):
            if moves(self.run.case["boundary"][face]):
                axis, high = divmod(FACES.index(face), 2)
                rows = self.run.forces()[face]
                (upper if high else lower)[axis] = np.interp(self.time, rows["time"], rows["xyz"[axis]])
        low, high = self.tool_extents
        centres = self.grains.centre
        for axis in range(self.dimension):
            if self.period[axis]:
                continue
            least, most = np.quantile(centres[:, axis], (1 - MOST, MOST))
            below, above = high[:, axis] <= least, low[:, axis] >= most
            lower[axis] = max(high[below, axis].max(initial=-np.inf), lower[axis])
            upper[axis] = min(low[above, axis].min(initial=np.inf), upper[axis])
        return lower, upper

    @cached_property
    def tool_extents(self) -> tuple[np.ndarray, np.ndarray]:
        """The boxes around the tools now [m]: as at the start, moved with their centres. Tools do not turn."""
        table, body = self.run.bodies, self.all_bodies
        tools = ~self.is_grain & (body < len(table))
        moved = self.frame.field("centre")[tools, : self.dimension] - self.start_of(body[tools])
        return table.lower[body[tools]] + moved, table.upper[body[tools]] + moved

    def start_of(self, body: np.ndarray) -> np.ndarray:
        """Centres of bodies in the first output, NaN where they are not there."""
        first = self.run.grains[0]
        known, centre = first.field("body"), first.field("centre")[:, : self.dimension]
        order = np.argsort(known)
        at = order[np.minimum(np.searchsorted(known, body, sorter=order), len(order) - 1)]
        return np.where((known[at] == body)[:, None], centre[at], np.nan)
