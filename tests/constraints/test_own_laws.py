"""Laws of a user's own: they move as the mechanics says, run compiled, and are refused by name where they cannot."""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import pytest

import mbd
from mbd.constraints import Closing, Constraint, Drag, Equation, Law
from tests.constraints.own import Clutch, Foot, OneWayBearing, Sole
from tests.helpers import one_body

g, LOOSE = 9.81, {"rtol": 1e-9, "atol": 1e-10}


def sliding():
    """A block that slides on its sole and stops."""
    model, foot = one_body(mbd.PointMass("foot", 2.0), mbd.Translation, "p")
    model.constrain(Sole("sole", foot.origin, 1e5))
    rest = -((2.0 * g / 1e5) ** (2.0 / 3.0))
    return model, mbd.assemble(
        model, position={"p.x": 0, "p.y": rest}, velocity={"p.x": 2.0, "p.y": 0}, closed=["sole"]
    )


def shafts():
    """Two shafts of 0.5 and 2 kg m² with a clutch that carries 4 N m."""
    model = mbd.Model("clutch", gravity=(0, 0, 0))
    one, other = (mbd.RigidBody(name, 1.0, (1, 1, inertia)) for name, inertia in (("engine", 0.5), ("load", 2.0)))
    model.connect(
        first := mbd.Revolute("input", model.ground.origin, one.origin),
        second := mbd.Revolute("output", model.ground.point(0.5, 0), other.origin),
    )
    model.constrain(Clutch("clutch", first, second, 4.0))
    model.apply(mbd.Motor("drive", second, torque=lambda t: mbd.where(t > 1.5, -20.0 * (t - 1.5), 0.0)))
    return model, mbd.assemble(model, velocity={"input.angle": 10.0, "output.angle": 0.0})


def freewheel():
    """A wheel of 0.5 kg m² on a one-way bearing, driven to and fro by 2 cos 2t N m."""
    model = mbd.Model("freewheel", gravity=(0, 0, 0))
    wheel = mbd.RigidBody("wheel", 1.0, (1, 1, 0.5))
    model.connect(hub := mbd.Revolute("hub", model.ground.origin, wheel.origin))
    model.apply(mbd.Motor("drive", hub, torque=lambda t: 2.0 * mbd.cos(2.0 * t)))
    model.constrain(OneWayBearing("bearing", hub, 1e4, damping=20.0))
    return model, mbd.assemble(model, velocity={"hub.angle": 0.0})


SCENES = {"sole": sliding, "clutch": shafts, "bearing": freewheel}


@lru_cache
def run_of(name, scheme=None, dt=1e-3, until=2.0, **options):
    model, start = SCENES[name]()
    return mbd.simulate(model, start, scheme or mbd.HHT(0.05), dt=dt, until=until, **options)


# mechanics ----------------------------------------------------------------------------------------------------------
def test_a_block_on_a_sole_stops_where_its_friction_law_says():
    """m v dv/dx = −μ(v) m g."""
    v = np.linspace(1e-9, 2.0, 40001)
    grip = (0.5 + 0.2 * np.exp(-((v / 0.2) ** 2))) * np.tanh(v / 0.02)
    run = run_of("sole", until=1.0)
    way = v / (grip * g)
    assert run["p.x"][-1] == pytest.approx(np.sum((way[1:] + way[:-1]) / 2) * (v[1] - v[0]), rel=2e-3)
    assert run["sole.friction"][10] == pytest.approx(-0.5 * run["sole.force"][10], rel=1e-6)
    assert run["sole.force"] == pytest.approx(np.full(len(run.time), 2.0 * g), rel=1e-6)


def test_a_clutch_slips_until_both_shafts_turn_alike_and_again_where_it_is_asked_too_much():
    """It sticks at 10/(4 (1/0.5 + 1/2)) = 1 s; it carries Jₑ α = M Jₑ/(Jₑ + Jₗ), so it slips from M = 20 N m on."""
    run = run_of("clutch", until=3.0)
    assert [(event.kind, event.name) for event in run.events] == [("stuck", "clutch"), ("slipped", "clutch")]
    assert [event.time for event in run.events] == pytest.approx([1.0, 2.5], abs=1e-6)
    (stuck, *_) = run.events
    assert run["input.angle.rate"][stuck.row] == pytest.approx(2.0, abs=1e-9)
    assert np.abs(run["clutch.friction"]).max() == pytest.approx(4.0, rel=1e-9)
    lost = next(part for part in run.energy.parts if part.name == "clutch friction")
    assert lost.energy[stuck.row] == pytest.approx(-20.0, rel=1e-6)


