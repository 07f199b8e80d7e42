"""Blocks on two corners: rocking to rest (g3), landing flat (j9)."""

import math
from functools import cache, partial
from itertools import pairwise
from typing import Any

import numpy as np

import mbd
from mbd.dataclass import dataclass
from mbd.equal import ROUND_OFF_RTOL
from mbd.hardcases.case import Curve, Figure, Outcome, hard_case
from mbd.hardcases.convergence import study
from mbd.hardcases.impacts import deepest, difference, impact_figures
from mbd.hardcases.references import accuracy, numbers, published, size
from mbd.hardcases.stepped import HOW, stepped_figures, within_steps

ANGLE_OFFSET = 1e-6
"""How far beside the angle of toppling a block is let go, relative [-]."""


@dataclass(frozen=True)
class Block:
    """A rectangle with its mass center `offset` to the right of its middle; corners 'left' and 'right'.

    friction : None sticks, 0 slides
    """

    half_width: float
    half_height: float
    m: float
    inertia: float
    g: float
    e: float
    friction: float | None
    offset: float = 0.0

    def tilted(self, angle: float, rate: float = 0.0, turned: bool = False) -> Any:
        """Turning on one corner, which lies at x = 0."""
        side = -1.0 if angle > 0.0 else 1.0
        x, y = side * self.half_width, -self.half_height
        place = {
            "place.x": -(x * math.cos(angle) - y * math.sin(angle)),
            "place.y": -(x * math.sin(angle) + y * math.cos(angle)),
            "place.angle": angle,
        }
        corner = "left" if side < 0.0 else "right"
        return mbd.assemble(model_of(self, turned), position=place, velocity={"place.angle": rate}, closed=[corner])


@cache
def model_of(block: Block, turned: bool = False) -> mbd.Model:
    """'place' is that of the mass center; `turned` names the corners the other way round."""
    model = mbd.Model("block", gravity=(0.0, -block.g, 0.0))
    body = mbd.RigidBody("block", mass=block.m, inertia=block.inertia)
    model.connect(mbd.Planar("place", model.ground.origin, body.origin))
    corners = [
        mbd.Unilateral(
            name,
            mbd.touchdown(body.point(side * block.half_width - block.offset, -block.half_height)),
            restitution=block.e,
            friction=block.friction,
        )
        for name, side in (("left", -1.0), ("right", 1.0))
    ]
    model.constrain(*(corners[::-1] if turned else corners))
    return model


ROCKING_LIMITS = {
    "error of the first impact time [s]": 2e-5, "error of the speed before it [rad/s]": 1e-5,
    "error of the next impact times [s]": 2e-4, "error of the amplitudes [rad]": 1e-5,
}  # fmt: skip
"""The most that is off at the finest step, over the first impact time, the speed before it, the first tilt."""


def strikes(run: Any) -> list[Any]:
    """The impacts of a run in which a corner comes down."""
    return [event for event in run.events if event.kind == "closed" and event.impulse.any()]


def rock(
    block: Block, angle: float, rate: float, scheme: Any, dt: float, until: float, turned: bool = False,
    contact: Any = "events",
) -> Any:  # fmt: skip
    """The run of a block let go on one corner."""
    start = block.tilted(angle, rate, turned)
    return mbd.simulate(model_of(block, turned), start, scheme, dt=dt, until=until, contact=contact)


def amplitudes(run: Any, instants: Any) -> Any:
    """The largest |θ| between impacts: θ̇ is sampled finely about the middle of each half cycle."""
    found = []
    for a, b in pairwise(instants):
        times = np.linspace(a, b, 2001)[1:-1]
        found.append(np.max(np.abs(run.at(times)["place.angle"])))
    return np.array(found)


def rocking_errors(id: str, run: Any) -> dict[str, Any]:
    """Errors of the half cycles of one run, by what they are of; none where there are fewer."""
    cycles = published(id, "(amplitude, impact time)")
    times = np.array([event.time for event in strikes(run)])[: len(cycles) + 1]
    rates = run["place.angle.rate"]
    first = strikes(run)[0].row
    if len(times) != len(cycles) + 1:
        return {}
    errors = (
        times[0] - published(id, "first impact time"), abs(rates[first - 1]) - published(id, "speed before"),
        times[1:] - cycles[:, 1], amplitudes(run, times) - cycles[:, 0],
    )  # fmt: skip
    return dict(zip(ROCKING_LIMITS, errors, strict=True))


