"""Steps that follow their error, and runs that are as accurate as `tol` asks for."""

import functools

import numpy as np
import pytest

import mbd
from mbd.errors import CapabilityError, ModelError, SimulationError
from mbd.kernel.records import TABLE
from mbd.kernel.translation.interpreted import InterpretedScheme
from mbd.results.matching import apart
from mbd.simulation.run.begin import notify
from mbd.simulation.simulate import prepared
from mbd.simulation.tolerance.comparison import gap
from tests.equations.mechanisms import four_bar
from tests.integrators.test_order import double_pendulum
from tests.simulation.mechanisms import ball, box, kneed_walker, kneed_walker_start, pendulum, run

EXPLICIT = mbd.RungeKutta853()
SCHEMES = [EXPLICIT, mbd.HHT(0.05), mbd.GeneralizedAlpha(0.8), mbd.Newmark()]


def swinging():
    model = double_pendulum()
    return model, mbd.assemble(model, {"u.angle": 1.0, "w.angle": 0.5}, {"u.angle": 1.0, "w.angle": -2.0})


def in_absolute_coordinates():
    model = double_pendulum("all")
    position = {"upper floating.angle": 1.0, "lower floating.angle": 1.5}
    return model, mbd.assemble(model, position, {"upper floating.angle": 1.0, "lower floating.angle": -1.0})


def linkage():
    model = four_bar()
    return model, mbd.assemble(model)


def damped():
    model = pendulum(mbd.Viscous(0.5))
    return model, mbd.assemble(model, {"hinge.angle": 1.0})


def walking():
    walker = kneed_walker()
    return walker, kneed_walker_start(walker)


SCENES = {
    "double pendulum": (swinging, 2.0), "with rows": (in_absolute_coordinates, 2.0), "four-bar": (linkage, 1.0),
    "damped pendulum": (damped, 5.0), "walker": (walking, 1.0),
}  # fmt: skip


@functools.cache
def reference(scene):
    make, until = SCENES[scene]
    model, start = make()
    return model, start, until, mbd.simulate(model, start, EXPLICIT, dt=0.004, until=until)


def achieved(scene, scheme, tol):
    """The largest error of a coordinate at rows of a run and between them, away from events; the run."""
    model, start, until, exact = reference(scene)
    found = mbd.simulate(model, start, scheme, tol=tol, until=until)
    told = gap(found, exact)
    assert told.same
    instants = np.linspace(0.0, until, 301)
    names = [coordinate.name for coordinate in exact.record.equations.coordinates]
    pairs = [(one.time, other.time) for one, other in zip(found.events, exact.events, strict=True)]
    instants = instants[apart(instants, pairs, 1e-9)]
    ours, theirs = found.at(instants).read(*names), exact.at(instants).read(*names)
    return max(told.size, *(np.max(np.abs(ours[name] - theirs[name])) for name in names)), found


# what tol promises --------------------------------------------------------------------------------------------------
@pytest.mark.covering
@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("scheme", [*SCHEMES[:2], mbd.RadauIIA()], ids=repr)
def test_the_largest_error_of_a_coordinate_is_what_tol_asks_for(scene, scheme):
    for tol in (1e-3, 1e-5) if scheme == SCHEMES[1] else (1e-3, 1e-5, 1e-7, 1e-9):
        error, found = achieved(scene, scheme, tol)
        told = found.stats["tolerance"]
        better = any("far below tol" in note for note in found.stats["notes"])
        assert error < 2.0 * tol and told["requested"] == tol and told["estimated"] <= tol
        assert error > 0.08 * tol or better
        assert 0.3 * told["estimated"] < error < 3.0 * told["estimated"]
        assert 2 <= len(told["runs"]) <= 5 and all(one["steps"] > 0 for one in told["runs"])
        assert told["growth"] < 100.0 and told["comparing_seconds"] > 0.0


