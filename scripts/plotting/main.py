"""Draws every picture of a run into RUN_DIR/pictures, and writes the numbers behind them to summary.json there."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from figures import FIGURES
from results import MissingData, Run

PICTURES = """pictures:
  grains_start.png          bodies at the start
  grains_75.png             bodies at 75 % shear (shear runs); grains_end.png: at the end
  principal_stress.png      principal stress difference: force chains
  displacement_profile.png  average displacement across the sheared layer, and the shear band
  energy.png                the energy book
  film.mp4 or film.gif      with --film
A picture whose data the run does not hold is skipped with a note."""


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="scripts/plot", description=__doc__, epilog=PICTURES,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path, metavar="RUN_DIR", help="result folder of a run")
    parser.add_argument("--compare", type=Path, metavar="OTHER_DIR", help="another run to set beside this one")
    parser.add_argument("--film", action="store_true", help="also make a film")
    return parser.parse_args()


def main() -> int:
    options = arguments()
    try:
        run = Run(options.run)
        other = Run(options.compare) if options.compare else None
    except MissingData as error:
        print(f"plot: {error}", file=sys.stderr)
        return 2
    folder = run.folder / "pictures"
    folder.mkdir(exist_ok=True)
    summary = {"title": run.title}
    print(f"Drawing {run.folder}")
    figures = list(FIGURES)
    if options.film:
        from film import film

        figures.append(film)
    for figure in figures:
        try:
            for name in figure(run, other, folder, summary):
                print(f"  {folder / name}")
        except MissingData as reason:
            print(f"  no {figure.__name__}: {reason}")
    (folder / "summary.json").write_text(json.dumps(summary, indent=2) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