def test_a_one_way_bearing_grips_as_the_wheel_would_turn_back():
    run = run_of("bearing", until=4.0)
    assert [event.kind for event in run.events] == ["closed", "opened"]
    closed, opened = (event.time for event in run.events)
    assert closed == pytest.approx(np.pi / 2, abs=1e-6)  # ω = 2 sin(2t)
    assert opened == pytest.approx(0.75 * np.pi, abs=5e-3)  # where the torque turns round
    back = run["hub.angle"][(run.time > closed) & (run.time < opened)]
    assert np.ptp(back) < 4.0 / 1e4
    hold = (run.time > closed + 0.3) & (run.time < opened - 0.1)
    assert run["bearing.force"][hold] == pytest.approx(-2.0 * np.cos(2.0 * run.time[hold]), abs=0.05)


def test_a_one_way_bearing_takes_the_blow_of_a_wheel_that_is_thrown_back():
    model, _ = freewheel()
    model = model.without("drive")
    model.constrain(mbd.Event("kick", mbd.measure(lambda t: t - 0.1, "t"), reset={"hub.rate": -1.0}))
    start = mbd.assemble(model, velocity={"hub.angle": 1.0})
    for scheme in (mbd.HHT(0.05), mbd.RadauIIA(), mbd.RungeKutta853()):
        run = mbd.simulate(model, start, scheme, dt=2e-4, until=0.3)
        assert [event.name for event in run.events] == ["kick", "bearing", "bearing"]
        omega, zeta = np.sqrt(1e4 / 0.5), 20.0 / (2.0 * np.sqrt(1e4 * 0.5))
        rebound = mbd.constraints.restitution.restitution_of_ratio(zeta, "pull")
        assert run["hub.angle.rate"][-1] == pytest.approx(rebound, rel=1e-3)
        assert run.events[2].time - run.events[1].time < np.pi / omega


@pytest.mark.parametrize("contact", ["events", "nonsmooth"])
def test_a_foot_written_anew_moves_as_that_of_the_library(contact):
    """A brick thrown on its two lower corners: bounces, slides, sticks."""
    runs, sides = [], {"left": -0.2, "right": 0.2}
    for make in (Foot, lambda name, point, e, mu: mbd.Unilateral(name, mbd.touchdown(point), e, friction=mu)):
        model, brick = one_body(mbd.RigidBody("brick", 2.0, (0.1, 0.1, 0.05)), mbd.Planar, "p")
        model.constrain(*(make(f"{side} corner", brick.point(x, -0.1), 0.3, 0.4) for side, x in sides.items()))
        place, speed = {"p.x": 0, "p.y": 0.3, "p.angle": 0.3}, {"p.x": 1.5, "p.y": 0, "p.angle": -1}
        start = mbd.assemble(model, position=place, velocity=speed)
        runs.append(mbd.simulate(model, start, mbd.HHT(0.05), dt=1e-3, until=0.6, contact=contact))
    own, library = runs
    assert [(e.kind, e.name) for e in own.events] == [(e.kind, e.name) for e in library.events]
    assert len(own.events) > 5
    np.testing.assert_allclose(own.final.q, library.final.q, **LOOSE)
    np.testing.assert_allclose(own["right corner.friction"], library["right corner.friction"], rtol=1e-7, atol=1e-6)


