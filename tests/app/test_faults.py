"""Disks that fill up, memory that runs out and ranks that die: the job ends, says why, and leaves no part of a file.

    test_faults.py CAIRN SCRATCH
"""

import csv
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

from harness import PATIENCE, ROOT, Done, Program, fresh_folder, load_compare_runs, sets

compare_runs = load_compare_runs()
import h5py  # noqa: E402  after the check that it is there

FAILED = 3
LIMIT = 120  # seconds for one run
NO_SPACE = "No space left on device"
CASE = ROOT / "cases" / "shear_small.toml"
# Everything off but what a test turns on.
QUIET = {"time.steps": 60, "domain.patch_cells": 8, "output.history": "{ every = 30 }", "output.particles": "{}",
         "output.grains": "{}", "output.contacts": "{}", "output.checkpoint": "{ every = 20, keep = 9 }"}
# The output that fills the disk, its file, and the bytes that are free before.
KINDS = {"history": ({"output.history": "{ every = 1 }"}, "history.csv", 8192),
         "bodies": ({"output.history": "{ every = 1 }", "output.track": "[0, 1, 2, 3, 4, 5, 6, 7]"}, ".csv", 8192),
         "particles": ({"output.particles": "{ every = 30 }"}, "particles_000000.vtkhdf", 65536),
         "grains": ({"output.grains": "{ every = 30 }"}, "grains_000000.h5", 65536),
         "contacts": ({"output.contacts": "{ every = 30 }"}, "contacts_000000.h5", 65536),
         "checkpoint": ({}, "checkpoint_000000.h5", 65536)}


class SmallDisk:
    """A file system in memory of a given size, mounted in a folder. Only root can make one."""

    def __init__(self, folder: Path, size: int):
        self.folder = folder
        folder.mkdir(parents=True)
        done = subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", folder], check=False,
                              capture_output=True)
        self.mounted = done.returncode == 0

    def __enter__(self) -> "SmallDisk":
        return self

    def __exit__(self, *_) -> None:
        if self.mounted:
            subprocess.run(["umount", "-l", self.folder], check=False)

    def leave_free(self, size: int) -> None:
        """Fills the disk up to so many bytes."""
        free = shutil.disk_usage(self.folder).free - size
        (self.folder / "filler").write_bytes(b"\0" * max(0, free))

    def free(self) -> None:
        (self.folder / "filler").unlink(missing_ok=True)


def whole_files(folder: Path) -> list[str]:
    """What is not whole under its final name, and what was left under another."""
    problems = [f"{f.name} was left" for f in folder.rglob(".*.part")]
    for file in [*folder.glob("*.h5"), *folder.glob("*.vtkhdf")]:
        try:
            h5py.File(file).close()
        except OSError as error:
            problems.append(f"{file.name}: {error}")
    for file in folder.glob("*.csv"):
        text = file.read_text(encoding="utf-8")
        rows = list(csv.reader(line for line in text.splitlines() if not line.startswith("#")))
        if not text.endswith("\n") or any(len(row) != len(rows[0]) for row in rows):
            problems.append(f"{file.name} has a part of a line")
    return problems


def compare(a: Path, b: Path) -> list[str]:
    names_a, names_b = compare_runs.result_files(a), compare_runs.result_files(b)
    lines = [f"files {sorted(names_a ^ names_b)}"] * (names_a != names_b) + [
        f"{n}: {line}" for n in sorted(names_a & names_b) for line in compare_runs.compare_files(a / n, b / n)]
    # The run of the first had fewer steps: its case differs, and the checksum over it.
    of_case = ("checkpoint_000000.h5: /case", "checkpoint_000000.h5: / attribute numbers_checksum")
    return [line for line in lines if not line.startswith(of_case)]


def full_at(kind: str, cairn: Program, scratch: Path, ranks: int) -> list[str]:
    """The disk is full when this kind of output is written; later there is room, and the run goes on."""
    more, name, room = KINDS[kind]
    settings, problems = QUIET | more, []
    whole = scratch / f"whole_{kind}"
    if not whole.exists():
        cairn("run", CASE, "--out", whole, *sets(settings), timeout=LIMIT)
    with SmallDisk(scratch / f"disk_{kind}_{ranks}", 16 << 20) as disk:
        if not disk.mounted:
            return [f"{kind}: no file system could be mounted"]
        out = disk.folder / "out"
        # Tables that grow by lines go on from a checkpoint, far enough for what is free.
        started = kind in ("history", "bodies")
        full = settings | ({"time.steps": 400, "output.checkpoint": "{}"} if started else {})
        if started:
            start = settings | {"time.steps": 20}
            first = cairn("run", CASE, "--out", out, *sets(start), ranks=ranks, timeout=LIMIT)
            if first.code != 0:
                problems.append(f"the start: {first.code} {first.err}")
        disk.leave_free(room)
        restart = ["--restart", "latest"] if started else []
        done = cairn("run", CASE, "--out", out, *sets(full), *restart, ranks=ranks, timeout=LIMIT)
        if done.code != FAILED or NO_SPACE not in done.err or name not in done.err:
            problems.append(f"exit code {done.code}, {done.err}")
        problems += whole_files(out)
        disk.free()
        restart = ["--restart", "latest"] if list(out.glob("checkpoint_*.h5")) else ["--overwrite"]
        done = cairn("run", CASE, "--out", out, *sets(settings), *restart, ranks=ranks, timeout=LIMIT)
        if done.code != 0:
            problems.append(f"with room again: {done.code}, {done.err}")
        else:
            problems += compare(whole, out) + whole_files(out)
    return [f"full disk at {kind} on {ranks} ranks: {p}" for p in problems]


