"""Pictures of cracks: their faces over the bodies, and what drives their tips over time."""

from __future__ import annotations

from pathlib import Path

import h5py
import matplotlib.pyplot as plt
import numpy as np
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

import figures
from results import Frame, MissingData, Run, reading


def faces(run: Run, frame: Frame) -> list[tuple[np.ndarray, np.ndarray]]:
    """Lower and upper face (each N x 2) [m] of every crack at the time of a frame, cut where it leaves the domain."""
    path = beside(frame, "cracks")
    with reading(path), h5py.File(path, "r") as file:
        crack, index, image = file["crack"][()], file["index"][()], file["image"][()]
        lower, upper = file["lower"][()][:, :2], file["upper"][()][:, :2]
        parted = file["parted"][()]
    lines = []
    order = np.lexsort((index, image[:, 1], image[:, 0], crack))
    order = order[parted[order] == 0]
    key = np.column_stack([crack, image[:, :2]])[order]
    starts = np.flatnonzero(np.any(key[1:] != key[:-1], axis=1)) + 1
    for part in np.split(order, starts):
        lines.append((lower[part], upper[part]))
    return lines


def draw_faces(axes, run: Run, frame: Frame) -> None:
    """Both faces of every crack, and what lies between them, as lines over a picture of the domain."""
    factor, _ = figures.length_unit(run)
    for lower, upper in faces(run, frame):
        for face in (lower, upper):
            axes.plot(*(factor * face.T), color="red", lw=0.8)


def cracks(run: Run, other: Run | None, folder: Path, summary: dict) -> list[str]:
    """The faces of the cracks over the bodies, at the start and at the end; in 3D their surfaces and opening."""
    if not run.frames:
        raise MissingData("there are no particles_*.vtkhdf files (see output.particles)")
    frames = [run.frames[0], run.frames[-1]]
    if run.dimension == 3:
        return surfaces(run, frames, folder)
    figure, row = plt.subplots(1, 2, figsize=(14, 7))
    for axes, frame in zip(row, frames):
        faces(run, frame)
        figures._show(axes, run, figures.grain_picture(run, frame), f"{run.title}, {figures.label(run, frame)}")
        draw_faces(axes, run, frame)
        for d, limits in enumerate((axes.set_xlim, axes.set_ylim)):
            limits(figures.length_unit(run)[0] * run.lower[d], figures.length_unit(run)[0] * run.upper[d])
    return [figures._save(figure, folder, "cracks.png")]


def beside(frame: Frame, kind: str) -> Path:
    """The file of cracks or tips that belongs to a frame."""
    path = frame.path.parent / f"{frame.path.stem.replace('particles', kind)}.h5"
    if not path.exists():
        raise MissingData(f"there is no {path.name}: the case has no cracks")
    return path


def surfaces(run: Run, frames: list[Frame], folder: Path) -> list[str]:
    """Triangles of 3D cracks, coloured by the size of the opening at the end [m]."""
    factor, unit = figures.length_unit(run)
    figure = plt.figure(figsize=(14, 7))
    data = []
    for frame in frames:
        path = beside(frame, "cracks")
        with reading(path), h5py.File(path, "r") as file:
            corners = file["VTKHDF/Connectivity"][()].reshape(-1, 3)
            data.append((frame, file["position"][()], corners, np.linalg.norm(file["opening"][()], axis=1)))
    most = max(opening.max(initial=0) for *_, opening in data) or 1.0
    for place, (frame, position, corners, opening) in enumerate(data, 1):
        axes = figure.add_subplot(1, 2, place, projection="3d")
        patches = Poly3DCollection(factor * position[corners], edgecolor=(0, 0, 0, 0.3), linewidth=0.3)
        patches.set_array(opening[corners].mean(axis=1))
        patches.set_clim(0, most)
        axes.add_collection3d(patches)
        for limits, low, high in zip((axes.set_xlim, axes.set_ylim, axes.set_zlim), run.lower, run.upper):
            limits(factor * low, factor * high)
        axes.set_box_aspect(run.upper - run.lower)
        axes.set(xlabel=f"x [{unit}]", ylabel=f"y [{unit}]", zlabel=f"z [{unit}]")
        axes.set_title(f"{run.title}, {figures.label(run, frame)}", fontsize=10)
        figure.colorbar(patches, ax=axes, shrink=0.6, label="opening [m]")
    return [figures._save(figure, folder, "cracks.png")]


def tips(run: Run, other: Run | None, folder: Path, summary: dict) -> list[str]:
    """J, K and the growth of the tips over time, from tips.csv."""
    path = run.folder / "tips.csv"
    if not path.exists():
        raise MissingData("there is no tips.csv (see output.tips)")
    with reading(path), open(path, encoding="utf-8") as file:
        names = file.readline().strip().split(",")
        rows = np.loadtxt(file, delimiter=",", ndmin=2)
    if rows.size == 0:
        raise MissingData("tips.csv has no rows")
    table = dict(zip(names, rows.T))
    if "index" in table:
        table["end"] = table["index"]  # points of a rim
    panels = (("J", "J [J/m²]"), ("K_I", "K_I [Pa m$^{1/2}$]"), ("K_II", "K_II [Pa m$^{1/2}$]"),
              ("grown", "growth [m]"))
    figure, axes = plt.subplots(2, 2, figsize=(11, 8), sharex=True)
    tips_of_run = sorted(set(zip(table["crack"], table["end"])))
    for panel, (name, title) in zip(axes.flat, panels):
        for crack, end in tips_of_run:
            rows_of_tip = (table["crack"] == crack) & (table["end"] == end)
            panel.plot(table["time"][rows_of_tip], table[name][rows_of_tip], lw=1,
                       label=f"crack {crack:.0f}, " + (f"point {end:.0f}" if run.dimension == 3 else f"{'last' if end else 'first'} end"))
        panel.set_ylabel(title)
    for panel in axes[1]:
        panel.set_xlabel("time [s]")
    if len(tips_of_run) <= 8:
        axes[0, 0].legend(fontsize=8)
    figure.suptitle(run.title, fontsize=10)
    summary["grown_at_end_m"] = float(sum(table["grown"][table["time"] == table["time"].max()]))
    return [figures._save(figure, folder, "tips.png")]
