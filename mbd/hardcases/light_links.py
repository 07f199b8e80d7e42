"""Heavy bodies on a light link in space: p5."""

from typing import Any

import numpy as np

import mbd
from mbd.hardcases.case import ROUND_OFF, Curve, Figure, HardCase, Outcome, definition
from mbd.hardcases.references import size
from mbd.hardcases.schemes import EVERY

P5 = "p5-light-link-in-space"
PHASE_FACTOR = 0.5
"""Error of the phase that is allowed to schemes of order two, over (ω dt)² ω t [-]."""


def dumbbell(cut: str = "all") -> tuple[mbd.Model, mbd.State]:
    """Two heavy bodies, which spin on their own, on the ends of a rod of a millionth of their mass."""
    numbers = definition(P5)["definition"]
    M, m, L, omega, r = (numbers[name] for name in ("M", "m", "L", "omega", "radius"))
    model = mbd.Model("dumbbell", gravity=(0.0, 0.0, 0.0), cut=cut)
    one, other = (mbd.RigidBody(name, M, tuple(numbers["I"])) for name in ("one", "other"))
    across = m * (L**2 / 12.0 + r**2 / 4.0)
    rod = mbd.RigidBody("rod", m, (0.5 * m * r**2, across, across))
    model.connect(
        mbd.Free("flight", model.ground.origin, one.origin),
        mbd.Spherical("first", one.origin, rod.point(-0.5 * L, 0.0, 0.0)),
        mbd.Spherical("second", rod.point(0.5 * L, 0.0, 0.0), other.origin),
    )
    spin, second = numbers["spins"]
    upright: Any = (1.0, 0.0, 0.0, 0.0)
    place: Any = {"flight.x": -0.5 * L, "flight.y": 0.0, "flight.z": 0.0}
    rates: Any = {"flight.x": 0.0, "flight.y": -0.5 * omega * L, "flight.z": 0.0}
    for joint, rate in ("flight", spin), ("first", omega - spin), ("second", second - omega):
        place[f"{joint}.orientation"], rates[f"{joint}.angular_velocity"] = upright, (0.0, 0.0, rate)
    return model, mbd.assemble(model, place, rates)


def judge_dumbbell(integrator: Any) -> Outcome:
    """The circle, the tension M ω² L/2, energy and length with all joints cut; a tree, or an error that says why."""
    numbers = definition(P5)["definition"]
    M, L, omega, until, dt = (numbers[name] for name in ("M", "L", "omega", "until", "dt"))
    run = mbd.simulate(*dumbbell(), integrator, dt=dt, until=until, store=10)
    circle = 0.5 * L * np.stack([np.cos(omega * run.t), np.sin(omega * run.t), 0.0 * run.t], -1)
    off = size(run["other.center"] - circle)
    length = np.linalg.norm(run["other.center"] - run["one.center"], axis=1) - L
    tension = np.linalg.norm(run["second.reaction_force"], axis=1) / (0.5 * M * omega**2 * L) - 1.0
    phase = PHASE_FACTOR * (omega * dt) ** 2 * omega * until if integrator.order() == 2 else ROUND_OFF
    figures = [
        Figure("error of the place [m]", off, 0.5 * L * phase),
        Figure("change of the length [m]", size(length), 1e-12),
        Figure("error of the tension, relative [-]", size(tension), max(phase, 1e-8)),
        Figure("change of the energy, relative [-]", float(np.ptp(run.energy.total) / run.energy.total[0]), phase),
    ]
    if getattr(integrator, "formulation", "ggl") != "index3":
        tree = mbd.simulate(*dumbbell("auto"), integrator, dt=dt, until=0.1, on_failure="return")
        wrong = float(np.ptp(tree.energy.total) / tree.energy.total[0]) if tree.success else 0.0
        figures.append(Figure("change of the energy of a tree that runs, relative [-]", wrong, phase))
    return Outcome(figures, [Curve("x of the other body", run.t, run["other.center"][:, 0], y_label="[m]")])


CASES = (
    HardCase(
        P5, "A link of a millionth of the mass of its neighbours carries their whole load; its length stays.",
        judge_dumbbell, EVERY,
    ),
)  # fmt: skip
