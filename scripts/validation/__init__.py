"""The validation suite: the papers' results and closed forms, run, compared and drawn. `scripts/validate --help`."""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts" / "plotting"))  # results and raster, which the pictures share
