"""Which bodies a case has: their materials, groups and extents at the start, and which of them are tools.

Bodies are numbered in the order of [[bodies]], then of the rows of the grain tables. A tool is a body that is rigid or
driven; the others are grains.
"""

from __future__ import annotations

import csv
import dataclasses
from pathlib import Path

import numpy as np

FACES = ("left", "right", "bottom", "top", "back", "front")  # axis = index // 2


@dataclasses.dataclass
class BodyTable:
    """One row for each body, by its number."""

    material: np.ndarray  # index in the order of [materials]
    group: np.ndarray  # name, or ""
    lower: np.ndarray  # extent at the start [m], NaN where the shape does not tell; N x dimension
    upper: np.ndarray
    tool: np.ndarray  # rigid or driven

    def __len__(self) -> int:
        return len(self.material)


def extent(shape: dict, dimension: int) -> tuple[np.ndarray, np.ndarray]:
    """The least box around a shape of the case file [m]; of turned ones a box that surely holds them."""
    unknown = np.full(dimension, np.nan)
    kind = shape.get("type")
    if kind in ("disk", "sphere", "ellipse", "ellipsoid"):
        centre = np.array(shape["centre"], float)
        reach = np.array(shape.get("radii", shape.get("radius")), float)
        if shape.get("angle"):
            reach = reach.max()
        return centre - reach, centre + reach
    if kind == "box":
        lower, upper = np.array(shape["lower"], float), np.array(shape["upper"], float)
        if np.any(shape.get("angle", 0)):
            centre, reach = (lower + upper) / 2, np.linalg.norm(upper - lower) / 2
            return centre - reach, centre + reach
        return lower, upper
    if kind == "polygon":
        points = np.array(shape["points"], float)
        return points.min(axis=0), points.max(axis=0)
    if kind == "cylinder":
        ends = np.array([shape["from"], shape["to"]], float)
        return ends.min(axis=0) - shape["radius"], ends.max(axis=0) + shape["radius"]
    if kind in ("union", "difference", "intersection"):
        parts = [extent(part, dimension) for part in shape["of"]]
        if kind == "difference":
            return parts[0]
        inner, outer = (np.min, np.max) if kind == "union" else (np.max, np.min)
        return inner([p[0] for p in parts], axis=0), outer([p[1] for p in parts], axis=0)
    return unknown, unknown


def read_bodies(case: dict, folder: Path) -> BodyTable:
    """The bodies of a case as it was run, whose grain tables lie in `folder`."""
    domain = case["domain"]
    dimension = int(domain.get("dimension", 2))
    names = list(case.get("materials", {}))
    materials, groups, boxes = [], [], []
    for body in case.get("bodies", []):
        materials.append(names.index(body["material"]))
        groups.append(body.get("group", ""))
        boxes.append(extent(body["shape"], dimension))
    for grains in case.get("grains", []):
        with open(folder / grains["file"], encoding="utf-8-sig") as file:
            lines = [line for line in file if line.strip() and not line.lstrip().startswith("#")]
        rows = [{key.strip(): (cell or "").strip() for key, cell in row.items()} for row in csv.DictReader(lines)]
        for row in rows:
            materials.append(names.index(row.get("material") or grains["material"]))
            groups.append(row.get("group") or grains.get("group", ""))
            centre, radius = np.array([float(row[axis]) for axis in "xyz"[:dimension]]), float(row["r"])
            boxes.append((centre - radius, centre + radius))
    ends = np.array(boxes).reshape(-1, 2, dimension)
    table = BodyTable(np.array(materials, int), np.array(groups, object), ends[:, 0], ends[:, 1],
                      np.zeros(len(materials), bool))
    rigid = np.array([case["materials"][name].get("model") == "rigid" for name in names])
    table.tool = rigid[table.material] if len(table) else table.tool
    for drive in case.get("drive", []):
        table.tool |= selected(table, drive.get("bodies", drive), domain)
    return table


def selected(table: BodyTable, selection: dict, domain: dict) -> np.ndarray:
    """Which bodies a drive moves."""
    chosen = np.zeros(len(table), bool)
    if "ids" in selection:
        ids = np.array(selection["ids"], int)
        chosen[ids[ids < len(table)]] = True
    elif selection.get("group"):
        chosen = table.group == selection["group"]
    elif selection.get("overlapping"):
        axis, high = divmod(FACES.index(selection["overlapping"]), 2)
        within = selection.get("within", 0.0)
        if high:
            chosen = table.upper[:, axis] > domain["upper"][axis] - within
        else:
            chosen = table.lower[:, axis] < domain.get("lower", [0, 0, 0])[axis] + within
    return chosen
