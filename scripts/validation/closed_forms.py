"""Exact solutions with which the runs are compared."""

from __future__ import annotations

import math

import numpy as np


class Rigid:
    """A rigid disk or sphere on an incline, rolling without slip as far as friction allows, from rest.

    Disk: Bardenhagen, Brackbill and Sulsky (2000), eq. 25. Sphere: Bardenhagen et al. (2001), eqs. 23 and 24.
    `inertia` is that about the centre, as a share of mass times radius squared; the angle is in radians.
    """

    def __init__(self, radius: float, inertia: float, gravity: float, angle: float, friction: float):
        self.slips = math.tan(angle) > friction * (1 + 1 / inertia)
        if self.slips:
            self.acceleration = gravity * (math.sin(angle) - friction * math.cos(angle))
            self.spin_up = friction * gravity * math.cos(angle) / (inertia * radius)
        else:
            self.acceleration = gravity * math.sin(angle) / (1 + inertia)
            self.spin_up = self.acceleration / radius

    def distance(self, time):
        return self.acceleration * time**2 / 2


class Backspin:
    """A rigid sphere of radius 1 m that spins at 5 rad/s on a plane with friction 0.5, gravity 10 m/s2: eqs. 25 and 26
    of Bardenhagen et al. (2001). It slips until 2/7 s, then rolls at 10/7 m/s."""

    slip_end, speed, spin = 2 / 7, 10 / 7, 5.0

    def distance(self, time):
        time = np.asarray(time)
        slipping = 2.5 * np.minimum(time, self.slip_end) ** 2
        return slipping + self.speed * np.maximum(time - self.slip_end, 0)

    def velocity(self, time):
        return 5.0 * np.minimum(time, self.slip_end)

    def spin_at(self, time):
        """Spin [rad/s]: slows by 12.5 rad/s2 while slipping."""
        return self.spin - 12.5 * np.minimum(time, self.slip_end)


class DroppedSphere:
    """A sphere that falls a gap onto an incline, then bounces, slips and rolls there: rigid but for its contact.

    Normal force after Hertz; friction after Mindlin, without partial slip: a spring of stiffness 8 G* a, at most mu
    times the normal force (Johnson, Contact Mechanics, sections 4.2 and 7.2). `softness` is that of both bodies
    together over that of the sphere alone: 1.1 on an incline ten times as stiff.
    """

    def __init__(self, radius: float, density: float, youngs: float, poisson: float, softness: float):
        self.radius, self.mass = radius, 4 / 3 * math.pi * radius**3 * density
        self.normal = plane_strain_modulus(youngs, poisson) / softness
        self.shear = youngs / (2 * (1 + poisson) * (2 - poisson)) / softness

    def path(self, gravity: float, angle: float, friction: float, gap: float, end: float, dt: float = 1e-4):
        """Times [s] and the way along the incline [m], from rest; the angle in radians."""
        gap_left, fall, v, w, x, drag, path = gap, 0.0, 0.0, 0.0, 0.0, 0.0, [0.0]
        for _ in range(round(end / dt)):  # semi-implicit Euler
            a = math.sqrt(self.radius * max(-gap_left, 0.0))
            push = 4 / 3 * self.normal * a**3 / self.radius
            drag = max(-friction * push, min(friction * push, drag + dt * 8 * self.shear * a * (v - self.radius * w)))
            fall += dt * (gravity * math.cos(angle) - push / self.mass)
            v += dt * (gravity * math.sin(angle) - drag / self.mass)
            w += dt * drag / (0.4 * self.mass * self.radius)
            gap_left -= dt * fall
            x += dt * v
            path.append(x)
        return dt * np.arange(len(path)), np.array(path)


def plane_strain_modulus(youngs: float, poisson: float) -> float:
    return youngs / (1 - poisson**2)