def test_a_run_that_is_better_than_asked_says_why():
    """A few steps of an easy motion, and the parabola of a ball, which every scheme follows to round-off."""
    model, start, _, _ = reference("double pendulum")
    easy = mbd.simulate(model, start, EXPLICIT, tol=1e-3, until=0.1)
    assert any("steps end at events or have their largest size, 25 % of the run" in n for n in easy.stats["notes"])
    thrown = run(ball(restitution=0.5), {"fall.displacement": 1.0}, dt=None, tol=1e-4, until=1.2)
    assert any("round-off whatever the steps" in note for note in thrown.stats["notes"])
    nothing = mbd.simulate(model, start, EXPLICIT, tol=1e-3, until=start.time)
    assert not nothing.stats["notes"], "no steps, nothing to tell of them"


def test_an_explicit_run_with_friction_is_as_accurate_between_its_rows():
    """Its steps are not taken again; polynomials through three rows take their place, and tol counts them."""
    model = pendulum(mbd.Coulomb(0.5))
    start = mbd.assemble(model, {"hinge.angle": 1.5})
    exact = mbd.simulate(model, start, mbd.RadauIIA(), dt=1e-3, until=3.0)
    found = mbd.simulate(model, start, EXPLICIT, tol=1e-7, until=3.0)
    pairs = [(one.time, other.time) for one, other in zip(found.events, exact.events, strict=True)]
    instants = np.linspace(0.0, 3.0, 1001)
    instants = instants[apart(instants, pairs, 1e-9)]
    error = np.max(np.abs(found.at(instants)["hinge.angle"] - exact.at(instants)["hinge.angle"]))
    assert 1e-8 < error < 1e-7 and found.stats["tolerance"]["estimated"] == pytest.approx(error, rel=1.0)


@pytest.mark.parametrize("scheme", SCHEMES[1:], ids=repr)
def test_schemes_of_second_order_take_steps_in_proportion_to_the_root_of_tol(scheme):
    model, start, until, _ = reference("double pendulum")
    steps = [mbd.simulate(model, start, scheme, tol=tol, until=until).stats for tol in (1e-3, 1e-5)]
    work = [numbers["steps"] / np.sqrt(1.0 / numbers["tolerance"]["estimated"]) for numbers in steps]
    assert work[0] == pytest.approx(work[1], rel=0.2)


def test_events_are_matched_and_located_in_runs_to_a_tolerance():
    found = run(ball(restitution=0.5), {"fall.displacement": 1.0}, integrator=EXPLICIT, dt=None, tol=1e-8, until=1.3)
    instants = np.sqrt(2.0 / 9.81) * np.array([1.0, 2.0, 2.5, 2.75])
    np.testing.assert_allclose([event.time for event in found.events[:4]], instants, rtol=0, atol=1e-14)


def test_a_run_ends_at_its_event_with_the_accuracy_that_was_asked_for():
    model, start = walking()
    found, exact = (
        mbd.simulate(model, start, EXPLICIT, until=("right foot", 2.0), **how) for how in ({"tol": 1e-8}, {"dt": 0.004})
    )
    assert found.status == 1 and found.time[-1] == pytest.approx(exact.time[-1], abs=1e-9)
    assert np.max(np.abs(found.record.q[-1] - exact.record.q[-1])) < 1e-8


def test_boundaries_are_hit_exactly():
    """Samples of a controller end steps, whatever their size."""
    model, called = pendulum(), []
    model.apply(mbd.Motor("motor", model.joints[0], torque=0.5))

    def note(time, values, state):
        called.append(time)
        return {"motor.torque": 0.5 + 0.2 * np.cos(time)}

    model.apply(mbd.Controller("servo", note, reads=["hinge.angle"], writes=["motor.torque"], period=0.3))
    start = mbd.assemble(model, {"hinge.angle": 0.3})
    found = mbd.simulate(model, start, EXPLICIT, tol=1e-7, until=1.0)
    instants = np.arange(4) * 0.3
    np.testing.assert_allclose(sorted(set(np.round(called, 12))), instants, atol=1e-12)
    assert found.time[-1] == 1.0 and all(np.min(np.abs(found.time - instant)) < 1e-15 for instant in instants)


def test_the_printed_run_tells_the_accuracy():
    _, found = achieved("damped pendulum", EXPLICIT, 1e-6)
    assert "estimated error of coordinates" in repr(found) and "asked for 1e-06" in repr(found)
    assert found.settings["tol"] == 1e-6 and found.settings["dt"] is None


