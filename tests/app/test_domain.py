"""The edges of the domain as users meet them: bodies that leave, periodic faces, time steps, the energy guard.

    test_domain.py CAIRN SCRATCH
"""

import csv
import sys
from pathlib import Path

from harness import Program, expect_code, fresh_folder, load_compare_runs, run_tests, sets

MATERIAL = 'model = "neo_hookean"\ndensity = 1000.0\nyoungs_modulus = {modulus}\npoissons_ratio = 0.3\n'
# Grains fall through an orifice between two fixed plates and out of the free bottom face.
HOPPER = """
[domain]
upper = [1.0, 0.8]
cells = [40, 32]
patch_cells = 8
gravity = [0.0, -9.81]
[time]
end = 0.45
[materials.grain]
{material}
[materials.plate]
model = "rigid"
[[bodies]]
shape = {{ type = "box", lower = [0.0, 0.28], upper = [0.36, 0.38] }}
material = "plate"
[[bodies]]
shape = {{ type = "box", lower = [0.64, 0.28], upper = [1.0, 0.38] }}
material = "plate"
{grains}
[output]
history = {{ every = 20 }}
grains = {{ every = 200 }}
checkpoint = {{ every = 300, keep = 9 }}
"""
GRAIN = '[[bodies]]\nshape = {{ type = "disk", centre = [{x}, {y}], radius = 0.065 }}\nmaterial = "grain"\n'
PLAIN = """
[domain]
upper = [1.0, 1.0]
cells = [20, 20]
{domain}
[time]
{time}
[materials.rubber]
{material}
[[bodies]]
shape = {{ type = "box", lower = [0.3, 0.5], upper = [0.6, 0.8] }}
material = "rubber"
{body}
[output]
history = {{ every = 1 }}
"""


def plain(path: Path, time: str, domain: str = "", body: str = "", modulus: float = 1e4) -> Path:
    path.write_text(PLAIN.format(domain=domain, time=time, body=body, material=MATERIAL.format(modulus=modulus)))
    return path


def history(folder: Path) -> list[dict]:
    with open(folder / "history.csv", encoding="utf-8") as file:
        return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]


def hopper(path: Path) -> Path:
    grains = "".join(GRAIN.format(x=0.22 + 0.14 * i, y=0.46 + 0.14 * j) for i in range(5) for j in range(2))
    path.write_text(HOPPER.format(material=MATERIAL.format(modulus=2e5), grains=grains))
    return path


def test_grains_leave_a_hopper(cairn: Program, here: Path):
    case = hopper(here / "case.toml")
    done = cairn("run", case, "--out", here / "plain", ranks=2, timeout=300)
    expect_code(done, 0)
    rows = history(here / "plain")
    last = rows[-1]
    assert last["points_left"] > 100, last["points_left"]
    assert f"left the domain: {last['points_left']:.0f} points" in done.out, done.out
    for row in rows:
        whole = row["mass"] + row["mass_left"]
        assert abs(whole - rows[0]["mass"]) < 1e-12 * whole, row
        assert abs(row["energy_error"]) < 0.01, row
    # What leaves falls, and nothing is dropped.
    assert last["momentum_left_y"] < 0 and last["points_lost"] == 0, last
    # Restarted after some have left, on another number of ranks: the same bits.
    middle = here / "plain" / "checkpoint_000001.h5"
    expect_code(cairn("run", case, "--out", here / "again", "--restart", middle, ranks=3, timeout=300), 0)
    assert history(here / "again")[-1] == last
    compare = load_compare_runs()
    file = sorted(path.name for path in (here / "plain").glob("grains_*.h5"))[-1]
    problems = compare.compare_files(here / "plain" / file, here / "again" / file)
    assert not problems, problems


def test_a_face_that_stops(cairn: Program, here: Path):
    case = hopper(here / "case.toml")
    done = cairn("run", case, "--out", here / "out", *sets({"boundary.bottom": '{ leaving = "stop" }'}), timeout=300)
    expect_code(done, 3, "left the domain: y = ")
    done = cairn("check", case, *sets({"boundary.bottom": '{ type = "wall", leaving = "stop" }'}))
    expect_code(done, 2, "is only for faces of type free")