class HertzSphere:
    """An elastic sphere on a rigid plane without friction (Hertz; Johnson, Contact Mechanics, sections 4.2 and 11.4).

    `modulus` is E* = E / (1 - nu^2) [Pa].
    """

    def __init__(self, radius: float, modulus: float):
        self.radius, self.modulus = radius, modulus

    def force(self, approach):
        """[N]"""
        return 4 / 3 * self.modulus * math.sqrt(self.radius) * np.maximum(approach, 0) ** 1.5

    def approach(self, force: float) -> float:
        """[m], under a force"""
        return (0.75 * force / (self.modulus * math.sqrt(self.radius))) ** (2 / 3)

    def contact_radius(self, force):
        return (0.75 * force * self.radius / self.modulus) ** (1 / 3)

    def peak_pressure(self, force):
        return 1.5 * force / (math.pi * self.contact_radius(force) ** 2)

    def impact_time(self, mass: float, speed: float) -> float:
        return 2.868 * (mass**2 / (self.radius * self.modulus**2 * speed)) ** 0.2

    def largest_approach(self, mass: float, speed: float) -> float:
        return (15 * mass * speed**2 / (16 * self.modulus * math.sqrt(self.radius))) ** 0.4

    def impact(self, mass: float, speed: float, steps: int = 4000):
        """Times and velocities towards the plane from the first touch until the sphere parts."""
        dt = self.impact_time(mass, speed) / steps
        approach, velocity, path = 0.0, speed, [speed]
        while approach > 0 or velocity > 0:  # leapfrog in kick-drift-kick form
            velocity -= dt / 2 * self.force(approach) / mass
            approach += dt * velocity
            velocity -= dt / 2 * self.force(approach) / mass
            path.append(velocity)
        return dt * np.arange(len(path)), np.array(path)


class HertzCylinder:
    """An elastic cylinder on a rigid plane without friction, plane strain (Johnson, Contact Mechanics, section 4.2)."""

    def __init__(self, radius: float, modulus: float):
        self.radius, self.modulus = radius, modulus

    def half_width(self, load):
        """`load` in N for each metre of length."""
        return np.sqrt(4 * load * self.radius / (math.pi * self.modulus))

    def peak_pressure(self, load):
        return np.sqrt(load * self.modulus / (math.pi * self.radius))


def swing_time(times, velocities, low: float = 0.1, high: float = 0.9) -> tuple[float, float]:
    """When a velocity that changes from its first to its last value has gone through two shares of the change [s]."""
    share = (np.asarray(velocities) - velocities[0]) / (velocities[-1] - velocities[0])
    ends = []
    for level in (low, high):
        k = int(np.argmax(share >= level))
        step = (level - share[k - 1]) / (share[k] - share[k - 1])
        ends.append(float(times[k - 1] + step * (times[k] - times[k - 1])))
    return ends[0], ends[1]


def pulse_length(times, velocities) -> tuple[float, float]:
    """When the force behind a change of velocity rises above, and last falls below, half of its plateau [s].

    The force is that over a hundredth of the record, which smooths single steps; the plateau is its median over the
    middle of the change.
    """
    start, end = swing_time(times, velocities)
    grid = np.linspace(times[0], times[-1], 2000)
    window = (times[-1] - times[0]) / 200
    force = (np.interp(grid + window, times, velocities) - np.interp(grid - window, times, velocities)) / (2 * window)
    plateau = np.median(force[(grid > start) & (grid < end)])
    above = np.flatnonzero(force / plateau >= 0.5)
    found = []
    for inside, outside in ((above[0], above[0] - 1), (above[-1], above[-1] + 1)):
        step = (0.5 - force[outside] / plateau) / ((force[inside] - force[outside]) / plateau)
        found.append(float(grid[outside] + step * (grid[inside] - grid[outside])))
    return found[0], found[1]


def bar_against_wall(stress, speed: float, modulus: float, density: float, length: float, cells: int = 2000):
    """A bar in uniaxial strain that hits a rigid wall: times and mean velocities over the bar, from before the impact
    until it has left.

    `stress(stretch)` is the nominal stress of the law [Pa]. A fine Lagrangian grid, leapfrog, with von Neumann and
    Richtmyer's viscosity for the shock. Two equal bars at +-speed do the same at their common face.
    """
    dx, c = length / cells, math.sqrt(modulus / density)
    dt = 0.4 * dx / c
    x, v = np.linspace(0, length, cells + 1), np.full(cells + 1, -speed)
    mass = np.full(cells + 1, density * dx)
    mass[[0, -1]] /= 2
    v[0], held, path, times = 0.0, True, [-speed], [0.0]
    while times[-1] < 3 * length / c:
        squeeze = np.minimum(np.diff(v), 0)
        total = stress(np.diff(x) / dx) - 2.0 * density * squeeze**2 + 0.1 * density * c * squeeze
        held = held and total[0] < 0  # the wall pushes, and does not pull
        v += dt * np.diff(total, prepend=0.0, append=0.0) / mass
        if held:
            v[0] = 0.0
        x += dt * v
        path.append(float((mass * v).sum()) / (density * length))
        times.append(times[-1] + dt)
    return np.array(times), np.array(path)
