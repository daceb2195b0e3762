"""What granular laboratories measure: one soft disk pressed flat, many of them far beyond jamming, a layer sheared at
constant pressure, a column that collapses.

The one disk is compared with finite elements that move with the material, which is exact to what refining them changes.
The laws of jammed packs, of sheared layers (da Cruz et al. 2005) and of columns (Staron & Hinch 2005) are the
literature's, of many more disks, in the last two of stiff ones; they stand beside what few soft ones give here, and are
no bands.
"""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np

from measuring import motion, network
from measuring.snapshot import Grains, Snapshot
from results import MissingData
from results import Run as Results
from validation.checks import Check, below, near, record
from validation.figures import Curve, Panel, draw_panels
from validation.lagrangian_contact import Pressed
from validation.runs import NO_PARTICLES, Run
from validation.suite import Folders, Problem

# The disk: radius, E and density 1; plates from above and below come 0.4 radii each.
CELLS = (12, 24)  # to a radius
RATIOS = {0.3: 0.005, 0.495: 0.01}  # Poisson's, and the plate's speed, below 0.5 % of the waves'
STRAINS = (0.05, 0.1, 0.2, 0.3, 0.4)
SPANS, BAND = (0.05, 0.15, 0.4), 0.03  # of strain, in which every force must be that near
ELEMENTS, STEPS = 32, 40
# The layer: speeds of the upper wall [m/s], and what the case fixes.
SPEEDS = (0.2, 0.4, 0.8)
LENGTH, PRESSURE, DIAMETER, DENSITY = 0.8, 500.0, 0.1, 1000.0
SETTLED = 0.75  # of the way that is sheared before anything is averaged, in wall-to-wall distances
# Soft disks without friction: speeds of the lid [m/s]; the literature's factor in Z - Z_0.
LID_SPEEDS = (0.1, 0.05)
SOFT, XI, ISOSTATIC = 1.0e5, 5.1, 4.0  # Young's modulus [Pa]
THRESHOLD = 1e-3  # of the mean force, below which nothing counts as a contact
# The column of 44 disks.
COLUMN_WIDTH, OPENED = 0.5, 0.25  # [m], and when the gate goes [s]
STRAY = 1.2  # a disk farther than so many diameters from the next one has left the heap


def flat(cells: int, poisson: float) -> Run:
    """A quarter of the disk."""
    cell, speed = 1 / cells, RATIOS[poisson]
    low = 1 + cell / 2
    settings = {"domain.cell_size": cell, "domain.upper": [1.75, 1.25], "materials.soft.poissons_ratio": poisson,
                "bodies.1.shape.lower": [0.0, low], "bodies.1.shape.upper": [1.75 - cell, 1.25],
                "bodies.1.velocity": [0.0, -speed], "time.end": (STRAINS[-1] + 0.01 + cell / 2) / speed,
                "output.contacts": "{}", "output.forces": "{ every = 10 }", "output.history": "{ every = 100 }"}
    return Run("validation/cylinder_press", NO_PARTICLES | settings, 2.0 * (cells / 12) ** 3)


def sheared(speed: float) -> Run:
    end = 0.75 + 1.6 / speed  # to a shear of about two
    return Run("laboratory/plane_shear", NO_PARTICLES | {
        "drive.0.velocity": [[0.5, 0.0, 0.0], [1.0, speed, 0.0]], "time.end": end, "output.contacts": "{}",
        "output.grains.interval": end / 40}, 12 / speed)


def disk_label(cells: int, poisson: float) -> str:
    return f"disk, {2 * cells} cells, nu {poisson}"


def layer_label(speed: float) -> str:
    return f"layer, {speed} m/s"


def soft_label(speed: float) -> str:
    return f"soft disks, {speed} m/s"


def softly(speed: float) -> Run:
    end = 0.05 + 0.2 / speed
    return Run("laboratory/soft_disks", {
        "time.end": end, "drive.0.velocity": [[0.0, 0.0, 0.0], [0.1, 0.0, -speed]], "output.grains.interval": end / 42,
        "output.contacts.interval": end / 42, "output.particles.interval": end / 42}, 4 / speed)


