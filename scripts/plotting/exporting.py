"""Writes the bodies and contacts of a run in forms that other programs read, into RUN_DIR/export."""

from __future__ import annotations

import argparse
import csv
import sys
from pathlib import Path

import numpy as np

from chains import network
from command import folder_in, own_folder, run_command, whole_file
from photoelastic import nearest_frames
from results import Frame, MissingData, Run
from shapes import Bodies, Shapes

FORMS = """forms:
  lammps   grains.dump: a LAMMPS dump that OVITO opens as it is: place, velocity, radius, orientation, semi-axes, stress;
           contacts.dump: bonds for OVITO's "Load trajectory"; grains.data: the last time with its contacts as bonds
  csv      grains.csv and contacts.csv, all times in one table each
  xyz      grains.xyz: extended XYZ
  vtp      contacts_*.vtp and contacts.pvd: lines from centre to centre for ParaView"""
STRESS = ("xx", "yy", "zz", "xy", "yz", "xz")
CARTESIAN = ("x", "y", "z")


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="scripts/export", description=__doc__, epilog=FORMS,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path, metavar="RUN_DIR", help="result folder of a run")
    parser.add_argument("-o", "--out", type=Path, metavar="DIR", help="another folder to write to")
    parser.add_argument("--form", nargs="+", choices=sorted(WRITERS), default=sorted(WRITERS), help="default: all")
    parser.add_argument("--times", type=float, nargs="+", default=[], metavar="S",
                        help="the outputs nearest to these times [s]; default: all")
    return parser.parse_args()


class Moment:
    """Bodies and contacts at the time of a frame."""

    def __init__(self, run: Run, shapes: Shapes, frame: Frame):
        self.run, self.frame = run.at(frame), frame
        self.bodies: Bodies = shapes.at(frame)
        self.contacts: Frame | None = run.file_at(run.contact_files, frame.time) if run.contact_files else None

    def grain_columns(self) -> dict[str, np.ndarray]:
        """Columns by name, SI units."""
        b = self.bodies
        columns = {"body": b.body}
        columns |= {name: b.centre[:, k] for k, name in enumerate(CARTESIAN)}
        columns |= {f"v{name}": b.velocity[:, k] for k, name in enumerate(CARTESIAN)}
        columns |= {"mass": b.mass, "volume": b.volume, "radius": b.radius}
        columns |= {f"semi_axis_{k + 1}": b.semi_axes[:, k] for k in range(3)}
        columns |= {f"quaternion_{name}": b.quaternion[:, k] for k, name in enumerate("xyzw")}
        if b.stress is not None:
            columns |= {f"stress_{name}": b.stress[:, k] for k, name in enumerate(STRESS)}
        return columns

    def bonds(self) -> dict[str, np.ndarray]:
        """Contacts of two bodies that have points."""
        columns = self.contact_columns()
        both = np.logical_and(*[np.isin(columns[name], self.bodies.body) for name in ("body_a", "body_b")]) if columns else []
        return {name: column[both] for name, column in columns.items()}

    def contact_columns(self) -> dict[str, np.ndarray]:
        table = self.contacts
        if table is None:
            return {}
        columns = {"body_a": table.field("body_a"), "body_b": table.field("body_b")}
        for field, letter in (("point", ""), ("normal", "n"), ("force", "f")):
            columns |= {f"{letter}{name}": table.field(field)[:, k] for k, name in enumerate(CARTESIAN)}
        return columns

    def box(self) -> np.ndarray:
        """Lower and upper (3 x 2) [m]; in 2D the box is as thick as a grain."""
        box = np.zeros((3, 2))
        box[: self.run.dimension] = np.column_stack([self.run.lower, self.run.upper])
        if self.run.dimension == 2:
            box[2] = np.array((-1, 1)) * float(np.median(self.bodies.radius))
        return box

    def periodic(self) -> list[bool]:
        return [bool(axis < self.run.dimension and self.run.periodic[axis]) for axis in range(3)]


def _rows(columns: dict[str, np.ndarray]) -> list[str]:
    return [" ".join(f"{value:.9g}" if isinstance(value, float) else str(value) for value in row)
            for row in zip(*[column.tolist() for column in columns.values()])]


