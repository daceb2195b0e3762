"""Colours: of bodies, so that neighbours differ, and of values, along maps that are even to the eye."""

from __future__ import annotations

from collections.abc import Callable

import matplotlib
import numpy as np

from lattice import SPACING_TO_CELL, Lattice
from results import Run

# Light enough for dark lines, and apart from each other for colour-blind eyes, too: P. Tol's and Okabe and Ito's.
PALETTE = np.array([(86, 160, 211), (230, 159, 0), (0, 158, 115), (204, 121, 167), (240, 228, 110), (213, 94, 60),
                    (153, 221, 255), (170, 170, 70), (136, 100, 170), (187, 204, 51), (255, 170, 153), (68, 187, 153)],
                   float) / 255  # fmt: skip
DRIVEN = np.array((150, 150, 150), float) / 255
SAMPLE = 60000  # points of a frame that are enough to see which bodies are neighbours


def body_colours(bodies: np.ndarray, pairs: np.ndarray, driven: np.ndarray) -> np.ndarray:
    """Colour (N x 3, 0 to 1) of each body: bodies in a pair differ, as far as the palette goes; driven ones are grey.

    Greedy, those with most neighbours first: the palette lasts where a body has eleven coloured neighbours at most.
    """
    index = {int(body): i for i, body in enumerate(bodies)}
    beside = [[] for _ in bodies]
    for a, b in pairs:
        if int(a) in index and int(b) in index:
            beside[index[int(a)]].append(index[int(b)])
            beside[index[int(b)]].append(index[int(a)])
    chosen = np.full(len(bodies), -1)
    used = np.zeros(len(PALETTE))
    for i in sorted(range(len(bodies)), key=lambda k: (-len(beside[k]), k)):
        taken = np.bincount(chosen[beside[i]][chosen[beside[i]] >= 0], minlength=len(PALETTE)) if beside[i] else 0 * used
        order = np.lexsort((used, taken))  # the least taken by neighbours, then the rarest
        chosen[i] = order[0]
        used[order[0]] += 1
    colours = PALETTE[chosen] if len(bodies) else np.zeros((0, 3))
    colours[np.isin(bodies, driven)] = DRIVEN
    return colours


def of_run(run: Run) -> Callable[[np.ndarray], np.ndarray]:
    """Gives the colour (N x 3) of bodies by number, the same in every picture of the run. Those that are neighbours at
    the start, at the end or at either third between them differ."""
    pairs, bodies = [np.zeros((0, 2), int)], [np.zeros(0, int)]
    for k in sorted({0, len(run.frames) // 3, 2 * len(run.frames) // 3, len(run.frames) - 1}):
        frame = run.frames[k]
        if not frame.points or not frame.has("body"):
            continue
        step = -(-frame.points // SAMPLE)
        body = frame.field("body")[::step]
        size = SPACING_TO_CELL * run.point_spacing * step ** (1 / run.dimension)
        near = Lattice(frame.field("position")[::step, : run.dimension], body, size, run.lower, run.upper, run.periodic)
        pairs.append(near.neighbours())
        bodies.append(near.bodies)
    bodies = np.unique(np.concatenate(bodies))
    table = body_colours(bodies, np.unique(np.concatenate(pairs), axis=0), run.driven_bodies)

    def colour(body: np.ndarray) -> np.ndarray:
        if not len(bodies):
            return np.broadcast_to(PALETTE[0], (len(body), 3))
        at = np.minimum(np.searchsorted(bodies, body), len(bodies) - 1)
        return np.where((bodies[at] == body)[:, None], table[at], PALETTE[np.asarray(body) % len(PALETTE)])

    return colour


def _from_oklab(lab: np.ndarray) -> np.ndarray:
    """sRGB (0 to 1) of colours in B. Ottosson's Oklab, in which equal steps look equal."""
    mix = np.array([[1, 0.3963377774, 0.2158037573], [1, -0.1055613458, -0.0638541728], [1, -0.0894841775, -1.2914855480]])
    back = np.array([[4.0767416621, -3.3077115913, 0.2309699292], [-1.2684380046, 2.6097574011, -0.3413193965],
                     [-0.0041960863, -0.7034186147, 1.7076147010]])
    linear = np.clip((lab @ mix.T) ** 3 @ back.T, 0, 1)
    return np.where(linear > 0.0031308, 1.055 * linear ** (1 / 2.4) - 0.055, 12.92 * linear)


def _diverging() -> np.ndarray:
    """Blue to near white to red-brown, in equal steps of lightness (256 x 3)."""
    blue, white, red = np.array((0.38, -0.04, -0.15)), np.array((0.97, 0.0, 0.0)), np.array((0.38, 0.12, 0.075))
    share = np.linspace(0, 1, 128)[:, None]
    return _from_oklab(np.concatenate([blue + share * (white - blue), white + share * (red - white)]))


MAPS = {"sequential": matplotlib.colormaps["viridis"](np.linspace(0, 1, 256))[:, :3], "diverging": _diverging(),
        "stress": matplotlib.colormaps["magma"](np.linspace(0, 1, 256))[:, :3]}


def mapped(values: np.ndarray, low: float, high: float, name: str) -> np.ndarray:
    """Colours (... x 3, 0 to 1) of values."""
    span = high - low if high > low else 1.0
    index = np.clip((np.asarray(values) - low) / span * 255, 0, 255)
    return MAPS[name][np.nan_to_num(index).astype(np.uint8)]
