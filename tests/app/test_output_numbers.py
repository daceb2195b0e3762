"""Every number of every result file against another way to compute it: from other files, from the case, and from the
balance of momentum for the forces.

    test_output_numbers.py CAIRN SCRATCH
"""

import json
import sys
from pathlib import Path

from harness import Program, fresh_folder, load_compare_runs, sets

load_compare_runs()  # ends the test as skipped where packages are missing
import h5py  # noqa: E402
import numpy as np  # noqa: E402

SHEAR, BULK, DENSITY = 5.0e3, 9.0e3, (1000.0, 1300.0, 900.0)
MODELS = ('model = "neo_hookean"', 'model = "von_mises", yield_stress = 60.0, hardening_modulus = 30.0',
          'model = "hypoelastic"')
FIELDS = ["velocity", "stress", "body", "id", "volume", "mass", "deformation_gradient", "plastic_strain", "image",
          "spin", "stress_work", "plastic_work"]
STATES = {0: [], 1: ["plastic_strain", "stress_work", "plastic_work"], 2: ["stress_work"]}  # of each material
GRAVITY = {2: [0.3, -0.8, 0.0], 3: [0.3, -0.8, 0.4]}
ROUND_OFF = 1e-11


def case(dimension: int, gravity: bool) -> str:
    """Three balls in a row that meet, one of them across a periodic boundary: each presses two others."""
    kind, z = ("disk", "") if dimension == 2 else ("sphere", ", 0.5")
    length = lambda v: "[" + ", ".join(map(str, v[:dimension])) + "]"  # noqa: E731
    cells = [40, 40] if dimension == 2 else [24, 20, 20]
    text = f"""\
domain = {{ dimension = {dimension}, upper = {length([1.0] * 3)}, cells = {cells}, periodic = {["false"] * 3}, \
gravity = {length(GRAVITY[dimension] if gravity else [0.0] * 3)}, patch_cells = 8 }}
time = {{ steps = 120 }}
solver = {{ spin = false }}
contact = {{ friction = 0.4 }}
output = {{ particles = {{ every = 20, fields = {json.dumps(FIELDS)} }}, grains = {{ every = 20 }}, \
contacts = {{ every = 20 }}, checkpoint = {{ every = 20, keep = 99 }}, history = {{ every = 20 }}, track = [0, 1, 2] }}
""".replace(str(["false"] * 3), str(["true", "false", "false"][:dimension]).replace("'", ""))
    for i, (model, density) in enumerate(zip(MODELS, DENSITY)):
        text += f"materials.m{i} = {{ {model}, density = {density}, shear_modulus = {SHEAR}, bulk_modulus = {BULK} }}\n"
    for i, (x, y, r, v) in enumerate(((0.17, 0.48, 0.15, [2.0, 0.3, 0.1]), (0.49, 0.53, 0.16, [-0.4, -0.2, 0.0]),
                                      (0.83, 0.5, 0.165, [-2.0, 0.1, -0.2]))):
        text += (f'[[bodies]]\nshape = {{ type = "{kind}", centre = [{x}, {y}{z}], radius = {r} }}\n'
                 f'material = "m{i}"\nvelocity = {length(v)}\n')
    return text


class Check:
    """Compares numbers, and notes what was compared."""

    def __init__(self, name: str):
        self.name, self.problems, self.compared = name, [], set()

    def same(self, what: str, found, expected, scale=None, tolerance=ROUND_OFF):
        found, expected = np.asarray(found, float), np.asarray(expected, float)
        self.compared.add(what)
        if found.shape != expected.shape:
            self.problems.append(f"{self.name}: {what}: shapes {found.shape} and {expected.shape}")
            return
        size = max(np.abs(expected).max(initial=0), np.abs(found).max(initial=0)) if scale is None else scale
        error = np.abs(found - expected).max(initial=0)
        if not error <= tolerance * max(size, 1e-300):
            self.problems.append(f"{self.name}: {what}: off by {error:.3g} of {size:.3g}")


