"""Laws of every loss, and what single losses do."""

import math

import numpy as np
import pytest
import sympy

import mbd
from mbd.errors import ModelError
from mbd.testing import check_loss
from mbd.testing.losses import force_at
from tests.instances import LOSSES

every_loss = pytest.mark.parametrize("factory", [factory for _, factory in LOSSES], ids=[name for name, _ in LOSSES])


@every_loss
def test_every_loss_keeps_the_laws(factory):
    assert len(check_loss(factory).laws) >= 8


def test_losses_add():
    both = mbd.Viscous(2.0) + mbd.Quadratic(3.0) + mbd.Viscous(1.0)
    assert force_at(both, 2.0) == pytest.approx(2.0 * 2.0 + 3.0 * 4.0 + 2.0)
    assert list(both.parameters("knee loss")) == [
        "knee loss.viscous.coefficient", "knee loss.quadratic.coefficient", "knee loss.viscous 2.coefficient",
    ]  # fmt: skip


def test_smoothed_friction_approaches_its_torque():
    assert force_at(mbd.Coulomb(2.0, smoothing=0.01), 5.0) == pytest.approx(2.0, rel=1e-5)
    assert force_at(mbd.Coulomb(2.0, smoothing=0.01), -5.0) == pytest.approx(-2.0, rel=1e-5)


def test_a_table_passes_through_its_points_and_goes_on_straight():
    loss = mbd.Tabulated([-2.0, 1.0, 3.0], [-4.0, 1.0, 9.0])
    for rate, torque in zip(loss.rate, loss.torque, strict=True):
        assert force_at(loss, rate) == pytest.approx(torque)
    slope = force_at(loss, 11.0) - force_at(loss, 10.0)
    assert force_at(loss, 100.0) - force_at(loss, 99.0) == pytest.approx(slope)
    assert slope > 0.0


def test_a_table_that_falls_at_its_end_stays_constant_beyond():
    loss = mbd.Tabulated([-3.0, -1.0, 1.0, 3.0], [-1.0, -4.0, 4.0, 1.0])
    assert force_at(loss, 1000.0) == pytest.approx(1.0)
    assert force_at(loss, -1000.0) == pytest.approx(-1.0)


def test_a_table_that_feeds_energy_in_is_a_fault():
    text = " ".join(mbd.Tabulated([-1.0, 0.0, 2.0], [1.0, 0.5, 3.0]).faults("knee loss"))
    assert "torque 1 at the rate -1" in text
    assert "torque 0.5 at the rate 0" in text
    assert "one sign only" in mbd.Tabulated([1.0, 2.0], [1.0, 3.0]).faults("knee loss")[0]


@pytest.mark.parametrize(
    ("rate", "torque", "told"),
    [([0.0, 1.0], [0.0], "as many torques"), ([1.0, 0.0], [0.0, 1.0], "increase"), ([0.0, math.nan], [0, 1], "finite")],
)
def test_wrong_tables_are_refused(rate, torque, told):
    with pytest.raises(ModelError, match=told):
        mbd.Tabulated(rate, torque)


def test_a_sympy_dissipation_is_the_same_as_a_function():
    v = sympy.Symbol("rate")
    assert force_at(mbd.Dissipation(v**4 / 4), 3.0) == pytest.approx(27.0)


def test_a_dissipation_that_feeds_energy_in_is_a_fault():
    assert "takes energy out" in mbd.Dissipation(lambda v: -v * v).faults("knee loss")[0]
    assert mbd.Dissipation(lambda v: v * v).faults("knee loss") == []


def test_negative_coefficients_are_faults():
    assert "feed energy in" in mbd.Viscous(-0.1).faults("knee loss")[0]
    assert "feed energy in" in (mbd.Viscous(0.1) + mbd.Quadratic(-0.1)).faults("knee loss")[0]


def test_a_number_is_no_loss_to_add():
    with pytest.raises(TypeError):
        mbd.Viscous(0.1) + 0.1


def test_equal_valves_with_memory_are_one_loss():
    """Oil, hysteresis and bristles give the same force through one valve or through two equal ones."""

    def stroke(loss):
        model, body = mbd.Model("stroke"), mbd.PointMass("body", 1.0)
        rail = mbd.Prismatic("rail", model.ground.origin, body.origin, loss=loss)
        model.connect(rail)
        model.constrain(mbd.Bilateral("drive", rail, lambda t: 0.05 * mbd.sin(7.0 * t)))
        run = mbd.simulate(model, mbd.assemble(model, velocity={"rail.rate": 0.35}), mbd.RadauIIA(), dt=2e-3, until=2.0)
        return run["rail loss.force"][-1], run["rail loss.deflection"][-1], run.energy["rail loss"][-1]

    for loss in mbd.CompressibleDamper(3.0, 0.8, 40.0), mbd.Dahl(3.0, 400.0), mbd.LuGre(3.0, 2.0, 0.5, 400.0, 0.8):
        alone, twice = stroke(loss), stroke(mbd.Valves(loss, loss))
        np.testing.assert_allclose(twice, alone, rtol=1e-6)


@pytest.mark.parametrize(
    ("backward", "forward"),
    [
        (mbd.Dahl(1.0, 400.0), mbd.Viscous(1.0)),
        (mbd.Dahl(1.0, 400.0), mbd.CompressibleDamper(1.0, 0.0, 400.0)),
        (mbd.Dahl(1.0, 400.0) + mbd.Viscous(1.0), mbd.Dahl(1.0, 400.0) + mbd.Viscous(1.0)),
        (mbd.Valves(mbd.Dahl(1.0, 4e2), mbd.Dahl(1.0, 4e2)), mbd.Valves(mbd.Dahl(1.0, 4e2), mbd.Dahl(1.0, 4e2))),
    ],
)
def test_valves_of_unlike_memories_are_refused(backward, forward):
    with pytest.raises(ModelError, match="share one deflection"):
        mbd.Valves(backward, forward)


def test_what_is_left_of_a_sum_keeps_the_names_of_its_parts():
    """The second of two alike was called as the first one, and read its parameters."""
    whole = mbd.Coulomb(2.0) + mbd.Coulomb(0.5, smoothing=0.1) + mbd.Viscous(1.0)
    left = whole.smooth
    assert len(left.losses) == 2
    assert left.parameters("knee loss").items() <= whole.parameters("knee loss").items()
