"""Wrong input: exit code 2, one report that names file, line and key, the same on 1 and 2 ranks, and nothing created.

Usage: python test_bad_input.py CAIRN_EXE SCRATCH_DIR
"""

import concurrent.futures
import dataclasses
import os
import sys
import time

from harness import Program, fresh_folder

BASE = """\
title = "two disks"
[domain]
dimension = 2
lower = [0.0, 0.0]
upper = [1.0, 1.0]
cells = [20, 20]
periodic = [false, false]
[time]
end = 0.1
cfl = 0.4
[solver]
shape = "gimp"
points_per_cell = 4
[contact]
friction = 0.3
[materials.soft]
model = "neo_hookean"
density = 1000.0
shear_modulus = 1.0e5
bulk_modulus = 2.0e5
[[bodies]]
shape = { type = "disk", centre = [0.3, 0.5], radius = 0.15 }
material = "soft"
velocity = [1.0, 0.0]
[[bodies]]
shape = { type = "disk", centre = [0.7, 0.5], radius = 0.15 }
material = "soft"
group = "right"
[boundary]
left = { type = "wall" }
[output]
history = { every = 1 }
"""

END = BASE.count("\n") + 1  # number of a line that follows

GRAINS = '[[grains]]\nfile = "pack.csv"\nmaterial = "soft"\n'

PACK = """\
[pack]
lower = [0.0, 0.0]
upper = [1.0, 1.0]
count = 20
[sizes]
type = "uniform"
min = 0.05
max = 0.06
"""


@dataclasses.dataclass
class Bad:
    """One wrong input: files to write, arguments, and what standard error must hold."""

    name: str
    expect: list
    files: dict
    args: list = dataclasses.field(default_factory=lambda: ["run", "case.toml", "--out", "out"])
    prepare: object = None  # called with the folder


def changed(old, new):
    """The base case with one text replaced, which must be there once."""
    assert BASE.count(old) == 1, old
    return BASE.replace(old, new)


def line_of(text, fragment):
    """Number of the first line that holds the fragment."""
    return next(i for i, line in enumerate(text.splitlines(), 1) if fragment in line)


def case(name, old, new, at, key, *words):
    """A wrong case: `old` becomes `new`; the error is at the line that holds `at` and names `key`."""
    text = changed(old, new)
    return Bad(name, [f"case.toml:{line_of(text, at)}: {key}: ", *words], {"case.toml": text})


def added(name, text, at, key, *words):
    """A wrong case: text is added at its end."""
    whole = BASE + text
    return Bad(name, [f"case.toml:{line_of(whole, at)}: {key}: ", *words], {"case.toml": whole})


def override(name, key, value, *words):
    args = ["run", "case.toml", "--out", "out", "--set", f"{key}={value}"]
    return Bad(name, [f"--set {key}: ", *words], {"case.toml": BASE}, args)


def table(name, rows, line, *words):
    """A wrong grain table."""
    return Bad(name, [f"pack.csv:{line}: ", *words], {"case.toml": BASE + GRAINS, "pack.csv": rows})


def pack(name, old, new, at, *words):
    """A wrong pack specification."""
    assert PACK.count(old) == 1, old
    text = PACK.replace(old, new)
    where = f"spec.toml:{line_of(text, at)}: " if at else "spec.toml:"
    return Bad(name, [where, *words], {"spec.toml": text}, ["pack", "spec.toml", "-o", "made.csv"])


def usage(name, args, *words):
    return Bad(name, list(words), {"case.toml": BASE}, args)


