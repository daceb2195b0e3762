"""scripts/view makes one page that shows a run in a browser: small, whole, without errors, by mouse, keys and touch.

    test_view.py CAIRN SCRATCH

What needs a browser is left out, with a message, where there is no Chromium.
"""

import base64
import importlib.util
import io
import json
import re
import shutil
import subprocess
import sys
import zlib
from pathlib import Path

from harness import PATIENCE, ROOT, SKIP, Program, expect, expect_code, fresh_folder, run_tests, sets

for package in ("numpy", "h5py", "matplotlib", "PIL"):
    if importlib.util.find_spec(package) is None:
        print(f"Python lacks {package}")
        sys.exit(SKIP)

import h5py  # noqa: E402  after the check that they are there
import numpy as np  # noqa: E402
from PIL import Image  # noqa: E402

sys.path.insert(0, str(ROOT / "scripts" / "plotting"))
sys.dont_write_bytecode = True
import colours  # noqa: E402
import results  # noqa: E402
from browser import Browser, find_chromium  # noqa: E402

ACROSS = 12  # points across a sphere


def view(*arguments, code: int = 0) -> subprocess.CompletedProcess:
    done = subprocess.run([ROOT / "scripts" / "view", *map(str, arguments)], capture_output=True, text=True,
                          timeout=500 * PATIENCE, check=False)
    expect(done.returncode == code and "Traceback" not in done.stderr, f"exit code {done.returncode}\n{done.stderr}")
    return done


def write_run(folder: Path, side: int, frames: int, across: int = ACROSS, title: str = "Block") -> None:
    """A block of side x side x side spheres that turn as one, while each is strained; stress is 1 kPa per metre of z."""
    folder.mkdir(parents=True)
    spacing = 1 / across
    (folder / "case.toml").write_text(f"title = {json.dumps(title)}\n[domain]\ndimension = 3\nlower = [0, 0, 0]\n"
                                      f"upper = [{side}, {side}, {side}]\ncell_size = {2 * spacing}\n"
                                      "[solver]\npoints_per_cell = 8\n")
    line = (np.arange(across) + 0.5) * spacing - 0.5
    grid = np.stack(np.meshgrid(line, line, line, indexing="ij"), -1).reshape(-1, 3)
    one = grid[np.linalg.norm(grid, axis=1) < 0.5]
    middle = np.stack(np.meshgrid(*[np.arange(side) + 0.5] * 3, indexing="ij"), -1).reshape(-1, 3)
    body = np.repeat(np.arange(len(middle), dtype=np.int32), len(one))
    noise = np.random.default_rng(1)
    for k in range(frames):
        angle = 0.1 * k
        turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
        at = (middle - side / 2) @ turn.T + side / 2
        x = (at[:, None] + (one * (1, 1, 1 - 0.02 * k)) @ turn.T).reshape(-1, 3) + noise.normal(0, 0.03 * spacing * (k > 0), (len(body), 3))
        stress = np.zeros((len(x), 6))
        stress[:, 2] = 1000 * x[:, 2]
        with h5py.File(folder / f"particles_{k:06d}.vtkhdf", "w") as file:
            group = file.create_group("VTKHDF")
            group.attrs["time"], group.attrs["step"] = 0.1 * k, k
            group["Points"] = x
            for name, values in {"body": body, "id": np.arange(len(x)), "stress": stress, "volume": np.full(len(x), spacing**3),
                                 "velocity": noise.normal(0, 1, x.shape)}.items():
                group[f"PointData/{name}"] = values
    rows = [f"{k},{0.1 * k},{k * k}" for k in range(frames)]
    (folder / "history.csv").write_text("\n".join(["step,time,kinetic_energy", *rows]) + "\n")


def unpacked(page: Path) -> tuple[dict, dict]:
    """What a page holds: its head, and its arrays."""
    text = page.read_text()
    head = json.loads(re.search(r'id="head">(.*?)</script>', text, re.DOTALL).group(1))
    block = zlib.decompress(base64.b64decode(re.search(r'id="data">(.*?)</script>', text, re.DOTALL).group(1)))
    return head, {name: np.frombuffer(block, kind, size, offset) for name, (kind, offset, size) in head["index"].items()}


def places(head: dict, arrays: dict, frame: int) -> np.ndarray:
    """Where a page shows its points at a full frame."""
    n = head["points"]
    start = np.stack([np.cumsum(bytes_[:n] + 256 * bytes_[n:].astype(np.int64)) & 65535
                      for bytes_ in (arrays[f"place_{k}"] for k in range(3))], 1)
    start = start / 65535 * head["extent"] + head["low"]
    owner = np.repeat(np.arange(len(head["bodies"])), arrays["counts"])
    maps = arrays["motion"].reshape(len(head["frames"]), -1, 3, 4)[frame][owner]
    off = arrays[f"off_{frame}"].reshape(3, n).T * head["scales"][head["full"].index(frame)] / 127
    return np.einsum("nij,nj->ni", maps[:, :, :3], start) + maps[:, :, 3] + off