def full_for_pack(cairn: Program, scratch: Path) -> list[str]:
    """A grain table that does not fit leaves the one that was there."""
    with SmallDisk(scratch / "disk_pack", 1 << 20) as disk:
        table = disk.folder / "pack.csv"
        arguments = ("pack", ROOT / "cases" / "packs" / "shear36.toml", "-o", table)
        if (done := cairn(*arguments, timeout=LIMIT)).code != 0:
            return [f"pack: {done.err}"]
        before = table.read_text()
        disk.leave_free(0)
        done = cairn(*arguments, timeout=LIMIT)
        problems = [] if done.code == FAILED and NO_SPACE in done.err else [f"exit code {done.code}, {done.err}"]
        if table.read_text() != before:
            problems.append("the table that was there is damaged")
        problems += whole_files(disk.folder)[:0] + [f"{f.name} was left" for f in disk.folder.glob(".*")]
        disk.free()
        done = cairn(*arguments, timeout=LIMIT)
        if done.code != 0 or not table.read_text().startswith("# 36 grains"):
            problems.append(f"with room again: {done.code} {done.err}")
    return [f"full disk at pack: {p}" for p in problems]


def full_for_plot(scratch: Path) -> list[str]:
    """Pictures that do not fit: exit code 3, and no part of a picture."""
    whole = scratch / "whole_particles"
    with SmallDisk(scratch / "disk_plot", 32 << 20) as disk:
        run = disk.folder / "run"
        shutil.copytree(whole, run)
        disk.leave_free(4096)
        plot = [ROOT / "scripts" / "plot", run]
        done = subprocess.run(plot, capture_output=True, text=True, check=False, timeout=LIMIT * PATIENCE)
        if "No module named" in done.stderr or "needs" in done.stderr:
            print(f"plot: left out: {done.stderr.strip()[-100:]}")
            return []
        problems = []
        if done.returncode != FAILED or NO_SPACE not in done.stderr or "Traceback" in done.stderr:
            problems.append(f"exit code {done.returncode}, {done.stderr[-300:]}")
        left = [f.name for f in (run / "pictures").rglob("*") if f.is_file()]
        if left:
            problems.append(f"left {left}")
        disk.free()
        done = subprocess.run(plot, capture_output=True, text=True, check=False, timeout=LIMIT * PATIENCE)
        if done.returncode != 0:
            problems.append(f"with room again: {done.returncode} {done.stderr[-300:]}")
    return [f"full disk at plot: {p}" for p in problems]


def one_rank_cannot_write(cairn: Program, scratch: Path) -> list[str]:
    """Files may not grow on one of four ranks: every rank ends, with its message."""
    problems = []
    settings = QUIET | {"output.particles": "{ every = 30 }", "domain.cells": "[96, 96]"}
    for limited in (0, 3):
        out = scratch / f"limited_{limited}"
        done = mixed(cairn, ["run", CASE, "--out", out, *sets(settings)], 4, limited, "ulimit -f 100")
        if done.code != FAILED or "cannot write" not in done.err:
            problems.append(f"rank {limited} cannot write: {done.code}, {done.err}")
        problems += whole_files(out)
    return problems


def mixed(cairn: Program, arguments: list, ranks: int, odd: int, prepare: str) -> Done:
    """Runs the program with one rank, number `odd`, started by a shell that has done something before."""
    words = [cairn.exe, *map(str, arguments)]
    shell = ["/bin/sh", "-c", f'{prepare}; exec "$@"', "sh", *words]
    command = [cairn.mpirun]
    for rank in range(ranks):
        command += [":"] * (rank > 0) + ["-n", "1", *(shell if rank == odd else words)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT * PATIENCE, check=False)
    except subprocess.TimeoutExpired:
        return Done("hang", "", "")
    return Done(done.returncode, done.stdout, done.stderr)