CASES = [
    case("unknown_key", "cells = ", "cels = ", "cels", "domain.cels", "unknown key", "'cells'"),
    case("unknown_table", "[solver]", "[slover]", "[slover]", "slover", "unknown key", "'solver'"),
    case("unknown_material_key", "bulk_modulus", "bulk_modulos", "bulk_modulos", "materials.soft.bulk_modulos",
         "'bulk_modulus'"),
    case("wrong_type", "end = 0.1", 'end = "soon"', "soon", "time.end", "is a string", "greater than 0"),
    case("number_for_text", 'title = "two disks"', "title = 2", "title", "title", "must be a string"),
    case("table_for_number", "cfl = 0.4", "cfl = { a = 1 }", "cfl", "time.cfl", "is a table"),
    case("negative_density", "density = 1000.0", "density = -1.0", "density", "materials.soft.density", "-1",
         "greater than 0"),
    case("missing_density", "density = 1000.0\n", "", "[materials.soft]", "materials.soft.density", "missing"),
    case("zero_cells", "cells = [20, 20]", "cells = [0, 20]", "cells =", "domain.cells", "in [1, 1000000]"),
    case("fractional_cells", "cells = [20, 20]", "cells = [20.5, 20]", "cells =", "domain.cells", "whole number"),
    case("cell_size_no_divisor", "cells = [20, 20]", "cell_size = 0.03", "cell_size", "domain.cell_size",
         "whole cells"),
    case("cells_and_size", "cells = [20, 20]", "cells = [20, 20]\ncell_size = 0.05", "cell_size", "domain.cell_size",
         "one of the two"),
    case("upper_below_lower", "upper = [1.0, 1.0]", "upper = [1.0, -1.0]", "upper", "domain.upper", "greater"),
    case("dimension_4", "dimension = 2", "dimension = 4", "dimension", "domain.dimension", "in [2, 3]"),
    Bad("missing_table", ["case.toml:1: domain: ", "missing"],
        {"case.toml": BASE[: BASE.index("[domain]")] + BASE[BASE.index("[time]"):]}),
    case("no_end", "end = 0.1\n", "", "[time]", "time.end", "missing", "steps"),
    case("body_outside", "centre = [0.3, 0.5]", "centre = [-3.0, 0.5]", "centre = [-3", "bodies.0.shape",
         "outside the domain"),
    case("body_beyond_corner", "centre = [0.3, 0.5]", "centre = [-0.14, -0.14]", "centre = [-0.14", "bodies.0.shape",
         "corner"),
    case("nan", "radius = 0.15 }\nmaterial = \"soft\"\nvelocity", "radius = nan }\nmaterial = \"soft\"\nvelocity",
         "nan",
         "bodies.0.shape.radius", "greater than 0"),
    case("infinity", "velocity = [1.0, 0.0]", "velocity = [inf, 0.0]", "inf,", "bodies.0.velocity", "finite"),
    case("unknown_material", 'material = "soft"\ngroup', 'material = "sfot"\ngroup', "sfot", "bodies.1.material",
         "known are soft"),
    case("unknown_model", '"neo_hookean"', '"neo_hokean"', "neo_hokean", "materials.soft.model", "choose one of",
         "neo_hookean", "von_mises"),
    case("one_modulus_only", "bulk_modulus = 2.0e5\n", "", "[materials.soft]", "materials.soft.bulk_modulus",
         "missing"),
    case("both_modulus_pairs", "bulk_modulus = 2.0e5",
         "bulk_modulus = 2.0e5\nyoungs_modulus = 1.0e5\npoissons_ratio = 0.3",
         "youngs_modulus", "materials.soft.youngs_modulus", "one pair"),
    case("poissons_ratio", "shear_modulus = 1.0e5\nbulk_modulus = 2.0e5",
         "youngs_modulus = 1.0e5\npoissons_ratio = 0.5",
         "poissons_ratio", "materials.soft.poissons_ratio", "(-1, 0.5)"),
    case("vector_length", "velocity = [1.0, 0.0]", "velocity = [1.0, 0.0, 0.0]", "velocity", "bodies.0.velocity",
         "3 entries", "2 numbers"),
    case("periodic_face", "periodic = [false, false]", "periodic = [true, false]", "left =", "boundary.left",
         "periodic"),
    case("periodic_too_few_cells", "cells = [20, 20]\nperiodic = [false, false]",
         "cells = [20, 3]\nperiodic = [false, true]",
         "periodic", "domain.periodic", "at least 4"),
    case("points_per_cell", "points_per_cell = 4", "points_per_cell = 5", "points_per_cell", "solver.points_per_cell",
         "square", "4, 9, 16"),
    case("unknown_choice", '"gimp"', '"cubic"', "cubic", "solver.shape", "linear, gimp, bspline2"),
    case("negative_friction", "friction = 0.3", "friction = -0.3", "friction", "contact.friction", "at least 0"),
    case("unknown_shape", '"disk", centre = [0.3', '"dsik", centre = [0.3', "dsik", "bodies.0.shape.type",
         "choose one of", "polygon"),
    case("sphere_in_2d", '"disk", centre = [0.3', '"sphere", centre = [0.3', "sphere", "bodies.0.shape.type", "disk"),
    case("face_of_3d", "left = ", "back = ", "back", "boundary.back", "3D"),
    case("face_type", '"wall" }', '"wal" }', "wal", "boundary.left.type", "free, fixed, symmetry, wall"),
    case("face_velocity", '"wall" }', '"free", velocity = [0.0, 0.0] }', "free", "boundary.left.velocity",
         "fixed or wall"),
    case("schedule_zero", "every = 1", "every = 0", "every", "output.history.every", "at least 1"),
    Bad("duplicate_key", ["case.toml:10: ", "TOML", "end"], {"case.toml": changed("cfl = 0.4", "end = 0.2")}),
    Bad("long_key", [f"case.toml:{END}: ", "TOML", "more than 32 parts"],
        {"case.toml": BASE + "a" + ".a" * 50_000 + " = 1\n"}),
    Bad("long_table", [f"case.toml:{END}: ", "more than 32 parts"],
        {"case.toml": BASE + "[a" + ".'a.#'" * 50_000 + "]\n"}),
    Bad("long_inline", [f"case.toml:{END}: ", "more than 32 parts"],
        {"case.toml": BASE + "b = { c = 1.5, a" + '."a"' * 50_000 + " = 1 }\n"}),
    Bad("escape_sequences", [f"case.toml:{END}: ", "?[2J"], {"case.toml": BASE + '["\\u001b[2J\\u009b1m"]\na = 1\n'}),
    Bad("syntax", ["case.toml:9: ", "TOML"], {"case.toml": changed("end = 0.1", "end = ")}),
    Bad("all_at_once",
        ["case.toml:6: domain.cells", "case.toml:10: time.cfl", "case.toml:18: materials.soft.density", "3 errors"],
        {"case.toml": BASE.replace("[20, 20]", "20.5").replace("cfl = 0.4", "cfl = 2").replace("1000.0", "0.0")}),
    Bad("no_point", ["case.toml:21: body 0 holds no material point", "smaller cells"],
        {"case.toml": changed('type = "disk", centre = [0.3, 0.5], radius = 0.15',
                              'type = "box", lower = [0.2, 0.505], upper = [0.8, 0.510]')}),
    table("grain_no_point", "x,y,r\n0.5,0.8,0.1\n0.5,0.55,0.002\n", 3, "body 3 holds no material point"),
    case("crossing_polygon", 'type = "disk", centre = [0.3, 0.5], radius = 0.15',
         'type = "polygon", points = [[0.1,0.1],[0.9,0.9],[0.9,0.1],[0.1,0.8]]', "polygon", "bodies.0.shape.points",
         "[0.1, 0.1] and [0.9, 0.1] cross or touch", "order"),
    added("unknown_field", 'particles = { every = 1, fields = ["temperature"] }\n', "temperature",
          "output.particles.fields",
          "choose from velocity"),
    added("track_range", "track = [2]\n", "track", "output.track", "body 2 does not exist", "0 to 1"),
    added("drive_range", "[[drive]]\nids = [7]\n", "ids", "drive.0.ids", "body 7 does not exist"),
    added("drive_group", '[[drive]]\nbodies = { group = "rihgt" }\n', "rihgt", "drive.0.bodies.group", "no body"),
    added("drive_nothing", "[[drive]]\nvelocity = [0.0, 1.0]\n", "[[drive]]", "drive.0.bodies", "give one of"),
    added("drive_face", '[[drive]]\nbodies = { overlapping = "left" }\n', "overlapping", "drive.0.bodies.overlapping",
          "no body reaches"),
    added("pair_material", '[[contact.pair]]\nmaterials = ["soft", "hard"]\n', "hard", "contact.pair.0.materials",
          "known are soft, wall"),
    added("pair_wall_or_material", '[materials.wall]\nmodel = "rigid"\ndensity = 1.0\n'
          '[[contact.pair]]\nmaterials = ["soft", "wall"]\n', '["soft", "wall"]', "contact.pair.0.materials",
          '"wall" is a material here'),
    added("unknown_partition", '[parallel]\npartition = "metsi"\n', "metsi", "parallel.partition",
          "metis, curve, round_robin"),
    added("grain_table_missing", GRAINS, "pack.csv", "grains.0.file", "there is no file"),
    Bad("no_bodies", ["case.toml:1: bodies: ", "no body"],
        {"case.toml": BASE[: BASE.index("[[bodies]]")] + BASE[BASE.index("[boundary]"):]}),
    Bad("grain_table_is_folder", ["pack.csv", "is a folder"], {"case.toml": BASE + GRAINS},
        prepare=lambda d: (d / "pack.csv").mkdir()),
    table("grain_header", "x,y,radius\n0.5,0.9,0.05\n", 1, '"radius"', "'r'", "x,y,r"),
    table("grain_no_column", "# grains\nx,r\n0.5,0.05\n", 2, "y: ", "missing"),
    table("grain_number", "x,y,r\n0.5,0.9,0.05\n0.2,O.9,0.05\n", 3, "y: ", "O.9", "not a number"),
    table("grain_radius", "x,y,r\n0.5,0.9,0\n", 2, "r: ", "greater than 0"),
    table("grain_nan", "x,y,r\nnan,0.9,0.05\n", 2, "x: ", "finite"),
    table("grain_columns", "x,y,r\n0.5,0.9\n", 2, "has 2 values", "3 columns"),
    table("grain_material", "x,y,r,material\n0.5,0.9,0.05,sfot\n", 2, "material: ", "known are soft"),
    table("grain_outside", "x,y,r\n0.5,0.9,0.05\n0.5,1.9,0.05\n", 3, "outside the domain"),
    Bad("grain_utf16", ["pack.csv: ", "UTF-16", "UTF-8"],
        {"case.toml": BASE + GRAINS, "pack.csv": "\ufeffx,y,r\n0.5,0.8,0.1\n".encode("utf-16-le")}),
    table("grain_table_empty", "", 1, "header"),
    table("grain_table_no_rows", "x,y,r\n", 1, "no grains"),
    table("grain_huge_line", "x,y,r\n" + "9" * 1_000_000 + "\n", 2, "has 1 values"),
    Bad("grain_many_errors", ["pack.csv:2: r: ", "pack.csv:21: r: ", "... and 30 more"],
        {"case.toml": BASE + GRAINS, "pack.csv": "x,y,r\n" + "0.5,0.9,-1\n" * 50}),
    Bad("grain_table_junk", ["pack.csv", "not a text file"],
        {"case.toml": BASE + GRAINS, "pack.csv": bytes(range(256)) * 8}),
    Bad("empty_file", ["case.toml:1: ", "empty"], {"case.toml": ""}),
    Bad("binary_junk", ["case.toml", "not a text file"], {"case.toml": bytes(range(256)) * 100}),
    Bad("text_junk", ["case.toml:1: ", "TOML"], {"case.toml": b"\x89PNG\r\n\x1a\n\xff\xfe\xfd" * 10}),
    Bad("file_is_folder", ["case.toml", "is a folder"], {}, prepare=lambda d: (d / "case.toml").mkdir()),
    Bad("file_missing", ["case.toml", "no such file"], {}),
    Bad("unreadable_file", ["case.toml", "cannot be read"], {"case.toml": BASE},
        prepare=lambda d: (d / "case.toml").chmod(0)),
    override("set_unknown_key", "contact.frictoin", "0.5", "unknown key", "'friction'"),
    override("set_range", "time.end", "-1", "greater than 0"),
    override("set_not_toml", "contact.law", "no slip", "quotes"),
    override("set_no_such_word", "contact.law", "stik", "choose one of", "stick"),
    override("set_word_for_number", "time.end", "soon", "is a string", "greater than 0"),
    override("set_word_for_boolean", "solver.spin", "yes", "is a string", "true or false"),
    override("set_index", "bodies.5.velocity", "[0.0, 1.0]", "2 entries"),
    override("set_inside_value", "time.end.more", "1", "plain value"),
    Bad("set_long_key", ["--set a.a.a", "a key of 20001 parts"], {"case.toml": BASE},
        ["run", "case.toml", "--out", "out", "--set", "a" + ".a" * 20_000 + "=1"]),
    override("set_long_value", "contact", "{ a" + ".a" * 20_000 + " = 1 }", "not a TOML value"),
    override("set_two_values", "time.steps", "1\nx = 2", "not a TOML value"),
    usage("set_no_value", ["run", "case.toml", "--out", "out", "--set", "time.steps"], "--set time.steps", "KEY=VALUE"),
    usage("no_command", []),
    usage("unknown_command", ["rnu", "case.toml"]),
    usage("unknown_option", ["run", "case.toml", "--uot", "out"], "--uot"),
    usage("no_case", ["run", "--out", "out"], "CASE.toml", "required"),
    usage("out_is_file", ["run", "case.toml", "--out", "case.toml"], "--out", "case.toml", "not a folder"),
    usage("out_below_file", ["run", "case.toml", "--out", "case.toml/out"], "--out", "cannot be made"),
    usage("out_unwritable", ["run", "case.toml", "--out", "/proc/cairn/out"], "--out", "/proc/cairn/out",
          "cannot be made"),
    usage("overwrite_restart", ["run", "case.toml", "--out", "out", "--overwrite", "--restart", "latest"],
          "--overwrite", "--restart"),
    usage("check_set_no_value", ["check", "case.toml", "--set", "time.steps"], "--set time.steps", "KEY=VALUE"),
    usage("restart_missing", ["run", "case.toml", "--out", "out", "--restart", "nowhere.h5"], "nowhere.h5"),
    usage("info_missing", ["info", "nothing.h5"], "nothing.h5"),
    usage("info_not_hdf5", ["info", "case.toml"], "case.toml"),
    usage("pack_no_output", ["pack", "case.toml"], "-o"),
    Bad("pack_folder", ["-o: nowhere/made.csv", "folder"], {"spec.toml": PACK},
        ["pack", "spec.toml", "-o", "nowhere/made.csv"]),
    pack("pack_unknown_key", "count", "cuont", "cuont", "pack.cuont", "'count'"),
    pack("pack_choice", '"uniform"', '"unform"', "unform", "sizes.type", "uniform, lognormal, list, fit"),
    pack("pack_negative", "min = 0.05", "min = -0.05", "min =", "sizes.min", "greater than 0"),
    pack("pack_no_sizes", PACK[PACK.index("[sizes]"):], "", None, "sizes", "missing"),
    pack("pack_too_full", "count = 20", "count = 20000", None, "pack.count"),
]

