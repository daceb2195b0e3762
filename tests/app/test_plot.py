"""scripts/plot draws every picture of a run, and measures the shear band rightly.

    test_plot.py CAIRN SCRATCH
"""

import concurrent.futures
import importlib.util
import json
import shutil
import subprocess
import sys
from pathlib import Path

from harness import PATIENCE, ROOT, SKIP, Program, fresh_folder, sets

for package in ("numpy", "h5py", "matplotlib"):
    if importlib.util.find_spec(package) is None:
        print(f"Python lacks {package}")
        sys.exit(SKIP)

import h5py  # noqa: E402  after the check that they are there
import matplotlib.image  # noqa: E402
import numpy as np  # noqa: E402

WIDTH = 1.2e-3  # of the layer [m]
CELLS = 120
GRAINS = 12  # along a side; disks on a square lattice, so that their mean diameter is known
RADIUS = 0.45 * WIDTH / GRAINS
SPEED = 100.0  # of the right side [m/s]
FRAMES = 41  # at every 2 % of shear

CASE = f"""\
title = "{{title}}"
[domain]
dimension = 2
lower = [0.0, 0.0]
upper = [{WIDTH}, {WIDTH}]
cells = [{CELLS}, {CELLS}]
periodic = [false, true]
gravity = [0.0, 0.0]
[solver]
points_per_cell = 4
[boundary]
left = {{{{ type = "fixed", velocity = [0.0, 0.0] }}}}
right = {{{{ type = "fixed", velocity = [0.0, {SPEED}] }}}}
"""
COLUMNS = ("step", "time", "dt", "kinetic_energy", "strain_energy", "potential_energy", "plastic_dissipation",
           "contact_dissipation", "boundary_work", "energy_error", "momentum_x", "momentum_y", "contact_nodes")


def profile(x: np.ndarray, band: tuple[float, float]) -> np.ndarray:
    """Share of the right side's displacement at x: all of it is gained across the band."""
    return np.clip((x - band[0]) / (band[1] - band[0]), 0, 1)


def disks() -> tuple[np.ndarray, np.ndarray]:
    """Positions [m] and bodies of the points of all disks."""
    side = (np.arange(2 * CELLS) + 0.5) * WIDTH / (2 * CELLS)
    x = np.stack(np.meshgrid(side, side, indexing="ij"), -1).reshape(-1, 2)
    place = np.floor(x / WIDTH * GRAINS)
    inside = np.linalg.norm(x - (place + 0.5) * WIDTH / GRAINS, axis=1) < RADIUS
    return x[inside], (place[inside] @ (GRAINS, 1)).astype(np.int32)


def write_run(folder: Path, title: str, band: tuple[float, float], plastic: float):
    """A made-up run in the layout of a real one; the points' order differs from frame to frame."""
    folder.mkdir()
    (folder / "case.toml").write_text(CASE.format(title=title))
    x, body = disks()
    random = np.random.default_rng(2)
    for frame in range(FRAMES):
        time = frame * 0.02 * WIDTH / SPEED
        y = x[:, 1] + SPEED * time * profile(x[:, 0], band)
        order = random.permutation(len(x))
        fields = {"velocity": np.column_stack([0 * y, SPEED * profile(x[:, 0], band), 0 * y]),
                  "stress": random.uniform(0, 1e8, (len(x), 6)), "body": body, "id": np.arange(len(x)),
                  "volume": np.full(len(x), (WIDTH / CELLS) ** 2 / 4), "mass": np.ones(len(x)),
                  "image": np.column_stack([0 * body, np.floor(y / WIDTH).astype(np.int32), 0 * body])}
        with h5py.File(folder / f"particles_{frame:06d}.vtkhdf", "w") as file:
            group = file.create_group("VTKHDF")
            group.attrs["time"], group.attrs["step"] = time, frame
            group["Points"] = np.column_stack([x[:, 0], y % WIDTH, 0 * y])[order]
            for name, values in fields.items():
                group[f"PointData/{name}"] = values[order]
    rows = [",".join(COLUMNS)]
    for i in range(0, 101, 10):
        values = dict.fromkeys(COLUMNS, 0) | {"step": i, "time": i / 100 * time, "kinetic_energy": i,
                                              "boundary_work": i, "plastic_dissipation": plastic * i,
                                              "energy_error": 1e-4 * i}
        rows.append(",".join(map(str, values.values())))
    (folder / "history.csv").write_text("\n".join(rows) + "\n")