@pytest.mark.parametrize("name", SCENES)
def test_it_moves_alike_in_absolute_coordinates(name):
    model, start = SCENES[name]()
    if name == "clutch":
        model.apply(mbd.Motor("steady", model.joints[1], torque=0.5))
    cut = mbd.Model(model.name, model.gravity, cut="all")
    for kind in ("joints", "forces", "constraints"):
        setattr(cut, kind, list(getattr(model, kind)))
    named = {n: float(v) for n, v in zip(start.names, start.q, strict=True)}
    rates = {n.removesuffix(".rate"): float(v) for n, v in zip(start.velocity_names, start.v, strict=True)}
    again = mbd.assemble(cut, position=named, velocity=rates, closed=sorted(start.mode.closed))
    usual, run = (
        mbd.simulate(each, state, mbd.HHT(0.05), dt=1e-3, until=1.8) for each, state in ((model, start), (cut, again))
    )
    assert [(e.kind, e.name) for e in run.events] == [(e.kind, e.name) for e in usual.events]
    for coordinate in named:
        assert run[coordinate][-1] == pytest.approx(usual[coordinate][-1], rel=1e-6, abs=1e-7)


# everything else that asks ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize(
    ("scheme", "contact"),
    [(mbd.RadauIIA(), "events"), (mbd.RungeKutta853(), "events"), (mbd.GeneralizedAlpha(0.8), "nonsmooth")],
    ids=repr,
)
def test_other_schemes_move_it_alike(name, scheme, contact):
    usual, other = run_of(name, until=0.9), run_of(name, scheme, until=0.9, contact=contact)
    np.testing.assert_allclose(other.final.q, usual.final.q, atol=2e-3, rtol=0.0)


@pytest.mark.parametrize("name", SCENES)
def test_its_energy_is_booked_and_it_is_found_in_texts_files_and_pages(name, tmp_path):
    run, effect = run_of(name, until=2.0), {"sole": "sole friction", "clutch": "clutch friction"}.get(name, name)
    assert run.energy.drift < 1e-4
    part = next(part for part in run.energy.parts if part.name == effect)
    assert part.energy[-1] < -1e-5
    model, _ = SCENES[name]()
    assert f"{name}: {type(model.constraints[0]).__name__}, " in model.describe()
    assert effect.split()[0] in str(model.cost())
    run.save(tmp_path / "run.npz")
    again = mbd.load(tmp_path / "run.npz")
    assert str(again.energy) == str(run.energy)
    run.page(tmp_path / "page.html")
    assert f'"{name}"' in (tmp_path / "page.html").read_text(encoding="utf-8")
    left = model.without(effect if name == "clutch" else name)
    assert not left.constraints


MADE = {
    "sole": lambda a, b, hinge: Sole("sole", a, 1e3),
    "clutch": lambda a, b, hinge: Clutch("clutch", hinge, hinge, 4.0),
    "bearing": lambda a, b, hinge: OneWayBearing("bearing", hinge, 1e3, damping=5.0),
}


@pytest.mark.parametrize("made", [MADE["sole"], MADE["bearing"], shafts], ids=["sole", "bearing", "clutch"])
def test_it_keeps_the_laws_of_constraints(made):
    verdict = mbd.testing.check_constraint(made, until=0.1)
    assert {"the run goes through", "energy books close"} <= set(verdict.laws)


def test_a_force_law_that_gives_energy_is_found_by_its_laws():
    with pytest.raises(AssertionError, match="passivity"):
        mbd.testing.check_constraint(lambda a, b, hinge: Sole("sole", a, 1e3, friction=-0.5, static=-0.5), until=0.1)
    with pytest.raises(AssertionError, match="starts from zero"):
        mbd.testing.check_constraint(lambda a, b, hinge: Preloaded("bearing", hinge, 1e3))


@dataclass(frozen=True)
class Preloaded(OneWayBearing):
    """A bearing that pushes before it is wound up."""

    def act(self, scope, hold):
        law = super().act(scope, hold)
        return replace(law, push=law.push + 1.0)


# refusals -----------------------------------------------------------------------------------------------------------
@dataclass(frozen=True)
class Silent(Constraint):
    """A constraint that says no law."""

    name: str
    what: str = "unilateral"

    @property
    def kind(self):
        return self.what

    def mentions(self):
        return []


