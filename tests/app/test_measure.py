"""scripts/measure: packings with known answers, and what must be conserved.

    test_measure.py CAIRN SCRATCH
"""

import importlib.util
import itertools
import json
import math
import subprocess
import sys
from pathlib import Path

from harness import PATIENCE, ROOT, SKIP, Program, expect, fresh_folder, run_tests

for package in ("numpy", "h5py", "matplotlib"):
    if importlib.util.find_spec(package) is None:
        print(f"Python lacks {package}")
        sys.exit(SKIP)

import h5py  # noqa: E402  after the check that they are there
import numpy as np  # noqa: E402

sys.path.insert(0, str(ROOT / "scripts"))

from made_up_runs import (DENSITY, R, close, padded, start_run, write_contacts, write_grains,  # noqa: E402
                          write_rows)
from measuring import coarse, collect, motion, network, pairs, stress  # noqa: E402
from measuring.snapshot import Contacts, Snapshot  # noqa: E402
from results import MissingData, Run  # noqa: E402

FORCE = 3.0  # in each contact of a lattice [N]


def lattice(folder: Path, steps: np.ndarray, cell: np.ndarray, basis: np.ndarray, count: int) -> Run:
    """Balls of radius R at the basis of `count` periodic cells a side, each pressed by FORCE along `steps`, half the
    vectors to its neighbours."""
    d = len(cell)
    places = np.stack(np.meshgrid(*[np.arange(count)] * d, indexing="ij"), -1).reshape(-1, d)
    centre, upper = (places[:, None, :] * cell + basis).reshape(-1, d), count * cell
    start_run(folder, upper, [True] * d, centre)
    write_grains(folder, 0, 1.0, centre + upper * (np.arange(len(centre)) % 3 - 1)[:, None])  # some have gone round

    def key(place: np.ndarray) -> np.ndarray:
        sixteenths = np.rint((place % upper) / R * 16).astype(int) % np.rint(upper / R * 16).astype(int)
        return np.ravel_multi_index(tuple(sixteenths.T), tuple(np.rint(upper / R * 16).astype(int)))

    order = np.argsort(key(centre))
    rows = []
    for step in steps:
        a, b = np.arange(len(centre)), order[np.searchsorted(key(centre)[order], key(centre + step))]
        sign = np.where(a < b, 1.0, -1.0)[:, None]  # a row has the lower body first
        normal = sign * step / np.linalg.norm(step)
        rows.append((np.minimum(a, b), np.maximum(a, b), (centre + step / 2) % upper, normal))
    a, b, point, normal = (np.concatenate(column) for column in zip(*rows))
    write_contacts(folder, 0, 1.0, a, b, point, normal, -FORCE * normal)
    return Run(folder)


