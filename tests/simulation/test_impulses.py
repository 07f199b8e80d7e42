"""Impulses of events: each contact that takes part in an impact is reported once; together they change the momentum."""

import numpy as np
import pytest

import mbd
from tests.simulation.mechanisms import point, run


@pytest.mark.parametrize("law", ["newton", "poisson", "sequential"])
def test_a_corner_that_rests_takes_a_part_of_the_impulse_on_the_other(law):
    """A box that tips about its sticking left corner: m v of the box is what both corners give."""
    trajectory = mbd.simulate(*_tipping(), dt=1e-3, until=("right", 2.0), impact=law)
    strike = trajectory.events[-1]
    assert strike.name == "right" and set(strike.impulses) == {"left", "right"}
    np.testing.assert_array_equal(strike.impulses["right"], strike.impulse)
    speeds = np.stack([trajectory["place.y.rate"], trajectory["place.x.rate"]], axis=1)
    jump = speeds[strike.row] - speeds[strike.row - 1]
    np.testing.assert_allclose(strike.impulses["left"] + strike.impulse, 2.0 * jump, rtol=0, atol=1e-12)
    assert "impulse of 'left'" in repr(strike)


def _tipping() -> tuple[mbd.Model, mbd.State]:
    """The box on its left corner, held through every impact by its rule."""
    model = mbd.Model("box")
    body = mbd.RigidBody("box", mass=2.0, inertia=0.2)
    model.connect(mbd.Planar("place", model.ground.origin, body.origin))
    model.constrain(
        mbd.Unilateral("right", mbd.touchdown(body.point(0.25, -0.15))),
        mbd.Unilateral("left", mbd.touchdown(body.point(-0.25, -0.15)), release=mbd.When("never")),
        mbd.Unilateral("never", mbd.touchdown(body.point(0.0, 5.0))),
    )
    height = 0.25 * np.sin(0.3) + 0.15 * np.cos(0.3)
    return model, mbd.assemble(model, closed=["left"], position={"place.angle": 0.3, "place.y": height})


def test_an_opening_has_zero_impulses_of_its_contact():
    model, body = point()
    model.constrain(mbd.Unilateral("floor", mbd.height(body.origin), friction=0.0))
    model.apply(mbd.Applied("lift", body.origin, force=(0.0, lambda t: 20.0 * t, 0.0)))
    (event,) = run(model, closed=["floor"], dt=0.01).events
    assert event.kind == "opened"
    np.testing.assert_array_equal(event.impulse, np.zeros(len(event.impulses["floor"])))
    assert len(event.impulse) == 1 and "impulse" not in repr(event)
