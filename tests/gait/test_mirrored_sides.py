"""Parameters of one side of a mirrored gait, wherever they enter: refused alone, taken with those of the other side."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest

import mbd
from mbd.gait.alike import moves_sides_alike
from mbd.gait.limit_cycle import map_of
from mbd.gait.return_map import ReturnMap
from mbd.tape.functions import where
from tests.cases.walkers import SIDES, end_at_fall

MIRROR = ("left", "right")
Words = Callable[[str, str, dict[str, Any]], list[Any]]
"""What a side adds to a walker: from its word, that of the other one, and the walker's hip, leg and joint."""


def walker(words: Words, loss: Any = None) -> tuple[mbd.Model, mbd.State]:
    """A compass walker whose sides each have some words, or a loss at the hip."""
    model = mbd.Model("two-sided walker", gravity=mbd.on_slope(0.0524))
    hip = mbd.PointMass("hip", 10.0)
    model.connect(mbd.Translation("trunk", model.ground.origin, hip.origin))
    parts: dict[str, dict[str, Any]] = {}
    for side, other in SIDES:
        leg = mbd.Link(f"{side} leg", 5.0, length=1.0, center=0.5)
        joint = mbd.Revolute(f"{side} hip", hip.origin, leg.start, loss=loss)
        model.connect(joint)
        ahead = mbd.measure(lambda mine, its: mine - its, f"{side} hip.angle", f"{other} hip.angle", unit="rad")
        foot = mbd.touchdown(leg.end)
        model.constrain(mbd.Unilateral(f"{side} foot", foot, release=mbd.When(f"{other} foot"), only_while=ahead))
        parts[side] = {"hip": hip, "leg": leg, "joint": joint}
    for side, other in SIDES:
        for word in words(side, other, parts[side]):
            (model.apply if isinstance(word, mbd.Motor | mbd.Rotor) else model.constrain)(word)
    end_at_fall(model, 1.0)
    start = mbd.assemble(
        model, {"left hip.angle": 0.27, "right hip.angle": -0.27}, {"left hip.rate": -1.1, "right hip.rate": -0.4},
        closed="left foot",
    )  # fmt: skip
    return model, start


def impulse(order: str) -> Words:
    def words(side: str, other: str, parts: dict[str, Any]) -> list[Any]:
        end = parts["leg"].end
        return [mbd.Impulse(f"{side} push", end, 0.1, f"{other} foot", direction=(0, 1), order=order, axes=end)]

    return words


def mode(side: str, other: str, parts: dict[str, Any]) -> list[Any]:
    """A timer, an angle at which the state changes, a remembered angle, and what the mode sets."""
    name = f"{side} phase"
    bent = mbd.measure(lambda q, limit: q - limit, f"{side} hip.angle", f"{name}.threshold", unit="rad")
    ahead = mbd.measure(lambda v, least: v - least, f"{side} hip.rate", f"{name}.least rate")
    late = [mbd.Transition("early", "late", after=0.3), mbd.Transition("late", "last", when=bent, only_while=ahead),
            mbd.Transition(("early", "late", "last"), "early", on=f"{side} foot")]  # fmt: skip
    stored = mbd.measure(lambda q, share: share * q, f"{side} hip.angle", f"{name}.share", unit="rad")
    numbers = {"threshold": 0.2, "share": 0.5, "least rate": -5.0, "stiffness": 0.5}
    held = mbd.Motor(f"{side} hold", parts["joint"], torque=lambda x, k: k * x,
                     arguments=[f"{name}.touchdown angle", f"{name}.stiffness"])  # fmt: skip
    drive = mbd.Motor(f"{side} drive", parts["joint"], torque=lambda u: u, arguments=[("u", 0.1)])
    return [mbd.Mode(name, ("early", "late", "last"), transitions=late, remembers={"touchdown angle": stored},
                     numbers=numbers, sets={f"{side} drive.u": {"last": 0.3}}), held, drive]  # fmt: skip


