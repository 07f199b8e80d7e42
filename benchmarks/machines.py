"""Gaits of machines with discrete states, beside passive walkers of the same bodies, joints, springs and contacts.

A passive twin has the same forces, with one law in the place of one for each state, and no modes. It walks a gait of
its own, so each figure is that of a gait: a run of 20 steps, the limit cycle from a start beside it, a branch of gaits
along a mass, and a batch that runs to the section. Without its modes the hopper has no gait: of it returns are counted
that start from the gait's state, for each second that they last.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

import mbd
from benchmarks.figures import BURST, Figure, Samples, interleaved
from benchmarks.stopwatch import processor_seconds

SIDES = ("left", "right")
AIM, RUN_AIM = 2.0, {"a knee of five phases": 1.3}
"""Times of a machine over those of its twin, and of a run of some [-]."""
STEPS, STARTS, POINTS = 20, 256, 20
"""Of a run, of a batch and of a branch."""


@dataclass(frozen=True)
class Walker:
    """A model with a start near a gait, its section and mirror, and the mass along which gaits are followed."""

    model: mbd.Model
    start: mbd.State
    mass: tuple[str, float] = ("hip.mass", 10.0)
    section: str = "right foot"
    mirror: tuple[str, str] | None = SIDES

    def gait(self, start: mbd.State) -> mbd.LimitCycle:
        """The gait beside a start."""
        return mbd.limit_cycle(
            self.model, start, section=self.section, mirror=self.mirror, parameters=dict([self.mass])
        )


def _legs(name: str, gravity: tuple[float, float, float], pull: bool = False) -> tuple[mbd.Model, dict[str, Any]]:
    """The compass: a hip mass of 10 kg and legs of 5 kg and 1 m; the joints of both hips, and their legs."""
    model, hip, found = mbd.Model(name, gravity=gravity), mbd.PointMass("hip", mass=10.0), {}
    model.connect(mbd.Translation("trunk", model.ground.origin, hip.origin))
    legs = {side: mbd.Link(f"{side} leg", mass=5.0, length=1.0, center=0.5) for side in SIDES}
    for side, other in SIDES, SIDES[::-1]:
        ahead = mbd.measure(lambda a, b: a[0] - b[0] - 0.1, legs[side].end, legs[other].end)
        release = mbd.When(f"{other} foot", may_pull=pull)
        found[side] = mbd.Revolute(f"{side} hip", hip.origin, legs[side].start)
        model.connect(found[side])
        foot = mbd.touchdown(legs[side].end)
        model.constrain(mbd.Unilateral(f"{side} foot", foot, release=release, only_while=ahead))
    return model, {**found, "hip": hip, "legs": legs}


def _walker(model: mbd.Model, angle: float, rates: tuple[float, float], **position: float) -> Walker:
    legs = {"left hip.angle": angle, "right hip.angle": -angle}
    velocity = {"left hip.rate": rates[0], "right hip.rate": rates[1]} | dict.fromkeys(position, 0.0)
    return Walker(model, mbd.assemble(model, {**legs, **position}, velocity, closed="left foot"))


def torso(modes: bool) -> Walker:
    """A torso held upright by the hip of the leg that stands; without modes by both hips alike."""
    model, parts = _legs("torso", mbd.on_slope(math.radians(3.0)), pull=True)
    body = mbd.Link("torso", mass=2.0, length=0.5, center=0.25, inertia=0.1)
    waist = mbd.Revolute("waist", parts["hip"].origin, body.start)
    model.connect(waist)

    def hold(angle: Any, rate: Any) -> Any:
        return 100.0 * (angle - math.pi) + 20.0 * rate

    state = ["waist.angle", "waist.rate"]
    model.apply(mbd.Motor("waist drive", waist, torque=lambda q, v: -hold(q, v), arguments=state))
    for side in SIDES:
        law: Any = {"torque": {side: hold}, "by": "stance"} if modes else {"torque": lambda q, v: 0.5 * hold(q, v)}
        model.apply(mbd.Motor(f"{side} drive", parts[side], arguments=state, **law))
    if modes:
        steps = [mbd.Transition(a, b, on=f"{b} foot") for a, b in (SIDES, SIDES[::-1])]
        model.constrain(mbd.Mode("stance", SIDES, transitions=steps))
    return _walker(model, 0.271, (-1.0924, -0.3774), **{"waist.angle": math.pi})


def reflexes(modes: bool) -> Walker:
    """Hips flex for a time after each strike; without modes they have a weak constant torque, down a slope."""
    gravity = (0.0, -9.81, 0.0) if modes else mbd.on_slope(math.radians(1.0))
    model, parts = _legs("reflexes", gravity)
    for side, other in SIDES, SIDES[::-1]:
        law: Any = {"torque": {"burst": 8.0}, "by": f"{side} reflex"} if modes else {"torque": 0.0}
        back: Any = {"torque": {"burst": -8.0}, "by": f"{side} reflex"} if modes else {"torque": 0.0}
        model.apply(mbd.Motor(f"{side} flexor", parts[side], **law))
        model.apply(mbd.Motor(f"{side} flexor on {other} leg", parts[other], **back))
        if modes:
            phases = [
                mbd.Transition(("quiet", "burst"), "delay", on=f"{other} foot"),
                mbd.Transition("delay", "burst", after=0.03), mbd.Transition("burst", "quiet", after=0.15),
            ]  # fmt: skip
            model.constrain(mbd.Mode(f"{side} reflex", ("quiet", "delay", "burst"), transitions=phases))
    return _walker(model, *((0.135, (-0.6, 0.0)) if modes else (0.19, (-0.8, -0.45))))


def push_off(modes: bool) -> Walker:
    """The trailing leg pushes just before each strike; without impulses the walker goes down a slope."""
    model, parts = _legs("push-off", (0.0, -9.81, 0.0) if modes else mbd.on_slope(0.03))
    reads = ["left hip.angle", "right hip.angle"]
    model.apply(mbd.Potential("hip spring", lambda left, right: 10.0 * (left - right) ** 2, arguments=reads))
    for side, other in (SIDES, SIDES[::-1]) if modes else ():
        leg = parts["legs"][side].start
        impulse = mbd.Impulse(
            f"{side} push-off", parts["hip"].origin, 4.0, on=f"{other} foot", direction=(0.0, 1.0), axes=leg
        )
        model.constrain(impulse)
    return _walker(model, 0.186, (-1.08, -0.93))


def knees(modes: bool, powered: tuple[str, ...] = SIDES) -> Walker:
    """Chen's walker with an impedance of five phases at powered knees; the others, and without modes all, have one."""
    model = mbd.Model("knees", gravity=mbd.on_slope(0.0504))
    hip = mbd.PointMass("hip", mass=0.5)
    model.connect(mbd.Translation("trunk", model.ground.origin, hip.origin))
    damping = {"stance": 2e-4, "flexion": 1e-4, "extension": 2e-4, "late swing": 3e-4, "locked": 1e-4}
    for side, other in SIDES, SIDES[::-1]:
        thigh = mbd.Link(f"{side} thigh", mass=0.5, length=0.5, center=0.325)
        shank = mbd.Link(f"{side} shank", mass=0.05, length=0.5, center=0.125)
        knee = mbd.Revolute(f"{side} knee", thigh.end, shank.start)
        model.connect(mbd.Revolute(f"{side} hip", hip.origin, thigh.start), knee)
        after = mbd.When(f"{other} foot", after_impact=True)
        model.constrain(
            mbd.Unilateral(f"{side} foot", mbd.touchdown(shank.end), release=mbd.When(f"{other} foot")),
            mbd.Unilateral(f"{side} knee lock", mbd.flexion(knee), release=after),
        )
        names, reads = tuple(damping), [f"{side} knee.angle", f"{side} knee.rate"]
        straight = mbd.measure(lambda angle: angle + 0.1, f"{side} knee.angle")
        causes: list[dict[str, Any]] = [
            {"on": f"{other} foot"}, {"when": f"{side} knee.rate", "direction": 1},
            {"when": straight, "direction": 1}, {"on": f"{side} knee lock"}, {"on": f"{side} foot"},
        ]  # fmt: skip
        laws = {state: lambda q, v, d=d: -d * (v + q) for state, d in damping.items()}
        plain: Any = {"torque": lambda q, v: -2e-4 * (v + q)}
        has_modes = modes and side in powered
        law: Any = {"torque": laws, "by": f"{side} phase"} if has_modes else plain
        model.apply(mbd.Motor(f"{side} motor", knee, arguments=reads, **law))
        if has_modes:
            turns = [mbd.Transition(names[k], names[(k + 1) % 5], **cause) for k, cause in enumerate(causes)]
            first = "stance" if side == "left" else "flexion"
            model.constrain(mbd.Mode(f"{side} phase", names, first, transitions=turns))
    start = mbd.assemble(
        model, {"left hip.angle": 0.2386, "right hip.angle": -0.2386},
        {"left hip.angle": -1.1096, "right hip.angle": -0.0571}, closed=["left foot", "left knee lock"],
    )  # fmt: skip
    return Walker(model, start, ("hip.mass", 0.5), mirror=SIDES if powered == SIDES else None)