def fixed_left(rows, more=""):
    """Files of a case with disks beside a fixed left face; cells are 0.05 wide."""
    text = BASE.replace('left = { type = "wall" }', 'left = { type = "fixed" }').replace("[0.3, 0.5]", "[0.45, 0.5]")
    return {"case.toml": text.replace("[0.7, 0.5]", "[0.8, 0.5]") + GRAINS + more, "pack.csv": "x,y,r\n" + rows}


@dataclasses.dataclass
class Warning_:
    """Input that is right but doubtful; with nothing to expect, not even that."""

    name: str
    expect: list
    files: dict


WARNINGS = [
    Warning_("byte_order_marks", [], {"case.toml": "\ufeff" + BASE + GRAINS,
                                     "pack.csv": "\ufeffx,y,r\r\n0.5,0.87,0.1\r\n"}),
    Warning_("closed_polygon", [],
             {"case.toml": changed('type = "disk", centre = [0.3, 0.5], radius = 0.15',
                                   'type = "polygon", points = [[0.1,0.1],[0.4,0.1],[0.3,0.2],[0.4,0.4],[0.1,0.1]]')}),
    Warning_("overlap", ["warning: ", "case.toml:21", "overlaps body 1", "1 pairs"],
             {"case.toml": changed("centre = [0.7, 0.5]", "centre = [0.5, 0.5]")}),
    Warning_("periodic_overlap", ["warning: ", "overlaps", "1 pairs"],
             {"case.toml": BASE.replace("[false, false]", "[true, false]").replace("left =", "bottom =")
              .replace("[0.3, 0.5]", "[0.1, 0.5]").replace("[0.7, 0.5]", "[0.9, 0.5]")}),
    Warning_("thin_grain", ["warning: ", "pack.csv:3", "2 of 5 bodies", "thinner than 2 cells"],
             {"case.toml": BASE + GRAINS, "pack.csv": "x,y,r\n0.5,0.8,0.1\n0.1,0.1,0.03\n0.9,0.1,0.04\n"}),
    Warning_("near_fixed_face",
             ["warning: pack.csv:2: body 2 lies 0.4 cells from the fixed face left", "2 of 5 bodies"],
             fixed_left("0.12,0.8,0.1\n0.8,0.87,0.1\n0.149,0.2,0.1\n")),
    Warning_("on_or_far_from_fixed_face", [], fixed_left("0.1,0.8,0.1\n0.09,0.2,0.1\n0.151,0.5,0.1\n")),
    Warning_("driven_near_fixed_face", [],
             fixed_left("0.12,0.8,0.1\n", '[[drive]]\nids = [2]\nvelocity = [0.0, 1.0]\n')),
]


