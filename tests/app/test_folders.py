"""Folders of results: nothing is replaced that the program did not write, one run at a time, and a folder that stands
alone.

    test_folders.py CAIRN SCRATCH [--soak]

--soak repeats what depends on timing many times.
"""

import concurrent.futures
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

from harness import PATIENCE, ROOT, Program, expect, expect_code, fresh_folder, load_compare_runs, sets

DISKS = ROOT / "cases" / "two_disks.toml"
SHEAR = ROOT / "cases" / "shear_small.toml"
FEW = sets({"time.steps": 3})
OUTPUTS = sets({"output.particles": "{ every = 2 }", "output.grains": "{ every = 2 }",
                "output.contacts": "{ every = 2 }", "output.track": "[0]", "output.checkpoint": "{ every = 2 }"})
LOCK = ".cairn.lock"


def contents(folder: Path) -> dict:
    """Every file of a folder: its bytes, or where a link leads."""
    return {str(p.relative_to(folder)): os.readlink(p) if p.is_symlink() else p.read_bytes()
            for p in folder.rglob("*") if p.is_symlink() or p.is_file()}


def refused(cairn: Program, here: Path, *arguments, words=(), ranks=1):
    """Exit code 2, and nothing in the folder has changed."""
    before = contents(here)
    expect_code(cairn(*arguments, cwd=here, ranks=ranks), 2, *words)
    changed = {name for name in before.keys() | contents(here).keys() if before.get(name) != contents(here).get(name)}
    expect(not changed, f"{arguments}: changed: {changed}")


def shear_beside(here: Path, table: str) -> Path:
    """A case of its own with a grain table of that name beside it."""
    shutil.copy(SHEAR.parent / "packs" / "shear36.csv", here / table)
    text = SHEAR.read_text()
    expect("packs/shear36.csv" in text, "the case has another table")
    (here / "case.toml").write_text("# mine\n" + text.replace("packs/shear36.csv", table))
    return here / "case.toml"


def test_own_case(cairn: Program, here: Path):
    """The case of the user is never replaced, whatever it is called and however the folder is named."""
    (here / "case.toml").write_text("# mine\n" + DISKS.read_text())
    for more in ([], ["--overwrite"]):
        for ranks in (1, 2):
            refused(cairn, here, "run", "case.toml", "--out", ".", *FEW, *more, ranks=ranks,
                    words=("case.toml: is the case of this run",))
    refused(cairn, here, "run", DISKS, "--out", ".", *FEW, words=("case.toml: was not written by cairn",))
    (here / "link").symlink_to(".")
    refused(cairn, here, "run", "case.toml", "--out", "link", *FEW, words=("case.toml",))
    (here / "case.toml").rename(here / "mine.toml")
    (here / "link").unlink()
    expect_code(cairn("run", "mine.toml", "--out", ".", *FEW, cwd=here), 0)
    expect((here / "mine.toml").read_text().startswith("# mine\n"), "the case was changed")
    # What the program wrote is replaced, and runs again into its own folder without a change.
    expect_code(cairn("run", "mine.toml", "--out", ".", *FEW, "--overwrite", cwd=here), 0)
    before = (here / "case.toml").read_bytes()
    expect_code(cairn("run", "case.toml", "--out", ".", "--overwrite", cwd=here), 0)
    expect(before == (here / "case.toml").read_bytes(), "case.toml changed")
    refused(cairn, here, "run", "case.toml", "--out", ".", *sets({"time.steps": 4}), "--overwrite",
            words=("is the case of this run",))


