"""The plain discrete element method of the validation suite against closed forms and conservation.

    test_dem.py CAIRN SCRATCH
"""

import importlib.util
import math
import sys

from harness import ROOT, SKIP

if importlib.util.find_spec("numpy") is None:
    print("Python lacks numpy")
    sys.exit(SKIP)

import numpy as np  # noqa: E402  after the check that it is there

sys.path.insert(0, str(ROOT / "scripts"))

from validation.closed_forms import Rigid  # noqa: E402
from validation.dem import Disks, Wall  # noqa: E402

GRAVITY = 9.81


def two_disks(restitution: float, friction: float, offset: float) -> Disks:
    """Of different size, flying at each other, `offset` from head on, and spinning."""
    disks = Disks([(0.0, 0.0), (0.35, offset)], [0.1, 0.15], 1000.0, 1e6, friction, restitution)
    disks.v[:], disks.w[:] = [(1.0, 0.2), (-0.5, 0.1)], [30.0, 20.0]
    return disks


def restitution():
    """Two disks that meet head on part at the restitution asked for."""
    for asked in (1.0, 0.8, 0.3):
        disks = two_disks(asked, 0.0, 0.0)
        disks.v[:, 1] = 0.0
        closing = disks.v[1, 0] - disks.v[0, 0]
        disks.advance(0.2)
        parting = disks.v[1, 0] - disks.v[0, 0]
        assert abs(-parting / closing - asked) < 2e-3, (asked, -parting / closing)


def conservation():
    """Momentum and angular momentum stay whatever contact does, energy stays where nothing takes it."""
    for asked, friction in ((1.0, 0.0), (1.0, 0.5), (0.5, 0.5)):
        disks = two_disks(asked, friction, 0.05)
        energy, momentum, turning = disks.energy(), disks.momentum(), disks.angular_momentum()
        disks.advance(0.3)
        assert np.abs(disks.momentum() - momentum).max() < 1e-12 * disks.mass.sum()
        assert abs(disks.angular_momentum() - turning) < 1e-12 * disks.mass.sum()
        lost = 1 - disks.energy() / energy
        assert abs(lost) < 2e-5 if friction == 0 and asked == 1 else lost > 0.01, lost


def incline():
    """A disk rolls down an incline, or slides where friction is too small for rolling, as a rigid one does."""
    angle = math.radians(30)
    for friction in (0.5, 0.1):
        wall = Wall((0.0, 0.0), (0.0, 1.0), friction)
        gravity = (GRAVITY * math.sin(angle), -GRAVITY * math.cos(angle))
        disks = Disks([(0.0, 0.1)], 0.1, 1000.0, 1e7, 0.0, 0.2, gravity, (wall,))
        disks.x[0, 1] -= disks.mass[0] * GRAVITY * math.cos(angle) / 1e7  # at rest on the wall
        rigid = Rigid(0.1, 1 / 2, GRAVITY, angle, friction)
        assert rigid.slips == (friction == 0.1)
        disks.advance(1.0)
        assert abs(disks.x[0, 0] / rigid.distance(1.0) - 1) < 2e-3, (friction, disks.x[0, 0], rigid.distance(1.0))
        assert abs(-disks.w[0] / rigid.spin_up - 1) < 5e-3, (disks.w[0], rigid.spin_up)


def at_rest():
    """A disk on two others between walls comes to rest; floor and walls carry the weight, and friction holds."""
    walls = (Wall((0.0, 0.0), (0.0, 1.0), 0.5), Wall((0.0, 0.0), (1.0, 0.0), 0.5), Wall((0.45, 0.0), (-1.0, 0.0), 0.5))
    disks = Disks([(0.1, 0.101), (0.35, 0.101), (0.225, 0.27)], 0.1, 1000.0, 1e6, 0.5, 0.5, (0.0, -GRAVITY), walls)
    start = disks.energy()
    disks.advance(3.0)
    assert disks.kinetic_energy() < 1e-9 * abs(start)
    floor = 1e6 * np.maximum(disks.radius - disks.x[:, 1], 0).sum()
    walls_up = disks.mass.sum() * GRAVITY - floor  # the rest hangs on the friction of the side walls
    assert -1e-6 < walls_up / (disks.mass.sum() * GRAVITY) < 0.5
    force, moment = disks.forces(0.0)
    assert np.abs(force).max() < 1e-4 * disks.mass[0] * GRAVITY and np.abs(moment).max() < 1e-5 * disks.mass[0] * GRAVITY


def neighbours_do_not_matter():
    """Springs along the tangent live on when neighbours are looked for again."""
    wall = Wall((0.0, 0.0), (0.0, 1.0), 0.5)
    paths = []
    for always in (False, True):
        disks = Disks([(0.0, 0.1), (0.21, 0.1), (0.1, 0.28)], 0.1, 1000.0, 1e6, 0.5, 0.5, (0.3, -GRAVITY), (wall,))
        for _ in range(200):
            disks.advance(1e-3)
            if always:
                disks.find_neighbours()
        paths.append(disks.x)
    assert np.abs(paths[0] - paths[1]).max() < 1e-9


for test in (restitution, conservation, incline, at_rest, neighbours_do_not_matter):
    test()
    print(f"{test.__name__}: ok")
