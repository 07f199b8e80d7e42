"""Planes on bodies and heights that move: what they are called with, what they hold, what they refuse."""

import functools
import math
import pickle

import numpy as np
import pytest
import sympy

import mbd
from mbd.bodies import Ground
from mbd.constraints.surfaces import Plane, Surface
from mbd.errors import ModelError
from mbd.tape.derivatives import gradient
from tests.helpers import FreeScope

GROUND = Ground()
ROD = mbd.Link("rod", 1.0, 0.5, 0.2)
PLANK = mbd.RigidBody("plank", 2.0, (0.1, 0.2, 0.3))
x, z, t = sympy.symbols("x z t")


def placed(seed: int = 0) -> FreeScope:
    """Both bodies somewhere, moving."""
    scope = FreeScope()
    for body in ("rod", "plank"):
        scope.coordinates(body)
    scope.scatter(np.random.default_rng(seed))
    return scope


# heights ------------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("ground", "names"),
    [
        (lambda x: x, "x"),
        (lambda s: s, "x"),
        (lambda x, z: x, "xz"),
        (lambda a, b: a, "xz"),
        (lambda z, x: x, "zx"),
        (lambda t: t, "t"),
        (lambda x, t: x, "xt"),
        (lambda t, s: s, "tx"),
        (lambda x, z, t: x, "xzt"),
        (lambda x, k=2.0: k * x, "x"),
        (lambda x, t, k=2.0: k * x, "xt"),
        (mbd.sin, "x"),
        (np.sin, "x"),
        (functools.partial(lambda k, x, t: k * x, 2.0), "xt"),
        (0.1 * x, "x"),
        (x, "x"),
        (x * t, "xt"),
        (x * z + t, "xzt"),
        (sympy.Lambda((t, x), x * t), "tx"),
    ],
)
def test_the_names_of_parameters_say_what_a_height_is_called_with(ground, names):
    surface = Surface(ground)
    assert "".join(surface.arguments) == names
    assert surface.is_moving == ("t" in names)


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (lambda x, t: 0.2 * x * mbd.sin(t), 0.2 * x * sympy.sin(t)),
        (lambda t, z, x: x * z - t, x * z - t),
        (lambda x, t, k=0.3: k * x * t, sympy.Lambda((x, t), 0.3 * x * t)),
    ],
)
def test_a_moving_height_is_a_function_or_an_expression(first, second):
    scope = placed()
    values = [scope.value(mbd.touchdown(ROD.end, ground).gap(scope))[0] for ground in (first, second)]
    assert values[0] == pytest.approx(values[1], rel=1e-14)
    assert values[0] != pytest.approx(scope.value(mbd.height(ROD.end).gap(scope))[0], abs=1e-3)


def test_the_rate_of_a_gap_over_moving_ground_is_that_of_the_distance():
    """At a place on the surface ġ = n · (ṗ − (0, H_t, 0))."""
    scope = placed()
    foot = mbd.touchdown(ROD.start, lambda x, z, t: 0.3 * mbd.sin(2.0 * x + z - 3.0 * t))
    place = scope.coordinates("rod")[:3]
    scope.numbers[place[1]] = 0.0
    X, _, Z = (scope.numbers[node] for node in place)
    phase = 2.0 * X + Z - 3.0 * scope.numbers[scope.time]
    scope.numbers[place[1]] = 0.3 * math.sin(phase)
    normal = np.array([-0.6 * math.cos(phase), 1.0, -0.3 * math.cos(phase)])
    velocity = np.array([scope.numbers[node] for node in scope.rates("rod")[:3]])
    expected = normal @ (velocity - [0.0, -0.9 * math.cos(phase), 0.0]) / np.linalg.norm(normal)
    rate = scope.rate(scope.tape.lift(foot.gap(scope)))
    assert scope.value(rate)[0] == pytest.approx(expected, rel=1e-12)


# planes -------------------------------------------------------------------------------------------------------------
def test_the_gap_over_a_plank_is_measured_along_its_normal_from_its_frame():
    scope = placed(3)
    frame = PLANK.point(0.1, 0.2, -0.3).turned(0.4, axis=(1, 2, 3))
    plane = Plane((1.0, 2.0, -1.0), 0.05, frame)
    own, end = scope.frame(frame), scope.frame(ROD.end)
    R = scope.matrix(own.rotation)
    away = np.array(scope.value(*end.position)) - scope.value(*own.position)
    expected = np.array(plane.normal) @ R.T @ away - 0.05
    assert scope.value(mbd.touchdown(ROD.end, plane).gap(scope))[0] == pytest.approx(expected, abs=1e-14)