def test_lattices(_cairn: Program, here: Path):
    """Coordination, fabric, density and stress of square, triangular and cubic lattices in closed form."""
    root = math.sqrt(3)
    square = lattice(here / "square", 2 * R * np.eye(2), np.full(2, 2 * R), np.zeros((1, 2)) + R, 6)
    triangle = lattice(here / "triangle", 2 * R * np.array([[1, 0], [0.5, root / 2], [-0.5, root / 2]]),
                       np.array([2 * R, 2 * root * R]), np.array([[R, R], [2 * R, R + root * R]]), 6)
    cubic = lattice(here / "cubic", 2 * R * np.eye(3), np.full(3, 2 * R), np.zeros((1, 3)) + R, 4)
    known = {"square": (square, 4, math.pi / 4, FORCE / (2 * R)),
             "triangle": (triangle, 6, math.pi / (2 * root), FORCE * root / (2 * R)),
             "cubic": (cubic, 6, math.pi / 6, FORCE / (4 * R**2))}
    for name, (run, neighbours, fraction, pressure) in known.items():
        found, missing = collect.measures(Snapshot(run, 0), collect.Options())
        expect(set(missing) == {"rotation"}, f"{name}: {missing}")
        expect(found["coordination"] == neighbours == found["coordination_without_rattlers"], f"{name}: {found}")
        expect(found["rattlers"] == 0, f"{name}: {found}")
        close(found["packing_fraction"], fraction, what=name)
        axes = "xyz"[: run.dimension]
        for i, j in itertools.product(axes, repeat=2):
            close(found[f"contact_stress_{i}{j}"] / pressure + 1, 1.0 - (i == j), what=name)
            if i <= j:
                close(found[f"fabric_{i}{j}"] + 1, 1 + (i == j) / run.dimension, what=name)
                close(found[f"normal_force_fabric_{i}{j}"] + 1, 1 + (i == j) / run.dimension, what=name)
        expect(found["mobilised_friction"] < 1e-12 and found["fabric_anisotropy"] < 1e-12, f"{name}: {found}")
        close(found["mean_normal_force"], FORCE, what=name)
        # Each grain alone: the same forces over its own volume.
        table = collect.grain_table(Snapshot(run, 0), collect.Options())
        close(table["contact_stress_xx"], np.full(len(table["body"]), -pressure / fraction), what=name)
        expect(table["unbalance"].max() < 1e-12, f"{name}: a grain is out of balance")
        # The first shells of g(r).
        pair = collect.pair_table(Snapshot(run, 0), collect.Options(bins=400))
        first = pair["r"][np.flatnonzero(pair["g"])[0]]
        expect(abs(first - 2 * R) < pair["r"][1] - pair["r"][0], f"{name}: first neighbours at {first}")
    # The command says the same.
    done = subprocess.run([ROOT / "scripts" / "measure", here / "square", "-o", here / "square.json"], capture_output=True,
                          text=True, check=False)
    expect(done.returncode == 0, done.stderr)
    close(json.loads((here / "square.json").read_text())["packing_fraction"], math.pi / 4)


def network_of(folder: Path, centre, a, b, force=None) -> Snapshot:
    """Disks that touch as said, pressed along their centres where no force is given."""
    centre, a, b = np.asarray(centre, float), np.asarray(a), np.asarray(b)
    start_run(folder, [10.0, 10.0], [False, False], centre)
    write_grains(folder, 0, 1.0, centre)
    way = centre[b] - centre[a]
    normal = way / np.linalg.norm(way, axis=1)[:, None]
    write_contacts(folder, 0, 1.0, a, b, (centre[a] + centre[b]) / 2, normal, -normal if force is None else force)
    return Snapshot(Run(folder), 0)


def test_rattlers_are_taken_away_one_after_the_other(_cairn: Program, here: Path):
    """A ring of four with a tail of three and a loose disk: the tail goes from its end, the ring stays."""
    centre = [[1, 1], [2, 1], [2, 2], [1, 2], [3, 3], [4, 4], [5, 5], [8, 8]]
    snapshot = network_of(here / "tail", centre, [0, 1, 2, 0, 0, 1, 2, 4, 5], [1, 2, 3, 3, 2, 3, 4, 5, 6])
    found = network.coordination(snapshot.contacts, 8, 3)
    expect(list(np.flatnonzero(found.is_rattler)) == [4, 5, 6, 7], found)
    close(found.mean, 2 * 9 / 8), close(found.without_rattlers, 3.0)
    close(network.coordination(snapshot.contacts, 8, 2).without_rattlers, 3.0)
    expect(list(network.coordination(snapshot.contacts, 8, 1).per_grain) == [3, 3, 4, 3, 2, 2, 1, 0], found)


def test_fabric_of_a_known_distribution(_cairn: Program, here: Path):
    """Contacts, normal and tangential forces that vary like 1 + a cos 2 (theta - theta_c): the amplitudes come back, and
    the ratio of the stresses is that of Rothenburg and Bathurst."""
    a, an, at, turn, count = 0.3, 0.2, 0.1, math.radians(25), 200_000
    theta = np.linspace(0, 2 * math.pi, 2_000_001)
    whole = np.cumsum(1 + a * np.cos(2 * (theta - turn)))
    theta = np.interp((np.arange(count) + 0.5) / count, whole / whole[-1], theta)
    n = np.column_stack([np.cos(theta), np.sin(theta)])
    t = np.column_stack([-np.sin(theta), np.cos(theta)])
    push, drag = 1 + an * np.cos(2 * (theta - turn)), -at * np.sin(2 * (theta - turn))
    zero = np.zeros(count, int)
    contacts = Contacts(zero, zero, zero, n, n, -push[:, None] * n - drag[:, None] * t, np.zeros((count, 2, 2)))
    F = network.fabric(contacts)
    close(network.anisotropy(F), a, 1e-4), close(network.direction(F), 25.0, 1e-4)
    close(contacts.normal_force, push), close(np.linalg.norm(contacts.tangential_force, axis=1), np.abs(drag), 1e-9)
    N, T = network.force_fabrics(contacts)
    moment = np.einsum("ci,cj->ij", contacts.force, contacts.normal)  # branches of one length
    p, tau, mu = stress.invariants(moment)
    close(moment, -(N + T) * contacts.normal_force.mean() * count, 2e-3)
    close(mu, (a + an + at) / 2 / (1 + a * an / 2), 1e-3)
    share = network.mobilised(contacts, np.full(count, 0.5))
    close(share, np.abs(drag) / (0.5 * push), 1e-9)