def test_foreign_files(cairn: Program, here: Path):
    """--overwrite removes what the program wrote, and refuses where other files have such names."""
    case = shear_beside(here, "bodies.csv").rename(here / "mine.toml")
    for more in ([], ["--overwrite"]):
        refused(cairn, here, "run", case, "--out", ".", *FEW, *more, words=("bodies.csv: was not written by cairn",))
    (here / "bodies.csv").rename(here / "table.csv")
    case.write_text(case.read_text().replace("bodies.csv", "table.csv"))
    out = here / "out"
    expect_code(cairn("run", case, "--out", "out", *FEW, *OUTPUTS, cwd=here), 0)
    foreign = {"history.csv": "time,mine\n", "particles.hdf.series": '{ "files": [] }', "grains_000007.h5": "text",
               "checkpoint_000009.h5": "\x89HDF\r\n\x1a\n" + "x" * 100, "failure_particles.vtkhdf": "mine"}
    for name, text in foreign.items():
        kept = (out / name).read_bytes() if (out / name).exists() else None
        (out / name).write_text(text)
        refused(cairn, here, "run", case, "--out", "out", *FEW, "--overwrite", words=(name, "was not written by cairn"))
        (out / name).unlink() if kept is None else (out / name).write_bytes(kept)
    (out / "view.hdf.series").write_text("a list of somebody else")
    (out / "history.csv").unlink()
    (out / "history.csv").symlink_to(here / "table.csv")
    refused(cairn, here, "run", case, "--out", "out", *FEW, "--overwrite", words=("history.csv: is a link",))
    (out / "history.csv").unlink()
    os.mkfifo(out / "history.csv")
    expect_code(cairn("run", case, "--out", "out", *FEW, "--overwrite", cwd=here), 2, "history.csv", "regular file")
    (out / "history.csv").unlink()
    expect_code(cairn("run", case, "--out", "out", *FEW, "--overwrite", cwd=here), 0)
    expect((out / "view.hdf.series").exists(), "the list of somebody else was removed")


def test_failure_file(cairn: Program, here: Path):
    """The state of a failure does not stay beside a run that succeeds."""
    fails = sets({"solver.energy_limit": 1e-12, "output.history": "{ every = 1 }"})
    expect_code(cairn("run", DISKS, "--out", "out", *fails, cwd=here), 3, "energy_limit")
    expect((here / "out" / "failure_particles.vtkhdf").exists(), "no state was left")
    (here / "out" / "history.csv").unlink()
    refused(cairn, here, "run", DISKS, "--out", "out", *FEW, words=("holds results", "--overwrite"))
    expect_code(cairn("run", DISKS, "--out", "out", *FEW, "--overwrite", cwd=here), 0)
    expect(not (here / "out" / "failure_particles.vtkhdf").exists(), "the state of an earlier failure is still there")


def test_pack_target(cairn: Program, here: Path):
    spec = '[pack]\nupper = [1.0, 1.0]\ncount = 20\n[sizes]\ntype = "uniform"\nmin = 0.05\nmax = 0.06\n'
    (here / "spec.toml").write_text(spec)
    (here / "mine.csv").write_text("x,y,r\n0,0,1\n")
    (here / "link.csv").symlink_to("mine.csv")
    os.mkfifo(here / "pipe.csv")
    for name in ("spec.toml", "mine.csv", "link.csv", "pipe.csv", "/dev/null"):
        expect_code(cairn("pack", "spec.toml", "-o", name, cwd=here), 2, "-o: ", Path(name).name)
    expect((here / "spec.toml").read_text() == spec and (here / "mine.csv").read_text().startswith("x,y,r"), "replaced")
    expect(Path("/dev/null").is_char_device(), "a device was replaced")
    for _ in range(2):  # its own table is replaced
        expect_code(cairn("pack", "spec.toml", "-o", "made.csv", cwd=here), 0)
    expect_code(cairn("pack", "spec.toml", "-o", "link", cwd=here), 0)


def test_links_under_temporary_names(cairn: Program, here: Path):
    """A link that somebody put under a temporary name is never followed."""
    victim = here / "victim"
    victim.write_text("precious\n")
    out = here / "out"
    out.mkdir()
    for name in ("case.toml", "particles_000000.vtkhdf", "particles.hdf.series", "grains_000000.h5",
                 "contacts_000000.h5", "checkpoint_000000.h5", "history.csv", "bodies.csv"):
        (out / f".{name}.part").symlink_to(victim)
    spec = '[pack]\nupper = [1.0, 1.0]\ncount = 9\n[sizes]\ntype = "uniform"\nmin = 0.05\nmax = 0.06\n'
    (here / "spec.toml").write_text(spec)
    (here / ".made.csv.part").symlink_to(victim)
    expect_code(cairn("run", DISKS, "--out", "out", *FEW, *OUTPUTS, cwd=here, ranks=2), 0)
    expect_code(cairn("pack", "spec.toml", "-o", "made.csv", cwd=here), 0)
    expect(victim.read_text() == "precious\n", "a link was followed")
    expect(not any(p.is_symlink() for p in out.iterdir() if not p.name.startswith(".")), "a result is a link")


