"""Surfaces of labels below a voxel: how deep each voxel lies in its body, and weights that keep the volumes.

A level set is smoothed under the constraint that the middle of each voxel stays in its own label, as Whitaker (2000),
"Reducing aliasing artifacts in iso-surfaces of binary volumes", does for one body; here all labels, and void, share one
field of depths, in which a voxel of another label counts as minus its depth. Volumes are kept meanwhile, so that round
bodies become round instead of shrinking onto their voxels' middles.

Arrays have three axes (an image one plane); `index` is 0 for void, 1 ... n for the labels. Depths are in voxels.
"""

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np

SHALLOW, DEEP = 0.02, 1.5  # of depths; a body is known that far below its surface [voxels]
ROUNDS, STRENGTH = 12, 1.8  # of the smoothing, and the share of the difference to the mean that goes each time
BEHIND = 2  # voxels behind those at a surface that know which it is
PLANES = 4  # of a slab that is worked on at a time


def over_slabs(planes, work):
    """The results of work(first, last) for slabs of all planes, on all processors."""
    slabs = [(z, min(planes, z + PLANES)) for z in range(0, planes, PLANES)]
    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        return list(pool.map(lambda slab: work(*slab), slabs))


def halves(values, axis):
    """Views of all but the last and all but the first along an axis."""
    front, back = [slice(None)] * 3, [slice(None)] * 3
    front[axis], back[axis] = slice(0, -1), slice(1, None)
    return values[tuple(front)], values[tuple(back)]


def first_depths(index):
    """0.5 where a voxel has a face to another label, DEEP elsewhere; and that label, also for the voxels behind, or the
    voxel's own."""
    depth, other = np.full(index.shape, DEEP, np.float32), index.copy()
    for axis in range(3):
        low, high = halves(index, axis)
        differ = low != high
        for half, to, label in zip(halves(depth, axis), halves(other, axis), (high, low)):
            half[differ] = 0.5
            to[differ] = label[differ]
    before = other.copy()
    for _ in range(BEHIND):
        for axis in range(3):
            (a, b), (p, q) = halves(index, axis), halves(before, axis)
            same = a == b
            for to, own, label in zip(halves(other, axis), (a, b), (q, p)):
                take = same & (to == own) & (label != own)
                to[take] = label[take]
        before[:] = other
    return depth, other


def signs(low, high):
    """1 where labels are the same, else -1."""
    return np.where(low == high, np.float32(1), np.float32(-1))


def mean_along(values, index, axis):
    """(1, 2, 1) / 4 along an axis, other labels counting with the other sign; planes at the faces are repeated."""
    if values.shape[axis] == 1:
        return values
    sign = signs(*halves(index, axis))
    result = 2 * values
    low, high = halves(result, axis)
    from_low, from_high = halves(values, axis)
    low += sign * from_high
    high += sign * from_low
    for edge in (0, -1):
        at = tuple(edge if k == axis else slice(None) for k in range(3))
        result[at] += values[at]
    result *= np.float32(0.25)
    return result


def pushed(depth, index, other, push):
    """What is less than its voxels is deeper, and what is next to it less deep."""
    result = push[index]
    result -= push[other]
    result += depth
    return np.clip(result, SHALLOW, DEEP, out=result)


def smooth_slab(depth, index, other, push, to, first, last):
    """One round, for the planes from first to before last."""
    low, high = max(0, first - 1), min(len(depth), last + 1)
    own = slice(first - low, last - low)
    start = pushed(depth[low:high], index[low:high], other[low:high], push)
    # At the volume's own faces planes are repeated; at a slab's they are not reached, as it has one plane more there.
    mean = mean_along(start, index[low:high], 0)[own]
    for axis in (1, 2):
        mean = mean_along(mean, index[first:last], axis)
    new = to[first:last]
    np.multiply(start[own], np.float32(1 - STRENGTH), out=new)
    new += np.float32(STRENGTH) * mean


