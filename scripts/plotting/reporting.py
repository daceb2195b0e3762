"""Writes one page about a run: the case, which program ran it where, pictures, energies, forces, measures, warnings."""

from __future__ import annotations

import argparse
import base64
import datetime
import html
import json
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from browser import Browser, BrowserFailed, find_chromium
from canvas import prefixed
from command import run_command, whole_file
from figures import FIGURES
from results import Damaged, MissingData, Run, reading

BALANCED = 0.01  # largest energy error that needs no warning
MOST_ROWS = 40  # of a table of tools
WIDE = 1.7  # width over height from which on a picture goes across the page
COUNTS = {"points_lost": "material points were lost and dropped", "points_left": "material points left through free faces",
          "points_stopped": "times a material point was kept from crossing a wall"}
CAPTIONS = {"grains_start": "Bodies at the start", "grains_75": "Bodies at 75 % shear", "grains_end": "Bodies at the end",
            "principal_stress": "In-plane principal stress difference", "stress_inside": "Von Mises stress, cut open",
            "force_chains": "Contacts, as wide as their force is large"}
STYLE = """body { font: 15px/1.5 "DejaVu Sans", Helvetica, Arial, sans-serif; max-width: 60em; margin: 2em auto; padding: 0 1em; color: #222; }
h1 { font-size: 1.6em; } h2 { font-size: 1.2em; border-bottom: 1px solid #ccc; margin-top: 2em; }
table { border-collapse: collapse; font-size: 0.85em; } th, td { text-align: left; padding: 2px 12px 2px 0; vertical-align: top; border-bottom: 1px solid #eee; }
td.n { text-align: right; font-variant-numeric: tabular-nums; } .warning { color: #b01414; } figure { margin: 1em 0; break-inside: avoid; }
.pictures { display: grid; grid-template-columns: 1fr 1fr; gap: 0 1em; align-items: end; } .wide { grid-column: span 2; }
img { max-width: 100%; max-height: 34em; } figcaption { font-size: 0.85em; color: #555; } pre { font-size: 0.75em; background: #f6f6f6; padding: 1em; overflow-x: auto; white-space: pre-wrap; overflow-wrap: anywhere; }
@media print { body { margin: 0; max-width: none; font-size: 11px; } h2 { break-after: avoid; } img { max-height: 60vh; } }"""


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="scripts/report", description=__doc__)
    parser.add_argument("run", type=Path, metavar="RUN_DIR", help="result folder of a run")
    parser.add_argument("-o", "--out", type=Path, metavar="FILE", help="the page; default: RUN_DIR/report.html")
    parser.add_argument("--pdf", action="store_true", help="also print it as PDF beside it; needs Chromium")
    return parser.parse_args()


def quantity(value: float, unit: str) -> str:
    """A number with its unit, as text."""
    factor, unit = prefixed(value, unit)
    return f"{value * factor:.4g} {unit}".replace("-", "\N{MINUS SIGN}", 1) if np.isfinite(value) else "unknown"


def table(rows: list, head: list[str] | None = None) -> str:
    """Rows of words and numbers; numbers are set to the right."""
    def cell(value) -> str:
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        text = f"{value:.5g}" if isinstance(value, float) else str(value)
        return f"<td{' class=n' if number else ''}>{html.escape(text)}</td>"

    top = "<tr>" + "".join(f"<th>{html.escape(name)}</th>" for name in head) + "</tr>" if head else ""
    return "<table>" + top + "".join("<tr>" + "".join(map(cell, row)) + "</tr>" for row in rows) + "</table>"


def records(run: Run) -> list[dict]:
    """The entries of run.json, one for each run into the folder."""
    path = run.folder / "run.json"
    if not path.is_file():
        return []
    with reading(path):
        return [dict(entry) for entry in json.loads(path.read_text(encoding="utf-8"))["runs"]]


def duration(entry: dict) -> float | None:
    """Wall time [s] of a run."""
    try:
        start, end = (datetime.datetime.fromisoformat(str(entry[key]).replace("Z", "+00:00")) for key in ("start", "end"))
    except (KeyError, ValueError):
        return None
    return (end - start).total_seconds()


