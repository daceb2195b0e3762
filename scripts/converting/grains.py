"""Grains of other programs: what their files hold is told from the header."""

import gzip
import re
import zlib

from converting import lammps
from converting.common import CutOff, InputError, note, printable
from converting.rows import SIZES, Columns, Grain, chosen, is_numbers, number, read_rows, whole_frames, words

YADE = {"x_y_z_r": "x y z r", "x_y_z_r_matId": "x y z r matId", "x_y_z_r_attrs": "x y z r ...",
        "x_y_z_r_clumpId": "x y z r clump", "id_x_y_z_r_matId": "id x y z r matId"}
MARK = " grains from "  # of the first line of a table made here


def read_yade(lines, name):
    """Yade's export.text, textExt and textClumps. Any order of the columns is told by the header."""
    kind = (lines[0].split() + [""])[1]
    columns = YADE.get(kind, kind.replace("_", " ").replace("clumpId", "clump")).split()
    if kind not in YADE and not {"x", "y", "z", "r"} <= set(columns):
        raise InputError(f"{name}:1: the format '{kind[:60]}' is not known; known are {', '.join(YADE)}, and others with x, "
                         "y, z and r in their names")
    grains = read_rows(lines, name, Columns(columns, name), 2, width=None if columns[-1] == "..." else len(columns))
    for grain in grains:
        grain.clump = "" if grain.clump in ("-1", "") else grain.clump  # -1: stands alone
    return grains, f"Yade text, {kind}"


def add_mercury_frames(lines, name, frames):
    """Frames of MercuryDPM's .data files: (time, first line number of the rows, rows, dimension)."""
    at = 0
    while at < len(lines):
        header = lines[at].split()
        at += 1
        if not header:
            continue
        if len(header) not in (6, 8) or not header[0].isdigit():
            raise InputError(f"{name}:{at}: is not the header 'N time box' of a MercuryDPM frame")
        count, width = int(header[0]), 14 if len(header) == 8 else 8
        rows = lines[at:at + count]
        if len(rows) < count:
            raise CutOff(f"{name}:{len(lines)}: ends in frame {len(frames)}; {count} rows were to come")
        for i, row in enumerate(rows, at + 1):
            if len(row.split()) != width:
                raise InputError(f"{name}:{i}: {len(row.split())} values; a row of MercuryDPM has {width}")
        frames.append((header[1], at + 1, rows, 3 if width == 14 else 2))
        at += count


def read_mercury(lines, name, frame):
    time, first, rows, dimension = chosen(whole_frames(add_mercury_frames, lines, name), frame, name)
    columns = Columns("x y z vx vy vz r".split() if dimension == 3 else "x y vx vy r".split(), name)
    grains = [columns.grain(row.split(), f"{name}:{i}") for i, row in enumerate(rows, first)]
    return grains, f"MercuryDPM, time {time[:30]}"


def add_xyz_frames(lines, name, frames):
    """Frames of extended XYZ: (names of columns, first line number of the rows, rows)."""
    at = 0
    while at < len(lines):
        if not lines[at].strip():
            at += 1
            continue
        if not lines[at].strip().isdigit():
            raise InputError(f"{name}:{at + 1}: '{lines[at][:40]}' is not the number of atoms of a frame")
        count = int(lines[at])
        if at + 2 + count > len(lines):
            raise CutOff(f"{name}:{len(lines)}: ends in frame {len(frames)}; {count} atoms were to come")
        found = re.search(r'Properties="?([^"\s]+)', lines[at + 1])
        if not found:
            raise InputError(f"{name}:{at + 2}: has no Properties=...: whether there are radii is not told")
        words_of, names = found.group(1).split(":"), []
        known = {"pos": ["x", "y", "z"], "velo": ["vx", "vy", "vz"], "vel": ["vx", "vy", "vz"]}
        for key, width in zip(words_of[::3], words_of[2::3]):
            if not width.isdecimal() or len(width) > 3:
                raise InputError(f"{name}:{at + 2}: Properties: '{key[:40]}' has '{width[:40]}' columns; that is no number below 1000")
            names += known.get(key, [key] if width == "1" else [f"{key}{i}" for i in range(int(width or 0))])
        frames.append((names, at + 3, lines[at + 2:at + 2 + count]))
        at += 2 + count