def write(folder, files):
    folder.mkdir(parents=True)
    for name, content in files.items():
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())


def check_bad(bad, scratch, cairn):
    """Problems found with one wrong input."""
    folder = scratch / bad.name
    write(folder, bad.files)
    if bad.prepare:
        bad.prepare(folder)
    before = sorted(p.name for p in folder.iterdir())
    problems, reports = [], []
    for ranks in (1, 2):
        done = cairn(*bad.args, ranks=ranks, cwd=folder, timeout=60)
        report = done.err
        reports.append(report)
        if done.code != 2:
            problems.append(f"{ranks} ranks: exit code {done.code} instead of 2")
        problems += [f"{ranks} ranks: '{text}' is not in the report" for text in bad.expect if text not in report]
        if not report:
            problems.append(f"{ranks} ranks: no report")
        if any(ord(c) < 32 and c != "\n" or 127 <= ord(c) < 160 for c in report):
            problems.append(f"{ranks} ranks: control characters in the report")
        for trace in ("terminate called", "Signal:", "[ 0]", "what():"):
            if trace in report:
                problems.append(f"{ranks} ranks: stack trace")
    if reports[0] != reports[1]:
        problems.append("the reports of 1 and 2 ranks differ:\n" + reports[1])
    if sorted(p.name for p in folder.iterdir()) != before:
        problems.append("something was created")
    if bad.args[:2] == ["run", "case.toml"] and bad.expect and bad.expect[0].startswith(("case", "--set ")):
        done = cairn("check", "case.toml", *bad.args[4:], cwd=folder, timeout=60)  # without --out and its folder
        if done.code != 2 or done.err != reports[0]:
            problems.append(f"check: exit code {done.code}, or another report than run:\n{done.err}")
    return [f"{bad.name}: {p}" for p in problems] + ([f"--- {bad.name} ---\n{reports[0]}"] if problems else [])