def test_a_belt_carries_the_place_that_is_held():
    scope = placed(2)
    plane = Plane(frame=PLANK.origin, velocity=(0.5, 0.0, -0.2))
    foot = mbd.touchdown(ROD.end, plane)
    anchors = scope.value(*foot.captured(scope))
    scope.numbers[scope.time] += 2.0
    slips = dict(foot.tangents(scope, anchors))
    assert scope.value(slips["forward"], slips["sideways"]) == pytest.approx([-1.0, 0.4], abs=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_what_holds_a_foot_on_a_body_pushes_that_body_back(seed):
    """Rows of sticking are forces between the two bodies: none of them moves or turns both together."""
    scope = placed(seed)
    foot = mbd.touchdown(ROD.point(0.1, 0.2, 0.3), Plane((1.0, 3.0, 0.5), 0.1, PLANK.point(0.2, 0.1, 0.3)))
    rows = [foot.gap(scope), *(row for _, row in foot.tangents(scope, [0.3, -0.2, 0.5]))]
    slopes = scope.matrix([gradient(scope.tape.lift(row), scope.all_coordinates) for row in rows])
    rides = [(axis, 0 * axis) for axis in np.eye(3)] + [(0 * axis, axis) for axis in np.eye(3)]
    work = slopes @ np.array([scope.ride(*ride) for ride in rides]).T
    np.testing.assert_allclose(work, 0.0, atol=1e-12)


def test_a_plane_of_the_ground_is_what_it_was():
    scope = placed()
    assert mbd.touchdown(ROD.end, Plane()).gap(scope) is mbd.height(ROD.end).gap(scope)
    assert mbd.touchdown(ROD.end, Plane(frame=GROUND.origin)).gap(scope) is mbd.height(ROD.end).gap(scope)
    assert not Plane().is_moving and Plane(velocity=(1, 0)).is_moving and Plane(frame=PLANK.origin).is_moving
    deck = Plane((0, 2, 0), 0.1, PLANK.origin, (1, 0))
    assert deck == Plane((0.0, 1.0, 0.0), 0.1, PLANK.origin, (1.0, 0.0, 0.0))
    assert pickle.loads(pickle.dumps(mbd.touchdown(ROD.end, deck))) == mbd.touchdown(ROD.end, deck)


def test_the_body_of_a_plane_is_mentioned():
    frame = PLANK.point(0.0, 0.1)
    assert mbd.touchdown(ROD.end, Plane(frame=frame)).mentions() == [ROD.end, frame]
    assert mbd.Rolling("tyre", ROD.center, 0.1, Plane(frame=frame)).mentions() == [ROD.center, frame]
    assert mbd.touchdown(ROD.end).mentions() == [ROD.end]


def test_a_plank_that_hangs_on_nothing_is_told():
    model = mbd.Model("lost plank")
    model.connect(mbd.Planar("float", model.ground.origin, ROD.start))
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(ROD.end, Plane(frame=PLANK.origin))))
    assert any("'plank', which 'foot' refers to, is not connected" in fault for fault in model.check())


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: Plane(frame=PLANK), "frame of a Plane must be a frame"),
        (lambda: Plane(velocity=3.0), "velocity of a Plane"),
        (lambda: mbd.touchdown(ROD.end, lambda x, y, z: x), "x, y, z; bring further values along"),
        (
            lambda: mbd.touchdown(ROD.end, lambda x, k=1.0, t=0.0: x),
            r"before parameters with a default, got \(x, k, t\)",
        ),
        (lambda: mbd.Rolling("w", ROD.center, 0.1, Plane(frame=PLANK.origin.turned(1.0, (1, 0, 0)))), "about z only"),
    ],
)
def test_wrong_surfaces_are_refused_in_words(make, told):
    with pytest.raises(ModelError, match=told):
        make()


def test_a_foot_on_its_own_body_is_a_fault():
    own = Plane(frame=ROD.start)
    assert "are both on 'rod'" in mbd.Unilateral("foot", mbd.touchdown(ROD.end, own)).faults()[0]
    assert "on the wheel 'rod' itself" in mbd.Rolling("tyre", ROD.center, 0.1, own).faults()[0]
    assert mbd.Unilateral("foot", mbd.touchdown(ROD.end, Plane(frame=PLANK.origin))).faults() == []
