"""Nodes of a regular lattice around material points, each body with its own: sums over points, and means back at them.

Linear (tent) weights. Only nodes beside points exist, so that memory goes with the points, whatever the domain.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

SPACING_TO_CELL = 2.0  # side of a lattice cell, in spacings of points


@dataclass
class Cells:
    """Cells of bodies."""

    owner: np.ndarray  # index of the body among the lattice's
    place: np.ndarray  # (C x D) number of the cell along each axis
    centre: np.ndarray  # (C x D) [m]
    inside: np.ndarray  # how many of its corners are inside

    def __getitem__(self, chosen) -> Cells:
        return Cells(self.owner[chosen], self.place[chosen], self.centre[chosen], self.inside[chosen])


class Lattice:
    """`position` (N x D) [m], `body` (N); `size`: about the side of a cell [m]; periodic directions close upon themselves."""

    def __init__(self, position: np.ndarray, body: np.ndarray, size: float, lower, upper, periodic):
        dimension = position.shape[1]
        extent = np.asarray(upper, float) - lower
        count = np.maximum(np.rint(extent / size), 1).astype(np.int64)
        self.size = np.where(periodic, extent / count, size)
        place = (position - lower) / self.size
        cell = np.floor(place).astype(np.int64)
        within = place - cell  # 0 to 1 in the cell
        cell = np.where(periodic, cell % count, cell)
        least, most = ([function(column, initial=0) for column in cell.T] for function in (np.min, np.max))
        low = np.where(periodic, 0, np.array(least) - 1)  # a cell more on each side, for those around nodes
        wide = np.where(periodic, count, np.array(most) - low + 3)
        cell -= low
        self._wide, self._origin = wide, lower + low * self.size
        self.bodies, self.owner = np.unique(body, return_inverse=True)
        stride = np.concatenate(([1], np.cumprod(wide)))
        cells, of_point = np.unique(self.owner * stride[-1] + cell @ stride[:-1], return_inverse=True)
        self._stride = stride
        owner, rest = np.divmod(cells, stride[-1])
        place = (rest[:, None] // stride[:-1]) % wide
        corners = np.stack(np.meshgrid(*[(0, 1)] * dimension, indexing="ij"), -1).reshape(-1, dimension)
        keys = np.stack([((place + corner) % wide) @ stride[:-1] for corner in corners], 1)
        nodes, at = np.unique(owner[:, None] * stride[-1] + keys, return_inverse=True)
        self._full = nodes
        self._keys = nodes % stride[-1]
        self.node_owner = nodes // stride[-1]
        self.nodes = len(nodes)
        self._corners, self._within = corners, within
        self.node_of_points = at.reshape(keys.shape).astype(np.int32)[of_point]  # of each point and corner
        shares = np.stack([1 - within, within])
        self._weight = [np.multiply.reduce([shares[corner[d], :, d] for d in range(dimension)]) for corner in corners]

    def to_nodes(self, values: np.ndarray, chosen=slice(None)) -> np.ndarray:
        """sum_p N_ip value_p, for values (N) or (N x K); `chosen`: of these points only."""
        columns = values.reshape(len(values), -1).T
        sums = np.zeros((len(columns), self.nodes))
        for k, weight in enumerate(self._weight):
            node, weight = self.node_of_points[chosen, k], weight[chosen]
            for row, column in zip(sums, columns):
                row += np.bincount(node, weights=weight * column, minlength=self.nodes)
        return sums.T.reshape(self.nodes, *values.shape[1:])

    def to_points(self, nodal: np.ndarray, chosen=slice(None)) -> np.ndarray:
        """sum_i N_ip value_i."""
        found = 0
        for k, weight in enumerate(self._weight):
            value, weight = nodal[self.node_of_points[chosen, k]], weight[chosen]
            found = found + (weight[:, None] if value.ndim > 1 else weight) * value
        return found

    def away(self, volume: np.ndarray) -> np.ndarray:
        """sum_p N_ip V_p (x_i - x_p) / h (nodes x D), away from the matter around a node."""
        sums = np.zeros((self._within.shape[1], self.nodes))
        for k, (corner, weight) in enumerate(zip(self._corners, self._weight)):
            weight = weight * volume
            for d, row in enumerate(sums):
                row += np.bincount(self.node_of_points[:, k], weights=weight * (corner[d] - self._within[:, d]), minlength=self.nodes)
        return sums.T

    def cells_around(self, inside: np.ndarray) -> Cells:
        """All cells with a corner that is one of the nodes `inside` (bool)."""
        place = self._keys[inside, None] // self._stride[:-1] % self._wide
        base = self.node_owner[inside] * self._stride[-1]
        keys = np.concatenate([base + (place - corner) % self._wide @ self._stride[:-1] for corner in self._corners])
        keys, count = np.unique(keys, return_counts=True)
        owner, rest = np.divmod(keys, self._stride[-1])
        place = rest[:, None] // self._stride[:-1] % self._wide
        return Cells(owner, place, self._origin + (place + 0.5) * self.size, count)

    def corners_of(self, cells: Cells) -> np.ndarray:
        """The nodes (C x 2^D) at the corners of cells, x slowest; `nodes`, one too many, where there is none."""
        keys = np.stack([(cells.place + corner) % self._wide @ self._stride[:-1] for corner in self._corners], 1)
        keys += cells.owner[:, None] * self._stride[-1]
        at = np.minimum(np.searchsorted(self._full, keys), self.nodes - 1)
        return np.where(self._full[at] == keys, at, self.nodes)

    def neighbours(self) -> np.ndarray:
        """Pairs of bodies (K x 2) that share a node: those that touch, or nearly."""
        order = np.argsort(self._keys, kind="stable")
        key, owner = self._keys[order], self.node_owner[order]
        pairs = []
        for apart in range(1, 5):  # more than five bodies at a node are rare
            same = key[apart:] == key[:-apart]
            pairs.append(np.stack([owner[:-apart][same], owner[apart:][same]], 1))
        pairs = np.unique(np.sort(np.concatenate(pairs), axis=1), axis=0)
        return self.bodies[pairs]
