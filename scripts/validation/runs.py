"""Runs of the program, kept in the output folder until the program, the case or the changes to it differ."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
import shutil
import signal
import subprocess
import threading
import time
import tomllib
from pathlib import Path

from benchmarking.runner import environment
from validation import ROOT

CASES = ROOT / "cases"
LIMIT = 3600  # for one run [s]
NO_PARTICLES = {"output.particles": "{}"}


def digest(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


class RunFailed(Exception):
    """The program ended with an error; the message holds what it said."""


@dataclasses.dataclass(frozen=True)
class Run:
    """A case and the changes to it, as `cairn run --set` takes them; or another program of the same build."""

    case: str = ""  # file in cases/, without .toml
    settings: dict = dataclasses.field(default_factory=dict)
    cost: float = 1.0  # about how long it takes alone [s]; only decides what is started first
    ranks: int | None = None  # None: as the command line says
    after: Run | None = None  # goes on from this run's last checkpoint
    tool: tuple[str, ...] = ()  # instead of a case: a program in the build folder, and its options; prints to log.txt

    def changed(self, settings: dict) -> Run:
        """The same run, and the one before it, with further changes."""
        after = self.after.changed(settings) if self.after else None
        return dataclasses.replace(self, settings=self.settings | settings, after=after)


@dataclasses.dataclass
class Done:
    folder: Path
    seconds: float
    processor: float  # time of all cores together [s]
    kept: bool  # from an earlier call


class Runner:
    """Runs cases with one program into one folder."""

    def __init__(self, program: Path, folder: Path, ranks: int = 1, fresh: bool = False):
        self.program, self.folder, self.ranks, self.fresh = program.resolve(), folder.resolve(), ranks, fresh
        self.identity = digest(self.program)

    def tool(self, run: Run) -> Path:
        """Raises RunFailed where it was not built."""
        path = self.program.parents[1] / run.tool[0]
        if not path.is_file():
            raise RunFailed(f"there is no {path}, which is built with the tests")
        return path

    def stamp(self, run: Run) -> str:
        """All that a run's results depend on; not the number of ranks, on which they do not."""
        if run.tool:
            return f"{digest(self.tool(run))} {' '.join(run.tool)}"
        file = CASES / f"{run.case}.toml"
        case = tomllib.loads(file.read_text(encoding="utf-8"))  # comments do not matter
        tables = [(file.parent / grains["file"]).read_text(encoding="utf-8") for grains in case.get("grains", [])]
        earlier = self.stamp(run.after) if run.after else ""
        parts = [self.identity, *tables, str(run.ranks), earlier,
                 *(json.dumps(table, sort_keys=True) for table in (case, run.settings))]
        return hashlib.sha256("\0".join(parts).encode()).hexdigest()

    def __call__(self, name: str, run: Run) -> Done:
        """Results of a run, from an earlier call if nothing has changed. Raises RunFailed."""
        out, stamp = self.folder / name, self.stamp(run)
        stamp_file = out / "stamp.json"
        if not self.fresh and stamp_file.is_file():
            found = json.loads(stamp_file.read_text(encoding="utf-8"))
            if found["stamp"] == stamp:
                return Done(out, found["seconds"], found["processor"], True)
        before = self(f"{name}_before", run.after) if run.after else None
        shutil.rmtree(out, ignore_errors=True)
        out.parent.mkdir(parents=True, exist_ok=True)
        start = time.monotonic()
        processor = self.execute(out, run, before) + (before.processor if before else 0.0)
        seconds = time.monotonic() - start
        stamp_file.write_text(json.dumps({"stamp": stamp, "seconds": seconds, "processor": processor}),
                              encoding="utf-8")
        return Done(out, seconds, processor, False)

    def execute(self, out: Path, run: Run, before: Done | None) -> float:
        """Returns the processor time [s]."""
        if run.tool:
            out.mkdir()
            return self.call(out, [str(self.tool(run)), *run.tool[1:]], 1)
        ranks = run.ranks or self.ranks
        command = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
        command += [str(self.program), "run", str(CASES / f"{run.case}.toml"), "--out", str(out)]
        if before:
            command += ["--restart", str(max(before.folder.glob("checkpoint_*.h5"))), "--allow-changes"]
        for key, value in run.settings.items():
            command += ["--set", f"{key}={value}"]
        return self.call(out, command, ranks)

    @staticmethod
    def call(out: Path, command: list[str], ranks: int) -> float:
        """Raises RunFailed; returns the processor time [s]."""
        log = out.parent / f"{out.name}.log"
        with open(log, "w", encoding="utf-8") as text:
            process = subprocess.Popen(command, stdout=text, stderr=subprocess.STDOUT, env=environment(ranks))
            alarm = threading.Timer(LIMIT, process.kill)
            alarm.start()
            _, status, usage = os.wait4(process.pid, 0)  # tells the processor time of this run alone
            alarm.cancel()
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode != 0:
            how = "took too long" if process.returncode == -signal.SIGKILL else f"exit code {process.returncode}"
            raise RunFailed(f"{out.name}: {how}\n{log.read_text(encoding='utf-8')[-500:].strip()}")
        log.replace(out / "log.txt")
        return usage.ru_utime + usage.ru_stime
