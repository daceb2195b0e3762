"""Shapes from files: surfaces, outlines and labels of every kind that docs/shapes.md names, and their broken forms.

    test_shapes.py CAIRN SCRATCH
"""

import importlib.util
import math
import re
import subprocess
import sys

import h5py
import numpy as np
import shape_files as make
from harness import PATIENCE, ROOT, Program, expect, expect_code, fresh_folder, run_tests

HEAD_3D = """
domain = { dimension = 3, lower = [-2, -2, -2], upper = [2, 2, 2], cells = 32 }
time = { steps = 3 }
materials.soft = { model = "neo_hookean", density = 1e3, shear_modulus = 1e5, bulk_modulus = 1e5 }
"""
HEAD_2D = HEAD_3D.replace("dimension = 3, lower = [-2, -2, -2], upper = [2, 2, 2]", "lower = [-30, -30], upper = [30, 30]")


def check(cairn, here, shape, head=HEAD_3D):
    """`cairn check` of a case with one body of this shape."""
    (here / "case.toml").write_text(f'{head}bodies = [{{ shape = {{ {shape} }}, material = "soft" }}]\n')
    return cairn("check", here / "case.toml")


def volume(done):
    expect(done.code == 0, f"{done.code} {done.err}")
    found = re.search(r"volume ([-+.0-9e]+) m[23], (.*), thinnest part ([.0-9e+]+) cells", done.out)
    expect(found, f"no volume in\n{done.out}")
    return float(found[1]), found[2], float(found[3])


def mesh(name, more='unit = "m"'):
    return f'type = "mesh", file = "{name}", {more}'


def test_surfaces_of_every_kind(cairn, here):
    points, triangles = make.sphere(40)
    corners, quads = make.box((1, 2, 1.5), (-0.5, -1, -1)), make.BOX_QUADS
    files = {"binary.stl": make.binary_stl(points, triangles), "text.stl": make.ascii_stl("a grain", points, triangles).encode(),
             "sphere.obj": make.obj(points, triangles).encode(), "text.ply": make.ply(points, triangles, "ascii"),
             "little.ply": make.ply(points, triangles, "binary_little_endian"),
             "big.ply": make.ply(points, triangles, "binary_big_endian")}
    for name, content in files.items():
        (here / name).write_bytes(content)
        found, box, thin = volume(check(cairn, here, mesh(name)))
        expect(abs(found / (4 / 3 * math.pi) - 1) < 0.005, f"{name}: volume {found}")
        expect(box.startswith("[-0.99") or box.startswith("[-1, -1, -1]"), f"{name}: {box}")
        expect(abs(thin - 16) < 0.3, f"{name}: thinnest {thin}")
    for name, content in (("box.obj", make.obj(corners[0], quads).encode()), ("box.ply", make.ply(corners[0], quads, "ascii"))):
        (here / name).write_bytes(content)
        expect(abs(volume(check(cairn, here, mesh(name)))[0] - 3) < 1e-5, name)
    found, box, _ = volume(check(cairn, here, mesh("box.obj", 'unit = "mm", scale = 500, move = [1, 0, 0], rotate = [0, 0, 1.5707963267948966]')))
    expect(abs(found - 3 * 0.125) < 1e-6 and box == "[0.5, -0.25, -0.5] to [1.5, 0.25, 0.25]", f"{found} {box}")


def test_several_solids_one_open(cairn, here):
    text = (make.ascii_stl("part one", *make.box((10, 20, 30)), end="\r\n")
            + make.ascii_stl("bucket", *make.box((10, 10, 10), (40, 0, 0), lid=False), end="\r\n"))
    (here / "two.stl").write_bytes(text.encode())
    done = check(cairn, here, mesh("two.stl", 'unit = "mm", scale = 20'))
    expect_code(done, 2, '"bucket" (line 87)', "4 open edges", "near [", "holes =")
    found, _, thin = volume(check(cairn, here, mesh("two.stl", 'unit = "mm", scale = 20, solid = "part one"')))
    expect(abs(found - 6000e-9 * 8000) < 1e-6 and abs(thin - 0.2 / 0.125) < 0.01, f"{found} {thin}")
    expect(abs(volume(check(cairn, here, mesh("two.stl", 'unit = "mm", scale = 20, solid = "#0"')))[0] - 0.048) < 1e-6, "by number")
    expect_code(check(cairn, here, mesh("two.stl", 'unit = "mm", solid = "lid"')), 2, '"lid" is not in the file', '#1 "bucket"')
    done = check(cairn, here, mesh("two.stl", 'unit = "mm", scale = 20, solid = "bucket", holes = 0.3'))
    expect("open edges, whose holes are closed" in done.err, done.err)
    expect(abs(volume(done)[0] - 1000e-9 * 8000) < 2e-3, "the bucket")
    expect_code(check(cairn, here, mesh("two.stl", 'solid = "part one"')), 2, "unit", "is missing")


