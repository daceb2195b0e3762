"""Reads a result folder: the case as it was run, the frames of material points, and the energy book.

All quantities are in SI units. In two dimensions volumes are areas [m2] (plane strain, per metre of thickness).
"""

from __future__ import annotations

import copy
import csv
import json
import tomllib
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import h5py
import numpy as np

from bodies import FACES, BodyTable, read_bodies
from lattice import SPACING_TO_CELL, Lattice
from look import Look

COMPONENTS = {"position": 3, "velocity": 3, "spin": 3, "image": 3, "stress": 6, "stress_smooth": 6,
              "deformation_gradient": 9,
              "centre": 3, "angular_velocity": 3, "mean_stress": 6, "second_moment": 6,  # of bodies
              "point": 3, "normal": 3, "force": 3, "moment": 9}  # of contacts; other fields have one


class MissingData(Exception):
    """A picture cannot be drawn from these results; the message says what is missing."""


class Damaged(Exception):
    """A result file is not what a run leaves; the message names it and says why."""


@contextmanager
def reading(path: Path):
    """Whatever goes wrong while `path` is read becomes Damaged: the libraries raise errors of many types."""
    try:
        yield
    except (MissingData, Damaged):
        raise
    except Exception as error:
        reason = f"it has no {error}" if isinstance(error, KeyError) else str(error)
        raise Damaged(f"{path} cannot be read: {reason.splitlines()[0] if reason else type(error).__name__}") from error


@dataclass
class Shear:
    """Two opposite faces, or the bodies across them, that slide past each other."""

    axis: int  # across the sheared layer
    along: int  # of the relative motion
    width: float  # [m]
    lower_velocity: float  # [m/s], along `along`
    upper_velocity: float

    def fraction(self, time: float) -> float:
        """Average shear strain (1 = 100 %) at `time` [s]."""
        return abs(self.upper_velocity - self.lower_velocity) * time / self.width

    def uniform_displacement(self, x: np.ndarray, lower: float, time: float) -> np.ndarray:
        """Displacement [m] along `along` at positions `x` [m] if the layer sheared uniformly."""
        share = (x - lower) / self.width
        return time * (self.lower_velocity + (self.upper_velocity - self.lower_velocity) * share)


class Frame:
    """Material points at one time, or bodies, or contacts. Fields are read when asked for, and not kept."""

    def __init__(self, path: Path):
        self.path = path
        with reading(path), h5py.File(path, "r") as file:
            group = file["VTKHDF"] if "VTKHDF" in file else file
            self.time = float(_attribute(group, file, "time"))  # [s]
            self.step = int(_attribute(group, file, "step"))
            if not np.isfinite(self.time):
                raise ValueError(f"its time is {self.time}")
            self.names = set(group["PointData"].keys()) if "PointData" in group else set()
            self.points = group["Points"].shape[0]

    def has(self, name: str) -> bool:
        return name in self.names or name == "position"

    def field(self, name: str) -> np.ndarray:
        """One value or row for each point: position (N x 3) [m], velocity (N x 3) [m/s],
        stress (N x 6: xx yy zz xy yz xz) [Pa], volume (N) [m3, m2 in 2D], body, id, image (N x 3), ..."""
        if not self.has(name):
            where = " (see output.particles.fields)" if self.path.name.startswith("particles") else ""
            raise MissingData(f"{self.path.name} holds no field '{name}'{where}")
        with reading(self.path), h5py.File(self.path, "r") as file:
            group = file["VTKHDF"] if "VTKHDF" in file else file
            values = (group["Points"] if name == "position" else group["PointData"][name])[()]
            expected = (self.points, COMPONENTS[name]) if name in COMPONENTS else (self.points,)
            if values.shape != expected or values.dtype.kind not in "iuf":
                raise ValueError(f"'{name}' is {values.dtype} of shape {values.shape}, not numbers of shape {expected}")
            if not np.isfinite(values).all() or (name == "body" and values.size and values.min() < 0):
                raise ValueError(f"'{name}' holds values that no run writes")
            return values


