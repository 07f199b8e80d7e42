"""How cost grows with the number of bodies: a step, a first call and a second one, from two bodies on.

Every figure is divided by that of two bodies measured in the same run, so that days and machines compare.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import log
from pathlib import Path

import mbd
from benchmarks.stopwatch import kernel_watched, processor_seconds
from mbd.compile.background import finish
from mbd.integrators import Integrator

__all__ = ["LARGEST", "SCENES", "Growth", "chain", "measure", "page", "sliders", "slope", "write"]

LARGEST = 128
"""Bodies at most, unless others are asked for [-]."""
DT, REPEATS = 1e-3, 5
"""Step [s], and repeats of each measurement, whose least counts."""
FEWEST, MOST, ENOUGH = 50, 6400, 0.02
"""Steps of a run at least and at most, and the time in the kernel [s] from which it is long enough."""


def chain(bodies: int) -> tuple[mbd.Model, mbd.State]:
    """A hanging chain of rods on hinges, which swings."""
    model, end = mbd.Model(f"chain of {bodies}"), None
    for k in range(bodies):
        rod = mbd.Link(f"rod {k}", length=1.0, **mbd.rod(mass=1.0, length=1.0).link)
        model.connect(mbd.Revolute(f"hinge {k}", model.ground.origin if end is None else end, rod.start))
        end = rod.end
    return model, mbd.assemble(model, position={"hinge 0.angle": -1.3}, velocity={"hinge 0.angle": 0.2})


def sliders(bodies: int) -> tuple[mbd.Model, mbd.State]:
    """Points that slide on the ground beside each other, with friction."""
    model, names = mbd.Model(f"{bodies} sliders"), range(bodies)
    for k in names:
        point = mbd.PointMass(f"point {k}", 1.0)
        model.connect(mbd.Translation(f"place {k}", model.ground.origin, point.origin))
        model.constrain(mbd.Unilateral(f"contact {k}", mbd.touchdown(point.origin), friction=1e-3))
    start = mbd.assemble(
        model, closed=[f"contact {k}" for k in names], position={f"place {k}.x": float(k) for k in names},
        velocity={f"place {k}.x": 1.0 for k in names},
    )  # fmt: skip
    return model, start


SCENES: dict[str, tuple[Callable[[int], tuple[mbd.Model, mbd.State]], Integrator]] = {
    "chain, implicit (HHT)": (chain, mbd.HHT(alpha=0.05)),
    "chain, explicit (RungeKutta853)": (chain, mbd.RungeKutta853()),
    "sliding contacts, HHT": (sliders, mbd.HHT(alpha=0.05)),
}
"""Mechanisms by number of bodies, with the scheme that they are stepped by."""


@dataclass(frozen=True)
class Growth:
    """Of a scene with some bodies: seconds of a step, of the first call with its derivation, and of the next."""

    scene: str
    bodies: int
    step: float
    first: float
    second: float


def measure(largest: int = LARGEST) -> list[Growth]:
    """All scenes from two bodies on, doubled up to the largest."""
    found = []
    for name, (make, scheme) in SCENES.items():
        bodies = 2
        while bodies <= largest:
            found.append(_grown(name, make, scheme, bodies))
            bodies *= 2
    return found


def _grown(
    name: str, make: Callable[[int], tuple[mbd.Model, mbd.State]], scheme: Integrator, bodies: int
) -> Growth:  # fmt: skip
    made: list[tuple[mbd.Model, mbd.State]] = []

    def run(steps: int) -> None:
        mbd.simulate(
            *made[-1], scheme, dt=DT, until=steps * DT, contact="events", progress=False, store=steps,
            on_failure="return",
        )  # fmt: skip

    def first() -> None:
        made.append(make(bodies))
        run(1)

    def in_kernel(steps: int) -> float:
        with kernel_watched() as watch:
            run(steps)
        return watch.seconds

    begun = processor_seconds(first)
    finish()  # faster code, which is made beside the run
    again = min(processor_seconds(partial(run, 1)) for _ in range(REPEATS))
    steps = FEWEST
    while in_kernel(steps) < ENOUGH and steps < MOST:
        steps *= 2
    step = min(in_kernel(steps) for _ in range(REPEATS)) / steps
    return Growth(name, bodies, step, begun, again)


def slope(grown: list[Growth]) -> float:
    """Power of the number of bodies that a step grows with, over the last factor of four."""
    one, other = grown[-3 if len(grown) > 2 else 0], grown[-1]
    return log(other.step / one.step) / log(other.bodies / one.bodies)


def page(found: list[Growth]) -> str:
    """The page of the documentation."""
    lines = [
        "# How cost grows",
        "",
        "This page shows how the cost of a step, of the first call and of the next call grows with the number of",
        "bodies. Times are processor times, the best of five runs; steps are timed inside the kernel. The first call",
        "derives and compiles the model unless the cache has its code. The next call makes one step.",
        "",
        "*Step, times two bodies* is the time of a step over that of two bodies, which should be similar on other",
        "machines. *Power at the end* is the exponent with which a step grows over the last factor of four.",
        "",
        "![Time of a step over the number of bodies](pictures/growth.png)",
        "",
        "`python -m benchmarks growth` writes this page. Steps of trees go from body to body and grow linearly:",
        "explicit ones, and implicit ones from trees of 24 coordinates on where no row and no force on a body acts;",
        "elsewhere a matrix is factored. Contacts that share no body are solved separately, and large sparse matrices",
        "are eliminated in a fixed order.",
        "",
    ]
    for name in SCENES:
        grown = [each for each in found if each.scene == name]
        if not grown:
            continue
        lines += [
            f"## {name[0].upper()}{name[1:]}",
            "",
            f"Power at the end: {slope(grown):.1f}.",
            "",
            "| bodies | step [µs] | a body [µs] | step, times two bodies | first call [s] | next call [ms] |",
            "|---|---|---|---|---|---|",
        ]
        lines += [
            f"| {g.bodies} | {g.step * 1e6:.3g} | {g.step / g.bodies * 1e6:.3g} | "
            f"{g.step / grown[0].step:.3g} | {g.first:.2g} | {g.second * 1e3:.2g} |"
            for g in grown
        ]
        lines.append("")
    return "\n".join(lines)


def write(found: list[Growth], docs: Path) -> None:
    """The page and its picture into the documentation."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, ax = plt.subplots(figsize=(6.4, 4.2))
    for name in SCENES:
        grown = [each for each in found if each.scene == name]
        ax.loglog([g.bodies for g in grown], [g.step * 1e6 for g in grown], "o-", ms=4, label=name)
    ax.set_xlabel("bodies")
    ax.set_ylabel("step [µs]")
    ax.set_xscale("log", base=2)
    ax.grid(alpha=0.3)
    ax.legend(frameon=False, fontsize=8)
    figure.tight_layout()
    figure.savefig(docs / "pictures" / "growth.png", dpi=90, metadata={"Software": None})
    plt.close(figure)
    (docs / "growth.md").write_text(page(found), encoding="utf-8")
