"""What scripts/convert-labels does with labels: pieces, sizes, weights that keep volumes, and the file."""

import h5py
import numpy as np
from scipy import ndimage

from converting.common import InputError, note

SIGMA, REACH = 1.0, 3  # of the mean over voxels; as in cairn/body/label_volume.hpp


def taps():
    at = np.arange(-REACH, REACH + 1)
    values = np.exp(-0.5 * (at / SIGMA) ** 2)
    return values / values.sum()


def whole(voxels, name):
    """As whole numbers from 0 on, and the labels themselves."""
    if voxels.dtype.kind == "f":
        if not (np.isfinite(voxels).all() and (voxels == np.round(voxels)).all()):
            raise InputError(f"{name}: holds values that are no whole numbers; say what is solid by --threshold or --ranges")
        voxels = voxels.astype(np.int64)
    if voxels.dtype.kind == "b":
        voxels = voxels.astype(np.uint8)
    if voxels.min() < 0:
        raise InputError(f"{name}: holds the label {voxels.min()}; labels are 0 (void) and above; use --ranges")
    return voxels


def by_ranges(voxels, ranges):
    """Labels 1, 2, ... of the ranges (low, high), both within; void elsewhere."""
    labels = np.zeros(voxels.shape, np.uint16)
    for number, (low, high) in enumerate(ranges, 1):
        labels[(voxels >= low) & (voxels <= high)] = number
    return labels


