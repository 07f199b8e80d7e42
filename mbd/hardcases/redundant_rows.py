"""Mechanisms with more rows than they need: j2, whose cranks are one too many, and b4, which the count would freeze."""

import math
import re
from collections.abc import Mapping
from typing import Any

import numpy as np

import mbd
from mbd.hardcases.case import CLOSURE_ATOL, Curve, Figure, HardCase, Outcome, definition
from mbd.hardcases.convergence import allowance, study
from mbd.hardcases.references import distance_to, quantity, size
from mbd.hardcases.schemes import EVERY

J2, B4 = "j2-parallel-fourbar-redundant", "b4-iftomm-a04-bricard"
CRANK, PLACE, ENERGY = 0.4, 0.1, 0.05
"""Factors of the allowance of errors of order 2, with √(g/L): of the crank angle, of P3, of the energy."""
MAX_MULTIPLIER = 10.0
"""A multiplier may be so many times the weight of the mechanism [-]; those that fight each other are 1e8 times it."""


def parallel_cranks(case: str = J2, cut: Any = "auto", count: int = 0) -> tuple[mbd.Model, mbd.State]:
    """Equal cranks at equal distances that carry one coupler: every crank beyond the second is redundant.

    count : of cranks; that of the case for 0
    """
    numbers, begin = definition(case)["definition"], definition(case)["initial_conditions"]
    L, apart, m = numbers["crank_length"], numbers["spacing"], numbers["crank_mass"]
    model = mbd.Model("parallel cranks", gravity=(0.0, -numbers["g"], 0.0), cut=cut)
    count = count or int(numbers["n_cranks"])
    span = apart * (count - 1)
    coupler = mbd.RigidBody("coupler", mass=numbers["coupler_mass"], inertia=numbers["coupler_mass"] * span**2 / 12.0)
    cranks = [mbd.Link(f"crank {k}", m, L, 0.5 * L, m * L**2 / 12.0) for k in range(count)]
    for k, crank in enumerate(cranks):
        model.connect(mbd.Revolute(f"base {k}", model.ground.point(k * apart, 0.0, 0.0, name=f"base {k}"), crank.start))
    for k, crank in enumerate(cranks):
        model.connect(mbd.Revolute(f"pin {k}", crank.end, coupler.point(k * apart - 0.5 * span, 0.0, name=f"pin {k}")))
    angle = begin["theta_from_downward"]
    if cut != "auto":
        return model, mbd.assemble(model)
    return model, mbd.assemble(
        model, position={"base 0.angle": angle, "pin 0.angle": -angle}, velocity={"base 0.angle": begin["thetadot"]}
    )


def bricard(cut: Any = "auto") -> tuple[mbd.Model, mbd.State]:
    """Thin rods between two fixed pivots, each of the hinges 'P0' … square to its neighbours."""
    numbers = definition(B4)["definition"]
    points = [np.array(place, dtype=float) for place in numbers["points"].values()]
    down = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}[numbers["gravity"][-1]]
    sign = -1.0 if numbers["gravity"].startswith("-") else 1.0
    model = mbd.Model("Bricard's mechanism", gravity=tuple(sign * numbers["g"] * part for part in down), cut=cut)
    rods = []
    for k in range(len(points) - 1):
        along = points[k + 1] - points[k]
        inertia = numbers["rod_mass"] * (along @ along - along * along) / 12.0
        rods.append(mbd.RigidBody(f"rod {k}", numbers["rod_mass"], tuple(inertia), center=tuple(0.5 * along)))
    for k, axis in enumerate(numbers["joint_axes"].values()):
        tip = points[k] - points[k - 1]
        before = rods[k - 1].point(tip[0], tip[1], tip[2], name="tip") if k else model.ground.origin
        x, y, z = points[k]
        after = rods[k].origin if k < len(rods) else model.ground.point(x, y, z, name="far pivot")
        model.connect(mbd.Revolute(f"P{k}", before, after, axis=tuple(axis)))
    return model, mbd.assemble(model)


