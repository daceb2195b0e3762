"""The pictures of a run, one function each.

Every function draws into `folder`, returns the names of the files it made, may add to `summary`, and raises
MissingData when the results lack what it needs. Figure numbers are those of Bardenhagen, Brackbill and Sulsky,
Comput. Methods Appl. Mech. Engrg. 187 (2000) 529-541, section 4.2.
"""

from __future__ import annotations

import textwrap
from dataclasses import replace
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import LineCollection

import colours
import laboratory
import raster
from canvas import beside, prefixed
from chains import STRONG, WEAK, loaded, network, widest
from photoelastic import nearest_frames
from results import Frame, MissingData, Run, Shear, displacement
from scalars import SCALARS, Scalar, scalar
from scalars import scale as scale_of
from space import Scene, middle_plane

PIXELS = 900  # on the longer side of a picture of the domain
FIGURE_6_SHEAR = 0.75
FIGURE_7_SHEAR = (0.63, 0.71)
FIGURE_8_SHEAR = (0.25, 0.50, 0.75)
BAND_SHARES = (0.75, 0.90)  # of the displacement difference, carried by the shear band


def length_unit(run: Run) -> tuple[float, str]:
    """Factor and name of the unit in which lengths of this run read well."""
    size = (run.upper - run.lower).max()
    return (1e3, "mm") if size < 0.1 else (1.0, "m")


def label(run: Run, frame: Frame) -> str:
    """When a frame was taken: its average shear if the run is driven so, else its time."""
    shear = run.shear()
    if shear is None:
        return f"t = {frame.time:.4g} s"
    return f"{100 * shear.fraction(frame.time):.0f} % shear"


def pixels_of(run: Run, frame: Frame, pixels: int) -> raster.Pixels:
    """The pixels of the domain (2D), `pixels` on the longer side."""
    if frame.points == 0:
        raise MissingData(f"{frame.path.name} holds no points")
    position = frame.field("position")[:, :2]
    return raster.Pixels(position, run.point_spacing, run.lower, run.at(frame).upper, run.periodic, pixels)


def bodies_of(frame: Frame) -> np.ndarray:
    """The body of each point."""
    return frame.field("body") if frame.has("body") else np.zeros(frame.points, int)


def grain_picture(run: Run, frame: Frame, pixels: int = PIXELS, colour=None) -> np.ndarray:
    """Bodies in different colours (2D; rows upwards)."""
    return raster.paint_bodies(pixels_of(run, frame, pixels).nearest(), bodies_of(frame), colour or colours.of_run(run))


def value_picture(run: Run, frame: Frame, shown: Scalar, scale: tuple, pixels: int = PIXELS) -> np.ndarray:
    """Points' values in the colours of a scale (low, high, name) (2D; rows upwards)."""
    place, body, values = pixels_of(run, frame, pixels), bodies_of(frame), shown.values(run, frame)
    owner = place.nearest()
    colour = colours.mapped(values[owner] if run.raw_stress else place.blended(owner, body, values), *scale)
    colour[np.isin(body, shown.lacking(run, frame))[owner]] = colours.DRIVEN
    return raster.paint_values(owner, body, colour)


def _title(run: Run, frame: Frame) -> str:
    return f"{run.title}, {label(run, frame)}"


def _show(axes, run: Run, picture: np.ndarray, title: str):
    """A picture of the domain (2D) with its scales; a failed run's title is red."""
    factor, unit = length_unit(run)
    extent = [factor * e for e in (run.lower[0], run.upper[0], run.lower[1], run.upper[1])]
    axes.imshow(picture, origin="lower", extent=extent, interpolation="antialiased")
    axes.set_title("\n".join(textwrap.wrap(title, 80)), fontsize=10, color="firebrick" if run.failed else "black")
    axes.set_xlabel(f"x [{unit}]")
    axes.set_ylabel(f"y [{unit}]")


