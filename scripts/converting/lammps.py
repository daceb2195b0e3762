"""LAMMPS and LIGGGHTS: dumps and data files."""

from converting.common import CutOff, InputError
from converting.rows import SIZES, VELOCITIES, Columns, Grain, chosen, number, whole_frames, words


def add_frames(lines, name, frames):
    """Frames of a dump: (step, bounds, columns, first line number of the rows, rows)."""
    step, count, bounds = None, None, None
    at = 0

    def take(n, what):
        nonlocal at
        if at + n > len(lines):
            raise CutOff(f"{name}:{len(lines)}: ends in the middle of {what}; {n} lines were to come")
        at += n
        return lines[at - n:at]

    while at < len(lines):
        item = lines[at].split()
        at += 1
        if not item:
            continue
        if item[0] != "ITEM:":
            raise InputError(f"{name}:{at}: expected a line that begins with ITEM:")
        if item[1:2] == ["TIMESTEP"]:
            step = take(1, "TIMESTEP")[0].strip()
        elif item[1:4] == ["NUMBER", "OF", "ATOMS"]:
            text = take(1, "NUMBER OF ATOMS")[0].strip()
            if not text.isdigit():
                raise InputError(f"{name}:{at}: '{text}' is not a number of atoms")
            count = int(text)
        elif item[1:3] == ["BOX", "BOUNDS"]:
            bounds = [[number(v, f"{name}:{at}") for v in line.split()] for line in take(3, "BOX BOUNDS")]
            if item[3:4] == ["abc"] or any(len(row) not in (2, 3) for row in bounds):
                raise InputError(f"{name}:{at}: BOX BOUNDS must hold 2 numbers in a row, 3 where the box is tilted")
        elif item[1:2] == ["ATOMS"]:
            if count is None:
                raise InputError(f"{name}:{at}: ITEM: ATOMS without ITEM: NUMBER OF ATOMS before it")
            first = at + 1
            frames.append((step, bounds, item[2:], first, take(count, "ATOMS")))
            count = None
        elif item[1:2] in (["UNITS"], ["TIME"]):
            take(1, " ".join(item))
        else:
            raise InputError(f"{name}:{at}: ITEM: {' '.join(item[1:3])} is not known; known are TIMESTEP, NUMBER OF "
                             "ATOMS, BOX BOUNDS, ATOMS, UNITS, TIME")


def edges_of(bounds):
    """Lower corner and edges of a box, tilted or not; a tilted one is given by the bounds around it."""
    tilt = [row[2] if len(row) == 3 else 0.0 for row in bounds]
    xy, xz, yz = tilt
    low = [bounds[0][0] - min(0.0, xy, xz, xy + xz), bounds[1][0] - min(0.0, yz), bounds[2][0]]
    high = [bounds[0][1] - max(0.0, xy, xz, xy + xz), bounds[1][1] - max(0.0, yz), bounds[2][1]]
    return low, [[high[0] - low[0], 0.0, 0.0], [xy, high[1] - low[1], 0.0], [xz, yz, high[2] - low[2]]]


def positions(columns, bounds, name, line):
    """What makes a point of the values in a row."""
    for suffix in ("", "u", "s", "su"):
        names = [letter + suffix for letter in "xyz"]
        if any(n in columns for n in names):
            break
    for axis, column in zip("xyz", names):
        if column not in columns:
            raise InputError(f"{name}:{line}: no column {axis}; columns are: {' '.join(columns)}")
    places = [columns.index(n) for n in names]
    if "s" not in suffix:
        return lambda values: [values[p] for p in places]
    if not bounds:
        raise InputError(f"{name}:{line}: scaled positions ({names[0]}) need BOX BOUNDS")
    low, edges = edges_of(bounds)
    return lambda values: [low[k] + sum(values[p] * edge[k] for p, edge in zip(places, edges)) for k in range(3)]


def read_dump(lines, name, frame):
    step, bounds, columns, first, rows = chosen(whole_frames(add_frames, lines, name), frame, name)
    size = next((s for s in ("radius", "diameter") if s in columns), None)
    if size is None:
        raise InputError(f"{name}:{first - 1}: no column radius or diameter; columns are: {' '.join(columns)}")
    place, size_column = positions(columns, bounds, name, first - 1), columns.index(size)
    id_column = columns.index("id") if "id" in columns else None
    speeds = [columns.index(v) for v in VELOCITIES] if all(v in columns for v in VELOCITIES) else []
    grains = []
    for line, row in enumerate(rows, first):
        where, texts = f"{name}:{line}", row.split()
        if len(texts) < len(columns):
            raise InputError(f"{where}: {len(texts)} values for {len(columns)} columns")
        values = {i: number(texts[i], where) for i, column in enumerate(columns)
                  if column[0] in "xyzv" or i in (size_column, id_column)}
        grains.append((values[id_column] if id_column is not None else line,
                       Grain(where, place(values), SIZES[size] * values[size_column], [values[v] for v in speeds] or None)))
    grains.sort(key=lambda grain: grain[0])  # LAMMPS writes atoms in the order of its ranks
    return [grain for _, grain in grains], f"LAMMPS dump, step {step}"


def data_size(size, rows, low, title, name):
    """The factor from the third column of an Atoms section to the radius. By definition it holds the diameter; Yade
    writes the radius, and a box that just holds the spheres."""
    if size:
        return SIZES[size]
    if not title.startswith("LIGGGHTS Description"):
        return 0.5
    fits = [factor for factor in (1.0, 0.5)
            if low is not None and abs(min(x - factor * d for x, d in rows) - low) <= 1e-4 * max(d for _, d in rows)]
    if len(fits) == 1:
        return fits[0]
    raise InputError(f"{name}: whether the third column of Atoms is the radius (Yade) or the diameter (LIGGGHTS) "
                     "cannot be told; say --size radius or --size diameter")


def read_data(lines, name, size):
    """A data file of LAMMPS or LIGGGHTS with atoms of style sphere or granular."""
    title = lines[0].strip()
    start = next((i for i, line in enumerate(lines) if line.split()[:1] == ["Atoms"]), None)
    if start is None:
        raise InputError(f"{name}: holds no section Atoms")
    if (style := lines[start].partition("#")[2].strip()) not in ("", "sphere", "granular"):
        raise InputError(f"{name}:{start + 1}: the style '{style[:60]}' is not known; known are sphere, granular")
    head = [line.split() for line in lines[:start]]
    count = next((int(w[0]) for w in head if w[1:] == ["atoms"] and w[0].isdigit()), None)
    low = next((number(w[0], name) for w in head if w[2:] == ["xlo", "xhi"]), None)
    rows = []
    for i, line in enumerate(lines[start + 1:], start + 2):
        values = words(line)
        if not values:
            continue
        if len(rows) == count or not values[0].isdigit():
            break
        if len(values) < 7:
            raise InputError(f"{name}:{i}: {len(values)} values; an atom has id type diameter density x y z")
        rows.append((i, values))
    if count is not None and len(rows) < count:
        raise InputError(f"{name}:{len(lines)}: holds {len(rows)} of its {count} atoms; it is cut off")
    if not rows:
        return [], ""
    pairs = [(number(v[4], f"{name}:{i}"), number(v[2], f"{name}:{i}")) for i, v in rows]
    columns = Columns("id type d density x y z".split(), name)
    columns.factor = data_size(size, pairs, low, title, name)
    source = f"data file, {'radius' if columns.factor == 1 else 'diameter'}"
    return [columns.grain(values, f"{name}:{i}") for i, values in rows], source
