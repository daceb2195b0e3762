"""Pictures in space show surfaces where they are, cuts with the values inside, neighbours in different colours, and
contacts with their periodic images.

    test_pictures.py CAIRN SCRATCH
"""

import importlib.util
import subprocess
import sys
import types
from pathlib import Path

from harness import PATIENCE, ROOT, SKIP, Program, expect, expect_code, fresh_folder, sets

for package in ("numpy", "h5py", "matplotlib", "PIL"):
    if importlib.util.find_spec(package) is None:
        print(f"Python lacks {package}")
        sys.exit(SKIP)

import h5py  # noqa: E402  after the check that they are there
import numpy as np  # noqa: E402
from PIL import Image  # noqa: E402

sys.path.insert(0, str(ROOT / "scripts" / "plotting"))
sys.dont_write_bytecode = True
import chains  # noqa: E402
import colours  # noqa: E402
import figures  # noqa: E402
import film  # noqa: E402
import results  # noqa: E402
import scalars  # noqa: E402
from camera import Camera, View  # noqa: E402
from lattice import Lattice  # noqa: E402
from look import Look  # noqa: E402
from space import Scene, clip_plane  # noqa: E402

ACROSS = 16  # points across a sphere
SPACING = 1.0 / ACROSS


def sphere() -> np.ndarray:
    side = (np.arange(ACROSS) + 0.5) * SPACING - 0.5
    x = np.stack(np.meshgrid(side, side, side, indexing="ij"), -1).reshape(-1, 3)
    return x[np.linalg.norm(x, axis=1) < 0.5]


def write_spheres(folder: Path, side: int, periodic: str = "false") -> results.Run:
    """A block of spheres of diameter 1 m, side x side x side of them; stress xx is 1000 Pa per metre along z."""
    folder.mkdir(parents=True)
    (folder / "case.toml").write_text(
        f"title = 'Block'\n[domain]\ndimension = 3\nlower = [0, 0, 0]\nupper = [{side}, {side}, {side}]\n"
        f"cell_size = {2 * SPACING}\nperiodic = [{periodic}, false, false]\ngravity = [0, 0, -9.81]\n"
        "[solver]\npoints_per_cell = 8\n")
    grid = np.arange(side) + 0.5
    centres = np.stack(np.meshgrid(grid, grid, grid, indexing="ij"), -1).reshape(-1, 3)
    one = sphere()
    x = (centres[:, None] + one[None]).reshape(-1, 3)
    stress = np.zeros((len(x), 6))
    stress[:, 0] = 1000 * x[:, 2]
    with h5py.File(folder / "particles_000000.vtkhdf", "w") as file:
        group = file.create_group("VTKHDF")
        group.attrs["time"], group.attrs["step"] = 0.0, 0
        group["Points"] = x
        fields = {"body": np.repeat(np.arange(len(centres), dtype=np.int32), len(one)), "stress": stress,
                  "id": np.arange(len(x)), "volume": np.full(len(x), SPACING**3), "mass": np.full(len(x), SPACING**3)}
        for name, values in fields.items():
            group[f"PointData/{name}"] = values
    return results.Run(folder)


def seen(run: results.Run, **look):
    """The camera, what it sees, and where that is in space [m]."""
    scene = Scene(run, Look(**look), run.frames)
    buffers = scene.buffers(run.frames[0])
    row, column = np.nonzero(buffers.hit)
    camera = scene.camera
    turned = camera.unproject(column + 0.5, row + 0.5, buffers.depth[buffers.hit])
    return scene, buffers, turned @ camera.basis + camera.target, buffers.owner[buffers.hit]


def test_surface(cairn: Program, scratch: Path) -> None:
    """A sphere of points looks like a sphere: depth, normals and outline, from any side, with perspective or without."""
    run = write_spheres(scratch / "one", 1)
    for look in ({}, {"azimuth": 10.0, "elevation": -40.0}, {"perspective": True}, {"zoom": 0.5}):
        scene, buffers, place, _ = seen(run, **look)
        away = place - 0.5
        distance = np.linalg.norm(away, axis=1)
        off = np.abs(distance - 0.5) / SPACING
        expect(np.percentile(off, 95) < 0.25, f"{look}: the surface is off by {np.percentile(off, 95):.2f} spacings")
        normal = buffers.normal[buffers.hit] @ scene.camera.basis
        angle = np.degrees(np.arccos(np.clip((normal * away).sum(axis=1) / distance, -1, 1)))
        expect(np.percentile(angle, 90) < 6, f"{look}: normals are off by {np.percentile(angle, 90):.1f} degrees")
        if not look.get("perspective"):
            area = buffers.hit.sum() / scene.camera.scale**2 / (np.pi / 4)
            expect(abs(area - 1) < 0.03, f"{look}: the outline's area is {area:.3f} of a disk's")
            rough = ragged(buffers.hit) / scene.camera.scale / SPACING
            expect(rough < 0.1, f"{look}: the outline's radius varies by {rough:.3f} spacings")


