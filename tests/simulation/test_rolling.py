"""A wheel rolls while its contact is closed, and has no grip in flight."""

import numpy as np
import pytest

import mbd

SCHEMES = [mbd.HHT(), mbd.Newmark(), mbd.HHT(0.1, formulation="index3"), mbd.RadauIIA(), mbd.RungeKutta853()]
NAMES = [f"{type(scheme).__name__}-{k}" for k, scheme in enumerate(SCHEMES)]
R, M, INERTIA, SLOPE = 0.3, 2.0, 0.12, 0.2


def hoop(only_while="road", contact=None):
    model = mbd.Model("hoop", gravity=mbd.on_slope(SLOPE))
    rim = mbd.RigidBody("rim", mass=M, inertia=INERTIA)
    model.connect(mbd.Planar("roll", model.ground.origin, rim.origin))
    height = mbd.touchdown(rim.origin, mbd.Plane(offset=R))
    model.constrain(contact(height) if contact else mbd.Unilateral("road", height, friction=0))
    model.constrain(mbd.Rolling("grip", rim.origin, radius=R, only_while=only_while))
    return model


@pytest.mark.parametrize("contact", ["events", "nonsmooth"])
@pytest.mark.parametrize("scheme", SCHEMES, ids=NAMES)
def test_a_hoop_that_hops_has_no_grip_in_flight_and_rolls_where_it_lands(scheme, contact):
    model = hoop()
    up = 2.62
    velocity = {"roll.x": 1.0, "roll.y": up, "roll.angle": -5.0}
    start = mbd.assemble(model, position={"roll.y": R + 1e-3}, velocity=velocity)
    run = mbd.simulate(model, start, scheme, dt=1e-3, until=0.8, contact=contact)
    flies = run.record.closed[:, 0] == 0
    assert run["road.gap"].max() == pytest.approx(1e-3 + up**2 / (2.0 * 9.81 * np.cos(SLOPE)), rel=1e-3)
    assert not run["grip.force"][flies].any()
    assert run["roll.angle.rate"][flies] == pytest.approx(-5.0)
    assert np.max(np.abs(run["grip.residual"][~flies])) < 1e-9
    landed = np.flatnonzero(~flies)[0]
    before = run["roll.x.rate"][landed - 1]
    together = (M * R * before + INERTIA * 5.0) / (M * R + INERTIA / R)  # momentum about the point of touch is kept
    assert run["roll.x.rate"][landed] == pytest.approx(together, rel=2e-3)
    assert run["grip.force"][-1] == pytest.approx(-M * 9.81 * np.sin(SLOPE) / (1.0 + M * R**2 / INERTIA), rel=1e-6)
    assert np.max(np.diff(run.energy.total[landed:])) < 1e-3


def test_a_hoop_that_stays_down_rolls_the_same_with_and_without_the_condition():
    runs = []
    for only_while in None, "road":
        model = hoop(only_while)
        runs.append(mbd.simulate(model, mbd.assemble(model, closed="road"), dt=1e-2, until=1.0))
    assert np.array_equal(runs[0]["roll.x"], runs[1]["roll.x"])
    assert np.array_equal(runs[0]["grip.force"], runs[1]["grip.force"])


def test_a_condition_that_names_no_contact_or_a_compliant_one_is_refused():
    with pytest.raises(mbd.ModelError, match=r"'grip'.*'rod'"):
        mbd.assemble(hoop("rod"))
    with pytest.raises(mbd.ModelError, match=r"'grip': only_while='mat' is a penalty contact"):
        mbd.assemble(hoop("mat", lambda height: mbd.Penalty("mat", height, stiffness=1e4)))
    with pytest.raises(mbd.ModelError, match="only_while of Rolling 'grip'"):
        hoop(3)
