"""Files of shapes and grains that other programs write are read with the right bodies: tifffile, tiffcp, nibabel, teem's unu,
VTK, meshio, Gmsh, admesh, ezdxf, matplotlib, ASE; each where it is installed.

    test_other_tools.py CAIRN SCRATCH
"""

import importlib
import math
import shutil
import subprocess
import sys

import numpy as np
import shape_files as make
import test_shapes as surface_files
from harness import PATIENCE, ROOT, Program, expect, fresh_folder, run_tests

sys.path.insert(0, str(ROOT / "scripts"))
sys.dont_write_bytecode = True
from converting import images  # noqa: E402  pylint: disable=wrong-import-position


def library(name: str):
    try:
        return importlib.import_module(name)
    except ImportError:
        print(f"{name}: skipped, it is not there")
        return None


def tool(name: str, *arguments, given: bytes | None = None) -> bool:
    """Runs a program; false, with a word, where there is none."""
    if shutil.which(name) is None:
        print(f"{name}: skipped, it is not there")
        return False
    done = subprocess.run([name, *map(str, arguments)], input=given, capture_output=True, timeout=60 * PATIENCE, check=False)
    expect(done.returncode == 0, f"{name}: {done.stderr.decode(errors='replace')}")
    return True


def expect_same(file, voxels, spacing=None):
    read = images.read(str(file))
    expect(read.voxels.shape == voxels.shape and (read.voxels == voxels).all(), f"{file.name}: other voxels, {read.voxels.shape}")
    if spacing is not None:
        expect(np.allclose(read.spacing, spacing, rtol=1e-6), f"{file.name}: spacing {read.spacing}")


def test_tiff(_, here):
    voxels = make.labels((48, 32, 6))
    tifffile = library("tifffile")
    if tifffile:
        kinds = {"plain": {}, "tiled": {"tile": (16, 16)}, "big": {"bigtiff": True}, "deflate": {"compression": "zlib"},
                 "motorola": {"byteorder": ">"}, "imagej": {"imagej": True}}
        for name, options in kinds.items():
            tifffile.imwrite(here / f"{name}.tif", voxels, photometric="minisblack", **options)
            expect_same(here / f"{name}.tif", voxels)
        for kind in (np.uint8, np.int16, np.int32, np.uint32):
            file = here / f"{np.dtype(kind).name}.tif"
            tifffile.imwrite(file, (voxels % 200).astype(kind), photometric="minisblack")
            expect_same(file, voxels % 200)
        for packing in ("none", "lzw", "zip", "packbits"):
            if tool("tiffcp", "-c", packing, here / "plain.tif", here / f"by_tiffcp_{packing}.tif"):
                expect_same(here / f"by_tiffcp_{packing}.tif", voxels)
        if tool("tiffcp", "-t", "-w", 16, "-l", 16, here / "plain.tif", here / "by_tiffcp_tiles.tif"):
            expect_same(here / "by_tiffcp_tiles.tif", voxels)


def test_nifti(_, here):
    nibabel = library("nibabel")
    if not nibabel:
        return
    voxels = make.labels()
    for kind in (np.uint8, np.int16, np.uint16, np.int32, np.float32):
        image = nibabel.Nifti1Image((voxels % 200).T.astype(kind), np.diag((0.005, 0.005, 0.01, 1)))
        image.header.set_xyzt_units("mm")
        for ending in ("nii", "nii.gz"):
            file = here / f"{np.dtype(kind).name}.{ending}"
            nibabel.save(image, file)
            expect_same(file, voxels % 200, (0.005, 0.005, 0.01))
    pair = nibabel.Nifti1Pair(voxels.T.astype(np.int16), np.eye(4))
    nibabel.save(pair, here / "pair.hdr")
    expect_same(here / "pair.hdr", voxels)
    swapped = nibabel.Nifti1Image(voxels.T.astype(np.int16), np.eye(4), header=nibabel.Nifti1Header(endianness=">"))
    nibabel.save(swapped, here / "motorola.nii")
    expect_same(here / "motorola.nii", voxels)