def table(file: Path) -> dict:
    with h5py.File(file) as f:
        return {name: f[name][()] for name in f if isinstance(f[name], h5py.Dataset)} | dict(f.attrs)


def csv(file: Path) -> dict:
    values = np.genfromtxt(file, delimiter=",", names=True)
    return {name: values[name] for name in values.dtype.names}


def full_gradient(rows: np.ndarray, dimension: int) -> np.ndarray:
    """F (N x 3 x 3) from the columns of a checkpoint; in 2D xx xy yx yy zz."""
    if dimension == 3:
        return rows.reshape(-1, 3, 3)
    F = np.zeros((len(rows), 3, 3))
    F[:, 0, 0], F[:, 0, 1], F[:, 1, 0], F[:, 1, 1], F[:, 2, 2] = rows.T
    return F


def padded(rows: np.ndarray, width: int) -> np.ndarray:
    return np.hstack([rows, np.zeros((len(rows), width - rows.shape[1]))])


def check_particles(check: Check, points: dict, kept: dict, dimension: int):
    """Against the checkpoint of the same step, which has its own writer, and the case."""
    order, other = np.argsort(points["id"]), np.argsort(kept["id"])
    body = np.repeat(kept["piece_body"], kept["piece_points"])[other]
    F = full_gradient(kept["deformation_gradient"], dimension)[other]
    at = {name: values[order] for name, values in points.items() if np.ndim(values) and len(values) == len(order)}
    check.same("id", at["id"], kept["id"][other])
    check.same("body", at["body"], body)
    for name in ("position", "velocity", "image"):
        check.same(name, at[name], padded(kept[name], 3)[other])
    stress = kept["stress"][other]
    check.same("stress", at["stress"], padded(stress, 6))  # 2D: xx yy zz xy
    check.same("deformation_gradient", at["deformation_gradient"], F.reshape(-1, 9))
    check.same("volume", at["volume"], kept["initial_volume"][other] * np.linalg.det(F))
    check.same("mass", at["mass"], kept["initial_volume"][other] * np.array(DENSITY)[body])
    check.same("spin", at["spin"], np.zeros_like(at["spin"]))
    for name in ("plastic_strain", "stress_work", "plastic_work"):
        expected = np.zeros(len(body))
        for material, names in STATES.items():
            if name in names:
                expected[body == material] = kept["state"][other][body == material, names.index(name)]
        check.same(name, at[name], expected)
    check.same("Points", points["position"], points["position"])  # the link leads to the grid's points
    return at | {"initial_volume": kept["initial_volume"][other]}


def motion(points: dict, body: int, dimension: int) -> dict:
    """Mass, centre, velocity, spin, angular momentum and mean stress of a body from its points."""
    mine = points["body"] == body
    m, V, v = points["mass"][mine], points["volume"][mine], points["velocity"][mine]
    x = points["position"][mine] + points["image"][mine]  # the period is 1
    centre, velocity = m @ x / m.sum(), m @ v / m.sum()
    r = x - centre
    L = m @ np.cross(r, v - velocity)
    inertia = np.einsum("p,p,ij->ij", m, (r**2).sum(1), np.eye(3)) - np.einsum("p,pi,pj->ij", m, r, r)
    omega = np.array([0, 0, L[2] / inertia[2, 2]]) if dimension == 2 else np.linalg.solve(inertia, L)
    return {"mass": m.sum(), "centre": centre, "velocity": velocity, "angular_velocity": omega, "angular_momentum": L,
            "mean_stress": V @ points["stress"][mine] / V.sum(), "momentum": m @ v}


def check_grains(check: Check, grains: dict, points: dict, touching: set, dimension: int):
    check.same("body of grains", grains["body"], [0, 1, 2])
    check.same("material of grains", grains["material"], [0, 1, 2])
    for i in range(3):
        expected = motion(points, i, dimension)
        for name in ("mass", "centre", "velocity", "mean_stress", "angular_velocity"):
            check.same(f"{name} of grains", grains[name][i], expected[name], tolerance=1e-9)
        check.same("position of grains", grains["position"][i], expected["centre"])
        check.same("contact_count", grains["contact_count"][i], sum(i in pair for pair in touching))