def surface_slab(depth, index, other, push, first, last):
    """Of each label, over the faces of voxels in these planes: how far its surface lies beyond them, how many they are,
    and how depth changes across them."""
    labels = len(push)
    beyond, faces, slope = np.zeros((3, labels))
    high = min(len(index), last + 1)
    depth = pushed(depth[first:high], index[first:high], other[first:high], push)
    for axis in range(3):
        planes = slice(0, (high if axis == 0 else last) - first)
        (a, b), (p, q) = halves(index[first:high][planes], axis), halves(depth[planes], axis)
        differ = a != b
        a, b, p, q = a[differ], b[differ], p[differ].astype(np.float64), q[differ]
        shift = p / (p + q) - 0.5
        for label, sign in ((a, 1), (b, -1)):
            beyond += sign * np.bincount(label, shift, labels)
            faces += np.bincount(label, minlength=labels)
            slope += np.bincount(label, p + q, labels)
    return beyond, faces, slope


def surfaces(depth, index, other, push):
    """What surface_slab says, of the whole."""
    parts = over_slabs(len(index), lambda first, last: surface_slab(depth, index, other, push, first, last))
    return [sum(part[k] for part in parts) for k in range(3)]


def push_for(depth, index, other, labels, steps):
    """What is to be added to the depths of each label for its volume to be that of its voxels, by so many Newton steps."""
    push = np.zeros(labels, np.float32)
    for _ in range(steps):
        beyond, faces, slope = surfaces(depth, index, other, push)
        faces = np.maximum(faces, 1)
        push -= np.clip(beyond * slope / faces**2, -0.3, 0.3).astype(np.float32)
        push[0] = 0
    return push


def depths(index, labels):
    """As bytes, in 1/255 of DEEP."""
    depth, other = first_depths(index)
    work = np.empty_like(depth)
    push = np.zeros(labels, np.float32)
    for left in range(ROUNDS - 1, -1, -1):
        over_slabs(len(index), lambda a, b, d=depth, w=work, p=push: smooth_slab(d, index, other, p, w, a, b))
        depth, work = work, depth
        push = push_for(depth, index, other, labels, 2 if left else 5)
    del work
    result = np.empty(depth.shape, np.uint8)

    def to_bytes(first, last):
        result[first:last] = np.round(pushed(depth[first:last], index[first:last], other[first:last], push) * (255 / DEEP))

    over_slabs(len(index), to_bytes)
    return result


