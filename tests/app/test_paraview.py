"""Runs a small case and opens its results with ParaView: the series with its times, and every file of it.

    test_paraview.py CAIRN SCRATCH

Uses pvpython, or the vtkmodules of this Python (which open single files only). Exit code 77 where there is neither.
"""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np

from harness import ROOT

CASE = """
title = "Two disks"
[domain]
dimension = 2
lower = [0.0, 0.0]
upper = [2.0, 1.0]
cells = [20, 10]
[time]
dt = 1.0e-4
steps = 6
[contact]
law = "friction"
friction = 0.3
[materials.rubber]
model = "neo_hookean"
density = 1000.0
shear_modulus = 3.0e5
bulk_modulus = 5.0e5
[[bodies]]
shape = { type = "disk", centre = [0.7, 0.5], radius = 0.25 }
material = "rubber"
velocity = [5.0, 0.0]
[[bodies]]
shape = { type = "disk", centre = [1.3, 0.5], radius = 0.25 }
material = "rubber"
velocity = [-5.0, 0.0]
[output]
particles = { interval = 2.0e-4, fields = ["velocity", "stress", "body"] }
contacts = { interval = 2.0e-4 }
history = { every = 1 }
"""

ARRAYS = {"velocity": 3, "stress": 6, "body": 1}

# Runs inside pvpython: prints what ParaView sees of each file named, as JSON.
PARAVIEW = """
import json, sys
from paraview.simple import OpenDataFile, VTKHDFReader
from paraview import servermanager
def describe(reader, time=None):
    reader.UpdatePipeline(time) if time is not None else reader.UpdatePipeline()
    data = servermanager.Fetch(reader)
    arrays = data.GetPointData()
    found = {}
    for i in range(arrays.GetNumberOfArrays()):
        array = arrays.GetArray(i)
        sums = [sum(array.GetComponent(p, c) for p in range(data.GetNumberOfPoints()))
                for c in range(array.GetNumberOfComponents())]
        found[array.GetName()] = sums
    return dict(time=time, points=data.GetNumberOfPoints(), cells=data.GetNumberOfCells(), arrays=found,
                bounds=list(data.GetBounds()))
result = {}
for name in sys.argv[1:]:
    if name.endswith(".series"):
        reader = OpenDataFile(name)
        result[name] = [describe(reader, t) for t in reader.TimestepValues]
    else:
        result[name] = [describe(VTKHDFReader(FileName=[name]))]
print("RESULT " + json.dumps(result))
"""


def skip(reason: str):
    print(f"skipped: {reason}")
    sys.exit(77)


def run_case(cairn: str, scratch: Path) -> Path:
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir(parents=True)
    (scratch / "disks.toml").write_text(CASE)
    out = scratch / "out"
    done = subprocess.run([cairn, "run", scratch / "disks.toml", "--out", out], capture_output=True, text=True)
    assert done.returncode == 0, f"exit code {done.returncode}\n{done.stdout}\n{done.stderr}"
    return out


def expectation(path: Path) -> dict:
    """What HDF5 says is in a file."""
    with h5py.File(path, "r") as file:
        points = file["position"][()]
        return {
            "time": float(file.attrs["time"]),
            "points": len(points),
            "bounds": np.stack([points.min(axis=0), points.max(axis=0)], axis=1).ravel(),
            "arrays": {name: np.asarray(file[name][()], float).reshape(len(points), -1).sum(axis=0) for name in ARRAYS},
        }


def compare(what: str, seen: dict, expected: dict):
    assert seen["points"] == seen["cells"] == expected["points"] > 0, f"{what}: {seen['points']} points"
    assert np.array_equal(seen["bounds"], expected["bounds"]), f"{what}: bounds {seen['bounds']}"
    for name, width in ARRAYS.items():
        assert name in seen["arrays"], f"{what}: no array {name}, only {sorted(seen['arrays'])}"
        assert len(seen["arrays"][name]) == width, f"{what}: {name} has {len(seen['arrays'][name])} components"
        scale = 1e-9 * max(1.0, np.abs(expected["arrays"][name]).max())
        alike = np.allclose(seen["arrays"][name], expected["arrays"][name], rtol=0, atol=scale)
        assert alike, f"{what}: the values of {name} differ"


def check_index(out: Path, files: list[Path], expected: list[dict]) -> Path:
    index = out / "particles.hdf.series"
    entries = json.loads(index.read_text())["files"]
    assert [entry["name"] for entry in entries] == [path.name for path in files], entries
    assert [entry["time"] for entry in entries] == [e["time"] for e in expected], entries
    return index


