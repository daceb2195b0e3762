"""A disk on a rigid incline (Bardenhagen, Brackbill and Sulsky 2000, section 4.1) and a sphere on a deformable one
(Bardenhagen et al. 2001, section 3.1), against rigid bodies that roll, sticking or slipping.

    test_physics_rolling.py CAIRN SCRATCH [--full]

--full: the sphere at twice the resolution, instead.
"""

import concurrent.futures
import math
import sys

from harness import Program, fresh_folder
from physics import NO_PARTICLES, Check, at_time, integral, motion, near, report, run_case


class Rigid:
    """A rigid disk or sphere on an incline: rolling without slip as far as friction allows, from rest."""

    def __init__(self, radius: float, inertia: float, gravity: float, angle: float, friction: float):
        """`inertia` is that about the centre, as a share of mass times radius squared."""
        self.slips = math.tan(angle) > friction * (1 + 1 / inertia)
        if self.slips:
            self.acceleration = gravity * (math.sin(angle) - friction * math.cos(angle))
            self.spin_up = friction * gravity * math.cos(angle) / (inertia * radius)
        else:
            self.acceleration = gravity * math.sin(angle) / (1 + inertia)
            self.spin_up = self.acceleration / radius

    def checks(self, name: str, path: dict, time: float, share: float, turn: tuple) -> list[Check]:
        """Distance within a share, and turn, which lags most on coarse grids, within factors of the rigid body's."""
        distance = at_time(path, "x", time) - path["x"][0]
        turned, expected = -integral(path, "wz", time), self.spin_up * time**2 / 2
        name = f"{name}, {time:g} s"
        return [near(f"{name}: x [m]", distance, self.acceleration * time**2 / 2, share),
                Check(f"{name}: turn [rad]", turned, turn[0] * expected, turn[1] * expected, expected)]


# Friction, incline in degrees, and the error of x at 2 s that is allowed at R/2, R/4 and R/8.
DISKS = ((0.3, 60, (0.01, 0.01, 0.01)), (0.5, 30, (0.22, 0.07, 0.02)), (0.5, 60, (0.03, 0.03, 0.03)),
         (0.9, 60, (0.13, 0.03, 0.03)))
RESOLUTIONS = (2, 4, 8)  # cells across a radius
DISK_TURN = {2: (0.4, 1.1), 4: (0.75, 1.1), 8: (0.85, 1.1)}  # least and most turn, of the rigid disk's


def disk(program: Program, scratch, friction: float, degrees: int, cells: int, share: float) -> list[Check]:
    """cases/rolling_disk.toml, with the disk half a cell above the wall."""
    radius, gravity, angle, end = 0.5, 9.8, math.radians(degrees), 2.0
    rigid, cell = Rigid(radius, 1 / 2, gravity, angle, friction), radius / cells
    length = 2.5 + 1.1 * rigid.acceleration * end**2 / 2
    folder = run_case(program, "rolling_disk", scratch / f"disk_{friction}_{degrees}_{cells}", NO_PARTICLES | {
        "domain.upper": f"[{math.ceil(length / cell) * cell}, 1.5]", "domain.cell_size": cell, "time.end": end,
        "domain.gravity": f"[{gravity * math.sin(angle)}, {-gravity * math.cos(angle)}]",
        "boundary.bottom.friction": friction, "bodies.0.shape.centre": f"[0.75, {radius + cell / 2}]",
        "output.history": "{ every = 5 }"})
    name = f"disk mu {friction}, {degrees} deg, R/{cells}"
    return rigid.checks(name, motion(folder, 0), end, share, DISK_TURN[cells])


def disks(program: Program, scratch, pool) -> list[Check]:
    waiting = {(friction, degrees, cells): pool.submit(disk, program, scratch, friction, degrees, cells, share)
               for friction, degrees, shares in DISKS for cells, share in zip(RESOLUTIONS, shares)}
    done = {key: job.result() for key, job in waiting.items()}
    errors = [abs(done[0.5, 30, cells][0].value / done[0.5, 30, cells][0].expected - 1) for cells in RESOLUTIONS]
    falls = float(errors[0] > errors[1] > errors[2])
    return [check for checks in done.values() for check in checks] + [
        Check("disk mu 0.5, 30 deg: error of x falls with the cells", falls, 1.0, 1.0)]


# Friction, incline in degrees, and the error of x that is allowed.
SPHERES = ((0.495, 45, 0.05), (0.286, 60, 0.03))
SPHERE_TURN = {4: (0.7, 1.1), 8: (0.8, 1.1)}

SPHERE_CASE = """\
# A sphere rolls down a deformable plane, half of each: Bardenhagen et al. (2001), section 3.1.
[domain]
dimension = 3
lower = [0.0, 0.0, 0.0]
upper = {upper}
cell_size = {cell}
gravity = {gravity}

[time]
end = 2.0

[contact]
friction = {friction}

[materials.sphere]
model = "neo_hookean"
density = 1000.0
bulk_modulus = 6.0e6
shear_modulus = 3.0e6

[materials.plane]
model = "neo_hookean"
density = 10000.0
bulk_modulus = 6.0e7
shear_modulus = 3.0e7

[[bodies]]
shape = {{ type = "box", lower = [0.0, 0.0, 0.0], upper = {plane} }}
material = "plane"

[[bodies]]
shape = {{ type = "sphere", centre = {centre}, radius = {radius} }}
material = "sphere"

[boundary]
bottom = {{ type = "fixed" }}
left = {{ type = "symmetry" }}
right = {{ type = "symmetry" }}
back = {{ type = "symmetry" }}
front = {{ type = "symmetry" }}

[output]
history = {{ every = 5 }}
track = [1]
"""


def sphere(program: Program, scratch, friction: float, degrees: int, cells: int, share: float) -> list[Check]:
    """A quarter of a cell above the plane: from higher up it falls and bounces, and gets ahead of the rigid one."""
    radius, gravity, angle = 1.6, 10.0, math.radians(degrees)
    rigid, cell = Rigid(radius, 2 / 5, gravity, angle, friction), radius / cells
    top = 0.5 * radius
    size = (5.0 + rigid.acceleration * 2, top + 2 * radius + 1.0, 1.25 * radius)
    upper = [math.ceil(length / cell) * cell for length in size]
    name = f"sphere mu {friction}, {degrees} deg, R/{cells}"
    text = SPHERE_CASE.format(
        cell=cell, friction=friction, radius=radius, upper=upper, plane=[upper[0], top, upper[2]],
        gravity=[gravity * math.sin(angle), -gravity * math.cos(angle), 0.0],
        centre=[2.4 + 0.37 * cell, top + radius + cell / 4, 0.0])
    file = scratch / f"sphere_{degrees}_{cells}.toml"
    file.write_text(text, encoding="utf-8")
    path = motion(run_case(program, file, file.with_suffix(""), {}), 1)
    return [check for time in (1.0, 2.0) for check in rigid.checks(name, path, time, share, SPHERE_TURN[cells])]


def main() -> int:
    program, scratch, full = Program(sys.argv[1]), fresh_folder(sys.argv[2]), "--full" in sys.argv[3:]
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        waiting = [pool.submit(sphere, program, scratch, friction, degrees, 8 if full else 4, share)
                   for friction, degrees, share in SPHERES]
        checks = [] if full else disks(program, scratch, pool)
        checks += [check for job in waiting for check in job.result()]
    return report(checks)


if __name__ == "__main__":
    sys.exit(main())