def test_periodic_faces_that_are_not_0(cairn: Program, here: Path):
    """A block that drifts by round numbers lands on faces to a rounding error, again and again."""
    for lower, velocity in ((-0.06, -1.0), (0.03, 1.0), (-0.35, 1.0), (1e-3, -1.0)):
        name = f"{lower}_{velocity}"
        text = f"""
domain = {{ lower = [{lower}, 0.0], upper = [{lower + 1.2}, 1.2], cells = [10, 10], periodic = [true, false] }}
time = {{ steps = 900, dt = 0.003 }}
materials.soft = {{ model = "neo_hookean", density = 1000.0, youngs_modulus = 1.0e3, poissons_ratio = 0.3 }}
bodies = [{{ shape = {{ type = "box", lower = [{lower}, 0.24], upper = [{lower + 0.72}, 0.96] }}, material = "soft", velocity = [{velocity}, 0.0] }}]
output = {{ history = {{ every = 100 }}, track = [0] }}
"""
        (here / f"{name}.toml").write_text(text)
        expect_code(cairn("run", here / f"{name}.toml", "--out", here / name), 0)
        with open(here / name / "bodies.csv", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        way = float(rows[-1]["x"]) - float(rows[0]["x"])
        assert abs(way - velocity * 2.7) < 1e-9, (name, way)


def test_time_steps(cairn: Program, here: Path):
    fine = plain(here / "fine.toml", "steps = 400\ndt = 1.0e-3")
    done = cairn("check", fine)
    expect_code(done, 0)
    assert "first step 0.001 s" in done.out and "steps      400" in done.out, done.out
    long = plain(here / "long.toml", "steps = 400\ndt = 2.0e-2")
    for command in (("check", long), ("run", long, "--out", here / "long")):
        expect_code(cairn(*command), 2, "time.dt: 0.02 s is", "give a smaller one")
    assert not (here / "long").exists()
    near = plain(here / "near.toml", "steps = 3\ndt = 1.3e-2")
    expect_code(cairn("check", near), 0, "time.dt: 0.013 s is 0.9")
    # A step that becomes too long, as the body falls faster and faster, ends the run before it does harm.
    falling = plain(here / "falling.toml", "steps = 4000\ndt = 1.3e-2",
                    domain="periodic = [false, true]\ngravity = [0.0, -2.0]")
    expect_code(cairn("run", falling, "--out", here / "falling"), 3, "time.dt = 0.013 s is longer than",
                "failure_particles.vtkhdf")


def test_the_energy_guard_lets_healthy_runs_be(cairn: Program, here: Path):
    for limit in (0.02, 0.005):
        case = plain(here / f"fall_{limit}.toml", "end = 0.1", domain="gravity = [0.0, -9.81]", modulus=1e6)
        done = cairn("run", case, "--out", here / f"fall_{limit}", *sets({"solver.energy_limit": limit}))
        expect_code(done, 0)
    assert max(abs(row["energy_error"]) for row in history(here / "fall_0.02")) < 0.005


def test_rounding_errors_of_a_table(cairn: Program, here: Path):
    """A grain whose centre lies a rounding error outside a periodic domain is wrapped."""
    (here / "grains.csv").write_text("x,y,r\n-1e-12,0.5,0.1\n0.5,1.000000000001,0.1\n")
    text = plain(here / "case.toml", "steps = 3", domain="periodic = [true, true]").read_text()
    (here / "case.toml").write_text(text + '[[grains]]\nfile = "grains.csv"\nmaterial = "rubber"\n')
    expect_code(cairn("run", here / "case.toml", "--out", here / "out"), 0)
    rows = history(here / "out")
    expected = 1000 * (0.09 + 2 * 3.14159265 * 0.01)
    assert abs(rows[-1]["mass"] / expected - 1) < 5e-3, rows[-1]["mass"]


def test_a_rigid_material_needs_no_density(cairn: Program, here: Path):
    expect_code(cairn("check", hopper(here / "case.toml")), 0)


def main() -> int:
    return run_tests(globals(), Program(sys.argv[1]), fresh_folder(sys.argv[2]))


if __name__ == "__main__":
    sys.exit(main())