def _scale_bar(figure, axes: list, low: float, high: float, name: str, shown: Scalar) -> None:
    """The colour scale beside pictures."""
    factor, unit = prefixed(max(abs(low), abs(high)), shown.unit)
    norm = matplotlib.colors.Normalize(low * factor, high * factor)
    colour_map = matplotlib.colors.ListedColormap(colours.MAPS[name])
    bar = figure.colorbar(matplotlib.cm.ScalarMappable(norm, colour_map), ax=axes, shrink=0.75, pad=0.02, extend="max")
    bar.set_label(f"{shown.title} [{unit}]" if unit else shown.title)


def _save(figure, folder: Path, name: str) -> str:
    figure.savefig(folder / name, dpi=150, bbox_inches="tight")
    plt.close(figure)
    return name


def _draw_grains(run: Run, frame: Frame, folder: Path, name: str) -> str:
    if run.dimension == 3:
        Scene(run, replace(run.look, colour="body"), [frame]).sheet(frame, _title(run, frame)).image.save(folder / name)
        return name
    figure, axes = plt.subplots(figsize=(7, 7))
    _show(axes, run.at(frame), grain_picture(run, frame), _title(run, frame))
    return _save(figure, folder, name)


def _draw_pair(pair: list[tuple[Run, Frame]], folder: Path, name: str) -> str:
    """Two runs side by side."""
    if pair[0][0].dimension == pair[1][0].dimension == 3:
        sheets = [Scene(run, replace(run.look, colour="body"), [frame]).sheet(frame, _title(run, frame)).image
                  for run, frame in pair]
        beside(sheets).save(folder / name)
        return name
    figure, row = plt.subplots(1, 2, figsize=(14, 7))
    for axes, (run, frame) in zip(row, pair):
        _show(axes, run.at(frame), grain_picture(run, frame), _title(run, frame))
    return _save(figure, folder, name)


def _first_frame(run: Run) -> Frame:
    if not run.frames:
        raise MissingData("there are no particles_*.vtkhdf files (see output.particles)")
    return run.frames[0]


def grains_start(run: Run, other: Run | None, folder: Path, summary: dict) -> list[str]:
    """The bodies at the start (Fig. 5)."""
    frame = _first_frame(run)
    made = [_draw_grains(run, frame, folder, "grains_start.png")]
    summary["bodies"] = int(len(np.unique(frame.field("body"))))
    summary["points"] = int(len(frame.field("body")))
    return made


def grains_later(run: Run, other: Run | None, folder: Path, summary: dict) -> list[str]:
    """The bodies at 75 % shear (Fig. 6b), and at the end if that is another time or the run is no shear.

    With another run to compare: that run's bodies (Fig. 6a) and both side by side.
    """
    last = run.frames[-1] if run.frames else _first_frame(run)
    try:
        frame, name = run.frame_at_shear(FIGURE_6_SHEAR), "grains_75"
    except MissingData:
        frame, name = last, "grains_end"
    made = [_draw_grains(run, frame, folder, f"{name}.png")]
    if frame is not last:
        made.append(_draw_grains(run, last, folder, "grains_end.png"))
    if other is None:
        return made
    if not other.frames:
        raise MissingData(f"{other.folder} has no particles_*.vtkhdf files to compare with")
    other_frame = min(other.frames, key=lambda candidate: abs(candidate.time - frame.time))
    made.append(_draw_grains(other, other_frame, folder, f"{name}_{other.folder.name}.png"))
    if run.dimension == other.dimension:
        made.append(_draw_pair([(other, other_frame), (run, frame)], folder, f"{name}_compare.png"))
    return made