# what it cannot do --------------------------------------------------------------------------------------------------
def test_a_tolerance_below_round_off_stops_with_what_was_reached():
    model, start, until, _ = reference("double pendulum")
    with pytest.raises(SimulationError, match=r"tol = 1e-16 was not reached.*estimated error of .*round-off") as told:
        mbd.simulate(model, start, EXPLICIT, tol=1e-16, until=until)
    best = told.value.run
    assert not best.success and best.stats["tolerance"]["estimated"] < 1e-12
    quiet = mbd.simulate(model, start, EXPLICIT, tol=1e-16, until=until, on_failure="return")
    assert not quiet.success and "was not reached" in quiet.message


@pytest.mark.parametrize("scheme", [*SCHEMES[:2], mbd.RadauIIA()], ids=repr)
def test_motions_that_need_no_short_steps_have_a_known_error(scheme):
    model = double_pendulum()
    for start, until in ((mbd.assemble(model), 10.0), (swinging()[1], 0.0), (swinging()[1], 1e-9)):
        found = mbd.simulate(model, start, scheme, tol=1e-6, until=until)
        still = np.max(np.abs(found.record.q - start.q), initial=0.0)
        assert found.time[-1] == until and found.stats["tolerance"]["estimated"] <= 1e-6 and still < 1e-8
    loose = mbd.simulate(model, swinging()[1], scheme, tol=1e8, until=1.0)
    assert loose.success and np.isfinite(loose.stats["tolerance"]["estimated"])


@pytest.mark.parametrize("scheme", [*SCHEMES[:2], mbd.RadauIIA()], ids=repr)
def test_an_event_within_the_first_step_ends_a_run_to_a_tolerance(scheme):
    model = pendulum()
    model.constrain(mbd.Event("low", mbd.measure("hinge.angle"), terminal=True))
    start = mbd.assemble(model, {"hinge.angle": 1e-6}, {"hinge.angle": -1.0})
    found = mbd.simulate(model, start, scheme, tol=1e-6, until=1.0)
    assert abs(found.time[-1] - 1e-6) < 1e-12 and found.stats["tolerance"]["estimated"] <= 1e-6


def test_an_interrupted_trial_is_the_last_one():
    model, calls = pendulum(mbd.Viscous(0.1)), []

    def stopping(time, values, state):
        calls.append(time)
        if time > 0.0:
            raise KeyboardInterrupt
        return {}

    model.apply(mbd.Controller("stop", stopping, period=0.5))
    start = mbd.assemble(model, {"hinge.angle": 1.0})
    with pytest.raises(SimulationError, match="interrupted at t = 0.5 s"):
        mbd.simulate(model, start, EXPLICIT, tol=1e-6, until=2.0)
    assert calls == [0.0, 0.5]


@pytest.mark.parametrize("tol", [0.0, -1e-6, np.nan, np.inf, "small", True])
def test_a_tolerance_that_is_none_is_refused(tol):
    model, start, _, _ = reference("double pendulum")
    with pytest.raises(ModelError, match="tol must be a positive error"):
        mbd.simulate(model, start, EXPLICIT, tol=tol, until=1.0)


def test_one_of_dt_and_tol_is_given():
    model, start, _, _ = reference("double pendulum")
    with pytest.raises(ModelError, match="not both"):
        mbd.simulate(model, start, EXPLICIT, dt=0.01, tol=1e-6, until=1.0)
    with pytest.raises(ModelError, match="a step or a tolerance is needed"):
        mbd.simulate(model, start, EXPLICIT, until=1.0)


def test_every_step_is_stored():
    model, start, _, _ = reference("double pendulum")
    with pytest.raises(ModelError, match="use store=1"):
        mbd.simulate(model, start, EXPLICIT, tol=1e-6, until=1.0, store=10)


def test_schemes_and_strategies_that_follow_no_tolerance_are_refused_with_another():
    model, start, _, _ = reference("with rows")
    cases = [
        (mbd.HHT(0.05, formulation="index3"), {}, "formulation='ggl'"),
        (mbd.HHT(0.05, form="averaged"), {}, "dt="),
        (mbd.Newmark(0.31, 0.6), {}, "mbd.HHT"),
        (EXPLICIT, {"contact": "nonsmooth"}, "contact='events'"),
        (EXPLICIT, {"locate": "linear"}, "locate='root'"),
    ]
    for scheme, options, instead in cases:
        with pytest.raises(CapabilityError, match=instead):
            mbd.simulate(model, start, scheme, tol=1e-5, until=1.0, **options)


