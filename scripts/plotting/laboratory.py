"""What granular laboratories draw: stress over strain, force over way, coordination over packing fraction, distributions
of forces, roses of the fabric, profiles, outflow. Measures are those of docs/measures.md.

Functions like those of figures.py.
"""

from __future__ import annotations

import functools
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from canvas import prefixed
from results import MissingData, Run

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # where measuring is

from measuring import coarse, collect, network  # noqa: E402
from measuring.snapshot import Snapshot  # noqa: E402

SECTORS = 36  # of a rose
MOVED = 1e-9  # of the domain: a tool that went less far stands
LATE = 0.5  # profiles are means over the outputs of this last share of the time


def saved(figure, folder: Path, name: str) -> list[str]:
    figure.tight_layout()
    figure.savefig(folder / name, dpi=130)
    plt.close(figure)
    return [name]


@functools.cache
def series(run: Run) -> dict[str, np.ndarray]:
    """The measures of all outputs, as columns; NaN where an output has not all."""
    rows = [collect.measures(Snapshot(run, k), collect.Options())[0] for k in range(len(run.grains))]
    return {name: np.array([row.get(name, np.nan) for row in rows]) for row in rows for name in row}


def needed(run: Run, *names: str) -> dict[str, np.ndarray]:
    table = series(run)
    for name in names:
        if name not in table or np.isnan(table[name]).all():
            collect.measures(Snapshot(run, len(run.grains) - 1), collect.Options(), tuple(
                group.__name__ for group in collect.GROUPS))  # says what is missing
            raise MissingData(f"no output has the measure '{name}'")
    return table


def force_displacement(run: Run, other: Run | None, folder: Path, summary: dict) -> list[str]:
    """The force on each tool that moves, against its own way, in the mean between rows of forces.csv."""
    tools, size = run.forces(), (run.upper - run.lower).max()
    axes_names = "xyz"[: run.dimension]
    figure, axes = plt.subplots(figsize=(6.5, 4.5))
    drawn = False
    for name, table in tools.items():
        place = np.array([table[a] for a in axes_names])
        moved = place - place[:, :1]
        axis = int(np.abs(moved).max(axis=1).argmax())
        if len(table["time"]) < 2 or np.abs(moved[axis]).max() < MOVED * size:
            continue
        sign = np.sign(moved[axis][np.abs(moved[axis]).argmax()])
        force = -np.diff(table[f"impulse_{axes_names[axis]}"]) / np.diff(table["time"]) * sign
        way = sign * (moved[axis][1:] + moved[axis][:-1]) / 2
        axes.plot(1e3 * way, force, lw=1.2, label=f"{name}, along {axes_names[axis]}")
        summary.setdefault("largest_force_N", {})[name] = float(force.max())
        drawn = True
    if not drawn:
        plt.close(figure)
        raise MissingData("no tool of forces.csv moves")
    axes.set_xlabel("way of the tool [mm]")
    axes.set_ylabel("force against it [N]" + (" per metre" if run.dimension == 2 else ""))
    axes.set_title(run.title, fontsize=10)
    axes.legend(fontsize=8)
    return saved(figure, folder, "force_displacement.png")


def stress_strain(run: Run, other: Run | None, folder: Path, summary: dict) -> list[str]:
    """Stresses of the cell against the strain of the axis that is strained most, and mu against the shear strain."""
    table = needed(run, "stress_xx", "strain_xx")
    names = "xyz"[: run.dimension]
    strains = {a: -table[f"strain_{a}{a}"] for a in names}
    axis = max(names, key=lambda a: np.nanmax(np.abs(strains[a])))
    tensor = np.array([[table[f"strain_{min(a, b)}{max(a, b)}"] for b in names] for a in names])
    deviator = tensor - np.eye(len(names))[:, :, None] * np.trace(tensor) / len(names)
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.2))
    stress = {a: -(table[f"stress_{a}{a}"] + table[f"kinetic_stress_{a}{a}"]) for a in names}
    factor, unit = prefixed(np.nanmax(np.abs(list(stress.values()))), "Pa")
    for a in names:
        left.plot(strains[axis], factor * stress[a], ".-", lw=1, ms=4, label=f"along {a}")
    left.set_xlabel(f"compression along {axis} (Hencky)")
    left.set_ylabel(f"compressive stress [{unit}]")
    left.legend(fontsize=8)
    right.plot(np.sqrt(2 * (deviator**2).sum(axis=(0, 1))), table["mu"], ".-", lw=1, ms=4, color="C3")
    right.set_xlabel("shear strain, sqrt(2 e:e)")
    right.set_ylabel("mu = tau / p")
    figure.suptitle(run.title, fontsize=10)
    return saved(figure, folder, "stress_strain.png")


