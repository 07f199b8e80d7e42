"""Modes that a run never changes say what they waited for, and transitions that cannot come are refused."""

import re

import pytest

import mbd


def shank(transition, contact=False):
    model = mbd.Model("shank")
    body = mbd.Link("shank", mass=2.0, length=0.4, center=0.2, inertia=0.03)
    model.connect(mbd.Revolute("knee", model.ground.origin, body.start, loss=mbd.Viscous(0.05)))
    if contact:
        model.constrain(mbd.Unilateral("stop", mbd.measure(lambda angle: angle + 2.0, "knee.angle")))
    model.constrain(mbd.Mode("phase", ("a", "b"), transitions=[transition]))
    return model


def notes(transition, contact=False, until=2.0):
    model = shank(transition, contact)
    run = mbd.simulate(model, mbd.assemble(model, {"knee.angle": 0.8}), mbd.RungeKutta853(), dt=0.01, until=until)
    return [note for note in run.stats["notes"] if "mode 'phase'" in note]


def beyond(limit):
    return mbd.measure(lambda angle: angle - limit, "knee.angle")


IDLE = {
    "a threshold out of reach": (mbd.Transition("a", "b", when=beyond(0.81)), "it came as near as -0.01 "),
    "a timer under a condition": (mbd.Transition("a", "b", after=0.1, only_while=beyond(5.0)), "timer of 'a to b'"),
    "the other direction": (
        mbd.Transition("a", "b", when="knee.angle", direction=1, only_while=beyond(5.0)), "crossed 0 in the other"
    ),
    "a contact that stays open": (mbd.Transition("a", "b", on="stop"), "'a to b' waited for 'stop' to close"),
}  # fmt: skip


@pytest.mark.parametrize(("transition", "said"), IDLE.values(), ids=IDLE)
def test_a_mode_that_is_never_left_says_what_it_waited_for(transition, said):
    (note,) = notes(transition, contact=transition.on is not None)
    assert "stayed in 'a' from t = 0 to 2 s" in note
    assert re.search(said, note)


@pytest.mark.parametrize(
    "transition", [mbd.Transition("a", "b", after=0.1), mbd.Transition("a", "b", after=5.0)], ids=repr
)
def test_a_mode_that_changes_or_whose_time_is_still_to_come_says_nothing(transition):
    assert notes(transition) == []


def test_a_second_transition_on_the_same_cause_is_refused():
    both = [mbd.Transition("a", target, on="stop") for target in ("b", "c")]
    back = mbd.Transition(("b", "c"), "a", after=1.0)
    with pytest.raises(mbd.ModelError, match="never goes from 'a' to 'c' on 'stop': the transition to 'b' is first"):
        mbd.Mode("phase", ("a", "b", "c"), transitions=[*both, back])
    bent = mbd.Transition("a", "b", on="stop", only_while=beyond(0.3))
    assert mbd.Mode("phase", ("a", "b", "c"), transitions=[bent, both[1], back]).states == ("a", "b", "c")
