"""Dry friction in a joint (a4), friction that follows the force in a pin (a4c), and a rod that jams (j13)."""

import math
from functools import cache
from typing import Any

import numpy as np

import mbd
from mbd.hardcases.case import Curve, Figure, Outcome, hard_case
from mbd.hardcases.convergence import study
from mbd.hardcases.references import numbers, published, size
from mbd.joints.losses import Loss


# pendulums ----------------------------------------------------------------------------------------------------------
@cache
def pendulum(mass: float, length: float, g: float, loss: Loss) -> mbd.Model:
    """A point mass on a massless rod, with friction in its hinge."""
    model = mbd.Model("pendulum", gravity=(0.0, -g, 0.0))
    rod = mbd.Link("rod", mass=mass, length=length, center=length)
    model.connect(mbd.Revolute("hinge", model.ground.origin, rod.start, loss=loss))
    return model


def swing(model: mbd.Model, angle: float, scheme: Any, dt: float, until: float) -> Any:
    """The run of a pendulum let go."""
    return mbd.simulate(model, mbd.assemble(model, position={"hinge.angle": angle}), scheme, dt=dt, until=until)


def turning_points(run: Any) -> tuple[Any, Any]:
    """The times and angles at which a pendulum turns, with those of its start."""
    turns = [event for event in run.events if event.kind in ("slipped", "stuck")]
    times = np.array([run.time[0], *(event.time for event in turns)])
    return times, run["hinge.angle"][[0, *(event.row for event in turns)]]


def turning_figures(
    model: mbd.Model, angle: float, scheme: Any, wanted: tuple[Any, Any], until: float
) -> tuple[list[Figure], Any]:
    """Number, times and angles of turning, over halved steps; the run at the finest."""
    times, angles = wanted

    def errors(run: Any) -> dict[str, float]:
        found, turned = turning_points(run)
        if len(found) != len(times):
            return {}
        return {
            "error of the turning times [s]": size(found - times),
            "error of the turning angles [rad]": size(turned - angles),
        }

    found = study(lambda dt: swing(model, angle, scheme, dt, until), errors, 0.01, scheme, 2)
    count = max(abs(len(turning_points(run)[0]) - len(times)) for run in found.runs)
    figures = [
        Figure("turning points more or fewer than there are [-]", float(count), 0.0),
        *found.figures({"error of the turning times [s]": 5e-4, "error of the turning angles [rad]": 5e-5}),
    ]
    return figures, found.finest


def friction_figures(run: Any, limit: Any) -> list[Figure]:
    """Friction within its limit, against the motion, and its loss as its law says.

    limit : the largest friction at every row
    """
    friction, rate = run["hinge.friction"], run["hinge.rate"]
    work = run.energy["hinge friction"]
    spent = np.concatenate([[0.0], np.cumsum(0.5 * (np.abs(rate) * limit)[1:] * np.diff(run.time))])
    spent[1:] += np.cumsum(0.5 * (np.abs(rate) * limit)[:-1] * np.diff(run.time))
    largest = size(limit)
    return [
        Figure("friction beyond its limit, relative [-]", float(np.max(np.abs(friction) - limit)) / largest, 1e-9),
        Figure("power that friction feeds in, relative [-]", float(np.max(friction * rate)) / largest, 1e-9),
        Figure("loss beside ∫ limit |rate| dt, relative [-]", abs(work[-1] + spent[-1]) / spent[-1], 1e-4),
        Figure("numerical energy at the finest step, relative [-]", size(run.energy.numerical) / spent[-1], 1e-4),
    ]


def coulomb(id: str, scheme: Any) -> Outcome:
    """A finite number of swings, then rest away from the vertical, without creep."""
    given = numbers(id)
    inertia, weight, torque = given["J"], given["K_mgd"], given["tau_friction"]
    model = pendulum(inertia, 1.0, weight / inertia, mbd.Coulomb(torque))
    wanted = (published(id, "turning times"), published(id, "turning angles"))
    until = float(wanted[0][-1]) + 3.0
    figures, run = turning_figures(model, given["theta0"], scheme, wanted, until)
    rest = np.flatnonzero(run.time >= run.events[-1].time)[1:] if run.events else np.zeros(0, dtype=int)
    angle = run["hinge.angle"][rest]
    held = run["hinge.friction"][rest]
    figures += [
        Figure(
            "half swings more or fewer than there are [-]", abs(len(run.events) - published(id, "number of half")), 0.0
        ),
        Figure("creep at rest [rad]", size(angle - angle[0]) if len(angle) else math.nan, 1e-12),
        Figure("speed at rest [rad/s]", size(run["hinge.rate"][rest]), 1e-9),
        Figure("error of the angle at rest [rad]", size(angle - published(id, "rest angle")), 5e-5),
        Figure("friction at rest beside the weight's torque [N m]", size(held - weight * np.sin(angle)), 1e-9),
        *friction_figures(run, np.full(len(run.time), torque)),
    ]
    curves = [
        Curve("angle", run.time, run["hinge.angle"], y_label="angle [rad]"),
        Curve("friction", run.time, run["hinge.friction"], y_label="torque [N m]"),
    ]
    return Outcome(figures, curves)