def test_what_is_mended_is_said(cairn, here):
    points, triangles = make.sphere(12)
    turned = [t[::-1] if i % 9 == 0 else t for i, t in enumerate(triangles)]
    (here / "turned.stl").write_bytes(make.binary_stl(points, turned + turned[:1]))
    done = check(cairn, here, mesh("turned.stl"))
    for words in ("turned against their neighbours", "there twice", "near ["):
        expect(words in done.err, done.err)
    right = volume(done)[0]
    (here / "inwards.stl").write_bytes(make.binary_stl(points, [t[::-1] for t in triangles]))
    done = check(cairn, here, mesh("inwards.stl"))
    expect("normals point inwards" in done.err and abs(volume(done)[0] / right - 1) < 1e-6, done.err)
    other, more = make.sphere(12, 0.7, (0.9, 0, 0))
    (here / "crossing.stl").write_bytes(make.binary_stl(points + other, triangles + [tuple(len(points) + c for c in t) for t in more]))
    expect("pass through each other" in check(cairn, here, mesh("crossing.stl")).err, "crossings are not said")


def test_broken_surfaces(cairn, here):
    points, triangles = make.box()
    whole, text = make.binary_stl(points, triangles), make.ascii_stl("a", points, triangles)
    bad = {"cut.stl": (whole[:-7], "cut off"), "cut_text.stl": (text[:len(text) // 2].encode(), ":44: "),
           "word.stl": (text.replace("outer loop", "outer lop", 1).encode(), ':3: "lop" where'),
           "number.stl": (text.replace("vertex 1", "vertex 1,", 1).encode(), "is not a finite number"),
           "nan.stl": (whole[:84 + 50 + 12] + b"\0\0\xc0\x7f" + whole[84 + 50 + 16:], "facet 1 (byte 134)"),
           "face.obj": (make.obj(points, triangles).replace("f 1//1", "f 99//1", 1).encode(), "names vertex 99"),
           "word.obj": (b"v 0 0 0\nthe end\n", ':2: "the" is no word'), "empty.stl": (b"", "holds no solid"),
           "cut.ply": (make.ply(points, triangles, "binary_little_endian")[:-3], "face 11: the file ends"),
           "index.ply": (make.ply(points, triangles, "ascii").replace(b"3 0 2 3", b"3 0 2 8"), "names vertex 8"),
           "head.ply": (b"ply\nformat ascii 1.0\nelement vertex 3\n", "does not end"), "flat.stl": (make.binary_stl(points, [(0, 0, 1)]), "an area")}
    for name, (content, words) in bad.items():
        (here / name).write_bytes(content)
        expect_code(check(cairn, here, mesh(name)), 2, name, words)
    expect_code(check(cairn, here, mesh("none.stl")), 2, "there is no file")


def test_outlines(cairn, here):
    for name, content in (("lines.csv", make.CSV), ("drawing.svg", make.SVG), ("drawing.dxf", make.DXF)):
        (here / name).write_text(content)
        found, box, thin = volume(check(cairn, here, f'type = "outline", file = "{name}", unit = "m"', HEAD_2D))
        right = 400 - (math.pi * 25 if name.endswith("dxf") else 100)
        expect(abs(found / right - 1) < 2e-3, f"{name}: {found}")
        expect(box == ("[10, 10] to [30, 30]" if name.endswith("svg") else "[0, 0] to [20, 20]"), f"{name}: {box}")
        expect(abs(thin - 5 / 1.875) < 0.3, f"{name}: {thin}")
    unseen = '<defs><g><rect width="50" height="50"/></g></defs><clipPath id="a"/><symbol><circle r="99"/></symbol>'
    (here / "unseen.svg").write_text(make.SVG.replace("<g ", unseen + "<g ", 1))
    expect(abs(volume(check(cairn, here, 'type = "outline", file = "unseen.svg", unit = "m"', HEAD_2D))[0] - 300) < 0.6, "unseen.svg")
    bad = {"use.svg": (make.SVG.replace("</g>", '<use href="#a"/></g>'), ":4: <use> is not read"), "open.svg": (make.SVG.replace(" z", ""), ":4: a path is not closed"), "open.dxf": (make.DXF.replace("21\n0\n0\nLWP", "21\n1\n0\nLWP"), "close it"),
           "spline.dxf": (make.DXF.replace("CIRCLE", "SPLINE"), "SPLINE is not read"), "cross.csv": ("0,0\n2,2\n2,0\n0,2\n", "cross or touch"),
           "number.csv": ("x,y\n0,0\n1,q\n1,1\n", ':3: y: "q"'), "cut.svg": (make.SVG[:150], "cut off")}
    for name, (content, words) in bad.items():
        (here / name).write_text(content)
        expect_code(check(cairn, here, f'type = "outline", file = "{name}", unit = "m"', HEAD_2D), 2, name, words)


TESS = """***tess
 **format
   3.5
 **general
   2 standard
 **cell
  2
  *id
   4 9
 **vertex
 6
   1 0 0 0 0
   2 10 -0.000000 0 0
   3 20 0 0 0
   4 20 12 0 0
   5 10 12 0 0
   6 0 12 0 0
 **edge
 0
 **face
 2
   1 4 1 2 5 6
     4 1 2 3 4
     0 0 0 1
     0 -1 0 0 0
   2 4 2 3 4 5
     4 5 6 7 -2
     0 0 0 1
     0 -1 0 0 0
***end
"""
MSH = """$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
2
3 1 "low grain"
3 2 "high"
$EndPhysicalNames
$Nodes
5
1 0 0 0
2 1 0 0
3 0 1 0
4 0 0 1
5 1 1 1
$EndNodes
$Elements
3
1 2 2 7 7 1 2 3
2 4 2 1 1 1 2 3 4
3 4 2 2 2 2 3 4 5
$EndElements
"""


def cells(*arguments):
    command = [sys.executable, ROOT / "scripts" / "convert-cells", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120 * PATIENCE, check=False)


def volumes(done):
    expect(done.code == 0, f"{done.code} {done.err}")
    return [float(v) for v in re.findall(r"volume ([-+.0-9e]+) m[23]", done.out)]


def test_cells(cairn, here):
    (here / "grains.tess").write_text(TESS)
    (here / "parts.msh").write_text(MSH)
    for source, out, shape, head, right in (
            ("grains.tess", "grains.csv", 'type = "outline", line = "each"', HEAD_2D, [120, 120]),
            ("parts.msh", "parts.obj", 'type = "mesh", solid = "each"', HEAD_3D, [1 / 6, 1 / 3])):
        done = cells(here / source, "-o", here / out)
        expect(done.returncode == 0 and "2 cells" in done.stdout, f"{source}: {done.stderr}")
        found = volumes(check(cairn, here, f'{shape}, file = "{out}", unit = "m"', head))
        expect(np.allclose(found, right, rtol=1e-5), f"{source}: {found}")
    one = check(cairn, here, 'type = "mesh", solid = "low grain", file = "parts.obj", unit = "m"')
    expect(np.allclose(volumes(one), 1 / 6, rtol=1e-5), one.out)
    expect_code(check(cairn, here, 'type = "union", of = [{ type = "mesh", solid = "each", file = "parts.obj", unit = "m" }]'), 2,
                "stands for each")
    bad = {"cut.tess": (TESS[:300], "cut off"), "vertex.tess": (TESS.replace("4 1 2 5 6", "4 1 2 5 8"), "names a vertex"),
           "cut.msh": (MSH[:200], "cut off"), "node.msh": (MSH.replace("2 3 4 5\n$End", "2 3 4 6\n$End"), "names node 6"), "text.tess": ("hello", "neither")}
    for name, (text, words) in bad.items():
        (here / name).write_text(text)
        done = cells(here / name, "-o", here / "new.obj")
        expect(done.returncode == 2 and words in done.stderr and not (here / "new.obj").exists(), f"{name}: {done.stderr}")
    if not has_scipy():
        return print("Voronoi cells: skipped, scipy is not there")
    for size, out, shape, head, scale in (("1,1", "v.csv", 'type = "outline", line = "each"', HEAD_2D, 20),
                                          ("1,1,1", "v.obj", 'type = "mesh", solid = "each"', HEAD_3D, 1)):
        filled = []
        for options in ([], ["--gap", "0.02"], ["--gap", "0.02", "--round", "0.02"]):
            done = cells("--voronoi", 8, "--size", size, "-o", here / out, *options)
            expect(done.returncode == 0, done.stderr)
            filled.append(sum(volumes(check(cairn, here, f'{shape}, file = "{out}", scale = {scale}', head))) / scale ** (2 if scale > 1 else 3))
        expect(abs(filled[0] - 1) < 1e-5 and 0.7 < filled[1] < 0.99 and filled[1] * 0.9 < filled[2] < filled[1], f"{size}: {filled}")


def has_scipy():
    return importlib.util.find_spec("scipy") is not None


def convert(*arguments):
    command = [sys.executable, ROOT / "scripts" / "convert-labels", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120 * PATIENCE, check=False)


def test_labels_of_every_kind(_, here):
    if not has_scipy():
        return print("labels: skipped, scipy is not there")
    from PIL import Image  # pylint: disable=import-outside-toplevel
    voxels = make.labels()
    counts = {int(v): int((voxels == v).sum()) for v in (3, 9, 700)}
    pages = [Image.fromarray(page) for page in voxels]
    pages[0].save(here / "pages.tif", save_all=True, append_images=pages[1:], compression="tiff_lzw")
    (here / "slices").mkdir()
    for i, page in enumerate(voxels):
        Image.fromarray(page.astype(np.int32)).save(here / "slices" / f"slice{i}.png")
    for name, content in (("scan.nrrd", make.nrrd(voxels)), ("scan.nii.gz", make.nifti(voxels)), ("scan.vti", make.vti(voxels)),
                          ("scan.tesr", make.tesr(voxels).encode()), ("bytes.raw", voxels.astype(">u2").tobytes())):
        (here / name).write_bytes(content)
    with h5py.File(here / "scan.dream3d", "w") as file:
        file["DataContainers/Image/CellData/FeatureIds"] = voxels.astype(np.int32)[..., None]
        file["DataContainers/Image/_SIMPL_GEOMETRY/SPACING"] = np.array([0.005, 0.005, 0.01], np.float32)
        file["DataContainers/Image/_SIMPL_GEOMETRY/ORIGIN"] = np.zeros(3, np.float32)
    spacing = ["--spacing", "0.005,0.005,0.01", "--unit", "mm"]
    kinds = {make.metaimage(voxels, here): ["--unit", "mm"], make.metaimage(voxels, here, packed=True): ["--unit", "mm"],
             here / "pages.tif": spacing, here / "slices": spacing, here / "scan.nrrd": ["--unit", "mm"], here / "scan.nii.gz": [],
             here / "scan.vti": ["--unit", "mm"], here / "scan.tesr": ["--unit", "mm"], here / "scan.dream3d": ["--unit", "mm"],
             here / "bytes.raw": [*spacing, "--shape", "24,20,16", "--type", ">u2"]}
    for source, options in kinds.items():
        out = here / "out.h5"
        done = convert(source, "-o", out, *options)
        expect(done.returncode == 0, f"{source.name}: {done.returncode} {done.stderr}")
        with h5py.File(out) as file:
            found = dict(zip(file["label"][()].tolist(), file["count"][()].tolist()))
            expect(found == counts, f"{source.name}: {found}, not {counts}")
            expect(np.array_equal(file["voxels"][()], voxels), f"{source.name}: other voxels")
            expect(np.allclose([file.attrs[f"spacing_{a}"] for a in "xyz"], [5e-6, 5e-6, 1e-5], rtol=1e-6), f"{source.name}: spacing")
        expect("1 pairs touch" in done.stdout, done.stdout)
    with h5py.File(here / "out.h5") as file:
        expect(abs(file.attrs["corner_x"]) < 1e-12, "corner")


IN_A_FILE = """
import runpy, sys
sys.path.insert(0, sys.argv[1])
from converting import scratch
scratch.SMALL = 0
sys.argv[:2] = ["convert-labels"]
runpy.run_path(sys.path[0] + "/convert-labels", run_name="__main__")
"""


def test_large_labels_are_the_same(_, here):
    """Volumes that are worked on in a file give what those in memory do."""
    if not has_scipy():
        return print("labels: skipped, scipy is not there")
    voxels = make.labels((40, 36, 70))
    voxels[33, 20, 20] = 9
    source = make.metaimage(voxels, here)
    options = ["--unit", "mm", "--split", "--crop", "0,2,1,40,36,70"]
    expect(convert(source, "-o", here / "memory.h5", *options).returncode == 0, "in memory")
    done = subprocess.run([sys.executable, "-B", "-c", IN_A_FILE, ROOT / "scripts", source, "-o", here / "file.h5", *options],
                          capture_output=True, text=True, timeout=120 * PATIENCE, check=False)
    expect(done.returncode == 0 and "dropped" in done.stderr, done.stderr)
    with h5py.File(here / "memory.h5") as a, h5py.File(here / "file.h5") as b:
        expect(sorted(a) == sorted(b) and all(np.array_equal(a[n][()], b[n][()]) for n in a), "other values")
        expect(len(a["depth"]) == 69 and a["depth"][()].max() == 255, "no depths")
    expect(not list(here.glob("tmp*")), "a file is left")


def test_labels_are_cleaned(_, here):
    if not has_scipy():
        return print("labels: skipped, scipy is not there")
    voxels = make.labels()
    voxels[15, 19, 23] = 3
    voxels[10:13, 16:19, 2:5] = 9
    source = make.metaimage(voxels, here)
    options = [source, "-o", here / "out.h5", "--unit", "mm"]
    done = convert(*options, "--picture", here / "slice.png", "--table", here / "table.csv")
    for words in ("a piece of 1 voxel at 23, 19, 15", "label 9: is in 2 pieces", "(480, 27 voxels)"):
        expect(words in done.stderr, done.stderr)
    expect((here / "slice.png").read_bytes().startswith(b"\x89PNG"), "no picture")
    expect((here / "table.csv").read_text() == "label,material\n3,grain\n9,grain\n700,grain\n", "table")
    done = convert(*options, "--split", "--smallest", "1")
    expect("5 labels" in done.stdout, done.stdout + done.stderr)
    expect("3 labels in 12 x 10 x 8 voxels" in convert(*options, "--downsample", "2").stdout, "downsample")
    expect("1 labels" in convert(*options, "--crop", "0,0,0,24,4,5").stdout, "crop")
    grey = (voxels > 0) * np.uint16(200)
    make.metaimage(grey, here)
    expect("3 labels" in convert(*options, "--threshold", "100", "--split").stdout, "threshold")
    bad = {"unit": [source, "-o", here / "new.h5"], "--crop": [*options, "--crop", "0,0,0,99,4,5"], "x.h5": [here / "x.h5", "-o", here / "new.h5"]}
    for words, arguments in bad.items():
        done = convert(*arguments)
        expect(done.returncode == 2 and words in done.stderr, f"{words}: {done.returncode} {done.stderr}")
    (here / "scan.raw").write_bytes((here / "scan.raw").read_bytes()[:-5])
    done = convert(*options)
    expect(done.returncode == 2 and "cut off" in done.stderr, done.stderr)
    (here / "mine.h5").write_text("notes\n")
    expect(convert(source, "-o", here / "mine.h5", "--unit", "mm").returncode == 2, "a file of somebody else was replaced")


LABEL_CASE = """
domain = {{ dimension = 3, upper = [1.2e-4, 1.0e-4, 1.6e-4], cells = [24, 20, 32], patch_cells = 8 }}
time = {{ steps = 4 }}
materials.soft = {{ model = "neo_hookean", density = 1e3, shear_modulus = 1e5, bulk_modulus = 1e5 }}
materials.hard = {{ model = "neo_hookean", density = 2e3, shear_modulus = 1e6, bulk_modulus = 1e6 }}
labels = [{{ file = "grains.h5", {} }}]
output = {{ history = {{ every = 1 }}, particles = {{ every = 2 }}, forces = {{ every = 1 }} }}
"""


def test_labels_become_bodies(cairn, here):
    if not has_scipy():
        return print("labels: skipped, scipy is not there")
    voxels = make.labels()
    (here / "scan.nii.gz").write_bytes(make.nifti(voxels))
    done = convert(here / "scan.nii.gz", "-o", here / "grains.h5")
    expect(done.returncode == 0, done.stderr)
    (here / "table.csv").write_text("label,material,group\n3,soft,left\n700,hard,\n9,soft,\n")
    (here / "case.toml").write_text(LABEL_CASE.format('table = "table.csv"'))
    done = cairn("check", here / "case.toml")
    expect(done.code == 0 and "labels     3 bodies" in done.out and "bodies     3 of 2 materials" in done.out, done.out + done.err)
    for ranks in (1, 2, 3):
        expect_code(cairn("run", here / "case.toml", "--out", here / f"run{ranks}", ranks=ranks), 0)
        expect(compare_folders(here / "run1", here / f"run{ranks}"), f"{ranks} ranks differ")
    with h5py.File(here / "run1" / "particles_000000.vtkhdf") as file:
        body, room, mass = file["body"][()], file["volume"][()], file["mass"][()]
    for index, (label, density) in enumerate(((3, 1e3), (9, 1e3), (700, 2e3))):
        right = (voxels == label).sum() * 2.5e-16
        expect(abs(room[body == index].sum() / right - 1) < 0.005, f"label {label}: {room[body == index].sum() / right}")
        expect(np.allclose(mass[body == index] / room[body == index], density), "density")
    # The folder runs again, wherever it is.
    (here / "run1").rename(here / "elsewhere")
    for name in ("grains.h5", "table.csv"):
        (here / name).unlink()
    expect_code(cairn("run", here / "elsewhere" / "case.toml", "--out", here / "again"), 0)
    expect(compare_folders(here / "again", here / "run2"), "the copy gives other results")


def compare_folders(a, b):
    done = subprocess.run([ROOT / "scripts" / "compare-runs", a, b], capture_output=True, text=True, timeout=60 * PATIENCE, check=False)
    if done.returncode != 0:
        print(done.stdout, done.stderr)
    return done.returncode == 0


def test_wrong_labels(cairn, here):
    if not has_scipy():
        return print("labels: skipped, scipy is not there")
    (here / "scan.nii.gz").write_bytes(make.nifti(make.labels()))
    convert(here / "scan.nii.gz", "-o", here / "grains.h5")
    whole = (here / "grains.h5").read_bytes()
    tables = {"label,material\n3,soft\n": ("label 9 has no material", "label 700"), "label,material\n3,wood\n": ('table.csv:2: material: "wood"',),
              "label;material\n": ("the header must be",), "label,material\n3,soft\n3,soft\n9,soft\n700,soft\n44,soft\n": ("there twice", "no label 44")}
    for text, words in tables.items():
        (here / "table.csv").write_text(text)
        (here / "case.toml").write_text(LABEL_CASE.format('table = "table.csv"'))
        expect_code(cairn("check", here / "case.toml"), 2, *words)
    (here / "case.toml").write_text(LABEL_CASE.format('material = "soft"'))
    expect_code(cairn("check", here / "case.toml", "--set", "labels.0.move=[1, 0, 0]"), 2, "label 3: the body lies outside")
    (here / "grains.h5").write_bytes(whole[:-500])
    expect_code(cairn("check", here / "case.toml"), 2, "grains.h5")
    with h5py.File(here / "grains.h5", "w") as file:
        file["voxels"] = np.zeros((2, 2, 2), np.uint8)
    expect_code(cairn("check", here / "case.toml"), 2, "no file of labels")


def test_touching_grains_start_without_load(cairn, here):
    """60 grains that fill a box: no energy, and no contact force until something moves."""
    if not has_scipy():
        return print("labels: skipped, scipy is not there")
    from scipy.spatial import cKDTree  # pylint: disable=import-outside-toplevel
    random = np.random.default_rng(3)
    z, y, x = np.meshgrid(*(np.arange(40) + 0.5,) * 3, indexing="ij")
    _, nearest = cKDTree(random.uniform(0, 40, (60, 3))).query(np.stack([x, y, z], axis=-1))
    (here / "scan.nii.gz").write_bytes(make.nifti((nearest + 1).astype(np.uint16)))
    done = convert(here / "scan.nii.gz", "-o", here / "grains.h5", "--spacing", "0.025", "--unit", "m")
    expect(done.returncode == 0 and "60 labels" in done.stdout, done.stderr)
    (here / "case.toml").write_text("""
domain = { dimension = 3, upper = [1, 1, 1], cells = 20, patch_cells = 8 }
time = { steps = 5 }
materials.soft = { model = "neo_hookean", density = 1e3, shear_modulus = 1e5, bulk_modulus = 1e5 }
labels = [{ file = "grains.h5", material = "soft" }]
boundary = { left = { type = "wall" }, right = { type = "wall" } }
output = { history = { every = 1 }, contacts = { every = 1 }, forces = { every = 1 } }
""")
    expect_code(cairn("run", here / "case.toml", "--out", here / "run", ranks=2), 0)
    rows = np.genfromtxt(here / "run" / "history.csv", delimiter=",", names=True)
    for name in ("kinetic_energy", "strain_energy", "contact_dissipation"):
        expect((rows[name] == 0).all(), f"{name}: {rows[name]}")
    expect(abs(rows["mass"][0] / 1000 - 1) < 1e-3, f"mass {rows['mass'][0]} of the whole box")
    for file in (here / "run").glob("contacts_*.h5"):
        with h5py.File(file) as table:
            expect((table["force"][()] == 0).all(), f"{file.name}: forces")


def test_a_mesh_runs_on_any_ranks(cairn, here):
    points, triangles = make.sphere(24, 0.8)
    (here / "grain.stl").write_bytes(make.binary_stl(points, triangles))
    (here / "case.toml").write_text(HEAD_3D.replace("cells = 32", "cells = 24, patch_cells = 8") + f"""
bodies = [{{ shape = {{ {mesh("grain.stl")} }}, material = "soft", angular_velocity = [0, 1, 2] }}]
output = {{ history = {{ every = 1 }}, particles = {{ every = 3 }} }}
""")
    for ranks in (1, 2, 3):
        expect_code(cairn("run", here / "case.toml", "--out", here / f"run{ranks}", ranks=ranks), 0)
        expect(compare_folders(here / "run1", here / f"run{ranks}"), f"{ranks} ranks differ")
    with h5py.File(here / "run1" / "particles_000000.vtkhdf") as file:
        room = file["volume"][()].sum()
    done = check(cairn, here, mesh("grain.stl"))
    expect(abs(room / volume(done)[0] - 1) < 0.003, f"points fill {room}")
    copies = list((here / "run1").glob("case_shape_*.stl"))
    expect(len(copies) == 1 and copies[0].read_bytes() == (here / "grain.stl").read_bytes(), "no copy of the surface")
    (here / "grain.stl").unlink()
    expect_code(cairn("run", here / "run1" / "case.toml", "--out", here / "again"), 0)
    expect(compare_folders(here / "again", here / "run2"), "the copy gives other results")
    copies[0].write_bytes(b"not what the name says")
    expect_code(cairn("run", here / "again" / "case.toml", "--out", here / "run1", "--overwrite"), 2, "was not written by cairn")


def test_from_a_scan_to_pictures(cairn, here):
    """scripts/sand, small: grains keep their volumes, and 1 and 3 ranks give the same bits."""
    if not has_scipy():
        return print("labels: skipped, scipy is not there")
    command = [ROOT / "scripts" / "sand", here / "sand", "--program", cairn.exe, "--grains", "8", "--voxels", "24", "--cells", "8",
               "--steps", "4", "--ranks", "1", "--page-only"]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=400 * PATIENCE, check=False)
    expect(done.returncode == 0, f"{done.returncode} {done.stdout} {done.stderr}")
    run = here / "sand" / "run"
    expect((run / "view.html").stat().st_size > 10000, "view.html")
    with h5py.File(run / "particles_000000.vtkhdf") as file, h5py.File(here / "sand" / "grains.h5") as labels:
        body, room, counts = file["body"][()], file["volume"][()], labels["count"][()]
        for i, count in enumerate(counts, 1):  # body 0 is the lid
            share = room[body == i].sum() / (count * (1e-3 / 24) ** 3)
            expect(abs(share - 1) < 0.01, f"grain {i}: {share} of the volume of its voxels")
    expect_code(cairn("run", here / "sand" / "sand.toml", "--out", here / "three", ranks=3), 0)
    expect(compare_folders(run, here / "three"), "3 ranks differ")


def main() -> int:
    return run_tests(globals(), Program(sys.argv[1]), fresh_folder(sys.argv[2]))


if __name__ == "__main__":
    sys.exit(main())
