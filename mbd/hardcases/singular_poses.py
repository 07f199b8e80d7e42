"""Linkages that pass singular configurations and another branch of motions begins: j3 and j3b."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

import mbd
from mbd.hardcases.case import CLOSURE_ATOL, Curve, Figure, HardCase, Outcome, definition
from mbd.hardcases.convergence import allowance, study
from mbd.hardcases.crossings import crossing
from mbd.hardcases.references import distance_to, quantity, size
from mbd.hardcases.schemes import EVERY

J3, J3B = "j3-slider-crank-equal-lengths", "j3b-fourbar-flattening"
ENERGY_JUMP_RTOL = 1e-6
"""Relative change of energy that one passage of a singular pose may make [-]."""
JUMP_WINDOW = 0.02
"""Time [s] before and after a singular pose within which a jump of energy is looked for."""
CRANK, FLAT = 0.6, 0.2
"""Factors of the allowance of errors, of j3 and j3b."""


def equal_slider_crank() -> tuple[mbd.Model, mbd.State]:
    """Crank and rod of one length, the slider on the x axis through the crank's pivot."""
    numbers, begin = definition(J3)["definition"], definition(J3)["initial_conditions"]
    L, m = numbers["L"], numbers["m_each"]
    rod = {"mass": m, "length": L, "center": 0.5 * L, "inertia": m * L * L / 12.0}
    model = mbd.Model("slider-crank", gravity=(0.0, -numbers["g"], 0.0))
    crank, coupler = mbd.Link("crank", **rod), mbd.Link("rod", **rod)
    slider = mbd.PointMass("slider", m)
    model.connect(
        mbd.Revolute("main", model.ground.origin, crank.start),
        mbd.Revolute("pin", crank.end, coupler.start),
        mbd.Prismatic("guide", model.ground.origin, slider.origin),
        mbd.Revolute("wrist", slider.origin, coupler.end),
    )
    angle = begin["crank_angle"]  # from the x axis; links hang along −y at angle zero
    place = {"main.angle": angle + 0.5 * math.pi, "pin.angle": -2.0 * angle}
    place["guide.displacement"] = 2.0 * L * math.cos(angle)
    return model, mbd.assemble(model, position=place, velocity={"main.angle": begin["crank_rate"]})


def parallelogram() -> tuple[mbd.Model, mbd.State]:
    """Two cranks and a coupler of one length on a base of the same length; 'a' and 'd' are their pivots."""
    numbers, begin = definition(J3B)["definition"], definition(J3B)["initial_conditions"]
    L, m = numbers["L"], numbers["link_mass"]
    rod = {"mass": m, "length": L, "center": 0.5 * L, "inertia": m * L * L / 12.0}
    model = mbd.Model("parallelogram", gravity=(0.0, -numbers["g"], 0.0))
    one, other, coupler = (mbd.Link(name, **rod) for name in ("one", "other", "coupler"))
    model.connect(
        mbd.Revolute("a", model.ground.origin, one.start),
        mbd.Revolute("d", model.ground.point(L, 0.0, name="far end"), other.start),
        mbd.Revolute("b", one.end, coupler.start),
        mbd.Revolute("c", coupler.end, other.end),
    )
    angle = begin["theta_from_downward"]
    place = {"a.angle": angle, "d.angle": angle, "b.angle": 0.5 * math.pi - angle}
    return model, mbd.assemble(model, position=place, velocity={"a.angle": begin["thetadot"]})


