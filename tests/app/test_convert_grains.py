"""scripts/convert-grains reads what it says it reads, tells it by its header, and refuses the rest by its name.

    test_convert_grains.py CAIRN SCRATCH
"""

import gzip
import os
import struct
import subprocess
import sys
import zlib
from pathlib import Path

from harness import PATIENCE, ROOT, Program, fresh_folder

# Three spheres, as (x, y, z, r).
SPHERES = [(0.1, 0.1, 0.1, 0.02), (0.2, 0.1, 0.15, 0.03), (0.3, 0.12, 0.1, 0.05)]
DISKS = [(x, y, r) for x, y, _, r in SPHERES]


def rows(*columns) -> str:
    """Lines of values; a text is a format of x, y, z, r and the number n of the sphere."""
    return "".join("\t".join(c.format(x=x, y=y, z=z, r=r, d=2 * r, n=n) for c in columns) + "\n"
                   for n, (x, y, z, r) in enumerate(SPHERES))


XYZR = ("{x}", "{y}", "{z}", "{r}")
DUMP_HEAD = "ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n3\nITEM: BOX BOUNDS pp pp ff\n0 1\n0 1\n0 1\n"


def vtp(cut: int = 0) -> bytes:
    """VTK points as DEM programs write them: appended bytes, compressed by zlib in blocks."""
    def packed(values):
        raw = struct.pack(f"<{len(values)}d", *values)
        blocks = [zlib.compress(raw[:32]), zlib.compress(raw[32:])]
        return struct.pack("<5I", 2, 32, len(raw) - 32, *map(len, blocks)) + b"".join(blocks)

    points = packed([v for s in SPHERES for v in s[:3]])
    text = ('<?xml version="1.0"?>\n<VTKFile type="PolyData" byte_order="LittleEndian" header_type="UInt32" '
            'compressor="vtkZLibDataCompressor"><PolyData><Piece NumberOfPoints="3"><PointData>'
            '<DataArray type="Float64" Name="radii" format="ascii">' + " ".join(str(s[3]) for s in SPHERES)
            + '</DataArray></PointData><Points><DataArray type="Float64" Name="Points" NumberOfComponents="3" '
            'format="appended" offset="0"/></Points></Piece></PolyData>\n<AppendedData encoding="raw">\n_')
    return text.encode() + points[:len(points) - cut] + b"\n</AppendedData></VTKFile>"


FRAME = DUMP_HEAD + "ITEM: ATOMS id type x y z radius \n" + rows("{n}", "1", *XYZR).replace("\t", " ")
LOW, HIGH = min(x - r for x, _, _, r in SPHERES), max(x + r for x, _, _, r in SPHERES)
BOX = "{low} {high} xlo xhi\n0 1 ylo yhi\n0 1 zlo zhi\n"
YADE_LIGGGHTS = ("LIGGGHTS Description\n\n3 atoms\n1 atom types\n\n" + BOX.format(low=LOW, high=HIGH) + "\nAtoms\n\n"
                 + rows("{n}", "1", "{r}", "2600", "{x}", "{y}", "{z}") + "\nVelocities\n\n"
                 + rows("{n}", "0", "0", "0", "0", "0", "0"))
LAMMPS_DATA = ("LAMMPS data file\n\n3 atoms\n1 atom types\n\n" + BOX.format(low=0, high=1) + "\nAtoms # sphere\n\n"
               + rows("{n}", "1", "{d}", "2600", "{x}", "{y}", "{z}", "0", "0", "0"))
MERCURY_3D = "3 {time} 0 0 0 1 1 1\n" + rows("{x}", "{y}", "{z}", "9", "9", "9", "{r}", *("8",) * 7).replace("\t", " ")
MERCURY_2D = "3 0 0 0 1 1\n" + rows("{x}", "{y}", "9", "9", "{r}", "8", "8", "8").replace("\t", " ")

