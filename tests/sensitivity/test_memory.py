"""Derivatives of runs with laws that have states of their own, and kinks at which steps end: limits of differences."""

import numpy as np
import pytest

import mbd
from tests.helpers import one_body

CLOSE = {"tolerance": 1e-12}
SCHEMES = (
    mbd.HHT(0.05, **CLOSE), mbd.HHT(0.05, formulation="index3", **CLOSE), mbd.RungeKutta853(), mbd.RadauIIA(**CLOSE),
    mbd.RungeKutta4(), mbd.GeneralizedAlpha(0.7, **CLOSE),
)  # fmt: skip


def shank(loss):
    """A leg that swings, whose friction turns around with it."""
    model, body = mbd.Model("shank"), mbd.Link("shank", mass=2.5, length=0.42, center=0.19, inertia=0.04)
    model.connect(mbd.Revolute("knee", model.ground.origin, body.start, loss=loss))
    return model, mbd.assemble(model, {"knee.angle": 0.9}), 1.5, "knee.angle"


def puck():
    """A foot that sticks to rubber and slides on it by turns."""
    model, body = one_body(mbd.PointMass("puck", 2.0), mbd.Translation, "slide", title="rubber")
    rubber = mbd.Bristles(0.4, 5e3, 80.0)
    model.constrain(mbd.Penalty("mat", mbd.touchdown(body.origin), 2e4, 200.0, friction=rubber))
    model.apply(mbd.Applied("pull", body.origin, (lambda t: 12.0 * mbd.sin(3.0 * t), lambda t: 0.0 * t)))
    return model, mbd.assemble(model, {"slide.y": -1.2e-3}, {"slide.x": 0.3}, closed="mat"), 0.5, "slide.x"


def thrown():
    """A foot that slides on rubber, and off it again: there no bristle is loaded, and neither side of its kink is."""
    model, body = one_body(mbd.PointMass("puck", 1.0), mbd.Translation, "flight", title="thrown")
    rubber = mbd.Bristles(0.4, 2e3, 15.0)
    model.constrain(mbd.Penalty("mat", mbd.touchdown(body.origin), 3e3, 20.0, friction=rubber))
    return model, mbd.assemble(model, {"flight.y": 0.1}, {"flight.x": 1.0}), 0.25, "flight.x"


def dropped(make):
    """A body that falls on a stop."""
    model, body = one_body(mbd.PointMass("body", 1.0), mbd.Prismatic, "rail", title="dropped", axis=(0, 1, 0))
    model.constrain(make(mbd.height(body.origin)))
    return model, mbd.assemble(model, {"rail.displacement": 0.1}), 1.0, "rail.displacement"


LAWS = {
    "dahl": (lambda: shank(mbd.Dahl(0.4, 25.0)), ["gravity.y", "shank.mass", "shank.center"]),
    "lugre": (lambda: shank(mbd.LuGre(0.5, 0.4, 0.5, 25.0, 0.8)), ["gravity.y", "shank.mass", "shank.center"]),
    "bristles": (puck, ["gravity.y", "puck.mass", "mat.bristle_stiffness"]),
    "bristles that open": (thrown, ["gravity.y", "mat.stiffness", "mat.mu"]),
    "maxwell": (
        lambda: dropped(lambda gap: mbd.MaxwellStop("stop", gap, 2e3, 3e3, 50.0)),
        ["gravity.y", "stop.stiffness", "stop.branch_stiffness"],
    ),
    "hysteretic": (
        lambda: dropped(lambda gap: mbd.HystereticStop("stop", gap, 2e3, 0.3, 0.01)),
        ["gravity.y", "stop.stiffness", "stop.share"],
    ),
}  # fmt: skip


@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
@pytest.mark.parametrize("law", LAWS)
def test_derivatives_of_laws_that_remember_are_limits_of_differences(law, scheme):
    """To 1e-8 of the largest, or to what two quotients differ by where that is more."""
    make, wrt = LAWS[law]
    model, start, until, name = make()
    of, settings = [name, f"{name}.rate"], {"dt": 4e-3, "until": until}
    found = mbd.sensitivities(model, start, scheme, wrt=wrt, of=of, **settings)

    def end(parameter, value):
        run = mbd.simulate(model, start, scheme, parameters={parameter: value}, **settings)
        return np.array([run[each][-1] for each in of])

    for parameter in wrt:
        value, quotients = model.parameters[parameter], []
        for step in (4e-6 * value, 2e-6 * value):
            quotients.append((end(parameter, value + step) - end(parameter, value - step)) / (2.0 * step))
        wanted = (4.0 * quotients[1] - quotients[0]) / 3.0
        largest, exact = np.max(np.abs(wanted)), np.array([found[each, parameter] for each in of])
        noise = np.max(np.abs(quotients[1] - quotients[0])) / largest
        assert noise < 1e-6
        assert np.max(np.abs(exact - wanted)) / largest <= max(1e-8, 2.0 * noise)
