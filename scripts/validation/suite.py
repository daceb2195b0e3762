"""What a problem of the suite is, and how all of them are run: the runs of all problems side by side, longest first."""

from __future__ import annotations

import concurrent.futures
import dataclasses
import re
from collections.abc import Callable
from pathlib import Path

from validation.checks import Check
from validation.runs import Run, Runner, RunFailed

Folders = dict[str, Path]  # of the results, by the label of the run

# What the papers print, in place of Cairn's defaults; `A` is the paper of 2000, `B` that of 2001.
LITERAL = {
    "approach": {"contact.release": '"approach"'},
    "traction": {"contact.release": '"traction"'},
    "own normals": {"contact.normal_choice": '"own"'},
    "impulse limit": {"contact.impulse_limit": 0.5},
    "A as printed": {"solver.shape": '"linear"', "contact.release": '"approach"', "contact.normals": '"density"',
                     "contact.normal_choice": '"own"', "contact.gate": '"body"'},
    "B as printed": {"solver.shape": '"linear"', "contact.release": '"traction"', "contact.normals": '"mass_gradient"',
                     "contact.normal_choice": '"own"', "contact.gate": '"body"', "contact.impulse_limit": 0.5,
                     "contact.departing_friction": '"printed"'},
}

# Other choices of the solver.
SETTINGS = {update: {"solver.stress_update": f'"{update}"'} for update in ("first", "modified_last", "last")} | {
    shape: {"solver.shape": f'"{shape}"'} for shape in ("linear", "bspline2")} | {
    # The first acts on round bodies only.
    "whole": {"solver.surface": '"whole"'}, "stand-off": {"contact.fill": 0.8}, "no filter": {"solver.noise_filter": '"off"'}}
FORMS = LITERAL | SETTINGS
OF_FLAT_BODIES = tuple(form for form in FORMS if form != "whole")


def nothing_drawn(_folders: Folders, _out: Path) -> list[Path]:
    return []


@dataclasses.dataclass(frozen=True)
class Problem:
    """A problem with a known answer. `runs(full)` names the runs, `checks` and `draw` take those that were made."""

    name: str
    title: str
    source: str  # paper and section, or the closed form
    runs: Callable[[bool], dict[str, Run]]
    checks: Callable[[Folders], list[Check]]
    draw: Callable[[Folders, Path], list[Path]] = nothing_drawn
    literal: tuple[str, ...] = ()  # labels of the runs that are repeated in other forms, the papers' own among them
    forms: tuple[str, ...] = tuple(FORMS)


@dataclasses.dataclass
class Outcome:
    """The checks of a problem, what other forms give instead, and its pictures."""

    problem: Problem
    checks: list[Check]
    forms: dict[str, list[Check]]
    pictures: list[Path]


def folder_name(problem: str, form: str, label: str) -> str:
    words = [re.sub(r"[^\w.]+", "_", word).strip("_") for word in (form, label) if word]
    return f"runs/{problem}/{'__'.join(words)}"


def all_runs(problems: list[Problem], full: bool) -> dict[tuple[str, str, str], Run]:
    """Every run by (problem, form, label); the form is empty for the defaults."""
    runs = {}
    for problem in problems:
        own = problem.runs(full)
        runs |= {(problem.name, "", label): run for label, run in own.items()}
        if full:
            runs |= {(problem.name, form, label): own[label].changed(changes)
                     for form, changes in FORMS.items() if form in problem.forms for label in problem.literal}
    return runs


def execute(runner: Runner, runs: dict, jobs: int, say: Callable[[str], None]) -> tuple[dict, dict, float]:
    """Makes all runs, `jobs` at a time; folders and error messages by (problem, form, label), and the processor time of
    all runs, also of those kept from before [s]."""
    folders, errors, processor = {}, {}, 0.0
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        order = sorted(runs, key=lambda key: -runs[key].cost)
        waiting = {pool.submit(runner, folder_name(*key), runs[key]): key for key in order}
        for count, job in enumerate(concurrent.futures.as_completed(waiting), 1):
            key = waiting[job]
            try:
                done = job.result()
                folders[key] = done.folder
                processor += done.processor
                how = "kept" if done.kept else f"{done.seconds:.1f} s, {done.processor:.1f} s of processor time"
            except RunFailed as error:
                errors[key], how = str(error), "FAILED"
            say(f"[{count:{len(str(len(runs)))}}/{len(runs)}] {' | '.join(word for word in key if word)}: {how}")
    return {key: folders[key] for key in runs if key in folders}, errors, processor


def judge(problem: Problem, form: str, folders: dict, errors: dict) -> list[Check]:
    """The checks of a problem in one form; a run that failed, and results that cannot be evaluated, fail a check."""
    failed = [Check(problem.name, f"run failed: {label}: {message.splitlines()[-1]}", float("nan"))
              for (name, its_form, label), message in errors.items() if (name, its_form) == (problem.name, form)]
    own = {label: folder for (name, its_form, label), folder in folders.items()
           if (name, its_form) == (problem.name, form)}
    try:
        return problem.checks(own) + failed
    except Exception as error:  # whatever it is, the other problems go on
        return failed + [Check(problem.name, f"no evaluation: {error!r}", float("nan"))]


def evaluate(problem: Problem, folders: dict, errors: dict, pictures: Path) -> Outcome:
    made = {form for name, form, _ in [*folders, *errors] if name == problem.name and form}
    forms = {form: judge(problem, form, folders, errors) for form in FORMS if form in made}
    own = {label: folder for (name, form, label), folder in folders.items() if name == problem.name and not form}
    found, drawn = judge(problem, "", folders, errors), []
    try:
        drawn = problem.draw(own, pictures) if own else []
    except Exception as error:  # as above
        found.append(Check(problem.name, f"no pictures: {error!r}", float("nan")))
    return Outcome(problem, found, forms, drawn)
