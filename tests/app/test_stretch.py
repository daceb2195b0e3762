"""A rubber bar is stretched to 2.2 with CPDI and points that move with the projected velocity: its points follow it, with
the same bits on other ranks and after a restart; with the default shape they part, which shows that the test can fail,
and the run warns of it in the same words on any number of ranks.

    test_stretch.py CAIRN SCRATCH
"""

import sys
from pathlib import Path

from harness import ROOT, Program, fresh_folder

sys.path[:0] = [str(ROOT / "scripts"), str(ROOT / "scripts/plotting")]
from validation.problems.stretch import history_of  # noqa: E402

CASE = ROOT / "cases/validation/stretched_bar.toml"
DEFAULT = {"solver.shape": "gimp", "solver.motion": "centred"}


WARNING = "body 0 is in"
said = {}  # what each run wrote to stderr, by its folder


def run(cairn: Program, out: Path, ranks: int = 1, restart: bool = False, **changes) -> Path:
    settings = {"time.end": 1.2, "output.checkpoint": "{ every = 700 }"} | changes
    words = [word for key, value in settings.items() for word in ("--set", f"{key}={value}")]
    done = cairn("run", CASE, "--out", out, *words, *(["--restart", "latest"] if restart else []), ranks=ranks)
    if done.code != 0:
        raise RuntimeError(f"{out.name}: {done.code} {done.err}")
    said[out.name] = [line for line in done.err.splitlines() if "parts" in line]
    return out


def error(folder: Path) -> float:
    """Of the mean F11, over the stretch of the bar's middle half."""
    stretch, mean, _ = history_of(folder)
    return float(abs(mean / stretch - 1).max())


def main() -> int:
    cairn, scratch = Program(sys.argv[1]), fresh_folder(sys.argv[2])
    whole = run(cairn, scratch / "whole")
    problems = []
    if not error(whole) < 0.01:
        problems.append(f"the mean F11 is off by {error(whole):.3f}")
    if not error(run(cairn, scratch / "default", **DEFAULT)) > 0.1:
        problems.append("the default shape holds too: this test shows nothing")
    run(cairn, scratch / "default_3", 3, **DEFAULT)
    if len(said["default"]) != 1 or WARNING not in said["default"][0] or said["default_3"] != said["default"]:
        problems.append(f"torn bodies are told as {said['default']} and {said['default_3']}")
    parts = scratch / "parts"
    run(cairn, parts, 2, **{"time.steps": 800})
    run(cairn, parts, 3, restart=True)
    others = {"3 ranks": run(cairn, scratch / "three", 3), "restarted on other ranks": parts}
    last = sorted(whole.glob("particles_*.vtkhdf"))[-1]
    for name, folder in others.items():  # the run that ended early wrote one more file then
        if sorted(folder.glob("particles_*.vtkhdf"))[-1].read_bytes() != last.read_bytes():
            problems.append(f"{name}: the last particle file has other bytes")
    problems += [f"{name} is torn: {said[name]}" for name in ("whole", "three", "parts") if said[name]]
    print("\n".join(problems))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
