"""Cases a1, a1b and b1: a point mass on a rod, swinging widely and turning over, in three kinds of coordinates."""

import math
from typing import Any

import numpy as np
import pytest

import mbd
from mbd.integrators.family import NewmarkFamily
from tests.cases.schemes import INDEX_3, SCHEMES
from tests.helpers import assert_second_order
from tests.problems import case

A1, A1B, B1 = case("a1-simple-pendulum"), case("a1b-rotating-pendulum"), case("b1-iftomm-a01-pendulum")
FORMS = ("one coordinate", "pivot cut", "places and a rod")
PAIRS = [pytest.param(form, scheme, id=f"{form}, {scheme!r}") for form in FORMS for scheme in SCHEMES]
PAIRS += [pytest.param(form, scheme, id=f"{form}, {scheme!r}") for form in FORMS[1:] for scheme in INDEX_3]


def pendulum(form: str, angle: float, rate: float = 0.0, mass: float = 1.0) -> tuple[mbd.Model, mbd.State]:
    """A rod of 1 m, its bob at an angle from the downward vertical."""
    model = mbd.Model("pendulum", cut="all" if form == "pivot cut" else "auto")
    if form != "places and a rod":
        rod = mbd.Link("rod", mass=mass, length=1.0, center=1.0)
        model.connect(mbd.Revolute("pivot", model.ground.origin, rod.start))
        return model, mbd.assemble(model, {"pivot.angle": angle}, {"pivot.rate": rate})
    bob = mbd.PointMass("bob", mass=mass)
    model.connect(mbd.Translation("bob", model.ground.origin, bob.origin))
    model.constrain(mbd.Bilateral("rod", mbd.distance(model.ground.origin, bob.origin), value=1.0))
    s, c = math.sin(angle), math.cos(angle)
    return model, mbd.assemble(model, {"bob.x": s, "bob.y": -c}, {"bob.x": c * rate, "bob.y": s * rate})


def place(form: str) -> tuple[str, str, str, str]:
    """Names of the bob's place and velocity."""
    if form == "places and a rod":
        return "bob.x", "bob.y", "bob.x.rate", "bob.y.rate"
    return "rod.end.x", "rod.end.y", "rod.end.vx", "rod.end.vy"


def read(values: Any, form: str) -> tuple[Any, Any, Any]:
    """θ between −π and π, θ˙ and the pull of the rod."""
    x, y, u, w = (values[name] for name in place(form))
    if form == "places and a rod":
        pull = values["rod.tension"]
    else:
        force = values["pivot.reaction_force"]
        pull = -(force[..., 0] * x + force[..., 1] * y)
    return np.arctan2(x, -y), x * w - y * u, pull


@pytest.mark.sampled(2)
@pytest.mark.parametrize("which", ["a1", "b1"])
@pytest.mark.parametrize(("form", "scheme"), PAIRS)
def test_a_wide_swing_meets_the_published_places_to_second_order(form: str, scheme: NewmarkFamily, which: str) -> None:
    if which == "a1":
        angle, reference = A1.start["theta0"], A1["theta(t)"]
        wanted = [(math.sin(theta), -math.cos(theta)) for theta in reference.value]
    else:
        angle, reference = math.atan2(B1.start["x0"], -B1.start["y0"]), B1["[x, y](t)"]
        wanted = reference.value
    model, start = pendulum(form, angle)

    def errors(share: float) -> list[float]:
        found = []
        for t, (x, y) in zip(reference.t, wanted, strict=True):
            steps = round(t / share)
            end = mbd.simulate(model, start, scheme, dt=t / steps, until=t, store=steps)
            found.append(math.hypot(end[place(form)[0]][-1] - x, end[place(form)[1]][-1] - y))
        return found

    assert_second_order(errors, 0.0025 if which == "a1" else 0.002)


@pytest.mark.parametrize(("form", "scheme"), PAIRS)
def test_the_tension_is_that_of_the_motion_at_every_step(form: str, scheme: NewmarkFamily) -> None:
    """T = m g (3 cos θ − 2 cos θ₀) along the whole swing, not oscillating from step to step."""
    model, start = pendulum(form, A1.start["theta0"], mass=2.3)

    def error(dt: float) -> float:
        angle, _, pull = read(mbd.simulate(model, start, scheme, dt=dt, until=2.0), form)
        return float(np.max(np.abs(pull - 2.3 * 9.81 * (3 * np.cos(angle) - 2 * math.cos(A1.start["theta0"])))))

    assert_second_order(error, 0.005)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("motion", ["swinging", "turning over"])
def test_period_speed_and_tension_are_the_published_ones_to_second_order(form: str, motion: str) -> None:
    """Of a swing at the lowest point, which it passes twice a period; of a pendulum that turns over at the top."""
    swings = motion == "swinging"
    model, start = pendulum(form, *((A1.start["theta0"],) if swings else (A1B.start["theta0"], A1B.start["thetadot0"])))
    model.constrain(mbd.Event("vertical", mbd.measure(place(form)[0])))
    if swings:
        half, at = 0.5 * A1["period T"].value, 0.25 * A1["period T"].value
        speed, pull = A1["speed at lowest point"].value, A1["rod tension at lowest point"].value
    else:
        half = at = 0.5 * A1B["time of one revolution"].value
        speed, pull = A1B["thetadot at the top"].value, A1B["rod tension at the top"].value

    def errors(dt: float) -> list[float]:
        run = mbd.simulate(model, start, mbd.HHT(alpha=0.05), dt=dt, until=at + 6.5 * half)
        times = [event.time for event in run.events if event.time > 0.5 * at]
        assert len(times) == 7
        _, rate, tension = read(run.at(times[4]), form)
        return [times[6] - at - 6 * half, abs(rate) - speed, tension - pull]

    assert_second_order(errors, half / 400)


@pytest.mark.parametrize("scheme", [mbd.Newmark(formulation="index3"), mbd.GeneralizedAlpha(1.0, formulation="index3")])
def test_an_undamped_scheme_with_rows_at_position_level_is_refused_and_told_why(scheme: NewmarkFamily) -> None:
    with pytest.raises(mbd.CapabilityError, match=r"multipliers grow.*use formulation='ggl'"):
        mbd.simulate(*pendulum("places and a rod", 2.0), scheme, dt=1e-3, until=1.0)
    assert mbd.simulate(*pendulum("one coordinate", 2.0), scheme, dt=1e-2, until=0.1).success