def _attribute(group: h5py.Group, file: h5py.File, name: str):
    for holder in (group, file):
        if name in holder.attrs:
            return np.ravel(holder.attrs[name])[0]
    raise ValueError(f"it has no attribute '{name}'")


class Run:
    """One result folder."""

    def __init__(self, folder: Path):
        self.folder = Path(folder)
        case_file = self.folder / "case.toml"
        if not case_file.is_file():
            raise MissingData(f"{self.folder} is not a result folder: it has no case.toml")
        with reading(case_file):
            self._read_case(tomllib.loads(case_file.read_text(encoding="utf-8")))
        self.failed = self._has_failed()
        if self.failed:
            self.title += " - THE RUN FAILED"
        self.frames = [Frame(path) for path in sorted(self.folder.glob("particles_*.vtkhdf"))]
        self._smoothed: tuple[Path, np.ndarray] | None = None  # the last, as a scale and a picture want it one after the other
        self.raw_stress = False  # pictures show the points' stress as computed
        self.look = Look()

    def _read_case(self, case: dict) -> None:
        self.case = case
        domain = case["domain"]
        self.dimension = int(domain.get("dimension", len(domain["lower"])))
        if self.dimension not in (2, 3):
            raise ValueError(f"domain.dimension is {self.dimension}")
        self.lower = np.array(domain["lower"][: self.dimension], float)  # [m]
        self.upper = np.array(domain["upper"][: self.dimension], float)
        self.cells = self._cells(domain)
        self.periodic = np.zeros(self.dimension, bool)
        self.periodic[:] = domain.get("periodic", [False] * self.dimension)[: self.dimension]
        sizes = (self.upper - self.lower) / self.cells
        if sizes.shape != (self.dimension,) or not (np.isfinite(sizes) & (sizes > 0)).all():
            raise ValueError("the domain has no size, or its cells have none")
        gravity = domain.get("gravity")
        self.gravity_varies = varies(gravity)
        self.gravity = self._vector(None if self.gravity_varies else gravity)  # [m/s2]; zero where it varies
        self.title = str(case.get("title") or self.folder.resolve().name)
        self._velocities = self._face_velocities()
        self._prescribed = [self._vector(drive.get("velocity")) for drive in case.get("drive", [])
                            if not _free(drive)]  # [m/s]
        if not self.point_spacing > 0:
            raise ValueError(f"solver.points_per_cell gives a spacing of {self.point_spacing}")

    def upper_at(self, time: float) -> np.ndarray:
        """The upper corner of the domain then [m], which may deform."""
        if "deform" not in self.case["domain"] and not any("deform" in stage.get("set", {}).get("domain", {})
                                                           for stage in self.case.get("stage", [])):
            return self.upper
        history = self.history()
        return self.lower + [np.interp(time, history["time"], history[f"length_{axis}"])
                             for axis in "xyz"[: self.dimension]]

    def at(self, frame: Frame) -> Run:
        """The run with the domain as it was at the time of a frame."""
        upper = self.upper_at(frame.time)
        if upper is self.upper:
            return self
        then = copy.copy(self)
        then.upper = upper
        return then

    def _has_failed(self) -> bool:
        """Whether the last run into this folder failed: it says so itself, or it left its last state."""
        record = self.folder / "run.json"
        if not record.is_file():
            return (self.folder / "failure_particles.vtkhdf").is_file()
        with reading(record):
            return json.loads(record.read_text(encoding="utf-8"))["runs"][-1]["exit_code"] == 3

    def stress_name(self, frame: Frame) -> str:
        """What stress pictures show: the points' own on request, else the smooth one of the file, or one made here."""
        if self.raw_stress:
            return "stress"
        return "stress_smooth" if frame.has("stress_smooth") else "stress, smoothed"

    @property
    def stiffness(self) -> float:
        """The largest modulus of a material [Pa]; 0 where none has one."""
        laws = self.case.get("materials", {}).values()
        return max((float(value) for law in laws for key, value in law.items()
                    if key.endswith("modulus") and isinstance(value, (int, float))), default=0.0)

    def unstressed(self, frame: Frame) -> np.ndarray:
        """Bodies whose stress is not computed: rigid or driven ones, at none of whose points there is any."""
        body = frame.field("body")
        bearing = body[frame.field(self.stress_name(frame).split(",")[0]).any(axis=1)]
        return np.setdiff1d(np.union1d(self._moved_alike, np.flatnonzero(self.bodies.tool)), bearing)

    def stress(self, frame: Frame) -> np.ndarray:
        """Stress to look at (N x 6: xx yy zz xy yz xz) [Pa]."""
        name = self.stress_name(frame)
        if name != "stress, smoothed":
            return frame.field(name)
        if self._smoothed is None or self._smoothed[0] != frame.path:
            self._smoothed = frame.path, smoothed(self, frame, frame.field("stress"))
        return self._smoothed[1]

    def has_stress(self, frame: Frame) -> bool:
        """Whether there is a stress to look at."""
        return frame.has("stress") or (frame.has("stress_smooth") and not self.raw_stress)

    def _cells(self, domain: dict) -> np.ndarray:
        if "cells" in domain:
            return np.array(domain["cells"][: self.dimension], int)
        return np.rint((self.upper - self.lower) / domain["cell_size"]).astype(int)

    @property
    def cell_size(self) -> float:
        """Side of a cell [m]."""
        return float(((self.upper - self.lower) / self.cells)[0])

    @property
    def point_spacing(self) -> float:
        """Distance between neighbouring material points at the start [m]."""
        points = self.case.get("solver", {}).get("points_per_cell", 2**self.dimension)
        return self.cell_size / points ** (1 / self.dimension)

    def shear(self) -> Shear | None:
        """The shearing motion that drives the run, or None."""
        velocities = self._velocities
        for axis in range(self.dimension):
            pair = [velocities.get(face) for face in FACES[2 * axis : 2 * axis + 2]]
            if pair[0] is None or pair[1] is None:
                continue
            difference = np.abs(pair[1] - pair[0])
            difference[axis] = 0
            if difference.max() > 0:
                along = int(difference.argmax())
                return Shear(axis, along, self.upper[axis] - self.lower[axis], pair[0][along], pair[1][along])
        return None

    def _face_velocities(self) -> dict[str, np.ndarray]:
        """Velocity [m/s] of every face that is fixed, is a wall, or carries driven bodies."""
        velocities = {}
        for face, condition in self.case.get("boundary", {}).items():
            if isinstance(condition, dict) and condition.get("type") in ("fixed", "wall") and not varies(
                    condition.get("velocity")):
                velocities[face] = self._vector(condition.get("velocity"))
        for drive in self.case.get("drive", []):
            face = drive.get("bodies", drive).get("overlapping")
            if face and not _free(drive):
                velocities[face] = self._vector(drive.get("velocity"))
        return velocities

    def _vector(self, value) -> np.ndarray:
        components = np.zeros(self.dimension)
        if value is not None:
            components[:] = value[: self.dimension]
        if not np.isfinite(components).all():
            raise ValueError(f"a vector is {value}")
        return components

    def frame_at_shear(self, fraction: float) -> Frame:
        """The output nearest to an average shear of `fraction`; at most 0.02 away."""
        shear = self.shear()
        if shear is None:
            raise MissingData("the run is not driven in shear")
        if not self.frames:
            raise MissingData("there are no particles_*.vtkhdf files")
        best = min(self.frames, key=lambda frame: abs(shear.fraction(frame.time) - fraction))
        if abs(shear.fraction(best.time) - fraction) > 0.02:
            raise MissingData(f"no output near {100 * fraction:.0f} % shear")
        return best

    @cached_property
    def contact_files(self) -> list[Frame]:
        """Rows for touching pairs: body_a, body_b, point [m], normal, force on a [N], means since the file before."""
        return [Frame(path) for path in sorted(self.folder.glob("contacts_*.h5"))]

    @cached_property
    def grain_files(self) -> list[Frame]:
        """Rows for bodies: body, mass [kg], centre [m], velocity [m/s], angular_velocity, mean_stress [Pa], ..."""
        return [Frame(path) for path in sorted(self.folder.glob("grains_*.h5"))]

    def file_at(self, files: list[Frame], time: float) -> Frame | None:
        """The file of that time [s], to a thousandth of the time between particle files; None where there is none."""
        spaces = np.diff([frame.time for frame in self.frames])
        near = 1e-3 * spaces.min() if len(spaces) and spaces.min() > 0 else 1e-9
        best = min(files, key=lambda file: abs(file.time - time), default=None)
        return best if best is not None and abs(best.time - time) <= max(near, 1e-12 * abs(time)) else None

    @cached_property
    def driven_bodies(self) -> np.ndarray:
        """Ids of the bodies that are rigid, or moved as rigid parts."""
        last = self.frames[-1]
        bare = self.unstressed(last) if last.points and last.has("body") and self.has_stress(last) else []
        return np.union1d(self._moved_alike, bare).astype(int)

    @cached_property
    def _moved_alike(self) -> np.ndarray:
        """Ids of the bodies all of whose points keep one and the same prescribed velocity."""
        last = self.frames[-1]
        if not (self._prescribed and last.points and last.has("velocity") and last.has("body")):
            return np.array([], int)
        velocity = last.field("velocity")[:, : self.dimension]
        bodies, body = np.unique(last.field("body"), return_inverse=True)
        tolerance = 1e-9 * max(np.abs(velocity).max(), 1e-300)
        moved = np.zeros(len(body), bool)
        for value in self._prescribed:
            moved |= (np.abs(velocity - value) <= tolerance).all(axis=1)
        return bodies[np.bincount(body, weights=moved) == np.bincount(body)]

    def mean_diameter(self) -> float:
        """Mean diameter [m] of the bodies that are not driven, from their volume at the start."""
        frame = self.frames[0]
        bodies, body = np.unique(frame.field("body"), return_inverse=True)
        if frame.has("volume"):
            weights = frame.field("volume")
        else:
            weights = np.full(len(body), self.point_spacing**self.dimension)
        volume = np.bincount(body, weights=weights)
        free = ~np.isin(bodies, self.driven_bodies)
        if not free.any():
            raise MissingData("all bodies are driven, so that there is no mean diameter")
        factor = {2: 4 / np.pi, 3: 6 / np.pi}[self.dimension]
        return float(np.mean((factor * volume[free]) ** (1 / self.dimension)))

    @cached_property
    def bodies(self) -> BodyTable:
        """Materials, groups and extents of the bodies, and which are tools."""
        with reading(self.folder / "case.toml"):
            return read_bodies(self.case, self.folder)

    @cached_property
    def grains(self) -> list[Frame]:
        """The files with a row for each body; there are some."""
        return self._outputs("grains", self.grain_files)

    @cached_property
    def contacts(self) -> list[Frame]:
        """The files with a row for each contact; there are some."""
        return self._outputs("contacts", self.contact_files)

    def _outputs(self, name: str, files: list[Frame]) -> list[Frame]:
        if not files:
            raise MissingData(f"there are no {name}_*.h5 files (see output.{name})")
        return files

    def history(self) -> dict[str, np.ndarray]:
        """Columns of history.csv by name."""
        return self._table("history")

    def forces(self) -> dict[str, dict[str, np.ndarray]]:
        """Columns of forces.csv by name, for each tool by its name."""
        table = self._table("forces", text=("name",))
        names = table.pop("name")
        return {str(name): {key: column[names == name] for key, column in table.items()} for name in np.unique(names)}

    def _table(self, name: str, text: tuple[str, ...] = ()) -> dict[str, np.ndarray]:
        """Columns of a CSV file of numbers by name; those in `text` are words."""
        path = self.folder / f"{name}.csv"
        if not path.is_file():
            raise MissingData(f"there is no {path.name} (see output.{name})")
        with reading(path):
            whole = path.read_text(encoding="utf-8").rpartition("\n")[0]  # a run that was killed may leave part of a line
            names, *rows = list(csv.reader(whole.splitlines())) or [[]]
            if "time" not in names:
                raise ValueError("it has no column 'time'")
            if any(len(row) != len(names) for row in rows):
                raise ValueError("its lines are not equally long")
            if not rows:
                raise MissingData(f"{path.name} has no rows")
            table = {key: np.array(column) if key in text else np.array(column, float)
                     for key, column in zip(names, zip(*rows))}
            if not np.isfinite(table["time"]).all():
                raise ValueError("a time is not finite")
        return table


