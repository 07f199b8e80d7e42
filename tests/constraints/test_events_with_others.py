"""Events that happen with something else: with a strike, with an opening, with another event or a mode."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import sympy

import mbd
from mbd.errors import ModelError, SimulationError

G = 9.81


def ball(*more: Any, restitution: float = 0.8) -> tuple[mbd.Model, mbd.State]:
    """A ball that falls from 0.5 m and moves on at 1 m/s."""
    model, body = mbd.Model("ball"), mbd.PointMass("ball", 1.0)
    model.connect(mbd.Translation("place", model.ground.origin, body.origin))
    model.constrain(mbd.Unilateral("floor", mbd.height(body.origin), restitution=restitution), *more)
    return model, mbd.assemble(model, {"place.y": 0.5}, {"place.x": 1.0})


KICK = mbd.Event("kick", on="floor", reset={"place.y.rate": 2.0})
RK = mbd.RungeKutta853()


@pytest.mark.parametrize("backend", ["auto", "python"])
def test_a_reset_follows_each_strike_and_has_its_line_in_the_ledger(backend: str) -> None:
    """Falls of √(2h/g), then hops of 2v/g; the ledger books what impact and reset take."""
    run = mbd.simulate(*ball(KICK), RK, dt=0.02, until=1.0, backend=backend)
    first, hop = math.sqrt(2.0 * 0.5 / G), 2.0 * 2.0 / G
    struck = [event.time for event in run.events if event.kind == "closed"]
    kicked = [event.time for event in run.events if event.name == "kick"]
    np.testing.assert_allclose(struck, [first, first + hop], atol=1e-12)
    assert kicked == struck
    parts = {part.name: part.energy[-1] for part in run.energy.parts}
    fall = math.sqrt(2.0 * G * 0.5)
    np.testing.assert_allclose(parts["floor impact"], -0.5 * 0.36 * (fall**2 + 4.0), rtol=1e-12)
    np.testing.assert_allclose(parts["resets"], 0.5 * (4.0 - 0.64 * fall**2) + 0.5 * 0.36 * 4.0, rtol=1e-12)
    assert np.max(np.abs(run.energy.numerical)) < 1e-12


def test_derivatives_and_gaits_go_through_such_a_reset() -> None:
    model, start = ball(KICK)
    how: dict[str, Any] = {"integrator": RK, "dt": 0.02, "until": 0.6}
    found = mbd.sensitivities(model, start, wrt=["place.y"], of=["place.y"], **how)["place.y", "place.y"]
    ends = [
        mbd.simulate(model, replace(start, q=start.q + np.array([0.0, h])), **how).final["place.y"]
        for h in (1e-4, -1e-4)
    ]
    np.testing.assert_allclose(found, (ends[0] - ends[1]) / 2e-4, rtol=1e-6)
    gait = mbd.limit_cycle(model, start, section="kick")
    np.testing.assert_allclose(gait.period, 4.0 / G, rtol=1e-12)
    np.testing.assert_allclose(gait.derivatives["period", "gravity.y"], 4.0 / G**2, rtol=1e-8)


def test_events_follow_openings_events_and_modes() -> None:
    """A ball at rest is lifted; each thing happens at the instant of what it waits for."""
    model, body = mbd.Model("lifted"), mbd.PointMass("body", 1.0)
    rail = mbd.Prismatic("rail", model.ground.origin, body.origin, axis="y")
    model.connect(rail)
    model.apply(
        mbd.Motor("lift", rail, force={"up": 2.0 * G}, by="phase"),
        mbd.Mode("phase", ("wait", "up", "off"), transitions=[
            mbd.Transition("wait", "up", after=0.1), mbd.Transition("up", "off", on="second"),
        ]),
    )  # fmt: skip
    model.constrain(
        mbd.Unilateral("floor", mbd.height(body.origin)),
        mbd.Event("left", on="floor opened"), mbd.Event("begun", on="phase: up"),
        mbd.Event("high", mbd.measure(lambda y: y - 0.2, "rail.displacement")),
        mbd.Event("second", on="high"), mbd.Event("end", on="phase: off", terminal=True),
    )  # fmt: skip
    run = mbd.simulate(model, mbd.assemble(model, closed="floor"), RK, dt=0.01, until=2.0)
    times = {event.name: event.time for event in run.events}
    np.testing.assert_allclose([times["begun"], times["left"]], 0.1, atol=1e-12)
    high = 0.1 + math.sqrt(2.0 * 0.2 / G)
    np.testing.assert_allclose([times["high"], times["second"], times["end"], run.time[-1]], high, atol=1e-10)
    assert run.message.startswith("ended by 'end'")


def test_a_reset_against_a_contact_that_stays_closed_is_refused_by_name() -> None:
    with pytest.raises(SimulationError, match="reset of 'kick' .* breaks constraints: 'floor'"):
        mbd.simulate(*ball(KICK, restitution=0.0), RK, dt=0.02, until=1.0)


def _rate(rate: Any) -> Any:
    return rate


CONDITIONS = [
    "place.y.rate", mbd.measure("place.y.rate"), mbd.measure(_rate, "place.y.rate"),
    sympy.Symbol("place.y.rate", real=True),
]  # fmt: skip


@pytest.mark.parametrize("condition", CONDITIONS)
def test_events_and_transitions_take_conditions_in_the_same_forms(condition: Any) -> None:
    turns = mbd.Mode("phase", ("rise", "fall"), transitions=[
        mbd.Transition("rise", "fall", when=condition, direction=-1), mbd.Transition("fall", "rise", on="floor"),
    ])  # fmt: skip
    run = mbd.simulate(*ball(mbd.Event("apex", condition, direction=-1), turns), RK, dt=0.02, until=1.0)
    times = {name: [each.time for each in run.events if each.name == name] for name in ("apex", "phase: rise to fall")}
    hop = math.sqrt(2.0 * 0.5 / G) * (1.0 + 0.8)
    np.testing.assert_allclose(times["apex"], hop, atol=1e-12)
    np.testing.assert_allclose(times["phase: rise to fall"][-1], hop, atol=1e-12)


@pytest.mark.parametrize(("make", "told"), [
    (lambda: mbd.Event("kick"), "takes one cause, a guard or on="),
    (lambda: mbd.Event("kick", mbd.measure("place.y"), on="floor"), "takes one cause"),
    (lambda: mbd.Event("kick", 5), "guard of Event 'kick' is a measure, the name of a quantity, or a function"),
    (lambda: mbd.Unilateral("wall", mbd.height(mbd.PointMass("p", 1.0).origin), only_while=5), "name of a contact"),
    (lambda: ball(mbd.Event("kick", "place.yy")), "no quantity named 'place.yy'; did you mean"),
    (lambda: mbd.Event("kick", on="kick"), "the name of something else"),
    (lambda: mbd.Event("kick", on="floor", direction=1), "leave it out beside on="),
    (lambda: ball(mbd.Event("kick", on="flor")), "on: no contact, event or mode named 'flor'; did you mean 'floor'"),
])  # fmt: skip
def test_bad_causes_are_named(make: Any, told: str) -> None:
    with pytest.raises(ModelError, match=told):
        make()
