"""A step that fails leaves everything as it was; what it failed of can be repeated; an interrupt keeps the rest."""

import subprocess
import sys
from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st

import mbd
from mbd.integrators import StepReport, StepResult
from mbd.testing.mechanisms import random_scene
from tests.helpers import one_body
from tests.integrators.own import ProjectedMidpoint
from tests.simulation.cut_runs import PARTS, assert_halves_are_the_whole
from tests.simulation.mechanisms import ball, falling, pendulum, point, run

ROOT = next(path for path in sys.path if path)


def wounded(model, until):
    """The model with a force that is no number any more after some time, and nothing but a push before."""
    body = list(model.bodies.values())[-1]

    def force(t, place):  # the place hides that the condition is one of time alone, at which a step would end
        return mbd.where(t + 1e-300 * place[0] <= until, mbd.sin(3.0 * t), mbd.sqrt(until - t))

    push = mbd.Applied(
        "wound", body.origin, force=lambda t, p: (force(t, p), force(t, p)), torque=force, arguments=("t", body.origin)
    )
    model.apply(push)
    return model


def assert_untouched(failed, model, start, **how):
    """The end of a failed run is that of a run which was never asked for more, and its last row is that state."""
    kept, last = failed.final, failed.record
    good = mbd.simulate(model, start, **{**how, "until": kept.time, "on_failure": "raise"})
    for part in PARTS:
        np.testing.assert_array_equal(getattr(last, part), getattr(good.record, part), err_msg=part)
    for part in ("q", "v", "z", "anchors"):
        np.testing.assert_array_equal(getattr(kept, part), getattr(good.final, part), err_msg=part)
    assert (kept.time, kept.mode, kept.armed) == (good.final.time, good.final.mode, good.final.armed)
    assert kept.memory.belongs == good.final.memory.belongs and kept.memory.digest == good.final.memory.digest
    np.testing.assert_array_equal(kept.memory.reals, good.final.memory.reals)
    np.testing.assert_array_equal(kept.memory.integers, good.final.memory.integers)
    assert_last_row(failed)


def assert_last_row(failed):
    """The last row is the state kept, multipliers and contacts too."""
    kept, last = failed.final, failed.record
    assert last.time[-1] == kept.time
    closed = {c.name for c, flag in zip(failed.record.equations.contacts, last.closed[-1], strict=True) if flag}
    assert closed == kept.mode.closed
    np.testing.assert_array_equal(last.q[-1], kept.q)
    np.testing.assert_array_equal(last.v[-1], kept.v)


# what a failed step leaves behind -------------------------------------------------------------------------------------
@settings(max_examples=10, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    until=st.floats(0.05, 0.5),
    scheme=st.sampled_from([mbd.HHT(0.05), mbd.GeneralizedAlpha(0.7), mbd.HHT(0.1, formulation="index3")]),
    store=st.sampled_from([1, 1, 1, 5]),
)
def test_a_force_that_fails_leaves_the_state_and_a_cure_goes_on_as_if_nothing_had_been(seed, until, scheme, store):
    ill, well = wounded(random_scene(seed), until), wounded(random_scene(seed), 1e3)
    start = mbd.assemble(well, open=[contact.name for contact in well.contacts], project=True)
    how = {"integrator": scheme, "dt": 5e-3, "until": 0.6}
    whole = mbd.simulate(well, start, **how, on_failure="return")
    assume(all(abs(event.time - until) > 1e-3 for event in whole.events))  # a start looks a little ahead
    failed = mbd.simulate(ill, start, **how, on_failure="return", store=store)
    if whole.success:
        assert not failed.success and "'wound'" in failed.message
        assert until - 0.011 < failed.final.time <= until
    if store == 1 and failed.final.memory is not None:
        assert_untouched(failed, ill, start, **how)
    cured = mbd.simulate(well, failed.final, **how, on_failure="return")
    assert cured.stats["restarts"] == 0 or cured.events
    np.testing.assert_array_equal(cured.record.q, whole.record.q[len(whole.time) - len(cured.time) :])
    if store == 1:
        assert_halves_are_the_whole(whole, failed, cured)
    again = mbd.replay(failed.failure)
    assert again.reproduced and again.message == failed.message
    assert mbd.replay(failed.failure, model=well, steps=3).passed or not whole.success


