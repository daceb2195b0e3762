"""Pair correlation g(r) of the centres. Formula: docs/measures.md."""

from __future__ import annotations

import itertools
import math

import numpy as np


def close_pairs(place: np.ndarray, reach: float, period: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """All pairs i, j in both orders with a distance below `reach` [m], and the distance; period 0: none. Bins of the
    size of `reach` are looked through, each with its neighbours. A period must be at least twice the reach."""
    count, d = place.shape
    lower = place.min(axis=0)
    length = np.where(period > 0, period, np.maximum(np.ptp(place, axis=0), reach))
    bins = np.maximum(np.floor(length / reach).astype(int), 1)
    local = np.floor((place - lower) / length * bins).astype(int)
    local = np.where(period > 0, local % bins, np.minimum(local, bins - 1))
    flat = np.ravel_multi_index(tuple(local.T), tuple(bins))
    order = np.argsort(flat, kind="stable")
    start = np.searchsorted(flat[order], np.arange(int(np.prod(bins)) + 1))
    # With few bins along a period the same neighbour must not be met twice.
    steps = [sorted({o % n if p > 0 else o for o in (-1, 0, 1)}) for n, p in zip(bins, period)]
    found = []
    for offset in itertools.product(*steps):
        cell = local + np.array(offset)
        inside = np.where(period > 0, True, (cell >= 0) & (cell < bins)).all(axis=1)
        cell = np.ravel_multi_index(tuple(np.where(period > 0, cell % bins, np.clip(cell, 0, bins - 1)).T), tuple(bins))
        number = np.where(inside, start[cell + 1] - start[cell], 0)
        i = np.repeat(np.arange(count), number)
        j = order[np.arange(len(i)) - np.repeat(np.cumsum(number) - number, number) + np.repeat(start[cell], number)]
        way = place[j] - place[i]
        way -= np.where(period > 0, np.rint(way / length) * length, 0.0)
        distance = np.linalg.norm(way, axis=1)
        near = (distance < reach) & (i != j)
        found.append((i[near], j[near], distance[near]))
    return tuple(np.concatenate(part) for part in zip(*found))


def pair_correlation(place: np.ndarray, box: tuple[np.ndarray, np.ndarray], periodic: np.ndarray, reach: float,
                     bins: int) -> tuple[np.ndarray, np.ndarray]:
    """Middles of the bins [m] and g: pairs in a shell over those that a gas of the same density has there. Shells are
    counted around the grains that are farther than `reach` from every border that is not periodic, where they are
    whole; NaN where there are none."""
    size, d = box[1] - box[0], place.shape[1]
    if (periodic & (size < 2 * reach)).any():
        raise ValueError(f"a period is shorter than twice the reach of g(r), {2 * reach:g} m")
    inside = ((place >= box[0]) & (place <= box[1]) | periodic).all(axis=1)
    place = place[inside]
    centres = ((place > box[0] + reach) & (place < box[1] - reach) | periodic).all(axis=1)
    i, _, distance = close_pairs(place, reach, np.where(periodic, size, 0.0))
    counts, edges = np.histogram(distance[centres[i]], bins, (0.0, reach))
    shell = np.diff(edges**d) * {2: math.pi, 3: 4 * math.pi / 3}[d]
    expected = centres.sum() * len(place) / np.prod(size) * shell
    return (edges[1:] + edges[:-1]) / 2, counts / expected if centres.any() else np.full(bins, np.nan)
