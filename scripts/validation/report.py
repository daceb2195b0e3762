"""The table of results: as text, as Markdown and as JSON."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path

from validation.checks import Check
from validation.suite import FORMS, LITERAL, SETTINGS, Outcome

HEADER = ["case", "quantity", "value", "expected", "error", "band", "pass"]


def as_text(rows: list[list[str]]) -> str:
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    return "\n".join("  ".join(word.ljust(width) for word, width in zip(row, widths)).rstrip() for row in rows)


def as_markdown(rows: list[list[str]]) -> str:
    lines = [rows[0], ["---"] * len(rows[0]), *rows[1:]]
    return "\n".join("| " + " | ".join(word.replace("|", "\\|") or " " for word in line) + " |" for line in lines)


Key = tuple[str, str]  # case and quantity


def by_key(checks: list[Check]) -> dict[Key, Check]:
    return {(check.case, check.quantity): check for check in checks}


def in_forms(outcome: Outcome) -> dict[Key, Check]:
    """The checks of the defaults that some other form repeats."""
    wanted = {key for checks in outcome.forms.values() for key in by_key(checks)}
    return {key: check for key, check in by_key(outcome.checks).items() if key in wanted}


def forms_table(outcome: Outcome, forms: list[str]) -> list[list[str]]:
    """What other forms give, one column each: the error where a value is expected, else the value."""
    def shown(check: Check | None) -> str:
        if check is None or not math.isfinite(check.value):
            return "failed"
        text = f"{check.value:.4g}" if check.error is None or not check.expected else f"{check.error:+.1%}"
        return text if check.passed else f"{text} (out)"

    columns = [by_key(outcome.forms[form]) for form in forms]
    return [["case", "quantity", "default", *forms]] + [
        [*key, shown(check), *(shown(column.get(key)) for column in columns)]
        for key, check in in_forms(outcome).items()]


def overview(outcomes: list[Outcome]) -> list[list[str]]:
    """For each problem, how many of the bands that forms repeat the default misses, and each form."""
    rows = [["problem", "bands", "default", *FORMS]]
    for outcome in outcomes:
        banded = {key for key, check in in_forms(outcome).items() if not check.recorded}
        if not banded:
            continue
        def missed(checks: list[Check]) -> str:
            found = by_key(checks)
            return str(sum(key not in found or not found[key].passed for key in banded))
        rows.append([outcome.problem.name, str(len(banded)), missed(outcome.checks),
                     *(missed(outcome.forms[form]) if form in outcome.forms else "-" for form in FORMS)])
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


def keys_of(forms: dict[str, dict]) -> str:
    return "\n".join(f"- *{form}*: " + ", ".join(f"`{key}` = {value}".replace('"', "") for key, value in keys.items())
                     for form, keys in forms.items())


GROUPS = {"In the papers' own forms": LITERAL, "With other choices of the solver": SETTINGS}


def markdown(outcomes: list[Outcome]) -> str:
    parts = [summary(outcomes) + "."]
    if len(rows := overview(outcomes)) > 1:
        parts += ["### Other forms and settings\n\nBands missed, of those of the runs that were repeated. The papers' "
                  "own forms of contact:", keys_of(LITERAL), "and other choices of the solver:", keys_of(SETTINGS),
                  as_markdown(rows)]
    for outcome in outcomes:
        parts.append(f"### {outcome.problem.title}\n\n`{outcome.problem.name}`; {outcome.problem.source}.")
        parts.append(as_markdown([HEADER] + [check.row() for check in outcome.checks]))
        for title, group in GROUPS.items():
            if forms := [form for form in group if form in outcome.forms]:
                parts += [f"{title}; (out): outside the band of the default.",
                          as_markdown(forms_table(outcome, forms))]
    return "\n\n".join(parts) + "\n"


def as_json(outcomes: list[Outcome], about: dict) -> str:
    def rows(checks: list[Check]) -> list[dict]:
        return [{name: value if not isinstance(value, float) or math.isfinite(value) else None
                 for name, value in dataclasses.asdict(check).items()} | {"passed": check.passed} for check in checks]

    problems = [{"name": outcome.problem.name, "title": outcome.problem.title, "source": outcome.problem.source,
                 "checks": rows(outcome.checks),
                 "forms": {form: rows(checks) for form, checks in outcome.forms.items()},
                 "pictures": [path.name for path in outcome.pictures]} for outcome in outcomes]
    return json.dumps({"about": about, "problems": problems}, indent=1) + "\n"


def write(outcomes: list[Outcome], about: dict, out: Path, page: Path | None) -> None:
    """results.md and results.json in `out`; with a page, the tables between its two marks as well."""
    out.mkdir(parents=True, exist_ok=True)
    tables = markdown(outcomes)
    head = (f"`{about['command']}`, {about['date']}, {about['program']}: {about['runs']} runs, "
            f"{about['processor'] / 60:.0f} minutes of processor time.")
    (out / "results.md").write_text(f"# Validation\n\n{head} {tables}", encoding="utf-8")
    (out / "results.json").write_text(as_json(outcomes, about), encoding="utf-8")
    if page:
        replace_between_marks(page, f"{head} {tables}")


BEGIN, END = "<!-- validate: begin -->", "<!-- validate: end -->"


def replace_between_marks(page: Path, body: str) -> None:
    before, rest = page.read_text(encoding="utf-8").split(BEGIN)
    page.write_text(f"{before}{BEGIN}\n\n{body}\n{END}{rest.split(END)[1]}", encoding="utf-8")
