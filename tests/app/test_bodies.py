"""bodies.csv gives position, velocity and spin of the tracked bodies, in 2D and 3D, under the columns of docs/results.md.

    test_bodies.py CAIRN SCRATCH
"""

import sys
from pathlib import Path

from harness import ROOT, Program, fresh_folder, sets

COLUMNS = {2: ["step", "time", "body", "x", "y", "vx", "vy", "wx", "wy", "wz", "lx", "ly", "lz"],
           3: ["step", "time", "body", "x", "y", "z", "vx", "vy", "vz", "wx", "wy", "wz", "lx", "ly", "lz"]}

# The case, the number of its dimensions and tracked bodies; body 0 spins and moves freely, far from everything.
CASES = {
    "two_disks": (2, {"time.steps": 3, "output.track": "[1, 0]", "bodies.0.angular_velocity": 4.0,
                      "output.particles": "{}", "output.history": "{ every = 1 }"},
                  {"x": 0.3037, "y": 0.3113, "vx": 0.1, "vy": 0.06, "wx": 0.0, "wy": 0.0, "wz": 4.0}),
    "sphere": (3, {}, {"x": 0.5, "y": 0.45, "z": 0.52, "vx": 0.3, "vy": -0.2, "vz": 0.1, "wx": 1.0, "wy": -2.0,
                       "wz": 3.0}),
}

SPHERE = """[domain]
dimension = 3
upper = [1.0, 1.0, 1.0]
cells = 12
[time]
steps = 3
[materials.soft]
model = "neo_hookean"
density = 1000.0
shear_modulus = 1.0e5
bulk_modulus = 2.0e5
[[bodies]]
shape = { type = "sphere", centre = [0.5, 0.45, 0.52], radius = 0.25 }
material = "soft"
velocity = [0.3, -0.2, 0.1]
angular_velocity = [1.0, -2.0, 3.0]
[output]
history = { every = 1 }
track = [0]
"""


def check(program: Program, case: Path, out: Path, dimension: int, settings: dict, expected: dict) -> list[str]:
    """What is wrong with the table of one case."""
    done = program("run", case, "--out", out, *sets(settings))
    if done.code != 0:
        return [f"{case.name}: exit code {done.code}\n{done.err}"]
    lines = (out / "bodies.csv").read_text().splitlines()
    header = lines[0].split(",")
    if header != COLUMNS[dimension]:
        return [f"{case.name}: columns {header}, expected {COLUMNS[dimension]}"]
    rows = [dict(zip(header, map(float, line.split(",")))) for line in lines[1:]]
    bodies = 2 if dimension == 2 else 1
    problems = [] if len(rows) == 4 * bodies else [f"{case.name}: {len(rows)} rows, expected {4 * bodies}"]
    first, last = [[row for row in rows if row["body"] == 0][i] for i in (0, -1)]
    for row in (first, last):
        for name, value in expected.items():
            moved = value + row["time"] * expected["v" + name] if name in "xyz" else value
            # The points' centre may lie a little beside the shape's, and then moves with the spin.
            if abs(row[name] - moved) > (0.01 if name in "xyz" else 0.03):
                problems.append(f"{case.name}: step {row['step']:.0f}: {name} = {row[name]}, expected {moved}")
    return problems


def main() -> int:
    program, scratch = Program(sys.argv[1]), fresh_folder(sys.argv[2])
    (scratch / "sphere.toml").write_text(SPHERE)
    problems = []
    for name, (dimension, settings, expected) in CASES.items():
        folder = scratch if name == "sphere" else ROOT / "cases"
        problems += check(program, folder / f"{name}.toml", scratch / name, dimension, settings, expected)
    print("\n".join(problems) or "bodies.csv holds the motion of the bodies")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
