"""Scenes for runs that are cut in two, and the comparison of the halves with the whole."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

import mbd
from mbd.hardcases.redundant_rows import parallel_cranks
from tests.kernel.test_twin import rubber_ball, served_pendulum
from tests.simulation.mechanisms import ball, box, falling, kneed_walker, kneed_walker_start, pendulum
from tests.simulation.test_singular_poses import four_bars

PARTS = ("time", "q", "v", "z", "a", "s", "lam", "closed")


@dataclass(frozen=True)
class Scene:
    """A model and how it starts, its step and its end."""

    make: Callable[[], tuple[mbd.Model, mbd.State]]
    dt: float = 0.01
    until: float = 1.0


def at(make: Callable[[], mbd.Model], position=None, velocity=None) -> Callable[[], tuple[mbd.Model, mbd.State]]:
    """A model assembled there."""

    def made():
        model = make()
        return model, mbd.assemble(model, position=position, velocity=velocity)

    return made


def walking() -> tuple[mbd.Model, mbd.State]:
    walker = kneed_walker()
    return walker, kneed_walker_start(walker)


def driven_point() -> mbd.Model:
    """A point on a rail, pushed by a controller at sample instants and by a signal with kinks."""
    model = mbd.Model("cart", gravity=(0, 0, 0))
    body = mbd.PointMass("cart", mass=1.0)
    model.tunable = ("push.force.x",)
    model.connect(mbd.Prismatic("rail", model.ground.origin, body.origin, loss=mbd.Viscous(0.3)))

    def update(t, values, state):
        state["calls"] += 1  # in place, which must not reach the other runs
        return {"push.force.x": -3.0 * values["rail.displacement"] + 0.1 * (state["calls"] % 3)}, state

    signal = mbd.Samples([0.1, 0.4567, 0.7, 0.9], [0.0, 1.0, -2.0, 0.5], kind="linear")
    model.apply(
        mbd.Applied("push", body.origin, force=(0.0, 0.0, 0.0)),
        mbd.Applied("signal", body.origin, force=(signal, 0.0, 0.0)),
        mbd.Controller(
            "hold", update, period=0.047, reads=("rail.displacement",), writes=("push.force.x",), state={"calls": 0}
        ),
    )
    return model


def bouncing() -> mbd.Model:
    """A ball thrown back by the reset of an event, with a controller that hears it and changes the gravity."""
    model, body = falling()
    model.tunable = ("lift.force.y",)
    thrown = {"fall.rate": lambda named: -0.8 * named["fall.rate"]}
    model.constrain(mbd.Event("bounce", mbd.height(body.origin), direction=-1, reset=thrown))
    model.apply(
        mbd.Applied("lift", body.origin, force=(0.0, 0.0, 0.0)),
        mbd.Controller(
            "count",
            lambda t, values, state: ({"lift.force.y": 0.5 * (state + 1)}, state + 1),
            on=("bounce",),
            writes=("lift.force.y",),
            state=0,
        ),
    )
    return model


def skater() -> mbd.Model:
    """A blade on a tilted plane: rows on velocities."""
    model = mbd.Model("skater", gravity=(1.0, -9.81, 0.5))
    body = mbd.RigidBody("skate", mass=1.0, inertia=0.1)
    model.connect(mbd.Planar("place", model.ground.origin, body.origin))
    model.constrain(mbd.KnifeEdge("blade", body.origin))
    return model


FALL = {"fall.displacement": 1.0}
TILTED = {"place.y": 0.4, "place.angle": 0.3}
SCENES = {
    "kneed walker": Scene(walking, dt=2e-3, until=1.2),
    "bouncing ball": Scene(at(lambda: ball(restitution=0.6), FALL)),
    "box on sticking corners": Scene(at(lambda: box(friction=None), TILTED)),
    "box on sliding corners": Scene(at(lambda: box(friction=0.0, restitution=0.3), TILTED, {"place.x": 0.7})),
    "ball on rubber": Scene(at(rubber_ball, {"fall.displacement": 0.2}), dt=1e-3, until=0.7),
    "pendulum with a slow servo": Scene(at(served_pendulum, {"hinge.angle": 0.7})),
    "redundant cranks": Scene(parallel_cranks),
    "flat four-bar": Scene(lambda: four_bars(1).start, dt=5e-3, until=4.0),
    "controller and signal": Scene(at(driven_point, {"rail.displacement": 0.5})),
    "reset and listener": Scene(at(bouncing, {"fall.displacement": 0.3})),
    "skater": Scene(at(skater, velocity={"place.x": 1.0, "place.angle": 2.0})),
    "pendulum": Scene(at(pendulum, {"hinge.angle": 1.0})),
}


@cache
def scene(name: str) -> tuple[mbd.Model, mbd.State]:
    """Model and start of a scene, made once."""
    return SCENES[name].make()


def halves(model, start, scheme, cut, between=lambda state: state, **settings):
    """Two runs, the second from the final state of the first."""
    first = mbd.simulate(model, start, scheme, **{**settings, "until": cut})
    return first, mbd.simulate(model, between(first.final), scheme, **settings)


def assert_halves_are_the_whole(whole, first, second):
    """The rows of the whole are those of the first and, from its last one on, those of the second; events too."""
    for part in PARTS:
        all_of_it = getattr(whole.record, part)
        begin, rest = getattr(first.record, part), getattr(second.record, part)
        np.testing.assert_array_equal(begin, all_of_it[: len(begin)], err_msg=part)
        np.testing.assert_array_equal(rest, all_of_it[len(all_of_it) - len(rest) :], err_msg=part)
        assert len(begin) + len(rest) == len(all_of_it) + 1, part
    told = [[(e.time, e.kind, e.name, e.energy_loss, *e.impulse) for e in run.events] for run in (whole, first, second)]
    assert told[0] == told[1] + told[2]
