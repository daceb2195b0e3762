"""Rows of numbers: what the readers of grains share."""

import dataclasses
import math

from converting.common import CutOff, InputError, note

SIZES = {"r": 1.0, "radius": 1.0, "radii": 1.0, "rad": 1.0, "d": 0.5, "diameter": 0.5}
VELOCITIES = ("vx", "vy", "vz")


@dataclasses.dataclass
class Grain:
    """A ball, where it stood in its file, and what else is known of it."""

    where: str
    point: list
    radius: float
    velocity: list | None = None
    clump: str = ""


def words(line):
    return line.split("#")[0].replace(",", " ").split()


def number(text, where):
    try:
        value = float(text)
    except ValueError:
        raise InputError(f"{where}: '{text}' is not a number") from None
    if not math.isfinite(value):
        raise InputError(f"{where}: '{text}' is not a finite number")
    return value


def is_numbers(values):
    try:
        return bool(values) and all(map(math.isfinite, map(float, values)))
    except ValueError:
        return False


def whole_frames(add, lines, name):
    """What `add` puts into a list, without a last frame that is cut off."""
    frames = []
    try:
        add(lines, name, frames)
    except CutOff as cut:
        if not frames:
            raise InputError(f"{cut}; no frame before it is whole") from None
        note(f"{cut}; that frame is left out, {len(frames)} before it are whole")
    if not frames:
        raise InputError(f"{name}: holds no frame")
    return frames


def chosen(frames, frame, name):
    if not -len(frames) <= frame < len(frames):
        raise InputError(f"{name}: no frame {frame}; it holds {len(frames)} that are whole, counted from 0")
    return frames[frame]


class Columns:
    """Where x, y, z (z may be missing: 2D), the size and what else is known are among the names of columns."""

    def __init__(self, names, where):
        sizes = [name for name in names if name.lower() in SIZES]
        self.places = [names.index(axis) for axis in ("x", "y", "z") if axis in names]
        if len(sizes) != 1 or "x" not in names or "y" not in names:
            raise InputError(f"{where}: the columns {' '.join(names)} must hold x, y, in 3D z, and one of "
                             "r, radius, d, diameter; say what they are called: --columns x=NAME,y=NAME,r=NAME")
        self.size, self.factor = names.index(sizes[0]), SIZES[sizes[0].lower()]
        self.velocity = [names.index(v) for v in VELOCITIES[:len(self.places)] if v in names]
        if len(self.velocity) < len(self.places):
            self.velocity = []
        clump = next((c for c in ("clump", "clumpId", "clumpid") if c in names), None)
        self.clump = None if clump is None else names.index(clump)
        self.needed = 1 + max(self.places + [self.size] + self.velocity + ([] if clump is None else [self.clump]))

    def grain(self, values, where):
        if len(values) < self.needed:
            raise InputError(f"{where}: {len(values)} values, but {self.needed} columns are needed")
        velocity = [number(values[v], where) for v in self.velocity] or None
        return Grain(where, [number(values[p], where) for p in self.places], self.factor * number(values[self.size], where),
                     velocity, "" if self.clump is None else values[self.clump])


def read_rows(lines, name, columns, first=1, split=words, width=None):
    """Of rows with `width` values each, where it is given."""
    rows = [(i, split(line)) for i, line in enumerate(lines[first - 1:], first)]
    for i, values in rows:
        if width and values and len(values) != width:
            raise InputError(f"{name}:{i}: {len(values)} values; the header names {width}")
    return [columns.grain(values, f"{name}:{i}") for i, values in rows if values]