def lammps(moments: list[Moment], folder: Path) -> list[str]:
    """OVITO knows the columns by their names; `AsphericalShape` are its own semi-axes, quati to quatw its orientation."""
    names = {"body": "id", **{f"quaternion_{own}": f"quat{theirs}" for own, theirs in zip("xyzw", "ijkw")},
             **{f"semi_axis_{k + 1}": f"AsphericalShape.{'XYZ'[k]}" for k in range(3)},
             **{f"stress_{name}": f"c_stress[{k + 1}]" for k, name in enumerate(("xx", "yy", "zz", "xy", "xz", "yz"))}}
    with whole_file(folder / "grains.dump") as draft, open(draft, "w", encoding="ascii") as file:
        for moment in moments:
            columns = moment.grain_columns()
            columns = {"body": columns["body"] + 1, "type": np.ones(len(columns["body"]), int)} | \
                {name: column for name, column in columns.items() if name != "body"}
            sides = " ".join("pp" if periodic else "ff" for periodic in moment.periodic())
            box = "\n".join(f"{low:.12g} {high:.12g}" for low, high in moment.box())
            file.write(f"ITEM: UNITS\nsi\nITEM: TIME\n{moment.frame.time:.12g}\nITEM: TIMESTEP\n{moment.frame.step}\n"
                       f"ITEM: NUMBER OF ATOMS\n{len(columns['body'])}\nITEM: BOX BOUNDS {sides}\n{box}\n"
                       f"ITEM: ATOMS {' '.join(names.get(name, name) for name in columns)}\n")
            file.writelines(row + "\n" for row in _rows(columns))
    made = ["grains.dump"]
    if any(moment.contacts for moment in moments):
        made += [_bonds(moments, folder), _data(moments[-1], folder)]
    return made


def _bonds(moments: list[Moment], folder: Path) -> str:
    with whole_file(folder / "contacts.dump") as draft, open(draft, "w", encoding="ascii") as file:
        for moment in moments:
            columns = moment.bonds()
            count = len(columns["body_a"]) if columns else 0
            sides = " ".join("pp" if periodic else "ff" for periodic in moment.periodic())
            box = "\n".join(f"{low:.12g} {high:.12g}" for low, high in moment.box())
            file.write(f"ITEM: TIMESTEP\n{moment.frame.step}\nITEM: NUMBER OF BONDS\n{count}\n"
                       f"ITEM: BOX BOUNDS {sides}\n{box}\nITEM: BONDS batom1 batom2 force fx fy fz\n")
            if count:
                file.writelines(row + "\n" for row in _rows(_bond_columns(columns)))
    return "contacts.dump"