def event_of_a_mode(side: str, other: str, parts: dict[str, Any]) -> list[Any]:
    """An event without a reset of its own, which a mode waits for."""
    passed = mbd.measure(lambda q, limit: q - limit, f"{side} hip.angle", f"{side} grip.angle", unit="rad")
    changes = [mbd.Transition("soft", "firm", on=f"{side} passing"), mbd.Transition("firm", "soft", on=f"{side} foot")]
    grip = mbd.Mode(f"{side} grip", ("soft", "firm"), transitions=changes, numbers={"angle": 0.1})
    return [mbd.Event(f"{side} passing", passed), grip,
            mbd.Motor(f"{side} hold", parts["joint"], torque={"firm": 0.2}, by=f"{side} grip")]  # fmt: skip


def sampled(side: str, other: str, parts: dict[str, Any]) -> list[Any]:
    law = mbd.SampledLaw(
        f"{side} PD", 0.05, {"u": lambda q, k, s: -k * q + s}, arguments=(f"{side} hip.angle", ("gain", 0.3),
        f"{side} PD.sum"), states={"sum": lambda q, k, s: 0.5 * s + 0.1 * k}, delay=0.01,
        restart_on=("left foot", "right foot"),
    )  # fmt: skip
    return [law, mbd.Motor(f"{side} drive", parts["joint"], torque=lambda u: u, arguments=[f"{side} PD.u"])]


def spring_leg(side: str, other: str, parts: dict[str, Any]) -> list[Any]:
    return [mbd.SpringLeg(f"{side} spring", parts["hip"].origin, 2000.0, 0.4, 1.2)]


def rotor(side: str, other: str, parts: dict[str, Any]) -> list[Any]:
    return [mbd.Rotor(f"{side} drive", parts["joint"], 1e-4, 30.0)]


def stop(side: str, other: str, parts: dict[str, Any]) -> list[Any]:
    """A stop of rubber that no step reaches, and a pad with friction."""
    bent = mbd.measure(lambda q: 1.5 - q, f"{side} hip.angle", unit="rad")
    pad = mbd.Penalty(f"{side} pad", mbd.touchdown(parts["leg"].center), 1e4, damping=0.3, friction=0.4)
    return [mbd.MaxwellStop(f"{side} stop", bent, 500.0, 300.0, 2.0), pad]


def beyond(side: str, other: str, parts: dict[str, Any]) -> list[Any]:
    """A force that acts beyond 6 rad alone, where nobody looks."""
    return [mbd.Motor(f"{side} beyond", parts["joint"], torque=lambda q, k: where(q > 6.0, k * q, 0.0),
                      arguments=[f"{side} hip.angle", ("k", 3.0)])]  # fmt: skip


def nothing(side: str, other: str, parts: dict[str, Any]) -> list[Any]:
    return []


KINDS: dict[str, tuple[Words, Any]] = {
    **{f"impulse {order}": (impulse(order), None) for order in ("before", "with", "after")},
    "mode": (mode, None), "event of a mode": (event_of_a_mode, None), "sampled law": (sampled, None),
    "spring leg": (spring_leg, None), "rotor": (rotor, None), "stops and pads": (stop, None),
    "out of reach": (beyond, None), "Dahl": (nothing, mbd.Dahl(0.02, 0.4)),
    "LuGre": (nothing, mbd.LuGre(0.02, 0.01, 0.1, 0.4, 0.01)), "Stribeck": (nothing, mbd.Stribeck(0.02, 0.01, 0.1)),
}  # fmt: skip


def mapped(kind: str) -> tuple[ReturnMap, dict[str, float]]:
    """The map of a mirrored step, and the parameters that this kind gives to the left side."""
    words, loss = KINDS[kind]
    model, start = walker(words, loss)
    plain = walker(nothing)[0].parameters
    own = {name: value for name, value in model.parameters.items() if name.startswith("left ") and name not in plain}
    cycle = ("right foot", MIRROR, 1)
    return map_of(model, start, mbd.RungeKutta853(), 0.05, cycle, None, None, None, 10.0, "python"), own