class Cells:
    """Cells between the middles of voxels, of those with more than one label: what each label's share of them is. The
    volume's faces are half a voxel beyond, where cells are half as wide."""

    def __init__(self, index, depth, labels):
        self.labels, self.axes = labels, [k for k in range(3) if index.shape[k] > 1]
        corners = 1 << len(self.axes)
        side = 8 if len(self.axes) < 3 else 4  # samples along a cell
        at = (np.indices((side,) * len(self.axes)).reshape(len(self.axes), -1) + 0.5) / side
        self.side = side
        self.linear = np.stack([np.prod([a if c >> k & 1 else 1 - a for k, a in enumerate(at)], axis=0)
                                for c in range(corners)]).astype(np.float32)
        self.whole = np.zeros(labels)
        self.parts = []
        for whole, part in over_slabs(index.shape[0] + (0 in self.axes), lambda a, b: self.gather(index, depth, a, b)):
            self.whole += whole
            self.parts.append(part)

    def padded(self, values, first, last):
        """The nodes of the cells first to before last along z; nodes beyond the volume repeat those at its faces."""
        if 0 in self.axes:
            values = values[np.clip(np.arange(first - 1, last), 0, len(values) - 1)]
        return np.pad(values, [(int(k in self.axes and k > 0),) * 2 for k in range(3)], mode="edge")

    def corners(self, values):
        views = []
        for c in range(1 << len(self.axes)):
            at = [slice(None)] * 3
            for bit, axis in enumerate(self.axes):
                at[axis] = slice(1, None) if c >> bit & 1 else slice(0, -1)
            views.append(values[tuple(at)])
        return views

    def gather(self, index, depth, first, last):
        views = self.corners(self.padded(index, first, last))
        mixed = np.zeros(views[0].shape, bool)
        for view in views[1:]:
            mixed |= view != views[0]
        room = np.ones(views[0].shape, np.float32)
        for axis in self.axes:
            cells = index.shape[axis] + 1
            numbers = np.arange(first, last) if axis == 0 else np.arange(cells)
            width = np.where((numbers == 0) | (numbers == cells - 1), np.float32(0.5), np.float32(1))
            room *= width.reshape([-1 if k == axis else 1 for k in range(3)])
        whole = np.bincount(views[0][~mixed], room[~mixed], self.labels)
        label = np.stack([view[mixed] for view in views])
        value = np.stack([view[mixed] for view in self.corners(self.padded(depth, first, last))])
        return whole, (label, value, room[mixed])

    def volumes(self, weights):
        """Of the smooth bodies, in voxels."""
        weights = weights.astype(np.float32)
        with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
            return self.whole + sum(pool.map(lambda part: self.of_part(weights, *part), self.parts))

    def of_part(self, weights, label, value, room):
        value = weights[label] * value
        one = label[0]
        other = np.where(label == one, 0, label).max(axis=0)
        two = ((label == one) | (label == other)).all(axis=0)
        return self.of_two(one[two], other[two], label[:, two], value[:, two], room[two]) + \
            self.of_more(label[:, ~two], value[:, ~two], room[~two])

    def of_two(self, one, other, label, value, room):
        """A sample's room is filled as a plane across it fills it, so that flat faces do not move by whole samples."""
        signed = np.where(label == one, value, -value)
        count = len(signed)
        slope = sum(np.abs(np.mean([signed[c | 1 << k] - signed[c] for c in range(count) if not c >> k & 1], axis=0))
                    for k in range(len(self.axes)))
        filled = signed.T @ self.linear
        filled *= (self.side / np.maximum(slope, 1e-6))[:, None]
        filled += 0.5
        share = np.clip(filled, 0, 1, out=filled).mean(axis=1) * room
        return np.bincount(one, share, self.labels) + np.bincount(other, room - share, self.labels)

    def of_more(self, label, value, room):
        """Cells of three labels and more: samples are counted."""
        result = np.zeros(self.labels)
        if not len(room):
            return result
        best, winner = np.full((len(room), self.linear.shape[1]), -1, np.float32), np.zeros(1, label.dtype)
        winner = np.broadcast_to(winner, best.shape).copy()
        for own in label:
            total = np.where(label == own, value, 0).T @ self.linear
            better = total > best
            np.copyto(best, total, where=better)
            np.copyto(winner, np.broadcast_to(own[:, None], best.shape), where=better)
        part = np.broadcast_to(room[:, None] / best.shape[1], best.shape)
        return np.bincount(winner.ravel(), part.ravel(), self.labels)


def weights_for(index, depth, counts, within=0.001, rounds=12):
    """Weights with which the smooth surfaces enclose as much as the voxels do, and the relative errors that are left; both
    without void, whose weight is 1."""
    labels = len(counts)
    cells = Cells(index, depth, labels)
    _, faces, _ = surfaces(depth, index, index, np.zeros(labels, np.float32))
    area = np.maximum(faces / len(cells.axes), 1)
    weights, error = np.ones(labels), np.zeros(labels)
    for _ in range(rounds):
        volumes = cells.volumes(weights)
        error = volumes / counts - 1
        if np.abs(error[1:]).max(initial=0) < within:
            break
        step = (counts - volumes) / (0.25 * area)
        step[0] = 0
        weights *= np.exp(np.clip(step, -0.7, 0.7))
        weights = np.clip(weights, 0.02, 50)
    return weights[1:], error[1:]
