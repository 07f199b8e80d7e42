"""Events at the instant of a strike: those that change nothing, and those that jump over zero in its impact."""

from typing import Any

import numpy as np
import pytest

import mbd

WRT, OF = ["trunk.y", "trunk.x", "gravity.y", "ball.mass"], ["trunk.x", "trunk.y", "trunk.x.rate", "trunk.y.rate"]
SCHEMES: list[tuple[Any, float]] = [
    (mbd.RungeKutta853(), 0.01), (mbd.HHT(tolerance=1e-12), 2e-3),
    (mbd.HHT(formulation="index3", tolerance=1e-12), 2e-3), (mbd.RadauIIA(), 0.01),
]  # fmt: skip
FALL = (2.0 / 9.81) ** 0.5
INERT = {
    "jumps": mbd.Event("other", "trunk.y.rate", direction=1),
    "its gap": mbd.Event("other", "trunk.y"),
    "has the same zero": mbd.Event("other", mbd.measure(lambda y: 2.0 * y + y**2, "trunk.y")),
    "comes by chance": mbd.Event("other", mbd.measure(lambda x: x - FALL, "trunk.x")),
    "follows": mbd.Event("other", on="floor"),
}


def ball(*more: Any) -> tuple[mbd.Model, mbd.State]:
    """A ball that falls from 1 m and bounces as it moves on at 1 m/s."""
    model, body = mbd.Model("ball"), mbd.PointMass("ball", mass=2.0)
    model.connect(mbd.Translation("trunk", model.ground.origin, body.origin))
    model.constrain(mbd.Unilateral("floor", mbd.height(body.origin), restitution=0.6))
    for each in more:
        model.apply(each(body) if callable(each) else each)
    return model, mbd.assemble(model, {"trunk.y": 1.0}, {"trunk.x": 1.0})


def sensitivities(model: mbd.Model, start: mbd.State, scheme: Any, dt: float, **how: Any) -> mbd.Sensitivities:
    return mbd.sensitivities(model, start, scheme, dt=dt, **({"until": 0.8, "wrt": WRT, "of": OF} | how))


@pytest.mark.parametrize(("scheme", "dt"), SCHEMES)
@pytest.mark.parametrize("kind", INERT)
def test_an_event_that_changes_nothing_changes_no_derivative(kind: str, scheme: Any, dt: float) -> None:
    found = sensitivities(*ball(INERT[kind]), scheme, dt)
    assert [each.name for each in found.run.events] == ["floor", "other"]
    assert found.run.events[0].time == found.run.events[1].time
    np.testing.assert_allclose(found.matrix, sensitivities(*ball(), scheme, dt).matrix, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("kind", INERT)
def test_its_instant_moves_with_the_strike_or_has_no_derivative(kind: str) -> None:
    asked: dict[str, Any] = {"of": ["floor.time", "other.time"]}
    if kind == "comes by chance":
        with pytest.raises(mbd.errors.OneSidedError, match="'other.time' is the instant of an event .* by chance"):
            sensitivities(*ball(INERT[kind]), *SCHEMES[0], **asked)
    elif kind != "follows":  # the log has the strike alone
        found = sensitivities(*ball(INERT[kind]), *SCHEMES[0], **asked).matrix
        np.testing.assert_allclose(found[0], [FALL / 2.0, 0.0, FALL / 2.0 / 9.81, 0.0], rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(found[1], found[0], rtol=1e-12, atol=1e-14)


def thrust(**when: Any) -> tuple[mbd.Model, mbd.State]:
    """The ball with a thruster that pushes it up from an instant on."""
    law = {"rise": (0.0, lambda v: 15.0 - 0.5 * v)}
    return ball(
        mbd.Mode("phase", ("fall", "rise"), transitions=[mbd.Transition("fall", "rise", **when)]),
        lambda body: mbd.Applied("push", body.origin, law, by="phase", arguments=["trunk.y.rate"]),
    )


@pytest.mark.parametrize(("scheme", "dt"), SCHEMES)
def test_a_transition_by_a_jump_has_the_derivatives_of_one_by_the_strike(scheme: Any, dt: float) -> None:
    """The rate jumps over zero as the floor is struck, so that both are the same motion."""
    found = sensitivities(*thrust(when="trunk.y.rate", direction=1), scheme, dt)
    assert [each.name for each in found.run.events] == ["floor", "phase: fall to rise"]
    np.testing.assert_allclose(
        found.matrix, sensitivities(*thrust(on="floor"), scheme, dt).matrix, rtol=1e-8, atol=1e-9
    )


def test_a_transition_by_chance_is_refused() -> None:
    with pytest.raises(mbd.errors.OneSidedError, match="'phase: fall to rise' happens at t = 0.45"):
        sensitivities(*thrust(when=mbd.measure(lambda x: x - FALL, "trunk.x")), *SCHEMES[0])
