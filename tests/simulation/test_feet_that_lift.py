"""Corners and feet that lift as their forces pass zero, several at once: no round-off, no error of a step undoes it."""

import itertools
import math

import numpy as np
import pytest

import mbd

FAMILY = mbd.HHT(0.1), mbd.GeneralizedAlpha(0.8), mbd.Newmark()


def tipping_block(seed):
    """A block on its four corners, tipped over an edge by a bar that whirls on top of it."""
    rng = np.random.default_rng(seed)
    size, mass = rng.uniform((0.2, 0.3, 0.2), (0.4, 0.6, 0.4)), rng.uniform(5.0, 20.0)
    inertia = tuple(mass / 12.0 * (size @ size - size**2))
    length, weight = rng.uniform(0.3, 0.6), rng.uniform(0.5, 3.0)
    block = mbd.RigidBody("block", mass, inertia)
    bar = mbd.RigidBody("bar", weight, (1e-3, weight * length**2 / 12.0, weight * length**2 / 12.0))
    model = mbd.Model("tipping block")
    model.connect(mbd.Free("float", model.ground.origin, block.origin))
    axle = block.point(0.0, 0.5 * size[1], rng.uniform(-0.05, 0.05) * (seed % 2))
    model.connect(mbd.Revolute("pivot", axle, bar.point(-0.5 * length, 0.0, 0.0)))
    for k, (x, z) in enumerate(((1, 1), (1, -1), (-1, -1), (-1, 1))):
        corner = block.point(0.5 * x * size[0], -0.5 * size[1], 0.5 * z * size[2])
        model.constrain(mbd.Unilateral(f"corner {k}", mbd.touchdown(corner), friction=0.8))
    start = mbd.assemble(
        model,
        {"float.y": 0.5 * size[1], "pivot.angle": rng.uniform(-2.0, 2.0)},
        {"pivot.angle": rng.uniform(5.0, 25.0)},
        closed=[f"corner {k}" for k in range(4)],
    )
    return model, start


def story(run):
    """Which contacts open, close and slip, sorted where several do so together."""
    groups = itertools.groupby(run.events, key=lambda event: round(event.time, 4))
    return [sorted((event.name, event.kind) for event in group) for _, group in groups]


def reopens(run):
    """Contacts that close again at the instant at which they have opened."""
    opened = {}
    for event in run.events:
        if event.kind == "opened":
            opened[event.name] = event.time
        elif event.kind == "closed" and event.time - opened.get(event.name, -math.inf) < 1e-9:
            yield event


@pytest.mark.parametrize("seed", [0, 6, 18])
def test_a_block_tips_over_its_edge_alike_with_every_scheme_and_step(seed):
    """Two corners lift at once, later the two on the edge slide at once: each of them does so once."""
    model, start = tipping_block(seed)
    told = story(mbd.simulate(model, start, mbd.RadauIIA(), dt=1e-3, until=0.1))
    for scheme, dt in itertools.product(FAMILY, 1e-3 + 1.1e-4 * np.arange(12)):
        run = mbd.simulate(model, start, scheme, dt=dt, until=0.1, contact="events")
        assert story(run) == told, (scheme, dt)
        assert not list(reopens(run))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(40))
def test_random_blocks_tip_and_land(seed):
    model, start = tipping_block(seed)
    for scheme, dt in itertools.product((*FAMILY, mbd.RadauIIA()), (1e-3, 1.3e-3, 2e-3)):
        run = mbd.simulate(model, start, scheme, dt=dt, until=0.25, contact="events")
        for k in range(4):
            friction = np.hypot(run[f"corner {k}.friction.forward"], run[f"corner {k}.friction.sideways"])
            push = run[f"corner {k}.force"]
            assert push.min() >= -1e-8 * push.max()
            assert (friction - 0.8 * push).max() <= 1e-6 * max(push.max(), 1.0)


def person_who_lands(passive, height, knees, friction):
    """On two feet, each with a heel and two balls that stick and slide."""
    person = mbd.human(70.0, 1.75, "female", passive=passive)
    model = mbd.Model("person who lands")
    model.connect(*person.joints)
    model.apply(*person.moments if passive else ())
    for side, place in itertools.product(("left", "right"), ("heel", "inner ball", "outer ball")):
        point = person.bodies[f"{side} foot"].frame(place)
        model.constrain(mbd.Unilateral(f"{side} {place}", mbd.touchdown(point), friction=friction))
    stands = person.standing(knees=knees)
    stands["trunk.y"] += height
    return model, mbd.assemble(model, stands)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("person", "scheme", "until", "end", "lift"),
    [
        ((False, 0.02, 0.3, 0.5), mbd.HHT(0.1), 0.728, 0.7315, ("left heel", "right heel")),
        ((True, 0.1, 0.6, 0.8), mbd.GeneralizedAlpha(0.8), 0.548, 0.551,
         ("left inner ball", "left outer ball", "right inner ball", "right outer ball")),
    ],
)  # fmt: skip
def test_both_feet_of_a_person_lift_once(person, scheme, until, end, lift):
    """Their forces pass zero at the same instant; the error of a step may hold a foot below the ground."""
    model, start = person_who_lands(*person)
    before = mbd.simulate(model, start, scheme, dt=2e-3, until=until, contact="events").final
    for dt in 1e-3 + 3.3e-5 * np.arange(30):
        run = mbd.simulate(model, before, scheme, dt=dt, until=end, contact="events")
        opened = [event.name for event in run.events if event.kind == "opened"]
        assert sorted(opened) == sorted(lift), dt
        assert not any(event.kind in ("closed", "stuck") for event in run.events)
