"""A mechanism moves as it does alone, however fast and far others move: its rows and steps are judged by its own."""

from math import asin, cos, pi, sin, sqrt

import numpy as np
import pytest

import mbd
from tests.simulation.singular_linkages import rod


def slider_crank(crank, coupler, cut="auto", turn=4.0, speed=0.0, force=0.0):
    """A slider-crank, and a mass of 1 kg on another line with this speed, under this force; none where both are 0."""
    model, angle = mbd.Model("slider-crank", cut=cut), 0.5
    arm, bar, slider = mbd.Link("arm", **rod(crank)), mbd.Link("bar", **rod(coupler)), mbd.PointMass("slider", 1.0)
    model.connect(
        mbd.Revolute("main", model.ground.origin, arm.start), mbd.Revolute("pin", arm.end, bar.start),
        mbd.Prismatic("guide", model.ground.origin, slider.origin), mbd.Revolute("wrist", slider.origin, bar.end),
    )  # fmt: skip
    height = crank * sin(angle)
    position = {
        "main.angle": angle + pi / 2, "pin.angle": -angle - asin(height / coupler),
        "guide.displacement": crank * cos(angle) + sqrt(coupler**2 - height**2),
    }  # fmt: skip
    velocity = {"main.angle": turn}
    if speed or force:
        mass = mbd.PointMass("mass", 1.0)
        model.connect(mbd.Prismatic("line", model.ground.origin, mass.origin))
        model.apply(mbd.Applied("pull", mass.origin, force=(force, 0.0)))
        velocity["line.displacement"] = speed
    return model, mbd.assemble(model, position=position, velocity=velocity)


def change(scheme, dt, until, bars, cut="auto", **beside):
    """Largest difference between the motions beside a mass and alone [rad, rad/s]."""
    alone, found = (
        mbd.simulate(*slider_crank(*bars, cut, **each), scheme, dt=dt, until=until) for each in ({}, beside)
    )
    return max(float(np.max(np.abs(found[name] - alone[name]))) for name in ("main.angle", "main.rate", "wrist.angle"))


@pytest.mark.parametrize("cut", ["auto", "all"])
def test_rows_hold_as_closely_beside_a_mass_that_gets_fast_and_far(cut):
    assert change(mbd.Newmark(), 5e-3, 1.0, (0.5, 0.8), cut, force=1e9) < 1e-9


def test_a_slow_linkage_stays_on_its_branch_beside_a_mass_that_gets_fast():
    run = mbd.simulate(*slider_crank(0.5, 0.5, turn=0.5, force=1e6), mbd.HHT(0.05), dt=0.01, until=3.0)
    assert np.max(np.abs(run["guide.displacement"] - np.sin(run["main.angle"]))) < 1e-9


@pytest.mark.parametrize(
    ("scheme", "dt"),
    [(mbd.HHT(0.05), 0.07), (mbd.HHT(0.05), 1e-3), (mbd.RungeKutta853(), 1e-4)],
    ids=["HHT, long steps", "HHT", "RK853"],
)
def test_a_singular_pose_is_passed_the_same_way_beside_a_fast_mass(scheme, dt):
    assert change(scheme, dt, 0.8, (0.5, 0.5), speed=1e4) < 1e-8
