"""Measures of finished runs, each defined in docs/measures.md. `scripts/measure --help`."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "plotting"))  # results, which the pictures share
