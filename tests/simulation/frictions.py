"""Scenes with dry friction, and its laws along any run."""

import numpy as np

import mbd
from mbd.compile.mechanisms import mechanism_of
from tests.helpers import one_body
from tests.simulation.mechanisms import G


def block(mu: float | None, slope: float = 0.0, reverse: bool = False) -> mbd.Model:
    """A block that cannot turn on a plane with the slope 'tilt', its contact 'foot'; downhill is 'place.x' > 0."""
    model, body = one_body(mbd.PointMass("block", mass=2.0), mbd.Translation, "place", gravity=mbd.on_slope(slope, G))
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(body.origin), friction=mu))
    return model


def brick(
    mu: float, restitution: float = 0.0, order=(0, 1, 2, 3), slope: float = 0.0, height: float = 0.15
) -> mbd.Model:
    """A box 0.5 m wide with contacts at its four corners."""
    model = mbd.Model("brick", gravity=mbd.on_slope(slope, G))
    body = mbd.RigidBody("box", mass=2.0, inertia=0.2)
    model.connect(mbd.Planar("place", model.ground.origin, body.origin))
    corners = [
        ("left", -0.25, -height),
        ("right", 0.25, -height),
        ("top left", -0.25, height),
        ("top right", 0.25, height),
    ]
    feet = [
        mbd.Unilateral(name, mbd.touchdown(body.point(x, y)), restitution=restitution, friction=mu)
        for name, x, y in corners
    ]
    model.constrain(*(feet[k] for k in order))
    return model


def rod(mu: float | None, restitution: float = 0.0) -> mbd.Model:
    """A uniform rod of 1 kg and 1 m along its own x, whose lower end is the contact 'tip'."""
    model, body = one_body(mbd.RigidBody("rod", mass=1.0, inertia=1.0 / 12.0), mbd.Planar, "place")
    model.constrain(mbd.Unilateral("tip", mbd.touchdown(body.point(-0.5, 0.0)), restitution=restitution, friction=mu))
    return model


def driven(force: float = 3.0) -> mbd.Model:
    """A mass of 1 kg on a spring of 20 N/m and a dry rail, driven by 4 N sin 3t."""
    model = mbd.Model("driven", gravity=(0.0, 0.0, 0.0))
    mass = mbd.PointMass("mass", mass=1.0)
    model.connect(mbd.Prismatic("rail", model.ground.origin, mass.origin, loss=mbd.Coulomb(force)))
    model.apply(
        mbd.Spring("spring", model.ground.point(-2.0, 0.0), mass.origin, stiffness=20.0, length=2.0),
        mbd.Applied("drive", mass.origin, force=(lambda t: 4.0 * mbd.sin(3.0 * t), 0.0, 0.0)),
    )
    return model


def four_bar(loss, cut="auto") -> mbd.Model:
    """A crank-rocker with a loss at every pin."""
    model = mbd.Model("four-bar", cut=cut)
    lengths = (0.3, 0.9, 0.7)
    bars = [mbd.Link(f"bar {k}", 1.0, length, length / 2.0, length**2 / 12.0) for k, length in enumerate(lengths)]
    ends = [model.ground.origin, *(bar.end for bar in bars)]
    starts = [*(bar.start for bar in bars), model.ground.point(0.8, 0.0)]
    for k, (a, b) in enumerate(zip(ends, starts, strict=True)):
        model.connect(mbd.Revolute(f"pin {k}", a, b, loss=loss))
    return model


def stops(run) -> list[tuple[str, str]]:
    """(kind, name) of the events of friction."""
    return [(event.kind, event.name) for event in run.events if event.kind in ("stuck", "slipped")]


def phases(run, friction) -> np.ndarray:
    """1 where it sticks after its first event, by the events of a run; 0 where it slides or is off."""
    name = friction.name
    kinds = {"stuck": 1, "slipped": 0, "opened": 0}
    found = np.zeros(len(run.time), dtype=int)
    for event in run.events:
        if event.name == name and event.kind in kinds:
            found[event.row :] = kinds[event.kind]
    return found


def check_friction(model: mbd.Model, run, slack: float = 1e-6, creep: float = 1e-9) -> None:
    """``|λ_T| ≤ limit`` always, ``= limit`` while it slides; it takes energy out, and what sticks does not move.

    slack : how far multipliers of one step may miss their law, relative to the largest force of the row
    creep : the fastest that what sticks may move; index 3 holds positions only
    """
    equations, record = mechanism_of(model).equations, run.record
    nodes = [node for friction in equations.frictions for node in (friction.rate, friction.limit)]
    values = iter(run.columns.evaluate(nodes, run.columns.rows))
    size = np.maximum(1.0, np.abs(record.lam).max(axis=1, initial=0.0))
    for friction in equations.frictions:
        rate, limit = (np.broadcast_to(next(values), run.time.shape) for _ in range(2))
        along = record.lam[:, friction.row]
        on = np.ones(len(along), dtype=bool) if friction.contact < 0 else record.closed[:, friction.contact] > 0
        assert not along[~on].any(), f"{friction.name}: friction without contact"
        assert np.all(np.abs(along[on]) <= (limit + slack * size)[on]), f"{friction.name}: beyond its limit"
        assert np.all((along * rate)[on] >= -slack * size[on]), f"{friction.name}: feeds energy in"
        slides = on & (np.abs(rate) > max(1e-5, creep))
        assert np.all(np.abs(np.abs(along) - limit)[slides] <= slack * size[slides]), (
            f"{friction.name}: slides with less"
        )
        assert np.all(np.abs(rate[phases(run, friction) == 1]) < creep), f"{friction.name}: moves while it sticks"
