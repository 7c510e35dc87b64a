"""Measures what docs/python.md states, where the package is installed: measure.py PROGRAM [ROUNDS]

All in CPU time, which other programs on the machine disturb little. PROGRAM is the program `domelight` of the same profile.
"""

import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable

import domelight as dl

IMPORT = "import numpy, numpy.typing, domelight"
RENDER = """
import domelight as dl, sys
film = dl.render(dl.Scene.builtin("statue"), dl.Environment.builtin("sky"), spp=32, size=(640, 640))
film.save(sys.argv[1])
"""


def of_child(command: list[str]) -> float:
    """CPU seconds of a process."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def of_call(function: Callable[[], dl.Film]) -> tuple[float, int]:
    """CPU seconds of this process, and the shadow rays of the film."""
    start = time.process_time()
    film = function()
    return time.process_time() - start, film.shadow_rays


def spread(values: list[float], digits: int = 2) -> str:
    return f"{statistics.median(values):.{digits}f} ({min(values):.{digits}f} to {max(values):.{digits}f})"


def measure_import(rounds: int) -> None:
    python = lambda code: of_child([sys.executable, "-c", code])
    beyond = [1000 * (python(IMPORT) - python("import numpy, numpy.typing")) for _ in range(rounds)]
    print(f"import beyond NumPy's: {spread(beyond, 0)} ms")


def measure_render(program: str, rounds: int) -> None:
    ratios, seconds = [], []
    with tempfile.TemporaryDirectory() as folder:
        picture = f"{folder}/a.pfm"
        for _ in range(rounds):
            own = of_child([sys.executable, "-c", RENDER, picture]) - of_child([sys.executable, "-c", IMPORT])
            theirs = of_child([program, "--quiet", "render", "--size", "640x640", "--spp", "32", "-o", picture])
            ratios.append(own / theirs)
            seconds.append(own)
    print(f"default scene, 640 x 640, 32 samples: {spread(seconds)} s, {spread(ratios, 3)} of the program's")


def measure_strategy(rounds: int) -> None:
    scene, env = dl.Scene.builtin("sphere"), dl.Environment.builtin("studio", rows=64)
    settings = dict(spp=16, size=(256, 256), hide_env=True)
    strategies = {"built in": "environment", "Python": dl.strategies.Environment(env)}
    rates: dict[str, list[float]] = {name: [] for name in strategies}
    for _ in range(rounds):
        for name, strategy in strategies.items():
            seconds, rays = of_call(lambda: dl.render(scene, env, strategy, tile_size=64, **settings))
            rates[name].append(rays / seconds * 1e-6)
    ratios = [own / theirs for own, theirs in zip(rates["Python"], rates["built in"])]
    for name, values in rates.items():
        print(f"environment, {name}: {spread(values)} million shadow rays a CPU second")
    print(f"Python's share: {spread(ratios)}")


def main() -> None:
    program, rounds = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 7
    measure_import(rounds)
    measure_strategy(rounds)
    measure_render(program, rounds)


if __name__ == "__main__":
    main()
