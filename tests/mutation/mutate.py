#!/usr/bin/env python3
"""Mutation check: one operator of the sources is changed at a time, and the unit tests of that layer should notice.

    mutate.py LAYER [LAYER...] [--count N] [--seed S] [--build DIR] [--also TEST]

Works on a copy of the committed tree below DIR (default: build/mutants). Prints a line for each change, and at the end the
survivors: changes that no test notices. What they mean, and those that are known: docs/notes/mutation.md.
"""

import argparse
import random
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SWAPS = {" + ": " - ", " - ": " + ", " * ": " / ", " / ": " * ", " += ": " -= ", " -= ": " += ", " < ": " <= ",
         " <= ": " < ", " > ": " >= ", " >= ": " > ", " == ": " != ", " != ": " == ", " && ": " || ", " || ": " && ",
         "true": "false", "false": "true", "std::min(": "std::max(", "std::max(": "std::min(", "return -": "return ",
         " 0.5": " 0.4"}
PATTERN = re.compile("|".join(re.escape(old) for old in sorted(SWAPS, key=len, reverse=True)))
SKIPPED = re.compile(r"^\s*(//|#|/\*|\*|using |template|namespace|static_assert)|throw |fmt::|concept |requires ")


def places(tree: Path, layer: str) -> list[tuple[Path, int, int, str]]:
    """File, line, column and operator of everything that can be changed in a layer."""
    found = []
    for folder in (tree / "src" / layer, tree / "include/cairn" / layer):
        for file in sorted(folder.rglob("*.[ch]pp")):
            for number, line in enumerate(file.read_text(encoding="utf-8").splitlines()):
                code = line.split("//")[0]
                if SKIPPED.search(code):
                    continue
                found += [(file, number, m.start(), m.group()) for m in PATTERN.finditer(code)
                          if code[:m.start()].count('"') % 2 == 0]
    return found


def quiet(*command: str | Path, seconds: int = 1800) -> int:
    try:
        return subprocess.run([str(word) for word in command], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                              check=False, timeout=seconds).returncode
    except subprocess.TimeoutExpired:
        return 124


def verdict(build: Path, tests: list[str]) -> str:
    """What becomes of the changed tree."""
    if quiet("cmake", "--build", build, "--target", *tests) != 0:
        return "does not compile"
    noticed = any(quiet("timeout", "300", next(build.rglob(f"bin/{test}"), build / "tests" / test)) for test in tests)
    return "noticed" if noticed else "SURVIVES"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("layers", nargs="+")
    parser.add_argument("--count", type=int, default=20, help="changes in each layer")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--build", type=Path, default=ROOT / "build/mutants")
    parser.add_argument("--also", action="append", default=[], help="a further test program to ask, such as test_solver")
    arguments = parser.parse_args()
    tree, build = arguments.build.absolute() / "source", arguments.build.absolute() / "release"
    if not tree.exists():
        subprocess.run(["git", "-C", ROOT, "worktree", "add", "--detach", tree, "HEAD"], check=True)
    subprocess.run(["cmake", "--preset", "release", "-S", tree, "-B", build], check=True, cwd=tree,
                   stdout=subprocess.DEVNULL)
    survivors, counts = [], {}
    for layer in arguments.layers:
        tests = [f"test_{layer}", *arguments.also]
        if (state := verdict(build, tests)) != "SURVIVES":
            sys.exit(f"the tests of {layer} fail, or do not build, before any change: {state}")
        choice = random.Random(arguments.seed)
        for file, line, column, old in choice.sample(all_places := places(tree, layer),
                                                     min(arguments.count, len(all_places))):
            text = file.read_text(encoding="utf-8")
            lines = text.splitlines(keepends=True)
            lines[line] = lines[line][:column] + SWAPS[old] + lines[line][column + len(old):]
            try:
                file.write_text("".join(lines), encoding="utf-8")
                state = verdict(build, tests)
            finally:
                file.write_text(text, encoding="utf-8")
            counts[state] = counts.get(state, 0) + 1
            said = f"{file.relative_to(tree)}:{line + 1}: {lines[line].strip()}   [was{old.rstrip()}]"
            print(f"{state}: {said}", flush=True)
            if state == "SURVIVES":
                survivors.append(said)
    print("\n" + ", ".join(f"{number} {state}" for state, number in sorted(counts.items())))
    print("\n".join(survivors))
    return 0


if __name__ == "__main__":
    sys.exit(main())
