"""The validation suite's own parts: closed forms, bands, kept runs, and its exit code.

    test_validation.py CAIRN SCRATCH
"""

import json
import math
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np

from harness import PATIENCE, ROOT, fresh_folder

sys.path.insert(0, str(ROOT / "scripts"))

from validation import closed_forms, report, series  # noqa: E402
from validation.checks import Check, below, near, observed_order, record  # noqa: E402
from validation.problems import bars, rotation, waves  # noqa: E402
from validation.suite import FORMS, Outcome, Problem  # noqa: E402


def bands():
    """A value is inside its band or not, and NaN never is."""
    assert near("", "", 1.04, 1.0, 0.05).passed and not near("", "", 0.94, 1.0, 0.05).passed
    assert near("", "", -1.04, -1.0, 0.05).passed
    assert below("", "", 0.0, 1e-12).passed and not below("", "", -1e-3, 1.0).passed
    assert record("", "", 5.0).passed and not record("", "", math.nan).passed
    assert not Check("", "", math.nan, 0.0, 1.0).passed
    assert math.isclose(observed_order([0.1, 0.2, 0.4], [3e-4, 12e-4, 48e-4]), 2.0)


def papers_formulas():
    """The closed forms give the numbers that the papers print."""
    sphere = closed_forms.Rigid(1.6, 2 / 5, 10.0, math.pi / 4, 0.495)
    assert not sphere.slips and math.isclose(sphere.distance(1.0), 25 * math.sqrt(2) / 14)  # B eq. 23
    sphere = closed_forms.Rigid(1.6, 2 / 5, 10.0, math.pi / 3, 2 / 7)
    assert sphere.slips and math.isclose(sphere.distance(1.0), 2.5 * (math.sqrt(3) - 2 / 7))  # B eq. 24
    disk = closed_forms.Rigid(0.5, 1 / 2, 9.8, math.pi / 6, 0.5)
    assert not disk.slips and math.isclose(disk.distance(2.0), 9.8 * 4 * 0.5 / 3)  # A eq. 25
    for inertia, limit in ((1 / 2, 3.0), (2 / 5, 3.5)):  # rolling begins to slip where tan(angle) = limit * mu
        pair = [closed_forms.Rigid(0.5, inertia, 9.8, math.atan(limit * 0.3) + side, 0.3) for side in (-1e-9, 1e-9)]
        assert [rigid.slips for rigid in pair] == [False, True]
        assert math.isclose(pair[0].distance(1.0), pair[1].distance(1.0), rel_tol=1e-6)
        assert math.isclose(pair[0].spin_up, pair[1].spin_up, rel_tol=1e-6)
    spin = closed_forms.Backspin()
    assert math.isclose(float(spin.distance(2 / 7)), 2.5 * (2 / 7) ** 2)  # B eq. 25
    assert math.isclose(float(spin.spin_at(1.0)), 10 / 7) and math.isclose(float(spin.velocity(1.0)), 10 / 7)


def dropped_sphere():
    """Without friction it slides freely; one that falls first gets further; a hard one rolls from the start."""
    soft = closed_forms.DroppedSphere(1.0, 1000.0, 1e7, 0.3, 1.0)
    times, way = soft.path(10.0, math.pi / 6, 0.0, 0.1, 1.0)
    assert math.isclose(way[-1], 2.5, rel_tol=1e-3) and math.isclose(times[-1], 1.0)
    placed = soft.path(10.0, math.pi / 6, 0.5, 0.0, 2.0)[1][-1]
    dropped = soft.path(10.0, math.pi / 6, 0.5, 0.1, 2.0)[1][-1]
    rolled = 5 / 14 * 10 * 0.5 * 2**2
    assert rolled < placed < dropped < 10 * 0.5 * 2**2 / 2  # it slips while it flies
    hard = closed_forms.DroppedSphere(1.0, 1000.0, 1e10, 0.3, 1.0)
    assert math.isclose(hard.path(10.0, math.pi / 6, 0.5, 0.0, 2.0, 1e-5)[1][-1], rolled, rel_tol=5e-3)


def waves_and_impacts():
    """Integrated solutions meet their closed forms, and the measures find what was put in."""
    hertz = closed_forms.HertzSphere(1.0, 1.1)
    times, velocities = hertz.impact(4.2, 0.01)
    assert math.isclose(times[-1], hertz.impact_time(4.2, 0.01), rel_tol=2e-3)
    assert math.isclose(velocities[-1], -0.01, rel_tol=1e-3)
    approach = float(np.trapz(np.maximum(velocities, 0), times))
    assert math.isclose(approach, hertz.largest_approach(4.2, 0.01), rel_tol=2e-3)
    force = float(hertz.force(0.03))  # peak pressure and radius belong to the same force
    assert math.isclose(hertz.approach(force), 0.03, rel_tol=1e-12)
    radius = hertz.contact_radius(force)
    assert math.isclose(radius**2, 0.03, rel_tol=1e-12)
    assert math.isclose(hertz.peak_pressure(force) * 2 / 3 * math.pi * radius**2, force, rel_tol=1e-12)
    times = np.linspace(0, 5, 1001)
    start, end = closed_forms.pulse_length(times, np.clip(times - 1.5, 0, 2))
    assert abs(start - 1.5) < 0.01 and abs(end - 3.5) < 0.01
    start, end = closed_forms.pulse_length(*bars.finite_strain(0.002))
    assert abs(end - start - 2) < 0.015, end - start  # linear at so small a speed
    stiffness = (bars.nominal_stress(1 + 1e-6) - bars.nominal_stress(1 - 1e-6)) / 2e-6
    assert math.isclose(stiffness, bars.BULK + 4 / 3 * bars.SHEAR, rel_tol=1e-6)
    wave_number, radii, mode = waves.ring_mode()
    shear = np.gradient(mode, radii) - mode / radii
    assert abs(shear[0]) < 0.05 and abs(shear[-1]) < 0.05 and wave_number > math.pi / (1 - waves.INNER)