def wheel(modes: bool) -> Walker:
    """A rimless wheel pushed along its trailing spoke before each strike; without impulses down a slope."""
    name, gravity = "wheel", (0.0, -9.81, 0.0) if modes else mbd.on_slope(0.12)
    model, hub = mbd.Model(name, gravity=gravity), mbd.RigidBody("hub", mass=1.1, inertia=0.3)
    model.connect(mbd.Planar("wheel", model.ground.origin, hub.origin))
    tips = [(math.sin(a), -math.cos(a)) for a in (2.0 * math.pi * k / 8 for k in range(8))]
    for k, (x, y) in enumerate(tips):
        model.constrain(mbd.Unilateral(f"spoke {k}", mbd.touchdown(hub.point(x, y, name=f"tip {k}"))))
    for k in range(8) if modes else ():
        way = tuple(-each for each in tips[k - 1])
        model.constrain(mbd.Impulse(f"push {k}", hub.origin, 0.8, f"spoke {k}", direction=way, axes=hub.origin))
    velocity = {"wheel.angle": -1.9, "wheel.x": 1.9, "wheel.y": 0.0}
    start = mbd.assemble(model, {"wheel.y": 1.0}, velocity, closed="spoke 0")
    return Walker(model, start, ("hub.mass", 1.1), "spoke 0", None)


