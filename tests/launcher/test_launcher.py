"""The launcher starts the best program that this processor can run, or the one that CAIRN_ISA names.

    test_launcher.py LAUNCHER SCRATCH
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

LEVELS = ("x86-64-v2", "x86-64-v3", "x86-64-v4")
NEEDED = {"x86-64-v2": {"sse4_2", "ssse3", "popcnt"}, "x86-64-v3": {"avx2", "bmi1", "bmi2", "fma"},
          "x86-64-v4": {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"}}


def here() -> list[str]:
    """The levels of this processor, by the system's account."""
    text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    flags = set(next(line for line in text.splitlines() if line.startswith("flags")).split())
    have = []
    for level in LEVELS:
        if not NEEDED[level] <= flags:
            break
        have.append(level)
    return have


def tree(scratch: Path, launcher: str, levels) -> Path:
    """An installed tree, with a blank in its name, whose programs say their names and arguments."""
    root = scratch / f"in stalled {len(list(scratch.iterdir()))}"
    (root / "bin").mkdir(parents=True)
    (root / "libexec" / "cairn").mkdir(parents=True)
    shutil.copy(launcher, root / "bin" / "cairn")
    for level in levels:
        program = root / "libexec" / "cairn" / f"cairn-{level}"
        program.write_text(f"#!/bin/sh\necho {level} \"$@\"\nexit 4\n")
        program.chmod(0o755)
    return root / "bin" / "cairn"


def started(program: Path, wanted: str | None = None, *arguments: str) -> tuple[int, str]:
    environment = {k: v for k, v in os.environ.items() if k != "CAIRN_ISA"}
    if wanted is not None:
        environment["CAIRN_ISA"] = wanted
    done = subprocess.run([program, *arguments], capture_output=True, text=True, env=environment, check=False)
    return done.returncode, (done.stdout + done.stderr).strip()


def main():
    launcher, scratch = sys.argv[1], Path(sys.argv[2])
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir(parents=True)
    have = here()
    if not have:
        return 77
    whole = tree(scratch, launcher, LEVELS)
    assert started(whole, None, "run", "a b") == (4, f"{have[-1]} run a b"), started(whole, None, "run", "a b")
    assert started(whole, "") == (4, have[-1]), "an empty CAIRN_ISA"
    for level in LEVELS:
        code, text = started(whole, level)
        if level in have:
            assert (code, text) == (4, level), f"CAIRN_ISA={level}: {code} {text}"
        else:
            assert code == 2 and "does not have it" in text and len(text.splitlines()) == 1, f"{level}: {code} {text}"
    code, text = started(whole, "avx9")
    assert code == 2 and all(level in text for level in LEVELS), f"{code} {text}"
    assert started(tree(scratch, launcher, LEVELS[:1])) == (4, LEVELS[0]), "the lowest alone"
    code, text = started(tree(scratch, launcher, LEVELS[:1]), LEVELS[1])
    assert code == 2 and "must be one of x86-64-v2" in text, f"{code} {text}"
    code, text = started(tree(scratch, launcher, []))
    assert code == 2 and "there is no" in text, f"{code} {text}"
    (scratch / "link").symlink_to(whole)
    assert started(scratch / "link") == (4, have[-1]), "through a link"
    return 0


if __name__ == "__main__":
    sys.exit(main())