def test_nrrd(_, here):
    voxels = make.labels()
    (here / "made.nrrd").write_bytes(make.nrrd(voxels))
    for name, encoding in (("raw.nrrd", "raw"), ("gzip.nrrd", "gzip"), ("ascii.nrrd", "ascii"), ("apart.nhdr", "raw"),
                           ("packed_apart.nhdr", "gzip")):
        if not tool("teem-unu", "save", "-f", "nrrd", "-e", encoding, "-i", here / "made.nrrd", "-o", here / name):
            return
        expect_same(here / name, voxels, (0.005, 0.005, 0.01))


def test_surfaces(cairn, here):
    points, triangles = make.sphere(24)
    right = surface_files.volume
    (here / "made.stl").write_bytes(make.binary_stl(points, triangles))
    whole = right(surface_files.check(cairn, here, surface_files.mesh("made.stl")))[0]
    files = []
    meshio = library("meshio")
    if meshio:
        mesh = meshio.Mesh(np.array(points), [("triangle", np.array(triangles))])
        for name, options in (("ascii.stl", {"binary": False}), ("binary.stl", {"binary": True}), ("ascii.ply", {"binary": False}),
                              ("binary.ply", {"binary": True}), ("plain.obj", {})):
            meshio.write(here / f"meshio_{name}", mesh, **options)
            files.append(f"meshio_{name}")
    for option, name in (("-a", "admesh_text.stl"), ("-b", "admesh_bytes.stl")):
        if tool("admesh", f"{option}{here / name}", here / "made.stl"):
            files.append(name)
    (here / "ball.geo").write_text('SetFactory("OpenCASCADE");\nSphere(1) = {0, 0, 0, 1};\nPhysical Volume("ball") = {1};\n'
                                   "Mesh.MeshSizeMax = 0.2;\n")
    for ending, options in (("stl", ["-2", "-save_all"]), ("msh", ["-3", "-format", "msh41"]), ("2.msh", ["-3", "-format", "msh22"])):
        if not tool("gmsh", *options, here / "ball.geo", "-o", here / f"gmsh.{ending}"):
            continue
        if ending.endswith("msh"):
            done = surface_files.cells(here / f"gmsh.{ending}", "-o", here / f"gmsh_{ending}.obj")
            expect(done.returncode == 0 and "1 cell" in done.stdout, done.stderr)
        files.append("gmsh.stl" if ending == "stl" else f"gmsh_{ending}.obj")
    for name in files:
        found = right(surface_files.check(cairn, here, surface_files.mesh(name)))[0]
        if name.startswith("gmsh"):
            expect(abs(found / (4 / 3 * math.pi) - 1) < 0.02, f"{name}: volume {found}")
        else:
            expect(abs(found / whole - 1) < 1e-5, f"{name}: volume {found} instead of {whole}")


def test_outlines(cairn, here):
    ezdxf = library("ezdxf")
    if not ezdxf:
        return
    for version in ("R12", "R2000", "R2004", "R2010", "R2018"):
        drawing = ezdxf.new(version)
        space = drawing.modelspace()
        space.add_line((0, 0), (20, 0)), space.add_line((20, 20), (20, 0))
        ends = [(20, 20), (0, 20), (0, 0)]
        if version == "R12":
            space.add_polyline2d(ends)
        else:
            space.add_lwpolyline(ends)
        space.add_circle((10, 10), 5)
        name = f"{version}.dxf"
        drawing.saveas(here / name)
        found = surface_files.volume(surface_files.check(cairn, here, f'type = "outline", file = "{name}", unit = "m"', surface_files.HEAD_2D))[0]
        expect(abs(found / (400 - math.pi * 25) - 1) < 2e-3, f"{name}: area {found}")


def vtk_image(vtk, voxels):
    from vtkmodules.util.numpy_support import numpy_to_vtk  # pylint: disable=import-outside-toplevel
    image = vtk.vtkImageData()
    image.SetDimensions(*voxels.shape[::-1])
    image.SetSpacing(0.005, 0.005, 0.01)
    values = numpy_to_vtk(voxels.ravel(), deep=True)
    values.SetName("labels")
    image.GetPointData().SetScalars(values)
    return image