def test_moved_folder(cairn: Program, here: Path):
    """The folder of the results runs again elsewhere, when the case and its tables are gone, with the same bits."""
    case = shear_beside(here, "grains é.csv")
    settings = sets({"time.steps": 12, "output.particles": "{ every = 6 }", "output.history": "{ every = 3 }"})
    expect_code(cairn("run", case, "--out", "out", *settings, cwd=here), 0)
    text = (here / "out" / "case.toml").read_text()
    expect('file = "case_grains_0.csv"' in text and str(here) not in text, text)
    case.unlink()
    (here / "grains é.csv").unlink()
    (here / "elsewhere").mkdir()
    moved = here / "elsewhere" / "moved"
    (here / "out").rename(moved)
    expect_code(cairn("run", moved / "case.toml", "--out", "again", cwd=here / "elsewhere"), 0)
    again = here / "elsewhere" / "again"
    names = {p.name for p in moved.iterdir()}
    expect(names == {p.name for p in again.iterdir()}, names)
    for name in names - {"run.json"}:  # which tells the two runs apart
        expect((moved / name).read_bytes() == (again / name).read_bytes(), f"{name} differs")
    expect_code(cairn("run", moved / "case.toml", "--out", moved, "--overwrite", cwd=here), 0)  # into itself
    results = [{name: text for name, text in contents(folder).items() if name != "run.json"}
               for folder in (moved, again)]
    expect(results[0] == results[1], "running into its own folder changed it")


def running(cairn: Program, here: Path, *more, ranks=1) -> subprocess.Popen:
    """A run that is at work."""
    at_rest = {"time.steps": 10**9, "time.end": 1e9, "bodies.0.velocity": "[0.0, 0.0]",
               "bodies.1.velocity": "[0.0, 0.0]"}
    command = cairn.command("run", DISKS, "--out", "out", *sets(at_rest), *more, ranks=ranks)
    process = subprocess.Popen(command, cwd=here, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    limit = time.monotonic() + 30 * PATIENCE
    history = here / "out" / "history.csv"
    while (not history.exists() or history.stat().st_size < 500) and process.poll() is None:
        expect(time.monotonic() < limit, "the run does not begin")
        time.sleep(0.01)
    expect(process.poll() is None, f"the run has ended: {process.returncode}")
    return process


def test_lock(cairn: Program, here: Path):
    """A second run is refused while the first lives, and not once it has ended, however that was."""
    for ranks in (1, 2):
        process = running(cairn, here, ranks=ranks)
        held = (here / "out" / LOCK).read_text()
        expect(held.startswith("process ") and os.uname().nodename in held, held)
        for more in ([], ["--overwrite"], ["--restart", "latest"]):
            expect_code(cairn("run", DISKS, "--out", "out", *FEW, *more, cwd=here, ranks=3 - ranks), 2,
                        "another run writes there", held.split()[1], os.uname().nodename)
        process.send_signal(signal.SIGKILL)
        process.communicate()
        pid, limit = int(held.split()[1]), time.monotonic() + 20 * PATIENCE
        while Path(f"/proc/{pid}").exists() and time.monotonic() < limit:  # mpirun's ranks end after it
            time.sleep(0.05)
        expect_code(cairn("run", DISKS, "--out", "out", *FEW, "--overwrite", cwd=here), 0)
        expect(not (here / "out" / LOCK).exists(), "the lock is still there")
        shutil.rmtree(here / "out")


def test_signals(cairn: Program, here: Path):
    """Each of these ends a run with a checkpoint, from which it goes on; under nohup it outlives its terminal."""
    for number in (signal.SIGHUP, signal.SIGXCPU, signal.SIGUSR2):
        process = running(cairn, here)
        process.send_signal(number)
        text, errors = process.communicate(timeout=60 * PATIENCE)
        stopped = process.returncode == 4 and f"stopped by {number.name}" in text
        expect(stopped, f"{number}: {process.returncode} {errors}")
        expect(list((here / "out").glob("checkpoint_*.h5")), f"{number}: no checkpoint")
        shutil.rmtree(here / "out")
    ignored = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    process = running(cairn, here)
    signal.signal(signal.SIGHUP, ignored)
    process.send_signal(signal.SIGHUP)
    time.sleep(0.5)
    expect(process.poll() is None, "a run under nohup ended by SIGHUP")
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=60 * PATIENCE)
    expect(process.returncode == 4, f"exit code {process.returncode}")


