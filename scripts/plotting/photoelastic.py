"""Photoelastic pictures: dark fringes along lines of equal in-plane shear stress, as polarised light shows them.

S.G. Bardenhagen et al., CMES 2 (2001) 509-522, section 3.3: the cosine of the difference of the in-plane principal
stresses over a parameter that sets how dense the fringes are; bright where there is no stress.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import raster
from results import Frame, MissingData, Run, principal_stress_difference

PIXELS = 1000  # on the longer side of the domain
VOID = 0.35  # grey of what is not matter


def fringes(stress: np.ndarray, parameter: float) -> np.ndarray:
    """Brightness, 0 to 1, of points with a stress (N x 6) [Pa]; `parameter` [Pa]: a fringe is 2 pi of it."""
    return 0.5 + 0.5 * np.cos(principal_stress_difference(stress) / parameter)


def fringe_picture(run: Run, frame: Frame, parameter: float, pixels: int = PIXELS) -> np.ndarray:
    """Brightness of every pixel of the domain, rows upwards; each point is painted where it is (2D)."""
    if run.dimension != 2:
        raise MissingData("photoelastic pictures are drawn for two dimensions only")
    position = frame.field("position")[:, :2]
    owner = raster.nearest_point(position, run.point_spacing, run.lower, run.at(frame).upper, run.periodic, pixels)
    return np.where(owner >= 0, fringes(run.stress(frame), parameter)[owner], VOID)


def nearest_frames(run: Run, times: list[float]) -> list[Frame]:
    """The outputs nearest to the times [s]; all outputs if there are no times."""
    if not run.frames:
        raise MissingData("there are no particles_*.vtkhdf files (see output.particles)")
    if not times:
        return run.frames
    return [min(run.frames, key=lambda frame: abs(frame.time - time)) for time in times]


def fringe_sheet(pictures: list[tuple[str, Run, Frame]], parameter: float, path: Path, title: str,
                 columns: int = 1) -> Path:
    """One sheet of frames, each with a caption, read along the rows."""
    run = pictures[0][1]
    width, height = run.upper - run.lower
    columns = min(columns, len(pictures))
    rows = -(-len(pictures) // columns)
    wide = 8.0 / columns if columns > 1 else 8.0
    figure, grid = plt.subplots(rows, columns, figsize=(wide * columns, (wide * height / width + 0.3) * rows),
                                squeeze=False)
    for axes in grid.flat:
        axes.set_axis_off()
    for axes, (caption, shown, frame) in zip(grid.flat, pictures):
        axes.imshow(fringe_picture(shown, frame, parameter), origin="lower", cmap="gray", vmin=0, vmax=1,
                    interpolation="antialiased")
        axes.set_title(caption, fontsize=9)
    figure.suptitle(title, fontsize=10)
    figure.tight_layout()
    figure.savefig(path, dpi=150, bbox_inches="tight")
    plt.close(figure)
    return path


def photoelastic(run: Run, parameter: float, times: list[float], folder: Path) -> list[str]:
    """Draws photoelastic.png: the outputs nearest to the times, or all."""
    frames = nearest_frames(run, times)
    columns = 1 if len(frames) <= 4 else 3
    pictures = [(f"t = {frame.time:.4g} s", run, frame) for frame in frames]
    return [fringe_sheet(pictures, parameter, folder / "photoelastic.png", run.title, columns).name]