def coordination(run: Run, other: Run | None, folder: Path, summary: dict) -> list[str]:
    """Coordination and pressure against the packing fraction."""
    table = needed(run, "coordination", "packing_fraction")
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.2))
    left.plot(table["packing_fraction"], table["coordination"], ".-", lw=1, ms=4, label="all")
    left.plot(table["packing_fraction"], table["coordination_without_rattlers"], ".-", lw=1, ms=4,
              label="without rattlers")
    left.set_ylabel("coordination Z")
    left.legend(fontsize=8)
    factor, unit = prefixed(np.nanmax(np.abs(table["pressure"])), "Pa")
    right.plot(table["packing_fraction"], factor * table["pressure"], ".-", lw=1, ms=4, color="C3")
    right.set_ylabel(f"pressure [{unit}]")
    for axes in (left, right):
        axes.set_xlabel("packing fraction")
    figure.suptitle(run.title, fontsize=10)
    summary["coordination_at_end"] = float(table["coordination"][-1])
    summary["packing_fraction_at_end"] = float(table["packing_fraction"][-1])
    return saved(figure, folder, "coordination.png")


def last_contacts(run: Run) -> Snapshot:
    """The last output in which something touches."""
    for k in reversed(range(len(run.grains))):
        snapshot = Snapshot(run, k)
        if len(snapshot.contacts):
            return snapshot
    raise MissingData("nothing touches in any output")


def force_distribution(run: Run, other: Run | None, folder: Path, summary: dict) -> list[str]:
    """P(f_n / <f_n>) and P(f_t / (mu f_n)) of the last output with contacts."""
    snapshot = last_contacts(run)
    bins = int(np.clip(len(snapshot.contacts) ** 0.5, 6, 40))
    table = collect.force_table(snapshot, collect.Options(bins=bins))
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.2))
    some = table["P_normal"] > 0
    left.semilogy(table["normal_force_over_mean"][some], table["P_normal"][some], "o-", lw=1, ms=4)
    left.set_xlabel("f_n / <f_n>")
    left.set_ylabel("probability density")
    if np.isfinite(table["P_mobilised"]).all():
        right.step(table["mobilised_friction"], table["P_mobilised"], where="mid")
    else:
        right.text(0.5, 0.5, "no friction", ha="center", transform=right.transAxes)
    right.set_xlabel("f_t / (mu f_n)")
    figure.suptitle(f"{run.title}, t = {snapshot.time:.4g} s, {len(snapshot.contacts)} contacts", fontsize=10)
    return saved(figure, folder, "force_distribution.png")


def fabric_rose(run: Run, other: Run | None, folder: Path, summary: dict) -> list[str]:
    """Directions of contacts, and mean forces by direction, with the second harmonics of their tensors (2D)."""
    if run.dimension != 2:
        raise MissingData("drawn for two dimensions only")
    snapshot = last_contacts(run)
    contacts = snapshot.contacts
    angle = np.arctan2(contacts.normal[:, 1], contacts.normal[:, 0])
    both = np.concatenate([angle, angle + np.pi]) % (2 * np.pi)
    sector = np.rint(both / (2 * np.pi) * SECTORS).astype(int) % SECTORS  # one lies around each axis
    count = np.bincount(sector, minlength=SECTORS)
    push = np.bincount(sector, np.tile(contacts.normal_force, 2), SECTORS) / np.maximum(count, 1)
    tensors = network.fabric(contacts), network.force_fabrics(contacts)[0]
    carried = push * count / (contacts.normal_force.mean() * count.mean())
    roses = ((count / count.mean(), tensors[0], "contacts, over the mean"),
             (carried, tensors[1], "normal force they carry, over the mean"))
    figure, pair = plt.subplots(1, 2, figsize=(10, 5), subplot_kw={"projection": "polar"})
    theta, fine = np.arange(SECTORS) * 2 * np.pi / SECTORS, np.linspace(0, 2 * np.pi, 361)
    for axes, (values, tensor, title) in zip(pair, roses):
        axes.bar(theta, values, width=2 * np.pi / SECTORS, alpha=0.6)
        a, at = network.anisotropy(tensor), np.radians(network.direction(tensor))
        axes.plot(fine, np.maximum(1 + a * np.cos(2 * (fine - at)), 0), "k-", lw=1)
        axes.set_title(f"{title}\na = {a:.3f} at {np.degrees(at):.0f} degrees", fontsize=9)
    figure.suptitle(f"{run.title}, t = {snapshot.time:.4g} s", fontsize=10)
    return saved(figure, folder, "fabric_rose.png")


