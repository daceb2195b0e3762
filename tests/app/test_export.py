"""scripts/export writes bodies and contacts as other programs read them: places, sizes, orientations, stresses, bonds.

    test_export.py CAIRN SCRATCH
"""

import csv
import importlib.util
import shutil
import subprocess
import sys
import xml.etree.ElementTree
from pathlib import Path

from harness import PATIENCE, ROOT, SKIP, Program, expect, expect_code, fresh_folder, run_tests, sets

for package in ("numpy", "h5py", "matplotlib"):
    if importlib.util.find_spec(package) is None:
        print(f"Python lacks {package}")
        sys.exit(SKIP)

import h5py  # noqa: E402  after the check that they are there
import numpy as np  # noqa: E402

SEMI = np.array((0.4, 0.25, 0.15))  # of the ellipsoid [m]
SPACING = 0.02


def export(*arguments, code: int = 0) -> subprocess.CompletedProcess:
    done = subprocess.run([ROOT / "scripts" / "export", *map(str, arguments)], capture_output=True, text=True,
                          timeout=300 * PATIENCE, check=False)
    expect(done.returncode == code and "Traceback" not in done.stderr, f"exit code {done.returncode}\n{done.stderr}")
    return done


def turn(axis, angle: float) -> np.ndarray:
    """Rodrigues' rotation."""
    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def matrix(q) -> np.ndarray:
    """Rotation of a quaternion x y z w."""
    x, y, z, w = q
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


TURNS = [np.eye(3), turn((1, 2, 3), 0.7), turn((1, 2, 3), 3.1), turn((-2, 1, 0.5), 2.0)]


def ellipsoid(folder: Path) -> None:
    """An ellipsoid (body 4) that turns while it crosses a periodic boundary, and a sphere (body 2) that rolls."""
    folder.mkdir(parents=True)
    (folder / "case.toml").write_text("[domain]\ndimension = 3\nlower = [0, 0, 0]\nupper = [2, 2, 2]\n"
                                      f"cell_size = {2 * SPACING}\nperiodic = [true, false, false]\n"
                                      "[solver]\npoints_per_cell = 8\n")
    side = np.arange(-0.41, 0.411, SPACING)
    grid = np.stack(np.meshgrid(side, side, side, indexing="ij"), -1).reshape(-1, 3)
    long, round_ = grid[(((grid / SEMI) ** 2).sum(1)) < 1], grid[np.linalg.norm(grid, axis=1) < 0.3]
    body = np.repeat([4, 2], [len(long), len(round_)]).astype(np.int32)
    ids = np.arange(len(body))
    for k, rotation in enumerate(TURNS):
        x = np.concatenate([long @ rotation.T + (1.72 + 0.15 * k, 1, 0.6), round_ @ rotation.T + (1, 1, 1.6)])
        stress = np.tile([1.0, 2, 3, 4, 5, 6], (len(x), 1)) * body[:, None]
        order = np.random.default_rng(k).permutation(len(x))
        with h5py.File(folder / f"particles_{k:06d}.vtkhdf", "w") as file:
            group = file.create_group("VTKHDF")
            group.attrs["time"], group.attrs["step"] = 0.1 * k, 10 * k
            group["Points"] = (x % 2)[order]
            for name, values in {"body": body, "id": ids, "stress": stress, "volume": np.full(len(x), SPACING**3),
                                 "mass": np.full(len(x), 2 * SPACING**3), "velocity": np.tile([1.0, 2, 3], (len(x), 1))}.items():
                group[f"PointData/{name}"] = values[order]


def dump_frames(path: Path) -> list[tuple[dict, list[dict]]]:
    """Header lines and rows of each frame of a LAMMPS dump."""
    frames, lines = [], iter(path.read_text().splitlines())
    header = {}
    for line in lines:
        item = line.removeprefix("ITEM: ")
        if item.startswith(("ATOMS", "BONDS")):
            names = item.split()[1:]
            rows = [dict(zip(names, next(lines).split())) for _ in range(header["count"])]
            frames.append((header, rows))
            header = {}
        elif item.startswith("NUMBER OF"):
            header["count"] = int(next(lines))
        elif item.startswith("BOX BOUNDS"):
            header["box"] = item.split()[2:], [tuple(map(float, next(lines).split())) for _ in range(3)]
        else:
            header[item] = next(lines)
    return frames


