"""The network of contacts: a line from the centre of each body through the contact to the centre of the other, as wide
as the force is large. Forces are means since the contact file before (docs/results.md)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from results import Frame, MissingData, Run

LARGE = 8.0  # a body of so many times the median mass is a lid or a plate: lines end at its surface, as at that of a driven body
STRONG, WEAK = np.array((165, 15, 35)) / 255, np.array((125, 125, 125)) / 255
WIDEST = 0.25  # of the mean diameter of grains: the width of the line of the largest force
THINNEST = 0.03


@dataclass
class Network:
    """Contacts of one time. Periodic images of lines that leave the domain are among them."""

    lines: np.ndarray  # (N x 3 x 3) [m]: centre of one body, contact, centre of the other
    force: np.ndarray  # (N) [N], in 2D [N/m]
    top: float  # the force that has the widest line: that of 99 contacts of 100 is smaller
    mean: float  # of all contacts; lines of smaller forces are grey
    contacts: int

    @property
    def title(self) -> str:
        return f"{self.contacts} contact{'s' * (self.contacts != 1)}, width by force"

    @property
    def strong(self) -> np.ndarray:
        return self.force >= self.mean

    @property
    def share(self) -> np.ndarray:
        """Width of each line, as a share of the widest."""
        return np.clip(self.force / self.top, THINNEST / WIDEST, 1) if self.top > 0 else np.full(len(self.force), 0.1)


def widest(run: Run) -> float:
    """Width [m] of the widest line."""
    return min(WIDEST * run.mean_diameter(), 0.03 * float((run.upper - run.lower).max()))


def network(run: Run, contacts: Frame, frame: Frame) -> Network:
    """The contacts of a file; bodies' centres are those of the grains' file of that time, or of the points."""
    bodies, centres, mass = _centres(run, contacts, frame)
    sides = [contacts.field("body_a"), contacts.field("body_b")]
    point = contacts.field("point").astype(float)
    force = np.linalg.norm(contacts.field("force"), axis=1)
    known = [np.isin(side, bodies) for side in sides]
    touching = known[0] | known[1]
    sides, known = [side[touching] for side in sides], [k[touching] for k in known]
    point, force = point[touching], force[touching]
    period = np.zeros(3)
    period[: run.dimension] = (run.upper - run.lower) * run.periodic
    large = mass > LARGE * np.median(mass) if len(mass) else mass > 0
    large = large | np.isin(bodies, run.driven_bodies)
    ends = []
    for side, there in zip(sides, known):
        at = np.minimum(np.searchsorted(bodies, side), max(len(bodies) - 1, 0))
        arm = (centres[at] - point) * there[:, None]  # a line to what is no body, such as a wall, ends at the contact
        arm -= period * np.rint(arm / np.where(period > 0, period, 1))
        arm[large[at]] = 0
        ends.append(point + arm)
    lines = np.stack([ends[0], point, ends[1]], 1)
    top = float(np.percentile(force, 99)) if len(force) else 0.0
    mean = float(force.mean()) if len(force) else 0.0
    lines, source = _images(lines, run, period)
    return Network(lines, force[source], top, mean, len(force))


def _images(lines: np.ndarray, run: Run, period: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The lines, and what enters at the other side where they leave the domain."""
    source = np.arange(len(lines))
    for axis in np.flatnonzero(period > 0):
        below = lines[:, :, axis].min(axis=1) < run.lower[axis]
        above = lines[:, :, axis].max(axis=1) > run.upper[axis]
        shift = np.zeros(3)
        shift[axis] = period[axis]
        lines = np.concatenate([lines, lines[below] + shift, lines[above] - shift])
        source = np.concatenate([source, source[below], source[above]])
    return lines, source


def _centres(run: Run, contacts: Frame, frame: Frame) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Numbers of the bodies, in order, their centres [m] and masses."""
    table = run.file_at(run.grain_files, contacts.time)
    if table is not None:
        body = table.field("body")
        order = np.argsort(body)
        return body[order], table.field("centre")[order].astype(float), table.field("mass")[order]
    position = frame.field("position").astype(float)
    weight = frame.field("mass") if frame.has("mass") else np.ones(frame.points)
    bodies, which = np.unique(frame.field("body"), return_inverse=True)
    mass = np.bincount(which, weights=weight)
    centres = np.zeros((len(bodies), 3))
    for axis in range(run.dimension):
        x = position[:, axis]
        if run.periodic[axis]:  # as seen from one of its points, so that halves at both sides are not averaged
            first = np.full(len(bodies), -1)
            first[which[::-1]] = np.arange(len(which))[::-1]
            period = run.upper[axis] - run.lower[axis]
            x = x - period * np.rint((x - x[first][which]) / period)
        centres[:, axis] = np.bincount(which, weights=weight * x) / mass
    return bodies, centres, mass


def loaded(run: Run) -> tuple[Frame, Frame]:
    """The contacts to show, and the particle file of that time: of the last time at which anything touched, or of the
    first of the --times."""
    if not run.contact_files:
        raise MissingData("there are no contacts_*.h5 files (see output.contacts)")
    if not run.frames:
        raise MissingData("there are no particles_*.vtkhdf files (see output.particles)")
    pairs = [(run.file_at(run.contact_files, frame.time), frame) for frame in run.frames]
    pairs = [(table, frame) for table, frame in pairs if table is not None and frame.points]
    if not pairs:
        raise MissingData("no contacts_*.h5 file is of the time of a particles_*.vtkhdf file")
    if run.look.times:
        return min(pairs, key=lambda pair: abs(pair[1].time - run.look.times[0]))
    touching = [pair for pair in pairs if pair[0].points and np.any(pair[0].field("force"))]
    if not touching:
        raise MissingData("nothing touches at the time of any contacts_*.h5 file")
    return touching[-1]