def majority(voxels, n):
    """Blocks of n voxels a side become one, of the label most of them have; sides that n does not divide lose a rest."""
    sizes = [s // n for s in voxels.shape]
    if min(sizes) < 1:
        raise InputError(f"--downsample {n}: is more than the {min(voxels.shape)} voxels along a side")
    cut = voxels[tuple(slice(0, s * n) for s in sizes)]
    shape = [v for s in sizes for v in (s, n)]
    d = len(sizes)
    blocks = cut.reshape(shape).transpose(*range(0, 2 * d, 2), *range(1, 2 * d, 2)).reshape(*sizes, n ** d)
    blocks = np.sort(blocks, axis=-1)
    best, most, run = blocks[..., 0].copy(), np.ones(sizes, np.int32), np.ones(sizes, np.int32)
    for k in range(1, n ** d):
        run = np.where(blocks[..., k] == blocks[..., k - 1], run + 1, 1)
        better = run > most
        most[better], best[better] = run[better], blocks[..., k][better]
    return best


def boxes(voxels):
    """(label, slices) of each label but void."""
    found = np.unique(voxels)
    found = found[found != 0]
    if len(found) and int(found[-1]) > 4 * len(found) + 1000:  # far from consecutive
        dense = np.searchsorted(found, voxels) + 1
        dense[voxels == 0] = 0
        return list(zip(found.tolist(), ndimage.find_objects(dense.astype(np.int32))))
    slices = ndimage.find_objects(voxels.astype(np.int64, copy=False))
    return [(int(label), slices[int(label) - 1]) for label in found]


def pieces(voxels, split, smallest):
    """Labels with their stray pieces gone, and what there is to say. With `split` each piece is a label of its own."""
    said, following = [], int(voxels.max()) + 1
    result = voxels.astype(np.uint32)
    for label, box in boxes(voxels):
        inside = voxels[box] == label
        parts, count = ndimage.label(inside)
        sizes = np.bincount(parts.ravel())[1:]
        small = [i + 1 for i, size in enumerate(sizes) if size < smallest]
        view = result[box]
        for i in small:
            view[parts == i] = 0
            where = [int(v.start + p) for v, p in zip(box, np.argwhere(parts == i)[0])]
            said.append(f"label {label}: a piece of {sizes[i - 1]} voxel{'s' if sizes[i - 1] > 1 else ''} at "
                        f"{', '.join(map(str, where[::-1]))} (x, y, z from 0) is dropped: below --smallest {smallest}")
        kept = [i + 1 for i in range(count) if i + 1 not in small]
        if len(kept) > 1 and not split:
            said.append(f"label {label}: is in {len(kept)} pieces that do not touch ({', '.join(str(sizes[i - 1]) for i in kept)} "
                        "voxels); they are one body; --split makes each one")
        if split:
            for i in sorted(kept, key=lambda i: -sizes[i - 1])[1:]:
                view[parts == i] = following
                said.append(f"label {label}: its piece of {sizes[i - 1]} voxels becomes label {following}")
                following += 1
    return result, said


def touching(voxels):
    """Pairs of labels with a face between them."""
    pairs = set()
    for axis in range(voxels.ndim):
        a, b = np.moveaxis(voxels, axis, 0)[:-1], np.moveaxis(voxels, axis, 0)[1:]
        differ = (a != b) & (a != 0) & (b != 0)
        low, high = np.minimum(a[differ], b[differ]), np.maximum(a[differ], b[differ])
        codes = np.unique(low.astype(np.uint64) << np.uint64(32) | high.astype(np.uint64))
        pairs.update((int(c >> np.uint64(32)), int(c & np.uint64(0xFFFFFFFF))) for c in codes)
    return pairs


def grown(box, by, shape):
    return tuple(slice(max(0, s.start - by), min(n, s.stop + by)) for s, n in zip(box, shape))


def inscribed(inside, spacing):
    """Middle (in voxels of the box) and radius of the largest ball within: as far as the nearest voxel that is not of it,
    less half a voxel."""
    distance = ndimage.distance_transform_edt(np.pad(inside, 1), sampling=spacing)[(slice(1, -1),) * inside.ndim]
    at = np.unravel_index(np.argmax(distance), distance.shape)
    return at, max(float(distance[at]) - 0.5 * max(spacing), 0.25 * min(spacing))


class Weights:
    """Weights with which the smooth surfaces enclose as much as the voxels do."""

    def __init__(self, voxels, found):
        self.shape, self.kernel = voxels.shape, taps()
        self.labels = [label for label, _ in found]
        index = {label: i for i, label in enumerate(self.labels)}
        self.regions = [grown(box, REACH + 1, voxels.shape) for _, box in found]
        self.counts, self.shares, self.near = [], [], []
        for label, region in zip(self.labels, self.regions):
            part = voxels[region]
            inside = part == label
            self.counts.append(int(inside.sum()))
            share = inside.astype(np.float32)
            for axis in range(share.ndim):
                share = ndimage.convolve1d(share, self.kernel, axis=axis, mode="nearest")
            self.shares.append(share)
            self.near.append([index[int(v)] for v in np.unique(part) if v not in (0, label)])
        self.weights = np.ones(len(found))
        self.side = side = {2: 8, 3: 4}[voxels.ndim]  # samples along each side of a cell between the middles of voxels
        at = (np.indices((side,) * voxels.ndim).reshape(voxels.ndim, -1) + 0.5) / side
        self.linear = np.stack([np.prod([a if c >> k & 1 else 1 - a for k, a in enumerate(at)], axis=0)
                                for c in range(1 << voxels.ndim)])

    def excess(self, i):
        """By how much the label outweighs all others at the middles of its region's voxels."""
        region = self.regions[i]
        void, most = 1 - self.shares[i], np.zeros_like(self.shares[i])
        for j in self.near[i]:
            there = tuple(slice(max(a.start, b.start), min(a.stop, b.stop)) for a, b in zip(region, self.regions[j]))
            if any(s.stop <= s.start for s in there):
                continue
            mine = tuple(slice(s.start - a.start, s.stop - a.start) for s, a in zip(there, region))
            share = self.shares[j][tuple(slice(s.start - b.start, s.stop - b.start) for s, b in zip(there, self.regions[j]))]
            void[mine] -= share
            np.maximum(most[mine], np.float32(self.weights[j]) * share, out=most[mine])
        return np.float32(self.weights[i]) * self.shares[i] - np.maximum(most, void)

    def volume(self, i):
        """Of the smooth body, in voxels."""
        excess = self.excess(i)
        widths = []
        for axis, (region, n) in enumerate(zip(self.regions[i], self.shape)):  # half a voxel more at the volume's faces
            first, last = region.start == 0, region.stop == n
            excess = np.pad(excess, [(int(first), int(last)) if a == axis else (0, 0) for a in range(excess.ndim)], mode="edge")
            widths.append(np.array([0.5] * first + [1.0] * (excess.shape[axis] - 1 - first - last) + [0.5] * last))
        corners = np.stack([excess[tuple(slice(1, None) if c >> k & 1 else slice(0, -1) for k in range(excess.ndim))]
                            for c in range(1 << excess.ndim)])
        room = widths[0]
        for width in widths[1:]:
            room = np.multiply.outer(room, width)
        inside = (corners >= 0).all(axis=0)
        mixed = ~inside & (corners >= 0).any(axis=0)
        corners = corners[:, mixed]
        # A sample's room is filled as a plane across it fills it, so that flat faces do not move by whole samples.
        slope = sum(np.abs(np.mean([corners[c | 1 << k] - corners[c] for c in range(len(corners)) if not c >> k & 1], axis=0))
                    for k in range(excess.ndim))
        values = (corners.T @ self.linear.astype(np.float32)) * (self.side / np.maximum(slope, 1e-12))[:, None]
        filled = np.clip(0.5 + values, 0, 1).mean(axis=1)
        return float(room[inside].sum() + (room[mixed] * filled).sum()), float(room[mixed].sum())

    def solve(self, within=0.001, rounds=8):
        """A weight e^u moves a surface between two labels by about 0.7 u voxels."""
        error = np.zeros(len(self.labels))
        for _ in range(rounds):
            steps = np.zeros(len(self.labels))
            for i, count in enumerate(self.counts):
                volume, surface = self.volume(i)
                error[i] = volume / count - 1
                steps[i] = (count - volume) / (0.45 * SIGMA * max(surface, 1.0))
            if np.abs(error).max(initial=0) < within:
                break
            self.weights = np.clip(self.weights * np.exp(np.clip(steps, -1, 1)), 0.02, 50)
        for i in np.argsort(-np.abs(error))[:5]:
            if abs(error[i]) > 0.005:
                note(f"label {self.labels[i]} of {self.counts[i]} voxels: its smooth surface encloses {100 * error[i]:+.1f} %")
        return self.weights, error


def facts(voxels, spacing, corner):
    """The table of the labels, columns by name; spacing and corner as x, y, z."""
    found = boxes(voxels)
    if not found:
        raise InputError("no label but void (0) is left")
    weigher = Weights(voxels, found)
    weights, _ = weigher.solve()
    rows = {name: [] for name in ("label", "count", "lower", "upper", "inner_centre", "inner_radius", "weight")}
    for (label, box), count, weight in zip(found, weigher.counts, weights):
        at, radius = inscribed(voxels[box] == label, spacing[::-1])
        rows["label"].append(label)
        rows["count"].append(count)
        rows["lower"].append([s.start for s in box][::-1])
        rows["upper"].append([s.stop for s in box][::-1])
        middle = [s.start + p + 0.5 for s, p in zip(box, at)][::-1]
        rows["inner_centre"].append([c + h * m for c, h, m in zip(corner, spacing, middle)])
        rows["inner_radius"].append(radius)
        rows["weight"].append(float(weight))
    return rows


def write(path, voxels, spacing, corner, rows, source):
    """The file that [[labels]] reads."""
    largest = int(voxels.max())
    kind = next(t for t in (np.uint8, np.uint16, np.uint32) if largest <= np.iinfo(t).max)
    with h5py.File(path, "w") as file:
        file.attrs["kind"] = np.bytes_("labels")
        file.attrs["source"] = np.bytes_(source.encode(errors="replace"))
        for axis, h, c in zip("xyz", spacing, corner):
            file.attrs[f"spacing_{axis}"], file.attrs[f"corner_{axis}"] = float(h), float(c)
        chunk = tuple(min(n, 32 if voxels.ndim == 3 else 256) for n in voxels.shape)
        file.create_dataset("voxels", data=voxels.astype(kind), chunks=chunk, compression="gzip", compression_opts=1,
                            shuffle=True)
        for name, values in rows.items():
            file.create_dataset(name, data=np.array(values, dtype=np.int64 if name in ("label", "count", "lower", "upper")
                                                    else np.float64))
