"""Files of shapes that other programs write are read with the right bodies: tifffile, tiffcp, nibabel, teem's unu, meshio, Gmsh,
admesh, ezdxf; each where it is installed.

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


def main() -> int:
    return run_tests(globals(), Program(sys.argv[1]), fresh_folder(sys.argv[2]))


if __name__ == "__main__":
    sys.exit(main())
