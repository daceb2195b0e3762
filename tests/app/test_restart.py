"""Checkpoints, restart and signals: a run that is interrupted in any way ends with the same bits as one that is not.

    test_restart.py CAIRN SCRATCH [--soak]

--soak repeats what is random (kills, damaged files) many times.
"""

import concurrent.futures
import dataclasses
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

from harness import PATIENCE, ROOT, Program, fresh_folder, load_compare_runs, sets

compare_runs = load_compare_runs()
import h5py  # noqa: E402  after the check that it is there

FIELDS = '["velocity", "stress", "id", "image"]'
SHEAR = ROOT / "cases" / "shear_small.toml"
SHEAR_SETS = {"time.steps": 90, "domain.patch_cells": 8, "output.history": "{ every = 7 }",
              "output.particles": f"{{ every = 25, fields = {FIELDS} }}", "output.grains": "{ interval = 2.0e-8 }",
              "output.contacts": "{ every = 40 }", "output.track": "[0, 5]",
              "output.checkpoint": "{ every = 20, keep = 9 }"}
SPHERES = ROOT / "cases" / "spheres_box.toml"
SPHERES_SETS = {"time.steps": 40, "domain.cell_size": 0.03, "domain.patch_cells": 8, "output.history": "{ every = 3 }",
                "output.particles": f"{{ every = 15, fields = {FIELDS} }}", "output.grains": "{ every = 15 }",
                "output.track": "[63, 0]", "output.checkpoint": "{ every = 16, keep = 9 }"}
# A viscoelastic disk under pressure meets a plastic sheet in plane stress: all that a point can hold.
DISKS = ROOT / "cases" / "two_disks.toml"
DISKS_SETS = {"time.steps": 60, "domain.cells": "[25, 25]", "domain.patch_cells": 8, "output.history": "{ every = 3 }",
              "output.particles": f"{{ every = 20, fields = {FIELDS} }}", "output.track": "[1]",
              "output.contacts": "{ every = 20 }", "output.checkpoint": "{ every = 16, keep = 9 }",
              "materials.soft.model": '"viscoelastic"',
              "materials.soft.branch_moduli": "[300.0, 200.0]", "materials.soft.branch_times": "[0.002, 0.1]",
              "materials.sheet": '{ model = "von_mises", plane = "stress", density = 900.0, shear_modulus = 400.0, '
                                 'bulk_modulus = 900.0, yield_stress = 20.0 }',
              "bodies.0.initial_pressure": 40.0, "bodies.0.shape.centre": "[0.3537, 0.3613]",
              "bodies.0.velocity": "[1.0, 0.6]", "bodies.1.material": '"sheet"',
              "bodies.1.shape.centre": "[0.6441, 0.6329]", "bodies.1.velocity": "[-1.0, -0.8]"}
# Runs for a few seconds, so that signals find it at work.
LONG_SETS = SHEAR_SETS | {"time.steps": 2000, "output.history": "{ every = 5 }", "output.grains": "{ every = 400 }",
                          "output.particles": f"{{ every = 400, fields = {FIELDS} }}",
                          "output.checkpoint": "{ every = 60, keep = 2 }"}
WRONG_INPUT, FAILED, STOPPED = 2, 3, 4


@dataclasses.dataclass
class Bench:
    program: Program
    scratch: Path
    soak: bool
    random: random.Random
    problems: list[str] = dataclasses.field(default_factory=list)

    def expect(self, good: bool, text: str) -> bool:
        if not good:
            self.problems.append(text)
            print("PROBLEM:", text, flush=True)
        return good

    def run(self, case: Path, settings: dict, out: Path, *more, ranks: int = 1, **options):
        return self.program("run", case, "--out", out, *sets(settings), *more, ranks=ranks, **options)

    def same(self, a: Path, b: Path, what: str) -> None:
        """Both folders hold the same files with the same bits, and nothing under a temporary name."""
        names_a, names_b = compare_runs.result_files(a), compare_runs.result_files(b)
        lines = [f"files {sorted(names_a ^ names_b)}"] if names_a != names_b or not names_a else []
        lines += [f"{n}: {line}" for n in sorted(names_a & names_b) for line in compare_runs.compare_files(a / n,
                                                                                                           b / n)]
        if (a / "particles.hdf.series").read_bytes() != (b / "particles.hdf.series").read_bytes():
            lines.append("particles.hdf.series")
        lines += [f"left behind: {f.name}" for f in b.glob(".*")]
        self.expect(not lines, f"{what}: {lines[:5]}")


