"""What stands around a picture in space: title, colour scale with its unit, scale bar, axes. Drawn without matplotlib's
figures, which take longer than the picture itself."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import matplotlib
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from camera import Camera
from chains import STRONG, WEAK
from colours import MAPS

INK, PAPER = (40, 40, 40), (255, 255, 255)
WARNING = (190, 20, 20)
AXIS_COLOURS = ((200, 60, 50), (40, 140, 70), (50, 90, 200))
TITLE = 30  # height of the line above the picture [pixels]
SCALE = 116  # width of the strip to the right, with a colour scale [pixels]
PREFIXES = {-12: "p", -9: "n", -6: "\N{MICRO SIGN}", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}


@lru_cache(maxsize=8)
def font(size: int) -> ImageFont.FreeTypeFont:
    return ImageFont.truetype(str(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"), size)


def prefixed(value: float, unit: str) -> tuple[float, str]:
    """Factor and name of the unit in which `value` reads well: (1e-6, "MPa") for 3e7 Pa."""
    if not unit or unit[0] == "1" or not np.isfinite(value) or value == 0:
        return 1.0, unit
    if "m\N{SUPERSCRIPT THREE}" == unit:
        return 1.0, unit
    power = int(np.clip(3 * np.floor(np.log10(abs(value) * 1.0001) / 3), -12, 9))
    return 10.0**-power, PREFIXES[power] + unit


def nice(value: float) -> float:
    """The largest 1, 2 or 5 times a power of ten that is no larger."""
    power = 10 ** np.floor(np.log10(value))
    return float(max(step for step in (1, 2, 5) if step * power <= value * 1.0000001) * power)


def ticks(low: float, high: float) -> list[float]:
    step = nice((high - low) / 4) if high > low else 1.0
    return [step * i for i in range(int(np.ceil(low / step - 1e-9)), int(np.floor(high / step + 1e-9)) + 1)]


class Sheet:
    """A picture (rows x columns x 3, 0 to 1) with room for words."""

    def __init__(self, picture: np.ndarray, title: str, failed: bool = False, scale: bool = False):
        rows, columns = picture.shape[:2]
        self.rows, self.columns = rows, columns
        self.image = Image.new("RGB", (columns + (SCALE if scale else 0), rows + TITLE), (255, 255, 255))
        self.image.paste(Image.fromarray((255 * np.clip(picture, 0, 1) + 0.5).astype(np.uint8)), (0, TITLE))
        self.draw = ImageDraw.Draw(self.image)
        self._title(title, WARNING if failed else INK)

    def _title(self, title: str, colour: tuple) -> None:
        size, room = 17, self.image.width - 20
        while size > 9 and font(size).getlength(title) > room:
            size -= 1
        while len(title) > 4 and font(size).getlength(title) > room:
            title = title[:-2].rstrip("\N{HORIZONTAL ELLIPSIS}") + "\N{HORIZONTAL ELLIPSIS}"
        self.draw.text((10, 6), title, fill=colour, font=font(size))

    def colour_scale(self, low: float, high: float, name: str, title: str, unit: str) -> None:
        """To the right of the picture; the title runs upwards."""
        factor, unit = prefixed(max(abs(low), abs(high)), unit)
        left, top, tall, wide = self.columns + 12, TITLE + 30, self.rows - 60, 18
        bar = np.repeat(MAPS[name][np.linspace(255, 0, tall).astype(int)][:, None], wide, axis=1)
        self.image.paste(Image.fromarray((255 * bar).astype(np.uint8)), (left, top))
        self.draw.rectangle((left, top, left + wide, top + tall), outline=INK)
        for value in ticks(low * factor, high * factor):
            y = top + tall * (1 - (value / factor - low) / (high - low))
            self.draw.line((left + wide, y, left + wide + 5, y), fill=INK)
            self.draw.text((left + wide + 8, y), f"{value:.6g}".replace("-", "\N{MINUS SIGN}"), fill=INK, font=font(13),
                           anchor="lm")
        words = f"{title} [{unit}]" if unit else title
        size = 14
        while size > 9 and font(size).getlength(words) > tall:
            size -= 1
        strip = Image.new("RGB", (int(font(size).getlength(words)) + 4, 20), (255, 255, 255))
        ImageDraw.Draw(strip).text((2, 1), words, fill=INK, font=font(size))
        strip = strip.rotate(90, expand=True)
        self.image.paste(strip, (self.image.width - 24, int(top + (tall - strip.height) / 2)))

    def scale_bar(self, camera: Camera, perspective: bool) -> None:
        """At the lower right; with perspective, lengths are those at the middle of what is seen."""
        length = nice(0.2 * self.columns / camera.scale)
        factor, unit = prefixed(length, "m")
        wide = length * camera.scale
        y, right = TITLE + self.rows - 16, self.columns - 16
        words = f"{length * factor:.4g} {unit}" + (" at the middle" if perspective else "")
        widest = max(wide, font(13).getlength(words))
        self.draw.rectangle((right - widest - 6, y - 24, right + 6, y + 8), fill=PAPER)
        self.draw.rectangle((right - wide, y - 2, right, y + 2), fill=INK)
        self.draw.text((right, y - 5), words, fill=INK, font=font(13), anchor="rb")

    def axes(self, camera: Camera) -> None:
        """Three arrows at the lower left; the nearest is drawn last."""
        centre, length = np.array((46.0, TITLE + self.rows - 46)), 30
        self.draw.ellipse((*(centre - 44), *(centre + 44)), fill=PAPER)
        for axis in np.argsort(camera.basis[2]):
            way = camera.basis[:2, axis] * (1, -1)
            tip = centre + length * way
            self.draw.line((*centre, *tip), fill=AXIS_COLOURS[axis], width=3)
            far = centre + (length + 10) * way if np.hypot(*way) > 0.2 else tip + (9, -6)
            self.draw.text(tuple(far), "xyz"[axis], fill=AXIS_COLOURS[axis], font=font(14), anchor="mm")

    def widths(self, top: float, mean: float, widest: float, unit: str, title: str) -> None:
        """What the widths and colours of lines of force mean, at the upper left; `widest`: the width for `top` [pixels]."""
        factor, unit = prefixed(top, unit)
        entries = [(top, f"{top * factor:.3g} {unit} and more"), (mean, f"{mean * factor:.3g} {unit}, the mean"),
                   (mean / 2, f"{mean / 2 * factor:.3g} {unit}: below the mean, grey")]
        y = TITLE + 12
        self.draw.text((10, y), title, fill=INK, font=font(12))
        for force, words in entries:
            y += 20
            wide = max(1, round(widest * min(force / top, 1) if top > 0 else 1))
            colour = tuple(int(255 * c) for c in (WEAK if force < mean else STRONG))
            self.draw.line((12, y + 7, 52, y + 7), fill=colour, width=wide)
            self.draw.text((60, y), words, fill=INK, font=font(12))
            y += max(0, wide - 14)


def beside(images: list[Image.Image]) -> Image.Image:
    """Pictures in a row."""
    row = Image.new("RGB", (sum(image.width for image in images), max(image.height for image in images)), (255, 255, 255))
    left = 0
    for image in images:
        row.paste(image, (left, 0))
        left += image.width
    return row


def box_lines(picture: np.ndarray, camera: Camera, depth: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Draws the edges of a box (lower and upper corner) behind what is seen: all but those at the nearest corner."""
    corners = np.array([[box[i, 0], box[j, 1], box[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    edges = [(a, b) for a in range(8) for b in range(a + 1, 8) if (a ^ b) in (1, 2, 4)]
    nearest = camera.project(corners)[1].argmax()
    for a, b in edges:
        if nearest in (a, b):
            continue
        line = corners[a] + np.linspace(0, 1, 4 * max(picture.shape))[:, None] * (corners[b] - corners[a])
        place, towards, _ = camera.project(line)
        column, row = np.floor(place).astype(int).T
        inside = (column >= 0) & (column < picture.shape[1]) & (row >= 0) & (row < picture.shape[0])
        column, row, towards = column[inside], row[inside], towards[inside]
        free = depth[row, column] < towards
        picture[row[free], column[free]] = 0.75
    return picture
