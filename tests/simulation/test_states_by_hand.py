"""States that were changed by hand: consistent ones are taken, others are refused with the rows they violate."""

import math
import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import mbd
from mbd.state import Mode, State

PLAIN: dict[str, Any] = {"backend": "python"}
SCHEMES = [
    mbd.HHT(0.05), mbd.HHT(0.05, formulation="index3"), mbd.GeneralizedAlpha(0.9), mbd.RadauIIA(), mbd.RungeKutta853()
]  # fmt: skip


def on_rod(rng: np.random.Generator) -> tuple[mbd.Model, State]:
    """A point mass on a rod, given by its distance."""
    length, turn = rng.uniform(0.3, 2.0), rng.uniform(-1.5, 1.5)
    model = mbd.Model("bob")
    bob = mbd.PointMass("bob", rng.uniform(0.5, 3.0))
    model.connect(mbd.Translation("place", model.ground.origin, bob.origin))
    model.constrain(mbd.Bilateral("rod", mbd.distance(model.ground.origin, bob.origin), length))
    place = {"place.x": length * math.sin(turn), "place.y": -length * math.cos(turn)}
    return model, mbd.assemble(model, place, {"place.x": 0.4 * math.cos(turn), "place.y": 0.4 * math.sin(turn)})


def four_bar(rng: np.random.Generator) -> tuple[mbd.Model, State]:
    """A crank, a coupler and a rocker."""
    model = mbd.Model("four-bar")
    crank, coupler, rocker = (
        mbd.Link(name, mass=rng.uniform(0.5, 2.0), length=length, center=length / 2, inertia=0.05)
        for name, length in (("crank", 0.4), ("coupler", 1.2), ("rocker", 0.9))
    )
    model.connect(
        mbd.Revolute("a", model.ground.origin, crank.start),
        mbd.Revolute("b", crank.end, coupler.start),
        mbd.Revolute("c", coupler.end, rocker.end),
        mbd.Revolute("d", model.ground.point(1.0, 0.0, 0.0, "support"), rocker.start),
    )
    return model, mbd.assemble(model, {"a.angle": rng.uniform(0.3, 2.5)}, {"a.angle": 1.0})


def standing(rng: np.random.Generator) -> tuple[mbd.Model, State]:
    """A stick that stands on a foot and falls over."""
    model = mbd.Model("stick")
    stick = mbd.Link("stick", mass=1.0, length=1.0, center=rng.uniform(0.3, 0.6), inertia=0.1)
    model.connect(mbd.Planar("float", model.ground.origin, stick.start))
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(stick.end)))
    return model, mbd.assemble(
        model, {"float.angle": rng.uniform(-0.4, 0.4)}, {"float.angle": rng.uniform(-0.5, 0.5)}, closed=["foot"]
    )


def driven(rng: np.random.Generator) -> tuple[mbd.Model, State]:
    """A pendulum on a slider that is moved to and fro."""
    model = mbd.Model("driven")
    slider, rod = mbd.PointMass("slider", 1.0), mbd.Link("rod", mass=1.0, length=0.7, center=0.3, inertia=0.02)
    rail = mbd.Prismatic("rail", model.ground.origin, slider.origin)
    model.connect(rail, mbd.Revolute("hinge", slider.origin, rod.start))
    model.constrain(mbd.Bilateral("drive", rail, lambda t: 0.2 * mbd.sin(3.0 * t)))
    return model, mbd.assemble(model, {"hinge.angle": rng.uniform(-1.0, 1.0)})


def blade(rng: np.random.Generator) -> tuple[mbd.Model, State]:
    """A sleigh on a blade, whose row holds velocities alone."""
    model = mbd.Model("sleigh", gravity=(0.0, 0.0, 0.0))
    body = mbd.RigidBody("body", 1.0, 0.3, (0.2, 0.0, 0.0))
    model.connect(mbd.Planar("float", model.ground.origin, body.origin))
    model.constrain(mbd.KnifeEdge("blade", body.origin))
    angle = rng.uniform(-1.0, 1.0)
    speeds = {"float.x": math.cos(angle), "float.y": math.sin(angle), "float.angle": 0.5}
    return model, mbd.assemble(model, {"float.angle": angle}, speeds)


