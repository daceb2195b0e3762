"""What the pages show runs: every command and every case of README.md, CONTRIBUTING.md and docs/, taken from the page.

    test_pages.py CAIRN SCRATCH

Commands of the program, of mpirun and of the tools that look at results are run as they stand, page by page, in a folder
that looks like a clone. Those that install, build or take hours are not; their options must be in the script's --help.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

from harness import PATIENCE, ROOT, Program, fresh_folder

# The tutorial is run from its first line to its last by test_tutorial.py.
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md",
         *(page for page in sorted((ROOT / "docs").rglob("*.md")) if page.name != "tutorial.md")]
SHOWN = re.compile(r"(?:[A-Z_]+=\S+ )*(cairn|mpirun|scripts/\S+|build/\S+|ctest|cmake|git|export)\b.*")
RUN = {"cairn", "mpirun", "scripts/plot", "scripts/measure", "scripts/view", "scripts/report", "scripts/export",
       "scripts/compare-runs"}
NOT_RUN = {"scripts/quickstart", "scripts/test", "scripts/build", "scripts/bench", "scripts/validate", "scripts/check",
           "scripts/readme-pictures", "scripts/sand", "scripts/paraview", "scripts/convert-cells", "scripts/convert-labels",
           "ctest", "cmake", "export", "git"}
# A case for pages that only say case.toml, and results for those that start from some.
ANY_CASE = {"time": "end = 1e-3\nsteps = 40", "output.checkpoint": "{ every = 10 }"}
# In a synopsis, or of a tree that is installed (test_install.py).
PLACEHOLDERS = re.compile(r"\b(CASE|FILE|SPEC|DIR|KEY|NAME|RUN_DIR|PATTERN)\b|\.\.\.|^cairn \w+,|~/")


def commands(page: Path) -> list[str]:
    """The commands of a page: indented lines that start with a known word, without the remark behind them."""
    found = []
    for line in page.read_text().splitlines():
        if not line.startswith("    ") or not SHOWN.fullmatch(line.strip()):
            continue
        found.append(re.split(r"\s{2,}(?=[#a-z])", line.strip())[0].strip())
    return found


def cases(page: Path) -> list[str]:
    """The TOML blocks of a page that are whole cases."""
    return [block for block in re.findall(r"^```toml\n(.*?)^```", page.read_text(), re.MULTILINE | re.DOTALL)
            if "domain" in block and "bodies" in block]


def clone(cairn: Program, here: Path) -> None:
    """A folder in which the commands of a page find what a clone has, and a case and its results."""
    shutil.copytree(ROOT / "cases", here / "cases")
    (here / "scripts").symlink_to(ROOT / "scripts")
    (here / "build" / "release" / "bin").mkdir(parents=True)
    (here / "build" / "release" / "bin" / "cairn").symlink_to(cairn.exe)
    text = (ROOT / "cases" / "two_disks.toml").read_text()
    text = re.sub(r"(?ms)^\[time\].*?(?=^\[)", f"[time]\n{ANY_CASE['time']}\n\n", text)
    text = re.sub(r"(?ms)^\[output\].*?(?=^\[|\Z)", "", text)
    text += f"\n[output]\nhistory = {{ every = 10 }}\ncheckpoint = {ANY_CASE['output.checkpoint']}\n"
    (here / "case.toml").write_text(text)
    for done in (cairn("run", "case.toml", "--out", name, cwd=here) for name in ("plain",)):
        assert done.code == 0, done.err


def shell(command: str, here: Path) -> str:
    """Runs a command; says what went wrong."""
    environment = {**os.environ, "PATH": f"{here / 'build/release/bin'}:{os.environ['PATH']}",
                   "OMPI_MCA_rmaps_base_oversubscribe": "1"}
    try:
        done = subprocess.run(["bash", "-c", command], cwd=here, env=environment, capture_output=True, text=True,
                              timeout=300 * PATIENCE, check=False)
    except subprocess.TimeoutExpired:
        return f"'{command}' did not end"
    return "" if done.returncode == 0 else f"'{command}' ended with {done.returncode}:\n{done.stdout}{done.stderr}"


def options_problem(command: str) -> str:
    """What is wrong with the options of a script that is not run."""
    for part in re.split(r"\s*&&\s*", command):
        words = part.split()
        if not words[0].startswith("scripts/"):
            continue
        text = subprocess.run([ROOT / words[0], "--help"], capture_output=True, text=True, check=False)
        if text.returncode != 0:
            return f"{words[0]} --help ended with {text.returncode}"
        missing = [w for w in words[1:] if w.startswith("--") and w not in text.stdout and words[0] != "scripts/test"]
        if missing:
            return f"{words[0]} does not know {', '.join(missing)}"
    return ""


def word_of(command: str) -> str:
    return next(word for word in command.split() if "=" not in word)


def check_page(cairn: Program, page: Path, here: Path) -> list[str]:
    problems = []
    clone(cairn, here)
    for i, case in enumerate(cases(page)):
        name = re.search(r"file `(\w+\.toml)`", page.read_text())
        file = here / (name.group(1) if name and i == 0 else f"case_{i}.toml")
        file.write_text(case)
        done = cairn("run", file.name, "--out", f"results_of_{file.stem}", cwd=here, timeout=300)
        if done.code != 0 or not done.last.startswith("done "):
            problems.append(f"case {i} ended with {done.code}: {done.err}")
    ran = 0
    for command in commands(page):
        word = word_of(command)
        if word in RUN or word.startswith("build/"):
            if PLACEHOLDERS.search(command):
                continue  # a synopsis
            ran += 1
            problems.append(shell(command, here))
        elif word in NOT_RUN:
            problems.append(options_problem(command))
        else:
            problems.append(f"'{command}' is run by no test: say in test_pages.py how")
    print(f"{page.relative_to(ROOT)}: {len(cases(page))} cases and {ran} commands run")
    return [f"{page.relative_to(ROOT)}: {problem}" for problem in problems if problem]


def check_cases(cairn: Program, here: Path) -> list[str]:
    """Every case that is shipped is read, and its first steps are made."""
    problems = []
    for file in sorted((ROOT / "cases").rglob("*.toml")):
        if "packs" in file.parts:
            continue
        done = cairn("run", file, "--out", here / file.stem, "--set", "time.steps=10", timeout=300)
        if done.code != 0:
            problems.append(f"{file.relative_to(ROOT)} ended with {done.code}: {done.err}")
    return problems


def check_table_of_cases() -> list[str]:
    """The README names the cases that are there."""
    named = set(re.findall(r"`(?:cases/)?(\w+\.toml)`", (ROOT / "README.md").read_text())) - {"case.toml"}
    there = {file.name for file in (ROOT / "cases").glob("*.toml")}
    return [] if named == there else [f"README.md names {sorted(named ^ there)}, or they are not in cases/"]


def main() -> int:
    cairn, scratch = Program(sys.argv[1]), fresh_folder(sys.argv[2])
    problems = check_table_of_cases()
    for page in PAGES:
        here = scratch / str(page.relative_to(ROOT)).replace("/", "_")
        here.mkdir()
        problems += check_page(cairn, page, here)
    (scratch / "cases").mkdir()
    problems += check_cases(cairn, scratch / "cases")
    print("\n".join(problems))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