def plot(*arguments) -> str:
    command = [ROOT / "scripts" / "plot", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300 * PATIENCE, check=False)
    assert done.returncode == 0, f"exit code {done.returncode}\n{done.stdout}\n{done.stderr}"
    return done.stdout


def check_picture(file: Path):
    """A PNG of some size that shows something."""
    assert file.is_file(), f"{file} was not drawn"
    assert file.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n", f"{file} is no PNG"
    pixels = matplotlib.image.imread(file)[:, :, :3]
    assert min(pixels.shape[:2]) > 300, f"{file} has {pixels.shape} pixels"
    colours = len(np.unique((pixels * 255).astype(np.uint8).reshape(-1, 3), axis=0))
    assert colours > 20 and pixels.std() > 0.05, f"{file} is nearly empty: {colours} colours"


def check_bands(summary: dict, band: tuple[float, float]):
    """A share of the displacement lies within the same share of the band; exact to two columns of cells."""
    size = WIDTH / CELLS
    expected = {(shear, share) for shear in (0.26, 0.50, 0.74, 0.76, 0.24) for share in (0.75, 0.90)}
    entries = summary["shear_band"]
    assert len(entries) == 6, f"{len(entries)} bands instead of 2 for each of 3 shears"
    for entry in entries:
        assert (round(entry["shear"], 6), entry["share"]) in expected, entry
        width = entry["share"] * (band[1] - band[0])
        assert abs(entry["width_mm"] * 1e-3 - width) <= 2 * size, f"{entry}: expected {width} m"
        assert abs(entry["width_share_of_layer"] - width / WIDTH) <= 2 / CELLS, entry
        assert band[0] - size <= entry["from_mm"] * 1e-3 < entry["to_mm"] * 1e-3 <= band[1] + size, f"{entry}: outside"
        diameters = entry["width_mm"] / summary["mean_grain_diameter_mm"]
        assert abs(entry["width_diameters"] - diameters) < 1e-9, entry


def synthetic(scratch: Path):
    """A shear band whose width is known beside a uniform shear."""
    band = (0.5 * WIDTH, 0.75 * WIDTH)
    write_run(scratch / "banded", "Banded", band, 1.0)
    write_run(scratch / "uniform", "Uniform", (0.0, WIDTH), 5.0)
    plot(scratch / "uniform")
    plot(scratch / "banded", "--compare", scratch / "uniform")
    summaries = {}
    for name in ("banded", "uniform"):
        pictures = scratch / name / "pictures"
        for file in ("grains_start", "grains_75", "grains_end", "principal_stress", "displacement_profile", "energy"):
            check_picture(pictures / f"{file}.png")
        summaries[name] = json.loads((pictures / "summary.json").read_text())
        diameter = summaries[name]["mean_grain_diameter_mm"]
        assert abs(diameter / (2e3 * RADIUS) - 1) < 0.02, f"mean diameter {diameter} mm instead of {2e3 * RADIUS}"
        assert summaries[name]["bodies"] == GRAINS**2 and summaries[name]["points"] == len(disks()[0]), summaries[name]
    for file in ("grains_75_uniform.png", "grains_75_compare.png"):
        check_picture(scratch / "banded" / "pictures" / file)
    check_bands(summaries["banded"], band)
    check_bands(summaries["uniform"], (0.0, WIDTH))
    assert abs(summaries["banded"]["plastic_work_ratio_to_this_run"]["uniform"] - 5) < 1e-12, summaries["banded"]