def profiles(run: Run, other: Run | None, folder: Path, summary: dict) -> list[str]:
    """Packing fraction, velocity, stress and temperature across the layer, means over the last half of the time."""
    shear = run.shear()
    across = shear.axis if shear else int(np.abs(run.gravity).argmax()) if np.abs(run.gravity).any() else 1
    late = [k for k, frame in enumerate(run.grains) if frame.time >= LATE * run.grains[-1].time]
    snapshots = [Snapshot(run, k) for k in late]
    # Slices stay where they are while tools move: within the least box that holds those of all outputs.
    box = np.min([s.box[0] for s in snapshots], axis=0), np.max([s.box[1] for s in snapshots], axis=0)
    grid = coarse.grid_of(snapshots[0], box)
    tables = [coarse.profile(coarse.fields(s, grid), across) for s in snapshots]
    names = [name for name in tables[-1] if all(name in table for table in tables)]
    mean = {}
    for name in names:
        rows = np.array([table[name] for table in tables])
        count = np.isfinite(rows).sum(axis=0)
        mean[name] = np.where(count > 0, np.nansum(rows, axis=0) / np.maximum(count, 1), np.nan)
    axis = "xyz"[across]
    panels = (("packing fraction", ["packing_fraction"]),
              ("velocity [m/s]", [n for n in names if n.startswith("velocity")]),
              ("stress by contacts [Pa]", [n for n in names if n.startswith("contact_stress")]),
              ("granular temperature [m\N{SUPERSCRIPT TWO}/s\N{SUPERSCRIPT TWO}]", ["temperature"]))
    figure, row = plt.subplots(1, len(panels), figsize=(15, 4.2), sharey=True)
    for axes, (title, columns) in zip(row, panels):
        for name in columns:
            axes.plot(mean[name], mean[axis], lw=1.2, label=name.rpartition("_")[2])
        axes.set_xlabel(title)
        axes.locator_params(axis="x", nbins=5)
        if len(columns) > 1:
            axes.legend(fontsize=7)
    row[0].set_ylabel(f"{axis} [m]")
    figure.suptitle(f"{run.title}, mean of {len(late)} outputs from {run.grains[late[0]].time:.4g} s on", fontsize=10)
    return saved(figure, folder, "profiles.png")


def outflow(run: Run, other: Run | None, folder: Path, summary: dict) -> list[str]:
    """What has left through free faces over time."""
    history = run.history()
    if not history.get("mass_left", np.zeros(1))[-1] > 0:
        raise MissingData("nothing left the domain")
    figure, axes = plt.subplots(figsize=(6.5, 4.5))
    axes.plot(history["time"], history["mass_left"], lw=1.2)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("mass that left [kg]" + (" per metre" if run.dimension == 2 else ""))
    axes.set_title(run.title, fontsize=10)
    return saved(figure, folder, "outflow.png")


def at_end(run: Run, other: Run | None, folder: Path, summary: dict) -> list[str]:
    """No picture: all measures of the last output go to summary.json."""
    summary["measures_at_end"] = collect.measures(Snapshot(run, len(run.grains) - 1), collect.Options())[0]
    return []


FIGURES = (force_displacement, stress_strain, coordination, force_distribution, fabric_rose, profiles, outflow, at_end)