def stiff(backend="auto", jump=1e9):
    """A wall that is a jump of the force, of 1e9 N: Newton's method cycles."""
    model, body = one_body(mbd.PointMass("body", mass=1.0), mbd.Prismatic, "x", title="wall", gravity=(0, 0, 0))
    wall = mbd.Applied(
        "wall", body.origin, force=lambda p: (mbd.where(p[0] > 0.5, -jump, 0.0), 0, 0), arguments=(body.origin,)
    )
    model.apply(wall)
    return model, mbd.assemble(model, velocity={"x.displacement": 1.0}, backend=backend)


def stuck(backend="auto"):
    """The end of a rod that sticks where it lands: no force holds it that does not pull."""
    model, rod = one_body(mbd.RigidBody("rod", mass=1.0, inertia=1.0 / 12.0), mbd.Planar, "place")
    model.constrain(mbd.Unilateral("tip", mbd.touchdown(rod.point(-0.5, 0.0))))
    return model, mbd.assemble(model, {"place.y": 0.8 + 0.5 * np.sin(0.5), "place.angle": 0.5}, backend=backend)


def repeating(backend="auto"):
    """A ball that a user's event throws up again and again, ever less."""
    model, body = falling()
    reset = {"fall.rate": lambda named: -0.5 * named["fall.rate"]}
    model.constrain(mbd.Event("bounce", mbd.height(body.origin), direction=-1, reset=reset))
    return model, mbd.assemble(model, {"fall.displacement": 1.0}, backend=backend)


CAUSES = {"stiff": (stiff, "stalled"), "chatter": (repeating, "switches"), "impact": (stuck, "no forces or impulses")}


@pytest.mark.parametrize("backend", ["auto", "python"])
@pytest.mark.parametrize("cause", CAUSES)
def test_whatever_fails_leaves_the_state_before_its_step(cause, backend):
    make, said = CAUSES[cause]
    model, start = make(backend)
    how = {"dt": 0.01, "until": 2.0, "backend": backend, "rest_speed": 0.0}
    failed = mbd.simulate(model, start, **how, on_failure="return")
    assert not failed.success and said in failed.message
    assert_last_row(failed)
    if cause != "chatter":  # of events at one instant, a run that ends there has the first
        assert_untouched(failed, model, start, **how)
    assert mbd.replay(failed.failure).reproduced
    again = mbd.simulate(model, failed.final, **how, on_failure="return")
    assert said in again.message and len(again.time) == 1


@pytest.mark.parametrize("what", ["reset", "conflicting reset", "listener", "sample", "not a number"])
def test_a_function_of_the_users_that_fails_is_called_again_when_the_run_goes_on(what):
    """Its cure needs no new model here, so that the run goes on as if it had never failed."""
    ill = {"now": False}

    def fault(value):
        if ill["now"]:
            wrong = {"conflicting reset": {"fall.rate": 5.0, "fall.displacement": -3.0}, "not a number": float("nan")}
            return wrong[what] if what in wrong else {}["lost"]
        return value

    model, body = falling()
    model.tunable = ("lift.force.y",)
    model.apply(mbd.Applied("lift", body.origin, force=(0.0, 0.0, 0.0)))
    if what == "conflicting reset":
        model.constrain(mbd.Bilateral("rail", mbd.measure("fall.displacement"), value=lambda t: 0.3 - t))
        model.constrain(mbd.Event("bounce", mbd.height(body.origin), reset=lambda named: fault({})))
    elif what == "reset":
        thrown = {"fall.rate": lambda named: fault(-0.8 * named["fall.rate"])}
        model.constrain(mbd.Event("bounce", mbd.height(body.origin), direction=-1, reset=thrown))
    else:
        when = {"on": ("floor",)} if what == "listener" else {"period": 0.061}
        model.constrain(mbd.Unilateral("floor", mbd.height(body.origin), restitution=0.5))

        def update(t, values, count):
            count["calls"] += 1
            force = fault(0.1 * count["calls"]) if t > 0.2 else 0.0
            return {"lift.force.y": force}, count

        model.apply(mbd.Controller("brain", update, **when, writes="lift.force.y", state={"calls": 0}))
    start = mbd.assemble(model, {"fall.displacement": 0.3})
    how = {"dt": 0.01, "until": 0.8, "on_failure": "return"}
    whole = mbd.simulate(model, start, **how)
    ill["now"] = True
    failed = mbd.simulate(model, start, **how)
    assert not failed.success and mbd.replay(failed.failure).reproduced
    ill["now"] = False
    cured = mbd.simulate(model, failed.final, **how)
    assert whole.success and cured.success
    assert_halves_are_the_whole(whole, failed, cured)


