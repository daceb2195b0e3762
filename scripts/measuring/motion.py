"""Motion and deformation of grains: mean flow, granular temperature, inertial number, strain, rotation, shape."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from measuring.snapshot import Grains, Snapshot
from results import MissingData, Run, displacement, unwrapped


@dataclasses.dataclass
class Flow:
    """The affine velocity that fits the grains best, by mass: v = mean + gradient (x - middle)."""

    mean: np.ndarray  # [m/s]
    gradient: np.ndarray  # dv_i/dx_j [1/s]; zero where grains do not span the space
    fluctuation: np.ndarray  # of each grain [m/s]


def affine(place: np.ndarray, value: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean and gradient of an affine fit by least squares, and what it leaves of each row. Where the places do not span
    the space, what they do not tell is zero."""
    share = weight / weight.sum()
    mean = share @ value
    arm = place - share @ place
    root = np.sqrt(share)[:, None]
    gradient = np.linalg.lstsq(root * arm, root * (value - mean), rcond=1e-10)[0].T
    return mean, gradient, value - mean - arm @ gradient.T


def flow(grains: Grains) -> Flow:
    return Flow(*affine(grains.centre, grains.velocity, grains.mass))


def shear_rate(gradient: np.ndarray) -> float:
    """sqrt(2 D':D') with D' the deviator of the rate of strain [1/s]; the rate of simple shear."""
    rate = (gradient + gradient.T) / 2
    rate = rate - np.trace(rate) / len(rate) * np.eye(len(rate))
    return math.sqrt(2 * (rate**2).sum())


def temperature(grains: Grains, fluctuation: np.ndarray) -> float:
    """sum m |v'|^2 / (d sum m) [m2/s2]."""
    return float((grains.mass @ (fluctuation**2).sum(axis=1)) / (fluctuation.shape[1] * grains.mass.sum()))


def inertial_number(rate: float, pressure: float, grains: Grains) -> float:
    """I = rate d sqrt(rho / p), with the mean diameter and the density of the grains; NaN without pressure."""
    if not pressure > 0:
        return math.nan
    density = grains.mass.sum() / grains.volume.sum()
    return rate * float(grains.diameter.mean()) * math.sqrt(density / pressure)


def packing_fraction(snapshot: Snapshot, box: tuple[np.ndarray, np.ndarray]) -> float:
    """sum V_g / V. Grains whose centre lies outside the box are left out."""
    place = snapshot.wrapped(snapshot.grains.centre)
    inside = ((place >= box[0]) & (place <= box[1])).all(axis=1)
    return float(snapshot.grains.volume[inside].sum() / np.prod(box[1] - box[0]))


@dataclasses.dataclass
class Strain:
    """Deformation of the packing between two outputs, from the displacements of the grains' centres."""

    gradient: np.ndarray  # F of the affine fit
    hencky: np.ndarray  # ln(F F^T) / 2
    non_affine: float  # D^2_min: mean square of what the fit leaves [m2]


def strain(first: Grains, now: Grains) -> Strain:
    """Of the grains that are there in both. Raises MissingData where there are none."""
    body, i, j = np.intersect1d(first.body, now.body, assume_unique=True, return_indices=True)
    if not len(body):
        raise MissingData("no grain of the first output is left")
    _, gradient, rest = affine(first.centre[i], now.centre[j] - first.centre[i], first.mass[i])
    F = np.eye(len(gradient)) + gradient
    values, vectors = np.linalg.eigh(F @ F.T)
    hencky = vectors @ np.diag(np.log(np.maximum(values, 1e-300)) / 2) @ vectors.T
    share = first.mass[i] / first.mass[i].sum()
    return Strain(F, hencky, float(share @ (rest**2).sum(axis=1)))


def aspect(second_moment: np.ndarray) -> np.ndarray:
    """Shortest over longest axis of the ellipse, or ellipsoid, with these second moments."""
    values = np.linalg.eigvalsh(second_moment)
    return np.sqrt(np.maximum(values[:, 0], 0) / values[:, -1])


def circularity(volume: np.ndarray, second_moment: np.ndarray) -> np.ndarray:
    """1 for a disk or sphere and less for all else: in 2D A / (2 pi mu), in 3D the like, mu the trace of the second
    moment over the mass."""
    trace = np.trace(second_moment, axis1=1, axis2=2)
    if second_moment.shape[1] == 2:
        return volume / (2 * math.pi * trace)
    return 3 ** (5 / 3) / (5 * (4 * math.pi) ** (2 / 3)) * volume ** (2 / 3) / trace


def rotations(run: Run, snapshot: Snapshot) -> np.ndarray:
    """By how much each grain has turned since the first output of points, as a rotation vector [rad], N x 3: the
    rotation R that fits best, of sum m r R^T r_0 (Kabsch), whatever the grain's deformation."""
    now = snapshot.points
    moved, _ = displacement(run, now)
    body = now.field("body")
    d, grains = run.dimension, snapshot.grains
    row = np.full(int(max(body.max(initial=0), grains.body.max())) + 1, -1)
    row[grains.body] = np.arange(len(grains))
    keep = row[body] >= 0
    row, mass = row[body][keep], now.field("mass")[keep]
    place = unwrapped(run, now)
    there = [centred(x[keep], mass, row, len(grains)) for x in (place, place - moved)]
    moment = np.stack([np.bincount(row, mass * there[0][:, i] * there[1][:, j], len(grains))
                       for i in range(d) for j in range(d)], axis=1).reshape(-1, d, d)
    turned = np.zeros((len(grains), 3))
    if d == 2:
        turned[:, 2] = np.arctan2(moment[:, 1, 0] - moment[:, 0, 1], moment[:, 0, 0] + moment[:, 1, 1])
        return turned
    u, _, vt = np.linalg.svd(moment)
    u[:, :, 2] *= np.linalg.det(u @ vt)[:, None]
    return rotation_vectors(u @ vt)


def rotation_vectors(rotation: np.ndarray) -> np.ndarray:
    """Axis times angle of rotation matrices, by the angle's sine and cosine; of half a turn from the symmetric part."""
    skew = np.stack([rotation[:, 2, 1] - rotation[:, 1, 2], rotation[:, 0, 2] - rotation[:, 2, 0],
                     rotation[:, 1, 0] - rotation[:, 0, 1]], axis=1) / 2
    sine, cosine = np.linalg.norm(skew, axis=1), (np.trace(rotation, axis1=1, axis2=2) - 1) / 2
    angle = np.arctan2(sine, cosine)
    vectors = skew * (angle / np.where(sine > 1e-12, sine, 1.0))[:, None]
    for k in np.flatnonzero((sine <= 1e-12) & (cosine < 0)):
        values, axes = np.linalg.eigh((rotation[k] + rotation[k].T) / 2)
        vectors[k] = angle[k] * axes[:, values.argmax()]
    return vectors


def centred(position: np.ndarray, mass: np.ndarray, row: np.ndarray, count: int) -> np.ndarray:
    """Positions from each body's centre of mass."""
    total = np.bincount(row, mass, count)
    total = np.where(total > 0, total, 1.0)
    middle = np.stack([np.bincount(row, mass * x, count) / total for x in position.T], axis=1)
    return position - middle[row]