def by_vtk(writer, data, file, *settings):
    """Writes data to a file by a writer of VTK's, after calls of its methods."""
    writer.SetInputData(data)
    writer.SetFileName(str(file))
    for name, *values in settings:
        getattr(writer, name)(*values)
    writer.Write()
    expect(file.exists(), f"VTK did not write {file.name}")


XML_FORMS = {"text": [("SetDataModeToAscii",)], "base64": [("SetDataModeToBinary",)],
             "plain64": [("SetDataModeToBinary",), ("SetCompressorTypeToNone",)],
             "appended": [("SetDataModeToAppended",), ("EncodeAppendedDataOff",)],
             "appended64": [("SetDataModeToAppended",), ("EncodeAppendedDataOn",), ("SetHeaderTypeToUInt64",)],
             "motorola": [("SetDataModeToAppended",), ("SetByteOrderToBigEndian",)]}


def test_volumes_of_vtk(_, here):
    vtk = library("vtk")
    if not vtk:
        return
    voxels = make.labels().astype(np.uint16)
    image = vtk_image(vtk, voxels)
    for name, settings in XML_FORMS.items():
        by_vtk(vtk.vtkXMLImageDataWriter(), image, here / f"{name}.vti", *settings)
        expect_same(here / f"{name}.vti", voxels, (0.005, 0.005, 0.01))
    for name, packed in (("apart.mhd", True), ("whole.mha", True), ("plain.mhd", False), ("plain.mha", False)):
        by_vtk(vtk.vtkMetaImageWriter(), image, here / name, ("SetCompression", packed))
        expect_same(here / name, voxels, (0.005, 0.005, 0.01))
    by_vtk(vtk.vtkNIFTIImageWriter(), image, here / "vtk.nii.gz")
    expect_same(here / "vtk.nii.gz", voxels, (0.005, 0.005, 0.01))
    for name, settings in (("packbits", [("SetCompressionToPackBits",)]), ("deflate", [("SetCompressionToDeflate",)])):
        by_vtk(vtk.vtkTIFFWriter(), image, here / f"{name}.tif", *settings)
        expect_same(here / f"{name}.tif", voxels)


def test_surfaces_of_vtk(cairn, here):
    vtk = library("vtk")
    if not vtk:
        return
    ball = vtk.vtkSphereSource()
    ball.SetRadius(1)
    ball.SetThetaResolution(48), ball.SetPhiResolution(24)
    ball.Update()
    mass = vtk.vtkMassProperties()
    mass.SetInputData(ball.GetOutput())
    for name, writer, settings in (("text.stl", vtk.vtkSTLWriter(), [("SetFileTypeToASCII",)]),
                                   ("bytes.stl", vtk.vtkSTLWriter(), [("SetFileTypeToBinary",)]),
                                   ("text.ply", vtk.vtkPLYWriter(), [("SetFileTypeToASCII",)]),
                                   ("bytes.ply", vtk.vtkPLYWriter(), [("SetFileTypeToBinary",)]),
                                   ("motorola.ply", vtk.vtkPLYWriter(), [("SetDataByteOrderToBigEndian",)]),
                                   ("plain.obj", vtk.vtkOBJWriter(), [])):
        by_vtk(writer, ball.GetOutput(), here / name, *settings)
        found = surface_files.volume(surface_files.check(cairn, here, surface_files.mesh(name)))[0]
        expect(abs(found / mass.GetVolume() - 1) < 1e-5, f"{name}: volume {found} instead of {mass.GetVolume()}")


SPHERES = np.array([(0.1, 0.1, 0.1, 0.02), (0.2, 0.1, 0.15, 0.03), (0.3, 0.12, 0.1, 0.05), (0.25, 0.25, 0.25, 0.04)])