def runs(full: bool) -> dict[str, Run]:
    found = {disk_label(cells, nu): flat(cells, nu) for cells in CELLS[: 1 + full] for nu in RATIOS}
    found |= {layer_label(speed): sheared(speed) for speed in (SPEEDS if full else SPEEDS[1:2])}
    found |= {soft_label(speed): softly(speed) for speed in LID_SPEEDS[: 1 + full]}
    return found | {"column": Run("laboratory/column_collapse", {"time.end": 1.6, "output.particles": "{}"}, 20)}


@functools.cache
def reference(poisson: float, elements: int = ELEMENTS) -> tuple[np.ndarray, np.ndarray]:
    """Strains, and forces on the disk, over E R."""
    body = Pressed(False, elements, elements, poisson)
    states = [body.press(1.02 * STRAINS[-1] * k / STEPS) for k in range(1, STEPS + 1)]
    return np.array([0.0, *(s.approach for s in states)]), np.array([0.0, *(s.force for s in states)])


def pressed(folder: Path, cells: int, speed: float) -> tuple[np.ndarray, np.ndarray]:
    """The same of a run, in the means over hundredths of strain."""
    plate = Results(folder).forces()["body1"]
    edges = np.arange(-0.005, STRAINS[-1] + 0.01, 0.01)
    times = (edges + 0.5 / cells) / speed
    impulse = np.interp(times, plate["time"], plate["impulse_y"])
    return (edges[1:] + edges[:-1]) / 2, 2 * np.diff(impulse) / np.diff(times)  # the model is half of the contact


