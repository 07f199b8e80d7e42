"""A pendulum in x and y under ever smaller steps: j1."""

import math
import re
from collections.abc import Mapping
from typing import Any

import numpy as np

import mbd
from mbd.hardcases.case import ROUND_OFF, Curve, Figure, HardCase, Outcome, definition
from mbd.hardcases.convergence import EPS, deviation, force_floor, study
from mbd.hardcases.references import quantity
from mbd.hardcases.schemes import EVERY

J1 = "j1-tiny-steps-index3"
ERROR_CONSTANT = 0.5
"""C of the multiplier error C dt² over m g²/L; the worst scheme needs about half of it [-]."""
NEAR, NEAR_STEP = 1e-8, 1e-6
"""Places must be this accurate [m] at steps of this size [s] and below."""
UNREACHABLE_TOLERANCE = 1e-17
"""A tolerance of the balance that no double precision meets: a tenth of a unit in the last place [-]."""


def circle(case: str = J1) -> tuple[mbd.Model, mbd.State]:
    """A point mass on the circle x² + y² = L², whose multiplier is the pull of the rod; at rest at its angle."""
    numbers, begin = definition(case)["definition"], definition(case)["initial_conditions"]
    L, angle = numbers["L"], begin["angle_from_vertical"]
    model = mbd.Model("pendulum in x and y", gravity=(0.0, -numbers["g"], 0.0))
    bob = mbd.PointMass("bob", numbers["m"])
    model.connect(mbd.Translation("place", model.ground.origin, bob.origin))
    row = mbd.measure(lambda x, y: (x * x + y * y - L * L) / (2.0 * L), "place.x", "place.y")
    model.constrain(mbd.Bilateral("rod", row))
    return model, mbd.assemble(model, position={"place.x": L * math.sin(angle), "place.y": -L * math.cos(angle)})


def judge_tiny_steps(integrator: Any) -> Outcome:
    """Errors fall with dt² down to round-off and stay there; a tolerance below round-off is refused by name."""
    model, start = circle()
    numbers = definition(J1)["definition"]
    L, m, g, until = (numbers[name] for name in ("L", "m", "g", "t_end"))
    first, last = quantity(J1, "rod tension at t = 0+"), quantity(J1, "rod tension at t_end")
    top = math.cos(definition(J1)["initial_conditions"]["angle_from_vertical"])
    low = (float(last.value) / (m * g) + 2.0 * top) / 3.0  # T = m g (3 cos θ − 2 cos θ₀), so cos θ from the reference
    place, speed = L * np.array([math.sqrt(1.0 - low * low), -low]), math.sqrt(2.0 * g * L * (low - top))

    def swing(dt: float) -> Any:
        return mbd.simulate(model, start, integrator, dt=dt, until=until, store=max(1, round(until / dt / 1000)))

    def errors(run: Any) -> Mapping[str, float]:
        return {
            "error of the place [m]": math.dist((run["place.x"][-1], run["place.y"][-1]), place),
            "error of the tension [N]": abs(float(run["rod.multiplier"][-1]) - float(last.value)),
        }

    found = study(swing, errors, numbers["dts"], integrator)
    (places, tensions), steps = map(np.array, found.errors.values()), found.steps
    begun = [abs(float(run["rod.multiplier"][0]) - float(first.value)) for run in found.runs]
    higher = integrator.order() > 2
    judgement = "what is missing to order 2" if higher else "|order − 2|"
    rest = 10.0 * EPS * L * np.sqrt(until / steps)
    floors = np.array([force_floor(integrator, dt, until / dt, m, L, speed) for dt in steps])
    figures = [
        Figure(f"{judgement} of the place above round-off [-]",
               deviation(steps, places, float(rest[-1]), higher), 0.15),
        Figure("error of the place over C dt² and round-off [-]",
               float(np.max(places / (ERROR_CONSTANT * g * steps**2 + rest))), 1.0),
        Figure(f"error of the place at dt ≤ {NEAR_STEP:g} s [m]", float(np.max(places[steps <= NEAR_STEP])), NEAR),
        Figure(f"{judgement} of the tension above its round-off floor [-]",
               deviation(steps, tensions, floors, higher), 0.15),
        Figure("error of the tension over C dt² and its round-off floor [-]",
               float(np.max(tensions / (ERROR_CONSTANT * m * g * g / L * steps * steps + floors))), 1.0),
        Figure("error of the tension at the start [N]", max(begun), first.accuracy),
        Figure("|constraint| over L [-]", max(run.violation.length / L for run in found.runs), ROUND_OFF),
    ]  # fmt: skip
    if hasattr(integrator, "tolerance"):
        figures.append(_refusal(integrator, model, start, min(numbers["dts"])))
    return Outcome(
        figures, [*found.curves(), Curve("round-off floor of the tension [N]", steps, floors, "dt [s]", "", True)]
    )


def _refusal(integrator: Any, model: mbd.Model, start: mbd.State, dt: float) -> Figure:
    """Whether a tolerance that cannot be met stops the run and tells what can be met: 0 if so."""
    what = "runs that go on, or stop without saying what is attainable, under a tolerance below round-off"
    run = mbd.simulate(
        model, start, _with_tolerance(integrator, UNREACHABLE_TOLERANCE), dt=dt, until=50 * dt, on_failure="return"
    )
    number = r"([\d.]+(?:e[-+]?\d+)?)"
    match = re.search(rf"stagnated at round-off: residual {number}, attainable {number}", run.message)
    is_named = match is not None and all(UNREACHABLE_TOLERANCE < float(each) < 1e-8 for each in match.groups())
    return Figure(what, 0.0 if is_named and not run.success else 1.0, 0.0)


def _with_tolerance(integrator: Any, tolerance: float) -> Any:
    """The same scheme with another tolerance."""
    own = {
        name: getattr(integrator, name) for name in ("alpha", "rho_inf", "beta", "gamma") if hasattr(integrator, name)
    }
    if hasattr(integrator, "formulation"):
        own["formulation"] = integrator.formulation
    return type(integrator)(**own, tolerance=tolerance)


CASES = (
    HardCase(
        J1,
        "Errors fall with dt² until round-off and stay there; no false failure of Newton, no false success.",
        judge_tiny_steps,
        EVERY,
        notes={"RungeKutta853": "explicit: it solves nothing to a tolerance that could be too small"},
    ),
)
