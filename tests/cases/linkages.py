"""Planar and spatial linkages whose rows depend on each other, always or in single poses."""

from typing import Any

import numpy as np

import mbd
from mbd.hardcases import redundant_rows


def rod(name: str, length: float = 1.0, mass: float = 1.0) -> mbd.Link:
    """A thin uniform rod."""
    return mbd.Link(name, mass=mass, length=length, center=0.5 * length, inertia=mass * length**2 / 12)


def parallel_cranks(count: int = 3, cut: Any = "auto") -> mbd.Model:
    """Case j2, with any number of cranks."""
    return redundant_rows.parallel_cranks(cut=cut, count=count)[0]


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