def checkpoints(folder: Path) -> list[Path]:
    return sorted(folder.glob("checkpoint_*.h5"))


def restarts(bench: Bench) -> Path:
    """From every checkpoint of three cases, on other numbers of ranks; returns the folder of the first case's run."""
    for name, case, settings in (("shear", SHEAR, SHEAR_SETS), ("spheres", SPHERES, SPHERES_SETS),
                                 ("disks", DISKS, DISKS_SETS)):
        whole = bench.scratch / name
        done = bench.run(case, settings, whole, ranks=2)
        bench.expect(done.code == 0, f"{name}: {done.code} {done.err}")
        for i, file in enumerate(checkpoints(whole)):
            ranks = (1, 3, 2)[i % 3]
            again = bench.scratch / f"{name}_{i}_{ranks}"
            shutil.copytree(whole, again)
            done = bench.run(case, settings, again, "--restart", again / file.name, ranks=ranks)
            bench.expect(done.code == 0 and f"going on from {again / file.name}" in done.out,
                         f"{name}: {done.code} {done.err}")
            bench.same(whole, again, f"{name} from {file.name} on {ranks} ranks")
            shutil.rmtree(again)
    return bench.scratch / "shear"


def start(bench: Bench, out: Path, ranks: int, *more) -> subprocess.Popen:
    command = bench.program.command("run", SHEAR, "--out", out, *sets(LONG_SETS), *more, ranks=ranks)
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def wait_for_rows(process: subprocess.Popen, out: Path, rows: int) -> None:
    """Until history.csv has grown by so many bytes, or the run has ended."""
    size = lambda: (out / "history.csv").stat().st_size if (out / "history.csv").exists() else 0  # noqa: E731
    began, limit = size(), time.monotonic() + 30 * PATIENCE
    while size() < began + rows and process.poll() is None and time.monotonic() < limit:
        time.sleep(0.005)


def signals(bench: Bench, whole: Path) -> None:
    """A chain of runs, each stopped by a signal, on 1, 2, 3 and 1 ranks."""
    out, more = bench.scratch / "signals", []
    for number, ranks in ((signal.SIGTERM, 1), (signal.SIGUSR1, 2), (signal.SIGUSR1, 3), (signal.SIGINT, 1)):
        process = start(bench, out, ranks, *more)
        wait_for_rows(process, out, bench.random.randrange(2000, 12000))
        process.send_signal(number)
        text, errors = process.communicate(timeout=60 * PATIENCE)
        what = f"{number.name} on {ranks} ranks"
        bench.expect(process.returncode == STOPPED, f"{what}: exit code {process.returncode} {errors}")
        bench.expect(f"stopped by {number.name}" in text and "--restart latest" in text.splitlines()[-1],
                     f"{what}: {text[-300:]}")
        more = ["--restart", "latest"]
    # The printed command resumes; a checkpoint at the wall limit is another way to stop.
    done = bench.run(SHEAR, LONG_SETS, out, "--set", "time.wall_limit=0.3", "--restart", "latest")
    bench.expect(done.code == STOPPED and "time.wall_limit" in done.out, f"wall limit: {done.code} {done.err}")
    command = text.splitlines()[-1].removeprefix("resume with: ")
    done = subprocess.run(command, shell=True, capture_output=True, text=True, timeout=120 * PATIENCE, check=False)
    bench.expect(done.returncode == 0, f"resumed: {done.returncode} {done.stderr}")
    bench.same(whole, out, "after four signals and a wall limit")


