"""What scripts/convert-labels does with labels: pieces, sizes, and the file. Volumes are gone through by slabs."""

import h5py
import numpy as np
from scipy import ndimage

from converting import smoothing
from converting.common import InputError, note
from converting.scratch import slabs_of

PLANES = 32  # of a slab: those of a chunk of the file


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


def planes_of(volume):
    """How many planes of a volume, or rows of an image, are a slab."""
    return PLANES if len(volume.shape) == 3 else 1024


def gathered(volume, part, change, n, scratch):
    """The labels that `change` makes of the voxels of a part (slices) of a volume, by slabs; n planes of it become one."""
    result, begin = None, part[0].start
    thick = n * max(1, planes_of(volume.voxels) // n)
    for first, last in slabs_of((part[0].stop - begin) // n * n, thick):
        slab = change(volume.voxels[begin + first:begin + last][(slice(None), *part[1:])])
        if result is None:
            result = scratch.new(((part[0].stop - begin) // n, *slab.shape[1:]), np.uint32)
        result[first // n:first // n + len(slab)] = slab
        scratch.drop()
        volume.drop()
    return result


def found_in(voxels, scratch):
    """The labels but void, ascending."""
    found = np.zeros(0, np.uint32)
    for first, last in slabs_of(len(voxels), planes_of(voxels)):
        part = voxels[first:last].reshape(-1)
        low, high = int(part.min()), int(part.max())
        new = np.flatnonzero(np.bincount(part - np.uint32(low))) + low if high - low < 1 << 22 else np.unique(part)
        found = np.union1d(found, new)
        scratch.drop()
    return found[found != 0].astype(np.uint32)


def dense(voxels, scratch):
    """The labels but void, ascending, and the voxels with 0 for void and 1, 2, ... for these."""
    found = found_in(voxels, scratch)
    index = scratch.new(voxels.shape, np.uint16 if len(found) < 1 << 16 else np.uint32)
    table = None
    if len(found) and found[-1] < 1 << 22:
        table = np.zeros(int(found[-1]) + 1, index.dtype)
        table[found] = np.arange(1, len(found) + 1)
    for first, last in slabs_of(len(voxels), planes_of(voxels)):
        part = voxels[first:last]
        if table is not None:
            np.take(table, part, out=index[first:last], mode="clip")
        else:
            index[first:last] = np.where(part == 0, 0, np.searchsorted(found, part) + 1)
        scratch.drop()
    return found, index


def boxes(index, scratch):
    """Slices of each label of `dense`, without void."""
    lower, upper = {}, {}
    for first, last in slabs_of(len(index), planes_of(index)):
        for number, box in enumerate(ndimage.find_objects(index[first:last])):
            if box:
                low, high = [s.start for s in box], [s.stop for s in box]
                low[0], high[0] = low[0] + first, high[0] + first
                lower[number] = list(map(min, lower.get(number, low), low))
                upper[number] = list(map(max, upper.get(number, high), high))
        scratch.drop()
    return [tuple(map(slice, lower[n], upper[n])) for n in range(len(lower))]


def pieces(voxels, split, smallest, scratch):
    """Takes the stray pieces of labels away, and tells what there is to say. With `split` each piece is a label of its own."""
    found, index = dense(voxels, scratch)
    said, following = [], int(found[-1]) + 1 if len(found) else 1
    for number, box in enumerate(boxes(index, scratch), 1):
        label, inside = int(found[number - 1]), index[box] == number
        parts, count = ndimage.label(inside)
        sizes = np.bincount(parts.ravel())[1:]
        small = [i + 1 for i, size in enumerate(sizes) if size < smallest]
        view = voxels[box]
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
        scratch.drop()
    return said


def touching(voxels, scratch):
    """Pairs of labels with a face between them."""
    pairs = set()
    for first, last in slabs_of(len(voxels), planes_of(voxels)):
        slab = voxels[first:last + 1]
        for axis in range(voxels.ndim):
            a, b = np.moveaxis(slab, axis, 0)[:-1], np.moveaxis(slab, axis, 0)[1:]
            at = np.nonzero(a != b)
            a, b = a[at], b[at]
            codes = np.unique(np.minimum(a, b).astype(np.uint64) << np.uint64(32) | np.maximum(a, b).astype(np.uint64))
            pairs.update((int(c >> np.uint64(32)), int(c & np.uint64(0xFFFFFFFF))) for c in codes if c >> np.uint64(32))
        scratch.drop()
    return pairs


def inscribed(inside, spacing):
    """Middle (in voxels of the box) and radius of the largest ball within: as far as the nearest voxel that is not of it,
    less half a voxel."""
    distance = ndimage.distance_transform_edt(np.pad(inside, 1), sampling=spacing)[(slice(1, -1),) * inside.ndim]
    at = np.unravel_index(np.argmax(distance), distance.shape)
    return at, max(float(distance[at]) - 0.5 * max(spacing), 0.25 * min(spacing))


def facts(voxels, spacing, corner, scratch):
    """The table of the labels, columns by name, and the depth of each voxel; spacing and corner as x, y, z."""
    found, index = dense(voxels, scratch)
    if not len(found):
        raise InputError("no label but void (0) is left")
    counts = sum(np.bincount(index[a:b].ravel(), minlength=len(found) + 1) for a, b in slabs_of(len(index), planes_of(index)))
    scratch.drop()
    solid = index.reshape((1,) * (3 - index.ndim) + index.shape)
    depth, faces = smoothing.depths(solid, len(counts), scratch)
    weights, error = smoothing.weights_for(solid, depth, counts, faces, scratch)
    for i in np.argsort(-np.abs(error))[:5]:
        if abs(error[i]) > 0.005:
            note(f"label {found[i]} of {counts[i + 1]} voxels: its smooth surface encloses {100 * error[i]:+.1f} %")
    rows = {name: [] for name in ("label", "count", "lower", "upper", "inner_centre", "inner_radius", "weight")}
    for number, box in enumerate(boxes(index, scratch), 1):
        at, radius = inscribed(index[box] == number, spacing[::-1])
        rows["label"].append(int(found[number - 1]))
        rows["count"].append(int(counts[number]))
        rows["lower"].append([s.start for s in box][::-1])
        rows["upper"].append([s.stop for s in box][::-1])
        middle = [s.start + p + 0.5 for s, p in zip(box, at)][::-1]
        rows["inner_centre"].append([c + h * m for c, h, m in zip(corner, spacing, middle)])
        rows["inner_radius"].append(radius)
        rows["weight"].append(float(weights[number - 1]))
        scratch.drop()
    return rows, depth.reshape(voxels.shape)


def write(path, voxels, depth, spacing, corner, rows, source, scratch):
    """The file that [[labels]] reads."""
    largest = max(rows["label"])
    kind = next(t for t in (np.uint8, np.uint16, np.uint32) if largest <= np.iinfo(t).max)
    with h5py.File(path, "w") as file:
        file.attrs["kind"] = np.bytes_("labels")
        file.attrs["source"] = np.bytes_(source.encode(errors="replace"))
        for axis, h, c in zip("xyz", spacing, corner):
            file.attrs[f"spacing_{axis}"], file.attrs[f"corner_{axis}"] = float(h), float(c)
        chunk = tuple(min(n, 32 if voxels.ndim == 3 else 256) for n in voxels.shape)
        for name, values, code in (("voxels", voxels, kind), ("depth", depth, np.uint8)):
            data = file.create_dataset(name, values.shape, code, chunks=chunk, compression="gzip", compression_opts=1, shuffle=True)
            for first, last in slabs_of(len(values), chunk[0]):
                data[first:last] = values[first:last].astype(code, copy=False)
                scratch.drop()
        for name, values in rows.items():
            file.create_dataset(name, data=np.array(values, dtype=np.int64 if name in ("label", "count", "lower", "upper")
                                                    else np.float64))