def test_ellipsoid(cairn: Program, scratch: Path) -> None:
    """Semi-axes, and how the body has turned, in all frames; across the boundary, too; with points in any order."""
    ellipsoid(scratch / "run")
    export(scratch / "run")
    frames = dump_frames(scratch / "run" / "export" / "grains.dump")
    expect(len(frames) == 4, f"{len(frames)} frames")
    for k, (header, rows) in enumerate(frames):
        expect(header["box"] == (["pp", "ff", "ff"], [(0, 2)] * 3) and header["TIMESTEP"] == str(10 * k), header)
        rolling, long = rows
        expect((rolling["id"], long["id"]) == ("3", "5"), rows)
        x = np.array([float(long[name]) for name in "xyz"])
        expect(np.abs(x - ((1.72 + 0.15 * k) % 2, 1, 0.6)).max() < 1e-6, f"frame {k}: centre {x}")
        semi = np.array([float(long[f"AsphericalShape.{name}"]) for name in "XYZ"])
        expect(np.abs(semi / SEMI - 1).max() < 0.02, f"frame {k}: semi-axes {semi}")
        axes = matrix([float(long[f"quat{name}"]) for name in "ijkw"])
        along = (axes.T @ TURNS[k] * np.eye(3)).diagonal()
        expect(np.abs(np.abs(along) - 1).max() < 1e-3, f"frame {k}: axes {axes}")
        spin = matrix([float(rolling[f"quat{name}"]) for name in "ijkw"])
        expect(np.abs(spin - TURNS[k]).max() < 1e-6, f"frame {k}: the sphere turned by {spin}")
        expect(abs(float(rolling["radius"]) / 0.3 - 1) < 0.02, rolling["radius"])
        stress = [float(long[f"c_stress[{i}]"]) for i in range(1, 7)]
        expect(np.allclose(stress, np.array([1, 2, 3, 4, 6, 5]) * 4), f"{stress} is not xx yy zz xy xz yz")
        expect([float(long[f"v{name}"]) for name in "xyz"] == [1, 2, 3], long)
    text = (scratch / "run" / "export" / "grains.xyz").read_text().splitlines()
    expect(len(text) == 4 * 4 and text[0] == "2" and 'pbc="T F F"' in text[1], text[:2])
    kinds = text[1].split("Properties=")[1].split(":")
    expect(sum(map(int, kinds[2::3])) == len(text[2].split()), f"{kinds} and {text[2]}")
    said = export(scratch / "run", "--form", "vtp").stdout
    expect("no vtp" in said, said)
    as_others_read(scratch / "run" / "export", frames)


def as_others_read(folder: Path, frames: list) -> None:
    """ASE finds the same bodies in grains.dump and grains.xyz."""
    try:
        from ase.io import read
    except ImportError:
        return print("ASE: skipped, it is not there")
    for name, options in (("grains.dump", {"format": "lammps-dump-text"}), ("grains.xyz", {"format": "extxyz"})):
        found = read(folder / name, index=":", **options)
        expect(len(found) == len(frames), f"{name}: ASE sees {len(found)} frames")
        for atoms, (_, rows) in zip(found, frames):
            place = np.array([[float(row[axis]) for axis in "xyz"] for row in rows])
            expect(np.abs(atoms.positions - place).max() < 1e-5, f"{name}: ASE sees {atoms.positions}")
            expect(atoms.pbc.tolist() == [True, False, False], f"{name}: ASE sees periods {atoms.pbc}")