def judge_parallel_cranks(integrator: Any) -> Outcome:
    """The motion with order 2, the sum of the joint forces exact, one note of what is redundant."""
    model, start = parallel_cranks()
    angle, force = quantity(J2, "crank angle"), quantity(J2, "sum of the joint forces")
    spare = quantity(J2, "number of redundant")
    numbers = definition(J2)["definition"]

    def swing(dt: float) -> Any:
        return mbd.simulate(model, start, integrator, dt=dt, until=float(angle.times[-1]))

    def errors(run: Any) -> Mapping[str, float]:
        return {"error of the crank angle [rad]": distance_to(run.at(angle.times)["base 0.angle"], angle)}

    found = study(swing, errors, 4e-3, integrator)
    runs, finest, rate = found.runs, found.finest, math.sqrt(numbers["g"] / numbers["crank_length"])
    pins = [joint.name for joint in model.joints if joint.name.startswith("pin")]
    total = sum(finest[f"{pin}.reaction_force"][0, :2] for pin in pins)
    weight = (numbers["n_cranks"] * numbers["crank_mass"] + numbers["coupler_mass"]) * numbers["g"]
    skew = max(size(run[f"base {k}.angle"] - run["base 0.angle"])
               for run in runs for k in range(1, len(pins)))  # fmt: skip
    return Outcome(
        [
            *found.figures({"error of the crank angle [rad]": allowance(CRANK, rate, found.dt, angle.size)}),
            Figure("error of the sum of the joint forces [N]", distance_to(total, force), max(force.accuracy, 1e-10)),
            Figure("wrong count of redundant rows in the notes", max(_miscount(run, spare.value) for run in runs), 0),
            Figure("runs that do not say that multipliers are not unique", sum(not _warned(run) for run in runs), 0),
            Figure("largest multiplier over the weight [-]", _largest(runs) / weight, MAX_MULTIPLIER),
            Figure("cranks out of parallel [rad]", skew, CLOSURE_ATOL),
            Figure("rows that do not hold [m]", max(run.violation.length for run in runs), CLOSURE_ATOL),
        ],
        [Curve("crank angle [rad]", finest.time, finest["base 0.angle"]), *found.curves()],
    )


def judge_bricard(integrator: Any) -> Outcome:
    """One freedom, not none: P3 with order 2, rows and energy kept, one note of the redundant row."""
    model, start = bricard()
    place, change, freedom = quantity(B4, "P3"), quantity(B4, "total energy change"), quantity(B4, "number of degrees")
    numbers = definition(B4)["definition"]

    def turning(dt: float) -> Any:
        return mbd.simulate(model, start, integrator, dt=dt, until=float(place.times[-1]))

    def errors(run: Any) -> Mapping[str, float]:
        total = run.energy.total
        return {
            "error of P3 [m]": distance_to(run.at(place.times)["rod 2.tip"], place),
            "change of energy [J]": size(total - total[0] - change.value),
        }

    found = study(turning, errors, 2e-3, integrator, 2)
    runs, finest, rate = found.runs, found.finest, math.sqrt(numbers["g"] / numbers["rod_length"])
    work = numbers["rod_mass"] * numbers["g"] * numbers["rod_length"]
    limits = (allowance(PLACE, rate, found.dt, place.size), allowance(ENERGY, rate, found.dt, work))
    rows = finest.record.lam.shape[1]
    free = max(abs(len(start.v) - rows + _spare(run) - float(freedom.value)) for run in runs)
    weight = (len(numbers["points"]) - 1) * numbers["rod_mass"] * numbers["g"]
    apart = max(max(run.violation.length, run.violation.angle) for run in runs)
    return Outcome(
        [
            *found.figures(dict(zip(found.errors, limits, strict=True))),
            Figure("wrong count of freedoms by the note of what is redundant", free, 0),
            Figure("runs that do not say that multipliers are not unique", sum(not _warned(run) for run in runs), 0),
            Figure("largest multiplier over the weight [-]", _largest(runs) / weight, MAX_MULTIPLIER),
            Figure("rows that do not hold [m, rad]", apart, CLOSURE_ATOL),
        ],
        [Curve("height of P3 [m]", finest.time, finest["rod 2.tip.y"]), *found.curves()],
    )


def _spare(run: Any) -> float:
    """How many rows the notes call redundant, told once; NaN otherwise."""
    counts = [found for note in run.stats["notes"] if (found := re.search(r"redundant constraints: (\d+)", note))]
    return float(counts[0][1]) if len(counts) == 1 else math.nan


def _miscount(run: Any, wanted: Any) -> float:
    return abs(_spare(run) - float(wanted))


def _warned(run: Any) -> bool:
    """Whether a note about redundant rows says that multipliers are not unique."""
    return any("redundant" in note and "multipliers" in note and "not" in note for note in run.stats["notes"])


def _largest(runs: Any) -> float:
    return max(size(run.record.lam) for run in runs)


CASES = (
    HardCase(J2, "The motion is unique and of order 2, the sum of forces exact; what is redundant is reported once.",
             judge_parallel_cranks, EVERY),
    HardCase(B4, "The mechanism moves with its one freedom, on its rows, with order 2; what is redundant is reported "
             "once.",
             judge_bricard, EVERY),
)  # fmt: skip
