"""What time prescribes: a leg that follows samples (j19), and a torque that jumps again and again (j20)."""

from typing import Any

import numpy as np

import mbd
from mbd.equal import EQUAL_RTOL
from mbd.hardcases.case import Curve, Figure, HardCase, Outcome
from mbd.hardcases.references import numbers, published, quantity, size
from mbd.hardcases.schemes import EVERY, holds_positions_only

LEG, ROD = "j19-leg-driven-by-a-table", "j20-torque-that-jumps"
INDEX_3_TOLERANCE = 1e-2
"""The same of schemes that hold positions only, whose multipliers have an error of dt² [-]."""


def followed(given: dict[str, Any]) -> mbd.Model:
    """Two links below a fixed hip, whose angles follow samples."""
    model = mbd.Model("followed leg", gravity=(0.0, -given["g"], 0.0))
    columns = (given[name] for name in ("masses", "lengths", "centers", "inertias"))
    thigh, shank = (mbd.Link(*each) for each in zip(("thigh", "shank"), *columns, strict=True))
    hip, knee = mbd.Revolute("hip", model.ground.origin, thigh.start), mbd.Revolute("knee", thigh.end, shank.start)
    model.connect(hip, knee)
    for joint in (hip, knee):
        samples = mbd.Samples(given["times"], given[joint.name])
        model.constrain(mbd.Bilateral(f"{joint.name} drive", joint, value=samples))
    return model


def judge_followed(integrator: Any) -> Outcome:
    """Errors of both torques at instants that are ends of steps, and between them."""
    given = numbers(LEG)
    model = followed(given)
    run = mbd.simulate(model, mbd.assemble(model), integrator, dt=given["dt"], until=given["until"])
    allowed = INDEX_3_TOLERANCE if holds_positions_only(integrator) else EQUAL_RTOL
    figures, curves = [], []
    for joint in ("hip", "knee"):
        reference, found = quantity(LEG, f"{joint} torque"), run[f"{joint} drive.torque"]
        between = size(run.at(reference.times)[f"{joint} drive.torque"] - reference.value)
        largest = size(reference.value)
        figures.append(Figure(f"error of the {joint} torque between steps [-]", between / largest, allowed))
        angle, knots = run[f"{joint}.angle"], np.isin(run.time, given["times"])
        samples = np.interp(run.time[knots], given["times"], given[joint])
        figures.append(Figure(f"error of the {joint} angle at its samples [rad]", size(angle[knots] - samples), 1e-10))
        curves.append(Curve(f"{joint} torque", run.time, found, y_label="torque [N m]"))
    return Outcome(figures, curves)


def switched(given: dict[str, Any]) -> tuple[mbd.Model, mbd.State]:
    """A rod on a damped hinge under a torque that is on for a share of each period, and its start."""
    model = mbd.Model("switched rod", gravity=(0.0, -given["g"], 0.0))
    rod = mbd.Link("rod", mass=given["m"], length=given["L"], center=given["c"], inertia=given["I"])
    hinge = mbd.Revolute("hinge", model.ground.origin, rod.start, loss=mbd.Viscous(given["damping"]))
    model.connect(hinge)

    def torque(t: Any) -> Any:
        since, period = t - given["first"], given["period"]
        acts = (since >= 0.0) & (mbd.mod(since, period) < given["share"] * period)
        return mbd.where(acts, given["torque"], 0.0)

    model.apply(mbd.Motor("motor", hinge, torque=torque))
    return model, mbd.assemble(model, position={"hinge.angle": given["angle"]})


def judge_switched(integrator: Any) -> Outcome:
    """The error at the end with tolerances, and its order with fixed steps."""
    given = numbers(ROD)
    model, start = switched(given)
    end, figures = published(ROD, "angle at the end"), []

    def error(**how: Any) -> float:
        run = mbd.simulate(model, start, integrator, until=given["until"], **how)
        return float(abs(run["hinge.angle"][-1] - end))

    fixed = [error(dt=dt) for dt in given["dts"]]
    order = min(2.0, float(integrator.order()))
    halved = max(fixed[k] / max(fixed[k - 1], 1e-11) for k in (1, 2) if fixed[k] > 1e-11) if fixed[-1] > 1e-11 else 0.0
    figures.append(Figure("error after half the step over that before [-]", halved, 1.25 * 0.5**order))
    figures += [
        Figure(f"error of the angle, tol = {tol:g} [tol]", error(tol=tol) / tol, 1.0) for tol in given["tolerances"]
    ]
    curve = Curve("error at the end", given["dts"], fixed, "dt [s]", "[rad]", logarithmic=True)
    return Outcome(figures, [curve])


CASES = (
    HardCase(LEG, "Torques of drives that follow samples are those of the spline through them.", judge_followed, EVERY),
    HardCase(ROD, "Steps end where a torque jumps: their order and a tolerance hold.", judge_switched, EVERY),
)