def principal_stress(run: Run, other: Run | None, folder: Path, summary: dict) -> list[str]:
    """In-plane principal stress difference, bright where large, at 63 % and 71 % shear (Fig. 7) on one scale.

    Runs that are not a shear, or end sooner: at the end.
    """
    if run.dimension != 2:
        raise MissingData("drawn for two dimensions only")
    _first_frame(run)
    try:
        frames = [run.frame_at_shear(fraction) for fraction in FIGURE_7_SHEAR]
    except MissingData:
        frames = [run.frames[-1]]
    if any(frame.points == 0 for frame in frames):
        raise MissingData("there are no points any more")
    shown = SCALARS["difference"]
    top = max(shown.noise(run), *(float(np.percentile(shown.values(run, frame), 99)) for frame in frames))
    scale = (0.0, top if top > 0 else 1.0, "stress")
    figure, row = plt.subplots(1, len(frames), figsize=(7 * len(frames), 7), squeeze=False)
    for axes, frame in zip(row[0], frames):
        _show(axes, run.at(frame), value_picture(run, frame, shown, scale), _title(run, frame))
    _scale_bar(figure, list(row[0]), *scale, shown)
    summary["principal_stress_scale_Pa"] = top
    summary["principal_stress_field"] = run.stress_name(frames[0])
    return [_save(figure, folder, "principal_stress.png")]


def stress_inside(run: Run, other: Run | None, folder: Path, summary: dict) -> list[str]:
    """Von Mises stress at the end, with bodies cut open through the middle (3D), or where --clip says."""
    frame = run.frames[-1] if run.frames else _first_frame(run)
    if run.dimension != 3:
        raise MissingData("drawn for three dimensions only")
    if not run.has_stress(frame):
        raise MissingData(f"{frame.path.name} holds no stress (see output.particles.fields)")
    look = replace(run.look, colour="mises", range=None, planes=run.look.planes or [middle_plane(run)])
    Scene(run, look, [frame]).sheet(frame, _title(run, frame)).image.save(folder / "stress_inside.png")
    return ["stress_inside.png"]


def force_chains(run: Run, other: Run | None, folder: Path, summary: dict) -> list[str]:
    """The contacts over the bodies, lines as wide as forces are large, at the last time at which anything touches."""
    contacts, frame = loaded(run)
    run = run.at(frame)
    net = network(run, contacts, frame)
    summary["contacts"] = {"time_s": contacts.time, "count": net.contacts, "mean_force_N": net.mean}
    if run.dimension == 3:
        scene = Scene(run, replace(run.look, colour="body"), [frame])
        scene.with_chains(frame, net, _title(run, frame)).image.save(folder / "force_chains.png")
        return ["force_chains.png"]
    figure, axes = plt.subplots(figsize=(7, 7))
    pale = 255 - (255 - grain_picture(run, frame)) * 0.35
    _show(axes, run, pale.astype(np.uint8), _title(run, frame))
    factor, _ = length_unit(run)
    figure.canvas.draw()
    per_metre = axes.get_window_extent().width / (run.upper - run.lower)[0] * 72 / figure.dpi  # points
    order = np.argsort(net.force)
    widths = np.maximum(widest(run) * net.share * per_metre, 0.4)[order]
    drawn = LineCollection(factor * net.lines[order, :, :2], linewidths=widths, capstyle="round",
                           colors=np.where(net.strong[:, None], STRONG, WEAK)[order])
    axes.add_collection(drawn, autolim=False)
    factor, unit = prefixed(net.top, "N/m")
    mean, top = (f"{force * factor:.3g} {unit}" for force in (net.mean, net.top))
    axes.plot([], [], color=STRONG, lw=3, label=f"{mean} (mean) to {top} (widest)")
    axes.plot([], [], color=WEAK, lw=1, label="weaker than the mean")
    axes.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=2, frameon=False,
                title=net.title, title_fontsize=8)
    return [_save(figure, folder, "force_chains.png")]


