"""Masses that differ by a million or vanish: j4 and j5."""

import math
import re
from collections.abc import Mapping
from typing import Any

import numpy as np

import mbd
from mbd.hardcases.case import ROUND_OFF, Curve, Figure, HardCase, Outcome, definition
from mbd.hardcases.convergence import allowance, study
from mbd.hardcases.crossings import falls
from mbd.hardcases.references import quantity
from mbd.hardcases.schemes import EVERY

J4, J5 = "j4-mass-ratio-1e6", "j5-near-massless-link"
RESOLVING = {2: ((1e-6, 2.5e-7), 5e-7), 3: ((1e-6, 5e-7), 1e-6), 8: ((2e-6, 1e-6), 2e-6)}
"""Steps [s] that resolve the snap of the light mass through the straight line, in minimal and in absolute coordinates,
of schemes of that order at least; the limits are the same for all."""
COARSE = (1e-2, 1e-3, 1e-4)
"""Steps [s] that do not: there a scheme may damp it or say that it cannot go on."""
ANGLE_LIMIT, RATE_LIMIT, ABSOLUTE = 8e-5, 1.6e-2, 25.0
"""Errors at the finest step [rad, rad/s]; in absolute coordinates, at steps that are larger, so many times that."""
ENERGY_GAIN_RTOL = 1e-3
"""Energy that may be gained, over that of the heavy mass between its lowest and highest place [-]."""


WELDED, HINGED = 0.2, 0.5
"""Factors of the allowance of errors of the period, with one coordinate and with rows."""


def heavy_below_light(cut: str = "auto") -> tuple[mbd.Model, mbd.State]:
    """A double pendulum of a light mass and a heavy one below it; cut='all' has absolute coordinates."""
    numbers, begin = definition(J4)["definition"], definition(J4)["initial_conditions"]
    model = mbd.Model("mass ratio", gravity=(0.0, -numbers["g"], 0.0), cut=cut)
    upper = mbd.Link("upper", numbers["m1"], numbers["L1"], numbers["L1"])
    lower = mbd.Link("lower", numbers["m2"], numbers["L2"], numbers["L2"])
    model.connect(
        mbd.Revolute("shoulder", model.ground.origin, upper.start), mbd.Revolute("elbow", upper.end, lower.start)
    )
    one, two = begin["theta1"], begin["theta2"]
    names = ("shoulder.angle", "elbow.angle") if cut == "auto" else ("upper floating.angle", "lower floating.angle")
    return model, mbd.assemble(model, position={names[0]: one, names[1]: two - one if cut == "auto" else two})


def judge_mass_ratio(integrator: Any) -> Outcome:
    """The values where the step resolves the light mass; elsewhere no gain of energy, no open joint, or an error."""
    reference = quantity(J4, "[theta1, theta2")
    model, start = heavy_below_light()

    def swing(dt: float) -> Any:
        return _swing(model, start, integrator, dt, reference.times)

    fine, middle = RESOLVING[max(order for order in RESOLVING if order <= max(integrator.order(), 2))]
    found = study(swing, lambda run: _differences(run, reference, "auto"), fine, integrator)
    absolute, begun = heavy_below_light("all")
    wide = _swing(absolute, begun, integrator, middle, reference.times)
    apart = _differences(wide, reference, "all")
    gap, silent, curves = wide.violation.length, [], []
    for mechanism, at in (model, start), (absolute, begun):
        for dt in COARSE:
            run = _swing(mechanism, at, integrator, dt, reference.times)
            gap = max(gap, run.violation.length)
            total = run.energy.total
            silent.append(_gain(total) if run.success else 0.0)
            curves.append(Curve(f"energy, {mechanism.cut}, dt = {dt:g} s", run.time, total, y_label="energy [J]"))
    limits = {"error of the angles [rad]": ANGLE_LIMIT, "error of the rates [rad/s]": RATE_LIMIT}
    figures = found.figures(limits, reference.accuracy, better=True)
    for what, limit in limits.items():
        figures.append(Figure(f"{what} at dt = {middle:g} s, absolute coordinates", apart[what], ABSOLUTE * limit))
    figures.append(Figure("gap of the joints at any step [m]", gap, ROUND_OFF))
    figures.append(Figure("energy gained in silence at large steps [-]", max(silent), ENERGY_GAIN_RTOL))
    return Outcome(figures, [*curves, *found.curves()])


def _swing(model: mbd.Model, start: mbd.State, integrator: Any, dt: float, times: Any) -> Any:
    """A run that keeps about 5000 rows, with those at the instants of the reference."""
    stride = max(1, round(2e-4 / dt))
    return mbd.simulate(model, start, integrator, dt=dt, until=float(times[-1]), store=stride, on_failure="return")


