"""Cases j4 and j5: a mass ratio of a million, and bodies with hardly any mass or none."""

from __future__ import annotations

import math

import numpy as np
import pytest

import mbd
from mbd.integrators.family import NewmarkFamily
from tests.cases.double_pendulums import FORMS, WITH_ROWS
from tests.cases.schemes import SCHEMES, name_of
from tests.helpers import assert_second_order
from tests.problems import case

J4, J5 = case("j4-mass-ratio-1e6"), case("j5-near-massless-link")
MOTION = (J4.start["theta1"], J4.start["theta2"], 0.0, 0.0)
SIZES = {name: J4.definition[name] for name in ("m1", "m2", "L1", "L2", "g")}
MASS, LENGTH, G = (J5.definition[name] for name in ("bob_mass", "total_length", "g"))
THETA = J5.start["theta0"]


# j4 -----------------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("form", FORMS)
def test_a_light_bob_over_a_heavy_one_meets_the_reference_where_its_blows_are_resolved(form: str) -> None:
    """Each time the rods straighten, the light bob is thrown to and fro with more than 4429 rad/s for an instant."""
    swing, reference = FORMS[form](**SIZES), J4["[theta1, theta2, w1, w2]"]
    scheme, until = mbd.GeneralizedAlpha(1.0), reference.t[0]
    run = mbd.simulate(swing.model, swing.start(MOTION), scheme, dt=5e-7, until=until, store=10000)
    miss = np.abs(np.array([column[-1] for column in swing.motion(run)]) - reference.value[0])
    assert miss[:2].max() < 1e-5 and miss[2:].max() < 1e-3, miss
    assert max(run.violation.length, run.violation.angle) < 1e-10
    assert run.energy.drift < 1e-5


@pytest.mark.parametrize("form", WITH_ROWS)
@pytest.mark.parametrize("scheme", SCHEMES, ids=name_of)
def test_coarse_steps_hold_the_joints_together_or_end_in_an_error(form: str, scheme: NewmarkFamily) -> None:
    """Steps of 1 ms cannot follow the impacts."""
    swing = FORMS[form](**SIZES)
    run = mbd.simulate(swing.model, swing.start(MOTION), scheme, dt=1e-3, until=1.0, on_failure="return")
    assert max(run.violation.length, run.violation.angle) < 1e-6
    assert run.success or "try a smaller dt" in run.message or "larger dt" in run.message


# j5 -----------------------------------------------------------------------------------------------------------------
def bob_on_a_bar(mass: float, cut: str = "auto") -> mbd.Model:
    """A bob welded to the end of a uniform bar of a given mass."""
    model = mbd.Model("bar and bob", gravity=(0.0, -G, 0.0), cut=cut)
    bar = mbd.Link("bar", mass=mass, length=LENGTH, center=0.5 * LENGTH, inertia=mass * LENGTH**2 / 12)
    bob = mbd.PointMass("bob", mass=MASS)
    model.connect(mbd.Revolute("pivot", model.ground.origin, bar.start), mbd.Weld("weld", bar.end, bob.origin))
    return model


def named(cut: str) -> str:
    return "pivot.angle" if cut == "auto" else "bar floating.angle"


@pytest.mark.parametrize("cut", ["auto", "all"])
@pytest.mark.parametrize("mass", [J5.definition["link_mass"], 0.0], ids=["hardly any mass", "no mass"])
def test_a_bar_without_mass_swings_its_bob_with_the_period_of_the_pendulum(mass: float, cut: str) -> None:
    model = bob_on_a_bar(mass, cut)
    start = mbd.assemble(model, {named(cut): THETA})
    quarter = J5["period"].value / 4.0

    def errors(dt: float) -> float:
        """It hangs straight after a quarter of the period."""
        run = mbd.simulate(model, start, mbd.GeneralizedAlpha(0.9), dt=dt, until=quarter)
        along = np.array([-math.sin(THETA), math.cos(THETA), 0.0])
        assert run["weld.reaction_force"][0] @ along == pytest.approx(J5["tension at the start"].value, abs=1e-9)
        return float(run[named(cut)][-1])

    assert_second_order(errors, quarter / 250)


def test_a_hinged_body_whose_motion_nothing_determines_is_refused_by_name_before_any_run() -> None:
    model = mbd.Model("loose link", gravity=(0.0, -G, 0.0))
    bob, link = mbd.PointMass("bob", mass=MASS), mbd.Link("loose", mass=0.0, length=LENGTH, center=0.5 * LENGTH)
    model.connect(
        mbd.Translation("place", model.ground.origin, bob.origin), mbd.Revolute("hinge", bob.origin, link.start)
    )
    with pytest.raises(mbd.ModelError, match="body 'loose' has neither mass nor inertia .* nothing determines"):
        mbd.assemble(model)
