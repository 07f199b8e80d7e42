"""Planar and spatial linkages whose rows depend on each other, always or in single poses."""

from __future__ import annotations

from typing import Any

import numpy as np

import mbd
from tests.problems import case

__all__ = ["bricard", "equal_slider_crank", "four_bar", "four_bars", "parallel_cranks", "upright"]


def rod(name: str, length: float = 1.0, mass: float = 1.0) -> mbd.Link:
    """A thin uniform rod."""
    return mbd.Link(name, mass=mass, length=length, center=0.5 * length, inertia=mass * length**2 / 12)


def parallel_cranks(count: int = 3, cut: Any = "auto") -> mbd.Model:
    """Equal cranks, 1 m apart, that carry one coupler of 2 kg: every crank beyond the second is redundant."""
    model = mbd.Model("parallel cranks", cut=cut)
    coupler = mbd.RigidBody("coupler", mass=2.0, inertia=0.1)
    cranks = [rod(f"crank {k}") for k in range(count)]
    for k, crank in enumerate(cranks):
        model.connect(mbd.Revolute(f"base {k}", model.ground.point(float(k), 0.0, name=f"base {k}"), crank.start))
    for k, crank in enumerate(cranks):
        model.connect(mbd.Revolute(f"pin {k}", crank.end, coupler.point(k - 1.0, 0.0, name=f"pin {k}")))
    return model


def four_bar(links: tuple[float, float, float], ground: float, cut: Any = "auto") -> mbd.Model:
    """Crank, coupler and rocker of given lengths over a base [m]."""
    model = mbd.Model("four-bar", cut=cut)
    crank, coupler, rocker = (rod(name, L) for name, L in zip(("crank", "coupler", "rocker"), links, strict=True))
    model.connect(
        mbd.Revolute("a", model.ground.origin, crank.start),
        mbd.Revolute("b", crank.end, coupler.start),
        mbd.Revolute("c", coupler.end, rocker.end),
        mbd.Revolute("d", model.ground.point(ground, 0.0), rocker.start),
    )
    return model


def four_bars(count: int) -> mbd.Model:
    """`count` parallelograms of rods of 1 m and 1 kg side by side on one base (IFToMM A02)."""
    model = mbd.Model("four-bars")
    cranks = [rod(f"crank {k}") for k in range(count + 1)]
    for k, crank in enumerate(cranks):
        model.connect(mbd.Revolute(f"base {k}", model.ground.point(float(k), 0.0, name=f"base {k}"), crank.start))
    for k in range(count):
        coupler = rod(f"coupler {k}")
        model.connect(mbd.Revolute(f"left {k}", cranks[k].end, coupler.start))
        model.connect(mbd.Revolute(f"right {k}", coupler.end, cranks[k + 1].end))
    return model


def upright(model: mbd.Model, count: int, angle: float = np.pi, speed: float = -1.0) -> mbd.State:
    """`four_bars` with parallel cranks at an angle from the downward vertical, turning at a speed [rad/s]."""
    place = {f"base {k}.angle": angle for k in range(count + 1)}
    place |= {f"left {k}.angle": 0.5 * np.pi - angle for k in range(count)}
    return mbd.assemble(model, position=place, velocity={"base 0.angle": speed})


def equal_slider_crank(length: float = 1.0, mass: float = 1.0) -> mbd.Model:
    """Crank and rod of one length, a slider on the x axis as heavy as each."""
    model = mbd.Model("slider-crank of equal lengths")
    crank, bar, slider = rod("crank", length, mass), rod("rod", length, mass), mbd.PointMass("slider", mass=mass)
    model.connect(
        mbd.Revolute("main", model.ground.origin, crank.start),
        mbd.Revolute("pin", crank.end, bar.start),
        mbd.Prismatic("guide", model.ground.origin, slider.origin),
        mbd.Revolute("wrist", bar.end, slider.origin),
    )
    return model


def bricard(cut: Any = "auto") -> mbd.Model:
    """Five thin rods between two fixed pivots, each of the six axes square to its neighbours (IFToMM A04)."""
    given = case("b4-iftomm-a04-bricard").definition
    points = [np.array(place) for place in given["points"].values()]
    model = mbd.Model("Bricard's mechanism", cut=cut)
    rods = []
    for k in range(5):
        along = points[k + 1] - points[k]
        inertia = (1.0 - along * along) * given["rod_mass"] * given["rod_length"] ** 2 / 12
        rods.append(mbd.RigidBody(f"rod {k}", given["rod_mass"], tuple(inertia), center=tuple(0.5 * along)))
    for k, axis in enumerate(given["joint_axes"].values()):
        before = rods[k - 1].point(*(points[k] - points[k - 1]), name="tip") if k else model.ground.origin
        after = rods[k].origin if k < 5 else model.ground.point(*points[5], name="far pivot")
        model.connect(mbd.Revolute(f"P{k}", before, after, axis=tuple(axis)))
    return model
