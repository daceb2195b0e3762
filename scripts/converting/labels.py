"""What scripts/convert-labels does with labels: pieces, sizes, and the file."""

import h5py
import numpy as np
from scipy import ndimage

from converting import smoothing
from converting.common import InputError, note

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


def inscribed(inside, spacing):
    """Middle (in voxels of the box) and radius of the largest ball within: as far as the nearest voxel that is not of it,
    less half a voxel."""
    distance = ndimage.distance_transform_edt(np.pad(inside, 1), sampling=spacing)[(slice(1, -1),) * inside.ndim]
    at = np.unravel_index(np.argmax(distance), distance.shape)
    return at, max(float(distance[at]) - 0.5 * max(spacing), 0.25 * min(spacing))


def dense(voxels):
    """The labels but void, ascending, and the voxels with 0 for void and 1, 2, ... for these; three axes."""
    found = np.flatnonzero(np.bincount(voxels.ravel())) if voxels.dtype.itemsize < 4 else np.unique(voxels)
    found = found[found != 0]
    kind = np.uint16 if len(found) < 1 << 16 else np.uint32
    index = np.empty(voxels.shape, kind)
    for z, page in enumerate(voxels):
        index[z] = np.searchsorted(found, page) + 1
        index[z][page == 0] = 0
    return found, index.reshape((1,) * (3 - index.ndim) + index.shape)


def facts(voxels, spacing, corner):
    """The table of the labels, columns by name, and the depth of each voxel; spacing and corner as x, y, z."""
    found, index = dense(voxels)
    if not len(found):
        raise InputError("no label but void (0) is left")
    counts = np.bincount(index.ravel())
    depth = smoothing.depths(index, len(counts))
    weights, error = smoothing.weights_for(index, depth, counts)
    for i in np.argsort(-np.abs(error))[:5]:
        if abs(error[i]) > 0.005:
            note(f"label {found[i]} of {counts[i + 1]} voxels: its smooth surface encloses {100 * error[i]:+.1f} %")
    rows = {name: [] for name in ("label", "count", "lower", "upper", "inner_centre", "inner_radius", "weight")}
    index = index.reshape(voxels.shape)
    for number, box in enumerate(ndimage.find_objects(index.astype(np.int32, copy=False)), 1):
        at, radius = inscribed(index[box] == number, spacing[::-1])
        rows["label"].append(int(found[number - 1]))
        rows["count"].append(int(counts[number]))
        rows["lower"].append([s.start for s in box][::-1])
        rows["upper"].append([s.stop for s in box][::-1])
        middle = [s.start + p + 0.5 for s, p in zip(box, at)][::-1]
        rows["inner_centre"].append([c + h * m for c, h, m in zip(corner, spacing, middle)])
        rows["inner_radius"].append(radius)
        rows["weight"].append(float(weights[number - 1]))
    return rows, depth.reshape(voxels.shape)


def write(path, voxels, depth, spacing, corner, rows, source):
    """The file that [[labels]] reads."""
    largest = int(voxels.max())
    kind = next(t for t in (np.uint8, np.uint16, np.uint32) if largest <= np.iinfo(t).max)
    with h5py.File(path, "w") as file:
        file.attrs["kind"] = np.bytes_("labels")
        file.attrs["source"] = np.bytes_(source.encode(errors="replace"))
        for axis, h, c in zip("xyz", spacing, corner):
            file.attrs[f"spacing_{axis}"], file.attrs[f"corner_{axis}"] = float(h), float(c)
        chunk = tuple(min(n, 32 if voxels.ndim == 3 else 256) for n in voxels.shape)
        for name, values in (("voxels", voxels.astype(kind, copy=False)), ("depth", depth)):
            file.create_dataset(name, data=values, chunks=chunk, compression="gzip", compression_opts=1, shuffle=True)
        for name, values in rows.items():
            file.create_dataset(name, data=np.array(values, dtype=np.int64 if name in ("label", "count", "lower", "upper")
                                                    else np.float64))