# the steps themselves -----------------------------------------------------------------------------------------------
def following(model, start, scheme, until, allowed=1e-6, backend="auto"):
    """A single run whose steps follow their error."""
    options = {
        "contact": "events", "impact": "newton", "locate": "root", "store": 1, "rest_speed": 1e-6, "backend": backend,
        "tol": allowed, "allowed": allowed, "longest": 0.1 * until,
    }  # fmt: skip
    return prepared(model, start, scheme, 1e-3, until, {}, options)


@pytest.mark.covering
@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("scheme", [*SCHEMES[:2], mbd.RadauIIA(tolerance=1e-13)], ids=repr)
def test_the_interpreted_kernel_takes_the_steps_of_the_compiled_one(scene, scheme):
    model, start, _, _ = reference(scene)
    fast, slow = (following(model, start, scheme, 0.3) for _ in range(2))
    assert fast.stepper.compiled
    slow.stepper.compiled, slow.stepper.scheme = False, InterpretedScheme(slow.stepper.own)
    one, two = (each.complete()[0] for each in (fast, slow))
    assert one.success and one.stats["rejected"] == two.stats["rejected"]
    np.testing.assert_allclose(one.time, two.time, rtol=0, atol=1e-9)
    np.testing.assert_allclose(one.record.q, two.record.q, rtol=0, atol=1e-9)


def test_the_plain_twin_takes_the_steps_of_the_compiled_kernel():
    model, start, _, _ = reference("with rows")
    for scheme, bound in ((EXPLICIT, 1e-9), (mbd.HHT(0.05, tolerance=1e-13), 1e-5)):
        one, two = (following(model, start, scheme, 0.3, backend=b).complete()[0] for b in ("auto", "python"))
        assert one.stats["compiled"] and not two.stats["compiled"] and len(one.time) == len(two.time)
        np.testing.assert_allclose(one.time, two.time, rtol=0, atol=bound)


@pytest.mark.parametrize("scheme", SCHEMES[:2], ids=repr)
def test_a_run_that_is_taken_back_takes_the_same_steps_again(scheme):
    """What the next step depends on is kept with the state: the same bits after going back."""
    model, start, _, _ = reference("walker")
    whole = following(model, start, scheme, 0.6)
    whole.kernel.chunk = 7  # many calls of the kernel, with a savepoint before each
    once = following(model, start, scheme, 0.6).complete()[0]
    again = whole.complete()[0]
    np.testing.assert_array_equal(once.time, again.time)
    np.testing.assert_array_equal(once.record.q, again.record.q)
    kept = {"clock", "q", "y", "rate", "aux", "slope"}
    assert kept <= set(TABLE.kept_reals) and "state" in TABLE.kept_integers


def test_a_run_goes_on_from_another_to_the_bit():
    """At an event both end a step: the run cut there equals the whole."""
    model, start, _, _ = reference("walker")
    whole = following(model, start, EXPLICIT, 0.9).complete()[0]
    event = next(e for e in whole.events if e.name == "right foot")
    first = following(model, start, EXPLICIT, 0.9)
    first.stop = "right foot"
    notify(first)
    head = first.complete()[0]
    assert head.time[-1] == event.time
    tail = following(model, head.final, EXPLICIT, 0.9).complete()[0]
    np.testing.assert_array_equal(tail.record.q[-1], whole.record.q[-1])


def test_a_box_tumbles_alike_with_fixed_steps_and_with_a_tolerance():
    settings = {"integrator": EXPLICIT, "until": 0.6}
    place, speed = {"place.y": 0.6, "place.angle": 0.3}, {"place.angle": 0.5, "place.x": 0.2}
    fixed = run(box(), place, speed, dt=2e-3, **settings)
    free = run(box(), place, speed, dt=None, tol=1e-8, **settings)
    assert [(e.name, e.kind) for e in free.events] == [(e.name, e.kind) for e in fixed.events]
    np.testing.assert_allclose([e.time for e in free.events], [e.time for e in fixed.events], rtol=0, atol=1e-8)
