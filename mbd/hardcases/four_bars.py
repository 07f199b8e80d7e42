"""N parallelograms side by side, whose flat poses have more freedoms than any other pose: b2 for N = 1, 2, 10, 40."""

import math
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

import mbd
from mbd.hardcases.case import CLOSURE_ATOL, Curve, Figure, HardCase, Outcome, definition
from mbd.hardcases.convergence import allowance, study
from mbd.hardcases.crossings import crossing
from mbd.hardcases.references import distance_to, quantity, size
from mbd.hardcases.schemes import DAMPED, EVERY, holds_positions_only

ENERGY_RTOL = 1e-3
"""Most change of energy that the definition allows [-]; a scheme of order 2 is far below it."""
ERROR_FACTOR = 0.4
"""Of the allowance of errors, with the rate at a flat pose."""


def four_bars(case: str) -> tuple[mbd.Model, mbd.State]:
    """Equal cranks upright on one base, 'base k', each next pair joined by a coupler of the same length."""
    numbers, begin = definition(case)["definition"], definition(case)["initial_conditions"]
    count, L, m = int(numbers["N"]), numbers["link_length"], numbers["link_mass"]
    rod = {"mass": m, "length": L, "center": 0.5 * L, "inertia": m * L * L / 12.0}
    model = mbd.Model(f"{count} four-bars", gravity=(0.0, -numbers["g"], 0.0))
    cranks = [mbd.Link(f"crank {k}", **rod) for k in range(count + 1)]
    for k, crank in enumerate(cranks):
        model.connect(mbd.Revolute(f"base {k}", model.ground.point(k * L, 0.0, name=f"base {k}"), crank.start))
    for k in range(count):
        coupler = mbd.Link(f"coupler {k}", **rod)
        model.connect(mbd.Revolute(f"left {k}", cranks[k].end, coupler.start))
        model.connect(mbd.Revolute(f"right {k}", coupler.end, cranks[k + 1].end))
    angle = math.pi - begin["theta0_from_upright"]
    position = {f"base {k}.angle": angle for k in range(count + 1)}
    position |= {f"left {k}.angle": 0.5 * math.pi - angle for k in range(count)}
    rate = -begin["vx_of_B0"] / (L * math.cos(begin["theta0_from_upright"]))
    return model, mbd.assemble(model, position=position, velocity={"base 0.angle": rate})


def judge_four_bars(case: str, dts: tuple[float, float], integrator: Any) -> Outcome:
    """Every flat pose is passed on the branch where cranks stay parallel, without a jump of energy, with order 2.

    dts : largest step, and that of index 3 [s]. There a step that happens to end next to a flat pose of many four-bars
    makes up to 1e-7 rad of round-off at 0.25 ms, as much as its error, and 1e-10 at 0.5 ms.
    """
    model, start = four_bars(case)
    angle, place = quantity(case, "crank angle"), quantity(case, "B0")
    passes, energy = quantity(case, "number of singular"), quantity(case, "total energy")
    first, rate, period = (quantity(case, name) for name in ("first passage", "thetadot at", "period of one"))
    turn = math.pi - definition(case)["initial_conditions"]["theta0_from_upright"]

    def turned(step: float) -> Any:
        return mbd.simulate(model, start, integrator, dt=step, until=float(angle.times[-1]), store=_stride(step),
                            on_failure="return")  # fmt: skip

    def errors(run: Any) -> Mapping[str, float]:
        at = run.at(angle.times)
        corner = np.column_stack([at["crank 0.end.x"], at["crank 0.end.y"]])
        return {
            "error of the crank angle [rad]": distance_to(turn - at["base 0.angle"], angle),
            "error of the corner [m]": distance_to(corner, place),
        }

    found = study(turned, errors, dts[holds_positions_only(integrator)], integrator, 2)
    runs, finest, limit = found.runs, found.finest, allowance(ERROR_FACTOR, rate.size, found.dt)
    limits = {"error of the crank angle [rad]": limit, "error of the corner [m]": limit * place.size}
    flat, round_ = _when(finest, turn, 0.5 * math.pi), _when(finest, turn, 2.0 * math.pi)
    speed = abs(float(finest.at(flat)["base 0.angle.rate"])) if flat == flat else math.nan
    total = finest.energy.total
    change = float(np.max(np.abs(total - energy.value)) / abs(energy.value))
    return Outcome(
        [
            found.stopped,
            *found.figures(limits, erratic=True),
            Figure("change of energy, relative [-]", change, min(ENERGY_RTOL, limit)),
            Figure("error of the energy at the start [J]", abs(total[0] - energy.value), energy.accuracy),
            Figure("wrong number of flat poses", max(abs(_passes(run, turn) - float(passes.value)) for run in runs), 0),
            Figure("error of the time of the first flat pose [s]", abs(flat - float(first.value)), limit * first.size),
            Figure("error of the rate there [rad/s]", abs(speed - float(rate.value)), limit * rate.size),
            Figure("error of the time of one revolution [s]", abs(round_ - float(period.value)), limit * period.size),
            Figure("cranks out of parallel [rad]", max(_skew(model, run) for run in runs), CLOSURE_ATOL),
            Figure("gap of the joints [m]", max(run.violation.length for run in runs), CLOSURE_ATOL),
        ],
        [Curve("crank angle [rad]", finest.time, turn - finest["base 0.angle"]), *found.curves()],
    )


def _stride(step: float) -> int:
    """Rows about 4 ms apart, between which places are interpolated to 1e-9."""
    return max(1, round(0.004 / step))


def _passes(run: Any, turn: float) -> int:
    """Flat poses that were passed, at angles of π/2 + k π from upright."""
    halves = np.floor((turn - run["base 0.angle"]) / math.pi + 0.5)
    return int(np.count_nonzero(np.diff(halves)))


def _when(run: Any, turn: float, level: float) -> float:
    """First time at which the angle from upright reaches a level, by bisection of the run's own interpolation."""
    reached = np.flatnonzero(np.abs(turn - run["base 0.angle"]) >= level)
    if not len(reached) or not reached[0]:
        return math.nan
    left, right = float(run.time[reached[0] - 1]), float(run.time[reached[0]])
    return crossing(run, lambda at: np.abs(turn - at["base 0.angle"]) - level, left, right)


def _skew(model: mbd.Model, run: Any) -> float:
    """Largest difference of the angles of two cranks."""
    bases = [joint.name for joint in model.joints if joint.name.startswith("base")]
    return max(size(run[f"{base}.angle"] - run["base 0.angle"]) for base in bases)


REQUIREMENT = (
    "Every flat pose is passed on the parallelogram branch, without a jump of energy, with an error of order 2."
)

CASES = tuple(
    HardCase(
        id,
        REQUIREMENT,
        partial(judge_four_bars, id, dts),
        DAMPED if slow else EVERY,
        slow,
        {"Newmark": "not judged with 40 four-bars, which take long; it is with 1, 2 and 10"} if slow else {},
        label=id.replace("-iftomm-a02-fourbar", "").removesuffix("-N40"),
    )
    for id, dts, slow in (
        ("b2-iftomm-a02-fourbar-N1", (1e-3, 1e-3), False),
        ("b2-iftomm-a02-fourbar-N2", (1e-3, 1e-3), False),
        ("b2-iftomm-a02-fourbar-N10", (1e-3, 2e-3), False),
        ("b2b-iftomm-a02-fourbar-N40", (1e-3, 2e-3), True),
    )
)