def hopper(modes: bool) -> Walker:
    """Raibert's hopper; without modes its leg keeps its length, and one law acts at its hip."""
    model, body = mbd.Model("hopper"), mbd.RigidBody("body", mass=10.0, inertia=1.1)
    leg, foot = mbd.Link("leg", mass=0.5, length=0.4, center=0.2, inertia=0.01), mbd.PointMass("foot", mass=0.1)
    hip = mbd.Revolute("hip", body.origin, leg.start)
    loss: Any = mbd.Viscous(20.0)
    slide = mbd.Prismatic("slide", leg.end, foot.origin, axis=(0, -1, 0), stiffness=4e3, rest=0.2, loss=loss)
    model.connect(mbd.Planar("trunk", model.ground.origin, body.origin), hip, slide)
    model.constrain(mbd.Unilateral("toe", mbd.touchdown(foot.origin)))

    def place(angle: Any, rate: Any, pitch: Any, turning: Any, speed: Any, time: Any = 0.17) -> Any:
        goal = mbd.asin(mbd.clip((0.5 * speed * time + 0.03 * (speed - 1.2)) / 0.6, -0.6, 0.6))
        return -60.0 * (pitch + angle - goal) - 4.0 * (turning + rate)

    def upright(angle: Any, rate: Any, pitch: Any, turning: Any, *_: Any) -> Any:
        return 100.0 * pitch + 40.0 * turning

    reads = ["hip.angle", "hip.rate", "trunk.angle", "trunk.angle.rate", "trunk.x.rate"]
    if modes:
        phase = mbd.Mode(
            "phase", ("flight", "compression", "thrust"),
            transitions=[
                mbd.Transition("flight", "compression", on="toe"),
                mbd.Transition("compression", "thrust", when="slide.rate", direction=1),
                mbd.Transition(("compression", "thrust"), "flight", on="toe opened"),
            ],
            remembers={"stance time": {"flight": "stance.time"}}, sets={"slide spring.rest": {"thrust": 0.22}},
        )  # fmt: skip
        turns = [mbd.Transition("off", "on", on="toe"), mbd.Transition("on", "off", on="toe opened")]
        model.apply(phase, mbd.Mode("stance", ("off", "on"), transitions=turns))
        laws = {"flight": place, "compression": upright, "thrust": upright}
        model.apply(mbd.Motor("drive", hip, torque=laws, by="phase", arguments=[*reads, "phase.stance time"]))
    else:
        model.apply(mbd.Motor("drive", hip, torque=place, arguments=reads))
    position = {"trunk.y": 1.0, "slide.displacement": 0.2, "trunk.angle": 0.0}
    return Walker(model, mbd.assemble(model, position, {"trunk.x.rate": 0.9}), ("body.mass", 10.0), "toe", None)