def loaded(id: str, scheme: Any) -> Outcome:
    """Friction μ r N of the whole force N in the pin, which it is itself a part of."""
    given = numbers(id)
    m, L, g, mu, radius = (given[name] for name in ("m", "L", "g", "mu", "pin_radius"))
    model = pendulum(m, L, g, mbd.PinFriction(mu, radius))
    wanted = (published(id, "turning times"), published(id, "turning angles"))
    until = float(wanted[0][-1]) + 0.05
    figures, run = turning_figures(model, given["theta0"], scheme, wanted, until)
    force = np.linalg.norm(run["hinge.reaction_force"], axis=-1)
    figures += friction_figures(run, mu * radius * force)
    curves = [
        Curve("angle", run.time, run["hinge.angle"], y_label="angle [rad]"),
        Curve("force in the pin", run.time, force, y_label="force [N]"),
    ]
    return Outcome(figures, curves)


# the rod ------------------------------------------------------------------------------------------------------------
@cache
def rod(L: float, m: float, g: float, mu: float) -> mbd.Model:
    """A uniform rod along its own x whose lower end slides on the ground."""
    model = mbd.Model("rod", gravity=(0.0, -g, 0.0))
    body = mbd.RigidBody("rod", mass=m, inertia=m * L * L / 12.0)
    model.connect(mbd.Planar("place", model.ground.origin, body.origin))
    model.constrain(mbd.Unilateral("tip", mbd.touchdown(body.point(-0.5 * L, 0.0)), friction=mu))
    return model


def slide(id: str, mu: float, speed: float, scheme: Any, *, until: float = 0.1) -> Any:
    """The run of the rod pushed along the ground at its angle, whatever comes of it."""
    given = numbers(id)
    L, angle = given["L"], given["theta"]
    model = rod(L, given["m"], given["g"], mu)
    # the tip stays on the ground: its speed is (speed, 0)
    start = mbd.assemble(
        model,
        position={"place.y": 0.5 * L * math.sin(angle), "place.angle": angle},
        velocity={
            "place.x": speed,
            "place.y": 0.0,
            "place.angle": 0.0,
        },
        closed=["tip"],
    )
    return mbd.simulate(model, start, scheme, dt=1e-3, until=until, on_failure="return")


def push_of(id: str, mu: float, sign: float) -> float:
    """The force of the ground on the rod at rest but for a sliding of this sign, −b/A [N]."""
    given = numbers(id)
    c, s = math.cos(given["theta"]), math.sin(given["theta"])
    return float(given["m"] * given["g"] / (1.0 + 3.0 * c * (c + sign * mu * s)))


def jamming(id: str, scheme: Any) -> Outcome:
    """Where a push makes the sliding tip approach an impulse stops it; elsewhere the force is that of the rod."""
    given = numbers(id)
    critical, mu = published(id, "critical"), given["mu"]
    found = slide(id, mu, 1.0, scheme, until=1e-3)["tip.force"][0] * published(id, "A for the two")[0]
    figures = [Figure("A of the reference times the force over m g, less 1 [-]",
                      abs(found / (given["m"] * given["g"]) - 1.0), 1e-9)]  # fmt: skip
    for sign, much in ((1.0, mu), (1.0, 0.999 * critical), (-1.0, 0.999 * critical), (-1.0, 0.5 * critical)):
        run = slide(id, much, sign, scheme, until=1e-3)
        wanted = push_of(id, much, sign)
        found = run["tip.force"][0] if len(run.time) else math.nan
        figures.append(Figure(f"μ = {much:.4g}, sliding {sign:+.0f}: force beside −b/A, relative [-]",
                              abs(found / wanted - 1.0), 1e-9))  # fmt: skip
    for much in (mu, 1.001 * critical):
        run = slide(id, much, -1.0, scheme)
        first = run.events[0] if run.events else None
        is_stopped = first is not None and first.kind == "stuck" and bool(np.any(np.asarray(first.impulse)[:1] > 0.0))
        figures.append(
            Figure(f"μ = {much:.4g}, a slide without a force that no impulse stops [-]", float(not is_stopped), 0.0)
        )
        figures.append(Figure(f"μ = {much:.4g}, largest pull in a row [N]",
                              float(max(-run["tip.force"].min(), 0.0)), 0.0))  # fmt: skip
    shares = 1.0 - np.logspace(0.0, -3.0, 13)
    forces = [float(slide(id, share * critical, -1.0, scheme, until=1e-3)["tip.force"][0]) for share in shares]
    curve = Curve("force as friction nears the jam", 1.0 - shares, forces, "1 − μ/critical μ", "force [N]", True)
    return Outcome(figures, [curve])


CASES = (
    hard_case(
        "a4-coulomb-pendulum",
        "The pendulum swings as often as the friction lets it, then rests away from the vertical without creeping.",
        coulomb,
    ),
    hard_case(
        "a4c-pin-friction-load-dependent",
        "The friction follows the whole force in the pin, its own share included; angles and times of turning are met.",
        loaded,
    ),
    hard_case(
        "j13-painleve-rod",
        "Where no contact force is consistent the run ends and says so; just before, the force is finite and exact.",
        jamming,
    ),
)
