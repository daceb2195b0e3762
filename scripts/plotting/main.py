"""Draws every picture of a run into RUN_DIR/pictures, and writes the numbers behind them to summary.json there."""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
import tempfile
from pathlib import Path

from command import folder_in, run_command
from cracks import cracks, tips
from figures import FIGURES, values
from look import Look
from results import Frame, MissingData, Run
from scalars import SCALARS
from space import clip_plane

PICTURES = """pictures:
  grains_start.png          bodies at the start
  grains_75.png             bodies at 75 % shear (shear runs); grains_end.png: at the end
  principal_stress.png      principal stress difference: force chains (2D)
  stress_inside.png         von Mises stress in bodies that are cut open (3D)
  displacement_profile.png  average displacement across the sheared layer, and the shear band
  energy.png                the energy book
  force_displacement.png    force on tools that move (forces.csv)
  stress_strain.png, coordination.png, force_distribution.png, fabric_rose.png, profiles.png
                            measures of grains and contacts (docs/measures.md)
  outflow.png               mass that left through free faces
  cracks.png                faces of cracks over the bodies; in 3D their surfaces and opening
  tips.png                  J, K and growth of their tips (output.tips)
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
                        help="with --fringes or --colour: the outputs nearest to these times [s]; default: all, or the last")
    parser.add_argument("--raw-stress", action="store_true",
                        help="show the points' stress as computed, also where the files hold the smooth field "
                        "(stress_smooth), which pictures show otherwise")
    space = parser.add_argument_group("what is shown, and from where")
    space.add_argument("--colour", default="body", metavar="VALUE",
                       help="draw VALUE.png, and the film, in colours of a value: " + ", ".join(SCALARS) +
                       ", or any field of the files with one component")
    space.add_argument("--range", type=float, nargs=2, metavar=("LOW", "HIGH"),
                       help="ends of its colour scale, in SI units")
    space.add_argument("--clip", action="append", default=[], metavar="KEPT",
                       help="3D: cut bodies open and keep what is there, as x<0.3 (metres), or x< for half; up to 3 times")
    space.add_argument("--azimuth", type=float,
                       help="3D: degrees about the vertical axis; default: 35, or so that cuts are seen")
    space.add_argument("--elevation", type=float, help="3D: degrees above the horizon (22)")
    space.add_argument("--zoom", type=float, default=1.0, help="3D: 2 shows half the width")
    space.add_argument("--perspective", action="store_true", help="3D: what is near looks larger")
    space.add_argument("--size", type=int, nargs=2, default=(900, 700), metavar=("WIDTH", "HEIGHT"),
                       help="3D: pixels (900 700)")
    return parser.parse_args()


def look_of(options: argparse.Namespace, run: Run) -> Look:
    """What the options ask to see."""
    numbers = [options.azimuth or 0, options.elevation or 0, options.zoom, *(options.range or (0, 1)), *options.times]
    if not all(map(math.isfinite, numbers)):
        raise MissingData("a number of the options is not finite")
    if not 0.01 <= options.zoom <= 1000:
        raise MissingData(f"--zoom {options.zoom:g}: must be from 0.01 to 1000")
    if not all(100 <= side <= 10000 for side in options.size):
        raise MissingData("--size: sides must be from 100 to 10000 pixels")
    if options.range and options.range[0] >= options.range[1]:
        raise MissingData("--range: the first must be below the second")
    planes = [clip_plane(text, run) for text in options.clip]
    if len(planes) > 3:
        raise MissingData("--clip: three planes at the most")
    return Look(options.colour, planes, options.azimuth, options.elevation, options.zoom, options.perspective,
                options.times, tuple(options.range) if options.range else None, *options.size)


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
    folder = folder_in(run.folder, "pictures")
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
    run.look = look_of(options, run)
    if other:
        other.look = run.look
    figures = [*FIGURES, cracks, tips]
    if options.colour != "body" or options.times:
        figures.append(values)
    if options.film:
        from film import film

        figures.append(film)
    print(f"Drawing {run.folder}{': THE RUN FAILED' if run.failed else ''}")
    draw(run, other, figures)
    return 0


def draw(run: Run, other: Run | None, figures: list) -> None:
    """Draws each picture in a folder of its own first, so that what has its final name is whole."""
    folder = folder_in(run.folder, "pictures")
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
    draw_all = pictures if options.fringes is None else fringes
    return run_command("plot", options.run, "the pictures", lambda: draw_all(options))


if __name__ == "__main__":
    sys.exit(main())
