"""The kernel with derivatives is the same as machine code and read as Python, which share their rules alone."""

import numpy as np
import pytest

import mbd
from benchmarks.walkers import kneed_walker
from mbd.dataclass import makes_late
from mbd.sensitivity.derivative import final_state_derivative
from mbd.sensitivity.starts import Completion
from mbd.sensitivity.tangent_run import WRITTEN_FIRST, TangentStepper
from mbd.testing.mechanisms import random_loop, random_scene
from tests.simulation.mechanisms import pendulum

CLOSE = {"tolerance": 1e-12}
SCHEMES = (
    mbd.HHT(alpha=0.05, **CLOSE), mbd.GeneralizedAlpha(0.7, **CLOSE), mbd.HHT(0.1, formulation="index3", **CLOSE),
    mbd.Newmark(start="consistent", **CLOSE), mbd.RungeKutta853(), mbd.RadauIIA(**CLOSE), mbd.RungeKutta4(),
)  # fmt: skip


def both(model, start, scheme, names, **settings):
    return [
        np.vstack(final_state_derivative(mbd.simulate(model, start, scheme, backend=backend, **settings), names))
        for backend in ("llvm", "python")
    ]


def test_steps_of_random_scenes():
    """With contacts that close, hold and slide; directions of the start and of parameters."""
    compared = 0
    for seed in range(9):
        model, scheme = random_scene(seed, bodies=2), SCHEMES[seed % 4]
        try:
            start = mbd.assemble(model)
            run = mbd.simulate(model, start, scheme, dt=5e-3, until=0.1)
            names = [*start.names, *run.record.parameter_names[:6]]
            found, wanted = both(model, start, scheme, names, dt=5e-3, until=0.1)
        except (mbd.SimulationError, mbd.AssemblyError, mbd.CapabilityError):
            continue  # a scene without a run, or a run without derivatives
        compared += 1
        assert found == pytest.approx(wanted, rel=1e-7, abs=1e-8 * np.max(np.abs(wanted))), (seed, scheme)
    assert compared >= 3


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_steps_of_closed_loops(scheme):
    model, place = random_loop(2)
    start = mbd.assemble(model, place, project=True)
    found, wanted = both(model, start, scheme, ["hinge 1.angle"], dt=0.01, until=0.03)
    assert found == pytest.approx(wanted, rel=1e-7, abs=1e-8 * np.max(np.abs(wanted)))


@pytest.mark.parametrize("scheme", [SCHEMES[0], *SCHEMES[4:]], ids=repr)
def test_interpreted_as_compiled(scheme):
    model = pendulum()
    start = mbd.assemble(model, {"hinge.angle": 1.0})
    found = both(model, start, scheme, ["hinge.angle", "rod.center"], dt=0.05, until=0.5)
    assert found[0] == pytest.approx(found[1], rel=1e-12)


def test_derivatives_of_a_run_that_separates_exponentially_are_those_of_this_run():
    """Seven links for 8 s: values with derivatives are those of the run to the bit, or they would end elsewhere."""
    model = mbd.Model("chain", gravity=(0.0, -9.81, 0.0))
    at = model.ground.origin
    for k in range(5):
        rod = mbd.Link(f"rod {k}", mass=1.0, length=0.3, center=0.15, inertia=0.0075)
        model.connect(mbd.Revolute(f"pin {k}", at, rod.start))
        at = rod.end
    start = mbd.assemble(model, {f"pin {k}.angle": 0.9 * k for k in range(5)})
    run = mbd.simulate(model, start, mbd.HHT(0.05), dt=2e-3, until=8.0)
    state, time = final_state_derivative(run, start.names)
    assert np.isfinite(state).all() and not time.any()
    assert np.max(np.abs(state)) > 1e3  # how far neighbouring runs are apart


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_no_run_reads_what_an_earlier_one_left_in_large_arrays(scheme, monkeypatch):
    """NaN in the place of their derivatives changes no bit, neither of a closed loop nor of feet that strike."""
    begin_again, poisoned = TangentStepper.begin_again, []

    def poison(self, *given):
        begin_again(self, *given)
        poisoned.append(self)
        for name in WRITTEN_FIRST:
            self.tangent(name)[:] = np.nan

    loop, place = random_loop(2)
    for model, start, until in (
        (loop, mbd.assemble(loop, place, project=True), 0.05),
        (*kneed_walker(), "right foot"),
    ):
        names = [start.names[-1], *mbd.simulate(model, start, scheme, dt=0.01, until=0.02).parameters][:5]
        found = []
        for begin in (begin_again, begin_again, poison):
            monkeypatch.setattr(TangentStepper, "begin_again", begin)
            found.append(mbd.simulate(model, start, scheme, dt=0.01, until=until, wrt=names).sensitivities.matrix)
        monkeypatch.setattr(TangentStepper, "begin_again", begin_again)
        np.testing.assert_array_equal(found[2], found[1])
        assert np.isfinite(found[2]).all()
    assert len(poisoned) == 2


def test_a_run_with_derivatives_finds_notes_and_memory_when_somebody_asks():
    model = pendulum()
    run = mbd.simulate(model, mbd.assemble(model, {"hinge.angle": 1.0}), dt=0.01, until=0.1, wrt=["hinge.angle"])
    assert makes_late(run.record, "stats") is not None and makes_late(run.final, "memory") is not None
    assert run.sensitivities["hinge.angle", "hinge.angle"] == run.stats["sensitivities"]["matrix"][0][0]
    assert run.stats["notes"] == [] and run.sensitivities.of_units == ("rad", "rad/s", "s")
    again = mbd.simulate(model, run.final, dt=0.01, until=0.2, wrt=["hinge.angle.rate"])
    assert again.time[0] == run.time[-1]


@pytest.mark.parametrize("seed", range(6))
def test_a_start_is_completed_by_the_least_change_whichever_rows_depend_on_others(seed):
    """In the metric of M: M-orthogonal to all changes that the rows allow; with rows twice it is the same."""
    rng = np.random.default_rng(seed)
    A, B, off = rng.normal(size=(6, 6)), rng.normal(size=(3, 6)), rng.normal(size=(3, 4))
    M, free = A @ A.T + np.eye(6), np.arange(6) != seed
    change = Completion(M, B, free).change(off)
    np.testing.assert_allclose(B @ change, -off, atol=1e-13)
    twice = Completion(M, np.vstack([B, B[1] - B[2]]), free).change(np.vstack([off, off[1] - off[2]]))
    np.testing.assert_allclose(twice, change, atol=1e-9)
    allowed = np.linalg.svd(B[:, free])[2][3:].T
    np.testing.assert_allclose(allowed.T @ M[np.ix_(free, free)] @ change[free], 0.0, atol=1e-6 * np.abs(M).max())
    assert not change[~free].any()
