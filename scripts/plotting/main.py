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
from results import Damaged, Frame, MissingData, Run

PICTURES = """pictures:
  grains_start.png          bodies at the start
  grains_75.png             bodies at 75 % shear (shear runs); grains_end.png: at the end
  principal_stress.png      principal stress difference: force chains
  displacement_profile.png  average displacement across the sheared layer, and the shear band
  energy.png                the energy book
  force_displacement.png    force on tools that move (forces.csv)
  stress_strain.png, coordination.png, force_distribution.png, fabric_rose.png, profiles.png
                            measures of grains and contacts (docs/measures.md)
  outflow.png               mass that left through free faces
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


def pictures_of(run: Run) -> Path:
    """The folder of the pictures, made where it is missing; it must not lead out of the results."""
    folder = run.folder / "pictures"
    if folder.is_symlink():
        raise Damaged(f"{folder} is a link, which is not followed; remove it")
    if folder.exists() and not folder.is_dir():
        raise Damaged(f"{folder} is not a folder; move it away")
    folder.mkdir(exist_ok=True)
    return folder


def fringes(options: argparse.Namespace) -> int:
    """photoelastic.png of a result folder, or of one particle file, in the folder's pictures."""
    from photoelastic import photoelastic

    if not options.fringes > 0:
        print(f"plot: --fringes {options.fringes:g}: must be above 0 Pa", file=sys.stderr)
        return 2
    path = options.run
    run = Run(path.parent if path.is_file() else path)
    run.raw_stress = options.raw_stress
    if path.is_file():
        run.frames = [Frame(path)]
    folder = pictures_of(run)
    with tempfile.TemporaryDirectory(dir=folder, prefix=".") as drafts:
        for name in photoelastic(run, options.fringes, options.times, Path(drafts)):
            os.replace(Path(drafts) / name, folder / name)
            print(f"  {folder / name}")
    return 0


def pictures(options: argparse.Namespace) -> int:
    """All pictures of a result folder."""
    run = Run(options.run)
    other = Run(options.compare) if options.compare else None
    run.raw_stress = options.raw_stress
    figures = list(FIGURES)
    if options.film:
        from film import film

        figures.append(film)
    print(f"Drawing {run.folder}{': THE RUN FAILED' if run.failed else ''}")
    draw(run, other, figures)
    return 0


def draw(run: Run, other: Run | None, figures: list) -> None:
    """Draws each picture in a folder of its own first, so that what has its final name is whole."""
    folder = pictures_of(run)
    summary = {"title": run.title, "failed": run.failed}
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


def main() -> int:
    options = arguments()
    try:
        return pictures(options) if options.fringes is None else fringes(options)
    except (MissingData, Damaged) as error:
        return refuse(str(error), 2)
    except (OSError, subprocess.CalledProcessError) as error:
        return refuse(f"cannot write the pictures: {error}", 3)
    except (ArithmeticError, LookupError, MemoryError, TypeError, ValueError) as error:
        # Each file can be read, but they are not of one run. CAIRN_TRACEBACK=1 shows where, should it be a fault here.
        if os.environ.get("CAIRN_TRACEBACK"):
            raise
        return refuse(f"{options.run}: the results do not fit together: {type(error).__name__}: {error}", 2)


def refuse(text: str, code: int) -> int:
    """One line of error."""
    print("plot: " + "".join(c if c.isprintable() else " " for c in text), file=sys.stderr)
    return code


if __name__ == "__main__":
    sys.exit(main())