def rocking(id: str, scheme: Any) -> Outcome:
    """Housner's ratio at every impact, half cycles to second order, rest flat on both corners."""
    given = numbers(id)
    b, h, m, g = (float(given[name]) for name in ("half_width", "half_height", "m", "g"))
    block = Block(b, h, m, m * (b * b + h * h) / 3.0, g, 0.0, None)
    angle, rate = float(given["theta0"]), float(given["thetadot0"])
    first, end = published(id, "first impact time"), published(id, "(amplitude, impact time)")[-1, 1]
    # amplitudes with HHT have a third-order error too: halving from first / 100.3, orders are 1.85, 1.93, 1.97, 1.98
    found = study(
        lambda dt: rock(block, angle, rate, scheme, dt, 1.02 * end),
        partial(rocking_errors, id),
        first / 150.3,
        scheme,
        2,
    )
    steps, runs = found.steps, found.runs
    ratio = published(id, "Housner velocity ratio")
    rates = runs[-1]["place.angle.rate"]
    ratios = np.array([rates[event.row] / rates[event.row - 1] for event in strikes(runs[-1])])
    by_unit = {"[s]": first, "[rad/s]": published(id, "speed before"), "[rad]": abs(angle)}
    sizes = {what: by_unit[what[what.index("[") :]] for what in ROCKING_LIMITS}
    figures = [
        Figure("error of Housner's velocity ratio at every impact [-]", size(ratios - ratio), 1e-11),
        *found.figures(
            {what: limit * sizes[what] for what, limit in ROCKING_LIMITS.items()},
            {what: 1e-9 * each for what, each in sizes.items()},
        ),
    ]
    # a half cycle takes nearly the share `ratio` of the one before; after these many the rest speed is reached
    count = math.ceil(math.log(by_unit["[rad/s]"] / 1e-6) / -math.log(ratio))
    rest = end + (end - first) * ratio**6 / (1.0 - ratio)
    long, other = (rock(block, angle, rate, scheme, steps[0], rest, turned) for turned in (False, True))
    figures += rest_figures(long, block, count)
    figures.append(
        Figure("change with the order of the corners, relative [-]", _apart(runs[0], block, angle, rate, scheme), 1e-10)
    )
    figures.append(Figure("change of the place of rest with that order [m]",
                          abs(long["place.x"][-1] - other["place.x"][-1]), 1e-10))  # fmt: skip
    figures.append(_threshold(block, published(id, "toppling threshold"), scheme, steps[0]))
    figures += impact_figures(model_of(block), long)
    figures += stepped_rocking(block, angle, rate, scheme, steps, (first, rest, ratio))
    return Outcome(
        figures,
        [
            Curve("tilt", long.time, long["place.angle"], y_label="angle [rad]"),
            found.curve("error of the next impact times [s]"),
        ],
    )


def stepped_rocking(block: Block, angle: float, rate: float, scheme: Any, steps: Any, expected: Any) -> list[Figure]:
    """In non-smooth steps: the first impact within one of them, Housner's ratio and rest to first order.

    Lifting a corner by up to 2 b ω dt gives up to m g b ω dt; an impact takes ½ I_c ω² (1 − r²) of the energy about a
    corner: the block goes on with rates up to 2 m g b dt / (I_c (1 − r²)).
    """
    first, rest, ratio = expected
    runs = [rock(block, angle, rate, scheme, float(dt), rest, contact="nonsmooth") for dt in steps]
    rates = [run["place.angle.rate"][strikes(run)[0].row - 1 :] for run in runs]
    ends = [np.max(np.abs(run["place.angle.rate"][run.time > 0.95 * rest])) for run in runs]
    about = block.inertia + block.m * (block.half_width**2 + block.half_height**2)
    most = 2.0 * block.m * block.g * block.half_width / (about * (1.0 - ratio**2))
    return [
        *within_steps("the first impact time [s]", steps, [strikes(run)[0].time - first for run in runs], 1.0),
        *within_steps(
            "Housner's velocity ratio [-]", steps, [each[1] / each[0] - ratio for each in rates], 5.0 / first
        ),
        *within_steps("the rate at rest [rad/s]", steps, ends, most),
        *stepped_figures(model_of(block), runs[-1]),
    ]


def _apart(run: Any, block: Block, angle: float, rate: float, scheme: Any) -> float:
    """The run with its corners named the other way round, against it."""
    other = rock(block, angle, rate, scheme, run.settings["dt"], run.time[-1], turned=True)
    return difference(run, other)