def check_warning(warning, scratch, cairn):
    folder = scratch / warning.name
    write(folder, warning.files)
    before = sorted(p.name for p in folder.iterdir())
    done = cairn("check", "case.toml", cwd=folder, timeout=60)
    problems = [f"'{text}' is not in the report" for text in warning.expect if text not in done.err]
    if not warning.expect and done.err:
        problems.append("a warning without need")
    if done.code != 0 or "case.toml: ok" not in done.out:
        problems.append(f"exit code {done.code} instead of 0")
    if sorted(p.name for p in folder.iterdir()) != before:
        problems.append("check created something")
    return [f"{warning.name}: {p}\n{done.err}" for p in problems]


def main():
    cairn, scratch = Program(sys.argv[1]), fresh_folder(sys.argv[2])
    names = [c.name for c in CASES] + [w.name for w in WARNINGS]
    assert len(set(names)) == len(names), "names must differ"
    root = os.geteuid() == 0  # root reads every file
    cases = [c for c in CASES if not (root and c.name == "unreadable_file")]
    start = time.monotonic()
    # Most of a run's time is mpirun's waiting, not computing.
    with concurrent.futures.ThreadPoolExecutor(8) as pool:
        results = list(pool.map(lambda c: check_bad(c, scratch, cairn), cases))
        results += list(pool.map(lambda w: check_warning(w, scratch, cairn), WARNINGS))
    failures = [line for result in results for line in result]
    print("\n".join(failures))
    print(f"{len(results)} inputs, {sum(map(bool, results))} failed, {time.monotonic() - start:.0f} s")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