def values(run: Run, other: Run | None, folder: Path, summary: dict) -> list[str]:
    """The value of --colour, at the --times or at the end, on one scale."""
    frames = list(dict.fromkeys(nearest_frames(run, run.look.times))) if run.look.times else [*run.frames[-1:]]
    if not frames:
        _first_frame(run)
    if any(frame.points == 0 for frame in frames):
        raise MissingData("there are no points any more")
    name = "bodies" if run.look.colour == "body" else run.look.colour
    names = [f"{name}.png" if len(frames) == 1 else f"{name}_{frame.step:06d}.png" for frame in frames]
    if run.dimension == 3:
        scene = Scene(run, run.look, frames)
        for frame, name in zip(frames, names):
            scene.sheet(frame, _title(run, frame)).image.save(folder / name)
        return names
    if run.look.colour == "body":
        return [_draw_grains(run, frame, folder, name) for frame, name in zip(frames, names)]
    shown = scalar(run, frames[0], run.look.colour)
    scale = scale_of(run, frames, shown, run.look.range)
    for frame, name in zip(frames, names):
        figure, axes = plt.subplots(figsize=(8, 7))
        _show(axes, run.at(frame), value_picture(run, frame, shown, scale), _title(run, frame))
        _scale_bar(figure, [axes], *scale, shown)
        _save(figure, folder, name)
    return names


def column_profile(run: Run, frame: Frame) -> tuple[np.ndarray, np.ndarray]:
    """Mean displacement [m] along the shear of all material in each column of cells, columns by current position.

    Returns the columns' centres [m] and the means; columns without material are left out.
    """
    shear = run.shear()
    moved, _ = displacement(run, frame)
    cells = run.cells[shear.axis]
    size = shear.width / cells
    x = frame.field("position")[:, shear.axis]
    column = np.clip(((x - run.lower[shear.axis]) / size).astype(int), 0, cells - 1)
    weight = frame.field("mass") if frame.has("mass") else np.ones(len(x))
    total = np.bincount(column, weights=weight, minlength=cells)
    sums = np.bincount(column, weights=weight * moved[:, shear.along], minlength=cells)
    filled = total > 0
    return (run.lower[shear.axis] + size * (np.arange(cells) + 0.5))[filled], (sums[filled] / total[filled])


def shear_band(x: np.ndarray, u: np.ndarray, difference: float, share: float) -> tuple[float, float] | None:
    """The narrowest interval of `x` [m] across which the displacement `u` changes by `share` of `difference` [m].

    Uniform shear gives `share` of the width; None where no interval carries that much.
    """
    u = u * np.sign(difference)
    needed = share * abs(difference)
    best = None
    for i in range(len(x)):
        reached = np.flatnonzero(u[i:] - u[i] >= needed)
        if len(reached) and (best is None or x[i + reached[0]] - x[i] < best[1] - best[0]):
            best = (x[i], x[i + reached[0]])
    return best


def _band_entry(shear: Shear, frame: Frame, share: float, band: tuple[float, float], diameter: float) -> dict:
    """What summary.json says about a shear band; also printed."""
    width = band[1] - band[0]
    print(f"  {100 * shear.fraction(frame.time):.0f} % shear: {100 * share:.0f} % of it within {1e3 * width:.3g} mm = "
          f"{width / diameter:.1f} mean grain diameters, from {1e3 * band[0]:.3g} to {1e3 * band[1]:.3g} mm")
    return {"shear": shear.fraction(frame.time), "time_s": frame.time, "share": share,
            "from_mm": 1e3 * band[0], "to_mm": 1e3 * band[1], "width_mm": 1e3 * width,
            "width_diameters": width / diameter, "width_share_of_layer": width / shear.width}


