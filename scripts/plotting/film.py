"""A film of a run: bodies, and beside them the principal stress difference (2D), or bodies in space."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from PIL import Image

import colours
from canvas import Sheet, beside
from figures import grain_picture, label, value_picture
from results import Frame, MissingData, Run
from scalars import SCALARS, scalar, scale
from space import Scene

PIXELS = 480  # of each of two pictures of the domain; a single one has half as many again
FRAMES_PER_SECOND = 12
BAR = 30  # width of the progress bar, in letters


def film(run: Run, other: Run | None, folder: Path, summary: dict) -> list[str]:
    """Writes film.mp4 where ffmpeg is installed, else film.gif."""
    if len(run.frames) < 2:
        raise MissingData("a film needs two or more particles_*.vtkhdf files")
    if any(frame.points == 0 for frame in run.frames):
        raise MissingData("a particles_*.vtkhdf file holds no points")
    pictures = progress(drawn(_drawer(run), run.frames), len(run.frames))
    ffmpeg = shutil.which("ffmpeg")
    return [_mp4(ffmpeg, pictures, folder / "film.mp4") if ffmpeg else _gif(pictures, folder / "film.gif")]


def _drawer(run: Run) -> Callable[[Frame], Image.Image]:
    """What draws a frame; all frames have one camera, and one scale."""
    if run.dimension == 3:
        scene = Scene(run, run.look, run.frames)
        return lambda frame: scene.sheet(frame, f"{run.title}   {label(run, frame)}").image
    colour, panels = colours.of_run(run), []
    if run.look.colour != "body":
        panels = [scalar(run, run.frames[0], run.look.colour)]
        pixels = PIXELS * 3 // 2
    elif all(run.has_stress(frame) for frame in run.frames):
        panels, pixels = [None, SCALARS["difference"]], PIXELS
    else:
        panels, pixels = [None], PIXELS * 3 // 2
    scales = [shown and scale(run, run.frames, shown, run.look.range) for shown in panels]
    scales = [ends and (*ends[:2], "stress" if shown is SCALARS["difference"] else ends[2])
              for ends, shown in zip(scales, panels)]

    sizes = [run.at(frame).upper - run.lower for frame in run.frames]
    largest = np.max(sizes, axis=0)

    def draw(frame: Frame) -> Image.Image:
        row = []
        for shown, ends in zip(panels, scales):
            picture = (value_picture(run, frame, shown, ends, pixels) if shown
                       else grain_picture(run, frame, pixels, colour))
            picture = _in_domain(picture, run.at(frame).upper - run.lower, largest)
            title = shown.title if shown and row else f"{run.title}   {label(run, frame)}"
            sheet = Sheet(picture[::-1] / 255.0, title, run.failed, scale=shown is not None)
            if shown:
                sheet.colour_scale(*ends, shown.title, shown.unit)
            row.append(sheet.image)
        return beside(row)

    return draw


def _in_domain(picture: np.ndarray, size: np.ndarray, largest: np.ndarray) -> np.ndarray:
    """A picture of a domain (rows upwards) of a size, on white, on the scale of the largest of a film."""
    if np.array_equal(size, largest):
        return picture
    longer = max(picture.shape[:2])
    full = np.full((*np.rint(largest[::-1] / largest.max() * longer).astype(int), 3), 255, picture.dtype)
    there = np.maximum(np.rint(size / largest.max() * longer).astype(int), 1)
    scaled = np.asarray(Image.fromarray(picture).resize((int(there[0]), int(there[1]))))
    full[: scaled.shape[0], : scaled.shape[1]] = scaled[: full.shape[0], : full.shape[1]]
    return full


_draw: Callable[[Frame], Image.Image]  # of the worker processes, which are forks


def _picture(frame: Frame) -> np.ndarray:
    """A frame as an array (rows x columns x 3) with even sides, which films want."""
    picture = np.asarray(_draw(frame))
    return np.ascontiguousarray(picture[: picture.shape[0] // 2 * 2, : picture.shape[1] // 2 * 2])


def drawn(draw: Callable[[Frame], Image.Image], frames: list[Frame]) -> Iterator[np.ndarray]:
    """The pictures in order, drawn on all cores."""
    global _draw
    _draw = draw
    with ProcessPoolExecutor(len(os.sched_getaffinity(0)), get_context("fork")) as pool:
        yield from pool.map(_picture, frames)


def progress(items: Iterable, count: int) -> Iterator:
    """Shows on a terminal how many of the items are there."""
    shown = sys.stderr.isatty()
    for k, item in enumerate(items, 1):
        yield item
        if shown:
            done = BAR * k // count
            print(f"\r  film [{'#' * done}{'.' * (BAR - done)}] {k}/{count}", end="\n" if k == count else "",
                  file=sys.stderr, flush=True)


def _mp4(ffmpeg: str, pictures: Iterator[np.ndarray], path: Path) -> str:
    first = next(pictures)
    height, width, _ = first.shape
    command = [ffmpeg, "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}",
               "-r", str(FRAMES_PER_SECOND), "-i", "-", "-pix_fmt", "yuv420p", str(path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE) as process:
        process.stdin.write(first.tobytes())
        for picture in pictures:
            process.stdin.write(picture.tobytes())
        process.stdin.close()
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, command)
    return path.name


def _gif(pictures: Iterator[np.ndarray], path: Path) -> str:
    images = [Image.fromarray(picture).quantize(128) for picture in pictures]
    duration = 1000 // FRAMES_PER_SECOND  # [ms]
    images[0].save(path, save_all=True, append_images=images[1:], duration=duration, loop=0)
    return path.name
