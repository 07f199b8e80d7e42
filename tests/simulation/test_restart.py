"""A run that is cut in two is the same run: to the bit, with everything that the next step depends on."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.testing.mechanisms import random_scene
from tests.integrators.own import ProjectedMidpoint, SemiImplicitEuler
from tests.simulation.cut_runs import SCENES, assert_halves_are_the_whole, driven_point, halves, scene
from tests.simulation.mechanisms import ball, falling, kneed_walker, kneed_walker_start, pendulum, run

SCHEMES = {
    "hht": mbd.HHT(0.05),
    "generalized alpha": mbd.GeneralizedAlpha(0.8),
    "newmark": mbd.Newmark(),
    "hht index 3": mbd.HHT(0.1, formulation="index3"),
    "textbook start": mbd.HHT(0.1, start="consistent"),
    "radau": mbd.RadauIIA(),
}


def cuts(whole, seed, count):
    """Rows at which to cut: the ends, both sides of the first events, those after short steps, some others."""
    rng, last = np.random.default_rng(seed), len(whole.time) - 1
    events = [row for event in whole.events[:3] for row in (event.row - 1, event.row)]
    steps = np.diff(whole.time)
    short = 1 + np.flatnonzero((steps > 0.0) & (steps < 0.99 * steps.max()))[:2]
    return sorted({0, last, *events, *short.tolist(), *rng.integers(1, last, count).tolist()})


@pytest.mark.covering
@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("name", SCENES)
def test_two_halves_are_the_whole_to_the_bit_also_by_a_file(name, scheme, tmp_path):
    (model, start), how = scene(name), {"dt": SCENES[name].dt, "until": SCENES[name].until}
    whole = mbd.simulate(model, start, SCHEMES[scheme], **how)
    for place, row in enumerate(cuts(whole, 1, 2)):
        between = (lambda state: state, lambda state: pickle.loads(pickle.dumps(state)))[place % 2]
        first, second = halves(model, start, SCHEMES[scheme], whole.time[row], between, **how)
        assert_halves_are_the_whole(whole, first, second)
    kept = mbd.load(first.save(tmp_path / "half")).final
    assert_halves_are_the_whole(whole, first, mbd.simulate(model, kept, SCHEMES[scheme], **how))


@pytest.mark.covering
@pytest.mark.parametrize("scheme", [mbd.HHT(0.05), mbd.RadauIIA(), ProjectedMidpoint(), SemiImplicitEuler()], ids=repr)
@pytest.mark.parametrize("name", ["bouncing ball", "redundant cranks", "controller and signal", "ball on rubber"])
def test_two_halves_in_plain_python_are_the_whole_too(name, scheme):
    (model, start), how = scene(name), {"dt": 4.0 * SCENES[name].dt, "until": 0.5, "backend": "python"}
    whole = mbd.simulate(model, start, scheme, **how)
    for row in cuts(whole, 2, 1):
        assert_halves_are_the_whole(whole, *halves(model, start, scheme, whole.time[row], **how))


@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 10**6), part=st.floats(0.0, 1.0))
def test_halves_of_random_mechanisms_over_the_ground_are_the_whole(seed, part):
    model = random_scene(seed)
    start = mbd.assemble(model, open=[contact.name for contact in model.contacts], project=True)
    how = {"dt": 5e-3, "until": 0.6, "on_failure": "return"}
    whole = mbd.simulate(model, start, mbd.GeneralizedAlpha(0.8), **how)
    row = round(part * (len(whole.time) - 1))
    assert_halves_are_the_whole(whole, *halves(model, start, mbd.GeneralizedAlpha(0.8), whole.time[row], **how))


@pytest.mark.parametrize("pause", [0.3, 0.7, 1.1, 1.3])
def test_a_round_number_of_seconds_cuts_on_the_grid(pause):
    """A sum of steps differs from it by round-off; the step is the same, its row has the time that was asked for."""
    model, start = scene("pendulum")
    whole = mbd.simulate(model, start, dt=1e-3, until=2.0)
    first, second = halves(model, start, mbd.HHT(0.05), pause, dt=1e-3, until=2.0)
    assert first.time[-1] == first.final.time == second.time[0] == pause
    np.testing.assert_array_equal(second.record.q, whole.record.q[len(first) - 1 :])
    np.testing.assert_array_equal(second.time[1:], whole.time[len(first) :])


def test_a_cut_between_the_instants_of_the_grid_goes_on_to_second_order():
    """The step cut short is not one of the whole run: no bits, but no start of the scheme either."""
    model, start = scene("pendulum")
    whole = mbd.simulate(model, start, dt=1e-3, until=1.0)
    first, second = halves(model, start, mbd.HHT(0.05), 0.50037, dt=1e-3, until=1.0)
    assert first.stats["restarts"] == 1 and second.stats["restarts"] == 0
    assert first.stats["steps"] == 501 and len(first.time) == 502
    np.testing.assert_allclose(second.record.q[-1], whole.record.q[-1], atol=1e-6)


def test_what_would_happen_within_a_step_after_the_end_is_not_counted():
    model, start = scene("bouncing ball")
    landing = mbd.simulate(model, start, dt=0.01, until="floor").time[-1]
    short = mbd.simulate(model, start, dt=0.01, until=landing - 1e-3)
    assert short.events == [] and short.final.mode.closed == frozenset()
    assert (short.stats["events"], short.stats["impacts"], short.stats["restarts"]) == (0, 0, 1)
    assert short.time[-1] == landing - 1e-3
    assert mbd.simulate(model, short.final, dt=0.01, until=1.0).events[0].time == pytest.approx(landing, abs=1e-9)


def test_a_run_that_ends_with_an_event_goes_on_to_the_bit():
    model, start = scene("kneed walker")
    whole = mbd.simulate(model, start, dt=2e-3, until=1.2)
    first = mbd.simulate(model, start, dt=2e-3, until="right foot")
    assert_halves_are_the_whole(whole, first, mbd.simulate(model, first.final, dt=2e-3, until=1.2))


@pytest.mark.parametrize("name", ["bouncing ball", "controller and signal"])
def test_a_stride_goes_on_where_it_was(name):
    model, start = scene(name)
    how = {"dt": SCENES[name].dt, "until": SCENES[name].until}
    every = mbd.simulate(model, start, **how)
    whole = mbd.simulate(model, start, store=7, **how)
    for cut in every.time[[10, 24, 40]]:
        first, second = halves(model, start, mbd.HHT(0.05), cut, store=7, **how)
        times = np.concatenate([first.time, second.time])
        assert set(whole.time) <= set(times) and len(times) <= len(whole.time) + 2
        np.testing.assert_array_equal(second.record.q[-1], whole.record.q[-1])


# when a memory counts -----------------------------------------------------------------------------------------------
def restarted(model, state, scheme=None, dt=0.01, **more):
    """How often the scheme of a run that goes on was started."""
    going_on = mbd.simulate(model, state, scheme or mbd.HHT(0.05), dt=dt, until=state.time + 0.1, **more)
    return going_on.stats["restarts"]


@pytest.mark.parametrize("seen", [True, False])
def test_a_memory_is_used_only_where_everything_is_as_it_was(seen):
    """Whether somebody has looked at it, so that it has a seal and is examined, or not."""
    model = pendulum(loss=mbd.Viscous(0.1))

    def end():
        final = run(model, {"hinge.angle": 1.0}, until=0.5).final
        assert not seen or final.memory is not None
        return final

    final = end()
    assert restarted(model, final) == 0
    assert ("memory" in vars(final)) == seen
    assert restarted(model, final, store=3, observers=[lambda t, state: None]) == 0
    assert restarted(model, final, parameters={"rod.mass": 1.0}) == 0, "the value that it has anyway"
    changed = {
        "scheme": restarted(model, end(), mbd.HHT(0.06)),
        "formulation": restarted(model, end(), mbd.HHT(0.05, formulation="index3")),
        "tolerance": restarted(model, end(), mbd.HHT(0.05, tolerance=1e-10)),
        "step": restarted(model, end(), dt=0.005),
        "backend": restarted(model, end(), backend="python"),
        "option": restarted(model, end(), rest_speed=1e-3),
        "parameter": restarted(model, end(), parameters={"hinge loss.coefficient": 0.2}),
        "position": restarted(model, replace(end(), q=final.q + 1e-16 + 1e-15)),
        "velocity": restarted(model, replace(end(), v=final.v * (1.0 + 1e-15))),
        "time": restarted(model, replace(end(), time=0.0)),
        "no memory": restarted(model, replace(end(), memory=None)),
    }
    assert changed == dict.fromkeys(changed, 1)


def test_a_memory_is_not_used_by_a_model_that_was_changed():
    model = pendulum()
    final = run(model, {"hinge.angle": 1.0}, until=0.5).final
    (hinge,) = model.joints
    model.apply(mbd.Motor("drive", hinge, torque=3.0))
    assert restarted(model, final) == 1
    going_on = mbd.simulate(model, final, dt=0.01, until=0.6)
    assert going_on["hinge.acceleration"][0] == pytest.approx(-1.5 * 9.81 * np.sin(final["hinge.angle"]) + 9.0)


def test_a_contact_opened_by_hand_makes_the_memory_void():
    final = run(ball(), {"fall.displacement": 0.5}, until=0.6).final
    assert final.mode.closed == {"floor"} and restarted(ball(), final) == 0
    assert restarted(ball(), replace(final, mode=type(final.mode)())) == 1


def test_controllers_go_on_whatever_the_scheme_and_its_steps():
    """They count their calls; only another state, or another controller, makes the count begin again."""
    counts = []

    def counting(period=0.1):
        model = pendulum()
        update = lambda t, values, n: (counts.append((n, round(t, 9))), ({}, n + 1))[1]  # noqa: E731
        model.apply(mbd.Controller("count", update, period=period, state=0))
        return model

    model, how = counting(), {"dt": 0.05, "backend": "python"}
    start = mbd.assemble(model, position={"hinge.angle": 1.0})
    final = mbd.simulate(model, start, until=0.45, **how).final

    def first(model, state, **more):
        counts.clear()
        notes = mbd.simulate(model, state, until=0.7, **{**how, **more}).stats["notes"]
        return *counts[0], any("controllers restarted" in note for note in notes)

    ways = ({}, {"dt": 0.025}, {"integrator": mbd.RadauIIA()}, {"dt": None, "tol": 1e-3}, {"backend": "llvm"})
    assert [first(model, final, **way) for way in ways] == [(5, 0.5, False)] * len(ways)
    assert first(model, final, parameters={"rod.mass": 2.0}) == (5, 0.5, False)
    assert first(model, replace(final, q=final.q + 0.1)) == (0, 0.45, True)
    assert first(counting(0.05), final) == (0, 0.45, True)
    assert first(model, start) == (0, 0.0, False)


def test_a_run_to_a_tolerance_goes_on_with_the_memory_of_its_controllers():
    """A force of the place now and of the place before, which only the controller knows; halves of the same length."""
    model = mbd.Model("cart", gravity=(0.0, 0.0, 0.0), tunable=("push.force.x",))
    cart = mbd.PointMass("cart", mass=1.0)
    model.connect(mbd.Prismatic("rail", model.ground.origin, cart.origin))
    update = lambda t, values, last: (  # noqa: E731
        {"push.force.x": -30.0 * values["rail.displacement"] + 10.0 * last}, values["rail.displacement"]
    )  # fmt: skip
    model.apply(
        mbd.Applied("push", cart.origin, force=(0.0, 0.0, 0.0)),
        mbd.Controller("c", update, period=0.05, reads=("rail.displacement",), writes=("push.force.x",), state=1.0),
    )
    start, how = mbd.assemble(model, position={"rail.displacement": 1.0}), {"backend": "python"}
    whole = mbd.simulate(model, start, dt=0.01, until=2.0, **how)
    for scheme in (mbd.RungeKutta853(), mbd.GeneralizedAlpha(0.8)):
        first = mbd.simulate(model, start, scheme, tol=1e-5, until=1.0, **how)
        second = mbd.simulate(model, first.final, scheme, tol=1e-5, until=2.0, **how)
        assert second["rail.displacement"][-1] == pytest.approx(whole["rail.displacement"][-1], abs=1e-6)
        assert len(second.stats["tolerance"]["runs"]) == len(first.stats["tolerance"]["runs"])


def test_a_model_made_again_in_the_same_words_takes_the_memory():
    walker = kneed_walker()
    final = mbd.simulate(walker, kneed_walker_start(walker), dt=2e-3, until=0.8).final
    assert restarted(kneed_walker(), final, dt=2e-3) == 0


# kept and sent ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scheme", [mbd.HHT(0.05), mbd.RadauIIA(), mbd.RungeKutta853()], ids=repr)
def test_a_file_keeps_the_memory_of_every_scheme_that_steps_in_python(scheme, tmp_path):
    model = pendulum(loss=mbd.Viscous(0.1))
    start = mbd.assemble(model, position={"hinge.angle": 1.0})
    how = {"integrator": scheme, "dt": 0.02, "backend": "python"}
    whole = mbd.simulate(model, start, until=0.4, **how)
    first = mbd.simulate(model, start, until=whole.time[9], **how)
    kept = mbd.load(first.save(tmp_path / "half")).final
    assert kept.memory is not None and type(kept.memory.scheme) is type(first.final.memory.scheme)
    second = mbd.simulate(model, kept, until=0.4, **how)
    assert second.stats["restarts"] == 0
    np.testing.assert_array_equal(second["hinge.angle"], whole["hinge.angle"][9:])


def test_what_a_file_cannot_keep_starts_the_scheme_anew(tmp_path):
    class Phase:
        """A state of the user's own."""

    model = pendulum()
    model.apply(mbd.Controller("walk", lambda t, values, state: ({}, Phase()), period=0.05))
    first = run(model, {"hinge.angle": 1.0}, until=0.5)
    assert restarted(model, first.final) == 0
    kept = mbd.load(first.save(tmp_path / "half")).final
    assert kept.memory is None and restarted(model, kept) == 1
    np.testing.assert_array_equal(kept.q, first.final.q)


def test_states_of_controllers_are_not_shared_between_runs():
    model = driven_point()
    (hold,) = model.controllers
    first = run(model, {"rail.displacement": 0.5}, until=0.5)
    again = [mbd.simulate(model, first.final, dt=0.01, until=1.0).record.q for _ in range(2)]
    np.testing.assert_array_equal(again[0], again[1])
    assert hold.state == {"calls": 0}


def test_dense_samples_are_stepped_over_wherever_a_run_begins():
    model, body = falling()
    times = np.linspace(0.0, 1.0, 201)
    push = mbd.Samples(times, np.sin(7.0 * times), kind="linear")
    model.apply(mbd.Applied("push", body.origin, force=(0.0, push, 0.0)))
    start = mbd.assemble(model)
    whole = mbd.simulate(model, start, dt=0.01, until=2.0)
    assert whole.stats["restarts"] == 1 and len(whole.time) == 201
    assert_halves_are_the_whole(whole, *halves(model, start, mbd.HHT(0.05), whole.time[80], dt=0.01, until=2.0))
