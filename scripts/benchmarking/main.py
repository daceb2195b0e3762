"""Times whole cases and prints them beside their targets; started by scripts/bench."""

import argparse
import shutil
import statistics
import sys
from pathlib import Path

import cases
import report
from report import Row
from runner import Program, Run, RunFailed, machine

ROOT = Path(__file__).resolve().parents[2]
FAST = {"solver.shape": '"linear"', "solver.stress_update": '"first"'}
DEFAULTS: dict[str, object] = {}  # GIMP, stress update "both"
VARIANTS = {"linear first": FAST, "gimp defaults": DEFAULTS}
QUIET = {f"output.{name}": "{}" for name in ("particles", "grains", "contacts", "checkpoint")}
# Million point-steps a second on one core of the machine the targets were set on.
BLOCK = {"linear last": ({"solver.shape": '"linear"', "solver.stress_update": '"last"'}, 11.0),
         "linear first": (FAST, 7.0), "gimp defaults": (DEFAULTS, 2.0)}
GRAINS = {2: {"linear first": 10.0, "gimp defaults": 4.5}, 3: {"linear first": 6.0, "gimp defaults": 1.5}}
BYTES_A_POINT = {2: 350.0, 3: 500.0}
FLAT, TWO_RANKS = 0.8, 1.8
LEAST_STEPS = 6


