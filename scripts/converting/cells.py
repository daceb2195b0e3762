"""Cells that fill space: tessellations, meshes of volumes, and Voronoi cells. A cell is a name and its faces, each a
list of points in order (3D, seen from outside anticlockwise), or its closed lines (2D)."""

import re

import numpy as np

from converting.common import InputError


def sections_of(text, name):
    """{section: (line, words)} of a file of Neper; a word is (text, line)."""
    found, current = {}, None
    for number, line in enumerate(text.splitlines(), 1):
        for word in line.split():
            if word.startswith("**"):
                current = word.lstrip("*") if word.startswith("**") and not word.startswith("***") else None
                if current:
                    found[current] = []
            elif current:
                found[current].append((word, number))
    if "***end" not in text:
        raise InputError(f"{name}:{len(text.splitlines())}: does not end with ***end; it is cut off")
    return found


class Words:
    """Numbers one after the other."""

    def __init__(self, words, name, section):
        self.words, self.name, self.section, self.at = words, name, section, 0

    def next(self, kind=int):
        if self.at >= len(self.words):
            raise InputError(f"{self.name}: the section **{self.section} ends too early; it is cut off or damaged")
        text, line = self.words[self.at]
        self.at += 1
        try:
            return kind(text)
        except ValueError:
            raise InputError(f"{self.name}:{line}: '{text[:40]}' is not a number (section **{self.section})") from None

    def list(self, count, kind=int):
        return [self.next(kind) for _ in range(count)]


def read_tess(text, name):
    """Neper's tessellation: (dimension, cells)."""
    if not text.lstrip().startswith("***tess"):
        raise InputError(f"{name}:1: does not begin with ***tess")
    parts = sections_of(text, name)
    for key in ("general", "cell", "vertex", "edge", "face"):
        if key not in parts:
            raise InputError(f"{name}: has no section **{key}")
    dimension = Words(parts["general"], name, "general").next()
    cell_words = [w for w, _ in parts["cell"]]
    count = Words(parts["cell"], name, "cell").next()
    names = list(range(1, count + 1))
    if "*id" in cell_words:
        names = Words(parts["cell"][cell_words.index("*id") + 1:], name, "cell").list(count)
    words = Words(parts["vertex"], name, "vertex")
    points = {}
    for _ in range(words.next()):
        number = words.next()
        points[number] = [v + 0.0 for v in words.list(3, float)]
        words.next()  # state
    words = Words(parts["face"], name, "face")
    faces = []
    for _ in range(words.next()):
        words.next()
        corners = words.list(words.next())
        words.list(words.next())  # edges, which follow from the corners
        words.list(4, float)
        words.next(), words.next(), words.list(3, float)
        if any(c not in points for c in corners):
            raise InputError(f"{name}: face {len(faces) + 1} names a vertex that is not there")
        faces.append(np.array([points[c] for c in corners]))
    if dimension == 2:
        if len(faces) != count:
            raise InputError(f"{name}: has {len(faces)} faces for {count} cells")
        return 2, [(str(n), [face[:, :2]]) for n, face in zip(names, faces)]
    if "polyhedron" not in parts:
        raise InputError(f"{name}: has no section **polyhedron")
    words, cells = Words(parts["polyhedron"], name, "polyhedron"), []
    for i in range(words.next()):
        words.next()
        signed = words.list(words.next())
        if any(not 1 <= abs(f) <= len(faces) for f in signed):
            raise InputError(f"{name}: polyhedron {i + 1} names a face that is not there")
        cells.append((str(names[i]), outwards([faces[abs(f) - 1] for f in signed])))
    return 3, cells


def outwards(faces):
    """Faces of a convex cell, turned so that their normals point away from its middle."""
    middle = np.mean(np.concatenate(faces), axis=0)
    turned = []
    for face in faces:
        normal = sum(np.cross(face[i] - face[0], face[i + 1] - face[0]) for i in range(1, len(face) - 1))
        turned.append(face if normal @ (face.mean(axis=0) - middle) > 0 else face[::-1])
    return turned


