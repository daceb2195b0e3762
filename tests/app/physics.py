"""What the physics tests share: running cases, reading their CSV tables, and a table of checks."""

import csv
import dataclasses
import math
from pathlib import Path

from harness import ROOT, Program, sets

NO_PARTICLES = {"output.particles": "{}"}
LIMIT = 580  # for one run [s]


@dataclasses.dataclass
class Check:
    """A measured quantity, what it should be, and the band in which it must lie."""

    quantity: str
    value: float
    low: float
    high: float
    expected: float | None = None

    @property
    def passed(self) -> bool:
        return self.low <= self.value <= self.high  # false for NaN

    def row(self) -> list[str]:
        expected = error = "-"
        if self.expected is not None:
            expected = f"{self.expected:.6g}"
            error = f"{self.value / self.expected - 1:+.3%}" if self.expected else f"{self.value:+.1e}"
        band = f"{self.low:.6g} to {self.high:.6g}"
        return [self.quantity, f"{self.value:.6g}", expected, error, band, "yes" if self.passed else "NO"]


def near(quantity: str, value: float, expected: float, relative: float) -> Check:
    """The value must be within a share of the expected one."""
    margin = relative * abs(expected)
    return Check(quantity, value, expected - margin, expected + margin, expected)


def below(quantity: str, value: float, limit: float) -> Check:
    """The value, which cannot be negative, must be at most so large."""
    return Check(quantity, value, 0.0, limit)


def report(checks: list[Check]) -> int:
    """Prints the table; returns the exit code."""
    rows = [["quantity", "value", "expected", "error", "band", "pass"]] + [check.row() for check in checks]
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    for row in rows:
        print("  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip())
    failed = sum(not check.passed for check in checks)
    print(f"{len(checks)} checks, {failed} outside their bands")
    return 1 if failed or not checks else 0


def run_case(program: Program, case: str | Path, out: Path, settings: dict, ranks: int = 1,
             timeout: float = LIMIT) -> Path:
    """Runs cases/CASE.toml, or a file, with the settings into a folder, which it returns."""
    file = case if isinstance(case, Path) else ROOT / "cases" / f"{case}.toml"
    done = program("run", file, "--out", out, *sets(settings), ranks=ranks, timeout=timeout)
    if done.code != 0:
        raise RuntimeError(f"{out.name}: exit code {done.code}\n{done.err or done.out[-500:]}")
    return out


def read_table(file: Path) -> dict[str, list[float]]:
    """A CSV table with a header, as columns."""
    with open(file, newline="", encoding="utf-8") as text:
        rows = csv.reader(text)
        names = next(rows)
        columns = zip(*[[float(word) for word in row] for row in rows])
        return {name: list(column) for name, column in zip(names, columns)}


def history(folder: Path) -> dict[str, list[float]]:
    return read_table(folder / "history.csv")


def motion(folder: Path, body: int) -> dict[str, list[float]]:
    """The rows of bodies.csv of one body."""
    table = read_table(folder / "bodies.csv")
    chosen = [row for row, number in enumerate(table["body"]) if number == body]
    return {name: [column[row] for row in chosen] for name, column in table.items()}


def at_time(table: dict[str, list[float]], name: str, time: float) -> float:
    """The value of a column at a time, linear between rows; the last row's time counts as reached."""
    times, values = table["time"], table[name]
    after = next((row for row, t in enumerate(times) if t >= time), len(times) - 1)
    if after == 0 or not math.isfinite(times[after]):
        return values[after]
    share = (time - times[after - 1]) / (times[after] - times[after - 1])
    return values[after - 1] + min(share, 1.0) * (values[after] - values[after - 1])


def integral(table: dict[str, list[float]], name: str, time: float) -> float:
    """The integral of a column over time from the start, by the trapezium rule."""
    times, values = table["time"], table[name]
    steps = zip(times, times[1:], values, values[1:])
    return sum((t1 - t0) * (v0 + v1) / 2 for t0, t1, v0, v1 in steps if t1 <= time * (1 + 1e-12))
