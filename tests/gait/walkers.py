"""Walkers for tests of gaits: those of the cases, with sides of their own, and the simplest one as its paper has it."""

import math
from collections.abc import Mapping
from functools import cache
from typing import Any

import mbd
from tests.cases.walkers import SIDES, end_at_fall


def slope_of(g: float) -> dict[str, Any]:
    """The slope as a function that gives gravity."""
    return {"slope": lambda s: {"gravity.x": g * math.sin(s), "gravity.y": -g * math.cos(s)}}


SLOPE = slope_of(9.81)


def two_sided(legs: Mapping[str, Mapping[str, float]], mh: float, g: float, slope: float, knees: bool) -> mbd.Model:
    """A walker whose left and right legs have shank and thigh masses of their own, of one length."""
    model = mbd.Model("two-sided walker", gravity=mbd.on_slope(slope, g))
    hip = mbd.PointMass("hip", mh)
    model.connect(mbd.Translation("trunk", model.ground.origin, hip.origin))
    for side, other in SIDES:
        sizes = legs[side]
        thigh = mbd.Link(f"{side} thigh", sizes["mt"], length=sizes["a2"] + sizes["b2"], center=sizes["b2"])
        shank = mbd.Link(f"{side} shank", sizes["ms"], length=sizes["a1"] + sizes["b1"], center=sizes["b1"])
        model.connect(mbd.Revolute(f"{side} hip", hip.origin, thigh.start))
        foot, release = mbd.touchdown(shank.end), mbd.When(f"{other} foot")
        if knees:
            knee = mbd.Revolute(f"{side} knee", thigh.end, shank.start)
            model.connect(knee)
            after = mbd.When(f"{other} foot", after_impact=True)
            model.constrain(
                mbd.Unilateral(f"{side} foot", foot, release=release, only_while=f"{side} knee lock"),
                mbd.Unilateral(f"{side} knee lock", mbd.flexion(knee), release=after),
            )
        else:
            model.connect(mbd.Weld(f"{side} knee", thigh.end, shank.start))
            ahead = mbd.measure(lambda mine, its: mine - its, f"{side} hip.angle", f"{other} hip.angle", unit="rad")
            model.constrain(mbd.Unilateral(f"{side} foot", foot, release=release, only_while=ahead))
    end_at_fall(model, sum(legs["left"][name] for name in ("a1", "b1", "a2", "b2")))
    return model


@cache
def simplest(beta: float = 1e-9) -> tuple[mbd.Model, mbd.State]:
    """The simplest walker and a start near its long gait at γ = 0.009.

    Garcia, Chatterjee, Ruina & Coleman (1998), J. Biomech. Eng. 120:281, with feet of mass β of the hip's.
    """
    from sympy import cos, sin, symbols

    theta, phi = mbd.Coordinate("theta"), mbd.Coordinate("phi")
    gamma, mass = symbols("gamma beta")
    x, y = sin(phi.q - theta.q) + sin(theta.q), cos(theta.q) - cos(phi.q - theta.q)
    vx, vy = (sum(place.diff(c.q) * c.v for c in (theta, phi)) for place in (x, y))
    model = mbd.Lagrangian(
        "simplest walker", [theta, phi], kinetic=theta.v**2 / 2 + mass * (vx**2 + vy**2) / 2,
        potential=cos(theta.q - gamma) + mass * (y * cos(gamma) + x * sin(gamma)),
        parameters={gamma: 0.009, mass: beta},
    )  # fmt: skip
    turn = cos(2 * theta.q)
    legs = {theta.q: -theta.q, phi.q: -2 * theta.q, theta.v: turn * theta.v, phi.v: turn * (1 - turn) * theta.v}
    model.constrain(mbd.Event("heel strike", phi.q - 2 * theta.q, direction=+1, reset=legs))
    return model, simplest_start(model, 0.2003109, -0.1998325)


def simplest_start(model: Any, theta: float, rate: float) -> mbd.State:
    """Just after a heel strike."""
    turn = 1.0 - math.cos(2.0 * theta)
    position, velocity = {"theta": theta, "phi": 2.0 * theta}, {"theta": rate, "phi": turn * rate}
    return mbd.assemble(model, position=position, velocity=velocity)
