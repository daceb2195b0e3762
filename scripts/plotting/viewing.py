"""Writes one page that shows a run in a browser: turn, zoom, cut open, pick bodies, play. It needs no network.

Points are stored as they are at the first frame, to 16 bits of the domain. At later frames each body has the affine map
that fits its points best, and each point what it is off from that, to 8 bits: deformed bodies cost little that way. Of
many frames, so many hold points' own places and values as the size allows; between them both are interpolated.
"""

from __future__ import annotations

import argparse
import base64
import json
import sys
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import colours
from command import run_command, whole_file
from figures import label
from results import Frame, MissingData, Run
from scalars import SCALARS, limits, mean_pressure, mises, scalar
from space import up_axis
from skin import depths
from surface import lattice_of

HERE = Path(__file__).resolve().parent
SIZE = 5.9e6  # bytes of a page, unless asked for otherwise
MOST_POINTS = 400_000
MOST_FRAMES = 120
DEEP = 24.0  # steps of depth beneath the surface in a spacing; 255: no surface near
HISTORY_ROWS = 600
DEFAULTS = {2: ("difference", "pressure", "speed", "plastic_strain"), 3: ("mises", "pressure", "speed", "plastic_strain")}


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="scripts/view", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path, metavar="RUN_DIR", help="result folder of a run")
    parser.add_argument("-o", "--out", type=Path, metavar="FILE", help="the page; default: RUN_DIR/view.html")
    parser.add_argument("--values", nargs="+", metavar="VALUE", help="values to colour by: " + ", ".join(SCALARS) +
                        ", or any field with one component; default: stresses, speed and plastic strain, where they are")
    parser.add_argument("--size", type=float, default=SIZE / 1e6, metavar="MB", help="size of the page (5.9)")
    return parser.parse_args()


class Pack:
    """Numbers behind each other in one block of bytes, with an index."""

    def __init__(self):
        self.parts: list[bytes] = []
        self.index: dict[str, list] = {}
        self.length = 0

    def add(self, name: str, values: np.ndarray) -> None:
        """One array; aligned to 8 bytes."""
        data = np.ascontiguousarray(values).tobytes()
        self.index[name] = [values.dtype.name, self.length, values.size]
        self.parts.append(data + b"\0" * (-len(data) % 8))
        self.length += len(self.parts[-1])

    def compressed(self) -> bytes:
        return zlib.compress(b"".join(self.parts), 9)


def _packed(parts: dict[str, np.ndarray]) -> float:
    """Bytes that arrays take in a page."""
    pack = Pack()
    for name, values in parts.items():
        pack.add(name, values)
    return len(pack.compressed()) * 4 / 3


def differences(values: np.ndarray) -> np.ndarray:
    """16-bit numbers as differences, low bytes before high ones: what is regular packs well so."""
    steps = np.diff(values.astype(np.int64), prepend=0).astype(np.uint16)
    return np.concatenate([(steps & 255).astype(np.uint8), (steps >> 8).astype(np.uint8)])


@dataclass
class Points:
    """The points that a page shows: their ids in order, by body, and where they are at the first frame."""

    ids: np.ndarray
    body: np.ndarray  # index into bodies
    bodies: np.ndarray  # numbers
    place: np.ndarray  # (N x 3) [m], no body is torn by a periodic boundary
    spacing: float
    step: int  # every so many points are shown


