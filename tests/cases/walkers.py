"""The walkers of the cases as models of bodies, in axes that lie on the slope."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import mbd
from tests.cases.gaits import FALLEN

SIDES = (("left", "right"), ("right", "left"))


def end_at_fall(model: mbd.Model, leg: float) -> None:
    """The run ends as the hip is down at half its height."""
    low = mbd.measure(lambda y: y - FALLEN * leg, "trunk.y")
    model.constrain(mbd.Event("fall", low, terminal=True, direction=-1))


def compass(sizes: Mapping[str, float]) -> mbd.Model:
    """Two straight legs; each foot is watched only while its leg is in front, for it scuffs as it passes."""
    leg = sizes["a1"] + sizes["b1"] + sizes["a2"] + sizes["b2"]
    model = mbd.Model("compass gait", gravity=mbd.on_slope(sizes["slope"], sizes["g"]))
    hip = mbd.PointMass("hip", sizes["mh"])
    model.connect(mbd.Translation("trunk", model.ground.origin, hip.origin))
    for side, other in SIDES:
        bone = mbd.Link(f"{side} leg", sizes["mt"], length=leg, center=sizes["b2"])
        model.connect(mbd.Revolute(f"{side} hip", hip.origin, bone.start))
        ahead = mbd.measure(lambda mine, its: mine - its, f"{side} hip.angle", f"{other} hip.angle", unit="rad")
        release = mbd.When(f"{other} foot")
        model.constrain(mbd.Unilateral(f"{side} foot", mbd.touchdown(bone.end), release=release, only_while=ahead))
    end_at_fall(model, leg)
    return model


def kneed(sizes: Mapping[str, float], late: bool = False) -> mbd.Model:
    """Thighs and shanks with knees that lock; `late`: a foot is watched only once its knee has locked."""
    thigh_length, shank_length = sizes["a2"] + sizes["b2"], sizes["a1"] + sizes["b1"]
    model = mbd.Model("kneed walker", gravity=mbd.on_slope(sizes["slope"], sizes["g"]))
    hip = mbd.PointMass("hip", sizes["mh"])
    model.connect(mbd.Translation("trunk", model.ground.origin, hip.origin))
    for side, other in SIDES:
        thigh = mbd.Link(f"{side} thigh", sizes["mt"], length=thigh_length, center=sizes["b2"])
        shank = mbd.Link(f"{side} shank", sizes["ms"], length=shank_length, center=sizes["b1"])
        knee = mbd.Revolute(f"{side} knee", thigh.end, shank.start)
        model.connect(mbd.Revolute(f"{side} hip", hip.origin, thigh.start), knee)
        after = mbd.When(f"{other} foot", after_impact=True)
        only_while = f"{side} knee lock" if late else None
        foot = mbd.touchdown(shank.end)
        model.constrain(
            mbd.Unilateral(f"{side} foot", foot, release=mbd.When(f"{other} foot"), only_while=only_while),
            mbd.Unilateral(f"{side} knee lock", mbd.flexion(knee), release=after),
        )
    end_at_fall(model, thigh_length + shank_length)
    return model


def standing(model: mbd.Model, state: Sequence[float], slope: float) -> mbd.State:
    """Just after a heel strike of the left foot, from angles from the vertical."""
    stance, swing, stance_rate, swing_rate = state
    locks = [name for name in ("left knee lock",) if any(word.name == name for word in model.constraints)]
    return mbd.assemble(
        model,
        closed=["left foot", *locks],
        position={"left hip.angle": stance + slope, "right hip.angle": swing + slope},
        velocity={"left hip.angle": stance_rate, "right hip.angle": swing_rate}
        | ({"right knee.angle": 0.0} if locks else {}),
    )


@dataclass(frozen=True, eq=False)
class Strike:
    """A heel strike: when, of which foot, where, and (stance, swing, rates) from the vertical after and before it."""

    time: float
    side: str
    place: float
    after: NDArray[np.float64]
    before: NDArray[np.float64]
    knee: float | None


def strikes(run: mbd.Trajectory, slope: float) -> list[Strike]:
    """The heel strikes of a run, each with the instant of the knee strike before it."""
    hits: list[tuple[float, str, float | None]] = []
    knee: float | None = None
    for event in run.events:
        if event.kind == "closed" and event.name.endswith("knee lock"):
            knee = event.time
        if event.kind == "closed" and event.name.endswith("foot"):
            hits.append((event.time, event.name.split()[0], knee))
    times = [time for time, _, _ in hits]
    tip = "shank.end.x" if "left shank.end.x" in run else "leg.end.x"
    names = [f"{side} {part}" for side in ("left", "right") for part in ("hip.angle", "hip.rate", tip)]
    after, before = (run.at(times, side=side).read(*names) for side in ("right", "left"))

    def state(values: Mapping[str, Any], k: int, stance: str) -> NDArray[np.float64]:
        legs = (stance, "left" if stance == "right" else "right")
        angles = [values[f"{leg} hip.angle"][k] - slope for leg in legs]
        return np.array([*angles, *(values[f"{leg} hip.rate"][k] for leg in legs)])

    return [
        Strike(
            time, side, after[f"{side} {tip}"][k], state(after, k, side),
            state(before, k, "left" if side == "right" else "right"), lock,
        )
        for k, (time, side, lock) in enumerate(hits)
    ]  # fmt: skip