def gmsh_sections(text, name):
    found = {}
    for match in re.finditer(r"^\$(\w+)\s*\n(.*?)^\$End\1", text, re.M | re.S):
        found[match.group(1)] = [line.split() for line in match.group(2).splitlines()]
    for key in ("MeshFormat", "Nodes", "Elements"):
        if key not in found:
            raise InputError(f"{name}: has no section ${key} that ends; it is cut off or damaged")
    version, form = found["MeshFormat"][0][:2]
    if form != "0":
        raise InputError(f"{name}: is binary; save it as text (Mesh.Binary = 0)")
    return found, float(version)


CORNERS = {2: 3, 4: 4}  # of triangles and tetrahedra


def gmsh_elements(found, version):
    """Points by number, and (kind, group, corners)."""
    names = {(int(row[0]), int(row[1])): " ".join(row[2:]).strip('"') for row in found.get("PhysicalNames", [])[1:]}
    if version < 4:
        points = {int(row[0]): [float(v) for v in row[1:4]] for row in found["Nodes"][1:]}
        rows = [(int(r[1]), int(r[3]) if int(r[2]) else 0, [int(v) for v in r[3 + int(r[2]):]]) for r in found["Elements"][1:]]
        return points, rows, names
    points, rows, groups, at = {}, [], {}, 1
    counts = [int(v) for v in found["Entities"][0]] if "Entities" in found else [0] * 4
    entities = iter(found.get("Entities", [])[1:])
    for dimension, count in enumerate(counts):
        for row in (next(entities) for _ in range(count)):
            skip = 4 if dimension == 0 else 7
            if int(row[skip]):
                groups[dimension, int(row[0])] = abs(int(row[skip + 1]))
    nodes = found["Nodes"]
    while at < len(nodes):
        count = int(nodes[at][3])
        for number, place in zip(nodes[at + 1:at + 1 + count], nodes[at + 1 + count:at + 1 + 2 * count]):
            points[int(number[0])] = [float(v) for v in place[:3]]
        at += 1 + 2 * count
    elements, at = found["Elements"], 1
    while at < len(elements):
        dimension, tag, kind, count = (int(v) for v in elements[at][:4])
        rows += [(kind, groups.get((dimension, tag), tag), [int(v) for v in row[1:]]) for row in elements[at + 1:at + 1 + count]]
        at += 1 + count
    return points, rows, names


def read_msh(text, name):
    """Gmsh's mesh (2.2 or 4.1, text): a cell for each physical volume, in 2D each physical surface."""
    found, version = gmsh_sections(text, name)
    try:
        points, rows, names = gmsh_elements(found, version)
    except (ValueError, IndexError, StopIteration) as error:
        raise InputError(f"{name}: is damaged: {error}") from None
    dimension = 3 if any(kind == 4 for kind, _, _ in rows) else 2
    groups = {}
    if short := next((number for number, place in points.items() if len(place) != 3), None):
        raise InputError(f"{name}: node {short} has {len(points[short])} coordinates instead of 3; it is cut off or damaged")
    for kind, group, corners in rows:
        if kind == (4 if dimension == 3 else 2):
            if len(corners) < CORNERS[kind]:
                raise InputError(f"{name}: an element of {CORNERS[kind]} nodes names {len(corners)}; it is cut off or damaged")
            groups.setdefault(group, []).append(corners[:CORNERS[kind]])
    if not groups:
        raise InputError(f"{name}: holds neither triangles nor tetrahedra")
    if missing := next((c for cs in groups.values() for e in cs for c in e if c not in points), None):
        raise InputError(f"{name}: an element names node {missing}, which is not there")
    try:
        return dimension, [(names.get((dimension, group), str(group)), boundary(elements, points, dimension))
                           for group, elements in sorted(groups.items())]
    except InputError as error:
        raise InputError(f"{name}: {error}") from None


def boundary(elements, points, dimension):
    """The sides that one element alone has, in order."""
    alone = {}
    sides = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)] if dimension == 3 else [(0, 1), (1, 2), (2, 0)]
    for element in elements:
        place = np.array([points[c] for c in element])
        edges = place[1:, :dimension] - place[0, :dimension]
        if np.linalg.det(edges) < 0:
            element = [element[1], element[0], *element[2:]]
        for side in sides:
            corners = tuple(element[k] for k in side)
            key = tuple(sorted(corners))
            alone[key] = None if key in alone else corners
    open_sides = [corners for corners in alone.values() if corners]
    if dimension == 3:
        return [np.array([points[c] for c in corners]) for corners in open_sides]
    following, lines = dict(open_sides), []
    while following:
        start, to = following.popitem()
        line = [start]
        while to != start:
            line.append(to)
            if to not in following:
                raise InputError(f"the outline of a surface does not close at node {to}")
            to = following.pop(to)
        lines.append(np.array([points[c][:2] for c in line]))
    return lines