def test_a_cure_by_parameters_goes_on_as_a_run_that_had_them_changed_there():
    """Other parameters are another motion: the scheme starts from the state kept."""
    model, body = falling()
    gasp = mbd.Applied(
        "gasp", body.origin, force=lambda t, limit: (0.0, mbd.sqrt(limit - t), 0.0), arguments=("t", ("limit", 0.5))
    )
    model.apply(gasp)
    start = mbd.assemble(model, {"fall.displacement": 1.0})
    failed = mbd.simulate(model, start, dt=0.01, until=1.0, on_failure="return")
    assert failed.final.time == pytest.approx(0.5)
    half = mbd.simulate(model, start, dt=0.01, until=failed.final.time)
    cure = {"gasp.limit": 2.0}
    cured = [mbd.simulate(model, run.final, dt=0.01, until=1.0, parameters=cure) for run in (failed, half)]
    for part in PARTS:
        np.testing.assert_array_equal(getattr(cured[0].record, part), getattr(cured[1].record, part))
    assert cured[0].success and cured[0].stats["restarts"] == 1


def test_a_start_that_fails_is_the_end():
    """A penalty that is no number at once: not even accelerations exist."""
    model, body = falling()
    model.apply(mbd.Applied("late", body.origin, force=(0.0, lambda t: mbd.sqrt(1.0 - t), 0.0)))
    start = replace(mbd.assemble(model, {"fall.displacement": 1.0}), time=2.0)
    failed = mbd.simulate(model, start, dt=0.01, until=3.0, on_failure="return")
    assert not failed.success and failed.final.time == 2.0
    np.testing.assert_array_equal(failed.final.q, start.q)
    assert mbd.replay(failed.failure).reproduced


# the capsule ----------------------------------------------------------------------------------------------------------
def test_a_failure_says_what_was_tried_and_what_was_left_over():
    model, start = stiff()
    with pytest.raises(mbd.SimulationError) as caught:
        mbd.simulate(model, start, dt=0.01, until=1.0)
    failure = caught.value.run.failure
    assert isinstance(failure, mbd.Failure) and failure.message == str(caught.value)
    assert failure.time == failure.state.time == 0.5 < failure.attempted < 0.51
    assert failure.candidate.time == failure.attempted and failure.iterations % 6 == 0
    assert abs(failure.residuals["x.displacement"]) > 1e8 and failure.dt == 0.01 and failure.model is model
    assert "x.displacement" in repr(failure) and "0.5" in repr(failure)
    with pytest.raises(AttributeError):
        failure.dt = 1.0
    assert mbd.simulate(model, start, dt=0.01, until=0.4).failure is None


def test_a_replay_shows_every_iteration_by_name():
    model, body = point()
    model.constrain(mbd.Bilateral("rod", mbd.distance(model.ground.point(0.0, 2.0), body.origin), value=1.5))
    model.apply(mbd.Applied("gasp", body.origin, force=(lambda t: mbd.sqrt(0.5 - t), 0.0, 0.0)))
    failed = run(model, {"place.x": 0.5}, on_failure="return")
    for replayed in (mbd.replay(failed.failure), mbd.replay(failed.failure, dt=1e-3, steps=2)):
        assert not replayed.passed
        first = replayed.tries[0].iterations[0]
        assert set(first.balance) == {"place.x", "place.y"} and len(first.rows) == len(first.rates) == 1
    assert "'rod'" in repr(replayed) and "place.x" in repr(replayed) and "try 1" in repr(replayed)
    model, start = stiff()
    failure = mbd.simulate(model, start, dt=0.01, until=1.0, on_failure="return").failure
    replayed = mbd.replay(failure)
    counts = [len(one.iterations) for one in replayed.tries]
    assert len(counts) == 6 and min(counts) == max(counts) > 10, "a full step and five shortened ones"
    assert sum(counts) == failure.iterations, "an iterate for each correction, whose halves are none of their own"
    assert any(iterate.halvings for one in replayed.tries for iterate in one.iterations)
    sizes = [(one.time - failure.time) / failure.dt for one in replayed.tries]
    np.testing.assert_allclose(sizes, 0.6180339887498949 ** np.arange(6), rtol=1e-9)