def children(pid: int) -> list[int]:
    """Processes that a process of this test has started."""
    found = []
    for entry in Path("/proc").iterdir():
        try:
            if entry.name.isdigit() and int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1]) == pid:
                found.append(int(entry.name))
        except OSError:
            pass  # it has ended
    return found


def kill(process: subprocess.Popen) -> None:
    """Ends every rank at once, without warning."""
    for pid in children(process.pid):
        try:
            os.kill(pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
    process.kill()
    process.communicate()


def kills(bench: Bench, whole: Path) -> None:
    """Killed at random moments again and again; what has its final name is whole each time."""
    out, count = bench.scratch / "kills", 100 if bench.soak else 10
    killed = writing = 0  # while a checkpoint was being written
    while killed < count:
        more = ["--restart", "latest"] if checkpoints(out) else ["--overwrite"] if out.exists() else []
        process = start(bench, out, bench.random.choice((1, 1, 2)), *more)
        wait_for_rows(process, out, bench.random.randrange(3000))
        time.sleep(bench.random.random() * 0.3)
        if process.poll() is not None:  # it has come to its end
            errors = process.communicate()[1]
            if not bench.expect(process.returncode == 0, f"restarted after kills: {process.returncode} {errors}"):
                return
            bench.same(whole, out, f"after {killed} kills")
            shutil.rmtree(out)
            continue
        kill(process)
        killed += 1
        writing += any(out.glob(".checkpoint_*.part"))
        for file in [*out.glob("*.h5"), *out.glob("*.vtkhdf")]:
            try:
                h5py.File(file).close()
            except OSError as error:
                bench.expect(False, f"after kill {killed}: {file.name}: {error}")
    more = ["--restart", "latest"] if checkpoints(out) else ["--overwrite"]
    done = bench.run(SHEAR, LONG_SETS, out, *more)
    bench.expect(done.code == 0, f"after all kills: {done.code} {done.err}")
    bench.same(whole, out, f"after {killed} kills")
    print(f"{killed} kills, {writing} of them while a checkpoint was being written", flush=True)
    bench.expect(writing > 0 or not bench.soak, "no kill came while a checkpoint was being written")


def damage(bench: Bench, whole: Path) -> None:
    """Single bytes changed, and files cut short: refused, with the file's name in one message."""
    good = checkpoints(whole)[-1].read_bytes()
    flips, cuts = (2000, 500) if bench.soak else (60, 20)

    def one(i: int, at: int, change: int) -> None:
        file, out = bench.scratch / f"damaged_{i}.h5", bench.scratch / f"from_damaged_{i}"
        if i < flips:
            data = bytearray(good)
            data[at] ^= change
            what = f"byte {at} of {len(good)} changed"
        else:
            data, what = good[:at], f"cut to {at} bytes of {len(good)}"
        file.write_bytes(data)
        done = bench.run(SHEAR, SHEAR_SETS, out, "--restart", file)
        lines = done.err.splitlines()
        bench.expect(done.code == WRONG_INPUT and len(lines) == 2 and str(file) in lines[0],
                     f"{what}: {done.code} {done.err}")
        bench.expect(not out.exists(), f"{what}: something was created")
        file.unlink()

    ends = [0, 7, 14, 21, 28, *(len(good) - 1 - 7 * i for i in range(5))]  # both ends are what decides first
    places = ends + [bench.random.randrange(len(good)) for _ in range(flips + cuts - len(ends))]
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        jobs = [pool.submit(one, i, at, bench.random.randrange(1, 256)) for i, at in enumerate(places)]
    for job in jobs:
        job.result()
    out = bench.scratch / "from_damaged"
    for other in (whole / "history.csv", whole / "particles_000000.vtkhdf", whole, bench.scratch / "nowhere"):
        done = bench.run(SHEAR, SHEAR_SETS, out, "--restart", other, ranks=2)
        bench.expect(done.code == WRONG_INPUT and str(other) in done.err, f"{other.name}: {done.code} {done.err}")


def latest_and_keep(bench: Bench, whole: Path) -> None:
    """A damaged last checkpoint is passed over; no more than asked for are kept; foreign folders are refused."""
    out = bench.scratch / "latest"
    shutil.copytree(whole, out)
    last = checkpoints(out)[-1]
    data = bytearray(last.read_bytes())
    data[len(data) // 2] ^= 1
    last.write_bytes(data)
    (out / ".checkpoint_000009.h5.part").write_bytes(b"left by a kill")
    done = bench.run(SHEAR, SHEAR_SETS, out, "--restart", "latest", ranks=2)
    before = checkpoints(out)[-2].name
    bench.expect(done.code == 0 and last.name in done.err and before in done.out, f"latest: {done.code} {done.err}")
    bench.same(whole, out, "from the last whole checkpoint")

    kept = bench.scratch / "kept"
    bench.run(SHEAR, SHEAR_SETS | {"output.checkpoint": "{ every = 20, keep = 2 }"}, kept)
    names = [f.name for f in checkpoints(kept)]
    bench.expect(names == [f.name for f in checkpoints(whole)][-2:], f"keep = 2 kept {names}")

    (kept / "history.csv").write_text("step,time\n")
    done = bench.run(SHEAR, SHEAR_SETS, kept, "--restart", "latest")
    bench.expect(done.code == WRONG_INPUT and "history.csv" in done.err, f"foreign history: {done.code} {done.err}")
    (kept / "history.csv").unlink()
    done = bench.run(SHEAR, SHEAR_SETS, kept, "--restart", "latest")
    bench.expect(done.code == WRONG_INPUT and "history.csv" in done.err, f"no history: {done.code} {done.err}")
    branch = bench.scratch / "branch"
    done = bench.run(SHEAR, SHEAR_SETS, branch, "--restart", checkpoints(whole)[1], ranks=3)
    bench.expect(done.code == 0, f"branch: {done.code} {done.err}")
    tail = (branch / "history.csv").read_text().splitlines()[1:]
    bench.expect(tail == (whole / "history.csv").read_text().splitlines()[-len(tail):], "the branch's history")
    done = bench.run(SHEAR, SHEAR_SETS, bench.scratch / "nothing", "--restart", "latest", ranks=2)
    bench.expect(done.code == WRONG_INPUT and not (bench.scratch / "nothing").exists(),
                 f"nothing: {done.code} {done.err}")


def changes(bench: Bench, whole: Path) -> None:
    """What may change at a restart, and what may not."""
    out, file = bench.scratch / "changed", checkpoints(whole)[0]
    for key, value, code, code_allowed in (
            ("contact.friction", 0.5, WRONG_INPUT, 0), ("materials.hmx.yield_stress", 0.2e9, WRONG_INPUT, 0),
            ("domain.patch_cells", 16, WRONG_INPUT, WRONG_INPUT), ("domain.cells",
                                                                   "[48, 50]", WRONG_INPUT, WRONG_INPUT),
            ("domain.upper", "[0.4e-3, 0.41e-3]", WRONG_INPUT, WRONG_INPUT), ("time.end", 5e-7, 0, 0),
            ("output.history",
             "{ every = 1 }", 0, 0), ("parallel.partition", '"round_robin"', 0, 0), ("title", '"x"', 0, 0)):
        for more, expected in (([], code), (["--allow-changes"], code_allowed)):
            done = bench.run(SHEAR, SHEAR_SETS | {"time.steps": 45, key: value}, out, "--restart", file, *more)
            good = done.code == expected and key in done.err + done.out and out.exists() == (expected == 0)
            bench.expect(good, f"{key} = {value} {more}: {done.code} {done.err} {done.out[-200:]}")
            shutil.rmtree(out, ignore_errors=True)
    # The same text with another table of grains.
    case = bench.scratch / "moved" / "case.toml"
    (case.parent / "packs").mkdir(parents=True)
    shutil.copy(SHEAR, case)
    table = (SHEAR.parent / "packs" / "shear36.csv").read_text().splitlines()
    for lines, expected in ((table, 0), (table[:-1], WRONG_INPUT)):
        (case.parent / "packs" / "shear36.csv").write_text("\n".join(lines) + "\n")
        done = bench.run(case, SHEAR_SETS, out, "--restart", file)
        bench.expect(done.code == expected, f"moved table of {len(lines)} lines: {done.code} {done.err}")
        shutil.rmtree(out, ignore_errors=True)


def guards(bench: Bench) -> None:
    """Energies that run away, and too little memory."""
    out = bench.scratch / "guards"
    done = bench.run(SHEAR, SHEAR_SETS | {"solver.energy_limit": 1e-9}, out, ranks=2)
    bench.expect(done.code == FAILED and "energy_limit" in done.err, f"energy limit: {done.code} {done.err}")
    bench.expect((out / "failure_particles.vtkhdf").exists(), "the state of the failure was not left")
    shutil.rmtree(out)
    if bench.program.sanitized:
        return
    limit = 1 << 31
    done = bench.run(SPHERES, {"domain.cell_size": 0.006, "solver.points_per_cell": 125}, out,
                     preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (limit, limit)))
    bench.expect(done.code == WRONG_INPUT and "memory" in done.err and not out.exists(),
                 f"memory: {done.code} {done.err}")


def full_disk(bench: Bench, whole: Path) -> None:
    """A checkpoint finds no room: exit code 3, nothing half written, and the run goes on once there is room."""
    disk = bench.scratch / "disk"
    disk.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=5m", "tmpfs", disk], check=False, capture_output=True)
    try:
        out = disk / "out"
        if mounted.returncode == 0:
            limit = {}
        else:  # files may not grow beyond a little more than the particles need
            limit = {"preexec_fn": lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (1_300_000, 1_300_000))}
        done = bench.run(SHEAR, SHEAR_SETS, out, ranks=2, **limit)
        bench.expect(done.code == FAILED and "cannot write" in done.err, f"full disk: {done.code} {done.err}")
        bench.expect(not list(out.glob(".*.part")), "a full disk left a temporary file")
        for file in [*out.glob("*.h5"), *out.glob("*.vtkhdf")]:
            h5py.File(file).close()
        if mounted.returncode == 0:
            bench.expect(len(checkpoints(out)) > 0, "no checkpoint was written before the disk was full")
            subprocess.run(["mount", "-o", "remount,size=64m", disk], check=True)
            done = bench.run(SHEAR, SHEAR_SETS, out, "--restart", "latest")
        else:
            done = bench.run(SHEAR, SHEAR_SETS, out, "--overwrite")
        bench.expect(done.code == 0, f"after a full disk: {done.code} {done.err}")
        bench.same(whole, out, "after a full disk")
        print(f"full disk: {'a small disk' if mounted.returncode == 0 else 'a limit on the size of files'}")
    finally:
        if mounted.returncode == 0:
            subprocess.run(["umount", disk], check=False)


def main() -> int:
    seed = int(os.environ.get("CAIRN_TEST_SEED", random.randrange(1 << 30)))
    bench = Bench(Program(sys.argv[1]), fresh_folder(sys.argv[2]), "--soak" in sys.argv[3:], random.Random(seed))
    print(f"CAIRN_TEST_SEED={seed}", flush=True)
    whole = restarts(bench)
    long = bench.scratch / "long"
    done = bench.run(SHEAR, LONG_SETS, long)
    bench.expect(done.code == 0, f"the long run: {done.code} {done.err}")
    parts = [(signals, long), (kills, long), (damage, whole), (latest_and_keep, whole), (changes, whole), (guards,),
             (full_disk, whole)]
    for part, *arguments in parts:
        began = time.monotonic()
        part(bench, *arguments)
        print(f"{part.__name__}: {time.monotonic() - began:.0f} s", flush=True)
    print(f"{len(bench.problems)} problems")
    return 1 if bench.problems else 0


if __name__ == "__main__":
    sys.exit(main())