def expect_spheres(file, *options):
    """The grains of a file are SPHERES."""
    table = file.parent / f"{file.name}.csv"
    done = subprocess.run([ROOT / "scripts/convert-grains", file, "-o", table, *options], capture_output=True, text=True,
                          timeout=60 * PATIENCE, check=False)
    expect(done.returncode == 0, f"{file.name}: {done.stderr}")
    found = np.loadtxt(table, delimiter=",", skiprows=2)
    expect(found.shape == SPHERES.shape and np.allclose(found, SPHERES, rtol=1e-6), f"{file.name}: {found}")


def test_grains_of_vtk(_, here):
    vtk = library("vtk")
    if not vtk:
        return
    points, radii = vtk.vtkPoints(), vtk.vtkDoubleArray()
    radii.SetName("radius")
    for x, y, z, r in SPHERES:
        points.InsertNextPoint(x, y, z)
        radii.InsertNextValue(r)
    for data, ending, writer in ((vtk.vtkPolyData(), "vtp", vtk.vtkXMLPolyDataWriter),
                                 (vtk.vtkUnstructuredGrid(), "vtu", vtk.vtkXMLUnstructuredGridWriter)):
        data.SetPoints(points)
        data.GetPointData().AddArray(radii)
        for name, settings in XML_FORMS.items():
            by_vtk(writer(), data, here / f"{name}.{ending}", *settings)
            expect_spheres(here / f"{name}.{ending}")
        old = vtk.vtkPolyDataWriter() if ending == "vtp" else vtk.vtkUnstructuredGridWriter()
        by_vtk(old, data, here / f"{ending}.vtk", ("SetFileTypeToASCII",))
        expect_spheres(here / f"{ending}.vtk")


def test_grains_of_ase(_, here):
    ase = library("ase")
    if not ase:
        return
    from ase import io  # pylint: disable=import-outside-toplevel
    atoms = ase.Atoms("H4", positions=SPHERES[:, :3], cell=(1, 1, 1), pbc=True)
    atoms.new_array("radius", SPHERES[:, 3])
    io.write(here / "one.xyz", atoms, format="extxyz")
    io.write(here / "two.xyz", [atoms, atoms], format="extxyz")
    atoms.set_velocities(np.ones((4, 3)))
    io.write(here / "speeds.xyz", atoms, format="extxyz")
    for name in ("one.xyz", "two.xyz", "speeds.xyz"):
        expect_spheres(here / name)


def test_outlines_of_matplotlib(cairn, here):
    """Pictures of it are 4 x 3 inches here, and have 72 points to an inch."""
    if not library("matplotlib"):
        return
    import matplotlib  # pylint: disable=import-outside-toplevel
    matplotlib.use("Agg")
    from matplotlib import patches, pyplot  # pylint: disable=import-outside-toplevel
    shapes = {"ring": (patches.Annulus((2, 1.5), 1, 0.5), math.pi * 0.75), "circle": (patches.Circle((2, 1.5), 1), math.pi),
              "box": (patches.Rectangle((1, 1), 2, 1, angle=20), 2), "star": (patches.RegularPolygon((2, 1.5), 6, radius=1), 1.5 * 3**0.5),
              "ellipse": (patches.Ellipse((2, 1.5), 2, 1), math.pi / 2)}
    for name, (patch, area) in shapes.items():
        figure = pyplot.figure(figsize=(4, 3))
        figure.patch.set_visible(False)
        axes = figure.add_axes((0, 0, 1, 1))
        axes.set(xlim=(0, 4), ylim=(0, 3)), axes.axis("off")
        axes.add_patch(patch)
        figure.savefig(here / f"{name}.svg")
        pyplot.close(figure)
        found = surface_files.volume(surface_files.check(cairn, here, f'type = "outline", file = "{name}.svg", scale = {1 / 72}, '
                                                         "move = [0, 3]", surface_files.HEAD_2D))[0]
        expect(abs(found / area - 1) < 4e-3, f"{name}: area {found} instead of {area}")


def main() -> int:
    return run_tests(globals(), Program(sys.argv[1]), fresh_folder(sys.argv[2]))


if __name__ == "__main__":
    sys.exit(main())
