"""The table of results: as text, as Markdown and as JSON."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path

from validation.checks import Check
from validation.suite import LITERAL, Outcome

HEADER = ["case", "quantity", "value", "expected", "error", "band", "pass"]


def as_text(rows: list[list[str]]) -> str:
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    return "\n".join("  ".join(word.ljust(width) for word, width in zip(row, widths)).rstrip() for row in rows)


def as_markdown(rows: list[list[str]]) -> str:
    lines = [rows[0], ["---"] * len(rows[0]), *rows[1:]]
    return "\n".join("| " + " | ".join(word.replace("|", "\\|") or " " for word in line) + " |" for line in lines)


def literal_table(outcome: Outcome) -> list[list[str]]:
    """What the papers' own forms give, one column each: the error where a value is expected, else the value."""
    def shown(check: Check | None) -> str:
        if check is None or not math.isfinite(check.value):
            return "failed"
        text = f"{check.value:.4g}" if check.error is None or not check.expected else f"{check.error:+.1%}"
        return text if check.passed else f"{text} (out)"

    columns = {form: {(check.case, check.quantity): check for check in checks}
               for form, checks in outcome.literal.items()}
    wanted = {key for found in columns.values() for key in found if not key[1].startswith(("run failed", "no eval"))}
    rows = [["case", "quantity", "default", *columns]]
    for check in outcome.checks:
        key = check.case, check.quantity
        if key in wanted:
            rows.append([*key, shown(check), *(shown(found.get(key)) for found in columns.values())])
    return rows


def summary(outcomes: list[Outcome]) -> str:
    checks = [check for outcome in outcomes for check in outcome.checks]
    banded = [check for check in checks if not check.recorded or not check.passed]
    missed = sum(not check.passed for check in banded)
    return f"{len(banded)} bands, {missed} missed; {len(checks) - len(banded)} values recorded"


def text(outcomes: list[Outcome]) -> str:
    parts = []
    for outcome in outcomes:
        parts.append(f"{outcome.problem.name}: {outcome.problem.title} ({outcome.problem.source})")
        parts.append(as_text([HEADER] + [check.row() for check in outcome.checks]))
    missed = [[outcome.problem.name, *check.row()] for outcome in outcomes for check in outcome.checks
              if not check.passed]
    if missed:
        parts += ["Missed:", as_text([["problem", *HEADER], *missed])]
    return "\n\n".join([*parts, summary(outcomes)])


def markdown(outcomes: list[Outcome]) -> str:
    parts = [summary(outcomes) + "."]
    for outcome in outcomes:
        parts.append(f"### {outcome.problem.title}\n\n`{outcome.problem.name}`; {outcome.problem.source}.")
        parts.append(as_markdown([HEADER] + [check.row() for check in outcome.checks]))
        if outcome.literal:
            forms = "; ".join(f"*{form}*: " + ", ".join(f"`{key}` = {value}".replace('"', "")
                                                         for key, value in LITERAL[form].items())
                              for form in outcome.literal)
            parts.append(f"In the papers' own forms ({forms}); (out): outside the band of the default.")
            parts.append(as_markdown(literal_table(outcome)))
    return "\n\n".join(parts) + "\n"


def as_json(outcomes: list[Outcome], about: dict) -> str:
    def rows(checks: list[Check]) -> list[dict]:
        return [{name: value if not isinstance(value, float) or math.isfinite(value) else None
                 for name, value in dataclasses.asdict(check).items()} | {"passed": check.passed} for check in checks]

    problems = [{"name": outcome.problem.name, "title": outcome.problem.title, "source": outcome.problem.source,
                 "checks": rows(outcome.checks),
                 "literal": {form: rows(checks) for form, checks in outcome.literal.items()},
                 "pictures": [path.name for path in outcome.pictures]} for outcome in outcomes]
    return json.dumps({"about": about, "problems": problems}, indent=1) + "\n"


def write(outcomes: list[Outcome], about: dict, out: Path, page: Path | None) -> None:
    """results.md and results.json in `out`; with a page, the tables between its two marks as well."""
    out.mkdir(parents=True, exist_ok=True)
    tables = markdown(outcomes)
    head = f"`{about['command']}`, {about['date']}, {about['program']}: {about['wall']:.0f} s."
    (out / "results.md").write_text(f"# Validation\n\n{head} {tables}", encoding="utf-8")
    (out / "results.json").write_text(as_json(outcomes, about), encoding="utf-8")
    if page:
        replace_between_marks(page, f"{head} {tables}")


BEGIN, END = "<!-- validate: begin -->", "<!-- validate: end -->"


def replace_between_marks(page: Path, body: str) -> None:
    before, rest = page.read_text(encoding="utf-8").split(BEGIN)
    page.write_text(f"{before}{BEGIN}\n\n{body}\n{END}{rest.split(END)[1]}", encoding="utf-8")
