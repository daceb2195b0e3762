"""The tutorial does what it says: its files are written and its commands run, in its order.

    test_tutorial.py CAIRN SCRATCH

A block of TOML goes into the file that the text before it names with "into `NAME`". Lines set in by four blanks are
commands, with exit code 0 or the one that their comment says. Blocks of Python run in that folder.
"""

import os
import re
import subprocess
import sys
from pathlib import Path

from harness import PATIENCE, ROOT, Program, fresh_folder

LIMIT = 120  # of a command [s]


def blocks(text: str):
    """The page as ("text", ...), ("sh" | "toml" | "python", ...) and ("command", line), in order."""
    for i, part in enumerate(re.split(r"^```(\w*\n.*?)^```\n", text, flags=re.MULTILINE | re.DOTALL)):
        if i % 2:
            language, _, inner = part.partition("\n")
            yield language, inner
            continue
        for line in part.splitlines():
            yield ("command", line[4:]) if line.startswith("    ") else ("text", line)


def main() -> int:
    cairn, scratch = Program(sys.argv[1]), fresh_folder(sys.argv[2])
    folder, programs = scratch / "empty", scratch / "bin"
    folder.mkdir()
    programs.mkdir()
    (programs / "cairn").symlink_to(cairn.exe)
    environment = os.environ | {"PATH": f"{programs}:{os.environ['PATH']}"}
    said, done = "", {"command": 0, "toml": 0, "python": 0}
    for kind, content in blocks((ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")):
        done[kind] = done.get(kind, 0) + 1
        if kind == "text":
            said += content + "\n"
        elif kind == "toml":
            name = re.findall(r"nto `([\w.]+)`", said)[-1]
            assert not (folder / name).exists(), f"{name} is written twice"
            (folder / name).write_text(content, encoding="utf-8")
        elif kind in ("command", "python"):
            expected = re.search(r"# exit code (\d)", content) if kind == "command" else None
            words = ["bash", "-c", content] if kind == "command" else [sys.executable, "-c", content]
            ran = subprocess.run(words, cwd=folder, env=environment, capture_output=True, text=True,
                                 timeout=LIMIT * PATIENCE, check=False)
            assert ran.returncode == (int(expected[1]) if expected else 0), \
                f"{content}\nexit code {ran.returncode}\n{ran.stdout}\n{ran.stderr}"
            if content.startswith("cairn check"):
                assert ran.stderr == "", f"{content} warns: {ran.stderr}"
            print(f"{content.splitlines()[0]}: {(ran.stdout.strip().splitlines() or [''])[-1]}")
    assert done["command"] >= 20 and done["toml"] == 3 and done["python"] == 1, done
    # What the text says of the results.
    for picture in ("first/pictures/grains_start.png", "first/pictures/energy.png", "press/pictures/principal_stress.png"):
        assert (folder / picture).is_file(), f"{picture} was not drawn"
    assert not (folder / "oops").exists(), "a refused run has made its folder"
    return 0


if __name__ == "__main__":
    sys.exit(main())