def read_xyz(lines, name, frame):
    names, first, rows = chosen(whole_frames(add_xyz_frames, lines, name), frame, name)
    columns = Columns(names, f"{name}:{first - 1}")
    return [columns.grain(row.split(), f"{name}:{i}") for i, row in enumerate(rows, first)], "extended XYZ"


def sized(arrays, where):
    """The array of sizes, and what it is times for the radius."""
    found = [n for n in arrays if n.lower() in SIZES]
    if len(found) != 1:
        raise InputError(f"{where}: {len(found)} arrays are called like a radius or a diameter; the arrays are "
                         f"{', '.join(arrays) or 'none'}; one must be called radius, radii, r, diameter or d")
    return found[0], SIZES[found[0].lower()]


def read_vtp(data, name):
    """Points of a VTK file of polygons or of an unstructured grid, with an array of radii."""
    from converting.vtk_xml import VtkFile  # pylint: disable=import-outside-toplevel
    file = VtkFile(data, name)
    grains = []
    for piece in file.root.iter("Piece"):
        arrays, places = file.arrays(piece.find("PointData")), file.arrays(piece.find("Points"))
        if not places:
            raise InputError(f"{name}: holds no points")
        size, factor = sized(arrays, name)
        points, radii = file.values(next(iter(places.values()))), file.values(arrays[size])
        speed = next((a for n, a in arrays.items() if "velocity" in n.lower() and "ang" not in n.lower()
                      and a.get("NumberOfComponents") == "3"), None)
        speeds = file.values(speed) if speed is not None else None
        count = int(piece.get("NumberOfPoints", len(radii)))
        if len(points) != 3 * count or len(radii) != count or (speeds is not None and len(speeds) != 3 * count):
            raise InputError(f"{name}: {count} points with {len(points)} coordinates and {len(radii)} radii")
        for i in range(count):
            where = f"{name}: point {i}"
            triple = slice(3 * i, 3 * i + 3)
            grains.append(Grain(where, [number(v, where) for v in points[triple]], factor * number(radii[i], where),
                                None if speeds is None else [number(v, where) for v in speeds[triple]]))
    return grains, "VTK points"


def read_vtk(lines, name):
    """VTK's old text form: POINTS, and a field or scalars of radii."""
    if len(lines) < 3 or lines[2].strip() != "ASCII":
        raise InputError(f"{name}:3: the form '{lines[2].strip() if len(lines) > 2 else ''}' is not read; ASCII and .vtp are")
    tokens = [(word, i) for i, line in enumerate(lines[3:], 4) for word in line.split()]
    arrays, at = {}, 0

    def take(count, key, line):
        nonlocal at
        if at + count > len(tokens):
            raise InputError(f"{name}:{len(lines)}: ends in the middle of {key} (line {line}); it is cut off")
        at += count
        return [number(word, f"{name}:{i}") for word, i in tokens[at - count:at]]

    count = 0
    while at < len(tokens):
        word, line = tokens[at]
        following = [t for t, _ in tokens[at + 1:at + 5]]
        at += 1
        if word == "POINTS" and following[:1] and following[0].isdigit():
            count, at = int(following[0]), at + 2
            arrays["POINTS"] = take(3 * count, "POINTS", line)
        elif word in ("SCALARS", "VECTORS") and following:
            at += 2
            if tokens[at][0].isdigit():
                at += 1
            if tokens[at][0] == "LOOKUP_TABLE":
                at += 2
            arrays[following[0]] = take(count * (3 if word == "VECTORS" else 1), following[0], line)
        elif len(following) >= 3 and following[0].isdigit() and following[1] == str(count) and word != "POINTS":
            at += 3  # an array of a FIELD: name components tuples type
            arrays[word] = take(int(following[0]) * count, word, line)
    if "POINTS" not in arrays:
        raise InputError(f"{name}: holds no POINTS")
    size, factor = sized([n for n in arrays if n != "POINTS"], name)
    speeds = next((v for n, v in arrays.items() if n in ("v", "velocity", "linVelocity") and len(v) == 3 * count), None)
    return [Grain(f"{name}: point {i}", arrays["POINTS"][3 * i:3 * i + 3], factor * arrays[size][i],
                  speeds and speeds[3 * i:3 * i + 3]) for i in range(count)], "VTK points"


