"""The network of contacts: coordination, rattlers, fabric, forces and friction. Formulas: docs/measures.md."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from measuring.snapshot import Contacts, Snapshot
from results import MissingData, Run

SLIDING = 0.99  # of mu f_n: from here on a contact counts as one that slides


@dataclasses.dataclass
class Coordination:
    """Contacts of a grain in the mean; those with tools and walls count for the grain alone."""

    mean: float
    without_rattlers: float
    rattlers: int
    is_rattler: np.ndarray  # of each grain
    per_grain: np.ndarray  # number of contacts


def least_contacts(dimension: int, friction: bool) -> int:
    """Fewer contacts than these hold no grain: force balance of frictionless ones, or two opposite ones."""
    return 2 if friction else dimension + 1


def coordination(contacts: Contacts, grains: int, least: int) -> Coordination:
    """Rattlers, grains with fewer than `least` contacts, are taken away until none is left."""
    pair = contacts.b >= 0
    b = np.where(pair, contacts.b, 0)
    kept, alive = np.ones(grains, bool), np.ones(len(contacts), bool)
    first = None
    while True:
        count = np.bincount(contacts.a[alive], minlength=grains) + np.bincount(b[alive & pair], minlength=grains)
        first = count if first is None else first
        rattles = kept & (count < least)
        if not rattles.any():
            break
        kept &= ~rattles
        alive &= kept[contacts.a] & (~pair | kept[b])
    left = int(kept.sum())
    return Coordination(float(first.mean()), float(count[kept].mean()) if left else 0.0, grains - left, ~kept, first)


def frictions(run: Run, snapshot: Snapshot) -> np.ndarray:
    """The coefficient of friction of each contact; 0 where it is frictionless, infinite where it sticks."""
    case, contacts, grains = run.case, snapshot.contacts, snapshot.grains
    names = list(case["materials"])
    rules = case.get("contact", {})

    def coefficient(table: dict, law: str) -> float:
        law = table.get("law", "friction" if "friction" in table else law)
        value = float(table.get("friction", rules.get("friction", 0.3)))
        return {"frictionless": 0.0, "friction": value}.get(law, math.inf)

    general = coefficient(rules, rules.get("law", "friction"))
    table = np.full((len(names) + 1, len(names) + 1), general)
    for pair in rules.get("pair", []):
        i, j = ((names + ["wall"]).index(name) for name in pair["materials"])
        table[i, j] = table[j, i] = coefficient(pair, rules.get("law", "friction"))
    material_of = np.full(int(max(snapshot.all_bodies.max(initial=0), contacts.partner.max(initial=0))) + 1, -1)
    material_of[snapshot.all_bodies] = snapshot.frame.field("material")
    other = np.where(contacts.partner >= 0, material_of[np.maximum(contacts.partner, 0)], len(names))
    found = table[grains.material[contacts.a], other]
    walls = {face.get("friction", 0.0) for face in case.get("boundary", {}).values()
             if isinstance(face, dict) and face.get("type") == "wall"}
    named = any("wall" in pair["materials"] for pair in rules.get("pair", []))
    if not named and (contacts.partner < 0).any():
        if len(walls) != 1:
            raise MissingData("the walls differ in friction, so that it is not known of a contact with one")
        found[contacts.partner < 0] = walls.pop()
    return found


def fabric(contacts: Contacts) -> np.ndarray:
    """F_ij = <n_i n_j>; its trace is 1."""
    return np.einsum("ci,cj->ij", contacts.normal, contacts.normal) / len(contacts)


def force_fabrics(contacts: Contacts) -> tuple[np.ndarray, np.ndarray]:
    """N_ij = <f_n n_i n_j> / <f_n> and T_ij = <f_t,i n_j> / <f_n>, symmetric part, f_t on the body that n points to.

    In statics the stress is proportional to N + T where branches are of one length along n."""
    mean = contacts.normal_force.mean()
    normal = np.einsum("c,ci,cj->ij", contacts.normal_force, contacts.normal, contacts.normal)
    tangential = -np.einsum("ci,cj->ij", contacts.tangential_force, contacts.normal)
    return normal / (len(contacts) * mean), (tangential + tangential.T) / (2 * len(contacts) * mean)


def anisotropy(tensor: np.ndarray) -> float:
    """The amplitude a of the distribution with this second moment: 2D E = (1 + a cos 2 theta) / (2 pi), 3D the size
    sqrt(3/2 a:a) of E = (1 + a_ij n_i n_j) / (4 pi); the tensor's trace is taken for 1."""
    d = len(tensor)
    deviator = tensor - np.trace(tensor) / d * np.eye(d)
    if d == 2:
        return 4 * math.sqrt((deviator**2).sum() / 2)
    return 7.5 * math.sqrt(1.5 * (deviator**2).sum())


def direction(tensor: np.ndarray) -> float:
    """The angle of the major axis to x in 2D [degrees], -90 to 90."""
    return math.degrees(0.5 * math.atan2(2 * tensor[0, 1], tensor[0, 0] - tensor[1, 1]))


def density(values: np.ndarray, top: float, bins: int) -> tuple[np.ndarray, np.ndarray]:
    """Probability density of values from 0 to `top`: middles of the bins, and density with integral 1 over all values,
    also those beyond."""
    counts, edges = np.histogram(values, bins, (0.0, top))
    return (edges[1:] + edges[:-1]) / 2, counts / (len(values) * np.diff(edges)) if len(values) else counts * 0.0


def mobilised(contacts: Contacts, friction: np.ndarray) -> np.ndarray:
    """f_t / (mu f_n) of the contacts that are pressed and have friction, neither frictionless nor sticking."""
    some = (friction > 0) & np.isfinite(friction) & (contacts.normal_force > 0)
    size = np.linalg.norm(contacts.tangential_force[some], axis=1)
    return size / (friction[some] * contacts.normal_force[some])
