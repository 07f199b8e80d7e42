"""Bodies at rest on more contacts than statics determines: j11 and j11b."""

from collections.abc import Sequence
from typing import Any

import numpy as np

import mbd
from mbd.hardcases.case import ROUND_OFF, Curve, Figure, HardCase, Outcome, definition
from mbd.hardcases.convergence import EPS, force_floor
from mbd.hardcases.references import quantity, size
from mbd.hardcases.schemes import EVERY

J11, J11B = "j11-four-legged-table", "j11b-block-two-contacts"
UNTIL, STEPS = 10.0, (1e-2, 1e-3)
"""Time of rest, and the steps it is tried with [s]."""


def table(
    case: str = J11, order: Sequence[int] = range(4), center: Sequence[float] | None = None
) -> tuple[mbd.Model, mbd.State]:
    """A square table that may rise and tilt, on four contacts 'leg 0' … 'leg 3', given to the model in some order.

    center : (x, z) of its mass center; that of the case if None
    """
    numbers = definition(case)["definition"]
    half, (x_c, z_c) = 0.5 * numbers["side"], numbers["com_offset"] if center is None else center
    corners = [(-half, -half), (half, -half), (half, half), (-half, half)]
    model = mbd.Model("table", gravity=(0.0, -numbers["g"], 0.0))
    stem = mbd.PointMass("stem", mass=0.0)
    inertia = numbers["m"] * numbers["side"] ** 2 / 12.0
    top = mbd.RigidBody("top", numbers["m"], (inertia, 2.0 * inertia, inertia), center=(x_c, 0.0, z_c))
    model.connect(
        mbd.Prismatic("lift", model.ground.origin, stem.origin, axis=(0.0, 1.0, 0.0)),
        mbd.Universal("tilt", stem.origin, top.origin),
    )
    for k in order:
        x, z = corners[k]
        model.constrain(mbd.Unilateral(f"leg {k}", mbd.height(top.point(x, 0.0, z, name=f"foot {k}"))))
    return model, mbd.assemble(model, closed=[f"leg {k}" for k in order])


def block(third: bool, case: str = J11B) -> tuple[mbd.Model, mbd.State]:
    """A block in the plane on its two corners, or on a third point too: contacts 'point 0', 'point 1', 'point 2'."""
    numbers = definition(case)["definition"]
    places = [*numbers["corners_x"], *([numbers["third_x"]] if third else [])]
    model = mbd.Model("block", gravity=(0.0, -numbers["g"], 0.0))
    width = max(places) - min(places)
    body = mbd.RigidBody("block", numbers["m"], numbers["m"] * width**2 / 12.0, center=(numbers["com_x"], 0.2, 0.0))
    model.connect(mbd.Planar("flight", model.ground.origin, body.origin))
    for k, x in enumerate(places):
        model.constrain(mbd.Unilateral(f"point {k}", mbd.height(body.point(x, 0.0, name=f"corner {k}"))))
    return model, mbd.assemble(model, closed=[f"point {k}" for k in range(len(places))])


