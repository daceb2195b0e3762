"""Reading a run's CSV tables: columns over time, their values at a time, and their integrals."""

from __future__ import annotations

from pathlib import Path

import numpy as np

Table = dict[str, np.ndarray]


def read_table(file: Path) -> Table:
    """A CSV table with a header, as columns."""
    with open(file, encoding="utf-8") as text:
        names = text.readline().strip().split(",")
        rows = np.loadtxt(text, delimiter=",", ndmin=2)
    return {name: rows[:, column] for column, name in enumerate(names)}


def history(folder: Path) -> Table:
    return read_table(folder / "history.csv")


def motion(folder: Path, body: int) -> Table:
    """The rows of bodies.csv of one body."""
    table = read_table(folder / "bodies.csv")
    chosen = table["body"] == body
    return {name: column[chosen] for name, column in table.items()}


def at_time(table: Table, name: str, time: float) -> float:
    """The value of a column at a time, linear between rows; before the first and after the last row, theirs."""
    return float(np.interp(time, table["time"], table[name]))


def integral(table: Table, name: str, start: float, end: float) -> float:
    """The integral of a column over time, by the trapezium rule."""
    times = table["time"]
    inside = times[(times > start) & (times < end)]
    nodes = np.concatenate(([start], inside, [end]))
    return float(np.trapz(np.interp(nodes, times, table[name]), nodes))


def mean(table: Table, name: str, start: float, end: float) -> float:
    """The mean of a column over an interval of time."""
    return integral(table, name, start, end) / (end - start)


def crossing(times, values, level: float) -> float:
    """The first time at which the values rise to a level, linear between rows; NaN if they never do."""
    above = np.flatnonzero(np.asarray(values) >= level)
    if not len(above):
        return float("nan")
    k = above[0]
    if k == 0:
        return float(times[0])
    share = (level - values[k - 1]) / (values[k] - values[k - 1])
    return float(times[k - 1] + share * (times[k] - times[k - 1]))
