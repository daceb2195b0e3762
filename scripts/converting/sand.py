"""Volumes of labels that look like scans of sand: grains of uneven shape, of which many touch.

A place belongs to the nearest of seeds that lie one in each box of a lattice, anywhere in its middle half, where it is not farther
from it than a radius that varies smoothly from place to place. It is not what a scan shows, but it has what makes scans
difficult: faces between grains of any direction, necks, hollows, slivers.
"""

import numpy as np
from scipy import ndimage


def volume(voxels, grains, seed=1):
    """An array of voxels^3 labels, uint16; `grains` is a cube number."""
    random = np.random.default_rng(seed)
    side = round(grains ** (1 / 3))
    width = voxels / side
    boxes = np.stack(np.meshgrid(*(np.arange(side),) * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    at = np.floor((boxes + 0.5 + random.uniform(-0.25, 0.25, boxes.shape)) * width).astype(int)
    free = np.ones((voxels,) * 3, bool)
    free[tuple(at.T)] = False
    number = np.zeros(free.shape, np.uint16)
    number[tuple(at.T)] = 1 + np.arange(len(at))
    distance, nearest = ndimage.distance_transform_edt(free, return_indices=True)
    result = number[tuple(nearest)]
    noise = ndimage.gaussian_filter(random.standard_normal(free.shape, dtype=np.float32), width / 8, mode="wrap")
    result[distance > width * (0.54 + 0.06 * noise / noise.std())] = 0
    return result