def _differences(run: Any, reference: Any, cut: str) -> dict[str, float]:
    """Errors of both angles and of both rates; NaN where the run stopped early."""
    names = ("error of the angles [rad]", "error of the rates [rad/s]")
    if not run.success:
        return dict.fromkeys(names, math.nan)
    at = run.at(reference.times)
    one, two = ("shoulder", "elbow") if cut == "auto" else ("upper floating", "lower floating")
    first = np.column_stack([at[f"{one}.angle"], at[f"{one}.angle.rate"]])
    second = np.column_stack([at[f"{two}.angle"], at[f"{two}.angle.rate"]])
    if cut == "auto":
        second = second + first
    off = np.abs(np.stack([first, second]) - np.moveaxis(reference.value.reshape(-1, 2, 2), 2, 0))
    return dict(zip(names, (float(np.max(off[..., 0])), float(np.max(off[..., 1]))), strict=True))


def _gain(total: Any) -> float:
    """Largest energy above that at the start, over 2 m g (L₁ + L₂) of the heavy mass."""
    numbers = definition(J4)["definition"]
    swing = 2.0 * numbers["m2"] * numbers["g"] * (numbers["L1"] + numbers["L2"])
    return float(np.max(total - total[0]) / swing)


def bob_on_link(mass: float, held: str = "weld", case: str = J5) -> tuple[mbd.Model, mbd.State]:
    """A bob at the end of a link of little or no mass, by a 'weld', a 'hinge', or without a bob ('nothing')."""
    numbers, begin = definition(case)["definition"], definition(case)["initial_conditions"]
    length, angle = numbers["total_length"], begin["theta0"]
    model = mbd.Model("bob on a link", gravity=(0.0, -numbers["g"], 0.0))
    link = mbd.Link("stick", mass, length, 0.5 * length, mass * length**2 / 12.0)
    bob = mbd.PointMass("bob", numbers["bob_mass"])
    model.connect(mbd.Revolute("pivot", model.ground.origin, link.start))
    position = {"pivot.angle": angle}
    if held == "weld":
        model.connect(mbd.Weld("glue", link.end, bob.origin))
    elif held == "hinge":
        model.connect(
            mbd.Translation("place", model.ground.origin, bob.origin), mbd.Revolute("pin", link.end, bob.origin)
        )
        position |= {"place.x": length * math.sin(angle), "place.y": -length * math.cos(angle)}
    return model, mbd.assemble(model, position=position)


def judge_massless_link(integrator: Any) -> Outcome:
    """Period and pull at the start with almost no mass and with none; an error where nothing determines the motion."""
    numbers = definition(J5)["definition"]
    period, pull = quantity(J5, "period"), quantity(J5, "tension at the start")
    full = float(period.value)
    ways = [(numbers["link_mass"], "weld"), (0.0, "weld"), (numbers["link_mass"], "hinge"), (0.0, "hinge")]
    figures, off, curves = list[Figure](), list[float](), list[Curve]()
    for mass, held in ways:
        model, start = bob_on_link(mass, held)
        what = f"error of the period, {mass:g} kg, {held} [s]"

        def swing(dt: float, model: mbd.Model = model, start: mbd.State = start) -> Any:
            return mbd.simulate(model, start, integrator, dt=dt, until=1.3 * full)

        def errors(run: Any, what: str = what) -> Mapping[str, float]:
            return {what: abs(_period(run) - full)}

        found = study(swing, errors, full / 100, integrator)
        most = allowance(WELDED if held == "weld" else HINGED, 2.0 * math.pi / full, found.dt, full)
        figures += found.figures({what: most})
        off += [abs(float(np.linalg.norm(run["pivot.reaction_force"][0])) - float(pull.value)) for run in found.runs]
        curves += found.curves()
    figures += [
        Figure("error of the pull at the start [N]", max(off), pull.accuracy),
        Figure("links that nothing moves and that are not refused by name", _unnamed(), 0),
    ]
    return Outcome(figures, curves)


def _period(run: Any) -> float:
    """Time between the first fall through zero and the next."""
    found = falls(run, "pivot.angle")
    return found[1] - found[0] if len(found) > 1 else math.nan


def _unnamed() -> int:
    """0 if a massless link without a bob is refused before a run begins, and named."""
    try:
        bob_on_link(0.0, "nothing")
    except mbd.ModelError as error:
        return 0 if re.search(r"'(stick|pivot)", str(error)) and "mass" in str(error) else 1
    return 1


CASES = (
    HardCase(J4, "Values where the step resolves the light mass; else an error or damping, no gain, no open joint.",
             judge_mass_ratio, EVERY),
    HardCase(J5, "A link of almost no mass, or of none, moves as its bob does; motion without mass is refused.",
             judge_massless_link, EVERY),
)  # fmt: skip