class Bench:
    def __init__(self, program: Program, arguments: argparse.Namespace, save):
        self.program, self.arguments, self.save = program, arguments, save
        self.folder = program.scratch
        self.rows: list[Row] = []
        self.triad = 0.0  # [bytes/s]

    def add(self, row: Row) -> None:
        self.rows.append(row)
        share = row.detail.get("bytes_per_point_step")
        if share and self.triad and row.value and row.unit == "M/s":
            row.detail["bandwidth_share"] = share * row.value * 1e6 / self.triad
        print(f"{row.name}: {report.number(row.value)} {row.unit} {report.bound(row)} {row.verdict}", flush=True)
        self.save(self.rows)

    def attempt(self, name: str, unit: str, measure) -> None:
        """Adds the rows that `measure` yields; a failure becomes a row and does not end the benchmark."""
        try:
            for row in measure():
                self.add(row)
        except RunFailed as error:
            print(f"{name}: {error}", file=sys.stderr)
            self.add(Row(name, None, unit))

    def steps(self, points: float, rate: float) -> int:
        """Steps that take about the time asked for at `rate` million points a second."""
        return max(LEAST_STEPS, round(self.arguments.seconds * rate * 1e6 / points))

    def timed(self, case: Path, variant: dict, points: float, rate: float, ranks: int = 1) -> Run:
        settings = {**variant, "time.steps": self.steps(points, rate)}
        runs = [self.program.run(case, settings, ranks) for _ in range(self.arguments.repeat)]
        return max(runs, key=lambda run: run.rate)

    def rate_row(self, name: str, run: Run, target: float, dimension: int, variant: dict) -> Row:
        update = str(variant.get("solver.stress_update", '"both"')).strip('"')
        spinning = "linear" not in str(variant.get("solver.shape"))  # the default of solver.spin
        return Row(name, run.rate, "M/s", target, detail={
            "points": run.done["points"], "steps": run.done["steps"], "energy_error": run.done["energy_error"],
            "shares": run.shares, "bytes_per_point_step": cases.bytes_per_point_step(dimension, update, spinning)})

    # The groups, in the order in which they run.

    def measure_triad(self):
        def measure():
            found = [b for b in self.program.bench("^triad$", 0.5) if b.get("bytes_per_second")]
            if not found:
                raise RunFailed("the kernel benchmarks have no triad")
            self.triad = max(b["bytes_per_second"] for b in found)
            yield Row("memory bandwidth, triad", 1e-9 * self.triad, "GB/s")

        self.attempt("memory bandwidth, triad", "GB/s", measure)

    def measure_block3d(self):
        cells = 16 if self.arguments.quick else 48
        case = cases.write_block(self.folder, cells)
        for variant, (settings, target) in BLOCK.items():
            name = f"block3d {variant}"

            def measure():
                run = self.timed(case, settings, 8 * cells**3, target)
                yield self.rate_row(name, run, target, 3, settings)

            self.attempt(name, "M/s", measure)

    def measure_grains(self, dimension: int, counts: list[int], points_each: int):
        rates: dict[tuple[str, int], Run] = {}
        for count in counts:
            case = cases.write_grains(self.folder, dimension, cases.lattice_of(count, dimension), count)
            for variant, settings in VARIANTS.items():
                name, target = f"grains{dimension}d {count} {variant}", GRAINS[dimension][variant]

                def measure():
                    run = rates[variant, count] = self.timed(case, settings, points_each * count, target)
                    yield self.rate_row(name, run, target, dimension, settings)

                self.attempt(name, "M/s", measure)
        largest = rates.get(("gimp defaults", counts[-1]))
        if largest:
            used = largest.peak_memory / largest.done["points"]
            self.add(Row(f"grains{dimension}d {counts[-1]} memory", used, "B/point", BYTES_A_POINT[dimension],
                         lower_is_better=True))
        return rates

    def measure_grains2d(self):
        counts = [64, 369, 1024] if self.arguments.quick else [64, 369, 4096, 65536]
        rates = self.measure_grains(2, counts, 208)
        for variant in VARIANTS:
            small, large = rates.get((variant, 369)), rates.get((variant, counts[-1]))
            if small and large:
                self.add(Row(f"flat {variant} {counts[-1]} over 369 grains", large.rate / small.rate, "", FLAT))
        largest = rates.get(("gimp defaults", counts[-1]))
        if largest:
            self.add(Row(f"setup of {counts[-1]} grains", largest.wall - largest.done["step_wall"], "s", 10.0,
                         lower_is_better=True))

    def measure_grains3d(self):
        self.measure_grains(3, [8, 64] if self.arguments.quick else [8, 64, 512], 2176)

    def measure_ranks(self):
        """Two ranks over one, in turn, so that a change of the machine's speed meets both."""
        for dimension, count, points in ((2, 1024 if self.arguments.quick else 4096, 208), (3, 64, 2176)):
            case = cases.write_grains(self.folder, dimension, cases.lattice_of(count, dimension), count)
            for variant, settings in VARIANTS.items():
                name = f"two ranks over one, grains{dimension}d {count} {variant}"

                def measure():
                    steps = {"time.steps": self.steps(points * count, GRAINS[dimension][variant])}
                    rates: dict[int, list[float]] = {1: [], 2: []}
                    for _ in range(3):
                        for ranks, list_of in rates.items():
                            list_of.append(self.program.run(case, {**settings, **steps}, ranks).rate)
                    medians = {ranks: statistics.median(list_of) for ranks, list_of in rates.items()}
                    yield Row(name, medians[2] / medians[1], "", TWO_RANKS, detail={"M/s": rates})

                self.attempt(name, "", measure)

    def measure_traffic(self):
        """Weak scaling by counting: what the busiest rank sends, also on more ranks than cores. Times mean nothing."""
        a = self.arguments
        each = 16 if a.quick else 64 if a.full else 32  # grains of a rank along each side
        for doublings in range(4 if a.quick else 6):
            ranks = 1 << doublings
            counts = (each << (doublings + 1) // 2, each << doublings // 2)
            case = cases.write_grains(self.folder, 2, counts, patch_cells=32)
            name = f"traffic on {ranks} ranks"

            def measure():
                run = self.program.run(case, {"time.steps": 4}, ranks)
                if run.sent is None:
                    raise RunFailed("the program reports no messages")
                yield Row(name, run.sent[1] / 1000, "kB/step", detail={
                    "table": "traffic", "ranks": ranks, "points": run.done["points"], "patch_cells": "32^2",
                    "messages": run.sent[0], "bytes": run.sent[1]})

            self.attempt(name, "kB/step", measure)

    def measure_shear(self):
        for name, settings, target in (
                ("linear", {}, 90.0), ("gimp defaults", {"solver.shape": '"gimp"', "contact.fill": 0.8}, 180.0)):
            label = f"shear to 80 %, 2 ranks, {name}"

            def measure():
                run = self.program.run(ROOT / "cases" / "shear.toml", {**QUIET, **settings}, 2)
                yield Row(label, run.done["wall"], "s", target, lower_is_better=True, detail={"shares": run.shares})

            self.attempt(label, "s", measure)

    def measure_output(self):
        """Cost of a file of points: what a run with three of them takes beyond one without, stepping left out."""
        side = 30 if self.arguments.quick else 220
        case = cases.write_grains(self.folder, 2, (side, side))
        name = f"particle file of {208e-6 * side**2:.2g} million points"

        def measure():
            steps = {"time.steps": 2}
            without = self.program.run(case, steps)
            written = self.program.run(case, {**steps, "output.particles": "{ every = 1 }"}, keep=True)
            out = self.folder / "out"
            files = sorted(out.glob("particles_*.vtkhdf"))
            size = sum(f.stat().st_size for f in files) / len(files) if files else 0
            shutil.rmtree(out, ignore_errors=True)
            if not files:
                raise RunFailed("no particle file was written")
            beyond = [run.done["wall"] - run.done["step_wall"] for run in (written, without)]
            yield Row(name, (beyond[0] - beyond[1]) / len(files), "s", 2.0, lower_is_better=True,
                      detail={"files": len(files), "bytes": size})

        self.attempt(name, "s", measure)

    def measure_kernels(self):
        def measure():
            for found in self.program.bench("-triad$", 0.02 if self.arguments.quick else 0.3):
                yield Row(found["name"], found["Mpoints"], "M/s", detail={"table": "kernel"})

        self.attempt("kernels", "M/s", measure)


GROUPS = ("triad", "block3d", "grains2d", "grains3d", "ranks", "traffic", "shear", "output", "kernels")
LONG = ("shear", "output", "kernels")  # only with --full
ALIASES = {"flat": "grains2d", "memory": "grains2d", "setup": "grains2d"}


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="scripts/bench", description="Times whole cases on this machine.",
                                     epilog="docs/performance.md says what the numbers mean.")
    parser.add_argument("--quick", action="store_true", help="small cases, a second each, to try the benchmark itself")
    parser.add_argument("--full", action="store_true", help=f"also {', '.join(LONG)}: half an hour")
    parser.add_argument("--only", metavar="NAME,...", help=f"of {', '.join([*GROUPS, *ALIASES])}")
    parser.add_argument("--json", type=Path, default=ROOT / "results" / "bench.json", metavar="FILE",
                        help="results; default %(default)s")
    parser.add_argument("--compare", type=Path, metavar="FILE", help="print ratios to these earlier results")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="write the tables between the marks of this file")
    parser.add_argument("--show", action="store_true", help="run nothing; show the results in --json")
    parser.add_argument("--seconds", type=float, metavar="S",
                        help="stepping time of a case at its target; default 6, quick 1")
    parser.add_argument("--repeat", type=int, default=1, metavar="N", help="best of N runs")
    parser.add_argument("--bin", type=Path, default=ROOT / "build" / "release" / "bin", metavar="DIR",
                        help="folder of the program and bench_kernels; default %(default)s, built first")
    a = parser.parse_args()
    a.seconds = a.seconds or (1.0 if a.quick else 6.0)
    names = a.only.split(",") if a.only else [g for g in GROUPS if a.full or g not in LONG]
    for name in names:
        if name not in GROUPS and name not in ALIASES:
            parser.error(f"--only: there is no '{name}'; choose from {', '.join([*GROUPS, *ALIASES])}")
    wanted = {ALIASES.get(name, name) for name in names}
    if wanted - {"traffic", "shear", "output", "kernels"}:
        wanted.add("triad")
    a.groups = [g for g in GROUPS if g in wanted]
    return a


def measure_all(a: argparse.Namespace) -> tuple[dict, list[Row]]:
    scratch = ROOT / "results" / "bench"
    scratch.mkdir(parents=True, exist_ok=True)
    program = Program(a.bin, scratch)
    here = machine()
    here["program"] = program.version()
    print(report.describe(here), flush=True)
    if here["load_at_start"] > 0.3:
        print("warning: other programs are running; the times below are not those of an idle machine", file=sys.stderr)
    bench = Bench(program, a, lambda rows: report.save(a.json, here, rows))
    for group in a.groups:
        getattr(bench, f"measure_{group}")()
    return here, bench.rows


def main() -> int:
    a = parse_arguments()
    try:
        earlier = {row.name: row for row in report.read(a.compare)[1]} if a.compare else None
        here, rows = report.read(a.json) if a.show else measure_all(a)
        print("\n" + "\n\n".join(report.as_text(t) for t in report.tables(rows, earlier)))
        if a.markdown:
            report.write_markdown(a.markdown, here, rows, earlier)
    except (RunFailed, OSError, ValueError, KeyError) as error:
        print(f"bench: {error}", file=sys.stderr)
        return 1
    return 1 if any(row.value is None for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