def _bond_columns(columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    force = np.sqrt(columns["fx"] ** 2 + columns["fy"] ** 2 + columns["fz"] ** 2)
    return {"batom1": columns["body_a"] + 1, "batom2": columns["body_b"] + 1, "force": force,
            **{name: columns[name] for name in ("fx", "fy", "fz")}}


def _data(moment: Moment, folder: Path) -> str:
    """A LAMMPS data file, atom style bond: grains as atoms, contacts as bonds."""
    bodies, contacts = moment.bodies, moment.bonds()
    bonds = len(contacts["body_a"]) if contacts else 0
    box = "\n".join(f"{low:.12g} {high:.12g} {name}lo {name}hi" for (low, high), name in zip(moment.box(), CARTESIAN))
    with whole_file(folder / "grains.data") as draft, open(draft, "w", encoding="ascii") as file:
        file.write(f"# grains and contacts at {moment.frame.time:.9g} s\n\n{len(bodies.body)} atoms\n{bonds} bonds\n"
                   f"1 atom types\n{1 if bonds else 0} bond types\n\n{box}\n\nAtoms # bond\n\n")
        for body, centre in zip(bodies.body, bodies.centre):
            file.write(f"{body + 1} 1 1 {centre[0]:.9g} {centre[1]:.9g} {centre[2]:.9g}\n")
        if bonds:
            file.write("\nBonds\n\n")
            for k, (a, b) in enumerate(zip(contacts["body_a"], contacts["body_b"]), 1):
                file.write(f"{k} 1 {a + 1} {b + 1}\n")
    return "grains.data"


def tables(moments: list[Moment], folder: Path) -> list[str]:
    """CSV with a header; numbers to 9 digits."""
    made = []
    for name, rows in (("grains.csv", Moment.grain_columns), ("contacts.csv", Moment.contact_columns)):
        parts = [(moment, rows(moment)) for moment in moments]
        parts = [(moment, columns) for moment, columns in parts if columns]
        if not parts:
            continue
        with whole_file(folder / name) as draft, open(draft, "w", encoding="ascii", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(["step", "time", *parts[0][1]])
            for moment, columns in parts:
                for row in zip(*[column.tolist() for column in columns.values()]):
                    values = [f"{value:.9g}" if isinstance(value, float) else value for value in row]
                    writer.writerow([moment.frame.step, f"{moment.frame.time:.9g}", *values])
        made.append(name)
    return made


def extended_xyz(moments: list[Moment], folder: Path) -> list[str]:
    """A frame for each time; the comment says what the columns are."""
    with whole_file(folder / "grains.xyz") as draft, open(draft, "w", encoding="ascii") as file:
        for moment in moments:
            b, box = moment.bodies, moment.box()
            parts = [("id", "I", b.body[:, None]), ("pos", "R", b.centre), ("velo", "R", b.velocity),
                     ("mass", "R", b.mass[:, None]), ("radius", "R", b.radius[:, None]), ("aspherical_shape", "R", b.semi_axes),
                     ("orientation", "R", b.quaternion)]
            if b.stress is not None:
                parts.append(("stress_tensor", "R", b.stress[:, (0, 1, 2, 3, 5, 4)]))  # xx yy zz xy xz yz
            kinds = ":".join(f"{name}:{kind}:{values.shape[1]}" for name, kind, values in parts)
            sides = " ".join("T" if periodic else "F" for periodic in moment.periodic())
            cell = " ".join(f"{value:.12g}" for value in np.diag(box[:, 1] - box[:, 0]).ravel())
            origin = " ".join(f"{value:.12g}" for value in box[:, 0])
            file.write(f'{len(b.body)}\nLattice="{cell}" Origin="{origin}" pbc="{sides}" Time={moment.frame.time:.12g} '
                       f"Step={moment.frame.step} Properties=species:S:1:{kinds}\n")
            for row in zip(*[values.tolist() for _, _, values in parts]):
                values = [value for cells in row for value in cells]
                file.write("X " + " ".join(f"{v:.9g}" if isinstance(v, float) else str(v) for v in values) + "\n")
    return ["grains.xyz"]


def lines(moments: list[Moment], folder: Path) -> list[str]:
    """Polylines centre - contact - centre, with the force as cell data; periodic images are among them."""
    made, sets = [], []
    for moment in moments:
        if moment.contacts is None:
            continue
        net = network(moment.run, moment.contacts, moment.frame)
        name = f"contacts_{moment.frame.step:06d}.vtp"
        count = len(net.lines)
        points = "\n".join(" ".join(f"{v:.9g}" for v in point) for point in net.lines.reshape(-1, 3).tolist())
        forces = " ".join(f"{v:.9g}" for v in net.force.tolist())
        with whole_file(folder / name) as draft:
            draft.write_text(VTP.format(points=3 * count, lines=count, coordinates=points, force=forces,
                                        connectivity=" ".join(map(str, range(3 * count))),
                                        offsets=" ".join(str(3 * (k + 1)) for k in range(count))), encoding="ascii")
        made.append(name)
        sets.append(f'    <DataSet timestep="{moment.frame.time:.12g}" file="{name}"/>')
    if made:
        with whole_file(folder / "contacts.pvd") as draft:
            draft.write_text('<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n'
                             + "\n".join(sets) + "\n  </Collection>\n</VTKFile>\n", encoding="ascii")
        made.append("contacts.pvd")
    return made


VTP = """<?xml version="1.0"?>
<VTKFile type="PolyData" version="0.1" byte_order="LittleEndian">
<PolyData><Piece NumberOfPoints="{points}" NumberOfVerts="0" NumberOfLines="{lines}" NumberOfStrips="0" NumberOfPolys="0">
<CellData Scalars="force"><DataArray type="Float64" Name="force" format="ascii">
{force}
</DataArray></CellData>
<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">
{coordinates}
</DataArray></Points>
<Lines><DataArray type="Int64" Name="connectivity" format="ascii">
{connectivity}
</DataArray><DataArray type="Int64" Name="offsets" format="ascii">
{offsets}
</DataArray></Lines>
</Piece></PolyData></VTKFile>
"""
WRITERS = {"lammps": lammps, "csv": tables, "xyz": extended_xyz, "vtp": lines}


def export(options: argparse.Namespace) -> int:
    run = Run(options.run)
    frames = list(dict.fromkeys(nearest_frames(run, options.times)))
    shapes = Shapes(run)
    moments = [Moment(run, shapes, frame) for frame in frames if frame.points]
    if not moments:
        raise MissingData("there are no points any more")
    folder = own_folder(options.out) if options.out else folder_in(run.folder, "export")
    for form in options.form:
        made = WRITERS[form](moments, folder)
        for name in made:
            print(f"  {folder / name}")
        if not made:
            print(f"  no {form}: there are no contacts_*.h5 files (see output.contacts)")
    return 0


def main() -> int:
    options = arguments()
    return run_command("export", options.run, "the export", lambda: export(options))


if __name__ == "__main__":
    sys.exit(main())