def test_a_replay_tells_whether_another_step_or_scheme_goes_through():
    """A jump of the force leaves long implicit steps without a balance; short ones pass it, and short explicit ones.

    The body turns round within 2 ms: 1 m/s against 1000 m/s².
    """
    model, start = stiff(jump=1e3)
    failed = mbd.simulate(model, start, dt=0.1, until=2.0, on_failure="return")
    assert not failed.success and mbd.replay(failed.failure).reproduced
    finer = mbd.replay(failed.failure, dt=1e-5, steps=500)
    assert finer.passed and "goes through" in repr(finer) and finer.run.stats["steps"] == 500
    assert finer.run.final["x.displacement"] < 0.5 and finer.run.final["x.rate"] == pytest.approx(-1.0, abs=0.05)
    assert not mbd.replay(failed.failure, integrator=mbd.RungeKutta853()).passed
    other = mbd.replay(failed.failure, integrator=mbd.RungeKutta853(), dt=1e-3)
    assert other.passed and not other.reproduced
    assert "steps are explicit" in repr(other)
    alike = mbd.replay(failed.failure, integrator=mbd.GeneralizedAlpha(0.5))
    assert not alike.passed and alike.message


def test_a_failure_of_a_whole_run_is_told_as_one_of_no_step():
    """An explicit scheme turns a body round at a wall by its steps' size; the energy of all rows tells."""
    model, start = stiff(jump=1e5)
    failure = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.003, until=1.0, on_failure="return").failure
    assert "Failure of the run to t = 1 s" in repr(failure) and "numerical energy gain" in failure.message
    assert "no step failed: the run was judged as a whole" in repr(mbd.replay(failure))


def test_a_wall_that_only_stages_meet_is_told():
    """Four stages err by what their embedded estimate, of the last one and the end, does not see."""
    model, start = stiff(jump=1e4)
    met = mbd.simulate(model, start, mbd.RungeKutta4(), dt=0.01, until=1.0, on_failure="return")
    assert not met.success and "a step of 0.01 s takes the rate of 'x.displacement'" in met.message


def clean_failure(**settings):
    """Of a model that pickles."""
    model, start = stuck()
    return mbd.simulate(model, start, **{"dt": 0.01, "until": 2.0, "on_failure": "return", **settings})


@pytest.mark.parametrize("scheme", [mbd.HHT(0.1), mbd.GeneralizedAlpha(0.8, formulation="index3"), ProjectedMidpoint()])
def test_a_failure_goes_into_a_file_and_is_repeated_from_it(scheme, tmp_path):
    failure = clean_failure(integrator=scheme).failure
    path = failure.save(tmp_path / "stuck")
    assert path.name == "stuck.failure.npz"
    with pytest.raises(mbd.TrajectoryError, match=r"a pickle may run any code; give the model.*trusted=True"):
        mbd.replay(path)
    assert mbd.replay(path, trusted=True).reproduced
    own = {"integrator": scheme} if isinstance(scheme, ProjectedMidpoint) else {}
    assert mbd.replay(path, model=stuck()[0], **own).reproduced, "the pickle is not needed"


def test_a_file_without_a_model_asks_for_it(tmp_path):
    model = wounded(falling()[0], 0.3)
    failure = run(model, on_failure="return").failure
    path = failure.save(tmp_path / "wound.npz")
    with pytest.raises(mbd.TrajectoryError, match="model=model"):
        mbd.replay(path)
    assert mbd.replay(path, model=model).reproduced
    with pytest.raises(FileNotFoundError, match="no failure file"):
        mbd.replay(tmp_path / "nothing.npz")
    with pytest.raises(mbd.TrajectoryError, match="not a run"):
        mbd.load(path)
    with pytest.raises(mbd.TrajectoryError, match="not a failure"):
        mbd.replay(run(falling()[0]).save(tmp_path / "run"))
    with pytest.raises(mbd.ModelError, match=r"run\.failure"):
        mbd.replay(None)