def check_contacts(check: Check, contacts: dict, before: dict, after: dict, duration: float, dimension: int,
                   gravity: np.ndarray):
    """What the contacts of a body passed to it is what its momentum changed by, less the gravity; normals lead from a
    to b, the point lies between them, and what presses pushes apart. Returns the largest force."""
    total = {i: np.zeros(3) for i in range(3)}
    largest = 0.0
    for a, b, force, normal, point in zip(*(contacts[n] for n in ("body_a", "body_b", "force", "normal", "point"))):
        check.same("order of bodies", float(a < b), 1.0)
        total[a] += force
        total[b] -= force
        across = motion(after, b, dimension)["centre"] - motion(after, a, dimension)["centre"]
        across[0] -= np.round(across[0])
        check.same("normal", normal @ across / np.linalg.norm(across), 1.0, 1.0, 0.1)
        check.same("length of normals", np.linalg.norm(normal), 1.0)
        middle = motion(after, a, dimension)["centre"] + 0.48 * across  # the radii are nearly the same
        miss = point - middle
        miss[0] -= np.round(miss[0])
        # The mean over the few nodes that pass the force: within a cell and a half of the coarser grid.
        check.same("contact point", miss, np.zeros(3), 1.0, 1.5 / 20)
        check.same("push", float(force @ normal <= 1e-9 * np.linalg.norm(force)), 1.0)
        largest = max(largest, np.linalg.norm(force))
    check.same("position of contacts", contacts["position"], contacts["point"])
    for i in range(3):
        was, now = motion(before, i, dimension), motion(after, i, dimension)
        change = (now["momentum"] - was["momentum"]) / duration - now["mass"] * gravity
        check.same("force", total[i], change, max(largest, 1e-300), 1e-7)
    return largest


def check_history(check: Check, history: dict, row: int, points: dict, gravity: np.ndarray, dimension: int):
    m, v, V0 = points["mass"], points["velocity"], points["initial_volume"]
    x = points["position"] + points["image"]
    J = np.linalg.det(points["deformation_gradient"].reshape(-1, 3, 3))
    F = points["deformation_gradient"].reshape(-1, 3, 3)
    elastic = 0.5 * BULK * (0.5 * (J**2 - 1) - np.log(J)) + 0.5 * SHEAR * ((F**2).sum((1, 2)) * J ** (-2 / 3) - 3)
    strain = np.where(points["body"] == 0, elastic, points["stress_work"] - points["plastic_work"])
    expected = {"kinetic_energy": 0.5 * m @ (v**2).sum(1), "potential_energy": -m @ (x @ gravity),
                "strain_energy": V0 @ strain, "plastic_dissipation": V0 @ points["plastic_work"], "mass": m.sum(),
                "viscous_dissipation": 0.0}
    for name, value in expected.items():
        check.same(name, history[name][row], value, tolerance=1e-9)
    for k in range(dimension):
        check.same("momentum", history[f"momentum_{'xyz'[k]}"][row], m @ v[:, k], m @ np.abs(v[:, k]))


def check_book(check: Check, h: dict):
    """The energy error is what its definition makes of the other columns."""
    accounts = [n for n in h if n.endswith(("_energy", "_dissipation"))]
    total = sum(h[n] for n in accounts) - h["boundary_work"]
    # What it is relative to is not a column: the same factor must hold in all rows with the largest energy so far.
    change, error = total - total[0], h["energy_error"]
    check.same("sign of the energy error", np.sign(error[1:]), np.sign(change[1:]))
    factor = np.abs(change[1:] / np.where(error[1:] == 0, np.inf, error[1:]))
    largest = h["kinetic_energy"].max() + h["strain_energy"].max() + np.abs(np.ptp(h["potential_energy"])) + 1
    check.same("scale of the energy error", float((factor[factor > 0] <= 3 * largest).all()), 1.0)
    check.same("boundary_work", h["boundary_work"], np.zeros_like(total))
    check.same("contact_dissipation", float((h["contact_dissipation"] >= -1e-6 * largest).all()), 1.0)
    check.same("contact_dissipation while nothing touches", h["contact_dissipation"][0], 0.0)


