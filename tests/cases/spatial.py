"""Mechanisms of the reference cases in space, as their files define them."""

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

import mbd
from tests.problems import case

Made = tuple[mbd.Model, mbd.State]
Numbers = NDArray[np.float64]
DOWN = (0.0, 0.0, -9.81)


def unit(values: Any) -> Numbers:
    """At length 1."""
    found = np.asarray(values, dtype=float)
    return np.asarray(found / np.linalg.norm(found))


@cache
def asymmetric_body() -> Made:
    """Case e1: a free body of three moments of inertia, about its intermediate axis."""
    e1 = case("e1-dzhanibekov")
    model = mbd.Model("racket", gravity=(0.0, 0.0, 0.0))
    body = mbd.RigidBody("body", 1.0, tuple(e1.definition["I"]))
    model.connect(mbd.Spherical("ball", model.ground.origin, body.origin))
    return model, mbd.assemble(model, velocity={"ball.angular_velocity": e1.start["omega0"]})


@cache
def top(name: str) -> mbd.Model:
    """Cases e2, e3, e3b: a symmetric top about a point, moments A and C, m g l."""
    given = case(name).definition
    A, C, arm = given["A"], given["C"], 0.05
    mass = given["mgl"] / (9.81 * arm)
    model = mbd.Model("top", gravity=DOWN)
    around = A - mass * arm**2
    body = mbd.RigidBody("body", mass, (around, around, C), center=(0.0, 0.0, arm))
    model.connect(mbd.Spherical("ball", model.ground.origin, body.origin))
    body.point(0.0, 0.0, 1.0, name="axis")
    return model


def spun(name: str, precession: float, spin: float, theta: float) -> Made:
    """At ψ = 0, φ = 0; ω of the body from the rates of precession ψ about z and spin φ about its axis."""
    model = top(name)
    omega = (0.0, precession * np.sin(theta), spin + precession * np.cos(theta))
    return model, mbd.assemble(model, {"ball.orientation": ((1, 0, 0), theta)}, {"ball.angular_velocity": omega})


@cache
def double_pendulum(cut: Any = "auto") -> Made:
    """Case e4: two bodies on ball joints."""
    e4 = case("e4-3d-double-pendulum")
    given, start = e4.definition, e4.start
    model = mbd.Model("double pendulum in space", gravity=DOWN, cut=cut)
    first = mbd.RigidBody("first", given["m1"], tuple(given["I1"]), center=tuple(given["com1"]))
    second = mbd.RigidBody("second", given["m2"], tuple(given["I2"]), center=tuple(given["com2"]))
    model.connect(mbd.Spherical("upper", model.ground.origin, first.origin))
    model.connect(mbd.Spherical("lower", first.point(*given["tip1"], name="tip"), second.origin))
    return model, mbd.assemble(
        model, {"upper.orientation": unit(start["q1"]), "lower.orientation": relative(start["q1"], start["q2"])},
        {"upper.angular_velocity": start["w1_body"], "lower.angular_velocity.ground": spin_apart(start)},
    )  # fmt: skip


def relative(one: Any, two: Any) -> Any:
    """The second orientation seen from the first, both against the ground."""
    from scipy.spatial.transform import Rotation

    first, second = (Rotation.from_quat(np.asarray(q)[[1, 2, 3, 0]]) for q in (one, two))
    return first.inv() * second


def spin_apart(start: Mapping[str, Any]) -> Numbers:
    """ω₂ − ω₁ in ground axes."""
    from scipy.spatial.transform import Rotation

    first, second = (Rotation.from_quat(np.asarray(start[q])[[1, 2, 3, 0]]) for q in ("q1", "q2"))
    return np.asarray(second.apply(start["w2_body"]) - first.apply(start["w1_body"]))


@cache
def coin(name: str = "d4-rolling-disk") -> mbd.Model:
    """Cases d4 and d5: a thin disk (its axis is y) that rolls on its edge; z is up."""
    given = case(name).definition
    m, R = given["m"], given["R"]
    model = mbd.Model("coin", gravity=DOWN)
    disk = mbd.RigidBody("disk", m, (m * R**2 / 4, m * R**2 / 2, m * R**2 / 4))
    model.connect(mbd.Free("float", model.ground.origin, disk.origin))
    center, edge = disk.origin, disk.point(0.0, 1.0, 0.0, name="normal")

    def height(c: Any, n: Any) -> Any:
        return c[2] - R * mbd.sqrt(1.0 - (n[2] - c[2]) ** 2)

    def slip(k: int) -> Any:
        def row(c: Any, n: Any, vx: Any, vy: Any, wx: Any, wy: Any, wz: Any) -> Any:
            x, y, z = (n[i] - c[i] for i in range(3))
            across = mbd.sqrt(1.0 - z * z)
            arm = [R * z * x / across, R * z * y / across, -R * across]  # from the center to the lowest point
            turned = (wy * arm[2] - wz * arm[1], wz * arm[0] - wx * arm[2])
            return (vx + turned[0], vy + turned[1])[k]

        return row

    asked = (center, edge, "float.x.rate", "float.y.rate", *(f"float.angular_velocity.ground.{a}" for a in "xyz"))
    model.constrain(mbd.Bilateral("edge", mbd.measure(height, center, edge, unit="m")))
    model.constrain(mbd.Nonholonomic("forward", slip(0), arguments=asked))
    model.constrain(mbd.Nonholonomic("sideways", slip(1), arguments=asked))
    return model


@cache
def tree(name: str, cut: Any = "auto") -> Made:
    """Cases l7 and l8: bodies listed with their joints."""
    found = case(name)
    state = found.start["state"]
    model = mbd.Model(name, gravity=(0.0, 0.0, -found.definition["g"]), cut=cut)
    bodies: dict[Any, Any] = {None: model.ground}
    position, velocity = dict[str, Any](), dict[str, Any]()
    for each in found.definition["bodies"]:
        own, at, joint = each["name"], each.get("at", (0.0, 0.0, 0.0)), f"to {each['name']}"
        body = bodies[own] = mbd.RigidBody(own, each["m"], tuple(each["I"]), center=tuple(each["com"]))
        frames, given = (bodies[each["parent"]].point(*at), body.origin), state[own]
        if each["joint"] == "revolute":
            model.connect(mbd.Revolute(joint, *frames, axis=tuple(each["axis"])))
            position[f"{joint}.angle"], velocity[f"{joint}.angle"] = given["angle"], given["rate"]
            continue
        model.connect((mbd.Free if each["joint"] == "free" else mbd.Spherical)(joint, *frames))
        position[f"{joint}.orientation"], velocity[f"{joint}.angular_velocity"] = unit(given["q"]), given["w"]
        if each["joint"] == "free":
            position |= {f"{joint}.{axis}": value for axis, value in zip("xyz", given["p"], strict=True)}
            velocity |= {f"{joint}.{axis}": value for axis, value in zip("xyz", given["v"], strict=True)}
    return model, mbd.assemble(model, position, velocity)
