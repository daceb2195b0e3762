"""scripts/report says what a reader must know: warnings, program, energies, forces; it prints where there is a browser.

    test_report.py CAIRN SCRATCH
"""

import importlib.util
import json
import re
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

from harness import PATIENCE, ROOT, SKIP, Program, expect, expect_code, fresh_folder, run_tests, sets

for package in ("numpy", "h5py", "matplotlib", "PIL"):
    if importlib.util.find_spec(package) is None:
        print(f"Python lacks {package}")
        sys.exit(SKIP)

FEW = {"time.steps": 40, "output.particles": "{ every = 20 }", "output.history": "{ every = 5 }", "output.forces": "{ every = 5 }"}


class Checked(HTMLParser):
    """Tags are closed in the order in which they were opened."""

    VOID = {"meta", "img", "br", "link"}

    def __init__(self):
        super().__init__()
        self.open, self.images = [], 0

    def handle_starttag(self, tag, attributes):
        self.images += tag == "img"
        if tag not in self.VOID:
            self.open.append(tag)
        expect(not any(name == "src" and not value.startswith("data:") for name, value in attributes), "it needs a network")

    def handle_endtag(self, tag):
        if tag in self.open:  # rows and cells may be closed by what holds them
            while self.open.pop() != tag:
                pass
        else:
            expect(False, f"</{tag}> closes nothing")


def report(*arguments, code: int = 0) -> subprocess.CompletedProcess:
    done = subprocess.run([ROOT / "scripts" / "report", *map(str, arguments)], capture_output=True, text=True,
                          timeout=500 * PATIENCE, check=False)
    expect(done.returncode == code and "Traceback" not in done.stderr, f"exit code {done.returncode}\n{done.stderr}")
    return done


def section(text: str, name: str) -> str:
    return re.search(rf"<h2>{name}</h2>(.*?)(<h2>|</body>)", text, re.DOTALL).group(1)


def test_whole(cairn: Program, scratch: Path) -> None:
    """All parts are there, with the numbers of the run; of a failed run the page says so first."""
    run = scratch / "press"
    expect_code(cairn("run", ROOT / "cases" / "press.toml", "--out", run, *sets(FEW)), 0)
    report(run)
    text = (run / "report.html").read_text()
    checked = Checked()
    checked.feed(text)
    expect(not checked.open and checked.images >= 4, f"{checked.open} are left open, {checked.images} pictures")
    expect("None." in section(text, "Warnings"), section(text, "Warnings"))
    entry = json.loads((run / "run.json").read_text())["runs"][-1]
    for word in (entry["commit"], entry["compiler"].split()[0], entry["mpi"]):
        expect(word in section(text, "Program and machine"), f"{word} is missing")
    for word in ("lid", "bottom", "impulse along y"):
        expect(word in section(text, "Forces on walls and tools"), f"{word} is missing")
    expect("kinetic energy" in section(text, "Energy") and "J/m" in section(text, "Energy"), section(text, "Energy")[-2000:])
    expect("viscoelastic" in section(text, "What was computed"), section(text, "What was computed"))


def test_warnings(cairn: Program, scratch: Path) -> None:
    """A failure, an energy book that is off, points that were stopped, a run that did not end: each is said."""
    run = scratch / "failed"
    done = cairn("run", ROOT / "cases" / "two_disks.toml", "--out", run, "--set", "solver.energy_limit=1e-15",
                 *sets(FEW | {"bodies.0.angular_velocity": 5.0}))
    expect_code(done, 3)
    report(run)
    text = (run / "report.html").read_text()
    expect("The run failed" in section(text, "Warnings") and "THE RUN FAILED" in text, section(text, "Warnings"))
    lines = (run / "history.csv").read_text().splitlines()
    names, last = lines[0].split(","), lines[-1].split(",")
    last[names.index("energy_error")], last[names.index("points_stopped")] = "0.2", "3"
    (run / "history.csv").write_text("\n".join([*lines[:-1], ",".join(last)]) + "\n")
    record = json.loads((run / "run.json").read_text())
    record["runs"][-1]["exit_code"] = record["runs"][-1]["end"] = None
    (run / "run.json").write_text(json.dumps(record))
    report(run)
    said = section((run / "report.html").read_text(), "Warnings")
    for words in ("off by up to 20 %", "3 times a material point was kept", "did not end"):
        expect(words in said, f"{words} is not in {said}")


def test_bad_folders(cairn: Program, scratch: Path) -> None:
    """What is no run, or damaged: one line; a title is text; a link is not followed."""
    run = scratch / "run"
    expect_code(cairn("run", ROOT / "cases" / "two_disks.toml", "--out", run, *sets(FEW)), 0)
    case = (run / "case.toml").read_text()
    (run / "case.toml").write_text(re.sub(r"(?m)^title = .*$", "title = '<script>alert(1)</script>'", case))
    (scratch / "kept").write_text("kept")
    (run / "report.html").symlink_to("../kept")
    report(run)
    expect((scratch / "kept").read_text() == "kept", "a link was followed")
    expect("<script" not in (run / "report.html").read_text(), "the title is a script")
    damage = {"record": ("run.json", b"{"), "forces": ("forces.csv", b"a,b\n1\n"), "case": ("case.toml", b"= =")}
    for name, (file, content) in damage.items():
        shutil.copytree(run, scratch / name)
        (scratch / name / file).write_bytes(content)
    (scratch / "empty").mkdir()
    for name in (*damage, "empty", "nowhere"):
        done = report(scratch / name, code=2)
        expect(len(done.stderr.splitlines()) == 1 and done.stderr.startswith("report: "), f"{name}: {done.stderr}")


def test_pdf(cairn: Program, scratch: Path) -> None:
    """Printed where there is Chromium; refused in a line where there is none."""
    sys.path.insert(0, str(ROOT / "scripts" / "plotting"))
    from browser import find_chromium

    run = scratch / "run"
    expect_code(cairn("run", ROOT / "cases" / "two_disks.toml", "--out", run, *sets(FEW)), 0)
    if not find_chromium():
        expect("needs Chromium" in report(run, "--pdf", code=2).stderr, "not said")
        print("there is no Chromium (Debian: chromium): nothing was printed")
        return
    report(run, "--pdf")
    printed = (run / "report.pdf").read_bytes()
    expect(printed.startswith(b"%PDF") and len(printed) > 20000, f"{len(printed)} bytes")


if __name__ == "__main__":
    sys.exit(run_tests(globals(), Program(sys.argv[1]), fresh_folder(sys.argv[2])))
