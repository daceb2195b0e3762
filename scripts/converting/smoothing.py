"""Surfaces of labels below a voxel: how deep each voxel lies in its body, and weights that keep the volumes.

A level set is smoothed under the constraint that the middle of each voxel stays in its own label, as Whitaker (2000),
"Reducing aliasing artifacts in iso-surfaces of binary volumes", does for one body; here all labels, and void, share one
field of depths, in which a voxel of another label counts as minus its depth. Volumes are kept meanwhile, so that round
bodies become round instead of shrinking onto their voxels' middles.

Arrays have three axes (an image one plane); `index` is 0 for void, 1 ... n for the labels. Depths are in voxels. All is done by
slabs, or with lists of the faces and cells between labels; what is large lies in a Scratch.
"""

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from converting.scratch import slabs_of

SHALLOW, DEEP = 0.02, 1.5  # of depths; a body is known that far below its surface [voxels]
ROUNDS, STRENGTH = 12, 1.8  # of the smoothing, and the share of the difference to the mean that goes each time
BEHIND = 2  # voxels behind those at a surface that know which it is
PLANES = 4  # of a slab whose sums are made at a time; others give other roundings
THICK = 16  # planes of a slab elsewhere
FEW = 1024  # cells whose samples fit the processor's cache


def over_slabs(planes, work, scratch, thick=PLANES):
    """The results of work(first, last) for slabs of all planes, on all processors."""
    def do(slab):
        result = work(*slab)
        scratch.drop()
        return result

    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        return list(pool.map(do, slabs_of(planes, thick)))


def halves(values, axis):
    """Views of all but the last and all but the first along an axis."""
    front, back = [slice(None)] * 3, [slice(None)] * 3
    front[axis], back[axis] = slice(0, -1), slice(1, None)
    return values[tuple(front)], values[tuple(back)]


def first_depths(index, scratch):
    """What depths_of_slab says, of the whole; a slab knows its surfaces by BEHIND + 1 planes on each side."""
    depth, other = scratch.new(index.shape, np.float32), scratch.new(index.shape, index.dtype)

    def work(first, last):
        low = max(0, first - BEHIND - 1)
        own = slice(first - low, last - low)
        parts = depths_of_slab(index[low:last + BEHIND + 1])
        depth[first:last], other[first:last] = parts[0][own], parts[1][own]

    over_slabs(len(index), work, scratch, THICK)
    return depth, other


def depths_of_slab(index):
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
    sign = np.equal(low, high).astype(np.float32)
    sign *= 2
    sign -= 1
    return sign


def mean_along(values, index, axis):
    """(1, 2, 1) / 4 along an axis, other labels counting with the other sign; planes at the faces are repeated."""
    if values.shape[axis] == 1:
        return values
    sign = signs(*halves(index, axis))
    result = 2 * values
    low, high = halves(result, axis)
    from_low, from_high = halves(values, axis)
    work = sign * from_high
    low += work
    np.multiply(sign, from_low, out=work)
    high += work
    for edge in (0, -1):
        at = tuple(edge if k == axis else slice(None) for k in range(3))
        result[at] += values[at]
    result *= np.float32(0.25)
    return result


def clipped(depth):
    np.maximum(depth, np.float32(SHALLOW), out=depth)
    return np.minimum(depth, np.float32(DEEP), out=depth)


def pushed(depth, index, other, push):
    """What is less than its voxels is deeper, and what is next to it less deep."""
    result = push[index]
    result -= push[other]
    result += depth
    return clipped(result)


def mean_of_planes(before, own, after):
    """(1, 2, 1) / 4 across planes, each given as (depth, index); None beyond the volume's faces, where planes are repeated."""
    if before is None and after is None:
        return own[0]
    result = 2 * own[0]
    for beside in (after, before):
        if beside is not None:
            result += signs(own[1], beside[1]) * beside[0]
    for beside in (after, before):
        if beside is None:
            result += own[0]
    result *= np.float32(0.25)
    return result


def smooth_slab(depth, index, other, push, to, first, last):
    """One round, for the planes from first to before last; by planes, which the processor's cache holds."""
    def plane(z):
        if not 0 <= z < len(depth):
            return None
        part = slice(z, z + 1)
        return pushed(depth[part], index[part], other[part], push), index[part]

    before, own = plane(first - 1), plane(first)
    for z in range(first, last):
        after = plane(z + 1)
        mean = mean_of_planes(before, own, after)
        for axis in (1, 2):
            mean = mean_along(mean, own[1], axis)
        new = to[z:z + 1]
        np.multiply(own[0], np.float32(1 - STRENGTH), out=new)
        mean = np.float32(STRENGTH) * mean
        new += mean
        before, own = own, after