def voronoi(count, size, seed, gap, rounding):
    """Cells of `count` places at random in a box, `gap` apart, their edges rounded by a radius."""
    from scipy.spatial import Voronoi  # pylint: disable=import-outside-toplevel
    dimension, size = len(size), np.array(size)
    random = np.random.default_rng(seed)
    places = random.uniform(size=(count, dimension)) * size
    for _ in range(5):  # towards the middles of their cells: less uneven
        samples = random.uniform(size=(200 * count, dimension)) * size
        from scipy.spatial import cKDTree  # pylint: disable=import-outside-toplevel
        nearest = cKDTree(places).query(samples)[1]
        sums = np.stack([np.bincount(nearest, samples[:, k], count) for k in range(dimension)], axis=1)
        places = sums / np.maximum(np.bincount(nearest, minlength=count), 1)[:, None]
    mirrored = [places]
    for k in range(dimension):
        for wall in (0.0, size[k]):
            other = places.copy()
            other[:, k] = 2 * wall - other[:, k]
            mirrored.append(other)
    diagram, cells = Voronoi(np.concatenate(mirrored)), []
    for i in range(count):
        corners = diagram.vertices[diagram.regions[diagram.point_region[i]]]
        shrunk = inset(np.clip(corners, 0, size), places[i], 0.5 * gap + rounding)
        if shrunk is not None:
            cells.append((str(i), hull(rounded(shrunk, rounding))))
    return dimension, cells


def inset(corners, within, by):
    """Corners of a convex cell without a layer of this thickness; None where nothing is left."""
    from scipy.spatial import ConvexHull, HalfspaceIntersection, QhullError  # pylint: disable=import-outside-toplevel
    if by == 0:
        return corners
    planes = np.unique(np.round(ConvexHull(corners).equations, 12), axis=0)
    planes[:, -1] += by
    if (planes[:, :-1] @ within + planes[:, -1]).max() >= 0:
        return None
    try:
        return HalfspaceIntersection(planes, within).intersections
    except QhullError:
        return None


def rounded(corners, radius):
    """Points of the cell with a ball of this radius rolled around it."""
    if radius == 0:
        return corners
    if corners.shape[1] == 2:
        angles = np.arange(24) * 2 * np.pi / 24
        around = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    else:
        k = np.arange(120) + 0.5  # evenly over the sphere
        polar, turn = np.arccos(1 - 2 * k / 120), np.pi * (1 + 5 ** 0.5) * k
        around = np.stack([np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)], axis=1)
    return (corners[:, None] + radius * around[None]).reshape(-1, corners.shape[1])


def hull(points):
    from scipy.spatial import ConvexHull  # pylint: disable=import-outside-toplevel
    found = ConvexHull(points)
    if points.shape[1] == 2:
        return [points[found.vertices]]
    faces = []
    for corners, plane in zip(found.simplices, found.equations):
        a, b, c = points[corners]
        faces.append(np.array([a, b, c] if np.cross(b - a, c - a) @ plane[:3] > 0 else [a, c, b]))
    return faces


def text_of(dimension, cells, source):
    """OBJ with an object for each cell, or CSV with a line for each (2D)."""
    if dimension == 2:
        rows = [f"# {len(cells)} cells from {source}", "x,y,line"]
        for name, lines in cells:
            for k, line in enumerate(lines):
                rows += [f"{float(x)!r},{float(y)!r},{name}{f'.{k}' if k else ''}" for x, y in line]
        return "\n".join(rows + [""])
    rows, count = [f"# {len(cells)} cells from {source}"], 0
    for name, faces in cells:
        rows.append(f"o {name}")
        known, numbered = {}, []
        for face in faces:
            numbered.append([known.setdefault(tuple(float(v) for v in p), len(known)) for p in face])
        rows += ["v {!r} {!r} {!r}".format(*p) for p in known]
        rows += ["f " + " ".join(str(1 + count + c) for c in face) for face in numbered]
        count += len(known)
    return "\n".join(rows + [""])