def test_contacts(cairn: Program, scratch: Path) -> None:
    """Contacts as bonds, lines and rows are those of the run's files, at every time."""
    few = {"time.steps": 40, "output.particles": "{ every = 20 }", "output.contacts": "{ every = 20 }",
           "output.grains": "{ every = 20 }"}
    run = scratch / "run"
    expect_code(cairn("run", ROOT / "cases" / "shear_small.toml", "--out", run, *sets(few)), 0)
    out = scratch / "elsewhere"
    export(run, "-o", out)
    bonds = dump_frames(out / "contacts.dump")
    files = sorted(run.glob("contacts_*.h5"))
    expect(len(bonds) == len(files) == 3, f"{len(bonds)} frames of {len(files)} files")
    rows = list(csv.DictReader(open(out / "contacts.csv", encoding="ascii")))
    for path, (header, entries) in zip(files, bonds):
        with h5py.File(path) as file:
            pairs = np.stack([file["body_a"][:], file["body_b"][:]], 1)
            force = np.linalg.norm(file["force"][:], axis=1)
            step = int(file.attrs["step"])
        expect([(int(e["batom1"]) - 1, int(e["batom2"]) - 1) for e in entries] == [tuple(p) for p in pairs], header)
        expect(np.allclose([float(e["force"]) for e in entries], force), "forces differ")
        expect(sum(row["step"] == str(step) for row in rows) == len(pairs), f"rows of step {step}")
        tree = xml.etree.ElementTree.parse(out / f"contacts_{step:06d}.vtp")
        values = [float(v) for v in tree.find(".//CellData/DataArray").text.split()]
        piece = tree.find(".//Piece")
        expect(len(values) == int(piece.get("NumberOfLines")) >= len(pairs), piece.attrib)
        expect(np.allclose(values[: len(pairs)], force), "forces of lines differ")
        expect(len(tree.find(".//Points/DataArray").text.split()) == 9 * len(values), "points of lines")
    data = (out / "grains.data").read_text()
    expect(f"36 atoms\n{len(pairs)} bonds\n" in data and "Atoms # bond" in data, data[:200])
    grains = [row for row in csv.DictReader(open(out / "grains.csv", encoding="ascii")) if row["step"] == str(step)]
    with h5py.File(sorted(run.glob("grains_*.h5"))[-1]) as file:
        for name, column in (("stress_xx", file["mean_stress"][:, 0]), ("mass", file["mass"][:]), ("vy", file["velocity"][:, 1])):
            mine = np.array([float(row[name]) for row in grains])
            expect(np.allclose(mine, column, rtol=1e-5, atol=1e-5 * np.abs(column).max()), f"{name}: {mine} and {column}")


def test_bad_folders(cairn: Program, scratch: Path) -> None:
    """What is no run, or damaged, or a link, gives one line, and nothing is written through a link."""
    ellipsoid(scratch / "sound")
    (scratch / "empty").mkdir()
    for name in ("link", "file", "cut", "words"):
        shutil.copytree(scratch / "sound", scratch / name)
    (scratch / "target").mkdir()
    (scratch / "link" / "export").symlink_to("../target")
    (scratch / "file" / "export").write_text("")
    cut = scratch / "cut" / "particles_000002.vtkhdf"
    cut.write_bytes(cut.read_bytes()[:3000])
    (scratch / "words" / "contacts_000010.h5").write_text("not HDF5")
    for name in ("empty", "link", "file", "cut", "words", "nowhere"):
        done = export(scratch / name, code=2)
        expect(len(done.stderr.splitlines()) == 1 and done.stderr.startswith("export: "), f"{name}: {done.stderr}")
    expect(not list((scratch / "target").iterdir()), "a link was followed")
    (scratch / "sound" / "export").mkdir()
    (scratch / "kept").write_text("kept")
    (scratch / "sound" / "export" / "grains.csv").symlink_to("../../kept")
    export(scratch / "sound", "--form", "csv", "--times", "0.1")
    expect((scratch / "kept").read_text() == "kept", "a file's link was followed")


if __name__ == "__main__":
    sys.exit(run_tests(globals(), Program(sys.argv[1]), fresh_folder(sys.argv[2])))