def _threshold(block: Block, threshold: float, scheme: Any, dt: float) -> Figure:
    """Let go at rest just below the angle at which it topples, the block falls back; just above, it falls over."""
    wrong = 0
    for share, falls_over in ((1.0 - ANGLE_OFFSET, False), (1.0 + ANGLE_OFFSET, True)):
        run = rock(block, share * threshold, 0.0, scheme, dt, 20.0 * dt)
        wrong += bool(run["place.angle.rate"][-1] > 0.0) is not falls_over
    return Figure(
        f"starts {ANGLE_OFFSET:g} beside the toppling threshold, relative, that fall to the wrong side [-]", wrong, 0.0
    )


def rest_figures(run: Any, block: Block, count: int) -> list[Figure]:
    """Flat, unmoved, half the weight on each corner, after a bounded number of impacts."""
    half = 0.5 * block.m * block.g
    angles, energy = run["place.angle"], run.energy
    begun = energy.kinetic[0] + energy.potential[0] - np.min(energy.potential)
    last = run.time > run.time[-1] - 0.05 * (run.time[-1] - run.time[0])
    creep = np.ptp(run["place.x"][last])
    impacts = np.diff(energy.kinetic + energy.potential)[[event.row - 1 for event in strikes(run)]]
    return [
        Figure("impacts until it rests [-]", len(strikes(run)), count + 3),
        Figure("tilt at rest [rad]", abs(angles[-1]), 1e-10),
        Figure("rates at rest [m/s, rad/s]", size(run.record.v[-1]), 1e-10),
        Figure("creep while it rests [m]", float(creep), 1e-10),
        Figure("force on a corner / (m g / 2) − 1 [-]",
               size([run[f"{name}.force"][-1] / half - 1.0 for name in ("left", "right")]), 1e-10),
        Figure("penetration [m]", deepest(run), 1e-10),
        Figure("energy gained at impacts, relative [-]", float(np.max(impacts)) / begun, ROUND_OFF_RTOL),
    ]  # fmt: skip


def landing(id: str, scheme: Any) -> Outcome:
    """Both corners come down at one instant, each takes its impulse, and nothing turns."""
    given = numbers(id)
    b, h, m, inertia = (float(given[name]) for name in ("half_width", "half_height", "m", "I"))
    e, offset = float(given["e"]), float(given["com_offset_from_centre"])
    block = Block(b, h, m, inertia, float(given.get("g", 0.0)), e, 0.0, offset)
    speed, wait = -float(given["vz"]), 1.0
    runs = []
    for turned, contact in HOW:
        model = model_of(block, turned)
        start = mbd.assemble(
            model,
            position={"place.y": block.half_height + speed * wait},
            velocity={"place.x": 0.0, "place.y": -speed, "place.angle": float(given["omega"])},
        )
        runs.append(mbd.simulate(model, start, scheme, dt=0.03 * wait, until=2.0 * wait, contact=contact))
    run, other, stepped = runs
    found = [run[f"place.{name}.rate"][-1] for name in ("x", "y", "angle")]
    wanted, impulses = published(id, "velocity after"), published(id, "corner impulses")
    by_corner = {event.name: event.impulse[0] for event in strikes(run)}
    times = [event.time for event in run.events]
    limit = accuracy(id, "velocity after") + ROUND_OFF_RTOL
    figures = [
        Figure("error of the velocity after [m/s]", size(found - wanted), limit),
        Figure("rotation created [rad/s]", abs(found[2] - given["omega"]), ROUND_OFF_RTOL),
        Figure("error of the impulses [N s]",
               size([by_corner.get(name, math.nan) for name in ("left", "right")] - impulses), accuracy(id, "corner")),
        Figure("events more or less than two [-]", abs(len(run.events) - 2), 0.0),
        Figure("time between the two impacts [s]", max(times) - min(times) if times else math.nan, 0.0),
        Figure("change with the order of the corners, relative [-]", difference(run, other), ROUND_OFF_RTOL),
        Figure("penetration [m]", deepest(run), 1e-10),
        *impact_figures(model_of(block), run),
        Figure("non-smooth steps: error of the velocity after [m/s]", size(stepped.record.v[-1] - wanted),
               accuracy(id, "velocity after") + ROUND_OFF_RTOL),
        *stepped_figures(model_of(block), stepped),
    ]  # fmt: skip
    return Outcome(
        figures,
        [
            Curve("height of the mass center", run.time, run["place.y"], y_label="height [m]"),
            Curve("tilt", run.time, run["place.angle"], y_label="angle [rad]"),
        ],
    )


CASES = (
    hard_case(
        "g3-rocking-block",
        "A block rocks on sticking corners as Housner found, and comes to rest flat with half its weight on each.",
        rocking,
    ),
    hard_case(
        "j9-block-lands-flat",
        "Two corners land at one instant, both push, and no rotation is created.",
        landing,
    ),
)