def test_densities_have_integral_one(_cairn: Program, _here: Path):
    values = np.random.default_rng(1).exponential(1.0, 100_000)
    x, p = network.density(values, 20.0, 200)
    close(p.sum() * (x[1] - x[0]), (values <= 20).mean())
    expect(np.abs(p - np.exp(-x))[:40].max() < 0.03, "an exponential distribution")


def test_friction_by_pairs_of_materials(_cairn: Program, here: Path):
    """Each contact has its pair's friction; sliding is counted against it."""
    more = """[materials.ice]
model = "neo_hookean"
density = 900.0
youngs_modulus = 1.0e6
poissons_ratio = 0.3
[[contact.pair]]
materials = ["rubber", "ice"]
friction = 0.1
[[contact.pair]]
materials = ["ice", "ice"]
law = "frictionless"
"""
    centre = np.array([[1.0, 1.0], [2.0, 1.0], [3.0, 1.0], [4.0, 1.0]])
    start_run(here / "run", [10, 10], [False, False], centre, more)
    write_grains(here / "run", 0, 1.0, centre)
    with h5py.File(here / "run" / "grains_000000.h5", "r+") as file:
        file["VTKHDF/PointData/material"][...] = [0, 0, 1, 1]
    normal = np.tile([1.0, 0.0], (3, 1))
    force = np.array([[-1.0, 0.2], [-1.0, 0.1], [-1.0, 0.0]])
    write_contacts(here / "run", 0, 1.0, [0, 1, 2], [1, 2, 3], centre[:3] + [0.5, 0], normal, force)
    snapshot = Snapshot(Run(here / "run"), 0)
    friction = network.frictions(snapshot.run, snapshot)
    close(friction, np.array([0.5, 0.1, 0.0]))
    close(network.mobilised(snapshot.contacts, friction), np.array([0.4, 1.0]))


def random_run(folder: Path, d: int, periodic: bool, count: int = 60) -> Run:
    """Grains and contacts without sense in a box, some of the contacts with a wall and a tool."""
    random, upper = np.random.default_rng(d), np.array([1.0, 1.3, 0.8])[:d]
    centre = random.uniform(0, 1, (count, d)) * upper
    start_run(folder, upper, [periodic] * d, centre)
    write_grains(folder, 0, 0.0, centre)
    write_grains(folder, 1, 1.0, centre, random.uniform(0.02, 0.06, count), random.normal(size=(count, d)),
                 random.normal(size=(count, 3)), random.normal(size=(count, d, d)))
    a, b = np.arange(count - 1), np.arange(1, count)
    b[::7] = -1 - (a[::7] % 4)  # walls
    normal = random.normal(size=(count - 1, d))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    point = np.clip(centre[a] + 0.05 * normal, 0, upper)
    write_contacts(folder, 1, 1.0, a, b, point, normal, random.normal(size=(count - 1, d)),
                   random.normal(size=(count - 1, d, d)))
    return Run(folder)


