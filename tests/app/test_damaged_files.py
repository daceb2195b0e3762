"""Files of shapes that are cut off, emptied or changed in a bit are read, or refused in one line that names them: no
traceback, no hang, and no more memory than the file asks for.

    test_damaged_files.py CAIRN SCRATCH
"""

import argparse
import contextlib
import importlib.util
import io
import random
import resource
import signal
import sys

import h5py
import numpy as np
import shape_files as make
import test_convert_grains as grain_files
import test_shapes as surface_files
from harness import PATIENCE, ROOT, Program, expect, expect_code, fresh_folder, run_tests

sys.path.insert(0, str(ROOT / "scripts"))
sys.dont_write_bytecode = True
from converting import cells, grains, images  # noqa: E402  pylint: disable=wrong-import-position
from converting.common import InputError  # noqa: E402  pylint: disable=wrong-import-position

MEMORY = 3 << 30  # bytes of address space for the readers
SECONDS = 20  # for one file


def damaged(whole: bytes, flips: int, seed: int = 1):
    """Forms of a file, with what was done to it: cut off, emptied, a bit or a byte changed (most of them near the head)."""
    yield "emptied", b""
    for share in (0.02, 0.2, 0.5, 0.9):
        yield f"cut at {share}", whole[:int(share * len(whole))]
    yield "a byte short", whole[:-1]
    yield "zeros in the second half", whole[:len(whole) // 2] + bytes(len(whole) - len(whole) // 2)
    yield "twice", whole + whole
    dice = random.Random(seed)
    for k in range(flips):
        at = dice.randrange(len(whole) if k % 3 == 0 else min(len(whole), 400))
        bit = 1 << dice.randrange(8)
        yield f"bit {bit} of byte {at}", whole[:at] + bytes([whole[at] ^ bit]) + whole[at + 1:]
    for k in range(flips // 4):
        at = dice.randrange(min(len(whole), 400))
        yield f"byte {at} is 9", whole[:at] + b"9" + whole[at + 1:]


def hurry(*_):
    raise TimeoutError(f"took more than {SECONDS} s")


def refuse_or_read(file, read, flips: int = 60) -> int:
    """Reads all damaged forms of a file; gives how many were refused."""
    whole, refused = file.read_bytes(), 0
    signal.signal(signal.SIGALRM, hurry)
    limits = resource.getrlimit(resource.RLIMIT_AS)
    for what, content in damaged(whole, flips):
        file.write_bytes(content)
        signal.alarm(int(SECONDS * PATIENCE))
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, limits[1]))
        try:
            with contextlib.redirect_stderr(io.StringIO()):
                read(str(file))
        except InputError as error:
            refused += 1
            expect(str(file.parent) in str(error), f"{file.name}, {what}: the message names no file: {error}")
            expect("\n" not in str(error) and len(str(error)) < 500, f"{file.name}, {what}: not a line: {error}")
        except Exception as error:  # pylint: disable=broad-exception-caught
            raise AssertionError(f"{file.name}, {what}: {type(error).__name__}: {error}") from error
        finally:
            signal.alarm(0)
            resource.setrlimit(resource.RLIMIT_AS, limits)
    file.write_bytes(whole)
    expect(refused >= 3, f"{file.name}: only {refused} damaged forms are refused")
    return refused


def test_label_volumes(_, here):
    if importlib.util.find_spec("PIL") is None:
        return print("images: skipped, PIL is not there")
    from PIL import Image  # pylint: disable=import-outside-toplevel
    voxels = make.labels()
    pages = [Image.fromarray(page) for page in voxels]
    for name, packing in (("lzw.tif", "tiff_lzw"), ("plain.tif", None), ("deflate.tif", "tiff_adobe_deflate")):
        pages[0].save(here / name, save_all=True, append_images=pages[1:], compression=packing)
    Image.fromarray(voxels[8].astype(np.int32)).save(here / "slice.png")
    for name, content in (("scan.nrrd", make.nrrd(voxels)), ("scan.nii.gz", make.nifti(voxels)), ("scan.vti", make.vti(voxels)),
                          ("scan.tesr", make.tesr(voxels).encode())):
        (here / name).write_bytes(content)
    with h5py.File(here / "scan.dream3d", "w") as file:
        file["CellData/FeatureIds"] = voxels.astype(np.int32)
    make.metaimage(voxels, here), make.metaimage(voxels, here, packed=True)
    for file in sorted(here.iterdir()):
        if file.suffix not in (".raw", ".zraw"):
            refuse_or_read(file, images.read, 30 if file.suffix == ".dream3d" else 60)
    for data, head in (("scan.raw", "scan.mhd"), ("scan.zraw", "packed.mhd")):
        refused = refuse_or_read(here / data, lambda name, head=here / head: images.read(str(head)), 30)
        expect(refused >= 6, f"{data}: {refused}")


def test_grain_tables(_, here):
    options = argparse.Namespace(format="auto", columns=None, size=None, frame=-1, two=False, velocities=False, scale=1.0)

    def read(name):
        found, source = grains.read_file(name, options)
        grains.table_of(found, source, name, options)

    for name, (content, _right) in grain_files.GOOD.items():
        refuse_or_read(grain_files.write(here / name, content), read, 40)


def test_cells(_, here):
    for name, content, read in (("grains.tess", surface_files.TESS, cells.read_tess), ("parts.msh", surface_files.MSH, cells.read_msh)):
        (here / name).write_text(content)

        def of_file(path, read=read):
            with open(path, encoding="utf-8", errors="replace") as file:
                read(file.read(), path)

        refuse_or_read(here / name, of_file, 150)


def test_surfaces(cairn, here):
    """By the program itself, so with few forms of each."""
    points, triangles = make.box()
    files = {"binary.stl": make.binary_stl(points, triangles), "text.stl": make.ascii_stl("a grain", points, triangles).encode(),
             "box.obj": make.obj(points, triangles).encode(), "text.ply": make.ply(points, triangles, "ascii"),
             "little.ply": make.ply(points, triangles, "binary_little_endian"), "lines.csv": make.CSV.encode(),
             "drawing.svg": make.SVG.encode(), "drawing.dxf": make.DXF.encode()}
    for name, content in files.items():
        flat = name.startswith(("lines", "drawing"))
        shape = f'type = "{"outline" if flat else "mesh"}", file = "{name}", unit = "m"'
        refused = 0
        for what, form in damaged(content, 4):
            (here / name).write_bytes(form)
            done = surface_files.check(cairn, here, shape, surface_files.HEAD_2D if flat else surface_files.HEAD_3D)
            expect(done.code in (0, 2), f"{name}, {what}: exit code {done.code}: {done.err[-300:]}")
            if done.code == 2:
                refused += 1
                expect_code(done, 2, name)
        expect(refused >= 4, f"{name}: only {refused} are refused")


def main() -> int:
    return run_tests(globals(), Program(sys.argv[1]), fresh_folder(sys.argv[2]))


if __name__ == "__main__":
    sys.exit(main())
