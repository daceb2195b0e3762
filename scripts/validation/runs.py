"""Runs of the program, kept in the output folder until the program, the case or the changes to it differ."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import shutil
import subprocess
import time
import tomllib
from pathlib import Path

from benchmarking.runner import environment
from validation import ROOT

CASES = ROOT / "cases"
LIMIT = 3600  # for one run [s]
NO_PARTICLES = {"output.particles": "{}"}


class RunFailed(Exception):
    """The program ended with an error; the message holds what it said."""


@dataclasses.dataclass(frozen=True)
class Run:
    """A case and the changes to it, as `cairn run --set` takes them."""

    case: str  # file in cases/, without .toml
    settings: dict = dataclasses.field(default_factory=dict)
    cost: float = 1.0  # about how long it takes alone [s]; only decides what is started first
    ranks: int | None = None  # None: as the command line says
    after: Run | None = None  # goes on from this run's last checkpoint

    def changed(self, settings: dict) -> Run:
        """The same run with further changes."""
        return dataclasses.replace(self, settings=self.settings | settings)


@dataclasses.dataclass
class Done:
    folder: Path
    seconds: float
    kept: bool  # from an earlier call


class Runner:
    """Runs cases with one program into one folder."""

    def __init__(self, program: Path, folder: Path, ranks: int = 1, fresh: bool = False):
        self.program, self.folder, self.ranks, self.fresh = program.resolve(), folder.resolve(), ranks, fresh
        self.identity = hashlib.sha256(self.program.read_bytes()).hexdigest()

    def stamp(self, run: Run) -> str:
        """All that a run's results depend on; not the number of ranks, on which they do not."""
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
                return Done(out, found["seconds"], True)
        before = self(f"{name}_before", run.after) if run.after else None
        shutil.rmtree(out, ignore_errors=True)
        out.parent.mkdir(parents=True, exist_ok=True)
        start = time.monotonic()
        self.execute(out, run, before)
        seconds = time.monotonic() - start
        stamp_file.write_text(json.dumps({"stamp": stamp, "seconds": seconds}), encoding="utf-8")
        return Done(out, seconds, False)

    def execute(self, out: Path, run: Run, before: Done | None) -> None:
        ranks = run.ranks or self.ranks
        command = ["mpirun", "--oversubscribe", "-n", str(ranks)] if ranks > 1 else []
        command += [str(self.program), "run", str(CASES / f"{run.case}.toml"), "--out", str(out)]
        if before:
            command += ["--restart", str(max(before.folder.glob("checkpoint_*.h5"))), "--allow-changes"]
        for key, value in run.settings.items():
            command += ["--set", f"{key}={value}"]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT, check=False,
                                  env=environment(ranks))
        except subprocess.TimeoutExpired:
            raise RunFailed(f"{out.name} took longer than {LIMIT} s") from None
        if done.returncode != 0:
            raise RunFailed(f"{out.name}: exit code {done.returncode}\n{done.stderr.strip() or done.stdout[-500:]}")
