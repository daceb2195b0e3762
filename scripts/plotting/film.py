"""A film of a run: bodies, and beside them the principal stress difference (2D)."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

import raster
from figures import grain_picture, label, owners
from results import MissingData, Run, principal_stress_difference

PIXELS = 480
FRAMES_PER_SECOND = 12
CAPTION = 20  # height of the line of text [pixels]


def film(run: Run, other: Run | None, folder: Path, summary: dict) -> list[str]:
    """Writes film.mp4 where ffmpeg is installed, else film.gif."""
    if len(run.frames) < 2:
        raise MissingData("a film needs two or more particles_*.vtkhdf files")
    if any(frame.points == 0 for frame in run.frames):
        raise MissingData("a particles_*.vtkhdf file holds no points")
    pictures = list(_pictures(run))
    ffmpeg = shutil.which("ffmpeg")
    if ffmpeg:
        height, width, _ = pictures[0].shape
        command = [ffmpeg, "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}",
                   "-r", str(FRAMES_PER_SECOND), "-i", "-", "-pix_fmt", "yuv420p", str(folder / "film.mp4")]
        subprocess.run(command, input=b"".join(picture.tobytes() for picture in pictures), check=True)
        return ["film.mp4"]
    images = [Image.fromarray(picture).quantize(128) for picture in pictures]
    duration = 1000 // FRAMES_PER_SECOND  # [ms]
    images[0].save(folder / "film.gif", save_all=True, append_images=images[1:], duration=duration, loop=0)
    return ["film.gif"]


def _pictures(run: Run):
    """Each frame as an array (rows from the top x columns x 3) with even sides."""
    stressed = run.dimension == 2 and all(frame.has(run.stress_name(frame)) for frame in run.frames)
    top = _stress_scale(run) if stressed else 0
    for frame in run.frames:
        panels = [grain_picture(run, frame, PIXELS)[0]]
        if stressed:
            value = principal_stress_difference(run.stress(frame))
            grey = (255 * raster.paint_values(owners(run, frame, PIXELS), value, top)).astype(np.uint8)
            panels.append(np.repeat(grey[..., None], 3, axis=2))
        picture = np.concatenate(panels, axis=1)[::-1]
        rows, columns = picture.shape[0] // 2 * 2, picture.shape[1] // 2 * 2
        canvas = Image.new("RGB", (columns, rows + CAPTION))
        canvas.paste(Image.fromarray(np.ascontiguousarray(picture[:rows, :columns])), (0, CAPTION))
        ImageDraw.Draw(canvas).text((6, 4), f"{run.title}   {label(run, frame)}", fill=(255, 255, 255))
        yield np.asarray(canvas)


def _stress_scale(run: Run) -> float:
    """One scale for the whole film [Pa]: the largest 99th percentile of any frame."""
    return max(float(np.percentile(principal_stress_difference(run.stress(frame)), 99)) for frame in run.frames)