def warnings(run: Run) -> list[str]:
    """What a reader must know before the numbers are believed."""
    found = ["The run failed; its last state is in failure_particles.vtkhdf."] if run.failed else []
    entries = records(run)
    if entries and entries[-1].get("exit_code") is None:
        found.append("The last run did not end: it is still at work, or was killed.")
    if entries and entries[-1].get("exit_code") == 4:
        found.append("The run was stopped by a signal and can be resumed.")
    if len({(entry.get("version"), entry.get("commit")) for entry in entries}) > 1:
        found.append("The run was continued with another version of the program.")
    try:
        history = run.history()
    except MissingData as reason:
        return [*found, f"Energies are not known: {reason}."]
    worst = float(np.nanmax(np.abs(history.get("energy_error", np.zeros(1)))))
    if worst > BALANCED or not np.isfinite(worst):
        found.append(f"The energy book is off by up to {100 * worst:.2g} % of the largest energy.")
    found += [f"{history[name][-1]:.0f} {words}." for name, words in COUNTS.items()
              if name in history and history[name][-1] > 0]
    if any(not np.isfinite(column).all() for column in history.values()):
        found.append("history.csv holds values that are not numbers.")
    return found


def summary(run: Run) -> str:
    """What was computed, in a table."""
    case, first = run.case, run.frames[0] if run.frames else None
    size = " x ".join(quantity(float(side), "m") for side in run.upper - run.lower)
    rows = [("domain", f"{run.dimension}D, {size}, {' x '.join(map(str, run.cells))} cells"
             + (f", periodic in {' and '.join(a for a, p in zip('xyz', run.periodic) if p)}" if run.periodic.any() else ""))]
    if first and first.has("body"):
        rows.append(("bodies", f"{len(np.unique(first.field('body')))} of {first.points} material points at the start"))
    for name, law in case.get("materials", {}).items():
        keys = ", ".join(f"{key} = {value:g}" if isinstance(value, float) else f"{key} = {value}" for key, value in law.items()
                         if key != "model")
        rows.append((f"material {name}", f"{law.get('model')}: {keys}"))
    contact = ", ".join(f"{key} = {value}" for key, value in case.get("contact", {}).items() if not isinstance(value, list))
    rows.append(("contact", contact or "defaults"))
    if run.frames:
        rows.append(("simulated", f"{quantity(run.frames[-1].time, 's')}, {run.frames[-1].step} steps, {len(run.frames)} outputs"))
    return table(rows)


def provenance(run: Run) -> str:
    """Which program ran, where and when, and how long it took."""
    parts = []
    for entry in records(run):
        took = duration(entry)
        hosts = entry.get("hosts")
        where = ", ".join(f"{name} ({ranks} ranks)" for name, ranks in hosts.items()) if isinstance(hosts, dict) else ""
        code = entry.get("exit_code")
        rows = [("command", entry.get("command")), ("program", f"cairn {entry.get('version')}, commit {entry.get('commit')}"),
                ("built with", f"{entry.get('compiler')}, {entry.get('instruction_set')}"),
                ("libraries", f"{entry.get('mpi')}, HDF5 {entry.get('hdf5')}, METIS {entry.get('metis')}"),
                ("ranks", f"{entry.get('ranks')} on {where}"), ("first step", entry.get("first_step")),
                ("start, end", f"{entry.get('start')}, {entry.get('end')}"),
                ("wall time", "unknown" if took is None else f"{took:.0f} s"), ("exit code", "none" if code is None else code)]
        parts.append(table([(name, "" if value is None else str(value)) for name, value in rows]))
    return "".join(parts) or "<p>There is no run.json.</p>"


def image(path: Path, caption: str) -> str:
    content, words = path.read_bytes(), html.escape(caption)
    data = base64.b64encode(content).decode("ascii")
    width, height = struct.unpack(">II", content[16:24])  # of a PNG
    return (f'<figure{" class=wide" if width > WIDE * height else ""}><img alt="{words}" src="data:image/png;base64,{data}">'
            f"<figcaption>{words}</figcaption></figure>")


def pictures(run: Run, folder: Path) -> str:
    """All pictures that the run allows; those that it does not are named with the reason."""
    made, missing = [], []
    for figure in FIGURES:
        if figure.__name__ == "energy":
            continue  # it has a section of its own
        try:
            for name in figure(run, None, folder, {}):
                made.append(image(folder / name, CAPTIONS.get(name[:-4], name[:-4].replace("_", " ").capitalize())))
        except MissingData as reason:
            missing.append((figure.__name__.replace("_", " "), str(reason)))
    return f"<div class=pictures>{''.join(made)}</div>" + ("<p>Not drawn:</p>" + table(missing) if missing else "")


def energies(run: Run, folder: Path) -> str:
    try:
        history = run.history()
        energy = next(figure for figure in FIGURES if figure.__name__ == "energy")
        drawn = [image(folder / name, "The energy book") for name in energy(run, None, folder, {})]
    except MissingData as reason:
        return f"<p>{html.escape(str(reason))}</p>"
    unit = "J/m" if run.dimension == 2 else "J"
    accounts = [name for name in history if name.endswith(("_energy", "_dissipation"))
                or name in ("boundary_work", "contact_gain", "energy_left")]
    rows = [(name.replace("_", " "), quantity(float(history[name][0]), unit), quantity(float(history[name][-1]), unit),
             quantity(float(np.nanmax(np.abs(history[name]))), unit)) for name in accounts]
    worst = float(np.nanmax(np.abs(history.get("energy_error", np.zeros(1)))))
    return "".join(drawn) + table(rows, ["account", "at the start", "at the end", "largest"]) + \
        f"<p>Largest error of the book: {worst:.3g} of the largest energy.</p>"


