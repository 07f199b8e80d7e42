"""Effects of no strength, beside the hard case j17: removed by name, given a strength, as run-time inputs."""

from collections.abc import Callable

import numpy as np
import pytest

import mbd
from mbd.integrators.family import NewmarkFamily
from tests.cases.schemes import SCHEMES, WITH_ROWS, name_of
from tests.problems import case

A2, J17 = case("a2-double-pendulum"), case("j17-effects-off")
START = [A2.start[name] for name in ("theta1", "theta2", "thetadot1", "thetadot2")]
WEAK = ("shoulder loss.coefficient", "elbow loss.torque", "motor.torque", "band.stiffness", "elastic.stiffness")
"""Strengths of the effects that are there with the value 0, as run-time inputs."""


def arm(contacts: bool = False, weak: bool = False, tunable: tuple[str, ...] = (), cut: str = "auto") -> mbd.Model:
    """The double pendulum of case a2, with what never acts."""
    model = mbd.Model("arm", tunable=tunable, cut=cut)
    upper = mbd.Link("upper", mass=1.0, length=1.0, center=1.0)
    lower = mbd.Link("lower", mass=1.0, length=1.0, center=1.0)
    losses = (mbd.Viscous(0.0), mbd.Coulomb(0.0, smoothing=0.01)) if weak else (None, None)
    shoulder = mbd.Revolute("shoulder", model.ground.origin, upper.start, loss=losses[0])
    elbow = mbd.Revolute("elbow", upper.end, lower.start, loss=losses[1])
    model.connect(shoulder, elbow)
    if contacts:
        model.constrain(
            mbd.Unilateral("stop", mbd.extension(elbow, offset=-50.0)),
            mbd.Unilateral("floor", mbd.touchdown(lower.end, mbd.Plane(offset=-5.0)), friction=0.0),
            mbd.Penalty("rubber", mbd.flexion(elbow, offset=-60.0), stiffness=1e3, damping=2.0),
        )
    if weak:
        model.apply(
            mbd.Motor("motor", shoulder, torque=0.0),
            mbd.TorsionSpring("band", elbow, stiffness=0.0),
            mbd.Spring("elastic", model.ground.point(3.0, 0.0), lower.end, stiffness=0.0),
        )
    return model


def swing(model: mbd.Model, scheme: NewmarkFamily, dt: float = 1e-3) -> mbd.Trajectory:
    angles = (
        ("upper floating.angle", "lower floating.angle") if model.cut == "all" else ("shoulder.angle", "elbow.angle")
    )
    values = (START[0], START[1] if model.cut == "all" else START[1] - START[0])
    start = mbd.assemble(model, position=dict(zip(angles, values, strict=True)))
    return mbd.simulate(model, start, scheme, dt=dt, until=5.0)


def bits(run: mbd.Trajectory) -> tuple[bytes, ...]:
    record = run.record
    return tuple(part.tobytes() for part in (record.time, record.q, record.v, record.a))


@pytest.mark.parametrize("scheme", WITH_ROWS, ids=name_of)
def test_effects_of_no_strength_cost_no_operation_and_change_no_bit(scheme: NewmarkFamily) -> None:
    """An exact zero given at build is folded away: the same equations."""
    assert bits(swing(arm(weak=True, cut="all"), scheme)) == bits(swing(arm(cut="all"), scheme))
    bare, weak = arm().cost(), arm(weak=True).cost()
    assert (weak.newton, weak.residual, weak.accelerations, weak.guards) == (
        bare.newton, bare.residual, bare.accelerations, bare.guards,
    )  # fmt: skip
    assert list(weak.effects) == list(bare.effects) == ["gravity"]


@pytest.mark.parametrize("scheme", SCHEMES, ids=name_of)
def test_effects_whose_force_is_zero_in_this_run_change_no_bit(scheme: NewmarkFamily) -> None:
    """The same effects as run-time inputs that happen to be zero: computed, listed, but without a trace."""
    assert bits(swing(arm(weak=True, tunable=WEAK), scheme)) == bits(swing(arm(), scheme))


def test_the_cost_lists_each_effect_and_what_each_contact_adds_while_closed() -> None:
    bare, full = arm().cost(), arm(contacts=True, weak=True, tunable=WEAK).cost()
    assert set(full.effects) == {"gravity", "shoulder loss", "elbow loss", "motor", "band", "elastic"}
    assert all(operations > 0 for operations in full.effects.values())
    assert set(full.contacts) == {"stop", "floor", "rubber"}
    assert all(operations > 0 for operations in full.contacts.values())
    assert (bare.guards, arm(contacts=True).cost().newton) == (0, bare.newton)
    listing = repr(full)
    assert all(name in listing for name in (*full.effects, *full.contacts))


def test_removing_an_effect_by_name_gives_the_model_that_never_had_it() -> None:
    full = arm(contacts=True, weak=True, tunable=WEAK)
    bare = full.without("shoulder loss", "elbow loss", "motor", "band", "elastic", "stop", "floor", "rubber")
    assert repr(bare.cost()) == repr(arm().cost())
    assert bits(swing(bare, mbd.HHT())) == bits(swing(arm(), mbd.HHT()))


def motion(build: Callable[..., mbd.Model], **named: float) -> np.ndarray:
    """Another mechanism from another start: a damped, driven arm whose damper and drive are zero."""
    model = build()
    start = mbd.assemble(model, position={"shoulder.angle": -0.8, "elbow.angle": 2.1}, velocity={"elbow.angle": 4.0})
    run = mbd.simulate(model, start, mbd.GeneralizedAlpha(0.8), dt=2e-3, until=3.0, parameters=named)
    return run.record.q


def test_an_effect_that_is_given_strength_acts_and_without_it_is_gone_again() -> None:
    def build() -> mbd.Model:
        return arm(weak=True, tunable=WEAK)

    still, bare = motion(build), motion(arm)
    assert np.array_equal(still, bare)
    for name in WEAK:
        assert np.max(np.abs(motion(build, **{name: 0.3}) - bare)) > 1e-3