def tables(scratch: Path):
    """Columns, values between rows, integrals, and the first time at which a level is reached."""
    (scratch / "table.csv").write_text("time,a\n0,0\n1,2\n3,2\n")
    table = series.read_table(scratch / "table.csv")
    assert series.at_time(table, "a", 0.25) == 0.5 and series.at_time(table, "a", 9.0) == 2.0
    assert series.integral(table, "a", 0.5, 2.0) == 0.75 + 2.0
    assert series.crossing(table["time"], table["a"], 1.0) == 0.5
    assert math.isnan(series.crossing(table["time"], table["a"], 2.5))


def other_forms():
    """The overview counts the bands that a form misses, also those of runs that failed; what is not repeated counts
    nowhere."""
    problem = Problem("p", "", "", lambda full: {}, lambda folders: [])
    own = [near("a", "x", 1.0, 1.0, 0.1), near("a", "y", 2.0, 1.0, 0.1), near("b", "x", 1.0, 1.0, 0.1),
           record("a", "z", 1.0)]
    forms = {"approach": [near("a", "x", 1.2, 1.0, 0.1), near("a", "y", 1.0, 1.0, 0.1), record("a", "z", 3.0)],
             "last": [Check("p", "run failed: a", math.nan)]}
    outcome = Outcome(problem, own, forms, [])
    header, row = report.overview([outcome])
    assert row[:3] == ["p", "2", "1"], row
    found = dict(zip(header, row))
    assert found["approach"] == "1" and found["last"] == "2" and found["linear"] == "-", found
    assert report.forms_table(outcome, ["approach", "last"])[1:] == [
        ["a", "x", "+0.0%", "+20.0% (out)", "failed"], ["a", "y", "+100.0% (out)", "+0.0%", "failed"],
        ["a", "z", "1", "3", "failed"]]
    assert all(f"*{form}*" in report.markdown([outcome]) for form in FORMS)


def drifts(scratch: Path):
    """The worst of the unit test's lines for each law; none at all is a failure."""
    (scratch / "log.txt").write_text(
        "Note: nothing\n2-D neo_hookean  strain 0.0001: det F 9e-12, pressure 3e-07, deviator 1e-09, det 2e-08\n"
        "2-D neo_hookean  (plane stress) strain 0.03: det F 1e-2, pressure 5e-10, deviator 2e-11, det 1e-14\n")
    volume, stress = rotation.check_tool(rotation.POINT, scratch)
    assert volume.value == 1e-2 and not volume.passed and stress.value == 3e-7 and stress.passed
    (scratch / "log.txt").write_text("")
    assert not rotation.check_tool(rotation.POINT, scratch)[0].passed


def validate(*arguments) -> subprocess.CompletedProcess:
    command = [ROOT / "scripts" / "validate", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300 * PATIENCE, check=False)


def whole_command(cairn: Path, scratch: Path):
    """A problem is run, kept for the next call, and made again with another program; a failure is the exit code."""
    out = scratch / "suite"
    known = ("--known", ROOT / "scripts" / "validation" / "missed.txt")
    done = validate("--quick", "--only", "bars", "--program", cairn, "--out", out, *known)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "kept" not in done.stdout, done.stdout
    results = json.loads((out / "results.json").read_text())
    missed = [check for problem in results["problems"] for check in problem["checks"] if not check["passed"]]
    assert f" {len(missed)} missed" in done.stdout, done.stdout
    # A band that is missed is an exit code of 1, unless the list of what is known names it.
    bare = validate("--quick", "--only", "bars", "--program", cairn, "--out", out)
    assert bare.returncode == (1 if missed else 0), bare.stdout
    assert (out / "pictures" / "bars.png").is_file() and "| contact lasts" in (out / "results.md").read_text()
    assert validate("--quick", "--only", "bars", "--program", cairn, "--out", out).stdout.count(": kept") == 2
    other = scratch / "other"
    shutil.copy(cairn, other)
    with open(other, "ab") as program:
        program.write(b"\0")
    assert ": kept" not in validate("--quick", "--only", "bars", "--program", other, "--out", out).stdout
    broken = scratch / "broken"
    broken.write_text("#!/bin/sh\necho 'no such luck' >&2\nexit 3\n")
    broken.chmod(0o755)
    done = validate("--quick", "--only", "bars", "--program", broken, "--out", scratch / "failed")
    assert done.returncode == 1 and "run failed" in done.stdout and "no such luck" in done.stdout, done.stdout
    done = validate("--only", "bans", "--program", cairn)
    assert done.returncode == 2 and "invalid choice: 'bans'" in done.stderr, done.stderr


def main():
    cairn, scratch = Path(sys.argv[1]), fresh_folder(sys.argv[2])
    bands()
    papers_formulas()
    dropped_sphere()
    waves_and_impacts()
    tables(scratch)
    other_forms()
    drifts(scratch)
    whole_command(cairn, scratch)


if __name__ == "__main__":
    main()