def see_with_paraview(pvpython: str, scratch: Path, index: Path, files: list[Path]) -> dict:
    script = scratch / "describe.py"
    script.write_text(PARAVIEW)
    names = [str(index)] + [str(path) for path in files]
    done = subprocess.run([pvpython, "--force-offscreen-rendering", script, *names], capture_output=True, text=True)
    lines = [line for line in done.stdout.splitlines() if line.startswith("RESULT ")]
    assert done.returncode == 0 and lines, f"pvpython failed\n{done.stdout}\n{done.stderr}"
    return json.loads(lines[-1].removeprefix("RESULT "))


def see_with_vtk(files: list[Path]) -> dict:
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOHDF import vtkHDFReader

    seen = {}
    for path in files:
        reader = vtkHDFReader()
        reader.SetFileName(str(path))
        reader.Update()
        data = reader.GetOutputDataObject(0)
        arrays = {}
        for i in range(data.GetPointData().GetNumberOfArrays()):
            array = data.GetPointData().GetArray(i)
            values = vtk_to_numpy(array).astype(float).reshape(data.GetNumberOfPoints(), -1)
            arrays[array.GetName()] = values.sum(axis=0)
        seen[str(path)] = [{"points": data.GetNumberOfPoints(), "cells": data.GetNumberOfCells(), "arrays": arrays,
                            "bounds": data.GetBounds()}]
    return seen


def check_script(out: Path, scratch: Path, points: int) -> None:
    """scripts/paraview loads points, bodies and contacts, draws them without a display, and saves the pipeline."""
    picture, state = scratch / "paraview.png", scratch / "run.pvsm"
    command = [ROOT / "scripts" / "paraview", out, "--picture", picture, "--state", state]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"scripts/paraview failed\n{done.stdout}\n{done.stderr}"
    assert f"points: {points} points" in done.stdout, done.stdout
    spheres = re.search(r"grains: (\d+) points", done.stdout)
    assert spheres and int(spheres[1]) > 2 * 20 and "contacts: " in done.stdout, f"not two spheres\n{done.stdout}"
    assert picture.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n" and picture.stat().st_size > 5000, "no picture was drawn"
    assert "ThresholdTable" in state.read_text(), "the pipeline was not saved"


def check_lines(out: Path) -> None:
    """Contacts as scripts/export writes them are read as lines with their force (VTK)."""
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

    subprocess.run([ROOT / "scripts" / "export", out, "--form", "vtp"], check=True, stdout=subprocess.DEVNULL)
    for path in sorted((out / "export").glob("contacts_*.vtp")):
        reader = vtkXMLPolyDataReader()
        reader.SetFileName(str(path))
        reader.Update()
        data = reader.GetOutput()
        lines = data.GetNumberOfLines()
        assert data.GetNumberOfPoints() == 3 * lines, f"{path.name}: {data.GetNumberOfPoints()} points, {lines} lines"
        assert lines == 0 or data.GetCellData().GetArray("force").GetNumberOfTuples() == lines, f"{path.name}: no forces"


def has_vtk() -> bool:
    try:
        import vtkmodules.vtkIOHDF  # noqa: F401
    except ImportError:
        return False
    return True


def main(cairn: str, scratch: Path):
    pvpython = shutil.which("pvpython")
    if not pvpython and not has_vtk():
        skip("neither pvpython (package paraview) nor Python's vtkmodules (package python3-vtk9) is installed")
    out = run_case(cairn, scratch)
    files = sorted(out.glob("particles_*.vtkhdf"))
    assert len(files) >= 3, f"expected a file at each of 0, 2e-4, 4e-4 s, found {[path.name for path in files]}"
    expected = [expectation(path) for path in files]
    index = check_index(out, files, expected)
    seen = see_with_paraview(pvpython, scratch, index, files) if pvpython else see_with_vtk(files)
    for path, e in zip(files, expected):
        compare(path.name, seen[str(path)][0], e)
    if pvpython:
        series = seen[str(index)]
        assert [s["time"] for s in series] == [e["time"] for e in expected], f"times {[s['time'] for s in series]}"
        for s, e in zip(series, expected):
            compare(f"series at {e['time']} s", s, e)
        if shutil.which("xvfb-run") or os.environ.get("DISPLAY"):
            check_script(out, scratch, expected[-1]["points"])
        else:
            print("there is neither a display nor xvfb-run (Debian: xvfb, xauth): scripts/paraview was not run")
    if has_vtk():
        check_lines(out)
    reader = "ParaView" if pvpython else "VTK"
    print(f"{len(files)} files, {expected[0]['points']} points: seen alike by {reader} and HDF5")


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]))