def ragged(hit: np.ndarray) -> float:
    """Standard deviation of an outline's distance from its middle, of what a pixel more or less does not make [pixels]."""
    rim = hit[1:-1, 1:-1] & ~(hit[:-2, 1:-1] & hit[2:, 1:-1] & hit[1:-1, :-2] & hit[1:-1, 2:])
    place = np.argwhere(rim) - np.argwhere(hit[1:-1, 1:-1]).mean(axis=0)
    radius, angle = np.linalg.norm(place, axis=1), np.arctan2(place[:, 0], place[:, 1])
    sector = ((angle / np.pi + 1) * 90).astype(int) % 180  # two degrees each
    return float((np.bincount(sector, radius) / np.maximum(np.bincount(sector), 1)).std())


def test_cut(cairn: Program, scratch: Path) -> None:
    """A cut face lies in its plane and shows the values inside; nothing is seen of what was cut away."""
    run = write_spheres(scratch / "cut", 2)
    for kept, axis, offset in (("x<0.4", 0, 0.4), ("y>1.6", 1, 1.6), ("x<", 0, 1.0)):
        scene, buffers, place, _ = seen(run, colour="stress_xx", planes=[clip_plane(kept, run)])
        beyond = (place[:, axis] - offset) * (1 if "<" in kept else -1)
        expect(beyond.max() < 0.3 * SPACING, f"{kept}: something is seen {beyond.max()} m beyond")
        face = np.abs(beyond) < 1e-3 * SPACING
        if kept == "x<":
            continue  # between spheres: they touch the plane in points
        radius = np.sqrt(0.25 - 0.1**2)
        area = face.sum() / scene.camera.scale**2 / abs(scene.camera.basis[2, axis])
        expect(abs(area / (4 * np.pi * radius**2) - 1) < 0.08, f"{kept}: the face's area is {area}")
        wrong = np.abs(buffers.value[buffers.hit][face] - 1000 * place[face, 2])
        expect(np.percentile(wrong, 95) < 1000 * 1.5 * SPACING, f"{kept}: values are off by {np.percentile(wrong, 95)} Pa")


def test_colours(cairn: Program, scratch: Path) -> None:
    """Bodies that touch differ in colour, and keep their colours from frame to frame."""
    run = write_spheres(scratch / "block", 4)
    colour = colours.of_run(run)(np.arange(64))
    place = np.stack(np.unravel_index(np.arange(64), (4, 4, 4)), 1)
    for a in range(64):
        for b in range(a):
            if np.abs(place[a] - place[b]).sum() == 1:
                expect(np.any(colour[a] != colour[b]), f"spheres {a} and {b} have one colour")
    full = colours.body_colours(np.arange(40), np.array([(a, b) for a in range(40) for b in range(a)]), np.array([7]))
    expect(len(np.unique(full, axis=0)) == len(colours.PALETTE) + 1, "not all colours are used where all are neighbours")
    expect(np.all(full[7] == colours.DRIVEN), "a driven body is not grey")


def test_maps(cairn: Program, scratch: Path) -> None:
    """Colour maps are even to the eye: lightness rises (or falls on both sides of zero) in equal steps."""
    for name, table in colours.MAPS.items():
        linear = np.where(table > 0.04045, ((table + 0.055) / 1.055) ** 2.4, table / 12.92)
        y = linear @ (0.2126, 0.7152, 0.0722)
        steps = np.diff(np.where(y > 0.008856, 116 * np.cbrt(y) - 16, 903.3 * y))
        halves = [steps[:126], -steps[128:]] if name == "diverging" else [steps]
        for half in halves:
            expect(half.min() > 0, f"{name}: lightness does not change one way")
            expect(half.max() < 2.6 * half.mean(), f"{name}: a step of lightness is {half.max() / half.mean()} of the mean")


