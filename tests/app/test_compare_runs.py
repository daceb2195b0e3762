"""scripts/compare-runs finds every kind of difference, and none where there is none.

    test_compare_runs.py CAIRN SCRATCH     (the program itself is not needed)
"""

import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np

SCRIPT = Path(__file__).resolve().parents[2] / "scripts" / "compare-runs"


def write_run(folder: Path, change=None):
    """A small result folder; `change` is given the open HDF5 file."""
    folder.mkdir(parents=True)
    (folder / "history.csv").write_text("step,time\n0,0\n10,0.5\n")
    with h5py.File(folder / "grains_000000.h5", "w") as file:
        file.attrs["time"] = 0.5
        group = file.create_group("data")
        group["mass"] = np.array([1.0, np.nan, -0.0])
        group["centre"] = np.arange(6.0).reshape(3, 2)
        group["empty"] = np.zeros((0, 3))
        file["mass"] = h5py.SoftLink("/data/mass")
        if change:
            change(file)


def set_value(path, place, value):
    def change(file):
        file[path][place] = value

    return change


def replace(path, values):
    def change(file):
        del file[path]
        file[path] = values

    return change


def set_attribute(file):
    file.attrs["time"] = np.nextafter(0.5, 1)


def add_dataset(file):
    file["more"] = 1.0


CHANGES = {  # what is changed -> what the report must say
    "value": (set_value("data/centre", (2, 1), 7.0), "/data/centre row 2 component 1: 5.0 and 7.0"),
    "sign of zero": (set_value("data/mass", 2, 0.0), "/data/mass row 2: -0.0 and 0.0"),
    "type": (replace("data/mass", np.array([1, 2, 3])), "/data/mass: float64 (3,) and int64 (3,)"),
    "shape": (replace("data/empty", np.zeros((1, 3))), "/data/empty: float64 (0, 3) and float64 (1, 3)"),
    "attribute": (set_attribute, "/ attribute time: 0.5 and 0.5000000000000001"),
    "dataset": (add_dataset, "/more: only in the second"),
}


def compare(a: Path, b: Path) -> tuple[int, str]:
    done = subprocess.run([SCRIPT, a, b], capture_output=True, text=True)
    assert not done.stderr, done.stderr
    return done.returncode, done.stdout


def expect_difference(a: Path, b: Path, message: str):
    code, text = compare(a, b)
    assert code == 1 and message in text, f"expected '{message}', exit code {code}:\n{text}"


def main(scratch: Path):
    shutil.rmtree(scratch, ignore_errors=True)
    write_run(scratch / "a")
    write_run(scratch / "same")
    code, text = compare(scratch / "a", scratch / "same")
    assert (code, text) == (0, "2 files: the same bits\n"), text

    for name, (change, message) in CHANGES.items():
        write_run(scratch / name, change)
        expect_difference(scratch / "a", scratch / name, message)

    table, fewer = scratch / "same" / "history.csv", scratch / "fewer"
    table.write_text("step,time\n0,0\n10,0.25\n")
    expect_difference(scratch / "a", scratch / "same", "history.csv: line 3: time 0.5 and 0.25")
    table.write_text("step,time\n0,0\n")
    expect_difference(scratch / "a", scratch / "same", "3 and 2 lines")
    write_run(fewer)
    (fewer / "grains_000000.h5").unlink()
    expect_difference(scratch / "a", fewer, f"grains_000000.h5: only in {scratch / 'a'}")
    (fewer / "grains_000000.h5").write_text("no HDF5")
    expect_difference(scratch / "a", fewer, "cannot be read")
    for name, text in (("case_a", "dt = 1.0\n[parallel]\npartition = 1\n[[grains]]\nfile = 'case_grains_0.csv'\n"),
                       ("case_b", "grains = [{ file = 'case_grains_0.csv' }]\ndt = 1.0\n[parallel]\npartition = 2\n"),
                       ("case_c", "grains = [{ file = 'case_grains_1.csv' }]\ndt = 2.0\n"), ("case_d", "dt = \n")):
        write_run(scratch / name)
        (scratch / name / "case.toml").write_text(text)
    code, text = compare(scratch / "case_a", scratch / "case_b")
    assert (code, text) == (0, "3 files: the same bits\n"), text
    expect_difference(scratch / "case_a", scratch / "case_c", "case.toml: dt: 1.0 and 2.0")
    expect_difference(scratch / "case_a", scratch / "case_c", "case.toml: grains.0.file: 'case_grains_0.csv' and")
    expect_difference(scratch / "case_a", scratch / "case_d", "case.toml: cannot be read")
    expect_difference(scratch / "case_a", scratch / "a", f"case.toml: only in {scratch / 'case_a'}")
    for name, row in (("case_a", "1,1,1"), ("case_b", "1,1,2")):
        (scratch / name / "case_grains_0.csv").write_text(f"x,y,r\n{row}\n")
    expect_difference(scratch / "case_a", scratch / "case_b", "case_grains_0.csv: line 2: r 1 and 2")
    (scratch / "nothing").mkdir()
    expect_difference(scratch / "a", scratch / "nothing", "no result folder")


if __name__ == "__main__":
    main(Path(sys.argv[2]))
