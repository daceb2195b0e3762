"""The memory that `check` foretells is what a run takes, to 15 %: small and large, 2D and 3D, on one rank and two. Where
a control group (containers, Slurm) or ulimit leaves less, `check` and `run` say so.

    test_memory.py CAIRN SCRATCH
"""

import itertools
import re
import statistics
import subprocess
import sys
import time
from pathlib import Path

from harness import SKIP, Program, fresh_folder

CASE = """
domain = {{ dimension = {dim}, upper = {upper}, cells = {cells} }}
time = {{ steps = 3 }}
materials.m = {{ model = "neo_hookean", density = 1000.0, youngs_modulus = 1e5, poissons_ratio = 0.3 }}
output = {{ history = {{ every = 1000 }}{output} }}
bodies = [{bodies}]
"""
BODY = '{{ shape = {{ type = "{ball}", centre = {centre}, radius = {radius} }}, material = "m" }}'
# Runs a command and says the most memory [kB] that it held.
WATCH = ("import resource, subprocess, sys; c = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL).returncode; "
         "print('held', resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss, flush=True); sys.exit(c)")
TOLERANCE = 0.15
# Dimension, cells a side, bodies a side, ranks, more output.
RUNS = [(2, 50, 1, 1, ""), (2, 180, 1, 1, ""), (2, 580, 1, 1, ""), (2, 580, 1, 2, ""), (2, 400, 8, 1, ""),
        (2, 400, 8, 2, ""), (3, 30, 1, 1, ""), (3, 50, 1, 1, ""), (3, 50, 1, 2, ""), (3, 64, 4, 1, ""),
        (3, 64, 8, 1, ""), (3, 64, 8, 2, ""), (3, 50, 1, 1, ", checkpoint = { every = 3 }, particles = { every = 3 }")]


def held(cairn: Program, file: Path, out: Path, ranks: int) -> float:
    """Bytes of all ranks, the middle of three runs."""
    launcher = [cairn.mpirun, "--oversubscribe", "-n", str(ranks)]
    command = [*launcher, sys.executable, "-c", WATCH, cairn.exe, "run", str(file), "--out", str(out), "--overwrite"]
    totals = []
    for _ in range(3):
        done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=300)
        totals.append(sum(1024 * float(kb) for kb in re.findall(r"held (\d+)", done.stdout)))
    return statistics.median(totals)


def control_group(limit: int) -> Path | None:
    """A group below this process's own that may hold `limit` bytes; none where groups cannot be made."""
    own = {kinds: path for _, kinds, path in (line.split(":", 2) for line in
                                              Path("/proc/self/cgroup").read_text(encoding="ascii").splitlines())}
    for mount, path, name in [("/sys/fs/cgroup/memory", own.get("memory"), "memory.limit_in_bytes"),
                              ("/sys/fs/cgroup", own.get(""), "memory.max")]:
        group = Path(f"{mount}{path}/cairn_test")
        try:
            group.mkdir(exist_ok=True)
            if not (group / "cgroup.procs").exists():
                raise FileNotFoundError(group)
            (group / name).write_text(str(limit), encoding="ascii")
            return group
        except OSError:
            continue
    return None


def limits(cairn: Program, scratch: Path) -> list[str]:
    """Of a case of some 80 MB where there are 64 for it."""
    limit = 64 << 20
    file = scratch / "limited.toml"
    file.write_text(CASE.format(dim=2, upper=[1.0] * 2, cells=[300] * 2, output="", bodies=BODY.format(
        ball="disk", centre=[0.5, 0.5], radius=0.48)), encoding="utf-8")
    group = control_group(limit)
    print("control group:", group or "none can be made here")
    problems = []
    for command in ("check", "run"):
        call = [cairn.exe, command, str(file), *(["--out", str(scratch / "limited"), "--overwrite"] * (command == "run"))]
        enter = f"echo $$ > '{group}/cgroup.procs' && " if group else ""
        # A rank that asks for more than the group has is ended by the system: the word must come before.
        done = subprocess.run(["sh", "-c", enter + 'exec "$@"', "sh", *call], capture_output=True, text=True,
                              check=False, timeout=300)
        if group and "this machine has" not in done.stderr:
            problems.append(f"{command} does not warn of a control group of {limit} bytes: {done.stderr}")
    for _ in range(50 if group else 0):  # until daemons of MPI are gone too
        try:
            group.rmdir()
            break
        except OSError:
            time.sleep(0.2)
    large = ["check", str(file), "--set", "domain.cells=4000"]  # some 9 GB
    done = subprocess.run(["sh", "-c", 'ulimit -v 4000000; exec "$@"', "sh", cairn.exe, *large], capture_output=True,
                          text=True, check=False, timeout=300)
    if "this machine has 4.1 GB for it" not in done.stderr:
        problems.append(f"check does not warn of ulimit: {done.returncode} {done.stdout} {done.stderr}")
    return problems


def main() -> int:
    cairn, scratch = Program(sys.argv[1]), fresh_folder(sys.argv[2])
    if cairn.sanitized:
        print("a sanitizer takes memory of its own")
        return SKIP
    problems = limits(cairn, scratch)
    for dim, cells, side, ranks, output in RUNS:
        bodies = [BODY.format(ball="disk" if dim == 2 else "sphere", centre=[(i + 0.5) / side for i in place],
                              radius=0.48 / side) for place in itertools.product(range(side), repeat=dim)]
        file = scratch / "case.toml"
        file.write_text(CASE.format(dim=dim, upper=[1.0] * dim, cells=[cells] * dim, output=output,
                                    bodies=", ".join(bodies)), encoding="utf-8")
        check = cairn("check", file, ranks=ranks)
        points, number, unit = re.search(r"points +about (\d+)\s+memory +about ([\d.e+]+) (MB|GB)", check.out).groups()
        foretold = float(number) * {"MB": 1e6, "GB": 1e9}[unit]
        measured = held(cairn, file, scratch / "out", ranks)
        line = (f"{dim}D, {points} points, {side**dim} bodies, {ranks} ranks: {foretold / 1e6:.1f} MB foretold, "
                f"{measured / 1e6:.1f} MB held: {100 * (foretold / measured - 1):+.1f} %")
        print(line, flush=True)
        if abs(foretold / measured - 1) > TOLERANCE:
            problems.append(line)
    print("\n".join(problems))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