def test_folder_removed(cairn: Program, here: Path):
    """A run whose history was deleted does not end as if all were well."""
    process = running(cairn, here, *sets({"output.particles": "{}", "output.track": "[]"}))
    shutil.rmtree(here / "out", ignore_errors=True)  # the run may still be making files
    _, errors = process.communicate(timeout=60 * PATIENCE)
    expect(process.returncode == 3 and "history.csv: it was removed" in errors, f"{process.returncode} {errors}")


def test_forbidden_folder(cairn: Program, here: Path):
    if os.geteuid() == 0:  # root may look everywhere: as somebody else
        as_other = {"user": 65534, "group": 65534, "extra_groups": []}
    else:
        as_other = {}
    (here / "closed").mkdir()
    (here / "closed").chmod(0o700 if as_other else 0)
    for name in ("closed/out", "closed"):
        done = cairn("run", DISKS, "--out", here / name, *FEW, **as_other)
        expect(done.code in (2, 126, 127), f"{name}: {done.code} {done.err}")
        if done.code == 2:
            expect(done.err.startswith("--out: ") and "filesystem error" not in done.err, done.err)
    (here / "closed").chmod(0o700)


def double_restarts(cairn: Program, here: Path, tries: int) -> str:
    """Two jobs go on from the same checkpoint at once: at most one of them ends well, and its files are right."""
    compare_runs = load_compare_runs()
    settings = sets({"time.steps": 60, "output.checkpoint": "{ every = 20, keep = 9 }",
                     "output.history": "{ every = 1 }", "output.particles": "{ every = 20 }"})
    expect_code(cairn("run", DISKS, "--out", "whole", *settings, cwd=here), 0)
    stopped = here / "stopped"
    shutil.copytree(here / "whole", stopped)
    for file in stopped.glob("checkpoint_*"):
        if file.name > "checkpoint_000000.h5":
            file.unlink()
    ended = {0: 0, 1: 0, 2: 0}
    for i in range(tries):
        out = here / "out"
        shutil.copytree(stopped, out)
        command = cairn.command("run", DISKS, "--out", out, *settings, "--restart", "latest", ranks=1)
        pair = [subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)]
        time.sleep((i % 5) * 0.02)
        pair.append(subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True))
        reports = [job.communicate(timeout=120 * PATIENCE) for job in pair]
        overlapped = sum("another run writes there" in err for _, err in reports)
        done = [job.returncode == 0 for job in pair]
        # Both may end well where the second began after the first had ended; then none was refused.
        expect(all(done) != bool(overlapped), f"try {i}: {[j.returncode for j in pair]} {reports}")
        expect(any(done), f"try {i}: none ended well: {reports}")
        ended[overlapped] += 1
        for name in sorted(compare_runs.result_files(here / "whole") | compare_runs.result_files(out)):
            lines = compare_runs.compare_files(here / "whole" / name, out / name)
            expect(not lines, f"try {i}: {name}: {lines}")
        shutil.rmtree(out)
    return f"{tries} double restarts: one was refused in {ended[1]}, both ended well one after the other in {ended[0]}"


def test_double_restarts(cairn: Program, here: Path):
    print(double_restarts(cairn, here, 50 if "--soak" in sys.argv[3:] else 8))


def main() -> int:
    cairn, scratch = Program(sys.argv[1]), fresh_folder(sys.argv[2])
    tests = {name: function for name, function in globals().items() if name.startswith("test_")}
    start = time.monotonic()

    def attempt(item):
        name, function = item
        here = scratch / name
        here.mkdir()
        try:
            function(cairn, here)
        except AssertionError as failure:
            return f"{name}: {failure}"
        return None

    tests_of_signals = tests.pop("test_signals")  # sets a handler: in the main thread
    failures = [attempt(("test_signals", tests_of_signals))]
    with concurrent.futures.ThreadPoolExecutor(4) as pool:
        failures += pool.map(attempt, tests.items())
    failures = [failure for failure in failures if failure]
    print("\n".join(failures))
    print(f"{len(tests) + 1} tests, {len(failures)} failed, {time.monotonic() - start:.0f} s")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