class Faces:
    """Faces of voxels between labels, in slabs of planes and along each axis: labels a and b on their sides, the labels
    that those know behind them, where they are, and how deep."""

    def __init__(self, index, other, labels, scratch):
        self.shape, self.labels, self.scratch = index.shape, labels, scratch
        self.counts = np.zeros(labels)
        self.parts = []
        for part, count in over_slabs(len(index), lambda a, b: self.gather(index, other, a, b), scratch):
            self.parts.append(part)
            self.counts += count
        self.depths = [[[scratch.new(lists[0].shape, np.float32) for _ in "ab"] for lists in part] for part in self.parts]

    def gather(self, index, other, first, last):
        high, lists, count = min(len(index), last + 1), [], np.zeros(self.labels)
        for axis in range(3):
            part = slice(first, high if axis == 0 else last)
            (a, b), (p, q) = halves(index[part], axis), halves(other[part], axis)
            at = np.nonzero(a != b)
            where = np.ravel_multi_index(at, index[part].shape).astype(np.int64 if index[part].size >> 31 else np.int32)
            lists.append([self.scratch.keep(v) for v in (a[at], b[at], p[at], q[at], where)])
            for label in lists[-1][:2]:
                count += np.bincount(label, minlength=self.labels)
        return lists, count

    def take(self, depth):
        """The depths on both sides of each face."""
        strides = (self.shape[1] * self.shape[2], self.shape[2], 1)

        def work(first, last):
            flat = depth[first:last + 1].reshape(-1)
            for lists, values, stride in zip(self.parts[first // PLANES], self.depths[first // PLANES], strides):
                np.take(flat, lists[4], out=values[0], mode="clip")
                np.take(flat, lists[4] + stride, out=values[1], mode="clip")

        over_slabs(self.shape[0], work, self.scratch)

    def surface_slab(self, push, first):
        """Of each label, over the faces of these planes: how far its surface lies beyond them, and how depth changes across."""
        beyond, slope = np.zeros((2, self.labels))
        for (a, b, behind_a, behind_b, _), (p, q) in zip(self.parts[first // PLANES], self.depths[first // PLANES]):
            p = pushed(p, a, behind_a, push).astype(np.float64)
            across = p + pushed(q, b, behind_b, push)
            shift = np.divide(p, across, out=p)
            shift -= 0.5
            for label, sign in ((a, 1), (b, -1)):
                label = label.astype(np.intp)
                beyond += sign * np.bincount(label, shift, self.labels)
                slope += np.bincount(label, across, self.labels)
        return beyond, slope

    def surfaces(self, push):
        """What surface_slab says, of the whole."""
        parts = over_slabs(self.shape[0], lambda first, last: self.surface_slab(push, first), self.scratch)
        return [sum(part[k] for part in parts) for k in range(2)]


def push_for(faces, steps):
    """What is to be added to the depths of each label for its volume to be that of its voxels, by so many Newton steps."""
    push, count = np.zeros(faces.labels, np.float32), np.maximum(faces.counts, 1)
    for _ in range(steps):
        beyond, slope = faces.surfaces(push)
        push -= np.clip(beyond * slope / count**2, -0.3, 0.3).astype(np.float32)
        push[0] = 0
    return push


def depths(index, labels, scratch):
    """As bytes, in 1/255 of DEEP; and the number of faces of each label."""
    depth, other = first_depths(index, scratch)
    faces = Faces(index, other, labels, scratch)
    work = scratch.new(depth.shape, np.float32)
    push = np.zeros(labels, np.float32)
    for left in range(ROUNDS - 1, -1, -1):
        over_slabs(len(index), lambda a, b, d=depth, w=work, p=push: smooth_slab(d, index, other, p, w, a, b), scratch, THICK)
        depth, work = work, depth
        faces.take(depth)
        push = push_for(faces, 2 if left else 5)
    result = scratch.new(depth.shape, np.uint8)

    def to_bytes(first, last):
        result[first:last] = np.round(pushed(depth[first:last], index[first:last], other[first:last], push) * (255 / DEEP))

    over_slabs(len(index), to_bytes, scratch)
    return result, faces.counts


class Cells:
    """Cells between the middles of voxels, of those with more than one label: what each label's share of them is. The
    volume's faces are half a voxel beyond, where cells are half as wide."""

    def __init__(self, index, depth, labels, scratch):
        self.scratch, self.labels, self.axes = scratch, labels, [k for k in range(3) if index.shape[k] > 1]
        self.side = 8 if len(self.axes) < 3 else 4  # samples along a cell
        self.at = ((np.arange(self.side, dtype=np.float32) + np.float32(0.5)) / self.side)[None, :, None, None]
        self.whole = np.zeros(labels)
        self.parts = []
        for whole, part in over_slabs(index.shape[0] + (0 in self.axes), lambda a, b: self.gather(index, depth, a, b), scratch):
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
        at = np.nonzero(mixed)
        label = np.stack([view[at] for view in views])
        value = np.stack([view[at] for view in self.corners(self.padded(depth, first, last))])
        return whole, [[self.scratch.keep(v) for v in lists] for lists in self.sorted(label, value, room[at])]

    @staticmethod
    def sorted(label, value, room):
        """Lists of the cells of two labels, of three, and so on: labels in the order in which they come at the corners, which of
        them each corner has, the depths, and the room."""
        which, owners, count = np.zeros(label.shape, np.uint8), np.zeros_like(label), np.zeros(len(room), np.uint8)
        for c, own in enumerate(label):
            known = np.zeros(len(room), bool)
            for k in range(c):
                same = (owners[k] == own) & (k < count)
                which[c][same] = k
                known |= same
            new = np.flatnonzero(~known)
            owners[count[new], new] = own[new]
            which[c][new] = count[new]
            count[new] += 1
        groups = [(k, np.flatnonzero(count == k)) for k in range(2, len(label) + 1)]
        return [[owners[:k, at], which[:, at], value[:, at], room[at]] for k, at in groups if len(at)]

    def volumes(self, weights):
        """Of the smooth bodies, in voxels."""
        weights = weights.astype(np.float32)

        def work(part, _):
            result = np.zeros(self.labels)
            for owners, which, value, room in self.parts[part]:
                method = self.shares_of_two if len(owners) == 2 else self.shares_of_more
                shares = np.empty(owners.shape, np.float32)
                for first, last in slabs_of(len(room), FEW):
                    at = slice(first, last)
                    method(weights[owners[:, at]], which[:, at], value[:, at], room[at], shares[:, at])
                result += sum(np.bincount(own, share, self.labels) for own, share in zip(owners, shares))
            return result

        return self.whole + sum(over_slabs(len(self.parts), work, self.scratch, 1))

    def samples(self, corners):
        """Values at the samples of cells (samples, cells), linear between those at the corners (corners, cells)."""
        values = corners[:, None]
        for _ in self.axes:
            low, across = values[0::2], values[1::2] - values[0::2]
            values = self.at * across[:, None]
            values += low[:, None]
            values = values.reshape(len(low), -1, corners.shape[1])
        return values[0]

    def shares_of_two(self, weights, which, value, room, shares):
        """A sample's room is filled as a plane across it fills it, so that flat faces do not move by whole samples."""
        signed = np.where(which == 0, weights[0], -weights[1])
        signed *= value
        count = len(signed)
        slope = np.zeros(len(room), np.float32)
        for k in range(len(self.axes)):
            across = sum(signed[c | 1 << k] - signed[c] for c in range(count) if not c >> k & 1)
            slope += np.abs(across, out=across)
        slope *= np.float32(2 / count)
        signed *= np.float32(self.side) / np.maximum(slope, np.float32(1e-6))
        signed += np.float32(0.5)  # which linear interpolation leaves as it is
        filled = self.samples(signed)
        np.maximum(filled, np.float32(0), out=filled)
        np.minimum(filled, np.float32(1), out=filled)
        np.multiply(filled.mean(axis=0), room, out=shares[0])
        np.subtract(room, shares[0], out=shares[1])

    def shares_of_more(self, weights, which, value, room, shares):
        """Cells of three labels and more: samples are counted."""
        value = np.take_along_axis(weights, which.astype(np.intp), axis=0) * value
        best = self.samples(np.where(which == 0, value, np.float32(0)))
        winner = np.zeros(best.shape, np.uint8)
        for k in range(1, len(weights)):
            total = self.samples(np.where(which == k, value, np.float32(0)))
            np.copyto(winner, np.uint8(k), where=total > best)
            np.maximum(best, total, out=best)
        for k, share in enumerate(shares):
            np.multiply(np.equal(winner, k).view(np.uint8).sum(axis=0, dtype=np.uint8), room / np.float32(len(best)), out=share)


def weights_for(index, depth, counts, faces, scratch, within=0.001, rounds=12):
    """Weights with which the smooth surfaces enclose as much as the voxels do, and the relative errors that are left; both
    without void, whose weight is 1."""
    labels = len(counts)
    cells = Cells(index, depth, labels, scratch)
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
