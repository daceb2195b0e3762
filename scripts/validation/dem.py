"""A plain discrete element method of disks: what grains do that are round, nearly rigid, and touch at points.

Springs and dashpots along the normal, springs with Coulomb's limit along the tangent (Cundall and Strack, Geotechnique
29, 1979, 47-65; Luding, Granular Matter 10, 2008, 235-246), velocity Verlet. Nothing resists rolling. A contact has the
same stiffness whatever touches; its dashpot gives a pair of disks the restitution asked for. Only numpy is needed.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np

TANGENTIAL = 0.8  # stiffness along the tangent over that along the normal
STEPS_A_CONTACT = 40  # of time, over the duration of a collision of the lightest disks
SKIN = 0.25  # neighbours are looked for so many mean radii beyond touching


@dataclasses.dataclass(frozen=True)
class Wall:
    """A rigid half-plane behind `point`; the normal points to the disks."""

    point: tuple[float, float]
    normal: tuple[float, float]
    friction: float = 0.0


@dataclasses.dataclass
class Touching:
    """Candidates for contact, `first` disk and `second` disk or, from the number of disks on, wall; ordered by key."""

    first: np.ndarray
    second: np.ndarray
    key: np.ndarray
    spring: np.ndarray  # along the tangent [m]


def damping_for(restitution: float) -> float:
    """The dashpot, as a share of the critical one, with which two disks part at this share of their closing speed where
    contact never pulls (Schwager and Poeschel, Granular Matter 9, 2007, 465-469, eq. 18)."""
    def parting(share: float) -> float:
        turn = math.sqrt(1 - share**2)  # frequency over that without dashpot
        return math.exp(-share / turn * (math.pi - math.atan2(2 * share * turn, 1 - 2 * share**2)))

    low, high = 0.0, 0.9999
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if parting(middle) > restitution else (low, middle)
    return low


class Disks:
    """Disks of one material in a plane, with walls; per metre of thickness.

    `stiffness` is that of a contact [N/m], `restitution` that of two disks, `gravity` a vector [m/s2].
    """

    def __init__(self, position, radius, density: float, stiffness: float, friction: float = 0.0,
                 restitution: float = 1.0, gravity=(0.0, 0.0), walls: tuple[Wall, ...] = ()):
        self.x = np.array(position, float)
        self.radius = np.broadcast_to(np.asarray(radius, float), len(self.x)).copy()
        self.v, self.w = np.zeros_like(self.x), np.zeros(len(self.x))
        self.mass = density * math.pi * self.radius**2
        self.inertia = self.mass * self.radius**2 / 2
        self.stiffness, self.friction, self.gravity = stiffness, friction, np.array(gravity, float)
        self.damping = damping_for(restitution)
        self.set_walls(walls)
        self.dt = math.pi * math.sqrt(self.mass.min() / 2 / stiffness) / STEPS_A_CONTACT
        self.time = 0.0

    def set_walls(self, walls: tuple[Wall, ...]) -> None:
        self.walls = walls
        self.wall_point = np.array([wall.point for wall in walls], float).reshape(-1, 2)
        normals = np.array([wall.normal for wall in walls], float).reshape(-1, 2)
        self.wall_normal = normals / np.hypot(*normals.T)[:, None] if len(walls) else normals
        self.touching = None

    def find_neighbours(self) -> None:
        """Pairs and walls that can touch before some disk has moved half the skin; springs of those known are kept."""
        count, skin = len(self.x), SKIN * self.radius.mean()
        self.sought_at = self.x.copy()
        first, second = np.triu_indices(count, 1)
        near = np.hypot(*(self.x[first] - self.x[second]).T) < self.radius[first] + self.radius[second] + skin
        first, second = first[near], second[near]
        for k, (point, normal) in enumerate(zip(self.wall_point, self.wall_normal)):
            at_wall = np.flatnonzero((self.x - point) @ normal < self.radius + skin)
            first = np.concatenate((first, at_wall))
            second = np.concatenate((second, np.full(len(at_wall), count + k)))
        key = first * (count + len(self.walls)) + second
        order = np.argsort(key)
        found = Touching(first[order], second[order], key[order], np.zeros(len(key)))
        if self.touching is not None:
            _, new, old = np.intersect1d(found.key, self.touching.key, assume_unique=True, return_indices=True)
            found.spring[new] = self.touching.spring[old]
        self.touching = found
        self.of_pair = found.second < count
        # The other body: a disk, or a wall of infinite mass whose radius is 0 and which stays.
        self.other = np.where(self.of_pair, found.second, 0)
        self.wall = np.where(self.of_pair, 0, found.second - count)
        wall_friction = np.array([wall.friction for wall in self.walls] or [0.0])
        self.limit = np.where(self.of_pair, self.friction, wall_friction[self.wall])
        inverse = 1 / self.mass[found.first] + np.where(self.of_pair, 1 / self.mass[self.other], 0.0)
        self.dashpot = 2 * self.damping * np.sqrt(self.stiffness / inverse)

    def contacts(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Of all candidates: the unit normal from the second body to the first, the overlap [m], and the arms from the
        two centres to the contact [m], the second of which is zero for a wall."""
        t, pair = self.touching, self.of_pair
        arm = self.x[t.first] - self.x[self.other]
        distance = np.hypot(*arm.T)
        normal = arm / np.where(pair, distance, 1.0)[:, None]
        if len(self.walls):
            height = ((self.x[t.first] - self.wall_point[self.wall]) * self.wall_normal[self.wall]).sum(1)
            normal = np.where(pair[:, None], normal, self.wall_normal[self.wall])
            distance = np.where(pair, distance, height)
        other_radius = np.where(pair, self.radius[self.other], 0.0)
        overlap = self.radius[t.first] + other_radius - distance
        other_arm = other_radius - np.where(pair, overlap / 2, 0.0)
        return normal, overlap, distance - other_arm, other_arm

    def forces(self, dt: float) -> tuple[np.ndarray, np.ndarray]:
        """Force on each disk [N] and its moment [N m]; springs along the tangent go on by `dt`."""
        t, pair, count = self.touching, self.of_pair, len(self.x)
        normal, overlap, arm, other_arm = self.contacts()
        tangent = np.stack((-normal[:, 1], normal[:, 0]), 1)
        relative = self.v[t.first] - np.where(pair[:, None], self.v[self.other], 0.0)
        turning = arm * self.w[t.first] + other_arm * np.where(pair, self.w[self.other], 0.0)
        slip = (relative * tangent).sum(1) - turning
        push = np.maximum(self.stiffness * overlap - self.dashpot * (relative * normal).sum(1), 0.0)
        push[overlap <= 0] = 0.0
        k, c = TANGENTIAL * self.stiffness, math.sqrt(TANGENTIAL) * self.dashpot
        t.spring[overlap <= 0] = 0.0
        t.spring += np.where(overlap > 0, dt * slip, 0.0)
        drag = -k * t.spring - c * slip
        most = self.limit * push
        slides = np.abs(drag) > most
        drag = np.where(slides, np.sign(drag) * most, drag)
        t.spring = np.where(slides, np.clip(-(drag + c * slip) / k, -most / k, most / k), t.spring)
        force = push[:, None] * normal + drag[:, None] * tangent
        total = self.mass[:, None] * self.gravity
        moment = -np.bincount(t.first, arm * drag, count)
        moment -= np.bincount(self.other, other_arm * np.where(pair, drag, 0.0), count)
        for d in range(2):
            total[:, d] += np.bincount(t.first, force[:, d], count)
            total[:, d] -= np.bincount(self.other, np.where(pair, force[:, d], 0.0), count)
        return total, moment

    def advance(self, duration: float) -> None:
        """Goes on for so long [s], in equal steps of at most `dt`."""
        steps = max(1, math.ceil(duration / self.dt - 1e-9))
        dt = duration / steps
        if self.touching is None:
            self.find_neighbours()
        force, moment = self.forces(0.0)
        for _ in range(steps):
            self.v += dt / 2 * force / self.mass[:, None]
            self.w += dt / 2 * moment / self.inertia
            self.x += dt * self.v
            if np.abs(self.x - self.sought_at).max() > SKIN * self.radius.mean() / 4:
                self.find_neighbours()
            force, moment = self.forces(dt)
            self.v += dt / 2 * force / self.mass[:, None]
            self.w += dt / 2 * moment / self.inertia
        self.time += duration

    def kinetic_energy(self) -> float:
        """[J]"""
        return float((self.mass * (self.v**2).sum(1) + self.inertia * self.w**2).sum() / 2)

    def energy(self) -> float:
        """With that of the springs and of gravity [J]."""
        if self.touching is None:
            self.find_neighbours()
        overlap = np.maximum(self.contacts()[1], 0.0)
        springs = self.stiffness * (overlap**2 + TANGENTIAL * self.touching.spring**2)
        return self.kinetic_energy() + float(springs.sum() / 2 - (self.mass * (self.x @ self.gravity)).sum())

    def momentum(self) -> np.ndarray:
        return self.mass @ self.v

    def angular_momentum(self) -> float:
        """About the origin."""
        turned = self.x[:, 0] * self.v[:, 1] - self.x[:, 1] * self.v[:, 0]
        return float((self.mass * turned + self.inertia * self.w).sum())
