"""Odd cases: each runs to its end with finite results and sane energies, or is refused with a clear message.

    test_odd_cases.py CAIRN SCRATCH [--soak]

--soak runs the case of a million steps to its end instead.
"""

import csv
import dataclasses
import math
import subprocess
import sys
import time
from pathlib import Path

from harness import PATIENCE, Done, Program, fresh_folder

WRONG_INPUT, FAILED = 2, 3
LIMIT = 300  # seconds for one run

HEAD = """[domain]
upper = [1.0, 1.0]
cells = [20, 20]
[time]
steps = 200
[materials.soft]
model = "neo_hookean"
density = 1000.0
youngs_modulus = 1.0e6
poissons_ratio = 0.3
[boundary]
left = { type = "wall" }
right = { type = "wall" }
bottom = { type = "wall" }
top = { type = "wall" }
[output]
history = { every = 10 }
"""
WAVE_SPEED = math.sqrt(1e6 * 0.7 / (1.3 * 0.4) / 1000)  # sqrt(M / density), M the longitudinal modulus [m/s]


def body(shape: str, velocity=(0.0, 0.0)) -> str:
    return f'[[bodies]]\nshape = {shape}\nmaterial = "soft"\nvelocity = {list(velocity)}\n'


def disk(x: float, y: float, radius: float, velocity=(0.0, 0.0)) -> str:
    return body(f'{{ type = "disk", centre = [{x}, {y}], radius = {radius} }}', velocity)


def box(lower, upper, velocity=(0.0, 0.0)) -> str:
    return body(f'{{ type = "box", lower = {list(lower)}, upper = {list(upper)} }}', velocity)


@dataclasses.dataclass
class Odd:
    """A case, and what may come of it: an end with so much of an energy error at most, or a refusal in these words."""

    name: str
    text: str
    files: dict = dataclasses.field(default_factory=dict)
    energy: float = 0.05  # largest |energy_error|
    refused: tuple[int, str] | None = None  # exit code, words


def far_grains() -> str:
    """10,000 grains, of which all but one stand in rows far from that one."""
    rows = [f"{0.05 + 0.09 * (i % 100)},{0.05 + 0.09 * (i // 100)},0.04" for i in range(9999)]
    return "x,y,r\n" + "\n".join(rows) + "\n95.0,95.0,0.04\n"


CASES = [
    # Into the wall at 100 times the wave speed: the wall stops every point.
    Odd("bullet", HEAD + disk(0.5, 0.5, 0.2, (-100 * WAVE_SPEED, 0.0))),
    # Two bodies face to face, without a gap.
    Odd("no_gap", HEAD + box((0.25, 0.3), (0.5, 0.7), (1.0, 0.0)) + box((0.5, 0.3), (0.75, 0.7), (-1.0, 0.0))),
    # Grains of one point each, one at rest and one that meets it.
    Odd("one_point", HEAD + disk(0.5125, 0.5125, 0.01) + disk(0.6125, 0.5125, 0.01, (-1.0, 0.0)), energy=0.5),
    # A grain that holds no point at all.
    Odd("no_point", HEAD + disk(0.5, 0.5, 0.01), refused=(WRONG_INPUT, "body 0 holds no material point")),
    # Two bodies at the same place, at rest and moving apart.
    Odd("same_place", HEAD + 2 * disk(0.5, 0.5, 0.2)),
    Odd("same_place_moving", HEAD + disk(0.5, 0.5, 0.2, (1.0, 0.0)) + disk(0.5, 0.5, 0.2, (-1.0, 0.0)), energy=0.5),
    # 10,000 bodies, all but one far away.
    Odd("far_away", HEAD.replace("[1.0, 1.0]", "[100.0, 100.0]").replace("[20, 20]", "[2500, 2500]")
        .replace("steps = 200", "steps = 3") + '[[grains]]\nfile = "grains.csv"\nmaterial = "soft"\n',
        {"grains.csv": far_grains()}),
    # A domain of one cell.
    Odd("one_cell", HEAD.replace("[20, 20]", "[1, 1]") + disk(0.5, 0.5, 0.4, (1.0, 0.0)), energy=0.5),
    Odd("one_cell_periodic", HEAD.replace("[20, 20]", "[1, 1]").replace("[time]", "periodic = [true, true]\n[time]")
        + disk(0.5, 0.5, 0.4), refused=(WRONG_INPUT, "a periodic direction needs at least 4")),
]

COLUMNS = ("kinetic_energy", "strain_energy", "contact_dissipation", "energy_error", "momentum_x", "momentum_y", "mass")


def history(folder: Path) -> list[dict[str, float]]:
    with open(folder / "history.csv", encoding="utf-8") as file:
        return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]


def check_history(rows: list[dict[str, float]], energy: float) -> list[str]:
    """What is wrong with the numbers of a run that came to its end."""
    problems = [f"{c} = {row[c]} at step {row['step']:.0f}" for row in rows for c in COLUMNS
                if not math.isfinite(row[c])]
    worst = max(abs(row["energy_error"]) for row in rows)
    if worst > energy:
        problems.append(f"energy error {worst:.3g}, more than {energy}")
    largest = max(row["kinetic_energy"] + row["strain_energy"] for row in rows)
    start = rows[0]["kinetic_energy"] + rows[0]["strain_energy"]
    if largest > (1 + energy) * start + 1e-9:
        problems.append(f"energy grew from {start:.6g} to {largest:.6g} J")
    if rows[-1]["mass"] != rows[0]["mass"]:
        problems.append("mass changed")
    return problems


