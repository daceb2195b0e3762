"""The problems of the suite, one module each, in the order of the table."""

from __future__ import annotations

import importlib

NAMES = ("block", "limits", "disk", "sphere", "backspin", "disks", "bars", "hertz", "cylinder", "collinear", "zigzag",
         "waves", "rotation", "grains", "column", "rest", "walls", "laboratory")


def load(names: list[str]) -> list:
    return [importlib.import_module(f"validation.problems.{name}").PROBLEM for name in names]