def test_content(cairn: Program, scratch: Path) -> None:
    """Places are kept to a hundredth of a spacing, values to 1/255 of their scale, colours as in the pictures."""
    write_run(scratch / "run", 2, 4)
    view(scratch / "run", "-o", scratch / "page.html", "--values", "stress_zz")
    head, arrays = unpacked(scratch / "page.html")
    expect(head["full"] == [0, 1, 2, 3] and head["points"] == 8 * len(np.flatnonzero(arrays["counts"])) * arrays["counts"][0] / 8, head["full"])
    run = results.Run(scratch / "run")
    for frame in range(4):
        shown, real = places(head, arrays, frame), run.frames[frame].field("position")
        nearest = np.array([np.abs(real - x).max(axis=1).min() for x in shown[:: len(shown) // 200]])
        expect(nearest.max() < 0.01 / ACROSS, f"frame {frame}: places are off by {nearest.max() * ACROSS} spacings")
        value, low, high = arrays[f"value_stress_zz_{frame}"] / 255, head["values"][0]["low"], head["values"][0]["high"]
        wrong = np.abs(low + value * (high - low) - np.clip(1000 * shown[:, 2], low, high))
        expect(np.percentile(wrong, 90) < 150, f"frame {frame}: values are off by {np.percentile(wrong, 90)}")  # they are smoothed
    expect(np.array_equal(arrays["colour"].reshape(-1, 3), np.rint(255 * colours.of_run(run)(run.frames[0].field("body")[:: int(arrays["counts"][0])]))),
           "colours differ")


def test_size(cairn: Program, scratch: Path) -> None:
    """400,000 points in less than 6 MB, with as many full frames as fit; more points are thinned, and the page says so."""
    write_run(scratch / "large", 6, 3, 15)
    said = view(scratch / "large", "--values", "stress_zz").stdout
    page = scratch / "large" / "view.html"
    head, arrays = unpacked(page)
    print(said)
    expect(page.stat().st_size < 6e6, f"{page.stat().st_size} bytes")
    expect(head["points"] == 216 * 1791 and head["step"] == 1 and len(head["frames"]) == 3, said)
    view(scratch / "large", "--size", "1", "--values", "stress_zz")
    expect(len(unpacked(page)[0]["full"]) == 1, "a full frame did not fit")


def test_hostile_names(cairn: Program, scratch: Path) -> None:
    """A title cannot end the page's script; links are not followed; what is no run gives one line."""
    write_run(scratch / "run", 1, 1, title="</script><script>alert(1)</script>")
    (scratch / "kept").write_text("kept")
    (scratch / "run" / "view.html").symlink_to("../kept")
    view(scratch / "run")
    expect((scratch / "kept").read_text() == "kept", "a link was followed")
    expect("<script>alert" not in (scratch / "run" / "view.html").read_text(), "the title is a script")
    shutil.copytree(scratch / "run", scratch / "cut")
    (scratch / "cut" / "particles_000000.vtkhdf").write_bytes(b"")
    (scratch / "empty").mkdir()
    for name in ("cut", "empty", "nowhere"):
        done = view(scratch / name, code=2)
        expect(len(done.stderr.splitlines()) == 1 and done.stderr.startswith("view: "), f"{name}: {done.stderr}")


def scene(browser: Browser) -> np.ndarray:
    """The picture of the bodies, without what stands around it."""
    browser.ask("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    data = browser.ask('document.getElementById("scene").toDataURL("image/png")')
    return np.asarray(Image.open(io.BytesIO(base64.b64decode(data.split(",")[1]))).convert("RGB")).astype(int)


def test_browser(cairn: Program, scratch: Path) -> None:
    """From the disk, without a network: it draws what it should, and answers to mouse, keys and touch, without errors."""
    chromium = find_chromium()
    if not chromium:
        print("there is no Chromium (Debian: chromium): the page was not opened")
        return
    write_run(scratch / "run", 2, 3)
    view(scratch / "run")
    with Browser(chromium, 900, 700, patience=120 * PATIENCE) as browser:
        browser.open(scratch / "run" / "view.html")
        browser.wait("window.ready === true")
        first = scene(browser)
        check_drawn(browser, first)
        check_cut(browser)
        check_input(browser, first)
        print(f"{browser.ask('speed(10)'):.1f} frames a second of {browser.ask('head.points')} points at "
              f"{first.shape[1]} x {first.shape[0]}, drawn by software")
        expect(not browser.messages, f"the console says: {browser.messages}")
        expect(browser.ask("performance.getEntriesByType('resource').length") == 0, "something was loaded from elsewhere")


def check_drawn(browser: Browser, picture: np.ndarray) -> None:
    """The bodies' colours are there, over as much of the picture as their outline takes."""
    background = (picture.min(axis=2) > 250).mean()
    expect(0.3 < background < 0.9, f"{background} of the picture are empty")
    hue = picture[picture.min(axis=2) <= 250]
    colour = np.array(browser.ask("[...arrays.colour]")).reshape(-1, 3)
    for body in (1, 3, 5, 7):  # with z up, from azimuth 35, these are in sight
        own = colour[body] / np.linalg.norm(colour[body])
        like = (hue @ own) / np.maximum(np.linalg.norm(hue, axis=1), 1)
        expect((like > 0.999).sum() > 300, f"body {body} is not seen")


def check_cut(browser: Browser) -> None:
    """A cut face shows the values in the scale's colours."""
    browser.ask("set({ axis: 0, cut: 0.7, colour: 0, frame: 0, azimuth: 0, elevation: 0 }), showScale()")
    picture = scene(browser)
    scale = np.array(browser.ask("head.maps[head.values[0].map]")).reshape(-1, 3)
    exact = np.abs(picture.reshape(-1, 1, 3) - scale[None]).sum(axis=2).min(axis=1) < 4
    expect(exact.mean() > 0.1, f"{exact.mean()} of the picture have a colour of the scale")
    browser.ask("set({ axis: -1, colour: -1, frame: 2 }), reset()")


def check_input(browser: Browser, first: np.ndarray) -> None:
    """Turn, zoom, pick, play: by mouse, keys and touch."""
    middle = browser.ask("(() => { const r = $('scene').getBoundingClientRect(); return [r.left + r.width / 2, r.top + r.height / 2]; })()")
    expect(np.abs(scene(browser) - first).max() == 0, "reset does not give back the view")
    for press, name in (("ArrowLeft", "azimuth"), ("+", "zoom"), (".", "frame"), ("f", "colour"), ("c", "axis"), ("]", "cut"), ("x", "flip")):
        browser.ask("set({ frame: 0 })")
        before = browser.ask(f"state.{name}")
        browser.key(press)
        expect(browser.ask(f"state.{name}") != before, f"the key {press} does nothing")
    browser.ask("set({ axis: -1, colour: -1, frame: 2 }), reset()")
    browser.mouse("mousePressed", *middle, button="left", buttons=1, clickCount=1)
    browser.mouse("mouseMoved", middle[0] + 60, middle[1], button="left", buttons=1)
    browser.mouse("mouseReleased", middle[0] + 60, middle[1], button="left", clickCount=1)
    expect(abs(browser.ask("state.azimuth") - (35 - 24)) < 1e-6, browser.ask("state.azimuth"))
    browser.mouse("mouseWheel", *middle, deltaX=0, deltaY=-200)
    expect(browser.ask("state.zoom") > 1.2, "the wheel does not zoom")
    browser.ask("reset()")
    expect(browser.ask("state.picked") == -1, "dragging picks")
    browser.mouse("mousePressed", middle[0], middle[1] + 40, button="left", buttons=1, clickCount=1)
    browser.mouse("mouseReleased", middle[0], middle[1] + 40, button="left", clickCount=1)
    picked = browser.ask("$('picked').textContent") if browser.ask("(draw(), showPicked(), state.picked)") >= 0 else "nothing"
    expect(picked.startswith("Body "), f"a click picks {picked}")
    browser.ask("reset(), pick(-1)")
    browser.touch("touchStart", (middle[0] - 30, middle[1]), (middle[0] + 30, middle[1]))
    for k in (1, 2, 3):
        browser.touch("touchMove", (middle[0] - 30 - 20 * k, middle[1]), (middle[0] + 30 + 20 * k, middle[1]))
    browser.touch("touchEnd")
    expect(browser.ask("state.zoom") > 1.5, f"two fingers zoom to {browser.ask('state.zoom')}")
    browser.ask("reset(), set({ frame: 0, playing: true })")
    browser.wait("state.frame > 0")
    browser.ask("set({ playing: false, frame: 2 })")


def test_two_dimensions(cairn: Program, scratch: Path) -> None:
    """A real run in 2D, across a periodic boundary, with contacts."""
    few = {"time.steps": 40, "output.particles": "{ every = 20 }", "output.contacts": "{ every = 20 }", "output.grains": "{ every = 20 }"}
    expect_code(cairn("run", ROOT / "cases" / "shear_small.toml", "--out", scratch / "run", *sets(few)), 0)
    view(scratch / "run")
    head, arrays = unpacked(scratch / "run" / "view.html")
    expect(head["dimension"] == 2 and "pairs_2" in arrays and "kinetic_energy" in head["history"], list(arrays))
    expect(np.isfinite(arrays["stress"]).all(), "stresses of grains are missing")
    chromium = find_chromium()
    if chromium:
        with Browser(chromium, 900, 700, patience=120 * PATIENCE) as browser:
            browser.open(scratch / "run" / "view.html")
            browser.wait("window.ready === true")
            expect(0.05 < (scene(browser).min(axis=2) > 250).mean() < 0.8, "grains are not drawn")
            browser.ask("set({ contacts: true, picked: 5 })")
            strong = np.abs(scene(browser) - (166, 15, 36)).sum(axis=2) < 60
            expect(strong.sum() > 300, f"{strong.sum()} pixels of contacts")
            browser.ask("showPicked()")
            expect("contact" in browser.ask("$('picked').textContent"), browser.ask("$('picked').textContent"))
            expect(not browser.messages, f"the console says: {browser.messages}")


if __name__ == "__main__":
    sys.exit(run_tests(globals(), Program(sys.argv[1]), fresh_folder(sys.argv[2])))