@pytest.mark.parametrize("kind", KINDS)
def test_a_parameter_of_one_side_is_refused_and_one_of_both_sides_is_taken(kind: str) -> None:
    step, own = mapped(kind)
    assert own
    for name, value in own.items():
        partner = name.replace("left ", "right ")
        for one in (name, partner):
            with pytest.raises(mbd.ModelError, match=f"'{one}' changes the two sides differently"):
                step.require_both_sides(one, value, step.values)

        def both(at: float, names: tuple[str, str] = (name, partner)) -> Any:
            return step.vector({**step.values, **dict.fromkeys(names, at)})

        assert moves_sides_alike(step.mechanism, step.mirror, both, value), name
        if kind != "out of reach":
            assert step.faults({**step.values, name: 1.01 * value}), name
        assert not step.faults({**step.values, name: 1.01 * value, partner: 1.01 * value}), name


def counting(on_left: str, on_right: str) -> Words:
    """Each side's hip is held in the odd state of a mode; feet that strike make it odd and even."""

    def words(side: str, other: str, parts: dict[str, Any]) -> list[Any]:
        name = f"{side} count"
        changes = [mbd.Transition("even", "odd", on=on_left), mbd.Transition("odd", "even", on=on_right)]
        if side == "right":
            changes = [mbd.Transition("odd", "even", on=on_left), mbd.Transition("even", "odd", on=on_right)]
        held = mbd.Motor(f"{side} hold", parts["joint"], torque={"odd": lambda q: -2.0 * q}, by=name,
                         arguments=[f"{side} hip.angle"])  # fmt: skip
        return [mbd.Mode(name, ("even", "odd"), start="even" if side == "left" else "odd", transitions=changes), held]

    return words


def shared(side: str, other: str, parts: dict[str, Any]) -> list[Any]:
    """One mode for both sides, whose states do not tell a side though its causes do."""
    changes = [mbd.Transition("even", "odd", on="right foot"), mbd.Transition("odd", "even", on="left foot")]
    held = mbd.Motor(f"{side} hold", parts["joint"], torque={"odd": lambda q: -2.0 * q}, by="count",
                     arguments=[f"{side} hip.angle"])  # fmt: skip
    return [held, *([mbd.Mode("count", ("even", "odd"), transitions=changes)] if side == "left" else [])]


@pytest.mark.parametrize(
    "words",
    [
        counting("left foot", "right foot"), counting("right foot", "left foot"),
        counting("left foot opened", "right foot opened"),
    ],
)  # fmt: skip
def test_a_mirrored_gait_whose_modes_are_images_repeats_its_step(words: Words) -> None:
    model, start = walker(words)
    gait = mbd.limit_cycle(model, start, section="right foot", mirror=MIRROR)
    strikes = [0.0, *(event.time for event in gait.walk(4).events if event.kind == "closed")]
    steps = [late - early for early, late in pairwise(strikes)]
    assert steps == pytest.approx([gait.period] * 4, abs=1e-8)


@pytest.mark.parametrize("words", [counting("left foot opened", "right foot"), shared])
def test_a_mirror_names_the_transition_whose_image_has_another_cause(words: Words) -> None:
    model, start = walker(words)
    with pytest.raises(
        mbd.ModelError, match="count: odd to even' on 'left foot(| opened)' has no partner on 'right foot"
    ):
        mbd.limit_cycle(model, start, section="right foot", mirror=MIRROR)


def test_a_mirror_takes_no_event_or_release_rule_of_one_side() -> None:
    model, start = walker(nothing)
    model.constrain(mbd.Event("kick", on="right foot", reset={"trunk.y.rate": lambda n: n["trunk.y.rate"]}))
    with pytest.raises(mbd.ModelError, match="'kick' on 'right foot' has no partner on 'left foot'"):
        mbd.limit_cycle(model, start, section="right foot", mirror=MIRROR)
    other = model.without("kick", "left foot")
    foot = mbd.touchdown(model.bodies["left leg"].end)
    other.constrain(mbd.Unilateral("left foot", foot, release=mbd.When("right foot", may_pull=False)))
    with pytest.raises(mbd.ModelError, match="release= or only_while= of 'left foot' and 'right foot'"):
        mbd.limit_cycle(other, start, section="right foot", mirror=MIRROR)