def real(cairn: Program, scratch: Path):
    """The results of the program itself, in two and three dimensions; too short for a shear band."""
    shortened = {"shear_small": {"time.steps": 20},
                 "spheres_box": {"time.steps": 4, "domain.cell_size": 0.025, "output.checkpoint": "{}"}}
    for name, settings in shortened.items():
        out = scratch / name
        done = cairn("run", ROOT / "cases" / f"{name}.toml", "--out", out, *sets(settings), ranks=2)
        assert done.code == 0, done.err
        said = plot(out)
        for file in ("grains_start", "grains_end", "energy"):
            check_picture(out / "pictures" / f"{file}.png")
        for number in (value for key, value in json.loads((out / "pictures" / "summary.json").read_text()).items()
                       if key in ("bodies", "points")):
            assert number > 0, said
    check_picture(scratch / "shear_small" / "pictures" / "principal_stress.png")
    assert "no displacement_profile" in said, said


def fringes(scratch: Path):
    """Photoelastic: the brightness that theory gives, where the points are; on a folder, at times, and on one file."""
    sys.path.insert(0, str(ROOT / "scripts" / "plotting"))
    from photoelastic import fringe_picture
    from results import Run
    write_run(scratch / "fringes", "Fringes", (0.0, WIDTH), 1.0)
    files = sorted((scratch / "fringes").glob("particles_*.vtkhdf"))
    parameter, dark = 2e6, 7  # so many dark fringes from left to right
    with h5py.File(files[0], "r+") as file:
        x = file["VTKHDF/Points"][:, 0]
        stress = np.zeros((len(x), 6))
        stress[:, 3] = 0.5 * parameter * (2 * np.pi * dark * x / WIDTH)  # shear: s1 - s2 is twice as much
        file["VTKHDF/PointData/stress"][...] = stress
    run = Run(scratch / "fringes")
    picture = fringe_picture(run, run.frames[0], parameter, 8 * CELLS)
    row = picture[int(round(8 * CELLS * (0.5 / GRAINS)))]  # through the centres of a row of grains
    place = (np.arange(len(row)) + 0.5) / len(row)
    inside = np.abs((place * GRAINS) % 1 - 0.5) < 0.4
    wrong = np.abs(row - (0.5 + 0.5 * np.cos(2 * np.pi * dark * place)))[inside]
    assert wrong.max() < 0.15, f"brightness is off by {wrong.max()}"  # a point is a 240th of the width, 0.09 at most
    for target, times in ((scratch / "fringes", ["--times", "0", "3e-6"]), (files[3], [])):
        pictures = scratch / "fringes" / "pictures" / "photoelastic.png"
        pictures.unlink(missing_ok=True)
        plot(target, "--fringes", parameter, *times)
        check_picture(pictures)


def smooth(scratch: Path):
    """Pictures show the smooth stress where the files hold it, and the points' own on request, or where they do not."""
    folder = scratch / "smooth"
    write_run(folder, "Smooth", (0.0, WIDTH), 1.0)
    files = sorted(folder.glob("particles_*.vtkhdf"))
    for path in files[2:]:
        path.unlink()
    scales = {"stress": 3e6, "stress_smooth": 1e6}
    for path in files[:2]:
        with h5py.File(path, "r+") as file:
            for name, scale in scales.items():
                stress = np.zeros((len(file["VTKHDF/Points"]), 6))
                stress[:, 0] = scale
                file["VTKHDF/PointData"].pop(name, None)
                file[f"VTKHDF/PointData/{name}"] = stress
    for options, name in (([], "stress_smooth"), (["--raw-stress"], "stress")):
        plot(folder, *options)
        summary = json.loads((folder / "pictures" / "summary.json").read_text())
        assert summary["principal_stress_field"] == name, summary
        assert abs(summary["principal_stress_scale_Pa"] / scales[name] - 1) < 1e-9, summary
    plot(folder, "--fringes", 1e6, "--raw-stress")
    check_picture(folder / "pictures" / "photoelastic.png")


