"""A run that was saved and read again gives the same bits, at rows and between them."""

import pickle
from collections.abc import Sequence

import numpy as np
import pytest

import mbd
from mbd.errors import MbdError, TrajectoryError
from mbd.hardcases.schemes import SCHEMES
from mbd.results.expressions import OPERATIONS
from mbd.testing.mechanisms import random_scene
from tests.mechanisms_between_rows import KINDS

TIMES = np.linspace(0.0, 0.2, 23)


def same(one: mbd.Trajectory, other: mbd.Trajectory, singly: Sequence[str] | None = None) -> None:
    """Every named result at rows, events and violation, to the bit; what lies between rows, and energies that are
    integrated there, to round-off, as a file has no machine code.

    singly : those that are asked for one by one, each by a function of its own; by default all
    """
    assert one.names == other.names
    np.testing.assert_array_equal(one.time, other.time)

    def equal(ours: np.ndarray, theirs: np.ndarray, name: str) -> None:
        largest = one[name] if name in one.names else ours
        if largest.dtype.kind in "US":
            np.testing.assert_array_equal(ours, theirs, err_msg=name)
            return
        size = 1.0 + np.max(np.abs(largest))
        np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=1e-9 * size, err_msg=name)

    times = np.linspace(one.time[0], one.time[-1], 23)
    for side in ("left", "right"):
        ours, theirs = one.at(times, side=side).read(*one.names), other.at(times, side=side).read(*one.names)
        for name in one.names:
            equal(ours[name], theirs[name], name)
    for name in one.names if singly is None else singly:
        np.testing.assert_array_equal(one[name], other[name], err_msg=name)
    for part, there in zip(one.energy.parts, other.energy.parts, strict=True):
        assert (part.name, part.kind) == (there.name, there.kind)
        equal(part.energy, there.energy, part.name)
    equal(one.energy.numerical, other.energy.numerical, "numerical")
    assert [repr(event) for event in one.events] == [repr(event) for event in other.events]
    assert one.violation == other.violation and repr(one.energy) == repr(other.energy)
    assert (one.name, one.message, one.parameters) == (other.name, other.message, other.parameters)
    assert one.settings == other.settings and one.stats == other.stats and repr(one) == repr(other)
    assert one.final.mode == other.final.mode and np.array_equal(one.final.q, other.final.q)


@pytest.mark.covering
@pytest.mark.parametrize("name", ["HHT", "RadauIIA", "RungeKutta853"])
@pytest.mark.parametrize("kind", KINDS)
def test_a_saved_run_gives_the_same_bits_everywhere(kind, name, tmp_path):
    model, start = KINDS[kind](0)
    run = mbd.simulate(model, start, SCHEMES[name](), dt=1e-2, until=0.2)
    once = mbd.load(run.save(tmp_path / "once"))
    same(run, once)
    same(run, mbd.load(once.save(tmp_path / "twice")))


@pytest.mark.parametrize("seed", range(6))
def test_a_saved_scene_with_contacts_and_losses_gives_the_same_bits_everywhere(seed, tmp_path):
    model = random_scene(seed, 2)
    scheme = SCHEMES[list(SCHEMES)[seed % len(SCHEMES)]]()
    run = mbd.simulate(model, mbd.assemble(model), scheme, dt=5e-3, until=0.2, on_failure="return")
    same(run, mbd.load(run.save(tmp_path / "run")))


@pytest.mark.parametrize("scheme", [mbd.HHT(), mbd.RadauIIA(), mbd.RungeKutta853()], ids=repr)
def test_a_file_knows_the_sides_of_forces_and_motions_that_jump_in_time(scheme, tmp_path):
    """Accelerations up to a jump were those of a line towards what is behind it, off by 7 of 11 rad/s²."""
    model, _ = KINDS["tree"](1)
    joints = [joint for joint in model.joints if isinstance(joint, mbd.Revolute)]
    model.apply(mbd.Motor("motor", joints[0], torque=lambda t: mbd.where(t < 0.0537, 2.0, -1.0)))
    cart = mbd.PointMass("cart", 1.0)
    model.connect(mbd.Prismatic("rail", model.ground.origin, cart.origin))
    motion = mbd.Samples([0.0, 0.04, 0.1234], [0.0, 0.1, 0.3], ends="clamped")
    model.constrain(mbd.Bilateral("drive", mbd.measure("rail.displacement"), value=motion))
    run = mbd.simulate(model, mbd.assemble(model), scheme, dt=0.015, until=0.2)
    once = mbd.load(run.save(tmp_path / "once"))
    same(run, once)
    same(run, mbd.load(once.save(tmp_path / "twice")))
    assert run.at(0.0536)["motor.torque"] == once.at(0.0536)["motor.torque"] == 2.0


def test_stored_rows_apart_changed_parameters_tables_and_pickles_do_the_same(tmp_path):
    model, start = KINDS["loop"](1)
    times, heights = [0.0, 0.05, 0.2], [0.0, 1.0, -1.0]
    model.apply(mbd.Applied("push", model.bodies["bar 1"].end, force=(mbd.Samples(times, heights), 0.0)))

    def soften(t, values, state):
        return {"spring.stiffness": 3.0 + t}

    model.observe("height", mbd.height(model.bodies["bar 1"].end))
    model.apply(mbd.Controller("softer", soften, period=0.05, writes=("spring.stiffness",)))
    run = mbd.simulate(model, start, mbd.RadauIIA(), dt=2e-3, store=3, until=0.2)
    assert run.record.parameter_changes
    same(run, mbd.load(run.save(tmp_path / "run")))
    same(run, pickle.loads(pickle.dumps(run)))


def test_names_that_were_not_saved_are_unknown_and_the_others_are_the_same(tmp_path):
    model, start = KINDS["redundant"](0)
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=1e-2, until=0.2)
    few = mbd.load(run.save(tmp_path / "few", names=["P3.reaction_torque", "P1.angle"]))
    for name in ("P3.reaction_torque", "P1.angle"):
        np.testing.assert_allclose(few.at(TIMES)[name], run.at(TIMES)[name], rtol=1e-12, atol=1e-12)
    with pytest.raises(MbdError, match="no result named 'P2.angle'"):
        few.at(0.1)["P2.angle"]


def test_a_file_without_expressions_is_interpolated_and_a_changed_graph_is_refused(tmp_path, monkeypatch):
    from mbd.results import storage

    model, start = KINDS["redundant"](0)
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=1e-2, until=0.2)
    write = storage.write

    def older(target, arrays, meta):
        arrays = {name: array for name, array in arrays.items() if not name.startswith(("graph", "table"))}
        write(target, arrays, meta | {"expressions": None})

    def with_graph(change):
        def changed(target, arrays, meta):
            change(arrays["graph"])
            write(target, arrays, meta)

        return changed

    monkeypatch.setattr(storage, "write", older)
    old = mbd.load(run.save(tmp_path / "old"))
    np.testing.assert_allclose(old.at(TIMES)["P1.angle"], run.at(TIMES)["P1.angle"], atol=1e-9)

    def forward(graph):
        graph[-1, 1] = len(graph)

    def unknown(graph):
        graph[-1, 0] = len(OPERATIONS)

    def beyond(graph):
        graph[graph[:, 0] == OPERATIONS.index("input"), 5] = 10**6

    for change in (forward, unknown, beyond):
        monkeypatch.setattr(storage, "write", with_graph(change))
        path = run.save(tmp_path / change.__name__)
        with pytest.raises(TrajectoryError, match="graph"):
            mbd.load(path)
