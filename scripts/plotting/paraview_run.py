"""Loads a run into ParaView: material points, grains as spheres with their stress, contacts as tubes.

Run by scripts/paraview, in ParaView or pvpython; what it reads besides the run's own files, scripts/export has written.
"""

import argparse
import math
import os
import sys
from pathlib import Path

from paraview.simple import (  # what ParaView 5.11 and later have
    Calculator, ColorBy, CreateView, CSVReader, GetActiveView, GetAnimationScene, GetColorTransferFunction, GetScalarBar, Glyph,
    OpenDataFile, PVDReader, ResetCamera, SaveScreenshot, SaveState, Show, TableToPoints, ThresholdTable)

UNITS = {"stress": "Pa", "stress_smooth": "Pa", "velocity": "m/s", "pressure": "Pa", "force": "N"}


def load(run: Path, value: str) -> dict:
    """The pipeline's ends by name: points, grains, contacts (where there are any)."""
    view = GetActiveView() or CreateView("RenderView")
    made = {}
    index = run / "particles.hdf.series"
    if not index.is_file():
        sys.exit(f"paraview: {index} is not there (see output.particles)")
    made["points"] = OpenDataFile(str(index))
    made["points"].UpdatePipelineInformation()
    table = run / "export" / "grains.csv"
    rows = CSVReader(FileName=[str(table)])
    # The table holds all outputs: the last is shown.
    last = int(table.read_text(encoding="utf-8").splitlines()[-1].split(",")[0])
    rows = ThresholdTable(Input=rows, Column=["ROWS", "step"], MinValue=last, MaxValue=last)
    grains = TableToPoints(Input=rows, XColumn="x", YColumn="y", ZColumn="z", KeepAllDataArrays=1)
    pressure = Calculator(Input=grains, ResultArrayName="pressure", Function="-(stress_xx+stress_yy+stress_zz)/3")
    made["grains"] = Glyph(Input=pressure, GlyphType="Sphere", ScaleArray=["POINTS", "radius"], ScaleFactor=2.0, GlyphMode="All Points")
    made["grains"].GlyphType.ThetaResolution = made["grains"].GlyphType.PhiResolution = 24
    lines = run / "export" / "contacts.pvd"
    if lines.is_file():
        made["contacts"] = PVDReader(FileName=str(lines))
    return show(view, made, value)


def show(view, made: dict, value: str) -> dict:
    """Points in colours of a value, grains as faint spheres, contacts as lines as thick as they are strong."""
    GetAnimationScene().UpdateAnimationUsingDataTimeSteps()
    view.ViewTime = made["points"].TimestepValues[-1]
    points = Show(made["points"], view)
    points.SetRepresentationType("Point Gaussian")
    points.GaussianRadius = 0.4 * apart(made["points"])
    names = made["points"].PointData.keys()
    if value not in names:
        sys.exit(f"paraview: there is no '{value}'; there are {', '.join(names)}")
    components = made["points"].PointData[value].GetNumberOfComponents()
    ColorBy(points, ("POINTS", value, "Magnitude") if components > 1 else ("POINTS", value))
    points.RescaleTransferFunctionToDataRange(True, False)
    GetColorTransferFunction(value).ApplyPreset("Viridis (matplotlib)", True)
    label(view, points, value, f"norm of {value}" if components > 1 else value, [0.87, 0.55])
    made["grains"].UpdatePipeline()
    spheres = Show(made["grains"], view)
    spheres.Opacity = 0.25
    ColorBy(spheres, ("POINTS", "pressure"))
    spheres.RescaleTransferFunctionToDataRange(True, False)
    label(view, spheres, "pressure", "pressure of bodies", [0.87, 0.1])
    if "contacts" in made:
        lines = Show(made["contacts"], view)
        lines.LineWidth = 3
        ColorBy(lines, ("CELLS", "force"))
    return made


def apart(source) -> float:
    """About how far points are from each other [m]."""
    source.UpdatePipeline()
    data = source.GetDataInformation()
    bounds = data.GetBounds()
    sides = [high - low for low, high in zip(bounds[::2], bounds[1::2]) if high > low]
    return (math.prod(sides) / max(1, data.GetNumberOfPoints())) ** (1 / max(1, len(sides)))


def label(view, shown, value: str, title: str, place: list) -> None:
    """A narrow scale at the right edge, with its unit."""
    shown.SetScalarBarVisibility(view, True)
    bar = GetScalarBar(GetColorTransferFunction(value), view)
    bar.Title, bar.ComponentTitle = f"{title} ({UNITS[value]})" if value in UNITS else title, ""
    bar.WindowLocation, bar.Position, bar.ScalarBarLength = "Any Location", place, 0.35
    bar.TitleFontSize, bar.LabelFontSize, bar.ScalarBarThickness = 12, 12, 14


def main() -> None:
    parser = argparse.ArgumentParser(prog="scripts/paraview", description=__doc__)
    parser.add_argument("run", type=Path, metavar="RUN_DIR")
    parser.add_argument("--picture", metavar="FILE.png", help="draw the last output without a display")
    parser.add_argument("--state", metavar="FILE.pvsm", help="save the pipeline")
    parser.add_argument("--value", default="stress", help="of the points' colours (stress: its norm)")
    inside = os.environ.get("CAIRN_RUN")
    options = parser.parse_args([inside] if inside else None)
    made = load(options.run.resolve(), options.value)
    size = [1200, 900]
    if options.picture:
        GetActiveView().ViewSize = size
    if options.picture or inside:
        ResetCamera()
    if options.picture:
        SaveScreenshot(options.picture, ImageResolution=size, OverrideColorPalette="WhiteBackground")
    if options.state:
        SaveState(options.state)
    for name, source in made.items():
        source.UpdatePipeline()
        data = source.GetDataInformation()
        print(f"  {name}: {data.GetNumberOfPoints()} points, {data.GetNumberOfCells()} cells")


main()