def nothing(scratch: Path):
    """A folder without results is refused in one line."""
    (scratch / "empty").mkdir()
    done = subprocess.run([ROOT / "scripts" / "plot", scratch / "empty"], capture_output=True, text=True, check=False)
    assert done.returncode == 2 and "no case.toml" in done.stderr, done.stderr
    assert "Traceback" not in done.stderr, done.stderr


def small_run(folder: Path):
    """A made-up run of three frames."""
    write_run(folder, "Small", (0.0, WIDTH), 1.0)
    for path in sorted(folder.glob("particles_*.vtkhdf"))[3:]:
        path.unlink()


def edited(change):
    """Applies `change` to the open group VTKHDF of the last frame."""
    def damage(folder: Path):
        with h5py.File(folder / "particles_000002.vtkhdf", "r+") as file:
            change(file["VTKHDF"])
    return damage


def replaced(group, name: str, values):
    del group[name]
    group[name] = values


def rewritten(name: str, change):
    """Applies `change` to the text of a file."""
    def damage(folder: Path):
        (folder / name).write_text(change((folder / name).read_text()))
    return damage


def cut(name: str, size: int):
    return lambda folder: (folder / name).write_bytes((folder / name).read_bytes()[:size])


def as_link(folder: Path):
    (folder.parent / "elsewhere").mkdir(exist_ok=True)
    (folder / "pictures").symlink_to("../elsewhere")


PARTICLES = "particles_000002.vtkhdf"
DAMAGE = {
    "case_empty": cut("case.toml", 0), "case_cut": cut("case.toml", 60),
    "case_no_toml": rewritten("case.toml", lambda t: "= = ="), "case_a_list": rewritten("case.toml", lambda t: "domain = [1]"),
    "case_bytes": lambda f: (f / "case.toml").write_bytes(b"title = '\xff\xfe'\n"),
    "case_one_dimension": rewritten("case.toml", lambda t: t.replace("dimension = 2", "dimension = 1")),
    "case_word": rewritten("case.toml", lambda t: t.replace(f"cells = [{CELLS}, {CELLS}]", "cells = 'many'")),
    "case_no_size": rewritten("case.toml", lambda t: t.replace(f"upper = [{WIDTH}, {WIDTH}]", "upper = [0.0, 0.0]")),
    "case_velocity": rewritten("case.toml", lambda t: t.replace(f"velocity = [0.0, {SPEED}]", "velocity = 'fast'")),
    "case_points": rewritten("case.toml", lambda t: t.replace("points_per_cell = 4", "points_per_cell = -4")),
    "frame_empty": cut(PARTICLES, 0), "frame_cut": cut(PARTICLES, 5000),
    "frame_text": lambda f: (f / PARTICLES).write_text("step,time\n"),
    "frame_no_points": edited(lambda g: g.__delitem__("Points")),
    "frame_no_time": edited(lambda g: g.attrs.__delitem__("time")),
    "frame_nan_time": edited(lambda g: g.attrs.__setitem__("time", np.nan)),
    "frame_short_field": edited(lambda g: replaced(g, "PointData/body", np.zeros(3, int))),
    "frame_flat_positions": edited(lambda g: replaced(g, "Points", np.zeros(7))),
    "frame_nan": edited(lambda g: replaced(g, "PointData/stress", np.full(g["PointData/stress"].shape, np.nan))),
    "frame_words": edited(lambda g: replaced(g, "PointData/body", np.array([b"a"] * len(g["Points"])))),
    "frame_negative_body": edited(lambda g: replaced(g, "PointData/body", -1 - np.arange(len(g["Points"])))),
    "frame_a_folder": lambda f: ((f / PARTICLES).unlink(), (f / PARTICLES).mkdir()),
    "history_empty": cut("history.csv", 0), "history_words": rewritten("history.csv", lambda t: t.replace("\n10,", "\nten,")),
    "history_ragged": rewritten("history.csv", lambda t: t.replace("\n10,", "\n10,10,")),
    "history_no_time": rewritten("history.csv", lambda t: t.replace("time", "when", 1)),
    "record_cut": lambda f: (f / "run.json").write_text('{ "runs": ['),
    "pictures_a_file": lambda f: (f / "pictures").write_text(""), "pictures_a_link": as_link,
}