def out_of_memory(cairn: Program, scratch: Path) -> list[str]:
    """One of two ranks may use little memory while a checkpoint is read: the job ends within seconds, with code 3."""
    settings = QUIET | {"time.steps": 20, "domain.cells": "[320, 320]", "solver.points_per_cell": 9}
    problems, codes = [], []
    whole = scratch / "memory"
    done = cairn("run", CASE, "--out", whole, *sets(settings), ranks=2, timeout=LIMIT)
    if done.code != 0:
        return [f"memory: {done.code} {done.err}"]
    # From too little to start with to enough; where reading fails lies between.
    for mebibytes in range(240, 360, 20):
        began = time.monotonic()
        arguments = ["run", CASE, "--out", scratch / f"memory_{mebibytes}", *sets(settings | {"time.steps": 21}),
                     "--restart", whole / "checkpoint_000000.h5"]
        done = mixed(cairn, arguments, 2, 1, f"ulimit -v {mebibytes * 1024}")
        ran_out = "a rank is out of memory" in done.err
        if "Signal:" in done.err:
            problems.append(f"{mebibytes} MiB: stack trace")
        codes.append((mebibytes, done.code, ran_out))
        if done.code == "hang" or (time.monotonic() - began > 60):
            problems.append(f"{mebibytes} MiB: hung")
        elif ran_out and done.code != FAILED:
            problems.append(f"{mebibytes} MiB: exit code {done.code}: {done.err[-300:]}")
    print(f"memory limits (MiB, exit code, out of memory): {codes}")
    if not any(out for _, _, out in codes):
        problems.append(f"no limit made memory run out: {codes}")
    return problems


def children(pid: int) -> list[int]:
    """The processes that a process has started."""
    text = Path(f"/proc/{pid}/task/{pid}/children").read_text()
    return [int(word) for word in text.split()]


def alive(pid: int) -> bool:
    """Whether a process runs; one that has ended and waits for its parent does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def one_rank_killed(cairn: Program, scratch: Path) -> list[str]:
    """kill -9 of one rank of three: the job ends with a code that is not 0, and the checkpoints before are whole."""
    problems = []
    settings = QUIET | {"time.steps": 1000000, "output.checkpoint": "{ every = 20, keep = 2 }"}
    for victim in (0, 2):
        out = scratch / f"killed_{victim}"
        command = cairn.command("run", CASE, "--out", out, *sets(settings), ranks=3)
        with open(scratch / f"killed_{victim}.log", "wb") as log:
            process = subprocess.Popen(command, stdout=log, stderr=log)
            limit = time.monotonic() + LIMIT * PATIENCE
            while len(list(out.glob("checkpoint_*.h5"))) < 2 and process.poll() is None and time.monotonic() < limit:
                time.sleep(0.05)
            ranks = [pid for pid in children(process.pid) if "cairn" in Path(f"/proc/{pid}/comm").read_text()]
            os.kill(sorted(ranks)[victim], signal.SIGKILL)
            try:
                code = process.wait(timeout=30 * PATIENCE)
            except subprocess.TimeoutExpired:
                process.kill()
                code = "hang"
        if code in (0, "hang"):
            problems.append(f"rank {victim} killed: exit code {code}")
        limit = time.monotonic() + 10 * PATIENCE
        while any(map(alive, ranks)) and time.monotonic() < limit:
            time.sleep(0.1)
        if any(map(alive, ranks)):
            problems.append(f"rank {victim} killed: other ranks go on")
        done = cairn("run", CASE, "--out", out, *sets(settings | {"time.wall_limit": 0.5}), "--restart", "latest",
                     ranks=2, timeout=LIMIT)
        if done.code != 4:
            problems.append(f"rank {victim} killed: cannot go on: {done.code} {done.err}")
    return problems


def main() -> int:
    cairn, scratch = Program(sys.argv[1]), fresh_folder(sys.argv[2])
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    problems = []

    def part(name: str, work, *arguments) -> None:
        began = time.monotonic()
        problems.extend(work(*arguments))
        print(f"{name}: {time.monotonic() - began:.0f} s", flush=True)

    part("one rank cannot write", one_rank_cannot_write, cairn, scratch)
    if not cairn.sanitized:
        part("out of memory", out_of_memory, cairn, scratch)
    part("one rank killed", one_rank_killed, cairn, scratch)
    if os.geteuid() == 0 and SmallDisk(scratch / "probe", 1 << 20).mounted:
        subprocess.run(["umount", scratch / "probe"], check=False)
        for kind in KINDS:
            for ranks in (1, 2):
                part(f"full disk at {kind} on {ranks} ranks", full_at, kind, cairn, scratch, ranks)
        part("full disk at pack", full_for_pack, cairn, scratch)
        part("full disk at plot", full_for_plot, scratch)
    else:
        print("full disks: left out: only root can mount a small file system")
    print("\n".join(problems))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