def chosen_points(run: Run, frame: Frame, most: int) -> tuple[Points, np.ndarray]:
    """Points to show, and their rows in the frame."""
    if not frame.points:
        raise MissingData(f"{frame.path.name} holds no points")
    body = frame.field("body") if frame.has("body") else np.zeros(frame.points, int)
    bodies, which = np.unique(body, return_inverse=True)
    position = frame.field("position").astype(float)
    cells = np.floor((position - position.min(axis=0)) / (4 * run.point_spacing)).astype(int)
    order = np.lexsort((position[:, 0], position[:, 1], position[:, 2], cells[:, 0], cells[:, 1], cells[:, 2], which))
    step = -(-len(order) // most)
    order = order[::step]
    ids = frame.field("id")[order] if frame.has("id") else order
    place = untorn(run, position[order], which[order], len(bodies))
    return Points(ids, which[order], bodies, place, run.point_spacing * step ** (1 / run.dimension), step), order


def untorn(run: Run, position: np.ndarray, which: np.ndarray, count: int) -> np.ndarray:
    """Positions as seen from one point of each body, across periodic boundaries."""
    first = np.zeros(count, int)
    first[which[::-1]] = np.arange(len(which))[::-1]
    for axis in np.flatnonzero(run.periodic):
        period = run.upper[axis] - run.lower[axis]
        position[:, axis] -= period * np.rint((position[:, axis] - position[first[which], axis]) / period)
    return position


def affine(start: np.ndarray, now: np.ndarray, which: np.ndarray, count: int, known: np.ndarray) -> np.ndarray:
    """For each body the map (3 x 4) from places at the start to those now, by least squares with a touch of stiffness
    where points do not tell (flat bodies)."""
    maps = np.zeros((count, 3, 4))
    maps[:, :, :3] = np.eye(3)
    weight = known.astype(float)
    total = np.maximum(np.bincount(which, weights=weight, minlength=count), 1e-300)
    mean = [np.stack([np.bincount(which, weights=weight * c, minlength=count) / total for c in x.T], 1) for x in (start, now)]
    a, b = start - mean[0][which], now - mean[1][which]
    moments = np.zeros((2, count, 3, 3))
    for i in range(3):
        for j in range(3):
            for k, (u, v) in enumerate(((a, a), (b, a))):
                moments[k, :, i, j] = np.bincount(which, weights=weight * u[:, i] * v[:, j], minlength=count) / total
    stiff = 1e-6 * np.trace(moments[0], axis1=1, axis2=2) + 1e-300
    moments += stiff[None, :, None, None] * np.eye(3)
    maps[:, :, :3] = moments[1] @ np.linalg.inv(moments[0])
    maps[:, :, 3] = mean[1] - np.einsum("nij,nj->ni", maps[:, :, :3], mean[0])
    return maps


def rows_of(points: Points, frame: Frame, same: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows of the points in a frame, and which of them are there."""
    if not frame.has("id"):
        if frame.points <= same.max():
            raise MissingData(f"{frame.path.name}: points cannot be followed without the field 'id'")
        return same, np.ones(len(same), bool)
    ids = frame.field("id")
    order = np.argsort(ids)
    at = order[np.minimum(np.searchsorted(ids, points.ids, sorter=order), max(len(ids) - 1, 0))] if len(ids) else 0 * same
    return at, (ids[at] == points.ids) if len(ids) else np.zeros(len(same), bool)


class Page:
    """All that a page holds, for a choice of frames."""

    def __init__(self, run: Run, names: list[str] | None):
        if not run.frames:
            raise MissingData("there are no particles_*.vtkhdf files (see output.particles)")
        self.run = run
        every = -(-len(run.frames) // MOST_FRAMES)
        self.frames = run.frames[::-1][::every][::-1] if every > 1 else run.frames
        self.points, self.rows = chosen_points(run, self.frames[0], MOST_POINTS)
        self.names = names or self._default_values()
        self.shown = [scalar(run, self.frames[0], name) for name in self.names]
        self.ends = []
        for value in self.shown:
            sample = self.frames[:: -(-len(self.frames) // 6)]
            self.ends.append(limits([value.values(run, frame) for frame in sample if frame.points], value.signed,
                                    value.noise(run)))

    def _default_values(self) -> list[str]:
        first = self.frames[0]
        there = {"difference": self.run.has_stress(first), "mises": self.run.has_stress(first),
                 "pressure": self.run.has_stress(first), "speed": first.has("velocity")}
        return [name for name in DEFAULTS[self.run.dimension] if there.get(name, first.has(name))]

    def html(self, size: float) -> tuple[str, int]:
        """The page with as many full frames as fit into `size` [bytes], and their number."""
        common = self._common()
        once, each = _packed(common), _packed(self._blocks([len(self.frames) - 1]))
        fixed = len(self._fill(Pack(), [0]))
        full, refined = int(np.clip((size - fixed - once) / (1.03 * each), 1, len(self.frames))), False
        while True:
            kept = sorted({round(k) for k in np.linspace(0, len(self.frames) - 1, full)}) if full > 1 else [0]
            pack = Pack()
            for name, values in (common | self._blocks(kept)).items():
                pack.add(name, values)
            page = self._fill(pack, kept)
            more = min(len(self.frames), int(0.97 * full * (size - fixed - once) / max(len(page) - fixed - once, 1)))
            if len(page) <= size and more > full and not refined:  # the last frame took more than most
                full, refined = more, True
            elif len(page) <= size or full == 1:
                return page, len(kept)
            else:
                full -= 1

    def _common(self) -> dict[str, np.ndarray]:
        """What is there once: points at the start, their surface, and the bodies' motion at all frames."""
        run, points = self.run, self.points
        parts = {"counts": np.bincount(points.body, minlength=len(points.bodies)).astype(np.uint32)}
        self.low = points.place.min(axis=0)
        self.extent = float(np.ptp(points.place, axis=0).max()) or 1.0
        whole = np.rint((points.place - self.low) / self.extent * 65535).astype(np.uint16)
        for axis in range(3):
            parts[f"place_{axis}"] = differences(whole[:, axis])
        self.start = whole / 65535 * self.extent + self.low
        normal, deep = np.zeros((len(points.ids), 3)), np.zeros(len(points.ids))
        if run.dimension == 3:
            first = self.frames[0]
            position = first.field("position").astype(float)
            body = first.field("body") if first.has("body") else np.zeros(first.points, int)
            volume = first.field("volume") if first.has("volume") else np.full(first.points, run.point_spacing**3)
            lattice = lattice_of(position, body, run.point_spacing, run.lower, run.upper, run.periodic)
            normal, deep = (values[self.rows] for values in depths(lattice, volume, run.point_spacing))
        parts["normal"] = np.rint(127 * normal).astype(np.int8).T.ravel()
        parts["deep"] = np.where(np.isfinite(deep), np.clip(np.rint(deep / run.point_spacing * DEEP), 0, 254), 255).astype(np.uint8)
        self.motion = [self._motion(frame) for frame in self.frames]
        parts["motion"] = np.stack([maps for maps, *_ in self.motion]).astype(np.float32)
        self._bodies_parts(parts)
        return parts

    def _motion(self, frame: Frame):
        """Maps of the bodies, rows of the points, and which are there."""
        at, known = rows_of(self.points, frame, self.rows)
        now = self.start.copy()
        if frame.points:
            now[known] = frame.field("position")[at[known]]
        count = len(self.points.bodies)
        if self.run.periodic.any():
            now = untorn(self.run, now, self.points.body, count)
        return affine(self.start, now, self.points.body, count, known), at, known

    def _blocks(self, kept: list[int]) -> dict[str, np.ndarray]:
        """What full frames hold: how far points are off their body's motion, and their values."""
        parts, self.scales, count = {}, [], len(self.points.bodies)
        for k in kept:
            maps, at, known = self.motion[k]
            frame = self.frames[k]
            now = frame.field("position").astype(float)[at] if frame.points else self.start.copy()
            if self.run.periodic.any():
                now = untorn(self.run, now, self.points.body, count)
            mine = maps[self.points.body]
            off = now - np.einsum("nij,nj->ni", mine[:, :, :3], self.start) - mine[:, :, 3]
            if self.run.periodic.any():
                period = np.zeros(3)
                period[: self.run.dimension] = (self.run.upper - self.run.lower) * self.run.periodic
                off -= period * np.rint(off / np.where(period > 0, period, 1))
            most = float(np.abs(off[known]).max(initial=0)) or 1.0
            most = max(most, 1e-3 * self.points.spacing)
            steps = np.where(known[:, None], np.rint(127 * off / most), -128).astype(np.int8)
            self.scales.append(most)
            parts[f"off_{k}"] = steps.T.ravel()
            for name, value, (low, high) in zip(self.names, self.shown, self.ends):
                values = value.values(self.run, frame)[at] if frame.points else np.zeros(len(at))
                parts[f"value_{name}_{k}"] = np.clip(np.rint((values - low) / (high - low) * 255), 0, 255).astype(np.uint8)
        return parts

    def _bodies_parts(self, parts: dict[str, np.ndarray]) -> None:
        """Stresses of bodies and contacts, at all frames."""
        bodies, run = self.points.bodies, self.run
        stress = np.full((len(self.frames), len(bodies), 2), np.nan, np.float32)
        for k, frame in enumerate(self.frames):
            table = run.file_at(run.grain_files, frame.time) if run.grain_files else None
            if table is not None:
                at = np.searchsorted(bodies, table.field("body"))
                known = (at < len(bodies)) & (bodies[np.minimum(at, len(bodies) - 1)] == table.field("body"))
                of = table.field("mean_stress")
                stress[k, at[known]] = np.stack([mean_pressure(of), mises(of)], 1)[known]
            contacts = run.file_at(run.contact_files, frame.time) if run.contact_files else None
            if contacts is not None and contacts.points:
                sides = np.stack([contacts.field("body_a"), contacts.field("body_b")], 1)
                both = np.isin(sides, bodies).all(axis=1)
                parts[f"pairs_{k}"] = np.searchsorted(bodies, sides[both]).astype(np.uint32)
                parts[f"contacts_{k}"] = np.column_stack([contacts.field("point"), contacts.field("force")])[both].astype(np.float32)
        parts["stress"] = stress
        colour = colours.of_run(run)(bodies)
        parts["colour"] = np.rint(255 * colour).astype(np.uint8)

    def _history(self) -> dict:
        try:
            history = self.run.history()
        except MissingData:
            return {}
        step = -(-len(history["time"]) // HISTORY_ROWS)
        return {name: [float(f"{v:.5g}") if np.isfinite(v) else None for v in column[::-1][::step][::-1]]
                for name, column in history.items() if name not in ("step", "dt")}

    def _fill(self, pack: Pack, kept: list[int]) -> str:
        run, points = self.run, self.points
        head = {"title": run.title, "failed": bool(run.failed), "dimension": run.dimension, "up": up_axis(run) if run.dimension == 3 else 1,
                "points": len(points.ids), "step": points.step, "spacing": points.spacing, "low": self.low.tolist(),
                "extent": self.extent, "lower": run.lower.tolist(), "upper": run.upper.tolist(),
                "periodic": run.periodic.tolist(), "bodies": points.bodies.tolist(), "deep": run.point_spacing / DEEP,
                "frames": [{"time": f.time, "step": f.step, "label": label(run, f)} for f in self.frames],
                "full": kept, "scales": self.scales, "index": pack.index, "history": self._history(),
                "units": {name: history_unit(name, run.dimension) for name in self._history()},
                "values": [{"name": n, "title": v.title, "unit": v.unit, "low": low, "high": high,
                            "map": "diverging" if low < 0 < high else "sequential"}
                           for n, v, (low, high) in zip(self.names, self.shown, self.ends)],
                "maps": {name: (255 * table[::4]).astype(int).ravel().tolist() for name, table in colours.MAPS.items()}}
        page = (HERE / "viewer.html").read_text(encoding="utf-8")
        script = "".join((HERE / name).read_text(encoding="utf-8") for name in ("viewer.js", "viewer_page.js"))
        text = json.dumps(head).replace("<", "\\u003c")  # no text of a case ends the script
        for mark, content in (("%SCRIPT%", script), ("%HEAD%", text),
                              ("%DATA%", base64.b64encode(pack.compressed()).decode("ascii"))):
            page = page.replace(mark, content, 1)
        return page


def history_unit(name: str, dimension: int) -> str:
    """The unit of a column of history.csv; "" for numbers."""
    kinds = ((("_energy", "_dissipation", "_work", "_gain", "energy_left"), "J"), (("mass", "mass_left"), "kg"))
    units = [unit for ends, unit in kinds if name.endswith(ends)] or ["kg m/s"] * name.startswith("momentum")
    return "".join(units[:1]) + (" / m" if units and dimension == 2 else "")


def view(options: argparse.Namespace) -> int:
    if not 0.1 <= options.size <= 2000:
        raise MissingData(f"--size {options.size:g}: must be from 0.1 to 2000 MB")
    run = Run(options.run)
    target = options.out or run.folder / "view.html"
    page = Page(run, options.values)
    text, full = page.html(options.size * 1e6)
    with whole_file(target) as draft:
        draft.write_text(text, encoding="utf-8")
    points = page.points
    thinned = "" if points.step == 1 else f" (one of {points.step} is shown)"
    print(f"  {target}: {len(text) / 1e6:.2f} MB, {len(points.ids)} points{thinned}, {len(page.frames)} frames, {full} of them with "
          f"the points' own places and values{': THE RUN FAILED' if run.failed else ''}")
    if len(text) > options.size * 1e6:
        print(f"  it is larger than the {options.size:g} MB asked for: one frame takes that much")
    return 0


def main() -> int:
    options = arguments()
    return run_command("view", options.run, "the page", lambda: view(options))


if __name__ == "__main__":
    sys.exit(main())
