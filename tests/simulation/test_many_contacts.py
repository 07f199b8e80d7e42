"""Many contacts, many modes, other doors: what a run does not mind."""

import numpy as np
import pytest

import mbd
from mbd.kernel.contact import nonsmooth, nonsmooth_cones
from mbd.kernel.stepping import restart
from tests.integrators.test_order import started
from tests.kernel.test_twin import served_pendulum
from tests.simulation.mechanisms import G, run


def balls(heights, **law):
    model = mbd.Model("balls")
    for k, _ in enumerate(heights):
        body = mbd.PointMass(f"ball {k}", mass=1.0 + k)
        model.connect(mbd.Prismatic(f"fall {k}", model.ground.origin, body.origin, axis=(0, 1, 0)))
        model.constrain(mbd.Unilateral(f"floor {k}", mbd.height(body.origin), **law))
    return model, {f"fall {k}.displacement": height for k, height in enumerate(heights)}


def test_code_is_made_only_for_the_modes_that_occur():
    model, position = balls([0.1, 0.2, 0.3, 0.4, 0.5])
    trajectory = run(model, position)
    assert trajectory.stats["modes"] == 6, "of 32 that could"


def test_more_modes_than_were_foreseen_are_no_trouble():
    """Six balls hop on drives of different frequencies: more than sixteen combinations stand and fly."""
    model, position = balls([0.0] * 6)
    for k in range(6):
        body = next(b for b in model.bodies.values() if b.name == f"ball {k}")
        model.apply(
            mbd.Applied(
                f"kick {k}", body.origin,
                force=(0.0, lambda t, k=k: 1.3 * G * (1.0 + k) * mbd.maximum(mbd.sin((3.0 + 1.3 * k) * t), 0.0), 0.0),
            )
        )  # fmt: skip
    trajectory = run(model, position, closed=[f"floor {k}" for k in range(6)], dt=5e-3, until=8.0)
    assert trajectory.stats["modes"] > 16
    for k in range(5):
        alone, start = balls([0.0])
        body = next(b for b in alone.bodies.values() if b.name == "ball 0")
        alone.apply(
            mbd.Applied("kick", body.origin,
                        force=(0.0, lambda t, k=k: 1.3 * G * mbd.maximum(mbd.sin((3.0 + 1.3 * k) * t), 0.0), 0.0))
        )  # fmt: skip
        single = run(alone, start, closed=["floor 0"], dt=5e-3, until=8.0)
        mine = [event.time for event in trajectory.events if event.name == f"floor {k}"]
        np.testing.assert_allclose(mine[:6], [event.time for event in single.events][:6], atol=2e-4)


def test_results_longer_than_the_kernels_store_are_whole():
    trajectory = run(*balls([100.0]), dt=1e-4, until=3.0)
    assert len(trajectory.time) == 30_001
    np.testing.assert_allclose(trajectory["fall 0.displacement"], 100.0 - 0.5 * G * trajectory.time**2, rtol=1e-9)


@pytest.mark.parametrize("period", [None, 0.0137])
def test_index_3_does_not_ring_after_steps_cut_by_a_controller(period):
    model, start = started("double pendulum in absolute coordinates")
    model.controllers = [] if period is None else [mbd.Controller("clock", lambda t, v, s: None, period=period)]
    scheme = mbd.HHT(0.1, formulation="index3")
    coarse = mbd.simulate(model, start, scheme, dt=5e-3, until=1.0)
    model.controllers = []
    fine = mbd.simulate(model, start, mbd.HHT(0.1), dt=2e-4, until=1.0)
    np.testing.assert_allclose(coarse.record.lam[-1], fine.record.lam[-1], atol=6e-3)
    np.testing.assert_allclose(coarse.record.q[-1], fine.record.q[-1], atol=2e-4)


