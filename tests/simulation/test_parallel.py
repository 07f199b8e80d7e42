"""Models travel to other processes and threads; the same motion comes back."""

import pickle
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest

import mbd
from mbd.compile import mechanisms
from tests.simulation.mechanisms import ball, box, kneed_walker, kneed_walker_start, pendulum


def walk(model, start, dt=2e-3, until=1.2, **settings):
    """What a worker does: numbers and events of a run."""
    trajectory = mbd.simulate(model, start, mbd.HHT(0.05), dt=dt, until=until, **settings)
    events = [(event.time, event.name, event.kind, event.energy_loss) for event in trajectory.events]
    return trajectory.record.q.tobytes(), trajectory.record.lam.tobytes(), events


def assembled_there(model, slope):
    """A worker that assembles by itself, with a parameter of its own."""
    start = kneed_walker_start(model, parameters={"left thigh.mass": slope})
    return walk(model, start, until=0.4)


@pytest.mark.parametrize("make", [ball, box, pendulum, kneed_walker])
def test_models_states_and_integrators_pickle(make):
    model = make()
    copy = pickle.loads(pickle.dumps(model))
    assert copy.parameters == model.parameters and copy.describe() == model.describe()
    start = mbd.assemble(model, project=True, open=[contact.name for contact in model.contacts])
    same = pickle.loads(pickle.dumps(start))
    assert np.array_equal(same.q, start.q) and same.mode == start.mode and same.names == start.names
    assert pickle.loads(pickle.dumps(mbd.HHT(0.05))) == mbd.HHT(0.05)


def test_errors_pickle_with_their_sentences():
    with pytest.raises(mbd.ModelError) as caught:
        mbd.simulate(pendulum(), None, mbd.HHT(), dt=-1.0, until=1.0)
    assert pickle.loads(pickle.dumps(caught.value)).faults == caught.value.faults


def test_other_processes_compute_the_same_bits():
    walker = kneed_walker()
    start = kneed_walker_start(walker)
    here = walk(walker, start)
    assert assembled_there(walker, 0.5) == walk(walker, start, until=0.4)
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        there = [pool.submit(walk, walker, start) for _ in range(2)]
        own = [pool.submit(assembled_there, walker, slope) for slope in (0.5, 0.55)]
        assert [future.result() for future in there] == [here, here]
        same, other = (future.result() for future in own)
    assert same == assembled_there(walker, 0.5) and other != same


def test_a_failure_in_another_process_comes_back_with_its_sentence():
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        future = pool.submit(walk, pendulum(), "no state")
        with pytest.raises(mbd.ModelError, match="start must be a State"):
            future.result()


def end_that_sticks():
    """A rod whose end sticks where it lands, which no force that only pushes can do."""
    model = mbd.Model("rod")
    rod = mbd.RigidBody("rod", mass=1.0, inertia=1.0 / 12.0)
    model.connect(mbd.Planar("place", model.ground.origin, rod.origin))
    model.constrain(mbd.Unilateral("end", mbd.touchdown(rod.point(-0.5, 0.0))))
    return model, mbd.assemble(model, {"place.y": 1.0, "place.angle": 0.5})


def test_runs_and_failures_come_back_from_other_processes():
    model = ball(restitution=0.5)
    start = mbd.assemble(model, {"fall.displacement": 1.0})
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        good = pool.submit(mbd.simulate, model, start, mbd.HHT(0.05), 0.01, until=0.6)
        bad = pool.submit(mbd.simulate, *end_that_sticks(), mbd.HHT(0.05), 0.01, until=2.0)
        trajectory = good.result()
        with pytest.raises(mbd.SimulationError, match="no forces or impulses") as failed:
            bad.result()
    here = mbd.simulate(model, start, mbd.HHT(0.05), dt=0.01, until=0.6)
    np.testing.assert_array_equal(trajectory["fall.displacement"], here["fall.displacement"])
    assert trajectory.events[0].time == here.events[0].time and trajectory.success
    assert not failed.value.run.success and failed.value.run["end.gap"].min() > -1e-12
    np.testing.assert_array_equal(trajectory.final.q, here.final.q)


def test_threads_that_share_a_model_get_the_same_bits():
    alone = walk(*fresh())
    for _ in range(3):
        walker, start = fresh()
        mechanisms._BY_WORDS.clear()
        mechanisms._KNOWN.pop(walker, None)  # derived and compiled by the threads themselves
        with ThreadPoolExecutor(4) as pool:
            futures = [pool.submit(walk, walker, start) for _ in range(4)]
            results = [future.result() for future in futures]
        assert all(result == alone for result in results)


def fresh():
    walker = kneed_walker()
    return walker, kneed_walker_start(walker)


def test_threads_with_different_parameters_do_not_disturb_each_other():
    model = pendulum()
    start = mbd.assemble(model, {"hinge.angle": 1.0})
    lengths = [0.5, 1.5, 2.0, 2.5]

    def swing(length):
        return walk(model, start, until=2.0, parameters={"rod.length": length, "rod.center": length / 2})

    alone = [swing(length) for length in lengths]
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(swing, lengths)) == alone
    assert len({result[0] for result in alone}) == 4
