"""An elastic sphere, or a cylinder in plane strain, between rigid plates without friction: a Lagrangian reference.

Bilinear finite elements that move with the material, at finite strain, with Cairn's neo-Hookean law, in axial symmetry
or plane strain. Symmetry leaves a quarter of a disk; the plate is a bound on the height of the nodes on its edge: those
that would pull on it are let go, those that would pass it are held (an active set), and their reactions are the force.
Hertz's solution is that for a small approach. With 16, 32 and 48 elements a side forces at approaches of 0.01 to 0.06 R
are within 1.5, 0.5 and 0.3 % of those with 64, radii within 2.5, 1 and 0.5 %, peak pressures within 5, 0.5 and 0.4 %.

Lengths are in radii, stresses in Young's moduli. Only numpy is needed.
"""

from __future__ import annotations

import dataclasses
import functools
import math

import numpy as np

POISSON = 0.3
GRADING = 3.5  # elements at the contact are so much (sinh(x)/x times) finer than they would be if all were equal
GAUSS = ((-1, -1), (1, -1), (1, 1), (-1, 1))  # times 1/sqrt(3); the corners of an element in the same order
PAIRS = ((0, 0), (0, 1), (1, 0), (1, 1), (2, 2))  # components of F that do not vanish


@dataclasses.dataclass
class State:
    """The contact at one approach of the plate to the centre, from the first touch. Of the whole contact; forces per
    radius of length for the cylinder."""

    approach: float  # over R
    force: float  # over E R^2, E R for the cylinder
    width: float  # radius, or half-width, of the contact over R, from the mean square distance of the pressure
    peak: float  # pressure in the middle over E