def damaged(scratch: Path):
    """Whatever is wrong with a folder of results: exit code 2 and one line that names what; no link is followed."""
    small_run(scratch / "sound")
    plot(scratch / "sound")
    shutil.rmtree(scratch / "sound" / "pictures")
    problems = []

    def attempt(name: str):
        folder = scratch / f"damaged_{name}"
        shutil.copytree(scratch / "sound", folder)
        DAMAGE[name](folder)
        return folder, subprocess.run([ROOT / "scripts" / "plot", folder], capture_output=True, text=True, check=False)

    with concurrent.futures.ThreadPoolExecutor(2) as workers:
        results = list(workers.map(attempt, DAMAGE))
    for name, (folder, done) in zip(DAMAGE, results):
        if done.returncode != 2 or len(done.stderr.splitlines()) != 1 or not done.stderr.startswith("plot: "):
            problems.append(f"{name}: exit code {done.returncode}: {done.stderr}")
        elif str(folder) not in done.stderr:
            problems.append(f"{name}: the folder is not named: {done.stderr}")
    for name in ("--fringes", "1e6"), ():
        done = subprocess.run([ROOT / "scripts" / "plot", scratch / "damaged_pictures_a_link", *name],
                              capture_output=True, text=True, check=False)
        if done.returncode != 2 or list((scratch / "elsewhere").iterdir()):
            problems.append(f"a link was followed: {done.returncode} {done.stderr}")
    assert not problems, "\n".join(problems)


def last_line_cut(scratch: Path):
    """A run that was killed may leave part of a line, which is left out."""
    small_run(scratch / "killed")
    with open(scratch / "killed" / "history.csv", "a", encoding="utf-8") as file:
        file.write("110,1.2e-")
    plot(scratch / "killed")
    check_picture(scratch / "killed" / "pictures" / "energy.png")


def failed(cairn: Program, scratch: Path):
    """The pictures of a run that failed say so, and those of one that went on from there do not."""
    case, out = ROOT / "cases" / "two_disks.toml", scratch / "failed"
    few = {"time.steps": 30, "output.history": "{ every = 1 }", "output.particles": "{ every = 10 }",
           "bodies.0.angular_velocity": 5.0}
    done = cairn("run", case, "--out", out, *sets(few | {"solver.energy_limit": 1e-15}))
    assert done.code == 3, f"exit code {done.code} {done.err}"
    assert "THE RUN FAILED" in plot(out)
    summary = json.loads((out / "pictures" / "summary.json").read_text())
    assert summary["failed"] and summary["title"].endswith("THE RUN FAILED"), summary
    check_picture(out / "pictures" / "grains_start.png")
    done = cairn("run", case, "--out", out, "--overwrite", *sets(few))
    assert done.code == 0, done.err
    assert "FAILED" not in plot(out)
    summary = json.loads((out / "pictures" / "summary.json").read_text())
    assert not summary["failed"] and "FAILED" not in summary["title"], summary


def main():
    cairn, scratch = Program(sys.argv[1]), fresh_folder(sys.argv[2])
    nothing(scratch)
    synthetic(scratch)
    fringes(scratch)
    smooth(scratch)
    damaged(scratch)
    last_line_cut(scratch)
    failed(cairn, scratch)
    real(cairn, scratch)


if __name__ == "__main__":
    main()