GOOD = {
    "dump.txt": (FRAME.format(step=0), SPHERES),
    "yade.txt": ("#format x_y_z_r\n# made by hand\n" + rows(*XYZR), SPHERES),
    "yade_material.txt": ("#format x_y_z_r_matId\n" + rows(*XYZR, "7"), SPHERES),
    "yade_id.txt": ("#format id_x_y_z_r_matId\n" + rows("{n}", *XYZR, "1"), SPHERES),
    "yade_attrs.txt": ("#format x_y_z_r_attrs\n# x y z r mass\n" + rows(*XYZR, "7", "8", "9"), SPHERES),
    "yade_clumps.txt": ("#format x_y_z_r_clumpId\n" + rows(*XYZR, "3"), [(*s, 3.0) for s in SPHERES]),
    "yade_other.txt": ("#format id_r_x_y_z_mask\n" + rows("{n}", "{r}", *XYZR[:3], "1"), SPHERES),
    "tilted.txt": (FRAME.format(step=0).replace("pp pp ff\n0 1\n0 1\n", "xy xz yz pp pp ff\n0 1.25 0.25\n0 1 0\n")
                   .replace("0 1\nITEM: ATOMS", "0 1 0\nITEM: ATOMS").replace("x y z radius", "xs ys zs radius"),
                   [(x + 0.25 * y, y, z, r) for x, y, z, r in SPHERES]),
    "extended.xyz": ("3\nLattice=\"1 0 0 0 1 0 0 0 1\" Properties=species:S:1:pos:R:3:radius:R:1\n"
                     + rows("Si", *XYZR).replace("\t", " "), SPHERES),
    "old.vtk": ("# vtk DataFile Version 3.0\nspheres\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n" + rows(*XYZR[:3])
                + "POINT_DATA 3\nSCALARS radius float 1\nLOOKUP_TABLE default\n" + rows("{r}"), SPHERES),
    "comma.csv": ("x;y;z;r\r\n" + rows(*XYZR).replace("\t", ";").replace(".", ","), SPHERES),
    "points.vtp": (vtp(), SPHERES),
    "yade_liggghts.txt": (YADE_LIGGGHTS, SPHERES),
    "lammps.data": (LAMMPS_DATA, SPHERES),
    "mercury.data": (MERCURY_3D.format(time=0), SPHERES),
    "mercury_two_frames.data": (MERCURY_3D.format(time=0).replace("0.05", "0.04") + MERCURY_3D.format(time=1), SPHERES),
    "mercury_2d.data": (MERCURY_2D, DISKS),
    "table.csv": ("y,x,z,diameter\r\n" + rows("{y}", "{x}", "{z}", "{d}").replace("\t", ","), SPHERES),
    "table_2d.txt": ("# x y r\n" + rows("{x}", "{y}", "{r}"), DISKS),
    "marked.csv": ("\ufeffx,y,z,r\r\n" + rows(*XYZR).replace("\t", ","), SPHERES),
    "utf16.csv": (("\ufeffx,y,z,r\r\n" + rows(*XYZR).replace("\t", ",")).encode("utf-16-le"), SPHERES),
    "packed.gz": (gzip.compress(FRAME.format(step=0).encode()), SPHERES),
    # A last frame that is cut: between rows, within a row, within a number, and in the compressed file.
    "cut_rows.txt": (FRAME.format(step=0) + FRAME.format(step=1)[:-20].rsplit("\n", 1)[0] + "\n", SPHERES),
    "cut_row.txt": (FRAME.format(step=0) + FRAME.format(step=1)[:-8], SPHERES),
    "cut_number.txt": (FRAME.format(step=0) + FRAME.format(step=1)[:-2], SPHERES),
    "cut_mercury.data": (MERCURY_3D.format(time=0) + MERCURY_3D.format(time=1)[:-2], SPHERES),
    "cut.gz": (gzip.compress((FRAME.format(step=0) + FRAME.format(step=1) * 40).encode())[:-30], SPHERES),
}
# Content, arguments, and what the message names.
BAD = {
    "short_yade.txt": ("#format id_x_y_z_r_matId\n" + rows("{n}", *XYZR), [], "5 values; the header names 6"),
    "unknown_yade.txt": ("#format jointedPM\n" + rows(*XYZR), [], "jointedPM"),
    "no_header.txt": (rows("{n}", *XYZR), [], "--columns"),
    "four_columns.txt": (rows(*XYZR), [], "--columns"),
    "mercury_short.data": ("3 0 0 0 0 1 1 1\n" + rows("{x}", "{y}", "{z}", "9", "9", "9", "{r}", "8"), [], "14"),
    "no_size.csv": ("x,y,z,mass\n" + rows(*XYZR), [], "radius"),
    "style.data": (LAMMPS_DATA.replace("# sphere", "# atomic"), [], "atomic"),
    "doubtful.data": (YADE_LIGGGHTS.replace(f"{LOW}", "-5"), [], "--size"),
    "cut_atoms.data": (LAMMPS_DATA.replace("3 atoms", "4 atoms"), [], "cut off"),
    "one_cut.txt": (FRAME.format(step=0)[:-20], [], "no frame before it is whole"),
    "frame.txt": (FRAME.format(step=0), ["--frame", "3"], "no frame 3"),
    "item.txt": (FRAME.format(step=0).replace("ITEM: BOX", "ITEM: B\x1bX"), [], "is not known"),
    "empty.txt": ("", [], "is empty"),
    "cut.vtp": (vtp(cut=9), [], "cut off or damaged"),
    "colour.csv": ("a,b,c,size\n" + rows(*XYZR).replace("\t", ","), ["--columns", "x=q,y=b,z=c,r=size"], "no column 'q'"),
    "no_radius.xyz": ("3\nProperties=species:S:1:pos:R:3\n" + rows("Si", *XYZR[:3]), [], "radius"),
}


