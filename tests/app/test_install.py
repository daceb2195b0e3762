"""The installed tree works alone, from another folder, and holds what a user needs.

    test_install.py CAIRN SCRATCH
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

from harness import ROOT, Program, expect, fresh_folder, sets


def bash(text: str, path: Path) -> str:
    environment = os.environ | {"PATH": f"{path}:{os.environ['PATH']}"}
    done = subprocess.run(["bash", "-c", text], capture_output=True, text=True, check=False, env=environment)
    expect(done.returncode == 0, f"{text}: {done.stderr}")
    return done.stdout


def completed(prefix: Path, *words: str) -> list[str]:
    """What bash offers for the last of the words."""
    text = f"""source '{prefix}/share/bash-completion/completions/cairn'
    COMP_WORDS=({' '.join(repr(w) for w in words)}); COMP_CWORD={len(words) - 1}
    compopt() {{ :; }}
    _cairn; printf '%s\\n' "${{COMPREPLY[@]}}" """
    return bash(text, prefix / "bin").split()


def main() -> int:
    built, scratch = Path(sys.argv[1]).resolve().parents[1], fresh_folder(sys.argv[2])
    staged, prefix = scratch / "staged", scratch / "in stalled"  # moved afterwards: nothing may point to where it was
    subprocess.run(["cmake", "--install", built, "--prefix", staged], check=True, stdout=subprocess.DEVNULL)
    staged.rename(prefix)
    cairn, here = Program(str(prefix / "bin" / "cairn")), scratch / "work"
    here.mkdir()

    commands = re.findall(r"^  ([a-z][a-z-]*) +[A-Z]", cairn("--help").out, re.MULTILINE)
    expect(len(commands) == 15, f"commands: {commands}")
    expect(f"Manual: {prefix}/share/doc/cairn" in cairn("--help").out, cairn("--help").out)
    pages = prefix / "share" / "doc" / "cairn"
    for page in [*(ROOT / "docs").glob("*.md"), ROOT / "README.md", ROOT / "LICENSE"]:
        expect((pages / page.name).read_bytes() == page.read_bytes(), f"{page.name} was not installed")
    manual = (prefix / "share" / "man" / "man1" / "cairn.1").read_text().replace("\\-", "-")
    for command in commands:
        expect(re.search(rf"^\.B {command}$", manual, re.MULTILINE), f"the man page lacks {command}")
    expect(sorted(completed(prefix, "cairn", "")) == sorted([*commands, "--help", "--version"]),
           completed(prefix, "cairn", ""))
    expect(completed(prefix, "cairn", "run", "case.toml", "--set", "solver.fl") == ["solver.flip="], "no key is offered")
    options = re.findall(r"--[a-z-]+", cairn("run", "--help").out)
    expect(set(completed(prefix, "cairn", "run", "--")) == set(options), f"options of run: {options}")

    for case in ("two_disks", "shear_small"):
        file = prefix / "share" / "cairn" / "cases" / f"{case}.toml"
        done = cairn("run", file, "--out", case, *sets({"time.steps": 5}), ranks=2, cwd=here)
        expect(done.code == 0, done.err)
    done = cairn("plot", "two_disks", cwd=here, timeout=300)
    expect(done.code == 0 and (here / "two_disks" / "pictures" / "grains_end.png").is_file(), done.err)
    for tool, made in (("export", "export/grains.dump"), ("view", "view.html"), ("report", "report.html")):
        done = cairn(tool, "two_disks", cwd=here, timeout=300)
        expect(done.code == 0 and (here / "two_disks" / made).is_file(), f"{tool}: {done.err}")
    expect(cairn("compare-runs", "two_disks", "two_disks", cwd=here).code == 0, "compare-runs")
    (here / "rows.txt").write_text("#format x_y_z_r\n0 0 0 1\n")
    expect(cairn("convert-grains", "rows.txt", "-o", "rows.csv", cwd=here).code == 0, "convert-grains")
    of_source = [p for p in prefix.rglob("*") if p.is_symlink() and str(ROOT) in str(p.resolve())]
    expect(not of_source, f"links to the source: {of_source}")
    shutil.rmtree(prefix)
    return 0


if __name__ == "__main__":
    sys.exit(main())
