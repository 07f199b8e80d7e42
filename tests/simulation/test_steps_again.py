"""States between rows of explicit steps: by machine code as by the equations in numpy, which files have."""

import random

import numpy as np
import pytest

import mbd
from tests.fuzz.scenes import scene
from tests.fuzz.verdict import run_of
from tests.mechanisms_between_rows import KINDS

SCHEMES = mbd.RungeKutta853(), mbd.RungeKutta4()


def compare(run: mbd.Trajectory) -> int:
    """Compare states at places within the steps of a run; how many lie far from singular configurations."""
    columns = run._model_columns
    steps = columns._steps
    if steps is None or len(run.time) < 2:
        return 0
    assert steps.balance.between is not None
    times = np.random.default_rng(0).uniform(run.time[0], run.time[-1], 60)
    places = columns.grid.places(times)
    places = places.part(np.flatnonzero(places.step > 0.0))
    (ours, near), (theirs, beside) = steps._by_machine(columns.rows, places), steps._by_equations(columns.rows, places)
    np.testing.assert_array_equal(near, beside)
    for name, allowed in {"q": 1e-10, "v": 1e-9, "z": 1e-9, "a": 1e-7, "s": 1e-7, "lam": 1e-7}.items():
        one, other = getattr(ours, name)[~near], getattr(theirs, name)[~near]
        size = np.max(np.abs(other), initial=0.0)
        np.testing.assert_allclose(one, other, rtol=0.0, atol=allowed * (1.0 + size), err_msg=name)
    return int(np.sum(~near))


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
@pytest.mark.parametrize("kind", KINDS)
def test_machine_code_and_equations_take_the_same_steps_again(kind, scheme):
    compared = 0
    for seed in range(6):
        model, start = KINDS[kind](seed)
        compared += compare(mbd.simulate(model, start, scheme, dt=1e-2, until=0.3, on_failure="return"))
    assert compared > 50


def thrown(seed: int) -> tuple[mbd.Model, mbd.State]:
    """A plate that lands on smooth feet, with a pendulum between stops."""
    rng = random.Random(seed)
    model = mbd.Model(f"thrown {seed}")
    plate, rod = mbd.RigidBody("plate", mass=3.0, inertia=0.4), mbd.Link("rod", 0.8, 0.5, 0.25, 0.02)
    model.connect(mbd.Planar("place", model.ground.origin, plate.origin))
    for k, x in enumerate((-0.8, 0.1, 0.8)[: rng.choice([2, 3])]):
        foot = mbd.touchdown(plate.point(x, -0.2))
        model.constrain(mbd.Unilateral(f"foot {k}", foot, friction=0.0, restitution=rng.choice([0.0, 0.4])))
    hinge = mbd.Revolute("hinge", plate.point(0.0, 0.1), rod.start)
    model.connect(hinge)
    model.constrain(mbd.Unilateral("stop", mbd.extension(hinge, -0.3), restitution=rng.choice([0.0, 0.5])))
    position = {"place.y": 0.25 + rng.random(), "place.angle": rng.uniform(-0.1, 0.1), "hinge.angle": 0.4}
    return model, mbd.assemble(model, position, {"hinge.angle": rng.uniform(-2.0, 2.0)}, project=True)


def test_contacts_that_open_and_close():
    compared, events = 0, 0
    for seed in range(12):
        run = mbd.simulate(*thrown(seed), mbd.RungeKutta853(), dt=5e-3, until=0.8, on_failure="return")
        here = compare(run)
        compared, events = compared + here, events + len(run.events) * (here > 0)
    assert compared > 300 and events > 30


DRIVEN = 10095074, 10095095, 10095104, 10095128, 10095143, 10095154


@pytest.mark.filterwarnings("ignore::mbd.MbdWarning")
@pytest.mark.parametrize("numbers", [DRIVEN, pytest.param(range(10095200, 10095260), marks=pytest.mark.slow)])
def test_driven_mechanisms_and_their_files_agree_between_rows_by_every_scheme(numbers, tmp_path):
    """Steps over jumps in time, and steps so large that they miss what drives prescribe."""
    compared = 0
    for number in numbers:
        made = scene(number, 100000)
        try:
            run = run_of(made)
        except mbd.MbdError:
            continue
        times = np.random.default_rng(number).uniform(*run.time[[0, -1]], 17)
        ours, theirs = (each.at(times).read(*run.names) for each in (run, mbd.load(run.save(tmp_path / "run"))))
        for name, expected in theirs.items():
            size = 1e-3 + np.max(np.abs(expected))
            np.testing.assert_allclose(ours[name], expected, rtol=0.0, atol=1e-6 * size, err_msg=f"{number} {name}")
        compared += 1
    assert compared > 0.8 * len(numbers)