def run(cairn: Program, scratch: Path, dimension: int, gravity: bool) -> Check:
    check = Check(f"{dimension}D{' with gravity' if gravity else ''}")
    file, out = scratch / f"case{dimension}{gravity}.toml", scratch / f"out{dimension}{gravity}"
    file.write_text(case(dimension, gravity))
    done = cairn("run", file, "--out", out, *sets({}), ranks=2, timeout=300)
    if done.code != 0:
        check.problems.append(f"{check.name}: {done.code} {done.err}")
        return check
    g = np.array(GRAVITY[dimension]) if gravity else np.zeros(3)
    history, bodies = csv(out / "history.csv"), csv(out / "bodies.csv")
    series = json.loads((out / "particles.hdf.series").read_text())["files"]
    before, strongest = None, 0.0
    for number in range(1, 7):
        kept = table(out / f"checkpoint_{number - 1:06}.h5")
        points = table(out / f"particles_{number:06}.vtkhdf")
        grains, contacts = table(out / f"grains_{number:06}.h5"), table(out / f"contacts_{number:06}.h5")
        for name in ("time", "step"):
            for other in (points, grains, contacts):
                check.same(name, other[name], kept[name])
            check.same(f"{name} of the history", history[name][number], kept[name])
        check.same("step", kept["step"], 20 * number)
        check.same("rows", points["rows"], len(points["id"]))
        check.same("time of the series", series[number]["time"], kept["time"])
        at = check_particles(check, points, kept, dimension)
        touching = set(zip(contacts["body_a"], contacts["body_b"]))
        check_grains(check, grains, at, touching, dimension)
        check_history(check, history, number, at, g, dimension)
        check_bodies(check, bodies, number, at, dimension)
        if before is not None:
            duration = float(kept["time"]) - before["now"]
            strongest = max(strongest, check_contacts(check, contacts, before, at, duration, dimension, g))
            for factor in (-3, -1, 1.001):  # wrong forces do not pass
                wrong = Check("wrong")
                changed = contacts | {"force": factor * contacts["force"]}
                check_contacts(wrong, changed, before, at, duration, dimension, g)
                if strongest > 1.0 and np.abs(contacts["force"]).max(initial=0) > 1e-3 and not wrong.problems:
                    check.problems.append(f"{check.name}: forces times {factor} pass")
        before = at | {"now": float(kept["time"])}
    check_book(check, history)
    if not strongest > 1.0 or not np.max(at["plastic_work"]) > 0:
        check.problems.append(f"{check.name}: the bodies hardly touched ({strongest} N), or nothing yielded")
    return check


def check_bodies(check: Check, bodies: dict, number: int, points: dict, dimension: int):
    axes = "xyz"[:dimension]
    for i in range(3):
        row = 3 * number + i
        expected = motion(points, i, dimension)
        check.same("body of bodies.csv", bodies["body"][row], i)
        check.same("x", [bodies[a][row] for a in axes], expected["centre"][:dimension])
        check.same("vx", [bodies[f"v{a}"][row] for a in axes], expected["velocity"][:dimension])
        check.same("wx", [bodies[f"w{a}"][row] for a in "xyz"], expected["angular_velocity"], tolerance=1e-9)
        scale = expected["mass"] * 0.1  # of a body that hardly turns
        check.same("lx", [bodies[f"l{a}"][row] for a in "xyz"], expected["angular_momentum"], scale, 1e-9)


def main() -> int:
    cairn, scratch = Program(sys.argv[1]), fresh_folder(sys.argv[2])
    checks = [run(cairn, scratch, dimension, gravity) for dimension in (2, 3) for gravity in (False, True)]
    problems = [problem for check in checks for problem in check.problems]
    print("\n".join(problems))
    print(f"{len(set().union(*(check.compared for check in checks)))} quantities compared, {len(problems)} problems")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