class Pressed:
    """A quarter of a disk of radius 1, in polar elements, `along` its edge and `deep` along a radius."""

    def __init__(self, axial: bool, along: int, deep: int, poisson: float = POISSON):
        self.axial, self.along, self.deep = axial, along, deep
        self.shear, self.bulk = 1 / (2 * (1 + poisson)), 1 / (3 * (1 - 2 * poisson))

        def graded(count: int) -> np.ndarray:
            return np.sinh(GRADING * np.linspace(0, 1, count + 1)) / math.sinh(GRADING)

        angle, radius = math.pi / 2 * graded(along), 1 - graded(deep)[::-1]
        self.place = np.stack((np.outer(np.sin(angle), radius), np.outer(np.cos(angle), radius)), -1)
        self.place[0, :, 0] = self.place[-1, :, 1] = 0.0
        i, j = (index.ravel() for index in np.meshgrid(np.arange(along), np.arange(deep), indexing="ij"))
        self.nodes = np.stack([(i + a) * (deep + 1) + j + b for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))], 1)
        self.prepare_elements()
        self.move = np.zeros_like(self.place)  # displacement
        fixed = np.zeros(self.place.shape, bool)
        fixed[0, :, 0] = fixed[-1, :, 1] = fixed[:, 0] = True  # axis, plane of symmetry, and the centre
        self.fixed = fixed
        self.held = np.zeros(along + 1, bool)  # nodes of the edge on the plate

    def prepare_elements(self) -> None:
        """Gradients of the shape functions, as the matrix from an element's displacements to F, and volumes."""
        x = self.place.reshape(-1, 2)[self.nodes]
        self.to_strain, self.volume, self.at = [], [], []
        for gauss in GAUSS:
            s, t = (g / math.sqrt(3) for g in gauss)
            value = np.array([(1 + a * s) * (1 + b * t) / 4 for a, b in GAUSS])
            slope = np.array([(a * (1 + b * t) / 4, b * (1 + a * s) / 4) for a, b in GAUSS])
            jacobian = np.einsum("enx,ns->exs", x, slope)
            gradient = np.einsum("ns,esx->enx", slope, np.linalg.inv(jacobian))
            radius = x[:, :, 0] @ value
            to_strain = np.zeros((len(x), len(PAIRS), 8))
            for n in range(4):
                for row, (i, j) in enumerate(PAIRS[:4]):
                    to_strain[:, row, 2 * n + i] = gradient[:, n, j]
                if self.axial:
                    to_strain[:, 4, 2 * n] = value[n] / radius
            self.to_strain.append(to_strain)
            self.volume.append(np.abs(np.linalg.det(jacobian)) * (2 * math.pi * radius if self.axial else 1.0))
            self.at.append(value)

    def law(self, strain: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Nominal stress P = dW/dF and dP/dF, in PAIRS, of cairn/material/neo_hookean.hpp; F - 1 is `strain`."""
        F = np.zeros((len(strain), 3, 3))
        for row, (i, j) in enumerate(PAIRS):
            F[:, i, j] = strain[:, row] + (i == j)
        inverse, J = np.linalg.inv(F), np.linalg.det(F)
        i, j = (np.array(index) for index in zip(*PAIRS))
        f, g = F[:, i, j], inverse[:, j, i]  # F and its inverse transposed
        square = (F**2).sum((1, 2))[:, None]
        scale, push = (self.shear * J ** (-2 / 3))[:, None], (self.bulk / 2 * (J**2 - 1))[:, None]
        stress = push * g + scale * (f - square / 3 * g)
        crossed = inverse[:, j[:, None], i[None, :]] * inverse[:, j[None, :], i[:, None]]  # -d(F^-T)_ij / dF_kl
        outer = g[:, :, None] * g[:, None, :]
        tangent = (self.bulk * J**2)[:, None, None] * outer - push[:, None] * crossed
        mixed = g[:, :, None] * f[:, None, :] + f[:, :, None] * g[:, None, :]
        tangent += scale[:, None] * (np.eye(len(PAIRS)) - 2 / 3 * mixed
                                     + square[:, None] / 3 * (2 / 3 * outer + crossed))
        return stress, tangent

    def assemble(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Internal forces, and the stiffness: blocks of the rows of nodes along a radius, and those beside them."""
        u = self.move.reshape(-1, 2)[self.nodes].reshape(len(self.nodes), 8)
        force, matrix = np.zeros_like(u), np.zeros((len(u), 8, 8))
        for to_strain, volume in zip(self.to_strain, self.volume):
            stress, tangent = self.law(np.einsum("esn,en->es", to_strain, u))
            force += volume[:, None] * np.einsum("esn,es->en", to_strain, stress)
            matrix += np.matmul(to_strain.transpose(0, 2, 1), volume[:, None, None] * np.matmul(tangent, to_strain))
        size, rows = 2 * (self.deep + 1), self.along + 1
        number = (2 * self.nodes[:, :, None] + np.arange(2)).reshape(-1, 8)  # of the unknown
        total = np.bincount(number.ravel(), force.ravel(), rows * size)
        row, place = number // size, number % size
        diagonal, beside = np.zeros(rows * size * size), np.zeros((rows - 1) * size * size)
        for a in range(8):
            for b in range(8):
                to = row[:, a] * size * size + place[:, a] * size + place[:, b]
                if (a // 2 in (1, 2)) == (b // 2 in (1, 2)):
                    diagonal += np.bincount(to, matrix[:, a, b], len(diagonal))
                elif b // 2 in (1, 2):
                    beside += np.bincount(to, matrix[:, a, b], len(beside))
        return total, diagonal.reshape(rows, size, size), beside.reshape(rows - 1, size, size)

    @staticmethod
    def solve(diagonal: np.ndarray, beside: np.ndarray, right: np.ndarray) -> np.ndarray:
        """A symmetric block tridiagonal system, by elimination row by row."""
        rows, size = right.shape
        upper, value = np.zeros_like(beside), np.zeros_like(right)
        for k in range(rows):
            matrix, load = diagonal[k], right[k]
            if k:
                matrix, load = matrix - beside[k - 1].T @ upper[k - 1], load - beside[k - 1].T @ value[k - 1]
            columns = load[:, None] if k == rows - 1 else np.hstack((load[:, None], beside[k]))
            solved = np.linalg.solve(matrix, columns)
            value[k] = solved[:, 0]
            if k < rows - 1:
                upper[k] = solved[:, 1:]
        for k in range(rows - 2, -1, -1):
            value[k] -= upper[k] @ value[k + 1]
        return value

    def press(self, approach: float) -> State:
        """Moves the plate to 1 - approach: Newton's iteration, with what is held decided again in each."""
        limit = 1 - approach - self.place[:, -1, 1]  # of the displacement of the edge
        for _ in range(60):
            before = self.held.copy()
            force, diagonal, beside = self.assemble()
            reaction = -force.reshape(self.move.shape)[:, -1, 1]  # of the plate, downwards below zero
            passed = self.move[:, -1, 1] > limit + 1e-12
            self.held = np.where(self.held, reaction >= 0, passed) if before.any() else passed
            self.held[-1] = False
            given = np.zeros_like(self.move)
            given[self.held, -1, 1] = (limit - self.move[:, -1, 1])[self.held]
            known = self.fixed.copy()
            known[self.held, -1, 1] = True
            right = np.where(known, given, -force.reshape(self.move.shape)).reshape(self.along + 1, -1)
            self.impose(diagonal, beside, right, known.reshape(self.along + 1, -1))
            step = self.solve(diagonal, beside, right).reshape(self.move.shape)
            self.move += step
            if np.abs(step).max() < 1e-9 and (self.held == before).all():
                return self.state(approach)
        raise RuntimeError(f"no convergence at an approach of {approach}")

    @staticmethod
    def impose(diagonal: np.ndarray, beside: np.ndarray, right: np.ndarray, known: np.ndarray) -> None:
        """Moves the known values to the right and leaves them an equation of their own."""
        values = np.where(known, right, 0.0)
        moved = np.einsum("kij,kj->ki", diagonal, values)
        moved[:-1] += np.einsum("kij,kj->ki", beside, values[1:])
        moved[1:] += np.einsum("kji,kj->ki", beside, values[:-1])
        right[:] = np.where(known, right, right - moved)
        free = ~known
        diagonal *= free[:, :, None] & free[:, None, :]
        beside *= free[:-1, :, None] & free[1:, None, :]
        diagonal += known[:, :, None] * np.eye(known.shape[1])

    def state(self, approach: float) -> State:
        force = self.assemble()[0].reshape(self.move.shape)[:, -1, 1]
        push = np.where(self.held, -force, 0.0)
        x = (self.place + self.move)[:, -1, 0]
        square = float((push * x**2).sum() / push.sum())
        width = math.sqrt(2.5 * square) if self.axial else 2 * math.sqrt(square)
        return State(approach, float(push.sum()) * (1 if self.axial else 2), width, self.peak(0.2 * width))

    def peak(self, reach: float) -> float:
        """Mean pressure on the plate of the elements at the edge that begin within `reach` of the axis."""
        chosen = np.flatnonzero((np.arange(len(self.nodes)) % self.deep == self.deep - 1)
                                & (self.place.reshape(-1, 2)[self.nodes[:, 0], 0] < reach))
        u = self.move.reshape(-1, 2)[self.nodes].reshape(len(self.nodes), 8)
        total, weight = 0.0, 0.0
        for to_strain, volume in zip(self.to_strain, self.volume):
            strain = np.einsum("esn,en->es", to_strain[chosen], u[chosen])
            stress = self.law(strain)[0]
            # sigma_zz = (P F^T)_zz / J, F_zr is row 2 and F_zz row 3
            f = strain + np.array([i == j for i, j in PAIRS])
            J = (f[:, 0] * f[:, 3] - f[:, 1] * f[:, 2]) * f[:, 4]
            total -= (volume[chosen] * (stress[:, 2] * f[:, 2] + stress[:, 3] * f[:, 3]) / J).sum()
            weight += volume[chosen].sum()
        return float(total / weight) if len(chosen) else 0.0


@functools.cache
def reference(axial: bool, deepest: float = 0.06, elements: int = 48, steps: int = 12) -> tuple[State, ...]:
    """States at approaches that grow like squares up to the deepest, so that contacts grow evenly."""
    body = Pressed(axial, elements, elements)
    return tuple(body.press(deepest * (k / steps) ** 2) for k in range(1, steps + 1))


def at_approach(axial: bool, approach: float, **options) -> State:
    """The state at an approach between the reference's, each quantity over its Hertzian power of the approach (that of
    a cylinder, whose power varies, likewise) and linear between them."""
    states = reference(axial, **options)
    powers = {"force": 1.5 if axial else 1.0, "width": 0.5, "peak": 0.5}
    depths = [state.approach for state in states]
    return State(approach, **{name: float(approach**power * np.interp(approach, depths, [
        getattr(state, name) / state.approach**power for state in states])) for name, power in powers.items()})
