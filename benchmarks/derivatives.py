"""What exact derivatives of a run cost beside the run: a step of the kneed walker; seven links that fall."""

from __future__ import annotations

from functools import partial
from typing import Any

import mbd
from benchmarks.figures import Figure, interleaved
from benchmarks.stopwatch import processor_seconds
from benchmarks.walkers import kneed_walker, seven

SCHEMES: dict[str, tuple[mbd.HHT | mbd.RungeKutta853 | mbd.RadauIIA, dict[str, float]]] = {
    "HHT, dt = 2 ms": (mbd.HHT(alpha=0.05), {"dt": 2e-3}),
    "HHT, index 3, dt = 2 ms": (mbd.HHT(alpha=0.05, formulation="index3"), {"dt": 2e-3}),
    "RungeKutta853, dt = 10 ms": (mbd.RungeKutta853(), {"dt": 1e-2}),
    "RadauIIA, dt = 10 ms": (mbd.RadauIIA(), {"dt": 1e-2}),
}
DIRECTIONS = 20
PARTS = [(side, part) for side in ("left", "right") for part in ("thigh", "shank", "foot")]
"""Of the walker of seven links; its trunk follows from the legs where a foot is held."""


def directions() -> list[str]:
    """Coordinates and rates of the start, and sizes of the legs."""
    sides = [(side, part) for side in ("left", "right") for part in ("thigh", "shank")]
    sizes = [f"{side} {part}.{size}" for side, part in sides for size in ("mass", "length", "center")]
    start = [f"{side} hip.angle{rate}" for rate in ("", ".rate") for side in ("left", "right")]
    return [*start, *sizes, "hip.mass", "gravity.x", "gravity.y", "trunk.x"][:DIRECTIONS]


def measure(repeats: int) -> list[Figure]:
    """A run that carries derivatives by 20 directions over the run alone; aim 2.5. Central differences take 40 runs."""
    figures = list[Figure]()
    model, start = kneed_walker()
    falling, upright = seven()
    for title, (scheme, step) in SCHEMES.items():
        run = partial(mbd.simulate, model, start, scheme, until="right foot", **step)  # type: ignore[arg-type]
        figures += _measured(f"a walker step, {title}", run, directions(), repeats)
        legs = [name for name in (*upright.names, *upright.velocity_names) if not name.startswith("root")]
        names = [*legs, "gravity.y", "trunk.mass", *(f"{side} {part}.mass" for side, part in PARTS)][:DIRECTIONS]
        for until in (0.4, 2.5 if isinstance(scheme, mbd.RadauIIA) else 8.0):  # dt is too long for RadauIIA at 2.6 s
            run = partial(mbd.simulate, falling, upright, scheme, until=until, **step)  # type: ignore[arg-type]
            figures += _measured(f"7 links for {until:g} s, {title}", run, names, repeats)
    return figures


def _measured(title: str, run: Any, names: list[str], repeats: int) -> list[Figure]:
    """A run with its derivatives by one direction, and by all."""

    def differentiated(count: int) -> None:
        run(wrt=names[:count])

    samples = interleaved(
        {
            "run": partial(processor_seconds, run),
            "one": partial(processor_seconds, differentiated, 1),
            "all": partial(processor_seconds, differentiated, DIRECTIONS),
        },
        5 * repeats,
    )
    alone = samples["run"].least
    return [
        Figure(
            f"{title}: with derivatives by {count}", samples[key].least * 1e3, "ms", None, "the run alone", alone * 1e3,
            aim, samples[key].spread,
        )
        for count, key, aim in ((1, "one", None), (DIRECTIONS, "all", 2.5))
    ]  # fmt: skip
