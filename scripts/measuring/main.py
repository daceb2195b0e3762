"""Measures a finished run: one output, or a row for each; or a table of grains, contacts, forces, fields or pairs."""

from __future__ import annotations

import argparse
import csv
import json
import math
import os
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from measuring import collect  # noqa: E402  where it is found was only now said
from measuring.snapshot import Snapshot  # noqa: E402
from results import Damaged, MissingData, Run  # noqa: E402

TABLES = """tables (--table):
  grains    a row for each grain: place, motion, shape, stress, contacts
  contacts  a row for each contact: place, normal, force, friction, branch
  forces    P(f_n), P(f_t / (mu f_n))
  fields    density, velocity, stress and temperature on a grid
  profile   the same, in slices across an axis (--across)
  pairs     the pair correlation g(r)
groups (--only): """ + ", ".join(group.__name__ for group in collect.GROUPS) + """
What each is: docs/measures.md. Without --at and --every the last output is measured."""


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="scripts/measure", description=__doc__, epilog=TABLES,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path, metavar="RUN_DIR", help="result folder with grain files (output.grains)")
    when = parser.add_mutually_exclusive_group()
    when.add_argument("--at", type=float, metavar="S", help="the output nearest to this time [s]")
    when.add_argument("--every", action="store_true", help="all outputs")
    parser.add_argument("-o", "--output", type=Path, metavar="FILE", help="a .csv or .json file; default: the terminal")
    parser.add_argument("--table", choices=list(collect.TABLES), help="a table instead of the measures")
    parser.add_argument("--only", nargs="+", default=[], metavar="GROUP",
                        choices=[group.__name__ for group in collect.GROUPS],
                        help="these groups of measures, which must be there; default: all that the files allow")
    parser.add_argument("--box", type=float, nargs="+", metavar="M",
                        help="lower and upper corner of the box [m]; default: between walls and tools")
    parser.add_argument("--threshold", type=float, default=0.0, metavar="SHARE",
                        help="leave out contacts below this share of the mean force; default 0")
    parser.add_argument("--rattlers", type=int, metavar="N", help="grains with fewer contacts are rattlers; default: 2 "
                        "with friction, the dimension + 1 without")
    parser.add_argument("--radius", type=float, metavar="M", help="of the kernel of fields; default: a mean diameter")
    parser.add_argument("--cell", type=float, metavar="M", help="of the grid of fields; default: half the radius")
    parser.add_argument("--across", choices="xyz", default="y", help="axis of profiles; default y")
    parser.add_argument("--bins", type=int, default=40, metavar="N", help="of distributions and g(r); default 40")
    parser.add_argument("--by-points", action="store_true",
                        help="fields and profiles from material points instead of grains and contacts")
    return parser.parse_args()


def options_of(given: argparse.Namespace, run: Run) -> collect.Options:
    box = None
    if given.box is not None:
        if len(given.box) != 2 * run.dimension:
            raise ValueError(f"--box takes {2 * run.dimension} numbers, the lower and the upper corner")
        box = np.array(given.box[: run.dimension]), np.array(given.box[run.dimension :])
        if not (box[1] > box[0]).all():
            raise ValueError("--box: the upper corner must be above the lower one")
    across = "xyz".index(given.across)
    if across >= run.dimension:
        raise ValueError("--across z: the run has two dimensions")
    for name in ("radius", "cell", "bins", "rattlers"):
        value = getattr(given, name)
        if value is not None and not value > 0:
            raise ValueError(f"--{name} must be above 0")
    return collect.Options(box, given.threshold, given.rattlers, given.radius, given.cell, across, given.bins,
                           given.by_points)


def chosen(given: argparse.Namespace, run: Run) -> list[int]:
    """Numbers of the outputs."""
    if given.every:
        return list(range(len(run.grains)))
    if given.at is None:
        return [len(run.grains) - 1]
    return [min(range(len(run.grains)), key=lambda k: abs(run.grains[k].time - given.at))]


def measured(given: argparse.Namespace, run: Run) -> dict[str, list]:
    """The columns of the table to write."""
    options, rows = options_of(given, run), []
    missing: dict[str, str] = {}
    for index in chosen(given, run):
        snapshot = Snapshot(run, index, options.threshold)
        if given.table:
            rows.append({"time": snapshot.time} | collect.TABLES[given.table](snapshot, options))
            continue
        found, why = collect.measures(snapshot, options, tuple(given.only))
        rows.append(found)
        missing |= why
    for group, reason in missing.items():
        print(f"measure: no {group}: {reason}", file=sys.stderr)
    names = list(dict.fromkeys(name for row in rows for name in row))
    columns: dict[str, list] = {name: [] for name in names}
    for row in rows:
        length = max(np.size(value) for value in row.values())
        for name in names:
            columns[name] += np.broadcast_to(row.get(name, math.nan), length).tolist()
    return columns


def write(columns: dict[str, list], path: Path | None) -> None:
    rows = list(zip(*columns.values()))
    if path is None:
        if len(rows) == 1:
            width = max(map(len, columns))
            print("\n".join(f"{name:{width}}  {values[0]:.6g}" for name, values in columns.items()))
            return
        csv.writer(sys.stdout, lineterminator="\n").writerows([columns, *rows])
        return
    draft = path.with_name(f".{path.name}.{os.getpid()}")
    with open(draft, "w", encoding="utf-8", newline="") as file:
        if path.suffix == ".json":
            whole = {name: [None if isinstance(v, float) and not math.isfinite(v) else v for v in values]
                     for name, values in columns.items()}
            json.dump({n: v[0] for n, v in whole.items()} if len(rows) == 1 else whole, file, indent=2)
            file.write("\n")
        else:
            csv.writer(file, lineterminator="\n").writerows([columns, *rows])
    os.replace(draft, path)
    print(f"{path}: {len(rows)} rows of {len(columns)} columns")


def main() -> int:
    given = arguments()
    try:
        if given.output and given.output.suffix not in (".csv", ".json"):
            raise ValueError(f"{given.output}: must end in .csv or .json")
        write(measured(given, Run(given.run)), given.output)
    except (MissingData, Damaged, ValueError) as error:
        if os.environ.get("CAIRN_TRACEBACK"):
            raise
        return refuse(str(error), 2)
    except BrokenPipeError:
        return 0
    except OSError as error:
        return refuse(f"cannot write: {error}", 3)
    except (ArithmeticError, LookupError, MemoryError, TypeError) as error:
        # Each file can be read, but they are not of one run. CAIRN_TRACEBACK=1 shows where, should it be a fault here.
        if os.environ.get("CAIRN_TRACEBACK"):
            raise
        return refuse(f"{given.run}: the results do not fit together: {type(error).__name__}: {error}", 2)
    return 0


def refuse(text: str, code: int) -> int:
    """One line of error."""
    print("measure: " + "".join(c if c.isprintable() else " " for c in text), file=sys.stderr)
    return code


if __name__ == "__main__":
    sys.exit(main())
