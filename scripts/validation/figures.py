"""Pictures that several problems share: curves over time beside the exact ones, and errors against cell size."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import LogLocator, NullLocator, StrMethodFormatter


@dataclasses.dataclass
class Curve:
    label: str
    x: np.ndarray
    y: np.ndarray
    style: str = "-"
    colour: str | None = None


@dataclasses.dataclass
class Panel:
    title: str
    x_label: str
    y_label: str
    curves: list[Curve]
    logarithmic: bool = False  # both axes; cell sizes along x
    log_from: float = 0.0  # above 0: a logarithmic axis for y that begins here


def save(figure, path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=130, bbox_inches="tight")
    plt.close(figure)
    return path


def draw_panels(path: Path, title: str, panels: list[Panel], columns: int = 3) -> Path:
    """All panels in rows of `columns`, in one picture. A legend that the panel before has as well is left out."""
    columns = min(columns, len(panels))
    rows = -(-len(panels) // columns)
    figure, grid = plt.subplots(rows, columns, figsize=(4.6 * columns, 3.6 * rows), squeeze=False)
    for axes in grid.flat[len(panels):]:
        axes.set_axis_off()
    labels: list[str] = []
    for axes, panel in zip(grid.flat, panels):
        for curve in panel.curves:
            colour = {"color": curve.colour} if curve.colour else {}
            axes.plot(curve.x, curve.y, curve.style, lw=1.2, ms=4, label=curve.label, **colour)
        if panel.logarithmic:
            axes.set_xscale("log")
            axes.set_yscale("log")
            sizes = sorted({float(size) for curve in panel.curves for size in curve.x})
            axes.set_xticks(sizes, [f"1/{round(1 / size)}" for size in sizes])
            axes.xaxis.set_minor_locator(NullLocator())
            axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
            axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
            axes.yaxis.set_minor_locator(NullLocator())
        if panel.log_from > 0:
            axes.set_yscale("log")
            axes.set_ylim(bottom=panel.log_from)
        axes.set_title(panel.title, fontsize=9)
        axes.set_xlabel(panel.x_label)
        axes.set_ylabel(panel.y_label)
        axes.grid(alpha=0.3)
        labels, before = [curve.label for curve in panel.curves], labels
        if labels != before:
            axes.legend(fontsize=7)
    figure.suptitle(title, fontsize=11)
    figure.tight_layout()
    return save(figure, path)


def convergence(title: str, y_label: str, errors: dict[str, tuple[list[float], list[float]]], x_label: str,
                slopes: tuple[int, ...] = (1, 2)) -> Panel:
    """Errors by name, each (cell sizes, errors), on logarithmic axes with lines of the given orders."""
    curves = [Curve(name, np.array(size), np.abs(error), "o-") for name, (size, error) in errors.items()]
    sizes = np.array(sorted({size for pair in errors.values() for size in pair[0]}))
    top = max((curve.y.max() for curve in curves if len(curve.y)), default=1.0)
    if len(sizes) > 1:
        curves += [Curve(f"order {slope}", sizes, top * (sizes / sizes[-1]) ** slope, ":", "0.6") for slope in slopes]
    return Panel(title, x_label, y_label, curves, logarithmic=True)
