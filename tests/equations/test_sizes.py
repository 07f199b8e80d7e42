"""Models whose equations do not fit into the free memory are refused before anything is derived."""

import numpy as np
import pytest

import mbd
from mbd.assembly import foreseen
from mbd.compile.mechanisms import mechanism_of
from mbd.equations import programs, sizes
from mbd.topology.plan import plan
from tests.simulation.test_transactions import stiff

pytestmark = pytest.mark.usefixtures("made_afresh")  # of programs that are made in other ways


def chain(count, axis=(0.0, 0.0, 1.0), spread=1, **more):
    """Links that follow each other, or `spread` such chains beside each other."""
    model = mbd.Model("chain", **more)
    ends = [model.ground.origin] * spread
    for k in range(count):
        link = mbd.RigidBody(f"link {k}", 0.01, (1e-6, 2e-6, 2e-6))
        turned = tuple(np.roll(axis, k % 2))
        model.connect(mbd.Revolute(f"hinge {k}", ends[k % spread], link.origin, axis=axis if axis[2] else turned))
        ends[k % spread] = link.point(1e-3, 0.0, 0.0)
    return model


@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (1.0, 1.0, 0.0)], ids=["planar", "spatial"])
@pytest.mark.parametrize("spread", [1, 4])
def test_the_size_predicted_is_that_of_the_equations_within_a_factor_of_three(axis, spread):
    model = chain(24, axis, spread)
    mbd.assemble(model)
    made = len(mechanism_of(model).equations.tape.nodes)
    assert made / 3.0 < sizes.operations(plan(model)) < 3.0 * made


def test_a_chain_that_does_not_fit_is_refused_at_once_with_its_figure(monkeypatch):
    monkeypatch.setattr(sizes, "available", lambda: 2e8)
    monkeypatch.setattr(foreseen, "weighted_velocities", lambda *_: pytest.fail("the refusal comes first"))
    figure = r"(?s)1000 bodies and 1000 joints.*268 MB and 0\.12 minutes.*200 MB.*cut='all'"
    with pytest.raises(mbd.ModelError, match=figure):
        mbd.assemble(chain(1000))
    sizes.require_room(plan(chain(1000, spread=100)))
    sizes.require_room(plan(chain(1000, cut="all")))


def test_chains_of_usual_length_ask_for_no_memory(monkeypatch):
    def asked():
        raise AssertionError

    monkeypatch.setattr(sizes, "available", asked)
    sizes.require_room(plan(chain(200)))


@pytest.mark.parametrize("count", [6, 25], ids=["factors in straight-line code", "factors in loops"])
def test_implicit_steps_whose_tangent_does_not_fit_are_refused_before_it_is_derived(monkeypatch, count):
    model = chain(count)
    start = mbd.assemble(model)
    derived = len(mechanism_of(model).equations.tape.nodes)
    monkeypatch.setattr(sizes, "MIN_CHECKED_OPERATIONS", 1e3)
    monkeypatch.setattr(sizes, "available", lambda: 0.9 * sizes.BYTES_OF_TANGENT * derived)
    with pytest.raises(mbd.ModelError, match=r"tangent of implicit steps needs at least .* MB.*RungeKutta853"):
        mbd.simulate(model, start, mbd.HHT(0.05), dt=1e-3, until=0.01)
    assert len(mechanism_of(model).equations.tape.nodes) == derived
    assert mbd.simulate(model, start, mbd.RungeKutta853(), dt=1e-3, until=0.01).success


def test_explicit_steps_derive_no_tangent_that_does_not_fit(monkeypatch):
    """Not even for an order of elimination, which would pay for chains beside each other."""
    model = chain(24, spread=4)
    start = mbd.assemble(model)
    monkeypatch.setattr(sizes, "MIN_CHECKED_OPERATIONS", 1e3)
    monkeypatch.setattr(sizes, "available", lambda: 1.0)
    monkeypatch.setattr(programs, "newton", lambda *_: pytest.fail("it needs none"))
    assert mbd.simulate(model, start, mbd.RungeKutta853(), dt=1e-3, until=0.005).success


@pytest.mark.parametrize("backend", ["llvm", "python"])
def test_a_tangent_that_a_run_needs_late_ends_it_with_what_it_has(monkeypatch, backend):
    """Factors in straight-line code suffice until a wall is met; plain Python has none, and is told at once."""
    model, start = stiff(backend)
    rooms = iter([1e12])
    monkeypatch.setattr(sizes, "MIN_CHECKED_OPERATIONS", 0.0)
    monkeypatch.setattr(sizes, "available", lambda: next(rooms, 1.0))
    if backend == "python":
        next(rooms)
        with pytest.raises(mbd.ModelError, match="tangent of implicit steps needs"):
            mbd.simulate(model, start, mbd.HHT(0.05), dt=0.01, until=1.0, backend=backend)
        return
    with pytest.raises(mbd.MemoryLimitError, match="needs the tangent as a matrix.* MB of memory is free") as told:
        mbd.simulate(model, start, mbd.HHT(0.05), dt=0.01, until=1.0, backend=backend)
    assert told.value.run.time[-1] == pytest.approx(0.5)


def test_a_contact_that_closes_without_room_for_its_tangent_ends_the_run_with_what_it_has(monkeypatch):
    model, body = mbd.Model("ball"), mbd.PointMass("ball", mass=1.0)
    model.connect(mbd.Translation("flight", model.ground.origin, body.origin))
    model.constrain(mbd.Unilateral("floor", mbd.touchdown(body.origin)))
    start = mbd.assemble(model, {"flight.y": 0.1})
    rooms = iter([1e12])
    monkeypatch.setattr(sizes, "MIN_CHECKED_OPERATIONS", 0.0)
    monkeypatch.setattr(sizes, "available", lambda: next(rooms, 1.0))
    with pytest.raises(mbd.MemoryLimitError, match="tangent of implicit steps needs") as told:
        mbd.simulate(model, start, mbd.HHT(0.05), dt=0.01, until=1.0)
    assert 0.13 < told.value.run.time[-1] < 0.15
