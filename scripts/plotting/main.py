"""Draws every picture of a run into RUN_DIR/pictures, and writes the numbers behind them to summary.json there."""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from figures import FIGURES
from results import Frame, MissingData, Run

PICTURES = """pictures:
  grains_start.png          bodies at the start
  grains_75.png             bodies at 75 % shear (shear runs); grains_end.png: at the end
  principal_stress.png      principal stress difference: force chains
  displacement_profile.png  average displacement across the sheared layer, and the shear band
  energy.png                the energy book
  film.mp4 or film.gif      with --film
  photoelastic.png          with --fringes PA: dark fringes of equal shear stress (2D), and nothing else is drawn
A picture whose data the run does not hold is skipped with a note."""


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="scripts/plot", description=__doc__, epilog=PICTURES,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path, metavar="RUN_DIR",
                        help="result folder of a run; with --fringes also one of its particle files")
    parser.add_argument("--compare", type=Path, metavar="OTHER_DIR", help="another run to set beside this one")
    parser.add_argument("--film", action="store_true", help="also make a film")
    parser.add_argument("--fringes", type=float, metavar="PA",
                        help="fringe parameter [Pa] of a photoelastic picture: a fringe for each 2 pi of it in the "
                        "difference of the in-plane principal stresses; a tenth of the largest stress is a start")
    parser.add_argument("--times", type=float, nargs="+", default=[], metavar="S",
                        help="with --fringes: the outputs nearest to these times [s]; default: all")
    parser.add_argument("--raw-stress", action="store_true",
                        help="show the points' stress as computed, also where the files hold the smooth field "
                        "(stress_smooth), which pictures show otherwise")
    return parser.parse_args()


def draw_fringes(path: Path, parameter: float, times: list[float], raw_stress: bool) -> int:
    """photoelastic.png of a result folder, or of one particle file, in the folder's pictures."""
    from photoelastic import photoelastic

    if not parameter > 0:
        print(f"plot: --fringes {parameter:g}: must be above 0 Pa", file=sys.stderr)
        return 2
    try:
        run = Run(path.parent if path.is_file() else path)
        run.raw_stress = raw_stress
        if path.is_file():
            run.frames = [Frame(path)]
        folder = run.folder / "pictures"
        folder.mkdir(exist_ok=True)
        for name in photoelastic(run, parameter, times, folder):
            print(f"  {folder / name}")
    except (MissingData, OSError) as error:
        print(f"plot: {error}", file=sys.stderr)
        return 2
    return 0


def main() -> int:
    options = arguments()
    if options.fringes is not None:
        return draw_fringes(options.run, options.fringes, options.times, options.raw_stress)
    try:
        run = Run(options.run)
        other = Run(options.compare) if options.compare else None
    except MissingData as error:
        print(f"plot: {error}", file=sys.stderr)
        return 2
    run.raw_stress = options.raw_stress
    figures = list(FIGURES)
    if options.film:
        from film import film

        figures.append(film)
    print(f"Drawing {run.folder}")
    try:
        draw(run, other, figures)
    except (OSError, subprocess.CalledProcessError) as error:
        print(f"plot: cannot write the pictures: {error}", file=sys.stderr)
        return 3
    return 0


def draw(run: Run, other: Run | None, figures: list) -> None:
    """Draws each picture in a folder of its own first, so that what has its final name is whole."""
    folder = run.folder / "pictures"
    folder.mkdir(exist_ok=True)
    summary = {"title": run.title}
    with tempfile.TemporaryDirectory(dir=folder, prefix=".") as drafts:
        for figure in figures:
            try:
                for name in figure(run, other, Path(drafts), summary):
                    os.replace(Path(drafts) / name, folder / name)
                    print(f"  {folder / name}")
            except MissingData as reason:
                print(f"  no {figure.__name__}: {reason}")
        draft = Path(drafts) / "summary.json"
        draft.write_text(json.dumps(summary, indent=2) + "\n")
        os.replace(draft, folder / draft.name)


if __name__ == "__main__":
    sys.exit(main())
