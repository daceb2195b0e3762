"""What the tests of the whole program share: running it on any number of ranks, and comparing result folders."""

import dataclasses
import importlib.machinery
import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SKIP = 77  # exit code of a test that cannot run here
# What time limits are multiplied by: more with sanitizers, and where other work keeps the machine busy.
PATIENCE = float(os.environ.get("CAIRN_TEST_PATIENCE", "1"))

# Lines of Open MPI about an exit code that is not 0, and about a run that was stopped for a while from outside.
NOISE = ("(null): Forwarding signal", "-----", "Primary job", "a non-zero", "mpirun detected", "the job to be",
         "Process name", "Exit code", "Per user-direction")


@dataclasses.dataclass
class Done:
    """What a command did; code 'hang' if it did not end in time."""

    code: object
    out: str
    err: str  # without mpirun's own words

    @property
    def last(self) -> str:
        """The last line of standard output."""
        lines = self.out.splitlines()
        return lines[-1] if lines else ""


class Program:
    """The program under test, and how to run it."""

    def __init__(self, exe: str):
        self.exe = str(Path(exe).resolve())
        # The address sanitizer cannot live with a limit of the address space (ulimit -v).
        self.sanitized = b"__asan_init" in Path(self.exe).read_bytes()
        self.mpirun = os.environ.get("CAIRN_MPIRUN") or shutil.which("mpirun")
        if not self.mpirun:
            print("mpirun was not found")
            sys.exit(SKIP)
        for key, value in (("OMPI_ALLOW_RUN_AS_ROOT", "1"), ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"),
                           ("OMPI_MCA_mpi_yield_when_idle", "1"), ("OMPI_MCA_rmaps_base_oversubscribe", "1"),
                           ("OMPI_MCA_btl_vader_single_copy_mechanism", "none")):
            os.environ.setdefault(key, value)

    def command(self, *arguments, ranks: int = 1) -> list[str]:
        launcher = [] if ranks == 1 else [self.mpirun, "-n", str(ranks)]
        return launcher + [self.exe, *map(str, arguments)]

    def __call__(self, *arguments, ranks: int = 1, cwd: Path | None = None, timeout: float = 120, **options) -> Done:
        """Runs `cairn ARGUMENTS`; `options` go to subprocess.run."""
        process = subprocess.Popen(self.command(*arguments, ranks=ranks), cwd=cwd, stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, **options)
        try:
            out, err = process.communicate(timeout=timeout * PATIENCE)
        except subprocess.TimeoutExpired:
            return Done("hang", "", end(process))
        lines = err.decode(errors="replace").splitlines()
        text = "\n".join(line for line in lines if line.strip() and not line.strip().startswith(NOISE))
        return Done(process.returncode, out.decode(errors="replace"), text)


def end(process: subprocess.Popen) -> str:
    """Ends a program that hangs, and its ranks with it; says what they were waiting for: the state (T is stopped from
    outside), the processor time, and the system call."""
    show = ["ps", "-o", "pid,stat,time,wchan:20,comm", "--pid", str(process.pid), "--ppid", str(process.pid)]
    states = subprocess.run(show, capture_output=True, text=True, check=False).stdout
    process.terminate()  # mpirun ends its ranks then
    try:
        process.communicate(timeout=10 * PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
    return states


def sets(values: dict) -> list[str]:
    """{'time.steps': 5} as --set arguments; the values are TOML."""
    return [word for key, value in values.items() for word in ("--set", f"{key}={value}")]


def load_compare_runs():
    """scripts/compare-runs as a module; ends the test as skipped where its packages are missing."""
    for name in ("h5py", "numpy"):
        if importlib.util.find_spec(name) is None:
            print(f"Python lacks {name}")
            sys.exit(SKIP)
    path = str(ROOT / "scripts" / "compare-runs")
    loader = importlib.machinery.SourceFileLoader("compare_runs", path)
    spec = importlib.util.spec_from_loader("compare_runs", loader)
    module = importlib.util.module_from_spec(spec)
    dont_write, sys.dont_write_bytecode = sys.dont_write_bytecode, True  # no cache among the scripts
    loader.exec_module(module)
    sys.dont_write_bytecode = dont_write
    return module


def fresh_folder(path: str) -> Path:
    """An empty folder of that name."""
    folder = Path(path).resolve()
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder


def expect(condition, message) -> None:
    if not condition:
        raise AssertionError(message)


def expect_code(done: Done, code: int, *words: str) -> None:
    """The exit code, and words that the report must hold."""
    expect(done.code == code, f"exit code {done.code} instead of {code}\n{done.out}\n{done.err}")
    for word in words:
        expect(word in done.err, f"'{word}' is not in the report:\n{done.err}")


def run_tests(names: dict, cairn: Program, scratch: Path) -> int:
    """Calls every test_* of a module with the program and a folder of its own; the exit code."""
    tests = {name: function for name, function in names.items() if name.startswith("test_")}
    failures = []
    for name, function in tests.items():
        here = scratch / name
        here.mkdir()
        try:
            function(cairn, here)
        except AssertionError as failure:
            failures.append(f"{name}: {failure}")
    print("\n".join(failures))
    print(f"{len(tests)} tests, {len(failures)} failed")
    return 1 if failures else 0
