"""Bodies that turn freely in space: p1 to p4."""

from collections.abc import Sequence
from typing import Any

import numpy as np

import mbd
from mbd.equal import EQUAL_RTOL
from mbd.hardcases.case import Curve, Figure, HardCase, Outcome, definition
from mbd.hardcases.references import size
from mbd.joints.quaternions import rotation_of

P1, P2, P3, P4 = "p1-free-body-1000s", "p2-gimbal-lock", "p3-top-through-vertical", "p4-coin-near-flat"
ADAPTIVE = ("RadauIIA", "RungeKutta853")
SECOND_ORDER = {"schemes": "those of order two would take some ten million steps to keep nine digits"}


def _numbers(case: str) -> Any:
    return definition(case)["definition"]


def _change(values: Any) -> float:
    """The largest change over the size of a scalar or vector that should stay."""
    size = float(np.max(np.abs(values[0])))
    return float(np.max(np.abs(values - values[0]))) / size


def _rotations(run: Any, joint: str) -> Any:
    """R of all rows (rows, 3, 3)."""
    found: Any = rotation_of(list(np.moveaxis(run[f"{joint}.orientation"], -1, 0)))
    return np.moveaxis(np.array([[part + 0.0 * run.t for part in row] for row in found]), -1, 0)


def free_body() -> tuple[mbd.Model, mbd.State]:
    """Three moments of inertia, near its intermediate axis."""
    numbers = _numbers(P1)
    model = mbd.Model("free body", gravity=(0.0, 0.0, 0.0))
    body = mbd.RigidBody("body", 1.0, tuple(numbers["I"]))
    model.connect(mbd.Spherical("ball", model.ground.origin, body.origin))
    return model, mbd.assemble(model, velocity={"ball.angular_velocity": numbers["omega"]})


def judge_free_body(integrator: Any) -> Outcome:
    """Energy and the vector of angular momentum over 1000 s."""
    numbers = _numbers(P1)
    run = mbd.simulate(*free_body(), integrator, tol=EQUAL_RTOL, until=numbers["until"])
    own = np.array(numbers["I"]) * run["ball.angular_velocity"]
    momentum = np.einsum("tij,tj->ti", _rotations(run, "ball"), own)
    over = int(np.count_nonzero(np.diff(np.sign(own[:, 1]))))
    figures = [
        Figure("change of the energy [-]", _change(run.energy.kinetic), EQUAL_RTOL),
        Figure("change of the angular momentum [-]", _change(momentum), EQUAL_RTOL),
        Figure("turns over that are missing", numbers["turns over"] - over, 0.0),
    ]
    return Outcome(figures, [Curve("ω about the intermediate axis", run.t, own[:, 1], y_label="[kg m²/s]")])


def gimbal(axis: Sequence[float], angle: float) -> tuple[mbd.Model, mbd.State]:
    """A pendulum on a ball joint whose frame on the ground is turned: the same motion whatever the frame."""
    numbers = _numbers(P2)
    model = mbd.Model("gimbal", gravity=(0.0, -9.81, 0.0))
    body = mbd.RigidBody("body", 1.0, tuple(numbers["I"]), center=tuple(numbers["center"]))
    x, y, z = numbers["center"]
    body.point(x, y, z, name="tip")
    frame = model.ground.origin.turned(angle, axis) if angle else model.ground.origin
    model.connect(mbd.Spherical("ball", frame, body.origin))
    begin: Any = ((-axis[0], -axis[1], -axis[2]), angle) if angle else (1.0, 0.0, 0.0, 0.0)
    return model, mbd.assemble(model, {"ball.orientation": begin}, {"ball.angular_velocity": numbers["omega"]})


def judge_gimbal(integrator: Any) -> Outcome:
    """Places of the tip, from frames in which Euler angles are singular and others."""
    numbers = _numbers(P2)
    names = [f"body.tip.{axis}" for axis in "xyz"]
    found, energies = [], []
    for axis, angle in [((0.0, 0.0, 1.0), 0.0), *((tuple(each[0]), each[1]) for each in numbers["frames"])]:
        run = mbd.simulate(*gimbal(axis, angle), integrator, dt=numbers["dt"], until=numbers["until"])
        found.append(np.stack([run[name] for name in names], -1))
        energies.append(float(np.ptp(run.energy.total)) / float(np.max(run.energy.kinetic)))
    apart = max(size(each - found[0]) for each in found)
    figures = [
        Figure("difference of places by the frame [m]", apart, EQUAL_RTOL),
        Figure("change of the energy over its kinetic part [-]", max(energies), numbers["energy"]),
    ]
    return Outcome(figures, [Curve("height of the tip", run.t, found[0][:, 1], y_label="[m]")])


