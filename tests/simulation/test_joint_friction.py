"""Dry friction in joints, in chains and loops; tables and pictures of it."""

import numpy as np
import pytest

import mbd
from tests.simulation.frictions import check_friction, four_bar
from tests.simulation.mechanisms import pendulum, run


# joints -------------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("cut", ["auto", "all"])
@pytest.mark.parametrize("formulation", ["ggl", "index3"])
def test_dry_pins_of_a_four_bar_stop_it_for_good(cut, formulation):
    model = four_bar(mbd.Coulomb(0.6), cut)
    scheme = mbd.HHT(0.05, formulation=formulation)
    trajectory = run(model, {"pin 0.angle": 0.9}, {"pin 0.angle": 3.0}, until=2.0, dt=5e-3, integrator=scheme)
    assert abs(trajectory["pin 0.rate"][-1]) < 1e-9
    rest = trajectory["pin 0.angle"][trajectory.events[-1].row :]
    np.testing.assert_allclose(rest, rest[0], rtol=0, atol=1e-12)
    check_friction(model, trajectory, *((1e-6, 1e-9) if formulation == "ggl" else (1e-2, 1e-2)))


def test_the_cut_of_a_four_bar_with_dry_pins_does_not_change_its_motion():
    angles = []
    closed = {"pin 0.angle": 0.9, "pin 1.angle": 1.8796872436635348, "pin 2.angle": -2.4200554058977284}
    for cut in "auto", "all":
        model = four_bar(mbd.Coulomb(0.3), cut)
        trajectory = run(model, closed, {"pin 0.angle": 3.0}, until=1.0, dt=1e-3)
        angles.append(trajectory.at(np.linspace(0.1, 0.9, 9))["pin 0.angle"])
    np.testing.assert_allclose(*angles, rtol=0, atol=2e-5)


def test_pin_friction_in_a_four_bar_is_that_of_the_force_in_each_pin():
    model = four_bar(mbd.PinFriction(0.3, 0.05))
    trajectory = run(model, {"pin 0.angle": 0.9}, {"pin 0.angle": 3.0}, until=1.0, dt=2e-3)
    for pin in ("pin 0", "pin 1", "pin 2", "pin 3"):
        force = np.linalg.norm(trajectory[f"{pin}.reaction_force"], axis=-1)
        friction, rate = trajectory[f"{pin}.friction"], trajectory[f"{pin}.rate"]
        assert np.all(np.abs(friction) <= 0.3 * 0.05 * force * (1 + 1e-6) + 1e-9)
        slides = np.abs(rate) > 1e-4
        np.testing.assert_allclose(np.abs(friction[slides]), 0.3 * 0.05 * force[slides], rtol=1e-6)
        assert np.all(friction * rate <= 1e-9)
    assert trajectory.energy["pin 0 friction"][-1] < 0.0
    check_friction(model, trajectory)


def test_friction_of_no_size_costs_nothing_and_changes_no_bit():
    plain = str(pendulum().cost())
    assert plain == str(pendulum(mbd.Coulomb(0.0)).cost()) == str(pendulum(mbd.PinFriction(0.0, 0.1)).cost())
    rubs = pendulum(mbd.Coulomb(0.1)).cost()
    assert plain != str(rubs) and rubs.newton == pendulum().cost().newton and rubs.frictions["hinge friction"] > 0
    runs = [run(pendulum(loss), {"hinge.angle": 1.0}) for loss in (None, mbd.Coulomb(0.0), mbd.PinFriction(0.0, 0.1))]
    for other in runs[1:]:
        np.testing.assert_array_equal(runs[0].record.q, other.record.q)
        np.testing.assert_array_equal(runs[0].record.a, other.record.a)


def test_pin_friction_that_was_left_out_cannot_be_had_at_run_time():
    """It would need the joint to be cut; the name is unknown rather than without effect."""
    model = pendulum(mbd.PinFriction(0.0, 0.1))
    with pytest.raises(mbd.MbdError, match=r"hinge loss\.mu"):
        mbd.simulate(model, mbd.assemble(model), dt=0.01, until=0.1, parameters={"hinge loss.mu": 0.2})