@pytest.mark.parametrize("door", [mbd.Model("m"), mbd.Lagrangian("l", ["x"], kinetic=lambda x_rate: 0.5 * x_rate**2)])
def test_a_class_that_nothing_could_serve_is_refused_by_name_as_it_is_given(door):
    with pytest.raises(mbd.ModelError, match=r"'stop' \(Silent\) has no act\(scope, hold\)"):
        door.constrain(Silent("stop"))
    with pytest.raises(mbd.ModelError, match="a name holds no dot"):
        door.constrain(Silent("left.stop"))
    with pytest.raises(mbd.ModelError, match=r"'stop' \(Silent\) is of kind 'ratchet'.*bilateral, nonholonomic"):
        door.constrain(Silent("stop", "ratchet"))
    with pytest.raises(mbd.ModelError, match=r"'stop' \(Silent\) is an event without guard"):
        door.constrain(Silent("stop", "event"))


@dataclass(frozen=True)
class Saying(Silent):
    """A constraint whose law is given."""

    said_law: object = None

    def act(self, scope, hold):
        return self.said_law(scope, hold) if callable(self.said_law) else self.said_law


def height(scope):
    return scope.named("p.y")


WRONG = {
    "no law": ("penalty", 3.0, "must return an mbd.constraints.Law, got 3.0"),
    "no closing": ("unilateral", lambda s, h: Law([Equation(height(s))]), "needs Law(contact=Closing(gap))"),
    "no rows": ("bilateral", lambda s, h: Law(), "needs Law(rows="),
    "closing": ("bilateral", lambda s, h: Law([Equation(height(s))], Closing(height(s))), "takes no Law(contact="),
    "rows of a force": (
        "penalty", lambda s, h: Law([Equation(height(s))], Closing(height(s)), push=1.0), "give push=, not rows",
    ),
    "drags of rows": (
        "unilateral", lambda s, h: Law([Equation(height(s))], Closing(height(s)), drags=[Drag(1.0, 1.0)]), "drags=",
    ),
    "rules of a force": (
        "penalty", lambda s, h: Law(contact=Closing(height(s), restitution=0.5), push=1.0), "leave them out",
    ),
    "rule": ("penalty", lambda s, h: Law(contact=Closing(height(s), opens_on="when"), push=1.0), "opens_on is 'gap'"),
    "restitution": (
        "unilateral", lambda s, h: Law([Equation(height(s))], Closing(height(s), restitution=-0.5)), "is negative",
    ),
    "first row": (
        "unilateral", lambda s, h: Law([Equation(s.named("p.x"), "normal")], Closing(height(s))), "its first row is",
    ),
    "unknown contact": (
        "nonholonomic",
        lambda s, h: Law([Equation(s.named("p.x.rate"), level="velocity")], while_closed="food"),
        "no contact named 'food'",
    ),
    "crooked drag": (
        "penalty",
        lambda s, h: Law(contact=Closing(height(s)), push=1.0, drags=[Drag(s.named("p.x.rate") ** 2, 1.0)]),
        "the velocity of its friction is not linear",
    ),
    "state": (
        "penalty", lambda s, h: Law(contact=Closing(height(s)), push=s.state("stop", "b", 0.0)), "'stop.b' has no rate",
    ),
    "state in a gap": (
        "penalty",
        lambda s, h: Law(contact=Closing(s.state("stop", "b", 0.0)), push=1.0),
        "its gap depends on states",
    ),
    "rates": ("bilateral", lambda s, h: Law([Equation(height(s))], rates=[1.0]), "must be pairs (state, its rate)"),
    "held for ever": ("bilateral", lambda s, h: Law([Equation(height(s) - h([height(s)])[0])]), "never closes"),
    "gap that nothing moves": (
        "penalty", lambda s, h: Law(contact=Closing(s.tape.lift(1.0)), push=1.0), "the same whatever the motion",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("kind", "law", "said"), WRONG.values(), ids=WRONG)
def test_a_law_that_is_not_what_its_kind_promises_is_refused_by_name(kind, law, said):
    model, _ = one_body(mbd.PointMass("ball", 1.0), mbd.Translation, "p", title="m")
    model.constrain(Saying("stop", kind, law))
    with pytest.raises(mbd.ModelError, match="'stop") as refused:
        mbd.assemble(model)
    assert said in str(refused.value)
