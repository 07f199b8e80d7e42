"""Sliding in space along a straight line, across which nothing moves: a block stops, a ball rolls on (p8)."""

from typing import Any

import numpy as np

import mbd
from mbd.hardcases.case import Curve, Figure, HardCase, Outcome, definition
from mbd.hardcases.schemes import EVERY, is_explicit

P8 = "p8-straight-slide-and-steady-roll"


def sliding_block() -> tuple[mbd.Model, mbd.State]:
    """A point on a floor in space, thrown along x."""
    numbers = definition(P8)["definition"]
    model = mbd.Model("block", gravity=(0.0, -numbers["g"], 0.0))
    block = mbd.PointMass("block", numbers["block_mass"])
    model.connect(mbd.Translation("slide", model.ground.origin, block.origin, axes="xyz"))
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(block.origin), friction=numbers["block_mu"]))
    return model, mbd.assemble(
        model, velocity={"slide.x": definition(P8)["initial_conditions"]["block_speed"]}, closed="foot"
    )


def rolling_ball() -> tuple[mbd.Model, mbd.State]:
    """A ball on a floor, thrown along x without spin."""
    numbers = definition(P8)["definition"]
    model = mbd.Model("ball", gravity=(0.0, -numbers["g"], 0.0))
    ball = mbd.RigidBody("ball", numbers["ball_mass"], (numbers["J"],) * 3)
    model.connect(mbd.Free("place", model.ground.origin, ball.origin))
    floor = mbd.sphere_touchdown(ball.origin, numbers["radius"])
    model.constrain(mbd.Unilateral("floor", floor, friction=numbers["ball_mu"]))
    speed = {"place.x": definition(P8)["initial_conditions"]["ball_speed"]}
    return model, mbd.assemble(model, position={"place.y": numbers["radius"]}, velocity=speed, closed="floor")


def judge_straight_slides(integrator: Any) -> Outcome:
    """The block stops and the ball begins to roll at their instants and places; explicit schemes also with tol."""
    case = definition(P8)
    numbers, (stop, way, grip, place) = case["definition"], (each["value"] for each in case["quantities"])
    steps: list[dict[str, Any]] = [{"dt": numbers["dt"]}]
    if is_explicit(integrator):
        steps.append({"tol": numbers["tol"]})
    figures, curves = list[Figure](), list[Curve]()
    for how in steps:
        limit = 1e-8 if "dt" in how else 10.0 * numbers["tol"]
        setting = "" if "dt" in how else f", tol = {numbers['tol']:g}"
        block = mbd.simulate(*sliding_block(), integrator, until=numbers["block_until"], **how)
        ball = mbd.simulate(*rolling_ball(), integrator, until=numbers["ball_until"], **how)
        instants = [next((e.time for e in run.events if e.kind == "stuck"), np.inf) for run in (block, ball)]
        figures += [
            Figure(f"error of the instants of rest and of rolling [s]{setting}",
                   max(abs(instants[0] - stop), abs(instants[1] - grip)), limit),
            Figure(f"error of the places at the end [m]{setting}",
                   max(abs(block["slide.x"][-1] - way), abs(ball["place.x"][-1] - place)), limit),
            Figure(f"moved to the side [m]{setting}",
                   float(max(np.max(np.abs(block["slide.z"])), np.max(np.abs(ball["place.z"])))), 1e-12),
        ]  # fmt: skip
        curves.append(Curve(f"speed of the ball{setting}", ball.t, ball["place.x.rate"], y_label="[m/s]"))
    return Outcome(figures, curves)


CASES = (
    HardCase(
        P8, "Sliding straight in space ends at rest, or in rolling, at its instant and place, with every scheme.",
        judge_straight_slides, EVERY,
    ),
)  # fmt: skip
