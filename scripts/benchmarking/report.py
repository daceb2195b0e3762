"""Results as rows with targets, as text, as Markdown and compared to earlier ones."""

import dataclasses
import json
from pathlib import Path

BEGIN, END = "<!-- bench: begin -->", "<!-- bench: end -->"


@dataclasses.dataclass
class Row:
    name: str
    value: float | None  # None: the run failed
    unit: str
    target: float | None = None
    lower_is_better: bool = False
    detail: dict = dataclasses.field(default_factory=dict)

    @property
    def verdict(self) -> str:
        if self.value is None:
            return "FAILED"
        if self.target is None:
            return ""
        return "met" if (self.value <= self.target if self.lower_is_better else self.value >= self.target) else "missed"


def number(value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:.0f}" if abs(value) >= 999.5 else f"{value:.3g}"


def bound(row: Row) -> str:
    if row.target is None:
        return ""
    return ("<= " if row.lower_is_better else ">= ") + number(row.target)


def save(path: Path, machine: dict, rows: list[Row]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    text = json.dumps({"machine": machine, "results": [dataclasses.asdict(row) for row in rows]}, indent=1)
    partial = path.with_name(path.name + ".partial")
    partial.write_text(text + "\n")
    partial.rename(path)


def read(path: Path) -> tuple[dict, list[Row]]:
    stored = json.loads(path.read_text())
    return stored["machine"], [Row(**row) for row in stored["results"]]


def describe(machine: dict) -> str:
    return (f"{machine['processor']}, {machine['cores']} cores, {machine['memory_bytes'] / 2**30:.0f} GiB; "
            f"{machine.get('program', '')}; load at start {machine['load_at_start']:.2f}; {machine['date']}")


def ratio(row: Row, earlier: dict[str, Row] | None) -> list[str]:
    """The cell that compares a row to the earlier one of its name; none where nothing is compared."""
    if earlier is None:
        return []
    before = earlier.get(row.name)
    return [number(row.value / before.value) if row.value is not None and before and before.value else "-"]


def result_table(rows: list[Row], earlier: dict[str, Row] | None) -> list[list[str]]:
    table = [["case", "here", "unit", "target", "", "of triad"] + (["over earlier"] if earlier is not None else [])]
    for row in rows:
        if row.detail.get("table"):
            continue
        share = row.detail.get("bandwidth_share")
        line = [row.name, number(row.value), row.unit, bound(row), row.verdict, f"{100 * share:.0f} %" if share else ""]
        table.append(line + ratio(row, earlier))
    return table


def stage_table(rows: list[Row]) -> list[list[str]]:
    """Where the time of each case goes [%]."""
    timed = [row for row in rows if row.detail.get("shares")]
    stages = list(timed[0].detail["shares"]) if timed else []
    return [["time of rank 0 [%]", *stages]] + [
        [row.name, *(number(row.detail["shares"].get(stage)) for stage in stages)] for row in timed]


def traffic_table(rows: list[Row]) -> list[list[str]]:
    header = ["ranks", "points", "patches' cells", "messages a step", "kB a step", "bytes a point-step"]
    return [header] + [
        [str(d["ranks"]), number(d["points"]), str(d["patch_cells"]), number(d["messages"]), number(d["bytes"] / 1000),
         number(d["bytes"] * d["ranks"] / d["points"])]
        for row in rows if (d := row.detail).get("table") == "traffic"]


def kernel_table(rows: list[Row], earlier: dict[str, Row] | None) -> list[list[str]]:
    header = ["kernel", "Mpoints/s"] + (["over earlier"] if earlier is not None else [])
    return [header] + [[row.name, number(row.value), *ratio(row, earlier)]
                       for row in rows if row.detail.get("table") == "kernel"]


def tables(rows: list[Row], earlier: dict[str, Row] | None) -> list[list[list[str]]]:
    all_tables = [result_table(rows, earlier), stage_table(rows), traffic_table(rows), kernel_table(rows, earlier)]
    return [table for table in all_tables if len(table) > 1]


def as_text(table: list[list[str]]) -> str:
    widths = [max(len(line[k]) for line in table) for k in range(len(table[0]))]
    sides = ["<"] + [">"] * (len(widths) - 1)
    return "\n".join("  ".join(f"{word:{s}{w}}" for word, s, w in zip(line, sides, widths)).rstrip() for line in table)


def as_markdown(table: list[list[str]]) -> str:
    lines = [[word or " " for word in line] for line in table]
    lines.insert(1, ["---"] + ["---:"] * (len(table[0]) - 1))
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def write_markdown(path: Path, machine: dict, rows: list[Row], earlier: dict[str, Row] | None) -> None:
    """Puts the tables between the two marks of a file, or into a new file."""
    body = "\n\n".join([describe(machine), *(as_markdown(t) for t in tables(rows, earlier))])
    text = path.read_text() if path.exists() else f"{BEGIN}\n{END}\n"
    if text.count(BEGIN) != 1 or text.count(END) != 1:
        raise ValueError(f"{path}: the lines '{BEGIN}' and '{END}' must stand in it once each, around the tables")
    before, rest = text.split(BEGIN)
    path.write_text(f"{before}{BEGIN}\n\n{body}\n\n{END}{rest.split(END)[1]}")