def test_periodic_lattice(cairn: Program, scratch: Path) -> None:
    """Sums at nodes close upon themselves; means of linear values are kept; neighbours are found across the boundary."""
    x = np.stack(np.meshgrid(*[(np.arange(20) + 0.5) / 20] * 2, indexing="ij"), -1).reshape(-1, 2)
    body = np.where((x[:, 0] > 0.5), 3, 8)
    lattice = Lattice(x, body, 0.1, np.zeros(2), np.ones(2), np.array([True, True]))
    volume = np.full(len(x), 1 / 400)
    total = lattice.to_nodes(volume)
    expect(abs(total.sum() - 1) < 1e-12, "volume is lost")
    whole = Lattice(x, 0 * body, 0.1, np.zeros(2), np.ones(2), np.array([True, True]))
    share = whole.to_points(whole.to_nodes(volume)) / 0.01
    expect(np.abs(share - 1).max() < 1e-12, f"a full plane is {share.min()} to {share.max()} full")
    expect(lattice.neighbours().tolist() == [[3, 8]], lattice.neighbours())
    inner = np.abs(x[:, 0] - 0.75) < 0.1
    value = lattice.to_points(lattice.to_nodes(x[:, 1] * volume) / total)
    middle = inner & (np.abs(x[:, 1] - 0.5) < 0.3)
    expect(np.abs(value - x[:, 1])[middle].max() < 1e-12, "a linear field is not kept")


def test_camera(cairn: Program, scratch: Path) -> None:
    """Places come back from the picture, and all of the box is in it."""
    lower, upper = np.array((0.0, -1.0, 2.0)), np.array((1.0, 3.0, 2.5))
    x = np.random.default_rng(3).uniform(lower, upper, (200, 3))
    for perspective in (False, True):
        for up in range(3):
            camera = Camera(View(perspective=perspective, azimuth=-70, elevation=50), up, lower, upper, 900, 700)
            expect(np.allclose(camera.basis @ camera.basis.T, np.eye(3)), "the axes are no rotation")
            expect(np.linalg.det(camera.basis) > 0, "the picture is mirrored")
            place, towards, _ = camera.project(x)
            expect(((place > 0) & (place < (900, 700))).all(), f"something is outside: {place.min(axis=0)}")
            back = camera.unproject(place[:, 0], place[:, 1], towards) @ camera.basis + camera.target
            expect(np.allclose(back, x), f"up {up}: places are off by {np.abs(back - x).max()}")


def test_images(cairn: Program, scratch: Path) -> None:
    """A contact across a periodic boundary is drawn at both sides, and lines have their shortest way."""
    run = types.SimpleNamespace(dimension=2, lower=np.zeros(2), upper=np.ones(2), periodic=np.array([False, True]),
                                driven_bodies=np.array([], int))
    table = {"body": np.array([5, 2]), "centre": np.array([[0.5, 0.95, 0], [0.5, 0.1, 0]]), "mass": np.ones(2)}
    run.grain_files, run.file_at = [], lambda tables, time: types.SimpleNamespace(field=table.__getitem__)
    rows = {"body_a": np.array([2]), "body_b": np.array([5]), "point": np.array([[0.5, 0.02, 0]]),
            "force": np.array([[3.0, 4.0, 0]])}
    contacts = types.SimpleNamespace(time=0.0, field=rows.__getitem__)
    net = chains.network(run, contacts, None)
    expect(net.contacts == 1 and net.force.tolist() == [5, 5], net)
    expect(np.allclose(net.lines[0, :, 1], (0.1, 0.02, -0.05)), net.lines)
    expect(np.allclose(net.lines[1, :, 1], (1.1, 1.02, 0.95)), net.lines)


def plot(*arguments, code: int = 0) -> str:
    done = subprocess.run([ROOT / "scripts" / "plot", *map(str, arguments)], capture_output=True, text=True,
                          timeout=300 * PATIENCE, check=False)
    expect(done.returncode == code, f"exit code {done.returncode}\n{done.stdout}\n{done.stderr}")
    expect("Traceback" not in done.stderr, done.stderr)
    return done.stdout if code == 0 else done.stderr


def test_options(cairn: Program, scratch: Path) -> None:
    """Options that ask for what is not there are refused in a line that says what is."""
    write_spheres(scratch / "run", 2)
    wrong = {("--clip", "w<1"): "--clip w<1", ("--clip", "x<a"): "'a'", ("--clip", "x<nan"): "'nan'", ("--zoom", "0"): "--zoom 0",
             ("--size", "9", "9"): "--size", ("--range", "2", "1"): "--range", ("--azimuth", "nan"): "finite"}
    for options, words in wrong.items():
        expect(words in plot(scratch / "run", *options, code=2), f"{options}")
    expect("there are body, pressure" in plot(scratch / "run", "--colour", "nothing"), "values are not named")
    plot(scratch / "run", "--colour", "volume", "--range", "0", "1", "--size", "400", "300", "--clip", "x<1.5", "--clip", "z<1")
    pictures = scratch / "run" / "pictures"
    for name in ("volume", "grains_start", "grains_end", "stress_inside"):
        expect(Image.open(pictures / f"{name}.png").height > 300, name)