def check(odd: Odd, cairn: Program, scratch: Path) -> list[str]:
    """Problems of one case on 1 and 2 ranks."""
    folder = scratch / odd.name
    folder.mkdir()
    for name, text in {"case.toml": odd.text, **odd.files}.items():
        (folder / name).write_text(text)
    problems, reports = [], []
    for ranks in (1, 2):
        out = folder / f"out{ranks}"
        done: Done = cairn("run", folder / "case.toml", "--out", out, ranks=ranks, timeout=LIMIT)
        what = f"{odd.name} on {ranks} ranks"
        if odd.refused is None:
            if done.code != 0 or not done.last.startswith("done "):
                problems.append(f"{what}: {done.code}: {done.err}")
                continue
            problems += [f"{what}: {line}" for line in check_history(history(out), odd.energy)]
            reports.append((out / "history.csv").read_bytes())
        else:
            code, words = odd.refused
            if done.code != code or words not in done.err:
                problems.append(f"{what}: {done.code} instead of {code}, '{words}': {done.err}")
            if code == WRONG_INPUT and out.exists():
                problems.append(f"{what}: something was created")
            reports.append(done.err.encode())
    if len(reports) == 2 and reports[0] != reports[1]:
        problems.append(f"{odd.name}: 1 and 2 ranks differ")
    return problems


STEPS, QUICK_STEPS, WARM_UP = 1_000_000, 4000, 1000
# Two disks that meet in a periodic box, again and again; no wall takes momentum.
MANY = """[domain]
upper = [1.0, 1.0]
cells = [8, 8]
periodic = [true, true]
patch_cells = 4
[time]
steps = %d
[materials.soft]
model = "neo_hookean"
density = 1000.0
youngs_modulus = 1.0e6
poissons_ratio = 0.3
[output]
history = { every = %d }
""" + disk(0.27, 0.31, 0.19, (1.0, 0.2)) + disk(0.73, 0.64, 0.19, (-0.8, 0.1))
ENERGY_BOUND = 0.01
MEMORY_GROWTH = 1 << 20  # [bytes]
ROUND_OFF = 1e-13  # of the momentum of one disk after a thousand steps; it adds up like a random walk


def resident(pid: int) -> int:
    """Bytes of memory that a process holds; 0 once it has ended."""
    try:
        return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * 4096
    except (OSError, IndexError):
        return 0


def steps_done(file: Path) -> int:
    """The last whole row of a history that is being written."""
    try:
        with open(file, "rb") as stream:
            stream.seek(max(0, file.stat().st_size - 2000))
            rows = stream.read().split(b"\n")[1:-1]
        return int(rows[-1].split(b",")[0]) if rows else 0
    except (OSError, ValueError):
        return 0


def many_steps(steps: int, cairn: Program, scratch: Path) -> list[str]:
    """Memory flat after the first thousand steps, energy error bounded, momentum to round-off."""
    folder, problems = scratch / "many_steps", []
    folder.mkdir()
    (folder / "case.toml").write_text(MANY % (steps, steps // 400))
    out = folder / "out"
    began = time.monotonic()
    with open(folder / "log", "wb") as log:
        process = subprocess.Popen(cairn.command("run", folder / "case.toml", "--out", out), stdout=log, stderr=log)
        after_warm_up, most = 0, 0
        while process.poll() is None:
            if steps_done(out / "history.csv") >= WARM_UP:
                now = resident(process.pid)
                after_warm_up, most = after_warm_up or now, max(most, now)
            time.sleep(0.05 if steps == QUICK_STEPS else 1)
            if time.monotonic() - began > (LIMIT if steps == QUICK_STEPS else 20000) * PATIENCE:
                process.kill()
    if process.returncode != 0:
        return [f"many steps: {process.returncode}: {(folder / 'log').read_text()[-500:]}"]
    rows = history(out)
    error = max(abs(row["energy_error"]) for row in rows)
    scale = 0.5 * rows[0]["mass"] * 1.0
    drift = max(abs(row[c] - rows[0][c]) for row in rows for c in ("momentum_x", "momentum_y")) / scale
    print(f"{steps} steps in {time.monotonic() - began:.0f} s: memory {after_warm_up / 1048576:.2f} MiB after the "
          f"{WARM_UP}th, at most {most / 1048576:.2f}; energy error at most {error:.3g}; momentum within {drift:.3g}")
    # The address sanitizer keeps what has been freed for a while.
    if after_warm_up == 0 or (most > after_warm_up + MEMORY_GROWTH and not cairn.sanitized):
        problems.append(f"many steps: memory grew from {after_warm_up} to {most}")
    if not error <= ENERGY_BOUND:
        problems.append(f"many steps: energy error {error:.3g}")
    if not drift <= ROUND_OFF * max(1, steps / 1000) ** 0.5:
        problems.append(f"many steps: momentum drifts by {drift:.3g}")
    return problems


def main() -> int:
    cairn, scratch = Program(sys.argv[1]), fresh_folder(sys.argv[2])
    if "--soak" in sys.argv[3:]:
        problems = many_steps(STEPS, cairn, scratch)
    else:
        problems = []
        for odd in CASES:
            began = time.monotonic()
            problems += check(odd, cairn, scratch)
            print(f"{odd.name}: {time.monotonic() - began:.1f} s", flush=True)
        problems += many_steps(QUICK_STEPS, cairn, scratch)
    print("\n".join(problems))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