SCENES = [(on_rod, "rod"), (four_bar, "c"), (standing, "foot"), (driven, "drive"), (blade, "blade")]
scenes = pytest.mark.parametrize(("scene", "owner"), SCENES, ids=lambda each: getattr(each, "__name__", each))


def run(model: mbd.Model, start: State, scheme: Any = None, until: float = 0.01, **more: Any) -> mbd.Trajectory:
    return mbd.simulate(model, start, scheme or mbd.HHT(0.05), dt=1e-3, until=start.time + until, **PLAIN, **more)


@scenes
def test_a_state_off_its_constraints_is_refused_with_how_far_it_is_off(scene: Callable[..., Any], owner: str) -> None:
    rng = np.random.default_rng(7)
    for size in (1e-4, 1e-2, 0.5):
        model, start = scene(rng)
        away, faster = rng.normal(size=len(start.q)), rng.normal(size=len(start.v))
        with pytest.raises(
            mbd.ModelError, match=rf"'({owner}|[a-d])'.* is violated by .* in its velocity.*mbd.project"
        ):
            run(model, replace(start, v=start.v + size * faster))
        if owner != "blade":
            with pytest.raises(mbd.ModelError, match=rf"'({owner}|[a-d])'.* is violated by [-\d.e]+ (m|rad)[.;]"):
                run(model, replace(start, q=start.q + size * away))


@scenes
def test_a_projected_state_goes_on_and_round_off_is_taken(scene: Callable[..., Any], owner: str) -> None:
    """Its forces are those of the nearest consistent state, from the first row on; nothing oscillates."""
    rng = np.random.default_rng(8)
    model, start = scene(rng)
    given = replace(
        start, q=start.q + 1e-2 * rng.normal(size=len(start.q)), v=start.v + 0.1 * rng.normal(size=len(start.v))
    )
    near = mbd.project(model, given, **PLAIN)
    assert near.moved and max(map(abs, near.moved.values())) < 1.0
    went = run(model, near, mbd.HHT(0.05, formulation="index3"))
    force = f"{owner}.{'tension' if owner == 'rod' else 'reaction_force.x' if owner == 'c' else 'force'}"
    size = np.max(np.abs(went[force]))
    assert np.max(np.abs(np.diff(went[force]))) <= 0.05 * size + 0.5
    again = mbd.project(model, near, **PLAIN)
    np.testing.assert_allclose(again.q, near.q, atol=1e-12)
    np.testing.assert_allclose(again.v, near.v, atol=1e-12)
    wobbly = replace(near, q=near.q * (1.0 + 1e-14), v=near.v * (1.0 + 1e-14))
    np.testing.assert_allclose(run(model, wobbly).final.q, run(model, near).final.q, atol=1e-9)


@pytest.mark.covering
@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
@scenes
def test_the_end_of_a_run_is_a_start_for_every_scheme_and_step(
    scene: Callable[..., Any], owner: str, scheme: Any
) -> None:
    """Whatever the scheme leaves at its rows; nor does a parameter that enters none of them change that."""
    model, start = scene(np.random.default_rng(9))
    first = mbd.simulate(model, start, scheme, dt=5e-3, until=0.1, backend="llvm")
    for other in SCHEMES:
        more: dict[str, Any] = {"parameters": {"gravity.y": -9.0}} if other is SCHEMES[0] else {}
        mbd.simulate(model, first.final, other, dt=2e-3, until=0.11, backend="llvm", **more)
    whole = mbd.simulate(model, start, scheme, dt=5e-3, until=0.15, backend="llvm")
    second = mbd.simulate(model, replace(first.final), scheme, dt=5e-3, until=0.15, backend="llvm")
    assert np.array_equal(whole.final.q, second.final.q) and np.array_equal(whole.final.v, second.final.v)


@scenes
def test_the_end_of_a_run_that_is_changed_by_hand_is_refused_too(scene: Callable[..., Any], owner: str) -> None:
    model, start = scene(np.random.default_rng(10))
    end = run(model, start).final
    with pytest.raises(mbd.ModelError, match="does not satisfy its constraints"):
        run(model, replace(end, v=end.v + 0.1))


