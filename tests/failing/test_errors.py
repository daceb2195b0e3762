"""An error of one rank, at every stage of a step and in output: the job ends within seconds, with one message and exit
code 3. The program is one whose stages can be made to fail (timers.cpp).

    test_errors.py CAIRN_FAILING SCRATCH
"""

import concurrent.futures
import os
import re
import subprocess
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "app"))
from harness import PATIENCE, ROOT, Program, fresh_folder, sets  # noqa: E402  from the folder beside

CASE = ROOT / "cases" / "shear_small.toml"
SETTINGS = {"time.steps": 1000000, "domain.patch_cells": 8, "output.history": "{ every = 10 }",
            "output.particles": "{ every = 25 }", "output.grains": "{}", "output.contacts": "{}",
            "output.checkpoint": "{ every = 30 }"}
# The stage, and the times it begins before it fails: beyond set-up, in the middle of a run.
STAGES = {"filter": 3, "project": 900, "exchange": 900, "contact": 900, "stress": 900, "integrate": 400,
          "update": 400, "migrate": 40, "output": 12}
KINDS = ("RunError", "InputError", "bad_alloc", "exception")
SECONDS = 15  # from the error to the end; what the ranks wait is 7.5 s at the most
HANG = 120


def fail_at(cairn: Program, scratch: Path, ranks: int, rank: int, stage: str, count: int, kind: str) -> list[str]:
    name = f"{stage} {count} on rank {rank} of {ranks}: {kind}"
    out = scratch / name.replace(" ", "_").replace(":", "")
    environment = os.environ | {"CAIRN_FAIL": f"{rank} {stage} {count} {kind}"}
    done = cairn("run", CASE, "--out", out, *sets(SETTINGS), ranks=ranks, timeout=HANG, env=environment)
    ended = time.time()
    began = re.search(r"failing at ([\d.]+)", done.err)
    if done.code == "hang" or not began:
        return [f"{name}: {done.code}, {done.err}"]
    seconds = ended - float(began[1])
    messages = [line for line in done.err.splitlines() if "cairn failed" in line or "error" in line and "cairn" in line]
    problems = [] if done.code == 3 else [f"exit code {done.code}"]
    reason = "out of memory" if kind == "bad_alloc" else "made to fail"
    who = "" if stage == "project" and count < 9 else f"rank {rank} after step"  # set-up names no step
    if len(messages) != 1 or who not in messages[0] or reason not in messages[0]:
        problems.append(f"messages {messages or done.err[-500:]}")
    if seconds > SECONDS * PATIENCE:
        problems.append(f"{seconds:.0f} s")
    print(f"{name}: {seconds:.1f} s, {messages[:1]}", flush=True)
    return [f"{name}: {p}" for p in problems]


def vanished_folder(cairn: Program, scratch: Path) -> list[str]:
    """The folder of the results is not there for rank 1, which works elsewhere."""
    here, elsewhere = fresh_folder(scratch / "here"), fresh_folder(scratch / "elsewhere")
    words = [cairn.exe, "run", str(CASE), "--out", "out", *sets(SETTINGS | {"time.steps": 50})]
    shell = ["/bin/sh", "-c", f'cd "{elsewhere}"; exec "$@"', "sh", *words]
    command = [cairn.mpirun, "--oversubscribe", "-n", "1", *words, ":", "-n", "1", *shell]
    try:
        done = subprocess.run(command, cwd=here, capture_output=True, text=True, check=False, timeout=HANG * PATIENCE)
    except subprocess.TimeoutExpired:
        return ["vanished folder: hangs"]
    good = done.returncode == 3 and done.stderr.count("cairn failed") == 1 and "No such file" in done.stderr
    return [] if good else [f"vanished folder: {done.returncode} {done.stderr[-500:]}"]


def main() -> int:
    cairn, scratch = Program(sys.argv[1]), fresh_folder(sys.argv[2])
    runs = [(ranks, (i + ranks) % ranks, stage, count, KINDS[(i + ranks) % len(KINDS)])
            for ranks in (2, 3) for i, (stage, count) in enumerate(STAGES.items())]
    runs += [(3, 1, "contact", 700, kind) for kind in KINDS] + [(2, 1, "project", 2, "exception")]
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        problems = sum(pool.map(lambda run: fail_at(cairn, scratch, *run), runs), [])
    problems += vanished_folder(cairn, scratch)
    print("\n".join(problems))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