def read_gsd(path, frame):
    """HOOMD's GSD, where Python has its library."""
    try:
        import gsd.hoomd  # pylint: disable=import-outside-toplevel
    except ImportError:
        raise InputError(f"{path}: GSD files need Python's gsd (Debian: apt-get install python3-gsd)") from None
    try:
        with gsd.hoomd.open(path, "rb" if hasattr(gsd.hoomd, "HOOMDTrajectory") and not hasattr(gsd, "fl") else "r") as file:
            found = file[frame].particles
    except (OSError, RuntimeError, IndexError, ValueError) as error:
        raise InputError(f"{path}: cannot be read as GSD: {error}") from None
    return [Grain(f"{path}: particle {i}", [float(v) for v in p], 0.5 * float(d), [float(v) for v in w])
            for i, (p, d, w) in enumerate(zip(found.position, found.diameter, found.velocity))], "GSD"


def spreadsheet(line):
    """A row as spreadsheets write it where the comma is the decimal sign."""
    return [cell.strip().strip('"').replace(",", ".") for cell in line.split(";")] if line.strip() else []


def read_table(lines, name, first, renamed):
    """A first line that names the columns; `renamed` says what they are called."""
    head = lines[first].strip().lstrip("#").strip()
    split = spreadsheet if ";" in head else words
    names = [n.strip().strip('"') for n in (head.split(";") if ";" in head else head.replace(",", " ").split())]
    for known, called in renamed.items():
        if called not in names:
            raise InputError(f"{name}:{first + 1}: has no column '{called}'; the columns are {', '.join(names)}")
        names = [n if n != known else f"{n} of the file" for n in names]
        names[names.index(called if called != known else f"{known} of the file")] = known
    return read_rows(lines, name, Columns(names, f"{name}:{first + 1}"), first + 2, split), f"table of {' '.join(names)}"


def renaming(text):
    """{"x": "X_mm"} of "x=X_mm"; nothing where --columns names the columns themselves."""
    pairs = [part.partition("=") for part in text.split(",")] if "=" in text else []
    if any(not equals or not a.strip() or not b.strip() for a, equals, b in pairs):
        raise InputError(f"--columns {text}: must be x=NAME,y=NAME,... or the names of all columns")
    return {a.strip(): b.strip() for a, _, b in pairs}