def test_a_lagrangian_runs_with_forces_losses_and_constraints():
    sympy = pytest.importorskip("sympy")
    x, y = mbd.Coordinate("x", unit="m"), mbd.Coordinate("y", unit="m")
    model = mbd.Lagrangian(
        "bead", [x, y], kinetic=0.5 * (x.v**2 + y.v**2), potential=G * y.q, dissipation=0.05 * (x.v**2 + y.v**2),
        forces={"x": lambda t: 0.1 * mbd.sin(t)}, constraints={"ring": sympy.sqrt(x.q**2 + y.q**2) - 1},
    )  # fmt: skip
    start = mbd.assemble(model, {"x": 0.6})
    trajectory = mbd.simulate(model, start, mbd.HHT(0.05), dt=1e-3, until=1.0)
    np.testing.assert_allclose(trajectory["x"] ** 2 + trajectory["y"] ** 2, 1.0, atol=1e-10)
    bad = mbd.simulate(
        mbd.Lagrangian("bad", [x], kinetic=0.5 * x.v**2, forces={"x": lambda t: mbd.sqrt(0.5 - t)}),
        mbd.assemble(mbd.Lagrangian("bad", [x], kinetic=0.5 * x.v**2, forces={"x": lambda t: mbd.sqrt(0.5 - t)})),
        mbd.HHT(0.05), dt=0.01, until=1.0, on_failure="return",
    )  # fmt: skip
    assert not bad.success and bad.time[-1] == pytest.approx(0.5) and "x" in bad.message


def test_a_first_order_state_follows_its_equation_and_can_be_reset():
    """Without the pendulum's motion entering (gain 0) the torque decays like exp(−t/τ)."""
    model = served_pendulum()
    trajectory = run(model, {"hinge.angle": 0.3}, dt=1e-3, until=0.2, parameters={"drive.gain": 0.0})
    np.testing.assert_allclose(trajectory["drive.torque"], 0.5 * np.exp(-trajectory.time / 0.05), atol=2e-5)
    assert run(model, {"hinge.angle": 0.3, "drive.torque": 2.0}, until=0.0)["drive.torque"][0] == 2.0
    model = served_pendulum()
    model.constrain(mbd.Event("jolt", mbd.measure(lambda t: t - 0.1, "t"), reset=lambda named: {"drive.torque": 3.0}))
    jolted = run(model, {"hinge.angle": 0.3}, dt=1e-3, until=0.2)
    assert jolted.at(0.1, side="right")["drive.torque"] == 3.0


@pytest.mark.parametrize("pushed", [0.0, 3.0], ids=["standing", "sliding"])
def test_steps_in_which_nothing_pulls_or_slips_look_at_no_forces_of_clusters(pushed, monkeypatch):
    """The round-off of forces is asked for only of a contact that pulls, or friction beyond its limit: not of each."""
    asked = list[int]()

    def counted(K, row):
        asked.append(row)
        return restart.largest_force(K, row)

    for module in (nonsmooth, nonsmooth_cones):
        monkeypatch.setattr(module, "largest_force", counted, raising=False)
    model = mbd.Model("points on the ground")
    for k in range(3):
        point = mbd.PointMass(f"point {k}", 1.0)
        model.connect(mbd.Translation(f"place {k}", model.ground.origin, point.origin))
        model.constrain(mbd.Unilateral(f"contact {k}", mbd.touchdown(point.origin), friction=0.2))
        model.apply(mbd.Applied(f"push {k}", point.origin, force=(pushed, 0.0, 0.0)))
    start = mbd.assemble(model, closed=[f"contact {k}" for k in range(3)], velocity={"place 0.x": pushed})
    found = mbd.simulate(model, start, dt=0.01, until=0.1, contact="nonsmooth", backend="python", progress=False)
    assert found["contact 2.force"][-1] == pytest.approx(G, rel=1e-9)
    assert not asked or pushed  # those that begin to slide are beyond their limits once
    assert len(asked) <= 4
