"""Force laws that begin to act only while a contact is closed or a measure is positive."""

import numpy as np
import pytest

import mbd

LAWS = {
    "kelvin-voigt": lambda where, **how: mbd.Penalty("mat", where, 4e3, 20.0, **how),
    "restitution": lambda where, **how: mbd.Penalty("mat", where, 4e3, restitution=0.5, **how),
    "rubbing": lambda where, **how: mbd.Penalty("mat", mbd.touchdown(where.point), 4e3, 20.0, friction=0.3, **how),
}


def thrown(law, condition=None, speed=1.0, floor=False):
    """A mass that is thrown along x and falls onto a mat at y = 0."""
    model, body = mbd.Model("mat"), mbd.PointMass("body", 1.0)
    model.connect(mbd.Translation("fly", model.ground.origin, body.origin, axes="xy"))
    if floor:
        model.constrain(mbd.Unilateral("floor", mbd.measure(lambda y: y + 0.5, "fly.y"), friction=0.0))
    if law is not None:
        model.constrain(law(mbd.height(body.origin), **({} if condition is None else {"only_while": condition})))
    return model, mbd.assemble(model, {"fly.x": -0.2, "fly.y": 0.3}, {"fly.x": speed})


def until(model, start, end=0.45):
    return mbd.simulate(model, start, mbd.HHT(0.05), dt=1e-3, until=end)


@pytest.mark.parametrize("name", LAWS)
def test_a_mat_acts_where_its_condition_holds_and_is_passed_where_it_does_not(name):
    """It is struck at x = 0.0473 m: with x > 0 everywhere as without a condition, with x > 0.1 m not at all."""
    held = until(*thrown(LAWS[name], mbd.measure("fly.x")))
    free = until(*thrown(LAWS[name]))
    assert held.events[0].kind == "closed"
    np.testing.assert_array_equal(held["fly.y"], free["fly.y"])
    beyond = until(*thrown(LAWS[name], mbd.measure(lambda x: x - 0.1, "fly.x")))
    np.testing.assert_allclose(beyond["fly.y"], until(*thrown(None))["fly.y"], atol=1e-12)
    assert not beyond.events


@pytest.mark.parametrize("name", LAWS)
def test_a_mat_may_follow_a_contact_that_is_closed(name):
    """The floor lies below: it is open as the body falls through the mat."""
    passed = until(*thrown(LAWS[name], "floor", floor=True), 0.3)
    np.testing.assert_allclose(passed["fly.y"], until(*thrown(None, floor=True), 0.3)["fly.y"], atol=1e-12)


def test_derivatives_follow_a_mat_with_a_condition():
    model, start = thrown(LAWS["restitution"], mbd.measure("fly.x"))
    of, wrt = ["fly.y", "fly.y.rate"], ["fly.y", "fly.x.rate"]
    found = mbd.sensitivities(model, start, mbd.HHT(0.05), 1e-3, until=0.4, wrt=wrt, of=of)
    model, start = thrown(LAWS["restitution"])
    free = mbd.sensitivities(model, start, mbd.HHT(0.05), 1e-3, until=0.4, wrt=wrt, of=of)
    for a in of:
        for b in wrt:
            assert found[a, b] == pytest.approx(free[a, b], rel=1e-9, abs=1e-12)


def test_a_condition_that_names_its_own_contact_is_a_fault():
    model, _ = thrown(LAWS["kelvin-voigt"])
    model.constrain(mbd.Penalty("pad", mbd.measure("fly.y"), 1e3, only_while="pad"))
    with pytest.raises(mbd.ModelError, match="'pad': only_while='pad' names itself"):
        mbd.assemble(model)
    with pytest.raises(mbd.ModelError, match="only_while of 'pad'"):
        mbd.Penalty("pad", mbd.measure("fly.y"), 1e3, only_while=3)
