"""Clip planes, and the lattice on which pictures find surfaces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lattice import SPACING_TO_CELL, Lattice


@dataclass
class Plane:
    """A clip plane: what lies on the side of `normal` is cut away."""

    normal: np.ndarray  # (3), of length 1
    offset: float  # [m] along the normal

    def above(self, position: np.ndarray) -> np.ndarray:
        """Signed distance [m]; above 0: cut away."""
        return position @ self.normal - self.offset


def lattice_of(position: np.ndarray, body: np.ndarray, spacing: float, lower, upper, periodic) -> Lattice:
    """The lattice that pictures use."""
    return Lattice(position, body, SPACING_TO_CELL * spacing, lower, upper, periodic)