def displacement_profile(run: Run, other: Run | None, folder: Path, summary: dict) -> list[str]:
    """Average displacement of each column of cells at 25, 50 and 75 % shear, dashed, with the uniform-shear lines,
    solid (Fig. 8); and the width of the shear band at each, in mm and in mean grain diameters."""
    shear = run.shear()
    if shear is None:
        raise MissingData("the run is not driven in shear")
    frames = []
    for fraction in FIGURE_8_SHEAR:
        try:
            frames.append((fraction, run.frame_at_shear(fraction)))
        except MissingData:
            continue
    if not frames:
        raise MissingData("the run did not reach 25 % shear")
    factor, unit = length_unit(run)
    diameter = run.mean_diameter()
    summary["mean_grain_diameter_mm"] = 1e3 * diameter
    summary["shear_band_definition"] = "narrowest interval that carries `share` of the displacement difference"
    summary["shear_band"] = []
    figure, axes = plt.subplots(figsize=(7, 5))
    for colour, (fraction, frame) in zip(("C0", "C1", "C2"), frames):
        x, u = column_profile(run, frame)
        uniform = shear.uniform_displacement(x, run.lower[shear.axis], frame.time)
        axes.plot(factor * x, factor * uniform, "-", color=colour, lw=1, label=f"{100 * fraction:.0f} % shear, uniform")
        axes.plot(factor * x, factor * u, "--", color=colour, lw=1.6, label=f"{100 * fraction:.0f} % shear, average")
        difference = frame.time * (shear.upper_velocity - shear.lower_velocity)
        for share in BAND_SHARES:
            band = shear_band(x, u, difference, share)
            if band is not None:
                summary["shear_band"].append(_band_entry(shear, frame, share, band, diameter))
    axes.set_xlabel(f"{'xyz'[shear.axis]} [{unit}]")
    axes.set_ylabel(f"displacement along {'xyz'[shear.along]} [{unit}]")
    axes.set_title(run.title, fontsize=10)
    axes.legend(fontsize=8)
    return [_save(figure, folder, "displacement_profile.png")]


def energy(run: Run, other: Run | None, folder: Path, summary: dict) -> list[str]:
    """The energy book of history.csv against time: every account, the work done at the boundary, and the error."""
    history = run.history()
    factor, unit = prefixed(history["time"][-1], "s")
    time = factor * history["time"]
    accounts = [name for name in history if name.endswith(("_energy", "_dissipation"))]
    figure, (upper, lower) = plt.subplots(2, 1, figsize=(7, 7), sharex=True, height_ratios=(3, 1))
    for k, name in enumerate(accounts):  # each has its colour in all pictures
        if np.any(history[name] != 0):
            upper.plot(time, history[name], "-" if k < 10 else ":", color=f"C{k % 10}", lw=1.3, label=name.replace("_", " "))
    if "boundary_work" in history:
        upper.plot(time, history["boundary_work"], "k--", lw=1, label="boundary work (in)")
    metre = " / m" if run.dimension == 2 else ""
    upper.set_ylabel(f"energy [J{metre}]")
    upper.set_title(run.title, fontsize=10, color="firebrick" if run.failed else "black")
    upper.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.01, 1), frameon=False)
    if "energy_error" in history:
        lower.plot(time, history["energy_error"], lw=1.2, color="C3")
        summary["energy_error_max"] = float(np.nanmax(np.abs(history["energy_error"])))
    lower.axhline(0, color="k", lw=0.5)
    lower.set_ylabel("energy error [1]")
    lower.set_xlabel(f"time [{unit}]")
    for name in accounts:
        summary.setdefault("energy_at_end_J", {})[name] = float(history[name][-1])
    _compare_plastic_work(run, other, summary)
    return [_save(figure, folder, "energy.png")]


def _compare_plastic_work(run: Run, other: Run | None, summary: dict) -> None:
    """Plastic dissipation of the other run over this one's, at the last time that both reached."""
    column = "plastic_dissipation"
    if other is None:
        return
    try:
        mine, theirs = run.history(), other.history()
    except MissingData:
        return
    if column not in mine or column not in theirs:
        return
    time = min(mine["time"][-1], theirs["time"][-1])
    work = [float(np.interp(time, book["time"], book[column])) for book in (mine, theirs)]
    if work[0] > 0:
        summary["plastic_work_ratio_to_this_run"] = {other.folder.name: work[1] / work[0]}


FIGURES = (grains_start, grains_later, principal_stress, stress_inside, force_chains, displacement_profile, energy,
           *laboratory.FIGURES)