def test_coarse_graining_conserves(_cairn: Program, here: Path):
    """Mass, momentum and volume on the grid are the grains', and the stress sum f l, to 1e-12, at walls and across
    periodic faces, in 2D and 3D; so are the profile's."""
    for d, periodic in itertools.product((2, 3), (False, True)):
        run = random_run(here / f"run{d}{periodic}", d, periodic)
        snapshot = Snapshot(run, 1)
        grains = snapshot.grains
        for radius in (0.11, 0.25):
            grid = coarse.grid_of(snapshot, (run.lower, run.upper), radius, 0.09)
            found, volume = coarse.fields(snapshot, grid), grid.volume
            axes = tuple(range(d))
            close(found.density.sum() * volume, grains.mass.sum())
            close(found.momentum.sum(axis=axes) * volume, grains.mass @ grains.velocity, 1e-12 * 100)
            close(found.fraction.sum() * volume, grains.volume.sum())
            close(found.contact_stress.sum(axis=axes) * volume, stress.contact_moment(snapshot), 1e-12)
            flux = np.einsum("g,gi,gj->ij", grains.mass, grains.velocity, grains.velocity)
            mean = np.nan_to_num(found.velocity)
            carried = np.einsum("...i,...j->...ij", found.momentum, mean)
            close((carried - found.kinetic_stress).sum(axis=axes) * volume, flux, 1e-12)
            expect(np.nanmin(found.temperature) > -1e-12, "a temperature below zero")
            slices = coarse.profile(found, 1)
            area = np.prod(run.upper - run.lower) / grid.cells[1]
            close(slices["density"].sum() * area, grains.mass.sum())


def test_coarse_graining_of_a_stated_flow(_cairn: Program, here: Path):
    """A dense lattice of tiny grains in simple shear: density, velocity and no temperature beyond that of the shear
    across the kernel; the kernel is Lucy's."""
    side = (np.arange(80) + 0.5) / 80
    centre = np.stack(np.meshgrid(side, side, indexing="ij"), -1).reshape(-1, 2)
    start_run(here / "run", [1, 1], [False, False], centre)
    velocity = np.column_stack([2.0 * centre[:, 1], 0 * side.repeat(80)])
    write_grains(here / "run", 0, 1.0, centre, 0.5 / 80, velocity)
    snapshot = Snapshot(Run(here / "run"), 0)
    found = coarse.fields(snapshot, coarse.grid_of(snapshot, snapshot.box, 0.15, 0.05))
    inner = (slice(4, -4),) * 2
    close(found.density[inner], np.full_like(found.density[inner], DENSITY * math.pi / 4), 0.01)
    expect(found.contact_stress is None, "no contact file")
    y = found.grid.middles(1)[None, 4:-4]
    expect(np.abs(found.velocity[inner][..., 0] - 2 * y).max() < 1e-3, "the velocity")
    # The mean of y^2 over Lucy's kernel in 2D is 5 c^2 / 56.
    expect(abs(found.temperature[inner].mean() / (4 * 0.15**2 * 5 / 56 / 2) - 1) < 0.02, found.temperature[inner].mean())


def test_walls_that_move_bound_the_box(_cairn: Program, here: Path):
    """Where they stand is in forces.csv; that it is missing is said. Gravity and drives may follow formulas."""
    more = """[boundary]
left = { type = "wall" }
top = { type = "wall", position = 1.5, servo = { pressure = 1.0 } }
[[drive]]
ids = [1]
velocity = ["sin(t)", 0.0]
"""
    centre = np.array([[0.5, 0.5], [1.0, 0.5]])
    start_run(here / "run", [2, 2], [False, False], centre, more)
    case = here / "run" / "case.toml"
    case.write_text(case.read_text().replace("[contact]", "gravity = [[0.0, 0.0, 0.0], [1.0, 0.0, -9.81]]\n[contact]", 1))
    write_grains(here / "run", 0, 1.0, centre)
    snapshot = Snapshot(Run(here / "run"), 0)
    expect(list(snapshot.grains.body) == [0], f"the driven one is a tool: {snapshot.grains.body}")
    try:
        expect(not snapshot.box, "no forces.csv")
    except MissingData as reason:
        expect("output.forces" in str(reason), reason)
    rows = ["step,time,name,x,y", "0,0.0,top,1.0,1.5", "1,2.0,top,1.0,1.1", ""]
    (here / "run" / "forces.csv").write_text("\n".join(rows))
    lower, upper = Snapshot(Run(here / "run"), 0).box
    close(np.array([*lower, *upper]), np.array([0, 0, 0.95, 1.3]), 1e-12)