def disk_checks(folders: Folders) -> list[Check]:
    found = []
    for cells in CELLS:
        for nu, speed in RATIOS.items():
            if (case := disk_label(cells, nu)) not in folders:
                continue
            strain, force = pressed(folders[case], cells, speed)
            found += [record(case, f"force at {at:g} of strain [E R]", np.interp(at, strain, force),
                             float(np.interp(at, *reference(nu)))) for at in STRAINS]
            for low, high in zip(SPANS, SPANS[1:]):
                inside = (strain > low - 1e-9) & (strain < high + 1e-9)
                errors = force[inside] / np.interp(strain[inside], *reference(nu)) - 1
                found.append(below(case, f"largest error of the force, strains {low:g} to {high:g}",
                                   np.abs(errors).max(), BAND))
    for nu in RATIOS:
        coarse, fine = (np.interp(STRAINS, *reference(nu, n)) for n in (ELEMENTS // 2, ELEMENTS))
        found.append(record("finite elements", f"largest change of the force with half of them, nu {nu}",
                            np.abs(coarse / fine - 1).max()))
    return found


def layer(folder: Path) -> dict[str, float]:
    """Means over the later part of the shear: friction and inertial number by the wall's force, and the fraction."""
    run = Results(folder)
    wall = run.forces()["upper"]
    height = np.interp([0.0], wall["time"], wall["y"])[0] - 0.05
    start = np.interp(SETTLED * height, wall["x"] - wall["x"][0], wall["time"])
    late = np.flatnonzero(wall["time"] >= start)
    first, last = late[0], late[-1]
    span = wall["time"][last] - wall["time"][first]
    given = {axis: (wall[f"impulse_{axis}"][last] - wall[f"impulse_{axis}"][first]) / span for axis in "xy"}
    drag, push = -given["x"], given["y"]
    fractions, rates = [], []
    for k, frame in enumerate(run.grains):
        if frame.time < start:
            continue
        grains = Snapshot(run, k).grains
        top = np.interp(frame.time, wall["time"], wall["y"])
        low, high = 0.05 + 2 * DIAMETER, top - 2 * DIAMETER  # away from the walls
        fractions.append(strip_fraction(grains, low, high))
        rates.append(motion.flow(grains).gradient[0, 1])
    rate = float(np.mean(rates))
    return {"I": rate * DIAMETER * (DENSITY / (push / LENGTH)) ** 0.5, "mu": drag / push,
            "fraction": float(np.mean(fractions)), "held": push / (PRESSURE * LENGTH)}


def strip_fraction(grains: Grains, low: float, high: float) -> float:
    """The share of a strip that disks, taken for round, fill."""
    radius = grains.diameter / 2

    def below(height: float) -> np.ndarray:
        t = np.clip((height - grains.centre[:, 1]) / radius, -1, 1)
        return radius**2 * (np.arcsin(t) + t * np.sqrt(1 - t**2) + np.pi / 2)

    return float((below(high) - below(low)).sum() / (LENGTH * (high - low)))


def layer_checks(folders: Folders) -> list[Check]:
    found = []
    for speed in SPEEDS:
        if (case := layer_label(speed)) in folders:
            m = layer(folders[case])
            found += [near(case, "pressure on the upper wall over that of the piston", m["held"], 1.0, 0.005),
                      record(case, "inertial number I", m["I"]),
                      record(case, "mu; da Cruz et al.: .25 + 1.1 I", m["mu"], 0.25 + 1.1 * m["I"]),
                      record(case, "packing fraction; da Cruz et al.: .81 - .3 I", m["fraction"], 0.81 - 0.3 * m["I"])]
    return found


def front(folder: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, how far the heap reaches, that is the farthest disk that hangs together with the left wall, and how high."""
    run, rows = Results(folder), []
    for k, frame in enumerate(run.grains):
        grains = Snapshot(run, k).grains
        centre, radius = grains.centre, grains.diameter / 2
        heap = centre[:, 0] < 2 * DIAMETER
        close = np.linalg.norm(centre[:, None] - centre[None], axis=2) < STRAY * (radius[:, None] + radius[None])
        while (grown := close[heap].any(axis=0) | heap).sum() > heap.sum():
            heap = grown
        rows.append((frame.time, (centre[:, 0] + radius)[heap].max(), (centre[:, 1] + radius)[heap].max()))
    return tuple(np.array(rows).T)


def column_checks(folders: Folders) -> list[Check]:
    if "column" not in folders:
        return []
    times, reach, heights = front(folders["column"])
    height = float(np.interp(OPENED, times, heights))
    ratio = height / COLUMN_WIDTH
    literature = 2.5 * ratio if ratio < 2 else 3.25 * ratio**0.7
    return [record("column", "height over width a", ratio),
            record("column", f"run-out at {times[-1]:.2g} s over the width; Staron & Hinch: 2.5 a, 3.25 a^.7",
                   reach[-1] / COLUMN_WIDTH - 1, literature)]


@functools.cache
def jammed(folder: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Packing fraction, coordination without rattlers, and pressure on the lid over E, at the outputs with points; of
    the middle, more than 1.5 diameters from the plates."""
    run, rows = Results(folder), []
    lid = run.forces()["lid"]
    for k, frame in enumerate(run.grains):
        snapshot = Snapshot(run, k, threshold=THRESHOLD)
        try:
            points = snapshot.points
        except MissingData:
            continue
        low, high = (end[1] + side * 1.5 * DIAMETER for end, side in zip(snapshot.box, (1, -1)))
        height = points.field("position")[:, 1]
        grain = np.isin(points.field("body"), snapshot.grains.body) & (height > low) & (height < high)
        area = points.field("volume")[grain].sum()
        found = network.coordination(snapshot.contacts, len(snapshot.grains), 3)
        middle = (snapshot.grains.centre[:, 1] > low) & (snapshot.grains.centre[:, 1] < high) & ~found.is_rattler
        start = snapshot.contact_interval[0]
        impulse = np.diff(np.interp([start, frame.time], lid["time"], lid["impulse_y"]))[0]
        push = impulse / (frame.time - start) if frame.time > start else 0.0
        rows.append((area / (LENGTH * (high - low)), found.per_grain[middle].mean() if middle.any() else 0.0,
                     push / LENGTH / SOFT))
    return tuple(np.array(rows).T)


def jamming_fit(fraction: np.ndarray, contacts: np.ndarray) -> tuple[float, float, float]:
    """phi_0, xi and the exponent of Z - 4 = xi (phi - phi_0)^beta with least squares of the logarithms; xi with 1/2."""
    use = contacts > ISOSTATIC + 0.1
    y = np.log(contacts[use] - ISOSTATIC)
    best = None
    for jam in np.linspace(0.70, fraction[use].min() - 1e-3, 200):
        x = np.log(fraction[use] - jam)
        slope, level = np.polyfit(x, y, 1)
        rest = ((y - slope * x - level) ** 2).sum()
        half = (y - x / 2).mean()
        rest_half = ((y - x / 2 - half) ** 2).sum()
        best = (rest, rest_half, jam, slope, half) if best is None or rest_half < best[1] else best
    return best[2], float(np.exp(best[4])), best[3]


def soft_checks(folders: Folders) -> list[Check]:
    found, pressures = [], []
    for speed in LID_SPEEDS:
        if (case := soft_label(speed)) not in folders:
            continue
        fraction, contacts, pressure = jammed(folders[case])
        jam, xi, exponent = jamming_fit(fraction, contacts)
        found += [record(case, "largest packing fraction", fraction.max()),
                  record(case, "phi_0, with exponent 1/2", jam),
                  record(case, "xi of Z - 4 = xi sqrt(phi - phi_0)", xi, XI),
                  record(case, "exponent from that phi_0", exponent, 0.5)]
        pressures.append(np.interp(0.9, fraction, pressure))
    if len(pressures) > 1:
        found.append(near("soft disks", "P at phi = 0.9, half as fast", pressures[1] / pressures[0], 1.0, 0.01))
    return found


def checks(folders: Folders) -> list[Check]:
    return disk_checks(folders) + soft_checks(folders) + layer_checks(folders) + column_checks(folders)


def draw(folders: Folders, out: Path) -> list[Path]:
    disks, errors = [], []
    for nu in RATIOS:
        x, f = reference(nu)
        disks.append(Curve(f"finite elements, nu {nu}", x, f, "k--"))
        for cells in CELLS:
            if (case := disk_label(cells, nu)) in folders:
                strain, force = pressed(folders[case], cells, RATIOS[nu])
                disks.append(Curve(case, strain, force))
                errors.append(Curve(case, strain[5:], force[5:] / np.interp(strain[5:], x, f) - 1))
    panels = [Panel("One soft disk between plates", "strain", "force [E R]", disks),
              Panel("Less the finite elements'", "strain", "share", errors)]
    layers = [layer(folders[layer_label(speed)]) for speed in SPEEDS if layer_label(speed) in folders]
    if layers:
        number = np.linspace(0, 0.2, 20)
        panels.append(Panel("Sheared layer", "inertial number", "mu", [
            Curve("da Cruz et al. 2005", number, 0.25 + 1.1 * number, "k--"),
            Curve("here", np.array([m["I"] for m in layers]), np.array([m["mu"] for m in layers]), "o")]))
    for speed in LID_SPEEDS:
        if (case := soft_label(speed)) in folders:
            fraction, contacts, pressure = jammed(folders[case])
            jam, xi, _ = jamming_fit(fraction, contacts)
            law = ISOSTATIC + xi * np.sqrt(np.maximum(fraction - jam, 0))
            panels += [Panel(case, "packing fraction", "Z without rattlers", [
                Curve("here", fraction, contacts, "o"), Curve(f"4 + {xi:.2g} sqrt(phi - {jam:.3f})", fraction, law, "k--")]),
                       Panel(case, "packing fraction", "P / E", [Curve("here", fraction, pressure, "o-")])]
    if "column" in folders:
        times, reach, _ = front(folders["column"])
        panels.append(Panel("Column collapse", "time [s]", "reach of the heap [m]", [Curve("here", times, reach)]))
    return [draw_panels(out / "laboratory.png", "The granular laboratory", panels, columns=2)]


PROBLEM = Problem("laboratory", "The granular laboratory",
                  "Lagrangian finite elements; da Cruz et al. 2005; Staron & Hinch 2005", runs, checks, draw)
