"""Arrays that lie in a file without a name while they are worked on by slabs: large volumes need no memory for all of it.

What is not in use is given back by `drop`: it stays in the file (and in the system's cache, as far as that has room).
"""

import mmap
import os
import shutil
import tempfile
import threading

import numpy as np

from converting.common import InputError

SMALL = 1 << 23  # voxels up to which all of it is in memory
BYTES = 64  # of the file, for each voxel; what does not fit in is in memory


class Scratch:
    """Room for arrays of a volume of so many voxels, in this folder."""

    def __init__(self, voxels, folder=""):
        self.map, self.used, self.lock = None, 0, threading.Lock()
        folder, size = folder or ".", voxels * BYTES
        try:
            if voxels > SMALL and shutil.disk_usage(folder).free > size:
                with tempfile.TemporaryFile(dir=folder) as file:
                    os.ftruncate(file.fileno(), size)
                    self.map = mmap.mmap(file.fileno(), size)
        except OSError as error:
            raise InputError(f"{folder}: no file for the volume while it is worked on: {error.strerror}") from None

    def new(self, shape, dtype):
        """An array whose values are not set."""
        count, dtype = int(np.prod(shape, dtype=np.int64)), np.dtype(dtype)
        size = -(-count * dtype.itemsize // mmap.PAGESIZE) * mmap.PAGESIZE
        with self.lock:
            at = self.used
            if self.map is None or not size or at + size > len(self.map):
                return np.empty(shape, dtype)
            self.used += size
        return np.frombuffer(self.map, dtype, count, at).reshape(shape)

    def keep(self, values):
        """A copy."""
        array = self.new(values.shape, values.dtype)
        array[...] = values
        return array

    def drop(self):
        """Memory of all arrays is given back; their values stay."""
        if self.map is not None:
            self.map.madvise(mmap.MADV_DONTNEED)


def slabs_of(planes, thick):
    """(first, behind the last) of slabs."""
    return [(z, min(planes, z + thick)) for z in range(0, planes, thick)]