def test_pairs_against_a_naive_search(_cairn: Program, _here: Path):
    random = np.random.default_rng(3)
    for d, periodic in itertools.product((2, 3), (False, True)):
        place, reach = random.uniform(0, 1, (150, d)), 0.23
        period = np.full(d, 1.0 if periodic else 0.0)
        i, j, distance = pairs.close_pairs(place, reach, period)
        way = place[None] - place[:, None]
        way -= np.rint(way) if periodic else 0.0
        naive = np.linalg.norm(way, axis=2)
        near = (naive < reach) & ~np.eye(150, dtype=bool)
        expect(len(i) == near.sum() and len(set(zip(i, j))) == len(i), f"{len(i)} pairs of {near.sum()}")
        expect(near[i, j].all() and np.allclose(distance, naive[i, j]), "the distances")
        many = random.uniform(0, 1, (3000, d))
        _, g = pairs.pair_correlation(many, (np.zeros(d), np.ones(d)), np.full(d, periodic), 0.2, 4)
        expect(np.abs(g[1:] - 1).max() < 0.05, f"a gas: {g}")


def test_strain_flow_and_temperature(_cairn: Program, here: Path):
    """Grains that move affinely, with a rest that is known."""
    random = np.random.default_rng(5)
    for d in (2, 3):
        centre = random.uniform(0, 1, (500, d))
        F = np.eye(d) + random.uniform(-0.2, 0.2, (d, d))
        L = random.normal(size=(d, d))
        rest = random.normal(size=(500, d)) * 0.01
        arm = np.hstack([np.ones((500, 1)), centre])
        rest -= arm @ np.linalg.lstsq(arm, rest, rcond=None)[0]  # what no affine motion holds
        folder = here / str(d)
        start_run(folder, [2.0] * d, [False] * d, centre)
        write_grains(folder, 0, 0.0, centre)
        write_grains(folder, 1, 1.0, centre @ F.T + rest, velocity=centre @ L.T + rest)
        snapshot = Snapshot(Run(folder), 1)
        found = motion.strain(Snapshot(snapshot.run, 0).grains, snapshot.grains)
        close(found.gradient, F, 1e-10)
        values, vectors = np.linalg.eigh(F @ F.T)
        close(found.hencky, vectors @ np.diag(np.log(values) / 2) @ vectors.T, 1e-10)
        close(np.trace(found.hencky), math.log(np.linalg.det(F)), 1e-9)
        close(found.non_affine, (rest**2).sum(axis=1).mean(), 1e-9)
        # The velocity is affine in the first place only where F is 1; fit it there.
        start = Snapshot(snapshot.run, 0).grains
        start.velocity = centre @ L.T + rest
        flow = motion.flow(start)
        close(flow.gradient, L, 1e-10)
        close(motion.temperature(start, flow.fluctuation), (rest**2).sum(axis=1).mean() / d, 1e-9)
    shear = np.array([[0.0, 3.0], [0.0, 0.0]])
    close(motion.shear_rate(shear), 3.0)
    close(motion.inertial_number(3.0, 1e4, start), 3.0 * 2 * R * math.sqrt(DENSITY / 1e4))


def test_shapes(_cairn: Program, _here: Path):
    """Ellipses and ellipsoids of known axes, a square, and a turned one."""
    turn = np.array([[math.cos(0.4), -math.sin(0.4)], [math.sin(0.4), math.cos(0.4)]])
    ellipse = turn @ np.diag([4.0, 1.0]) @ turn.T / 4  # axes 2 and 1
    square = np.eye(2) / 12
    close(motion.aspect(np.array([ellipse, square])), np.array([0.5, 1.0]))
    close(motion.circularity(np.array([2 * math.pi, 1.0]), np.array([ellipse, square])),
          np.array([0.8, 1 / (2 * math.pi / 6)]))
    ball = np.eye(3) / 5
    close(motion.circularity(np.array([4 / 3 * math.pi]), ball[None]), np.array([1.0]))
    expect(motion.circularity(np.array([1.0]), np.eye(3)[None] / 12)[0] < 0.98, "a cube")