def judge_slider_crank(integrator: Any) -> Outcome:
    """Two singular poses are passed on the smooth branch: angle and slider with order 2, energy without a jump."""
    model, start = equal_slider_crank()
    angle, slider = quantity(J3, "crank angle"), quantity(J3, "slider position")
    instant, rate = quantity(J3, "time of first"), quantity(J3, "crank rate at the first")
    energy = quantity(J3, "energy")

    def turning(dt: float) -> Any:
        return mbd.simulate(model, start, integrator, dt=dt, until=float(angle.times[-1]), on_failure="return")

    def errors(run: Any) -> Mapping[str, float]:
        at = run.at(angle.times)
        return {
            "error of the crank angle [rad]": distance_to(at["main.angle"] - 0.5 * math.pi, angle),
            "error of the slider [m]": distance_to(at["guide.displacement"], slider),
        }

    found = study(turning, errors, 2e-3, integrator)
    runs, finest, turn = found.runs, found.finest, definition(J3)["initial_conditions"]["crank_rate"]
    turned = finest["main.angle"] - 0.5 * math.pi
    passages = _passages(finest, "main.angle", 0.5 * math.pi)
    first = passages[0] if passages else math.nan
    speed = float(finest.at(first)["main.angle.rate"]) if passages else math.nan
    L, most = definition(J3)["definition"]["L"], allowance(CRANK, turn, found.dt, angle.size)
    off = [run["guide.displacement"] - 2.0 * L * np.cos(run["main.angle"] - 0.5 * math.pi) for run in runs]
    branch = max(map(size, off))
    return Outcome(
        [
            found.stopped,
            *found.figures({"error of the crank angle [rad]": most}, angle.accuracy),
            *found.figures({"error of the slider [m]": 2.0 * L * most}, slider.accuracy),
            Figure("error of the time of the first singular pose [s]", abs(first - float(instant.value)),
                   allowance(CRANK, turn, found.dt, instant.size)),
            Figure("error of the crank rate there [rad/s]", abs(speed - float(rate.value)),
                   allowance(CRANK, turn, found.dt, rate.size)),
            Figure("error of the energy at the start [J]", abs(float(finest.energy.total[0]) - float(energy.value)),
                   max(energy.accuracy, 1e-12 * float(energy.value))),
            Figure("jump of energy at a singular pose, relative [-]", _jump(finest, passages), ENERGY_JUMP_RTOL),
            Figure("slider off the smooth branch [m]", branch, CLOSURE_ATOL),
            Figure("gap of the joints [m]", max(run.violation.length for run in runs), CLOSURE_ATOL),
        ],
        [Curve("crank angle [rad]", finest.time, turned), *found.curves()],
    )  # fmt: skip


def judge_parallelogram(integrator: Any) -> Outcome:
    """Every flat pose is passed on the branch where the cranks stay parallel."""
    model, start = parallelogram()
    angle, count = quantity(J3B, "crank angle"), quantity(J3B, "flat positions")

    def turning(dt: float) -> Any:
        return mbd.simulate(model, start, integrator, dt=dt, until=float(angle.times[-1]), on_failure="return")

    def errors(run: Any) -> Mapping[str, float]:
        return {"error of the crank angle [rad]": distance_to(run.at(angle.times)["a.angle"], angle)}

    found = study(turning, errors, 2e-3, integrator)
    runs, finest, turn = found.runs, found.finest, definition(J3B)["initial_conditions"]["thetadot"]
    passages = _passages(finest, "a.angle")
    skew = max(size(run["d.angle"] - run["a.angle"]) for run in runs)
    return Outcome(
        [
            found.stopped,
            *found.figures({"error of the crank angle [rad]": allowance(FLAT, turn, found.dt, angle.size)}),
            Figure("wrong number of flat poses", abs(len(passages) - float(count.value)), 0),
            Figure("jump of energy at a flat pose, relative [-]", _jump(finest, passages), ENERGY_JUMP_RTOL),
            Figure("cranks out of parallel [rad]", skew, CLOSURE_ATOL),
            Figure("gap of the joints [m]", max(run.violation.length for run in runs), CLOSURE_ATOL),
        ],
        [Curve("crank angle [rad]", finest.time, finest["a.angle"]), *found.curves()],
    )


def _passages(run: Any, name: str, offset: float = 0.0) -> list[float]:
    """Times at which an angle, measured from its offset, is π/2 + k π."""
    rows = np.flatnonzero(np.diff(np.floor((run[name] - offset) / math.pi + 0.5)))
    return [
        crossing(run, lambda at: np.cos(at[name] - offset), float(run.time[row]), float(run.time[row + 1]))
        for row in rows
    ]


def _jump(run: Any, passages: list[float]) -> float:
    """Largest change of energy across a singular pose, beyond its straight trend before and after, over the energy.

    The trend is the scheme's own error, of order dt²; what a bad passage does is added within one step.
    """
    total, worst = run.energy.total, 0.0 if passages else math.nan
    for instant in passages:
        before = (run.time > instant - JUMP_WINDOW) & (run.time < instant)
        after = (run.time > instant) & (run.time < instant + JUMP_WINDOW)
        if np.count_nonzero(before) < 4 or np.count_nonzero(after) < 4:
            return math.nan
        ends = [np.polyval(np.polyfit(run.time[side] - instant, total[side], 2), 0.0) for side in (before, after)]
        worst = max(worst, float(abs(ends[1] - ends[0]) / np.max(np.abs(run.energy.kinetic))))
    return worst


CASES = (
    HardCase(J3, "The slider-crank passes its singular poses on the smooth branch, with order 2 and no jump of energy.",
             judge_slider_crank, EVERY),
    HardCase(J3B, "The parallelogram passes its flat poses with its cranks parallel, with order 2.",
             judge_parallelogram, EVERY),
)  # fmt: skip
