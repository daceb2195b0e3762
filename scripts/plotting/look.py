"""What pictures show, and how: what a user may choose."""

from __future__ import annotations

from dataclasses import dataclass, field

from surface import Plane


@dataclass
class Look:
    colour: str = "body"  # or the name of a value (scalars.py)
    planes: list[Plane] = field(default_factory=list)  # that cut bodies open (3D)
    azimuth: float | None = None  # degrees about the vertical axis; None: so that cut faces are seen
    elevation: float | None = None  # degrees above the horizon
    zoom: float = 1.0
    perspective: bool = False
    times: list[float] = field(default_factory=list)  # of the outputs shown [s]; none: the last
    range: tuple[float, float] | None = None  # of the colour scale; None: from the values
    width: int = 900  # of a picture in space [pixels]
    height: int = 700
