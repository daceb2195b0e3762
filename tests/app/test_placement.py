"""What is placed is what `check` foretold: shapes in periodic domains once, and a word where the mass is another.

    test_placement.py CAIRN SCRATCH
"""

import csv
import re
import sys
from pathlib import Path

from harness import Program, fresh_folder

HEAD = """
domain = {{ dimension = {dim}, upper = {upper}, cells = {cells}, periodic = {periodic} }}
time = {{ steps = 1 }}
materials.soft = {{ model = "neo_hookean", density = 1000.0, youngs_modulus = 1.0e4, poissons_ratio = 0.3 }}
bodies = [{{ shape = {shape}, material = "soft" }}]
output = {{ history = {{ every = 1 }} }}
"""
HALF = '{ type = "half_space", point = %s, normal = %s }'
UNION = '{ type = "union", of = [%s] }'
PARTS = ['{ type = "box", lower = [-0.3, 0.0], upper = [0.5, 0.5] }',
         '{ type = "box", lower = [0.4, 0.0], upper = [1.3, 0.5] }']
# Name: dimension, periodic directions, shape, volume.
SHAPES = {
    "half space in 2D": (2, [True, False], HALF % ([0.0, 0.5], [0.0, 1.0]), 0.5),
    "half space in 3D": (3, [True, False, True], HALF % ([0.0, 0.5, 0.0], [0.0, 1.0, 0.0]), 0.5),
    "compound wider than the period": (2, [True, False], UNION % ", ".join(PARTS), 0.5),
    "box across the boundary": (2, [True, True], '{ type = "box", lower = [-0.25, 0.75], upper = [0.25, 1.25] }', 0.25),
    "box that just fills the period":
        (2, [True, False], '{ type = "box", lower = [0.25, 0.0], upper = [1.25, 0.5] }', 0.5),
}
# A plate of .8 cells, and whether its points, two rows to a cell, have another mass.
PLATE = '{ type = "box", lower = [0.25, %s], upper = [0.75, %s] }'


def run(cairn: Program, scratch: Path, name: str, dim: int, periodic: list, shape: str, ranks: int) -> tuple:
    """Points foretold, points placed, mass, and the warnings of check and run."""
    file = scratch / (re.sub(r"\W+", "_", name) + ".toml")
    file.write_text(HEAD.format(dim=dim, upper=[1.0] * dim, cells=[16] * dim, shape=shape,
                                periodic=str(periodic).lower()), encoding="utf-8")
    check = cairn("check", file)
    out = scratch / f"{file.stem}_{ranks}"
    done = cairn("run", file, "--out", out, ranks=ranks)
    if check.code != 0 or done.code != 0:
        raise RuntimeError(f"{name}: {check.code} {check.err} {done.code} {done.err}")
    with open(out / "history.csv", encoding="utf-8") as table:
        first = next(csv.DictReader(line for line in table if not line.startswith("#")))
    foretold = int(re.search(r"points +about (\d+)", check.out)[1])
    return foretold, int(re.search(r"points=(\d+)", done.last)[1]), float(first["mass"]), done.err


def main() -> int:
    cairn, scratch = Program(sys.argv[1]), fresh_folder(sys.argv[2])
    problems = []
    for name, (dim, periodic, shape, volume) in SHAPES.items():
        for ranks in (1, 2):
            foretold, points, mass, err = run(cairn, scratch, name, dim, periodic, shape, ranks)
            exact = round(volume * 16**dim * 2**dim)
            if points != exact or abs(mass - 1000 * volume) > 1e-9 or abs(foretold - exact) > 0.02 * exact or err:
                problems.append(f"{name}, {ranks} ranks: {points} points of {exact}, {foretold} foretold, {mass} kg {err}")
    cell = 1 / 16
    for low, rows in ((5.0, 2), (5.1, 2), (5.2, 2), (5.3, 1), (5.6, 1)):
        a, b = low * cell, (low + 0.8) * cell
        _, _, mass, err = run(cairn, scratch, f"plate {low}", 2, [False, False], PLATE % (a, b), 2)
        whole, placed = 1000 * 0.5 * 0.8 * cell, 1000 * 0.5 * rows * cell / 2
        if abs(placed - whole) <= 0.05 * whole:
            problems.append(f"plate at {low}: the test shows nothing")
        said = re.search(r"have ([\d.]+) kg, density x volume of its shape is ([\d.]+) kg", err)
        if not said or abs(float(said[1]) - mass) > 1e-3 * mass or abs(float(said[2]) - whole) > 1e-3 * whole:
            problems.append(f"plate at {low}: {mass} kg of {whole}: {err}")
    print("\n".join(problems))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
