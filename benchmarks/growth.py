"""How cost grows with the number of bodies: a step, a start, a first call and a second one.

Every figure is divided by that of the fewest bodies measured in the same run, so that days and machines compare.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import log, pi
from pathlib import Path

import mbd
from benchmarks.stopwatch import kernel_watched, processor_seconds
from mbd.compile.background import finish
from mbd.integrators import Integrator

LARGEST = 512
"""Bodies at most, unless others are asked for; a scene may have a smaller number [-]."""
DT, REPEATS = 1e-3, 5
"""Step [s], and repeats of each measurement, whose least counts."""
FEWEST, MOST, ENOUGH = 50, 6400, 0.02
"""Steps of a run at least and at most, and the time in the kernel [s] from which it is long enough."""


Started = tuple[mbd.Model, mbd.State]


def _rod(name: str) -> mbd.Link:
    return mbd.Link(name, length=1.0, **mbd.rod(mass=1.0, length=1.0).link)


def chain(bodies: int) -> Started:
    """A hanging chain of rods on hinges, which swings."""
    model, end = mbd.Model(f"chain of {bodies}"), None
    for k in range(bodies):
        rod = _rod(f"rod {k}")
        model.connect(mbd.Revolute(f"hinge {k}", model.ground.origin if end is None else end, rod.start))
        end = rod.end
    return model, mbd.assemble(model, position={"hinge 0.angle": -1.3}, velocity={"hinge 0.angle": 0.2})


def tree(bodies: int) -> Started:
    """A tree of rods, two hanging from the end of each."""
    model, rods = mbd.Model(f"tree of {bodies}"), list[mbd.Link]()
    for k in range(bodies):
        rods.append(_rod(f"rod {k}"))
        place = rods[(k - 1) // 2].end if k else model.ground.origin
        model.connect(mbd.Revolute(f"hinge {k}", place, rods[k].start))
    position = {f"hinge {k}.angle": (0.4 if k % 2 else -0.4) if k else -1.3 for k in range(bodies)}
    return model, mbd.assemble(model, position=position, velocity={"hinge 0.angle": 0.2})


def balls(bodies: int) -> Started:
    """A hanging chain of rods on ball joints, the first of which starts to swing."""
    model, end = mbd.Model(f"{bodies} rods on ball joints"), None
    for k in range(bodies):
        rod = mbd.RigidBody(f"rod {k}", 1.0, (0.0834, 0.0834, 0.01), center=(0.0, 0.0, -0.5))
        model.connect(mbd.Spherical(f"ball {k}", model.ground.origin if end is None else end, rod.origin))
        end = rod.point(0.0, 0.0, -1.0)
    return model, mbd.assemble(model, velocity={"ball 0.angular_velocity.x": 0.3})


def four_bars(bodies: int) -> Started:
    """Parallelograms in a row on one base: cranks, and couplers between neighbours."""
    loops = max(1, (bodies - 1) // 2)
    model, cranks, angle = mbd.Model(f"{loops} four-bars"), [_rod(f"crank {k}") for k in range(loops + 1)], 1.2
    for k, crank in enumerate(cranks):
        model.connect(mbd.Revolute(f"base {k}", model.ground.point(float(k), 0.0, name=f"base {k}"), crank.start))
    for k in range(loops):
        coupler = _rod(f"coupler {k}")
        model.connect(mbd.Revolute(f"left {k}", cranks[k].end, coupler.start))
        model.connect(mbd.Revolute(f"right {k}", coupler.end, cranks[k + 1].end))
    position = {f"base {k}.angle": angle for k in range(loops + 1)}
    position |= {f"left {k}.angle": 0.5 * pi - angle for k in range(loops)}
    return model, mbd.assemble(model, position=position, velocity={"base 0.angle": 0.3})


def lattice(bodies: int) -> Started:
    """A hanging ladder of rods on hinges: two rails, and a rung at each joint of theirs."""
    cells, angle = max(1, bodies // 3), 0.3
    model, position = mbd.Model(f"ladder of {cells}"), dict[str, float]()
    left, right = (model.ground.point(x, 0.0, name=f"hook {x:g}") for x in (0.0, 1.0))
    for k in range(cells):
        one, other, rung, side = _rod(f"left {k}"), _rod(f"right {k}"), _rod(f"rung {k}"), angle - 2 * angle * (k % 2)
        model.connect(mbd.Revolute(f"left {k}", left, one.start))
        model.connect(mbd.Revolute(f"right {k}", right, other.start))
        model.connect(mbd.Revolute(f"rung {k}", one.end, rung.start))
        model.connect(mbd.Revolute(f"end {k}", rung.end, other.end))
        position |= {f"{name} {k}.angle": 2.0 * side if k else side for name in ("left", "right")}
        position[f"rung {k}.angle"] = 0.5 * pi - side
        left, right = one.end, other.end
    return model, mbd.assemble(model, position=position, velocity={"left 0.angle": 0.2})


def sliders(bodies: int) -> Started:
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


def falling(bodies: int) -> Started:
    """Points above the ground that fall beside each other."""
    model, names = mbd.Model(f"{bodies} falling points"), range(bodies)
    for k in names:
        point = mbd.PointMass(f"point {k}", 1.0)
        model.connect(mbd.Translation(f"place {k}", model.ground.origin, point.origin))
        model.constrain(mbd.Unilateral(f"contact {k}", mbd.touchdown(point.origin), friction=0.3))
    position = {f"place {k}.x": float(k) for k in names} | {f"place {k}.y": 500.0 + 0.01 * k for k in names}
    return model, mbd.assemble(model, position=position)


@dataclass(frozen=True)
class Scene:
    """A mechanism by number of bodies, about, and the scheme that it is stepped by.

    largest : bodies at most, above which a page takes minutes
    """

    make: Callable[[int], Started]
    scheme: Integrator
    largest: int


_IMPLICIT, _EXPLICIT = mbd.HHT(alpha=0.05), mbd.RungeKutta853()
SCENES = {
    "chain, implicit (HHT)": Scene(chain, _IMPLICIT, 256),
    "chain, explicit (RungeKutta853)": Scene(chain, _EXPLICIT, 256),
    "tree, implicit (HHT)": Scene(tree, _IMPLICIT, 512),
    "tree, explicit (RungeKutta853)": Scene(tree, _EXPLICIT, 512),
    "chain in space on ball joints, HHT": Scene(balls, _IMPLICIT, 64),
    "row of four-bars, HHT": Scene(four_bars, _IMPLICIT, 256),
    "ladder of loops, HHT": Scene(lattice, _IMPLICIT, 128),
    "sliding contacts, HHT": Scene(sliders, _IMPLICIT, 256),
    "falling bodies, HHT": Scene(falling, _IMPLICIT, 256),
}
"""Mechanisms that grow."""


@dataclass(frozen=True)
class Growth:
    """Of a scene with some bodies: seconds of a step, of the first call with its derivation, and of the next.

    start : seconds in the kernel before the first step
    """

    scene: str
    bodies: int
    step: float
    first: float
    second: float
    start: float


def measure(largest: int = LARGEST) -> list[Growth]:
    """All scenes from two bodies on, doubled up to the largest."""
    found = []
    for name, scene in SCENES.items():
        bodies = 2
        while bodies <= min(largest, scene.largest):
            found.append(_grown(name, scene, bodies))
            bodies *= 2
    return found


def _grown(name: str, scene: Scene, bodies: int) -> Growth:
    made: list[Started] = []

    def run(steps: int) -> None:
        mbd.simulate(
            *made[-1], scene.scheme, dt=DT, until=steps * DT, contact="events", progress=False, store=steps,
            on_failure="return",
        )  # fmt: skip

    def first() -> None:
        made.append(scene.make(bodies))
        run(1)

    def in_kernel(steps: int) -> float:
        with kernel_watched() as watch:
            run(steps)
        return watch.seconds

    begun = processor_seconds(first)
    finish()  # faster code, which is made beside the run
    again = min(processor_seconds(partial(run, 1)) for _ in range(REPEATS))
    start, steps = min(in_kernel(1) for _ in range(REPEATS)), FEWEST
    while in_kernel(steps) < ENOUGH + start and steps < MOST:
        steps *= 2
    step = (min(in_kernel(steps) for _ in range(REPEATS)) - start) / (steps - 1)
    return Growth(name, len(made[-1][0].bodies) - 1, step, begun, again, start)


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
        "bodies. Times are processor times, the best of five runs; steps are timed inside the kernel, less the",
        "start. The first call derives and compiles the model unless the cache has its code. The next call makes one",
        "step; the start is what the kernel takes of it.",
        "",
        "*Step, relative* is the time of a step over that in the first line, which should be similar on other",
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
            "| bodies | step [µs] | a body [µs] | step, relative | first call [s] | next call [ms] | start [ms] |",
            "|---|---|---|---|---|---|---|",
        ]
        lines += [
            f"| {g.bodies} | {g.step * 1e6:.3g} | {g.step / g.bodies * 1e6:.3g} | "
            f"{g.step / grown[0].step:.3g} | {g.first:.2g} | {g.second * 1e3:.2g} | {g.start * 1e3:.2g} |"
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
