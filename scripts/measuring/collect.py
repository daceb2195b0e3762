"""All measures of an output as names and numbers, and as tables: where docs, plots and tests take them from."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from measuring import coarse, motion, network, stress
from measuring.pairs import pair_correlation
from measuring.snapshot import Snapshot
from results import MissingData, Run

Measures = dict[str, float]
Table = dict[str, np.ndarray]


@dataclasses.dataclass
class Options:
    box: tuple[np.ndarray, np.ndarray] | None = None  # lower and upper corner [m]; None: between walls and tools
    threshold: float = 0.0  # contacts below this share of the mean force are left out
    least: int | None = None  # grains with fewer contacts are rattlers; None: network.least_contacts
    radius: float | None = None  # of Lucy's kernel [m]; None: a mean diameter
    cell: float | None = None  # of the grid [m]; None: half the radius
    across: int = 1  # axis of profiles
    bins: int = 40  # of distributions and of g(r)
    by_points: bool = False  # fields from material points


def tensor_columns(name: str, tensor: np.ndarray, symmetric: bool = False) -> Measures:
    axes = "xyz"[: len(tensor)]
    return {f"{name}_{a}{b}": float(tensor[i, j]) for i, a in enumerate(axes) for j, b in enumerate(axes)
            if not symmetric or i <= j}


def box_of(snapshot: Snapshot, options: Options) -> tuple[np.ndarray, np.ndarray]:
    return options.box if options.box is not None else snapshot.box


def volume_of(snapshot: Snapshot, options: Options) -> float:
    lower, upper = box_of(snapshot, options)
    return float(np.prod(upper - lower))


def packing(snapshot: Snapshot, options: Options) -> Measures:
    grains, box = snapshot.grains, box_of(snapshot, options)
    axes = "xyz"[: snapshot.dimension]
    found = {"grains": len(grains), "mass": float(grains.mass.sum()), "volume": float(grains.volume.sum()),
             "mean_diameter": float(grains.diameter.mean())}
    for name, corner in zip(("lower", "upper"), box):
        found |= {f"box_{name}_{a}": float(x) for a, x in zip(axes, corner)}
    return found | {"packing_fraction": motion.packing_fraction(snapshot, box)}


def has_friction(run: Run) -> bool:
    rules = run.case.get("contact", {})
    rows = [rules, *rules.get("pair", [])]
    return any(row.get("law", "friction") != "frictionless" and row.get("friction", 0.3) > 0 for row in rows)


def coordination(snapshot: Snapshot, options: Options) -> Measures:
    least = options.least or network.least_contacts(snapshot.dimension, has_friction(snapshot.run))
    found = network.coordination(snapshot.contacts, len(snapshot.grains), least)
    return {"contacts": len(snapshot.contacts), "coordination": found.mean,
            "coordination_without_rattlers": found.without_rattlers, "rattlers": found.rattlers}


def some_contacts(snapshot: Snapshot):
    if not len(snapshot.contacts):
        raise MissingData("nothing touches")
    return snapshot.contacts


def fabric(snapshot: Snapshot, _options: Options) -> Measures:
    contacts = some_contacts(snapshot)
    names = ("fabric", "normal_force_fabric", "tangential_force_fabric")
    found: Measures = {}
    for name, tensor in zip(names, (network.fabric(contacts), *network.force_fabrics(contacts))):
        found |= tensor_columns(name, tensor, symmetric=True) | {f"{name}_anisotropy": network.anisotropy(tensor)}
        if snapshot.dimension == 2:
            found[f"{name}_direction"] = network.direction(tensor)
    return found


def forces(snapshot: Snapshot, _options: Options) -> Measures:
    contacts = some_contacts(snapshot)
    found = {"mean_normal_force": float(contacts.normal_force.mean()),
             "mean_tangential_force": float(np.linalg.norm(contacts.tangential_force, axis=1).mean())}
    share = network.mobilised(contacts, network.frictions(snapshot.run, snapshot))
    if len(share):
        found |= {"mobilised_friction": float(share.mean()),
                  "sliding_contacts": float((share > network.SLIDING).mean())}
    return found


def stress_by_volume(snapshot: Snapshot, options: Options) -> Measures:
    grains, volume = snapshot.grains, volume_of(snapshot, options)
    fluctuation = motion.flow(grains).fluctuation
    of_grains = stress.cell_volume_stress(grains, volume)
    kinetic = stress.kinetic_stress(grains, fluctuation, volume)
    pressure, shear, mu = stress.invariants(of_grains + kinetic)
    return (tensor_columns("stress", of_grains, True) | tensor_columns("kinetic_stress", kinetic, True)
            | {"pressure": pressure, "shear_stress": shear, "mu": mu})


def stress_by_contacts(snapshot: Snapshot, options: Options) -> Measures:
    return tensor_columns("contact_stress", stress.cell_contact_stress(snapshot, volume_of(snapshot, options)))


def flow(snapshot: Snapshot, options: Options) -> Measures:
    grains, volume = snapshot.grains, volume_of(snapshot, options)
    found = motion.flow(grains)
    total = stress.cell_volume_stress(grains, volume) + stress.kinetic_stress(grains, found.fluctuation, volume)
    rate, axes = motion.shear_rate(found.gradient), "xyz"[: snapshot.dimension]
    spin = grains.spin[:, 2] if snapshot.dimension == 2 else grains.spin
    return ({f"velocity_{a}": float(v) for a, v in zip(axes, found.mean)}
            | tensor_columns("velocity_gradient", found.gradient)
            | {"shear_rate": rate, "granular_temperature": motion.temperature(grains, found.fluctuation),
               "inertial_number": motion.inertial_number(rate, stress.invariants(total)[0], grains),
               "mean_spin": float(spin.mean() if spin.ndim == 1 else np.linalg.norm(spin.mean(axis=0))),
               "rms_spin": float(np.sqrt((grains.spin**2).sum(axis=1).mean()))})


def strain(snapshot: Snapshot, _options: Options) -> Measures:
    found = motion.strain(Snapshot(snapshot.run, 0).grains, snapshot.grains)
    return (tensor_columns("strain", found.hencky, True) | {"volume_strain": float(np.trace(found.hencky)),
                                                            "non_affine_displacement": found.non_affine**0.5})


def shape(snapshot: Snapshot, _options: Options) -> Measures:
    grains = snapshot.grains
    found: Measures = {}
    for name, values in (("aspect", motion.aspect(grains.second_moment)),
                         ("circularity", motion.circularity(grains.volume, grains.second_moment))):
        found |= {f"mean_{name}": float(values.mean()), f"least_{name}": float(values.min())}
    return found


def rotation(snapshot: Snapshot, _options: Options) -> Measures:
    turned = motion.rotations(snapshot.run, snapshot)
    found = {"rms_rotation": float(np.sqrt((turned**2).sum(axis=1).mean()))}
    return found | ({"mean_rotation": float(turned[:, 2].mean())} if snapshot.dimension == 2 else {})


GROUPS: tuple[Callable[[Snapshot, Options], Measures], ...] = (
    packing, coordination, fabric, forces, stress_by_volume, stress_by_contacts, flow, strain, shape, rotation)


def measures(snapshot: Snapshot, options: Options, only: tuple[str, ...] = ()) -> tuple[Measures, dict[str, str]]:
    """All measures of an output that its files allow, and why groups are missing. Groups that are named in `only` must
    not be: MissingData."""
    found, missing = {"time": snapshot.time, "step": snapshot.step}, {}
    for group in GROUPS:
        if only and group.__name__ not in only:
            continue
        try:
            found |= group(snapshot, options)
        except MissingData as reason:
            if only:
                raise MissingData(f"no {group.__name__}: {reason}") from reason
            missing[group.__name__] = str(reason)
    return found, missing


def vectors(name: str, values: np.ndarray) -> Table:
    return {f"{name}_{a}": column for a, column in zip("xyz", values.T)}


def stresses(name: str, values: np.ndarray) -> Table:
    d = values.shape[-1]
    return {f"{name}_{'xyz'[i]}{'xyz'[j]}": values[..., i, j] for i in range(d) for j in range(d)}


def grain_table(snapshot: Snapshot, options: Options) -> Table:
    """A row for each grain."""
    grains = snapshot.grains
    table = {"body": grains.body} | vectors("centre", grains.centre) | vectors("velocity", grains.velocity)
    table |= vectors("spin", grains.spin) | {"mass": grains.mass, "volume": grains.volume, "diameter": grains.diameter,
                                             "aspect": motion.aspect(grains.second_moment),
                                             "circularity": motion.circularity(grains.volume, grains.second_moment)}
    table |= stresses("stress", grains.stress)
    try:
        contacts = snapshot.contacts
    except MissingData:
        return table
    least = options.least or network.least_contacts(snapshot.dimension, has_friction(snapshot.run))
    net = network.coordination(contacts, len(grains), least)
    table |= {"contacts": net.per_grain, "rattler": net.is_rattler.astype(int), "unbalance": stress.unbalance(snapshot)}
    return table | stresses("contact_stress", stress.grain_moments(snapshot) / grains.volume[:, None, None])


def contact_table(snapshot: Snapshot, _options: Options) -> Table:
    """A row for each contact of a grain."""
    contacts, body = snapshot.contacts, snapshot.grains.body
    table = {"body": body[contacts.a], "partner": contacts.partner} | vectors("point", contacts.point)
    table |= vectors("normal", contacts.normal) | vectors("force", contacts.force)
    table |= {"normal_force": contacts.normal_force,
              "tangential_force": np.linalg.norm(contacts.tangential_force, axis=1),
              "friction": network.frictions(snapshot.run, snapshot)}
    return table | vectors("branch", stress.branches(snapshot, snapshot.grains, contacts))


def force_table(snapshot: Snapshot, options: Options) -> Table:
    """P(f_n / <f_n>) to six times the mean, and P(f_t / (mu f_n)); NaN where no contact has friction."""
    contacts = some_contacts(snapshot)
    normal = contacts.normal_force / contacts.normal_force.mean()
    x, p = network.density(normal, 6.0, options.bins)
    share = network.mobilised(contacts, network.frictions(snapshot.run, snapshot))
    y, q = network.density(np.minimum(share, 1.0), 1.0, options.bins)
    return {"normal_force_over_mean": x, "P_normal": p, "mobilised_friction": y,
            "P_mobilised": q if len(share) else q * np.nan}


def field_table(snapshot: Snapshot, options: Options) -> Table:
    """A row for each cell of the grid, the first axis slowest."""
    found = coarse.fields(snapshot, grid := grid_of(snapshot, options), options.by_points)
    places = np.meshgrid(*(grid.middles(k) for k in range(snapshot.dimension)), indexing="ij")
    table = {"xyz"[k]: place for k, place in enumerate(places)} | {"density": found.density}
    table |= {f"momentum_{a}": found.momentum[..., i] for i, a in enumerate("xyz"[: snapshot.dimension])}
    table |= {f"velocity_{a}": found.velocity[..., i] for i, a in enumerate("xyz"[: snapshot.dimension])}
    table |= {"packing_fraction": found.fraction, "temperature": found.temperature}
    for kind, values in (("contact_stress", found.contact_stress), ("kinetic_stress", found.kinetic_stress)):
        table |= stresses(kind, values) if values is not None else {}
    return {name: values.ravel() for name, values in table.items()}


def grid_of(snapshot: Snapshot, options: Options) -> coarse.Grid:
    return coarse.grid_of(snapshot, box_of(snapshot, options), options.radius, options.cell)


def profile_table(snapshot: Snapshot, options: Options) -> Table:
    found = coarse.fields(snapshot, grid_of(snapshot, options), options.by_points)
    return coarse.profile(found, options.across)


def pair_table(snapshot: Snapshot, options: Options) -> Table:
    """g(r) to five mean diameters, or as far as the box allows."""
    grains, box = snapshot.grains, box_of(snapshot, options)
    diameter, size = float(grains.diameter.mean()), box[1] - box[0]
    whole = np.isclose(box[0], snapshot.run.lower) & np.isclose(box[1], snapshot.upper)
    periodic = snapshot.run.periodic & whole
    reach = min(5 * diameter, *np.where(periodic, size / 2, size / 3))
    r, g = pair_correlation(snapshot.wrapped(grains.centre), box, periodic, reach, options.bins)
    return {"r": r, "r_over_diameter": r / diameter, "g": g}


TABLES: dict[str, Callable[[Snapshot, Options], Table]] = {
    "grains": grain_table, "contacts": contact_table, "forces": force_table, "fields": field_table,
    "profile": profile_table, "pairs": pair_table}
