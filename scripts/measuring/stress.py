"""Stresses: of grains and of the cell, from contact forces, from volumes, and from motion. Formulas: docs/measures.md.

Tension is positive. The pressure p, the shear stress tau and mu = tau / p are of the in-plane stress in two dimensions.
"""

from __future__ import annotations

import math

import numpy as np

from measuring.snapshot import Contacts, Grains, Snapshot
from results import MissingData


def added(rows: np.ndarray, values: np.ndarray, count: int) -> np.ndarray:
    """Sums of tensors by row; values: N x d x d."""
    shape = values.shape[1:]
    flat = values.reshape(len(values), math.prod(shape))
    return np.stack([np.bincount(rows, column, count) for column in flat.T], axis=1).reshape(count, *shape)


def grain_moments(snapshot: Snapshot) -> np.ndarray:
    """Love and Weber, for each grain: sum over its contacts of f_i (x_j - centre_j) [J], N x d x d."""
    grains, contacts = snapshot.grains, snapshot.contacts
    arm = snapshot.shortest(contacts.point - grains.centre[contacts.a])
    total = added(contacts.a, contacts.moment + contacts.force[:, :, None] * arm[:, None, :], len(grains))
    pair = contacts.b >= 0
    second = contacts.chosen(pair)
    arm = snapshot.shortest(second.point - grains.centre[second.b])
    return total - added(second.b, second.moment + second.force[:, :, None] * arm[:, None, :], len(grains))


def contact_moment(snapshot: Snapshot) -> np.ndarray:
    """Of the cell: sum over contacts of f_i l_j [J], with the branch l from centre to centre, or from the centre to the
    contact with a tool or wall."""
    grains, contacts = snapshot.grains, snapshot.contacts
    inner = contacts.moment[contacts.b < 0].sum(axis=0)  # that of a pair cancels
    return np.einsum("ci,cj->ij", contacts.force, branches(snapshot, grains, contacts)) + inner


def branches(snapshot: Snapshot, grains: Grains, contacts: Contacts) -> np.ndarray:
    """The branch vector of each contact, from the centre of a [m]."""
    pair = contacts.b >= 0
    end = np.where(pair[:, None], grains.centre[np.where(pair, contacts.b, 0)], contacts.point)
    return snapshot.shortest(end - grains.centre[contacts.a])


def boundary_moment(snapshot: Snapshot) -> np.ndarray:
    """The same from outside: sum over contacts with tools and walls of f_i (x_j - X_j) [J], with X the grains' centre
    of mass, about which gravity has none. Walls that are no rows of the contact file come from forces.csv, in the mean
    over the contacts' time, as if each acted in its middle: exact for forces along a wall's normal and for friction on
    its way across the other walls, while friction's own place along the wall is not known."""
    grains, contacts = snapshot.grains, snapshot.contacts
    outer = contacts.chosen(contacts.b < 0)
    middle = np.average(grains.centre, axis=0, weights=grains.mass)
    total = np.einsum("ci,cj->ij", outer.force, outer.point - middle) + outer.moment.sum(axis=0)
    if not snapshot.unseen_faces:
        return total
    tools, (start, end) = snapshot.run.forces(), snapshot.contact_interval
    if not end > start:
        raise MissingData("no forces were averaged before the first step")
    for face in snapshot.unseen_faces:
        if face not in tools:
            raise MissingData(f"forces.csv has no rows of the face {face}")
        table = tools[face]

        def vector(time: float, columns: tuple[str, ...]) -> np.ndarray:
            return np.array([np.interp(time, table["time"], table[name]) for name in columns[: snapshot.dimension]])

        impulses = [vector(time, ("impulse_x", "impulse_y", "impulse_z")) for time in (start, end)]
        force = (impulses[0] - impulses[1]) / (end - start)  # on the grains
        total += np.outer(force, vector(end, ("x", "y", "z")) - middle)
    return total


def cell_contact_stress(snapshot: Snapshot, volume: float) -> np.ndarray:
    """Love-Weber stress of the cell [Pa]: by branches where all contacts are rows, from outside otherwise."""
    if snapshot.faces("symmetry"):
        raise MissingData("what faces of symmetry bear is in no file")
    moment = boundary_moment if snapshot.unseen_faces else contact_moment
    return moment(snapshot) / volume


def unbalance(snapshot: Snapshot) -> np.ndarray:
    """Of each grain |sum f + m g| / (m g + sum |f|); 0 where nothing acts, NaN where gravity varies. Contacts with walls must be rows."""
    grains, contacts = snapshot.grains, snapshot.contacts
    if snapshot.run.gravity_varies:
        return np.full(len(grains), np.nan)
    total = grains.mass[:, None] * snapshot.run.gravity
    size = np.linalg.norm(total, axis=1)
    for rows, sign, chosen in ((contacts.a, 1, contacts), (contacts.b, -1, contacts.chosen(contacts.b >= 0))):
        rows = rows[rows >= 0]
        total += sign * added(rows, chosen.force, len(grains))
        size += np.bincount(rows, np.linalg.norm(chosen.force, axis=1), len(grains))
    return np.linalg.norm(total, axis=1) / np.where(size > 0, size, 1.0)


def motion_within(snapshot: Snapshot) -> tuple[np.ndarray, np.ndarray]:
    """Of each grain sum_p m v_i r_j and sum_p m v'_i v'_j [J s, J], v', r from the centre: by the first's change and the
    second the mean stress differs from the contacts' (docs/measures.md)."""
    frame, grains, d = snapshot.points, snapshot.grains, snapshot.dimension
    row = np.full(int(max(frame.field("body").max(initial=0), grains.body.max())) + 1, -1)
    row[grains.body] = np.arange(len(grains))
    row = row[frame.field("body")]
    keep = row >= 0
    row, mass = row[keep], frame.field("mass")[keep][:, None, None]
    v = frame.field("velocity")[keep][:, :d] - grains.velocity[row]
    r = snapshot.shortest(frame.field("position")[keep][:, :d] - grains.centre[row])
    return (added(row, mass * v[:, :, None] * r[:, None, :], len(grains)),
            added(row, mass * v[:, :, None] * v[:, None, :], len(grains)))


def cell_volume_stress(grains: Grains, volume: float) -> np.ndarray:
    """sum V_g sigma_g / V [Pa]."""
    return np.einsum("g,gij->ij", grains.volume, grains.stress) / volume


def kinetic_stress(grains: Grains, fluctuation: np.ndarray, volume: float) -> np.ndarray:
    """-sum m v' v' / V [Pa]."""
    return -np.einsum("g,gi,gj->ij", grains.mass, fluctuation, fluctuation) / volume


def invariants(stress: np.ndarray) -> tuple[float, float, float]:
    """p = -tr(sigma) / d, tau = sqrt(s:s / 2), mu = tau / p."""
    d = len(stress)
    pressure = -np.trace(stress) / d
    deviator = stress + pressure * np.eye(d)
    shear = math.sqrt(((deviator + deviator.T) ** 2).sum() / 8)
    return float(pressure), shear, shear / pressure if pressure else math.nan