def test_real(cairn: Program, scratch: Path) -> None:
    """Chains of a real run in two and three dimensions, films, and the smooth stress that is made where none was written."""
    two = {"time.steps": 60, "output.particles": "{ every = 20 }", "output.contacts": "{ every = 20 }", "output.grains": "{}"}
    expect_code(cairn("run", ROOT / "cases" / "shear_small.toml", "--out", scratch / "two", *sets(two)), 0)
    three = {"time.steps": 40, "domain.cell_size": 0.025, "output.particles": "{ every = 20 }", "output.checkpoint": "{}",
             "output.contacts": "{ every = 20 }", "output.grains": "{ every = 20 }", "grains.0.velocity": "[0.0, 0.0, 0.0]"}
    expect_code(cairn("run", ROOT / "cases" / "spheres_box.toml", "--out", scratch / "three", *sets(three)), 0)
    for name in ("two", "three"):
        said = plot(scratch / name, "--film", "--colour", "pressure")
        expect((scratch / name / "pictures" / "pressure.png").is_file(), said)
        expect(list((scratch / name / "pictures").glob("film.*")), said)
    expect((scratch / "two" / "pictures" / "force_chains.png").is_file(), "no chains in 2D")
    run = results.Run(scratch / "two")
    stress = run.stress(run.frames[-1])
    expect(run.stress_name(run.frames[-1]) == "stress, smoothed", "the smooth stress was there already")
    raw = run.frames[-1].field("stress")
    expect(np.ptp(stress) < np.ptp(raw) and np.corrcoef(stress.ravel(), raw.ravel())[0, 1] > 0.7, "it is not the stress, smoothed")
    picture = np.asarray(Image.open(scratch / "two" / "pictures" / "force_chains.png").convert("RGB")).astype(int)
    strong = np.abs(picture - 255 * chains.STRONG).sum(axis=2) < 12
    expect(strong.mean() > 2e-3, f"{strong.mean()} of the picture are strong lines")


LID = """
domain = { upper = [1.0, 1.0], cells = [20, 20], gravity = [0.0, -9.81] }
time = { steps = 40 }
materials.soft = { model = "neo_hookean", density = 1e3, shear_modulus = 1e5, bulk_modulus = 1e5 }
materials.steel = { model = "rigid" }
bodies = [{ shape = { type = "disk", centre = [0.5, 0.3], radius = 0.28 }, material = "soft" },
          { shape = { type = "box", lower = [0.1, 0.6], upper = [0.9, 0.8] }, material = "steel", group = "lid" }]
drive = [{ bodies = { group = "lid" }, velocity = [0.0, -0.5] }]
output = { particles = { every = 20 } }
"""


def test_bodies_without_stress(cairn: Program, scratch: Path) -> None:
    """Rigid bodies are grey where stress is shown, and not the colour of zero; where speed is, they have its colour."""
    (scratch / "case.toml").write_text(LID)
    expect_code(cairn("run", scratch / "case.toml", "--out", scratch / "run"), 0)
    run = results.Run(scratch / "run")
    frame, grey = run.frames[-1], np.rint(255 * colours.DRIVEN)
    expect(run.driven_bodies.tolist() == [1], run.driven_bodies)
    for name, right in (("pressure", True), ("speed", False)):
        shown = scalars.SCALARS[name]
        picture = figures.value_picture(run, frame, shown, scalars.scale(run, [frame], shown, None), 100)
        expect(np.allclose(picture[68, 50], grey) == right, f"{name}: the lid is {picture[68, 50]}")
        expect(not np.allclose(picture[30, 50], grey), f"{name}: the disk is grey")


def test_rounding_errors_are_no_pattern(cairn: Program, scratch: Path) -> None:
    """A scale does not end below what stress is known to."""
    values = [np.array([-3e-12, 0.0, 5e-12])]
    expect(scalars.limits(values, True, 1e-8) == (-1e-8, 1e-8), "signed")
    expect(scalars.limits(values, True) == scalars.limits(values, True, 1e-13), "what is above is not changed")


def test_progress(cairn: Program, scratch: Path) -> None:
    """The frames come in order from all workers; the bar is for terminals only."""
    frames = [types.SimpleNamespace(k=k) for k in range(7)]
    pictures = list(film.progress(film.drawn(lambda frame: Image.new("RGB", (21, 11), (frame.k, 0, 0)), frames), 7))
    expect([int(p[0, 0, 0]) for p in pictures] == list(range(7)), "frames are not in order")
    expect(pictures[0].shape == (10, 20, 3), pictures[0].shape)


def main() -> int:
    from harness import run_tests

    return run_tests(globals(), Program(sys.argv[1]), fresh_folder(sys.argv[2]))


if __name__ == "__main__":
    sys.exit(main())