def run(*arguments):
    command = [sys.executable, ROOT / "scripts" / "convert-grains", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=60 * PATIENCE, check=False)


def write(file: Path, content):
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    return file


def table(file: Path):
    return [tuple(map(float, line.split(","))) for line in file.read_text().splitlines()[2:]]


def good(scratch: Path) -> list[str]:
    problems = []
    for name, (content, expected) in GOOD.items():
        out = scratch / f"{name}.csv"
        done = run(write(scratch / name, content), "-o", out)
        if done.returncode != 0 or table(out) != expected:
            problems.append(f"{name}: {done.returncode} {done.stderr} {out.read_text() if out.exists() else ''}")
        elif name.startswith("cut") and "cut off" not in done.stderr and "left out" not in done.stderr:
            problems.append(f"{name}: what is left out is not said: {done.stderr}")
    for arguments, name in ((["--columns", "n x y z r"], "no_header.txt"), (["--format", "yade"], "four_columns.txt"),
                            (["--size", "radius"], "doubtful.data"),
                            (["--columns", "x=a,y=b,z=c,r=size"], "colour.csv")):
        out = scratch / f"{name}.csv"
        done = run(write(scratch / name, BAD[name][0]), "-o", out, *arguments)
        if done.returncode != 0 or table(out) != SPHERES:
            problems.append(f"{name} {arguments}: {done.returncode} {done.stderr}")
    return problems


def bad(scratch: Path) -> list[str]:
    problems = []
    for name, (content, arguments, word) in BAD.items():
        out = scratch / f"bad_{name}.csv"
        done = run(write(scratch / f"bad_{name}", content), "-o", out, *arguments)
        if done.returncode != 2 or word not in done.stderr or out.exists() or "\x1b" in done.stderr:
            problems.append(f"{name}: {done.returncode} {done.stderr}")
    return problems


def targets(scratch: Path) -> list[str]:
    """Only what does not exist, or what was made here before, is written."""
    source = write(scratch / "source.txt", GOOD["yade.txt"][0])
    mine, link, pipe = write(scratch / "mine.csv", "x,y,r\n"), scratch / "link.csv", scratch / "pipe"
    link.symlink_to(mine)
    os.mkfifo(pipe)
    problems = [f"{target.name} was not refused" for target in (source, mine, link, pipe)
                if run(source, "-o", target).returncode != 2]
    if mine.read_text() != "x,y,r\n" or source.read_text() != GOOD["yade.txt"][0]:
        problems.append("a file was replaced")
    for _ in range(2):
        if run(source, "-o", scratch / "again.csv").returncode != 0:
            problems.append("a table of this program was not replaced")
    return problems


def read_back(cairn: Program, scratch: Path) -> list[str]:
    """What was converted is read by a case."""
    case = ('domain = { dimension = 3, upper = [0.4, 0.3, 0.3], cells = [40, 30, 30] }\ntime = { steps = 1 }\n'
            'materials.soft = { model = "neo_hookean", density = 1e3, shear_modulus = 1e5, bulk_modulus = 1e5 }\n'
            'grains = [{ file = "yade_id.txt.csv", material = "soft" }]\n')
    problems = []
    for name, bodies in (("yade_id.txt.csv", 3), ("yade_clumps.txt.csv", 1)):
        done = cairn("check", write(scratch / "case.toml", case.replace("yade_id.txt.csv", name)))
        if done.code != 0 or f"bodies     {bodies} " not in done.out:
            problems.append(f"check: {done.code} {done.err} {done.out}")
    return problems


def main() -> int:
    cairn, scratch = Program(sys.argv[1]), fresh_folder(sys.argv[2])
    problems = good(scratch) + bad(scratch) + targets(scratch) + read_back(cairn, scratch)
    print("\n".join(problems))
    print(f"{len(GOOD)} good files, {len(BAD)} bad ones, {len(problems)} problems")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
