"""What the commands that look at results share: a folder for what they write, and one line for what goes wrong."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from results import Damaged, MissingData


def folder_in(results: Path, name: str) -> Path:
    """A folder of that name in the results, made where it is missing; it must not lead out of them."""
    return own_folder(results / name)


def own_folder(folder: Path) -> Path:
    """The folder, made where it is missing; a link is not followed."""
    if folder.is_symlink():
        raise Damaged(f"{folder} is a link, which is not followed; remove it")
    if folder.exists() and not folder.is_dir():
        raise Damaged(f"{folder} is not a folder; move it away")
    folder.mkdir(exist_ok=True)
    return folder


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """A draft beside `path`, which takes its name when it is whole; a link of that name is replaced and not followed."""
    if path.is_dir() and not path.is_symlink():
        raise Damaged(f"{path} is a folder; move it away")
    handle, draft = tempfile.mkstemp(dir=path.parent or ".", prefix=".", suffix=path.suffix)
    os.close(handle)
    try:
        yield Path(draft)
        os.chmod(draft, 0o666 & ~_umask())
        os.replace(draft, path)
    finally:
        Path(draft).unlink(missing_ok=True)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def run_command(name: str, run: Path, what: str, function: Callable[[], int]) -> int:
    """Calls the function; the exit code, and one line for what goes wrong: 2 for wrong input, 3 where nothing can be
    written."""
    try:
        return function()
    except (MissingData, Damaged) as error:
        return refuse(name, str(error), 2)
    except (OSError, subprocess.CalledProcessError) as error:
        return refuse(name, f"cannot write {what}: {error}", 3)
    except (ArithmeticError, LookupError, MemoryError, TypeError, ValueError) as error:
        # Each file can be read, but they are not of one run. CAIRN_TRACEBACK=1 shows where, should it be a fault here.
        if os.environ.get("CAIRN_TRACEBACK"):
            raise
        return refuse(name, f"{run}: the results do not fit together: {type(error).__name__}: {error}", 2)


def refuse(name: str, text: str, code: int) -> int:
    """One line of error."""
    print(f"{name}: " + "".join(c if c.isprintable() else " " for c in text), file=sys.stderr)
    return code