def test_a_contact_that_is_closed_by_hand_must_touch() -> None:
    model, start = standing(np.random.default_rng(11))
    risen = replace(start, q=start.q + np.array([0.0, 0.1, 0.0]), mode=Mode())
    assert run(model, replace(risen, armed=None), until=1e-3).success
    with pytest.raises(mbd.ModelError, match=r"'foot' \(normal\) is violated by 0.1 m"):
        run(model, replace(risen, mode=Mode(frozenset({"foot"}))))
    end = run(model, risen, until=1e-3).final
    with pytest.raises(mbd.ModelError, match=r"'foot' \(normal\) is violated by"):
        run(model, replace(end, mode=Mode(frozenset({"foot"}))))
    elsewhere = replace(start, anchors=start.anchors + 0.2)
    with pytest.raises(mbd.ModelError, match=r"'foot' \(forward\) is violated by -?0.2 m"):
        run(model, elsewhere)


def test_a_driven_start_at_another_time_is_off_its_drive() -> None:
    model, start = driven(np.random.default_rng(12))
    with pytest.raises(mbd.ModelError, match="'drive' is violated by"):
        run(model, replace(start, time=0.2))
    later = mbd.project(model, replace(start, time=0.2), **PLAIN)
    assert later["rail.displacement"] == pytest.approx(0.2 * math.sin(0.6))
    assert later["rail.rate"] == pytest.approx(0.6 * math.cos(0.6))
    assert run(model, later).success


def test_a_length_that_a_parameter_changes_is_told_with_the_rows_it_breaks() -> None:
    model, start = on_rod(np.random.default_rng(13))
    longer = {"rod.value": float(np.hypot(*start.q)) + 0.05}
    with pytest.raises(mbd.ModelError, match="'rod' is violated by -0.05 m.*give it the parameters="):
        run(model, start, parameters=longer)
    assert run(model, mbd.project(model, start, longer, **PLAIN)).success


def test_a_controller_cannot_shift_a_constraint() -> None:
    model, start = on_rod(np.random.default_rng(14))
    value = model.parameters["rod.value"]
    model.apply(mbd.Controller("winch", lambda t, *_: {"rod.value": value + 0.1 * t}, period=0.005, writes="rod.value"))
    went = run(model, start, on_failure="return")
    assert not went.success and went.time[-1] == pytest.approx(0.005)
    assert re.search(r"'winch' at t = 0.005 s sets 'rod.value' to .*'rod' is violated by -0.0005 m", went.message)


def test_no_consistent_state_near_is_told() -> None:
    model, start = on_rod(np.random.default_rng(15))
    with pytest.raises(mbd.AssemblyError, match=r"no consistent state .*'rod' is violated by"):
        mbd.project(model, start, {"rod.value": -1.0}, **PLAIN)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"q": np.zeros(3)}, "assemble it from this model"),
        ({"q": np.zeros((2, 1))}, "q of the start must be an array of numbers"),
        ({"v": "fast"}, "v of the start must be"),
        ({"v": [[1.0], [2.0, 3.0]]}, "v of the start must be"),
        ({"v": np.array([1.0, None])}, "v of the start must be"),
        ({"v": np.array([math.nan, 0.0])}, "'place.x.rate' = nan; give a finite number"),
        ({"anchors": np.array([1j])}, "anchors of the start must be"),
        ({"mode": {"foot"}}, "mode of the start must be a Mode"),
        ({"mode": Mode("foot")}, "mode of the start must be a Mode"),  # type: ignore[arg-type]
        ({"mode": Mode(frozenset({"foot"}))}, "no contact named 'foot'"),
        ({"armed": "foot"}, "armed of the start must be"),
        ({"armed": [3]}, "armed of the start must be"),
        ({"memory": {"reals": 3}}, "memory of the start must be"),
        ({"parameters": [1.0]}, "parameters of the start must map"),
        ({"parameters": {"bob.mass": "heavy"}}, "must be a finite number"),
        ({"time": "noon"}, "time of the start must be finite"),
    ],
)
def test_what_is_no_state_is_told(changes: dict[str, Any], said: str) -> None:
    model, start = on_rod(np.random.default_rng(16))
    with pytest.raises(mbd.MbdError, match=said):
        mbd.simulate(model, replace(start, **changes), dt=1e-3, until=0.1, **PLAIN)
    if "time" not in changes:
        with pytest.raises(mbd.MbdError, match=said):
            mbd.project(model, replace(start, **changes), **PLAIN)