MACHINES: dict[str, Callable[[bool], Walker]] = {
    "torso held by the stance leg": torso,
    "reflexes with timers": reflexes,
    "push-off at strikes": push_off,
    "a knee of five phases": partial(knees, powered=("right",)),
    "two knees of five phases": knees,
    "wheel pushed at strikes": wheel,
}


def tasks_of(walker: Walker, start: mbd.State) -> dict[str, Callable[[], Any]]:
    """What is timed of a walker with a gait beside a start, by name; everything is compiled."""
    gait, (mass, value) = walker.gait(start), walker.mass
    how: dict[str, Any] = {"integrator": gait.map.integrator, "dt": gait.map.dt}
    many = {mass: value * np.linspace(0.999, 1.001, STARTS)}
    until = (walker.section, 3.0 * gait.period)
    return {
        "run": partial(mbd.simulate, walker.model, gait.state, **how, until=(STEPS + 0.5) * gait.period),
        "limit cycle": partial(walker.gait, start),
        "branch": partial(mbd.branch, gait, mass, to=1.2 * value, steps=POINTS, step=0.01 * value),
        "batch": partial(mbd.batch, walker.model, gait.state, **how, until=until, parameters=many, workers=1),
    }


def _returns(walker: Walker, gait: mbd.LimitCycle) -> tuple[Callable[[], Any], float]:
    """Runs to the section from where a gait begins, and the time that they last [s]."""
    velocity = dict(zip(gait.state.velocity_names, gait.state.v, strict=True))
    position = dict(zip(gait.state.names, gait.state.q, strict=True))
    start = mbd.assemble(walker.model, position, velocity, closed=gait.state.mode.closed)
    how: dict[str, Any] = {"integrator": gait.map.integrator, "dt": gait.map.dt, "until": (walker.section, 3.0)}
    mass, value = walker.mass
    made = partial(mbd.batch, walker.model, start, **how, parameters={mass: np.full(STARTS, value)}, workers=1)
    return made, STARTS * mbd.simulate(walker.model, start, **how).final.time


def measure(repeats: int) -> list[Figure]:
    """Of each machine a run, a limit cycle, a branch and a batch, over those of its passive twin."""
    figures = []
    for name, made in MACHINES.items():
        walkers = made(True), made(False)
        mine, its = (tasks_of(walker, walker.start) for walker in walkers)
        for what in mine:
            pair = {"mine": partial(processor_seconds, mine[what]), "its": partial(processor_seconds, its[what])}
            samples = interleaved(pair, BURST * repeats if what == "run" else repeats)
            aim = RUN_AIM.get(name, AIM) if what == "run" else AIM
            figures.append(_figure(f"{what}, {name}", samples, (1.0, 1.0), aim))
    walker = hopper(True)
    gait = walker.gait(walker.start)
    tasks = [_returns(each, gait) for each in (walker, hopper(False))]
    pair = {who: partial(processor_seconds, task) for who, (task, _) in zip(("mine", "its"), tasks, strict=True)}
    seconds = tasks[0][1], tasks[1][1]
    return [*figures, _figure("a second of returns, hopper of three phases", interleaved(pair, repeats), seconds, AIM)]


def _figure(title: str, samples: Mapping[str, Samples], units: tuple[float, float], aim: float) -> Figure:
    """The least time of a machine and of its twin, over so many units of each."""
    mine, its = (1e3 * samples[who].least / unit for who, unit in zip(("mine", "its"), units, strict=True))
    return Figure(title, mine, "ms", None, "its passive twin", its, aim, samples["mine"].spread)
