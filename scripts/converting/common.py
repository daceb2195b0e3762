"""What the converters share: errors with their place, and files that replace nothing of others."""

import os
import sys


class InputError(Exception):
    """What is wrong, where, and what would be right."""


class CutOff(InputError):
    """A file that ends before what it began is whole."""


# Metres in each unit of length.
UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "inch": 0.0254}


def printable(text):
    """The text without what a terminal would act on."""
    return "".join(c if c.isprintable() or c == "\n" else "?" for c in str(text))


def note(text):
    print(f"note: {printable(text)}", file=sys.stderr)


def check_target(output, source, is_own):
    """Refuses to replace what a converter did not write; `is_own` tells from a file's first bytes."""
    if output == "-" or not os.path.lexists(output):
        return
    try:
        if os.path.exists(source) and os.path.samefile(output, source):
            raise InputError(f"{output}: is the input; name another file")
        if os.path.islink(output) or not os.path.isfile(output):
            raise InputError(f"{output}: is not a regular file (a link, folder or device); name another file")
        with open(output, "rb") as file:
            first = file.read(100_000)
    except OSError as error:
        raise InputError(f"{output}: cannot be looked at: {error.strerror}") from None
    if first and not is_own(first):
        raise InputError(f"{output}: was not written by this program; name another file")


def part_of(output):
    """The name under which a file is written before it is whole."""
    return os.path.join(os.path.dirname(output), f".{os.path.basename(output)}.part")


def publish(output, write):
    """All of a file or nothing: `write` makes it under another name first."""
    part = part_of(output)
    try:
        if os.path.lexists(part):
            os.unlink(part)
        write(part)
        os.replace(part, output)
    except OSError as error:
        raise InputError(f"{output}: cannot be written: {error.strerror or error}") from None


def run(main):
    """The exit code of a converter: 0 done, 2 the input is wrong."""
    try:
        main()
    except InputError as error:
        print(printable(error), file=sys.stderr)
        return 2
    return 0
