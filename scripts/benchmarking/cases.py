"""The cases that are timed: one solid block, and touching grains on a regular lattice."""

import itertools
import math
import random
from pathlib import Path

CELLS_ACROSS = 8  # of a grain
MARGIN = 2  # cells between the grains and the sides: grains then straddle sides of patches as often as at random places
JITTER = 0.01  # largest shift of a grain in each direction, in cells: overlaps stay within 0.5 % of the radius
TABLES = 16  # grain tables of a case, each with its own velocity
SPEED_SHARE = 0.001  # speeds over the wave speed: grains knock at each other, and none leaves the domain

# Cell size [m], text of the material, wave speed [m/s].
MATERIALS = {
    2: (1.0e-5, """[materials.solid]
model = "von_mises"
density = 1900.0
shear_modulus = 7.5e9
bulk_modulus = 11.4e9
yield_stress = 0.3e9
hardening_modulus = 0.01e9
""", ((11.4e9 + 4 / 3 * 7.5e9) / 1900.0) ** 0.5),
    3: (1.0e-3, """[materials.solid]
model = "neo_hookean"
density = 1000.0
shear_modulus = 3.0e6
bulk_modulus = 5.0e6
""", ((5.0e6 + 4 / 3 * 3.0e6) / 1000.0) ** 0.5),
}


def make_folder(folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def numbers(values) -> str:
    return "[" + ", ".join(repr(v) for v in values) + "]"


def head(title: str, dimension: int, cells: tuple[int, ...], patch_cells: int | None) -> str:
    size, material, _ = MATERIALS[dimension]
    patch = f"patch_cells = {patch_cells}\n" if patch_cells else ""
    return f"""title = "{title}"

[domain]
dimension = {dimension}
upper = {numbers(n * size for n in cells)}
cells = {numbers(cells)}
{patch}
[time]
steps = 1

[output]
history = {{ every = 1000000 }}

{material}"""


def velocity(generator: random.Random, dimension: int) -> list[float]:
    speed = SPEED_SHARE * MATERIALS[dimension][2]
    return [speed * generator.uniform(-1, 1) for _ in range(dimension)]


def write_block(folder: Path, cells: int) -> Path:
    """A neo-Hookean cube of cells^3 cells that spins slowly and touches nothing."""
    name = f"block3d_{cells}"
    folder = make_folder(folder / name)
    size, _, wave = MATERIALS[3]
    side = cells + 2 * MARGIN
    spin = SPEED_SHARE * wave / (cells * size)
    path = folder / f"{name}.toml"
    path.write_text(head(f"One block of {cells}^3 cells", 3, (side,) * 3, None) + f"""
[[bodies]]
shape = {{ type = "box", lower = {numbers([MARGIN * size] * 3)}, upper = {numbers([(MARGIN + cells) * size] * 3)} }}
material = "solid"
angular_velocity = {numbers([0.0, 0.0, spin])}
""")
    return path


def lattice_of(count: int, dimension: int) -> tuple[int, ...]:
    """Grains in each direction: as nearly a square or cube as holds `count`."""
    counts = [1] * dimension
    direction = 0
    while math.prod(counts) < count:
        counts[direction] += 1
        direction = (direction + 1) % dimension
    return tuple(counts)


def write_grains(folder: Path, dimension: int, counts: tuple[int, ...], grains: int = 0,
                 patch_cells: int | None = None) -> Path:
    """Touching balls on a square or cubic lattice of `counts`, the first `grains` of them (0: all)."""
    size = MATERIALS[dimension][0]
    grains = grains or math.prod(counts)
    name = f"grains{dimension}d_{grains}" + (f"_{patch_cells}" if patch_cells else "")
    folder = make_folder(folder / name)
    generator = random.Random(1)
    rows: list[list[str]] = [[] for _ in range(min(TABLES, grains))]
    places = itertools.product(*(range(n) for n in counts))
    for place in itertools.islice(places, grains):
        centre = [(MARGIN + CELLS_ACROSS * (i + 0.5) + generator.uniform(-JITTER, JITTER)) * size for i in place]
        rows[generator.randrange(len(rows))].append(",".join(repr(x) for x in [*centre, 0.5 * CELLS_ACROSS * size]))
    cells = tuple(CELLS_ACROSS * n + 2 * MARGIN for n in counts)
    text = head(f"{grains} touching grains", dimension, cells, patch_cells)
    for k, lines in enumerate(rows):
        if not lines:
            continue
        table = folder / f"{k:02}.csv"
        table.write_text(",".join("xyz"[:dimension]) + ",r\n" + "\n".join(lines) + "\n")
        text += f"""
[[grains]]
file = "{table.name}"
material = "solid"
velocity = {numbers(velocity(generator, dimension))}
"""
    path = folder / f"{name}.toml"
    path.write_text(text)
    return path


def bytes_per_point_step(dimension: int, stress_update: str, spinning: bool) -> int:
    """Bytes of point columns that the passes of a step read and write (the formula of docs/performance.md): what
    crosses the memory bus where the points do not fit into the cache. Nodes are not counted."""
    d, tensor, symmetric, state = dimension, *((5, 4, 3) if dimension == 2 else (9, 6, 0))
    spin = (1 if dimension == 2 else 3) if spinning else 0
    first = stress_update in ("first", "both")
    again = stress_update in ("both", "modified_last")
    strain = 2 * (tensor + symmetric + state)  # F sigma state, read and written
    words = d  # extent of the piece: x
    words += 2 * d + spin + tensor + symmetric + 1  # projection: x v w F sigma V
    if first:
        words += d + strain + 1  # x; V
    if again:
        words += 3 * d + 2 * spin + 1  # x; v and w read and written; V
    if stress_update == "first":
        words += 4 * d + 2 * spin  # x v w read and written
    else:
        words += 3 * d + strain  # x read and written, v
    if stress_update == "last":
        words += 3 * d + 2 * spin  # x; v and w read and written
    words += d  # search for points that left: x
    return 8 * words
