"""Sweeps and batches keep vectors, quaternions and Euler angles by their one name, discrete states by their number."""

import numpy as np
import pytest

import mbd

NAMES = ("tip.euler.zxy", "tip.angular_velocity", "tip.orientation", "top.center", "kinetic_energy")


def test_a_vector_by_name_is_kept_by_its_components():
    """Each is what the single run has at its end, in a sweep and in a batch."""
    model, body = mbd.Model("top"), mbd.RigidBody("top", 0.7, (0.004, 0.003, 0.002), center=(0.0, 0.0, 0.12))
    model.connect(mbd.Spherical("tip", model.ground.origin, body.origin))
    start = mbd.assemble(
        model,
        position={"tip.orientation": ("xyz", (-1.2, 0.1, 0.3))},
        velocity={"tip.angular_velocity": (0.3, 0.2, 40.0)},
    )
    scheme, masses = mbd.RungeKutta853(), [0.6, 0.7]
    sweep = mbd.sweep(model, {"top.mass": masses}, start, NAMES, integrator=scheme, dt=2e-3, until=0.05)
    batch = mbd.batch(model, start, scheme, 2e-3, until=0.05, parameters={"top.mass": masses}, results=NAMES)
    run = mbd.simulate(model, start, scheme, dt=2e-3, until=0.05)
    endings = {3: "xyz", 4: "wxyz"}
    for name in NAMES:
        end = np.atleast_1d(run[name][-1])
        parts = "123" if "euler" in name else endings.get(end.size)
        titles = [name] if parts is None else [f"{name}.{part}" for part in parts]
        assert [sweep.results[title][1] for title in titles] == end.tolist()
        assert [batch.results[title][1] for title in titles] == end.tolist()
    with pytest.raises(mbd.UnknownNameError, match="no result named 'tip.eulr.zxy'"):
        mbd.sweep(model, {"top.mass": masses}, start, ["tip.eulr.zxy"], integrator=scheme, dt=2e-3, until=0.05)


def test_a_discrete_state_is_kept_and_written_as_its_number(tmp_path):
    """Tables have its words; columns of numbers, and files of OpenSim, where it stands among its states."""
    model, rod = mbd.Model("clock"), mbd.Link("rod", 1.0, length=1.0, center=0.5)
    model.connect(mbd.Revolute("pin", model.ground.origin, rod.start))
    turn = mbd.Event("turn", mbd.measure(lambda a: a + 10.0, "pin.angle"), reset={"pin.angle": "pin.angle"})
    model.apply(mbd.Mode("phase", ("first", "second"), transitions=[mbd.Transition("first", "second", after=0.2)]))
    start, how = mbd.assemble(model, {"pin.angle": 0.4}), {"dt": 0.01, "until": 0.3}
    run = mbd.simulate(model, start, **how)
    assert list(run["phase"][[0, -1]]) == ["first", "second"]
    assert mbd.sweep(model, {"rod.mass": [1.0, 2.0]}, start, ["phase"], **how).results["phase"] == (1.0, 1.0)
    assert list(mbd.batch(model, [start], **how, results=["phase"]).results["phase"]) == [1.0]
    model.constrain(turn)  # whose runs are made one by one
    assert list(mbd.batch(model, [start], **how, results=["phase"]).results["phase"]) == [1.0]
    read = mbd.read(run.to_sto(tmp_path / "run.sto", ["phase", "pin.angle"]))
    assert list(read["phase"][[0, -1]]) == [0.0, 1.0]