def test_rotations(_cairn: Program, here: Path):
    """Bodies that turned and were stretched, in 2D and 3D, by up to half a turn; across a periodic face."""
    random = np.random.default_rng(8)
    for d in (2, 3):
        side = np.arange(-4, 5)
        ball = np.stack(np.meshgrid(*[side] * d, indexing="ij"), -1).reshape(-1, d) * R / 4.5
        ball = ball[np.linalg.norm(ball, axis=1) < R]
        vectors = random.normal(size=(5, 3)) if d == 3 else np.outer([0.1, -0.7, 2.5, 3.1, 0.0], [0, 0, 1])
        vectors[4] = [0, 0, math.pi - 1e-9] if d == 3 else 0
        centre, first, later = np.zeros((5, d)), [], []
        for k, vector in enumerate(vectors):
            centre[k] = 0.2 + 0.15 * k
            angle = np.linalg.norm(vector)
            K = np.cross(np.eye(3), vector / max(angle, 1e-300))
            turn = (np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * K @ K)[:d, :d]
            stretch = np.eye(d) + 0.1 * np.diag(np.arange(d))
            first.append(centre[k] + ball), later.append(centre[k] + 0.3 + ball @ stretch @ turn.T)
        body, upper = np.repeat(np.arange(5), len(ball)), np.ones(d)
        start_run(here / str(d), upper, [True] * d, centre)
        for number, (time, place) in enumerate(((0.0, first), (1.0, later))):
            place = np.concatenate(place)
            order = random.permutation(len(place))
            write_grains(here / str(d), number, time, centre)
            write_rows(here / str(d) / f"particles_{number:06d}.vtkhdf", time, (place % 1.0)[order], {
                "body": body[order], "id": order, "mass": np.ones(len(place)),
                "image": padded(np.floor(place))[order].astype(np.int32)})
        run = Run(here / str(d))
        close(motion.rotations(run, Snapshot(run, 1)), vectors, 1e-7)


def measure(*arguments) -> subprocess.CompletedProcess:
    return subprocess.run([ROOT / "scripts" / "measure", *map(str, arguments)], capture_output=True, text=True,
                          timeout=300 * PATIENCE, check=False)


def test_what_is_missing_is_named(_cairn: Program, here: Path):
    """One line and exit code 2: the output to ask for, not a trace."""
    run = random_run(here / "run", 2, False)
    for words, said in ((("--table", "contacts", "--at", 0), "there are no contacts at 0 s"),
                        (("--only", "rotation"), "see output.particles"), (("--box", 1, 2, 3), "--box takes 4 numbers"),
                        (("--across", "z"), "two dimensions"), (("--bins", 0), "--bins must be above 0"),
                        (("--table", "fields", "--radius", "0.1", "--cell", "0.5"), "at least half a cell's diagonal"),
                        (("-o", "table.txt"), "must end in .csv or .json")):
        done = measure(run.folder, *words)
        expect(done.returncode == 2 and said in done.stderr and len(done.stderr.splitlines()) == 1,
               f"{words}: {done.returncode} {done.stderr}")
    for name, said in (("contacts_000001.h5", "see output.contacts"), ("grains_*.h5", "see output.grains"),
                       ("case.toml", "no case.toml")):
        for path in run.folder.glob(name):
            path.unlink()
        done = measure(run.folder, "--only", "coordination")
        expect(done.returncode == 2 and said in done.stderr, f"{name}: {done.returncode} {done.stderr}")
    (here / "damaged").mkdir()
    (here / "damaged" / "case.toml").write_text("= = =")
    expect(measure(here / "damaged").returncode == 2, "a damaged case")


def test_many_grains(_cairn: Program, here: Path):
    """A hundred thousand grains are measured in seconds, every table of them."""
    run = lattice(here / "run", 2 * R * np.eye(2), np.full(2, 2 * R), np.zeros((1, 2)) + R, 316)
    snapshot = Snapshot(run, 0)
    found, _ = collect.measures(snapshot, collect.Options())
    close(found["packing_fraction"], math.pi / 4, 1e-9), expect(found["coordination"] == 4, found)
    for name, table in collect.TABLES.items():
        if name != "fields":  # the profile needs them
            expect(len(table(snapshot, collect.Options(radius=8 * R))) > 2, name)


def main() -> int:
    return run_tests(globals(), Program(sys.argv[1]), fresh_folder(sys.argv[2]))


if __name__ == "__main__":
    sys.exit(main())