def judge_table(integrator: Any) -> Outcome:
    """Rest without drift; the legs share the weight with least norm, whatever their order; a note says so."""
    numbers = definition(J11)["definition"]
    total, least = quantity(J11, "sum of leg forces"), quantity(J11, "minimum-norm leg forces")
    admissible, still = quantity(J11, "admissible range"), quantity(J11, "acceleration of the table")
    half, (x_c, z_c) = 0.5 * numbers["side"], numbers["com_offset"]
    arms = np.array([(-half, -half), (half, -half), (half, half), (-half, half)]) - (x_c, z_c)
    weight, low, high = numbers["m"] * numbers["g"], *admissible.value
    worst: dict[str, float] = {}
    runs = []
    for order in (0, 1, 2, 3), (3, 1, 0, 2):
        model, start = table(order=order)
        for dt in STEPS:
            run = mbd.simulate(model, start, integrator, dt=dt, until=UNTIL)
            runs.append(run)
            forces = np.array([run[f"leg {k}.force"] for k in range(4)])
            floor = _floor(integrator, dt, weight, numbers["m"], half)
            found = {
                "error of the sum of leg forces over its round-off": np.abs(forces.sum(axis=0) - total.value) / floor,
                "moment of the leg forces over its round-off": np.abs(arms.T @ forces) / (floor * half),
                "error of the leg forces over its round-off": np.abs(forces - least.value[:, None]) / floor,
                "acceleration over its round-off": np.abs(run.record.a - still.value) * numbers["m"] / floor,
                "first leg outside of its admissible range [N]": np.maximum(low - forces[0], forces[0] - high),
                "drift [m, rad]": np.abs(run.record.q - run.record.q[0]),
            }
            for what, value in found.items():
                worst[what] = max(worst.get(what, 0.0), float(np.max(value)))
    limits = {what: 1.0 for what in worst} | {"first leg outside of its admissible range [N]": 0.0,
                                              "drift [m, rad]": ROUND_OFF}  # fmt: skip
    return Outcome(
        [
            *(Figure(what, worst[what], limit) for what, limit in limits.items()),
            Figure("switches of legs", sum(len(run.events) for run in runs), 0),
            Figure(
                "runs that do not say that the forces are not unique",
                sum(not _notes_redundancy(run) for run in runs),
                0,
            ),
        ],
        [Curve("force of the first leg [N]", runs[0].time, runs[0]["leg 0.force"])],
    )


def judge_block(integrator: Any) -> Outcome:
    """Rest on two corners with determinate forces, on three points with those of least norm, told only there."""
    numbers = definition(J11B)["definition"]
    weight, curves = numbers["m"] * numbers["g"], []
    off, drift, resultant, events, wrong = 0.0, 0.0, 0.0, 0, 0
    for third, name in (False, "two contacts"), (True, "three contacts"):
        reference = quantity(J11B, name)
        model, start = block(third)
        for dt in STEPS:
            run = mbd.simulate(model, start, integrator, dt=dt, until=UNTIL)
            forces = np.array([run[f"point {k}.force"] for k in range(len(reference.value))])
            floor = _floor(integrator, dt, weight, numbers["m"], float(np.ptp(numbers["corners_x"])))
            off = max(off, size(forces - reference.value[:, None]) / floor)
            resultant = max(resultant, size(forces.sum(axis=0) - weight) / floor)
            drift = max(drift, size(run.record.q - run.record.q[0]))
            events += len(run.events)
            wrong += _notes_redundancy(run) is not third
            curves.append(Curve(f"force of the first point, {name} [N]", run.time, forces[0]))
    return Outcome(
        [
            Figure("error of the forces over its round-off [-]", off, 1.0),
            Figure("error of their sum over its round-off [-]", resultant, 1.0),
            Figure("drift [m, rad]", drift, ROUND_OFF),
            Figure("switches of contacts", events, 0),
            Figure("runs that tell a redundancy that is none, or do not tell one that is", wrong, 0),
        ],
        curves[:1],
    )


def _floor(integrator: Any, dt: float, weight: float, mass: float, length: float) -> float:
    """Round-off of forces at rest, where the speeds that cancel are those that gravity gives within a step [N]."""
    return 100.0 * EPS * weight + force_floor(integrator, dt, UNTIL / dt, mass, length, weight / mass * dt)


def _notes_redundancy(run: Any) -> bool:
    """Whether a note says that rows are redundant and their multipliers not unique."""
    return any("redundant" in note and "multipliers" in note and "not" in note for note in run.stats["notes"])


CASES = (
    HardCase(J11, "The table rests; its legs share the weight with least norm, in any order, and that is reported.",
             judge_table, EVERY),
    HardCase(J11B, "The block rests on two points and on three, with determinate forces and those of least norm.",
             judge_block, EVERY),
)  # fmt: skip