def test_a_failure_travels_with_its_run(tmp_path):
    failed = clean_failure()
    kept = mbd.load(failed.save(tmp_path / "run")).failure
    assert kept.message == failed.message and kept.model is None and kept.integrator == failed.failure.integrator
    assert [e.name for e in kept.events] == [e.name for e in failed.failure.events]
    with pytest.raises(mbd.ModelError, match="model=model"):
        mbd.replay(kept)
    assert mbd.replay(kept, model=stuck()[0]).reproduced


# interrupts -----------------------------------------------------------------------------------------------------------
def test_a_run_interrupted_by_an_observer_goes_on_to_the_bit():
    model = pendulum()
    start = mbd.assemble(model, {"hinge.angle": 1.0})
    calls = []

    def impatient(t, state):
        calls.append(t)
        if len(calls) == 2:
            raise KeyboardInterrupt

    how = {"dt": 1e-5, "store": 1000}
    first = mbd.simulate(model, start, **how, until=1e3, observers=[impatient], on_failure="return")
    assert not first.success and "interrupted" in first.message and first.final.time == calls[1] > 0.0
    until = first.final.time + 0.5
    second = mbd.simulate(model, first.final, **how, until=until)
    np.testing.assert_array_equal(second.final.q, mbd.simulate(model, start, **how, until=until).final.q)


@dataclass(frozen=True)
class Interrupted(ProjectedMidpoint):
    """Ctrl-C in the middle of a step, with the state half changed."""

    at: float = 0.333

    def step(self, system, state, dt, mode, memory):
        if ARMED and state.time > self.at:
            ARMED.pop()
            raise KeyboardInterrupt
        result = super().step(system, state, dt, mode, memory)
        return StepResult(result.state, result.memory, StepReport(True, 1))


ARMED: list[bool] = []


def test_ctrl_c_in_the_middle_of_a_step_leaves_the_last_accepted_state():
    model = ball(restitution=0.6)
    start = mbd.assemble(model, {"fall.displacement": 0.3})
    how = {"integrator": Interrupted(), "dt": 1e-3, "until": 0.6, "on_failure": "return"}
    whole = mbd.simulate(model, start, **how)
    ARMED.append(True)
    first = mbd.simulate(model, start, **how)
    assert whole.success and not first.success and 0.0 < first.final.time < 0.34
    assert_halves_are_the_whole(whole, first, mbd.simulate(model, first.final, **how))


PROGRAM = """
import mbd, numpy as np
from tests.simulation.mechanisms import kneed_walker, kneed_walker_start
walker = kneed_walker()
start = kneed_walker_start(walker)
mbd.simulate(walker, start, dt=1e-3, until=0.01)
print("ready", flush=True)
how = {"dt": 1e-6, "store": 10**5, "on_failure": "return"}
first = mbd.simulate(walker, start, **how, until=20.0)
until = first.final.time + 0.1
second = mbd.simulate(walker, first.final, **how, until=until)
whole = mbd.simulate(walker, start, **how, until=until)
same = all(np.array_equal(getattr(second.final, part), getattr(whole.final, part)) for part in ("q", "v", "anchors"))
events = len(first.events) + len(second.events) == len(whole.events)
print(first.success, first.message, len(first.time) > 1, same and events and second.success)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGINT between processes there")
def test_a_signal_to_another_process_keeps_its_run_which_goes_on_to_the_bit():
    import signal
    import threading
    import time

    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM], stdout=subprocess.PIPE, text=True, cwd=ROOT, env=None
    ) as process:
        late = threading.Timer(300.0, process.kill)
        late.start()
        assert process.stdout is not None and process.stdout.readline() == "ready\n"
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        told = process.stdout.read()
        late.cancel()
    assert told.startswith("False interrupted at t = ") and told.endswith("kept True True\n"), told
