"""Runs of the program and what they report."""

import dataclasses
import json
import os
import re
import shutil
import subprocess
import tempfile
import time
from pathlib import Path


class RunFailed(Exception):
    pass


@dataclasses.dataclass
class Run:
    """One run: the numbers of its `done` line, and what was seen from outside."""

    done: dict[str, float]
    wall: float  # of the whole process [s]
    peak_memory: int  # largest resident size of the process, or of one rank [bytes]
    shares: dict[str, float]  # time of rank 0 by stage [%]
    sent: tuple[float, float] | None  # most messages and bytes a step sent by a rank

    @property
    def rate(self) -> float:
        """Million point-steps a second."""
        return 1e-6 * self.done["point_steps_per_s"]


def environment(ranks: int) -> dict[str, str]:
    variables = dict(os.environ)
    if os.getuid() == 0:  # as in scripts/common.sh
        variables.update(OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1",
                         OMPI_MCA_btl_vader_single_copy_mechanism="none")
    if ranks > (os.cpu_count() or 1):
        variables.update(OMPI_MCA_mpi_yield_when_idle="1", OMPI_MCA_rmaps_base_oversubscribe="1")
    return variables


class Program:
    def __init__(self, folder: Path, scratch: Path):
        self.cairn = folder / "cairn"
        self.kernels = folder / "bench_kernels"
        self.scratch = scratch
        if not self.cairn.is_file():
            raise RunFailed(f"there is no {self.cairn}; build first: scripts/build")

    def version(self) -> str:
        done = subprocess.run([self.cairn, "--version"], capture_output=True, text=True, env=environment(1),
                              check=False)
        return ", ".join(" ".join(line.split()) for line in done.stdout.splitlines() if line.strip())

    def run(self, case: Path, settings: dict[str, object], ranks: int = 1, keep: bool = False) -> Run:
        """Runs a case; its results are removed unless `keep`."""
        out = self.scratch / "out"
        launcher = [] if ranks == 1 else ["mpirun", "-n", str(ranks)]
        command = [*launcher, str(self.cairn), "run", str(case), "--out", str(out), "--overwrite", "--profile"]
        for key, value in settings.items():
            command += ["--set", f"{key}={value}"]
        with tempfile.TemporaryFile() as stdout, tempfile.TemporaryFile() as stderr:
            start = time.monotonic()
            # wait4 gives the peak memory of this very process, which subprocess.run does not.
            process = subprocess.Popen(command, stdout=stdout, stderr=stderr, env=environment(ranks))
            try:
                _, status, usage = os.wait4(process.pid, 0)
            except BaseException:
                process.kill()
                raise
            wall = time.monotonic() - start
            process.returncode = os.waitstatus_to_exitcode(status)
            texts = []
            for stream in (stdout, stderr):
                stream.seek(0)
                texts.append(stream.read().decode(errors="replace"))
        if not keep:
            shutil.rmtree(out, ignore_errors=True)
        lines = texts[0].splitlines()
        if process.returncode != 0 or not lines or not lines[-1].startswith("done "):
            raise RunFailed(f"{' '.join(command)}: exit code {process.returncode}\n{texts[1].strip()[-2000:]}")
        return parse(lines, wall, 1024 * usage.ru_maxrss)

    def bench(self, pattern: str, seconds: float) -> list[dict]:
        """Results of the kernel benchmarks that match, each timed for at least `seconds`."""
        if not self.kernels.is_file():
            raise RunFailed(f"there is no {self.kernels}: Google Benchmark was not found when the program was built")
        done = subprocess.run([self.kernels, f"--benchmark_filter={pattern}",
                               f"--benchmark_min_time={seconds}", "--benchmark_format=json"],
                              capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise RunFailed(f"{self.kernels}: {done.stderr.strip()}")
        return json.loads(done.stdout)["benchmarks"]


def parse(lines: list[str], wall: float, peak_memory: int) -> Run:
    done = {}
    for word in lines[-1].split()[1:]:
        key, value = word.split("=", 1)
        done[key] = float(value)
    shares, sent = {}, None
    for line in lines:
        if line.startswith("time of rank 0:"):
            shares = {name: float(value) for name, value in re.findall(r"(\w+) ([\d.]+) %", line)}
        found = re.match(r"most sent by a rank: ([\d.]+) messages and ([\d.]+) bytes a step", line)
        if found:
            sent = (float(found[1]), float(found[2]))
    return Run(done, wall, peak_memory, shares, sent)


def machine() -> dict[str, object]:
    """What the numbers were measured on."""
    model, memory = "unknown", 0
    try:
        text = Path("/proc/cpuinfo").read_text()
        model = re.search(r"model name\s*:\s*(.*)", text)[1]
        # Virtual machines hide the name; family and model still tell the generation.
        numbers = [re.search(rf"^{key}\s*:\s*(\d+)", text, re.MULTILINE)[1] for key in ("cpu family", "model")]
        model += f" (family {numbers[0]}, model {numbers[1]})"
        memory = int(re.search(r"MemTotal:\s*(\d+)", Path("/proc/meminfo").read_text())[1]) * 1024
    except (OSError, TypeError):
        pass
    return {"processor": model, "cores": os.cpu_count(), "memory_bytes": memory,
            "load_at_start": os.getloadavg()[0], "date": time.strftime("%Y-%m-%d %H:%M")}