def forces(run: Run, folder: Path) -> str:
    """Forces on tools over time, from their impulses, and what they add up to."""
    try:
        tools = run.forces()
    except MissingData as reason:
        return f"<p>{html.escape(str(reason))}</p>"
    figure, panels = plt.subplots(run.dimension, 1, figsize=(8, 2.4 * run.dimension), sharex=True)
    unit, rows = "N/m" if run.dimension == 2 else "N", []
    for tool, columns in list(tools.items())[:MOST_ROWS]:
        time, ends = columns["time"], [tool]
        for axis, axes in zip("xyz", panels):
            impulse = columns[f"impulse_{axis}"]
            if len(time) > 1:
                axes.step(time[1:], np.diff(impulse) / np.maximum(np.diff(time), 1e-300), where="pre", lw=1, label=tool)
            axes.set_ylabel(f"force along {axis} [{unit}]")
            ends.append(quantity(float(impulse[-1]), unit.replace("N", "N s")))
        rows.append([*ends, quantity(float(columns["work"][-1]), "J/m" if run.dimension == 2 else "J")])
    panels[-1].set_xlabel("time [s]")
    panels[0].legend(fontsize=8, ncols=4, loc="lower left", bbox_to_anchor=(0, 1.02), frameon=False)
    figure.savefig(folder / "forces.png", dpi=120, bbox_inches="tight")
    plt.close(figure)
    head = ["tool", *[f"impulse along {axis}" for axis in "xyz"[: run.dimension]], "work done"]
    return image(folder / "forces.png", "Forces of the bodies on tools, means between rows of forces.csv") + table(rows, head)


def measures(run: Run) -> str:
    """What scripts/measure says of the last output, where that is."""
    script = Path(__file__).resolve().parents[1] / "measure"
    if not script.is_file():
        return ""
    done = subprocess.run([script, run.folder], capture_output=True, text=True, check=False)
    missing = sorted({line.removeprefix("measure: ") for line in done.stderr.splitlines()})
    return (f"<h2>Measures of the last output</h2><pre>{html.escape(done.stdout.strip())}</pre>"
            + table([(line,) for line in missing]))


def page(run: Run) -> str:
    """The whole page."""
    title = html.escape(run.title)
    found = warnings(run)
    items = "".join(f"<li>{html.escape(words)}</li>" for words in found)
    listed = f"<ul class=warning>{items}</ul>" if found else "<p>None.</p>"
    with tempfile.TemporaryDirectory(prefix="cairn-report-") as drafts:
        folder = Path(drafts)
        parts = [("Warnings", listed), ("What was computed", summary(run)), ("Pictures", pictures(run, folder)),
                 ("Energy", energies(run, folder)), ("Forces on walls and tools", forces(run, folder))]
    with reading(run.folder / "case.toml"):
        case = (run.folder / "case.toml").read_text(encoding="utf-8")
    body = "".join(f"<h2>{name}</h2>{content}" for name, content in parts) + measures(run)
    return (f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
            f"<style>{STYLE}</style></head><body>"
            f"<h1{' class=warning' if run.failed else ''}>{title}</h1>{body}<h2>Program and machine</h2>{provenance(run)}"
            f"<h2>Case, with all defaults</h2><pre>{html.escape(case)}</pre></body></html>\n")


def report(options: argparse.Namespace) -> int:
    run = Run(options.run)
    chromium = find_chromium()
    if options.pdf and not chromium:
        raise MissingData("--pdf needs Chromium (Debian: chromium); a browser prints the page as well")
    target = options.out or run.folder / "report.html"
    text = page(run)
    with whole_file(target) as draft:
        draft.write_text(text, encoding="utf-8")
    print(f"  {target}{': THE RUN FAILED' if run.failed else ''}")
    if options.pdf:
        try:
            with Browser(chromium) as browser:
                browser.open(target)
                printed = browser.pdf()
        except BrowserFailed as error:
            raise Damaged(f"{target.with_suffix('.pdf')} was not printed: {error}") from error
        with whole_file(target.with_suffix(".pdf")) as draft:
            draft.write_bytes(printed)
        print(f"  {target.with_suffix('.pdf')}")
    return 0


def main() -> int:
    options = arguments()
    return run_command("report", options.run, "the report", lambda: report(options))


if __name__ == "__main__":
    sys.exit(main())