def top() -> tuple[mbd.Model, mbd.State]:
    """A slow top whose momenta about the vertical and its own axis are equal, thrown up: it passes the vertical."""
    numbers = _numbers(P3)
    model = mbd.Model("top", gravity=(0.0, 0.0, -9.81))
    body = mbd.RigidBody("body", 1.0, tuple(numbers["I"]), center=(0.0, 0.0, numbers["arm"]))
    body.point(0.0, 0.0, 1.0, name="axis")
    model.connect(mbd.Spherical("ball", model.ground.origin, body.origin))
    theta, spin, rise = numbers["theta"], numbers["spin"], numbers["rise"]
    across, along = numbers["I"][0] + numbers["arm"] ** 2, numbers["I"][2]  # about the ball
    momentum = along * spin
    sideways = momentum * (1.0 - np.cos(theta)) / (across * np.sin(theta))  # so that L_z is the momentum too
    rates = (-rise, sideways, spin)
    return model, mbd.assemble(model, {"ball.orientation": ((1, 0, 0), theta)}, {"ball.angular_velocity": rates})


def judge_top(integrator: Any) -> Outcome:
    """Energy, momenta about the vertical and the axis; it comes to the vertical."""
    numbers = _numbers(P3)
    run = mbd.simulate(*top(), integrator, tol=EQUAL_RTOL, until=numbers["until"])
    own = np.array(numbers["I"]) + numbers["arm"] ** 2 * np.array([1.0, 1.0, 0.0])
    momentum = np.einsum("tij,tj->ti", _rotations(run, "ball"), own * run["ball.angular_velocity"])
    times = np.linspace(0.0, numbers["until"], 20_001)
    nearest = 1.0 - float(np.max(run.at(times)["body.axis.z"]))
    size = float(np.max(run.energy.kinetic))
    figures = [
        Figure("change of the energy [-]", float(np.ptp(run.energy.total)) / size, EQUAL_RTOL),
        Figure("change of the momentum about the vertical [-]", _change(momentum[:, 2]), EQUAL_RTOL),
        Figure("change of the spin [-]", _change(run["ball.angular_velocity"][:, 2]), EQUAL_RTOL),
        Figure("distance of the axis from the vertical, 1 − cos θ [-]", nearest, numbers["near"]),
    ]
    return Outcome(figures, [Curve("height of the axis", run.t, run["body.axis.z"], y_label="cos θ [-]")])


def coin() -> tuple[mbd.Model, mbd.State]:
    """A thin disk in a steady turn, nearly flat."""
    numbers = _numbers(P4)
    R, lean, turn, g = (numbers[name] for name in ("R", "lean", "turn", "g"))
    model = mbd.Model("coin", gravity=(0.0, -g, 0.0))
    body = mbd.RigidBody("disk", 1.0, (R**2 / 4, R**2 / 4, R**2 / 2))
    model.connect(mbd.Free("float", model.ground.origin, body.origin))
    model.constrain(mbd.Bilateral("edge", mbd.disk_touchdown(body.origin, R, (0, 0, 1))))
    model.constrain(mbd.Rolling("grip", body.origin, R, axis=(0, 0, 1)))
    spin = np.sin(lean) * (5 * R * turn**2 * np.cos(lean) + 4 * g) / (6 * R * turn * np.cos(lean))
    rates = (0.0, turn * np.cos(lean), spin - turn * np.sin(lean))
    place = {"float.orientation": ((1, 0, 0), lean), "float.x": 0.0, "float.z": 0.0}
    return model, mbd.assemble(model, place, {"float.angular_velocity": rates})


def judge_coin(integrator: Any) -> Outcome:
    """Its height stays, and its energy."""
    numbers = _numbers(P4)
    run = mbd.simulate(*coin(), integrator, tol=EQUAL_RTOL, until=numbers["until"])
    height = run["float.y"]
    figures = [
        Figure("change of the height over itself [-]", _change(height), numbers["steady"]),
        Figure("change of the energy [-]", float(np.ptp(run.energy.total)) / float(run.energy.total[0]), EQUAL_RTOL),
        Figure("gap of the edge [m]", float(run.violation.length), 1e-10),
    ]
    return Outcome(figures, [Curve("height of the center", run.t, height, y_label="[m]")])


CASES = (
    HardCase(
        P1, "A free body turns over for 1000 s with its energy and momentum within 1e-9.", judge_free_body, ADAPTIVE,
        notes=SECOND_ORDER,
    ),
    HardCase(
        P2, "No frame of a ball joint is singular: the motion is the same from each.", judge_gimbal,
        ("HHT", "generalized-alpha", "Newmark", "RadauIIA", "RungeKutta853"),
        notes={"index 3": "no rows act, so that the formulation makes no difference"},
    ),
    HardCase(P3, "A top passes through the vertical with its energy and both momenta.", judge_top, ADAPTIVE,
             notes=SECOND_ORDER),
    HardCase(P4, "A coin three degrees from flat rolls on in its steady turn.", judge_coin, ADAPTIVE,
             notes=SECOND_ORDER),
)  # fmt: skip