def _free(drive: dict) -> bool:
    """Whether the velocity of a drive is none that is the same all the time."""
    return "piston" in drive or "servo" in drive or varies(drive.get("velocity"))


def varies(velocity) -> bool:
    """A velocity that changes with time: rows of a table, or formulas among its components."""
    return isinstance(velocity, list) and any(isinstance(component, (list, str)) for component in velocity)


def smoothed(run: Run, frame: Frame, values: np.ndarray) -> np.ndarray:
    """Points' values (N x K) as the nodes see them: of each body, the mean over a node's points by volume, and that back
    at the points. As `stress_smooth` of a run (docs/results.md), but on a lattice of the pictures'."""
    position = frame.field("position")[:, : run.dimension]
    body = frame.field("body") if frame.has("body") else np.zeros(frame.points, int)
    volume = frame.field("volume") if frame.has("volume") else np.ones(frame.points)
    lattice = Lattice(position, body, SPACING_TO_CELL * run.point_spacing, run.lower, run.at(frame).upper, run.periodic)
    nodal = lattice.to_nodes(np.column_stack([values * volume[:, None], volume]))
    return lattice.to_points(nodal[:, :-1] / np.maximum(nodal[:, -1:], 1e-300))


def principal_stress_difference(stress: np.ndarray) -> np.ndarray:
    """Difference of the in-plane principal stresses [Pa], sqrt((sxx - syy)^2 + 4 sxy^2)."""
    return np.hypot(stress[:, 0] - stress[:, 1], 2 * stress[:, 3])


def displacement(run: Run, frame: Frame) -> tuple[np.ndarray, np.ndarray]:
    """Displacement [m] of every point of `frame` since the first frame (N x dimension), matched by id, and the
    index of each point in the first frame. Periodic crossings are undone with the field `image`."""
    start = run.frames[0]
    if run.periodic.any() and not (start.has("image") and frame.has("image")):
        raise MissingData("periodic displacements need the field 'image' in output.particles.fields")
    start_ids, ids = start.field("id"), frame.field("id")
    order = np.argsort(start_ids)
    match = order[np.minimum(np.searchsorted(start_ids, ids, sorter=order), len(order) - 1)]
    if not np.array_equal(start_ids[match], ids):
        raise MissingData(f"{frame.path.name} holds points that the first frame does not")
    return unwrapped(run, frame) - unwrapped(run, start)[match], match


def unwrapped(run: Run, frame: Frame) -> np.ndarray:
    """Positions [m] that go on across periodic faces (N x dimension)."""
    position = frame.field("position")[:, : run.dimension].astype(float)
    if run.periodic.any():
        position = position + frame.field("image")[:, : run.dimension] * (run.at(frame).upper - run.lower) * run.periodic
    return position