def read(lines, name, options):
    """The grains of a text file, and what they are from; the header decides."""
    first = next((i for i, line in enumerate(lines) if line.strip()), None)
    if first is None:
        raise InputError(f"{name}: is empty")
    head = lines[first].strip()
    renamed = renaming(options.columns or "")
    if renamed:
        return read_table(lines, name, first, renamed)
    if options.columns:
        names = words(options.columns)
        return read_rows(lines, name, Columns(names, "--columns")), f"columns {' '.join(names)}"
    if head.startswith("ITEM:"):
        return lammps.read_dump(lines, name, options.frame)
    if head.startswith("#format"):
        return read_yade(lines[first:], name)
    if head.startswith("# vtk DataFile"):
        return read_vtk(lines[first:], name)
    if head.isdigit() and len(lines) > first + 1 and "Properties=" in lines[first + 1]:
        return read_xyz(lines, name, options.frame)
    if options.format == "yade" and is_numbers(words(head)):
        return read_rows(lines, name, Columns("x y z r".split(), name)), "Yade text, x_y_z_r"
    if any(line.split()[:1] == ["Atoms"] for line in lines):
        return lammps.read_data(lines, name, options.size)
    second = next((words(line) for line in lines[first + 1:] if words(line)), [])
    if is_numbers(words(head)) and (len(words(head)), len(second)) in ((6, 8), (8, 14), (8, 8)):
        return read_mercury(lines, name, options.frame)
    names = [n.strip().strip('"') for n in re.split(r"[;,\s]+", head.lstrip("#"))]
    if "x" in names and "y" in names:
        return read_table(lines, name, first, {})
    raise InputError(f"{name}:{first + 1}: '{head[:60]}' is no header that is known (see --help); where the rows have "
                     "none, say what they hold: --columns x,y,z,r; where they have other names: --columns x=NAME,...")


def contents(name):
    """The bytes of a file, unpacked."""
    try:
        with open(name, "rb") as file:
            data = file.read()
    except OSError as error:
        raise InputError(f"{name}: cannot be read: {error.strerror}") from None
    if not data.startswith(b"\x1f\x8b"):
        return data
    try:
        return gzip.decompress(data)
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        try:
            data = zlib.decompressobj(31).decompress(data)  # as far as it goes
        except zlib.error:
            raise InputError(f"{name}: cannot be unpacked: {error}") from None
        note(f"{name}: the compressed file is cut off or damaged ({error})")
        return data


def lines_of(data, name):
    """The file's lines, and whether the last one has an end."""
    wide = data.startswith((b"\xff\xfe", b"\xfe\xff"))
    try:
        text = data.decode("utf-16" if wide else "utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{name}: cannot be read as text: {error}") from None
    return text.splitlines(), text.endswith(("\n", "\r"))


def read_file(name, options):
    """The grains of a file, checked, and what they are from."""
    data = contents(name)
    if data.startswith(b"<?xml") or data.startswith(b"<VTKFile"):
        grains, source = read_vtp(data, name)
    elif name.lower().endswith(".gsd"):
        grains, source = read_gsd(name, options.frame)
    else:
        lines, ended = lines_of(data, name)
        framed = lines and (lines[0].startswith("ITEM:") or len(lines[0].split()) in (6, 8) or lines[0].strip().isdigit())
        if not ended and lines and not options.columns and framed:
            lines.pop()  # a number of it may be cut
        elif not ended and lines:
            note(f"{name}:{len(lines)}: the last line has no end; is the file whole?")
        grains, source = read(lines, name, options)
    if not grains:
        raise InputError(f"{name}: holds no grains")
    if bad := next((grain for grain in grains if not grain.radius > 0), None):
        raise InputError(f"{bad.where}: radius {bad.radius!r} is not above 0")
    return grains, source


def table_of(grains, source, name, options):
    """The text of the grain table."""
    axes = 2 if options.two else len(grains[0].point)
    clumps, speeds = any(g.clump for g in grains), options.velocities and all(g.velocity for g in grains)
    names = ["x", "y", "z"][:axes] + ["r"] + (["vx", "vy", "vz"][:axes] if speeds else []) + (["clump"] if clumps else [])
    text = [f"# {len(grains)}{MARK}{printable(name.rsplit('/', 1)[-1])} ({source}), lengths times {options.scale!r}",
            ",".join(names)]
    for g in grains:
        values = [repr(options.scale * v) for v in g.point[:axes] + [g.radius]]
        values += [repr(options.scale * v) for v in g.velocity[:axes]] if speeds else []
        text.append(",".join(values + ([printable(g.clump).replace(",", "_")] if clumps else [])))
    return "\n".join(text + [""])
