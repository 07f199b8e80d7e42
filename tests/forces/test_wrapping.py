"""Paths around surfaces: shortest of all ways, moment arms, lifting off, sides and ends, two surfaces, runs."""

import math
import warnings

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import minimize, root

import mbd
from mbd.forces.muscles.wrapping import taut


class Still:
    """A scope in which frames of the ground stand still, and parameters are what they are."""

    class _Motion:
        def __init__(self, frame):
            self.rotation = frame.rotation or ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
            self.position = frame.offset

    def frame(self, frame):
        return self._Motion(frame)

    def parameter(self, owner, field, value):
        return value


def length(P, S, *surfaces):
    return float(taut(Still(), "muscle", tuple(P), tuple(S), list(enumerate(surfaces, 1))))


def shortest(P, S, kind, r, guesses):
    """The least length over where a path touches and leaves the surface, with straight pieces outside of it."""

    def ends(x):
        (u, z, w, y) = x
        if kind == "sphere":
            return [r * np.array([math.cos(a) * math.cos(b), math.sin(a) * math.cos(b), math.sin(b)])
                    for a, b in ((u, z), (w, y))]  # fmt: skip
        return [np.array([r * math.cos(a), r * math.sin(a), b]) for a, b in ((u, r * z), (w, r * y))]

    def whole(x):
        A, B = ends(x)
        if kind == "sphere":
            arc = r * math.atan2(np.linalg.norm(np.cross(A, B)), A @ B)
        else:
            arc = math.hypot(r * (x[2] - x[0]), B[2] - A[2])
        return (np.linalg.norm(P - A) + arc + np.linalg.norm(S - B)) / r

    def outside(x):
        normal = np.array([1.0, 1.0, 1.0 if kind == "sphere" else 0.0])
        return [float(((point - place) * normal) @ place) / r**2 for point, place in zip((P, S), ends(x), strict=True)]

    limits = {"type": "ineq", "fun": outside}
    found = [minimize(whole, x, constraints=limits, options={"ftol": 1e-15, "maxiter": 500}) for x in guesses]
    return r * min(each.fun for each in found if min(outside(each.x)) > -1e-9)


@pytest.mark.parametrize("kind", ["sphere", "cylinder"])
def test_the_path_is_the_shortest_around_the_surface(kind):
    model, rng, r, touched = mbd.Model("m"), np.random.default_rng(2), 0.03, 0
    make = mbd.WrappingSphere if kind == "sphere" else mbd.WrappingCylinder
    surface = make(model.ground.origin, r)
    for _ in range(8):
        a, b = rng.uniform(0.0, 0.6), rng.uniform(2.2, 3.0)
        P = np.array([*rng.uniform(1.1, 4.0) * r * np.array([math.cos(a), math.sin(a)]), rng.uniform(-0.02, 0.02)])
        S = np.array([*rng.uniform(1.1, 4.0) * r * np.array([math.cos(b), math.sin(b)]), rng.uniform(-0.02, 0.02)])
        ours = length(P, S, surface)
        if ours == pytest.approx(np.linalg.norm(S - P), abs=1e-12):
            continue
        touched += 1
        best = shortest(P, S, kind, r, [(a + 0.3, 0.0, b - 0.3, 0.0), (a + 0.6, 0.1, b - 0.1, -0.1)])
        assert ours == pytest.approx(best, abs=1e-8)
        assert ours > np.linalg.norm(S - P)
    assert touched >= 3


def test_a_turn_between_two_tangents_has_its_closed_form():
    """Up along x = r, around by γ, and 3 m along the tangent there; on a side also the other way around."""
    ground, r, gamma = mbd.Model("m").ground, 0.5, 0.2
    c, s = math.cos(gamma), math.sin(gamma)
    P, S = (r, -2.0, 0.0), (r * c - 3.0 * s, r * s + 3.0 * c, 0.0)
    flat = 2.0 + r * gamma + 3.0
    for surface in (
        mbd.WrappingSphere(ground.origin, r),
        mbd.WrappingCylinder(ground.origin, r),
        mbd.WrappingCylinder(ground.origin, r, side=(0.2, 0.1, 0.0)),
    ):
        assert length(P, S, surface) == pytest.approx(flat, rel=1e-15)
        assert length(S, P, surface) == pytest.approx(flat, rel=1e-15)
    raised = length(P, (S[0], S[1], 1.7), mbd.WrappingCylinder(ground.origin, r))
    assert raised == pytest.approx(math.hypot(flat, 1.7), rel=1e-15)
    alpha, beta = math.atan(2.0 / r), math.atan(3.0 / r)
    behind = length(P, S, mbd.WrappingCylinder(ground.origin, r, side=(-1.0, 0.0, 0.0)))
    turn = math.tau - (gamma + alpha + beta) - alpha - beta
    assert behind == pytest.approx(2.0 + r * turn + 3.0, rel=1e-14)


def test_two_surfaces_share_the_tangent_between_them():
    """Circles of two radii with a common tangent, in closed form; helices by the least of all lengths."""
    ground, r1, r2, d = mbd.Model("m").ground, 0.3, 0.2, 2.0
    above = {"side": (0.0, 1.0, 0.0)}
    first = mbd.WrappingCylinder(ground.origin, r1, **above)
    second = mbd.WrappingCylinder(ground.point(d, 0.0, 0.0), r2, **above)
    P, S = (-r1, -1.0, 0.0), (d + r2, -1.5, 0.0)
    slope = math.asin((r1 - r2) / d)
    flat = 1.0 + r1 * (math.pi / 2 + slope) + math.sqrt(d * d - (r1 - r2) ** 2) + r2 * (math.pi / 2 - slope) + 1.5
    assert length(P, S, first, second) == pytest.approx(flat, rel=1e-13)
    # parallel axes: one helix over the developed surface
    raised = length(P, (d + r2, -1.5, 0.9), first, second)
    assert raised == pytest.approx(math.hypot(flat, 0.9), rel=1e-9)
    # what is not touched changes nothing
    below = mbd.WrappingCylinder(ground.point(d, -3.0, 0.0), r2, **above)
    assert length(P, (3.0, 0.5, 0.1), first, below) == pytest.approx(length(P, (3.0, 0.5, 0.1), first), abs=1e-15)


def test_two_spheres_share_a_path_that_leaves_every_plane():
    """The least of |PA| + arc AB + |BC| + arc CD + |DS|; its slope by P is (P − A)/|PA|."""
    P, S, middles, radii = (
        (-0.09, -0.04, -0.01),
        (0.2, 0.02, 0.0),
        ((0.02, -0.01, -0.01), (0.08, -0.01, 0.01)),
        (0.04, 0.03),
    )
    ground, c, r = mbd.Model("m").ground, np.array(middles), radii
    spheres = [mbd.WrappingSphere(ground.point(*middle), radius) for middle, radius in zip(middles, radii, strict=True)]

    def places(x):
        u = x.reshape(4, 3) / np.linalg.norm(x.reshape(4, 3), axis=1)[:, None]
        return u, np.array([c[k // 2] + r[k // 2] * u[k] for k in range(4)])

    def whole(x):
        u, (A, B, C, D) = places(x)
        arcs = sum(
            r[k] * math.atan2(np.linalg.norm(np.cross(u[2 * k], u[2 * k + 1])), u[2 * k] @ u[2 * k + 1]) for k in (0, 1)
        )
        return 10.0 * (math.dist(P, A) + math.dist(B, C) + math.dist(D, S) + arcs)

    def outside(x):
        u, (A, B, C, D) = places(x)
        return [(P - A) @ u[0], (C - B) @ u[1], (B - C) @ u[2], (S - D) @ u[3]]

    guess = np.array([[0.0, -1.0, 0.0], [0.3, -1.0, 0.0], [0.2, -0.7, -0.7], [0.3, -0.7, -0.7]])
    limits = {"type": "ineq", "fun": outside}
    best = minimize(whole, np.ravel(guess), constraints=limits, options={"ftol": 1e-16, "maxiter": 500})
    assert min(outside(best.x)) > -1e-9
    assert length(P, S, *spheres) == pytest.approx(best.fun / 10.0, abs=1e-9)
    A = places(best.x)[1][0]
    slope = [(length(P + h, S, *spheres) - length(P - h, S, *spheres)) / 2e-6 for h in 1e-6 * np.eye(3)]
    np.testing.assert_allclose(slope, (P - A) / math.dist(P, A), atol=1e-5)


def geodesic(P, S, radii):
    """Length of the geodesic that is tangent to the lines to both points: shot from the outline seen from P."""
    p, squares = P / radii, radii**2
    k = (S - P) / radii
    foot = p - (p @ k) / (k @ k) * k
    # the outline seen from P is a circle of the unit sphere, whose points an angle from the way around tells
    u = foot - (foot @ p) / (p @ p) * p
    u /= np.linalg.norm(u)
    w = np.cross(p, u) / np.linalg.norm(p)
    away = np.linalg.norm(p)

    def shot(angle, arc):
        T = radii * (p / away**2 + math.sqrt(1.0 - away**-2) * (math.cos(angle) * u + math.sin(angle) * w))
        start = (T - P) / np.linalg.norm(T - P)

        def slope(_, y):
            normal = y[:3] / squares
            return np.concatenate([y[3:], -(y[3:] ** 2 / squares).sum() / (normal @ normal) * normal])

        end = solve_ivp(slope, (0.0, arc), np.concatenate([T, start]), rtol=1e-10, atol=1e-12).y[:, -1]
        return np.linalg.norm(T - P), end[:3], end[3:]

    def miss(x):
        _, place, direction = shot(x[0], x[1])
        return place + x[2] * direction - S

    guess = (0.0, 0.5 * radii.mean(), np.linalg.norm(S / radii) * radii.mean())
    found = root(miss, guess, tol=1e-9)
    whole = shot(found.x[0], found.x[1])[0] + found.x[1] + found.x[2]
    return whole if found.success and found.x[1] > 0.0 and found.x[2] > 0.0 else math.nan


def test_a_path_around_an_ellipsoid_is_hardly_longer_than_the_geodesic():
    """Radii that differ up to 1.5 times, by less than 1e-3 of their mean; of one radius it is the sphere's."""
    ground, rng, seen = mbd.Model("m").ground, np.random.default_rng(3), 0
    while seen < 25:
        radii = rng.uniform(0.8, 1.2, size=3)
        P, S = ((direction := rng.normal(size=3)) * rng.uniform(1.2, 3.0) / np.linalg.norm(direction) for _ in range(2))
        ours = length(P, S, mbd.WrappingEllipsoid(ground.origin, tuple(radii)))
        assert length(S, P, mbd.WrappingEllipsoid(ground.origin, tuple(radii))) == pytest.approx(ours, rel=1e-9)
        alike = mbd.WrappingEllipsoid(ground.origin, (radii[0],) * 3)
        assert length(P, S, alike) == pytest.approx(
            length(P, S, mbd.WrappingSphere(ground.origin, radii[0])), rel=1e-12
        )
        foot = P - (P @ (S - P)) / ((S - P) @ (S - P)) * (S - P)
        shortest_of_all = geodesic(P, S, radii) if 0.4 < np.linalg.norm(foot) < 0.7 else math.nan
        if math.isnan(shortest_of_all) or ours < math.dist(P, S) + 1e-6:
            continue
        seen += 1
        assert shortest_of_all - 1e-7 < ours < shortest_of_all + 1e-3


def test_the_side_of_an_ellipsoid_is_that_of_its_path():
    """A sphere with a side beside the closed form of both ways around; away from the surface the path is straight."""
    ground, r, high = mbd.Model("m").ground, 0.5, 0.2
    P, S = np.array((-2.0, high, 0.0)), np.array((2.5, high, 0.0))
    for sense in 1.0, -1.0:
        sided = mbd.WrappingEllipsoid(ground.origin, (r, r, r), side=(0.0, sense, 0.0))
        flat = [math.hypot(x, high) for x in (2.0, 2.5)]
        turn = sum(math.atan2(x, sense * high) - math.acos(r / away) for x, away in zip((2.0, 2.5), flat, strict=True))
        expected = sum(math.sqrt(away**2 - r * r) for away in flat) + r * turn
        assert length(P, S, sided) == pytest.approx(expected, rel=1e-12)
        beside = [point + np.array((0.0, 0.4, 0.0)) for point in (P, S)]
        assert length(*beside, sided) == pytest.approx(math.dist(*beside), rel=1e-15)


def test_a_path_beyond_the_ends_of_a_cylinder_is_straight():
    ground = mbd.Model("m").ground
    short, endless = (mbd.WrappingCylinder(ground.origin, 0.3, length=size) for size in (1.0, None))
    for z, inside in (0.0, True), (0.45, True), (0.55, False), (-0.6, False):
        P, S = (-1.0, 0.1, z), (0.8, 0.0, z)
        straight = math.dist(P, S)
        assert length(P, S, endless) > straight + 1e-3
        assert length(P, S, short) == pytest.approx(length(P, S, endless) if inside else straight, rel=1e-15)


@pytest.mark.parametrize("kind", ["sphere", "cylinder", "ellipsoid"])
def test_length_and_slope_are_continuous_where_the_path_lifts_off(kind):
    ground, r = mbd.Model("m").ground, 0.3
    surface = {
        "sphere": mbd.WrappingSphere(ground.origin, r),
        "cylinder": mbd.WrappingCylinder(ground.origin, r),
        "ellipsoid": mbd.WrappingEllipsoid(ground.origin, (0.25, r, 0.4)),
    }[kind]

    def at(height):
        return length((-1.0, height, 0.2), (0.8, 0.25, -0.1), surface)

    from scipy.optimize import brentq

    def bent(height):
        return at(height) - math.dist((-1.0, height, 0.2), (0.8, 0.25, -0.1)) - 1e-13

    off = brentq(bent, 0.0, 0.5, xtol=1e-14)
    assert 0.1 < off < 0.49
    h = 1e-4
    before, after = (at(off) - at(off - h)) / h, (at(off + h) - at(off)) / h
    assert after == pytest.approx(before, abs=20 * h)
    assert at(off + 1e-9) == pytest.approx(at(off - 1e-9), abs=1e-8)


def test_a_point_within_a_surface_counts_as_on_it():
    """No decision hangs on whether round-off puts a point inside."""
    ground, r = mbd.Model("m").ground, 0.3
    for surface in mbd.WrappingSphere(ground.origin, r), mbd.WrappingCylinder(ground.origin, r):
        on = length((0.0, r, 0.0), (0.9, -0.8, 0.1), surface)
        for inside in 1e-16, 1e-9, 1e-3:
            assert length((0.0, r * (1.0 - inside), 0.0), (0.9, -0.8, 0.1), surface) == pytest.approx(on, rel=1e-12)
        assert length((0.0, r * (1.0 + 1e-9), 0.0), (0.9, -0.8, 0.1), surface) == pytest.approx(on, rel=1e-12)


def elbow(surface, start=(-0.02, 0.28, 0.01), end=(-0.025, -0.015, -0.005), **how):
    """A forearm that two joints carry, and an extensor over what is at the elbow."""
    model = mbd.Model("arm")
    base = mbd.RigidBody("base", 0.2, (1e-3,) * 3 + (0.0,) * 3)
    arm = mbd.RigidBody("forearm", 1.5, (0.016, 0.002, 0.016, 0.0, 0.0, 0.0), center=(0.0, -0.16, 0.0))
    turn = mbd.Revolute("turn", model.ground.origin, base.origin, axis=(0.3, 1.0, 0.1))
    model.connect(turn, mbd.Revolute("elbow", base.origin, arm.origin, axis=(0.0, 0.0, 1.0)))
    given = {"max_force": 700.0, "fiber_length": 0.13, "tendon_length": 0.16, "pennation": 0.1} | how
    path = (model.ground.point(*start), *surface(model, base), arm.point(*end))
    model.apply(mbd.Muscle("triceps", path, **given))
    return model


SURFACES = {
    "sphere": lambda model, base: (mbd.WrappingSphere(base.origin, 0.025),),
    "cylinder": lambda model, base: (mbd.WrappingCylinder(base.origin.turned(0.2, (1.0, 0.0, 0.0)), 0.025),),
    "side": lambda model, base: (mbd.WrappingCylinder(base.origin, 0.025, side=(-1.0, 0.0, 0.0)),),
    "ends": lambda model, base: (mbd.WrappingCylinder(base.origin, 0.025, side=(-1.0, 0.0, 0.0), length=0.2),),
    "ellipsoid": lambda model, base: (
        mbd.WrappingEllipsoid(base.origin.turned(0.4, (1.0, 2.0, 0.0)), (0.024, 0.028, 0.035)),
    ),
    "ellipsoid with a side": lambda model, base: (
        mbd.WrappingEllipsoid(base.origin, (0.024, 0.026, 0.03), side=(-1.0, 0.0, 0.0)),
    ),
    "ellipsoid and sphere": lambda model, base: (
        mbd.WrappingEllipsoid(model.ground.point(-0.012, 0.1, 0.0), (0.02, 0.025, 0.03)),
        mbd.WrappingSphere(base.origin, 0.025),
    ),
    "two": lambda model, base: (
        mbd.WrappingCylinder(model.ground.point(-0.012, 0.1, 0.0), 0.02),
        mbd.WrappingSphere(base.origin, 0.025),
    ),
}


@pytest.mark.parametrize("surface", SURFACES)
def test_the_moment_arm_is_minus_the_slope_of_the_length(surface):
    now = {"activation_time": 0.0, "deactivation_time": 0.0, "tendon": "rigid"}
    model, h, bent = elbow(SURFACES[surface], **now), 1e-3, 0
    marks = [
        mbd.Marker(f"end {k}", model.forces[0].path.points[k].body, model.forces[0].path.points[k].offset).full_name
        for k in (0, -1)
    ]
    steps, weights = h * np.array([-3, -2, -1, 1, 2, 3]), np.array([-1, 9, -45, 45, -9, 1]) / (60.0 * h)
    poses = [(0.3, 1.1), (-0.2, 0.7), (0.5, 1.6), (0.1, -0.9)]
    motion = {
        "time": np.arange(4.0),
        **{f"{name}.angle": [pose[k] for pose in poses] for k, name in enumerate(("turn", "elbow"))},
    }
    held = mbd.muscle_forces(model, motion)
    for frame, pose in enumerate(poses):
        for k, name in enumerate(("turn", "elbow")):
            around = []
            for step in steps:
                moved = [q + step * (j == k) for j, q in enumerate(pose)]
                state = mbd.assemble(model, {"turn.angle": moved[0], "elbow.angle": moved[1]})
                around.append(state["triceps.length"])
            arm = held[f"triceps.moment_arm.{name}.angle"][frame]
            assert arm == pytest.approx(-float(weights @ around), abs=3e-12)
        ends = [np.array(mbd.assemble(model, {"turn.angle": pose[0], "elbow.angle": pose[1]})[p]) for p in marks]
        bent += held["triceps.length"][frame] > np.linalg.norm(ends[1] - ends[0]) + 1e-6
    assert bent >= 3
    if surface == "side":  # the radius, but for what the turned base takes: never the short way in front
        assert np.all(held["triceps.moment_arm.elbow.angle"] < -0.024)


@pytest.mark.parametrize(
    ("scheme", "order", "dts"),
    [(mbd.RungeKutta4(), 4, (1e-3, 2.5e-4)), (mbd.HHT(alpha=0.05), 2, (2e-3, 5e-4))],
    ids=["RungeKutta4", "HHT"],
)
def test_schemes_keep_their_order_while_the_path_lies_on_the_surface(scheme, order, dts):
    model = elbow(SURFACES["cylinder"], excitation=lambda t: 0.3 + 0.2 * mbd.sin(9.0 * t))
    (muscle,) = model.forces
    values = {"turn.angle": 0.2, "elbow.angle": 1.3}
    stretched = mbd.assemble(model, values)["triceps.length"]
    values |= {"triceps.activation": 0.3, "triceps.fiber_length": muscle.fiber_at(stretched, 0.3)}
    start = mbd.assemble(model, values)
    exact = mbd.simulate(model, start, mbd.RungeKutta853(), tol=1e-12, until=0.1)
    names = ("turn.angle", "elbow.angle", "turn.angle.rate", "elbow.angle.rate", "triceps.fiber_length")
    end = np.array([exact[name][-1] for name in names])
    runs = [mbd.simulate(model, start, scheme, dt=dt, until=0.1) for dt in dts]
    errors = [np.linalg.norm([run[name][-1] for name in names] - end) for run in runs]
    assert math.log2(errors[0] / errors[1]) / 2 == pytest.approx(order, abs=0.2)
    change = np.diff((exact["kinetic_energy"] + exact["gravity.energy"])[[0, -1]])[0]
    assert exact.energy["triceps"][-1] == pytest.approx(change, rel=1e-6)


def test_a_radius_is_a_parameter_and_must_be_positive():
    model = elbow(SURFACES["sphere"], tendon="rigid", tendon_length=0.2)
    wide = mbd.assemble(model, {"elbow.angle": 1.3}, parameters={"triceps point 2.radius": 0.03})
    assert wide["triceps.length"] > mbd.assemble(model, {"elbow.angle": 1.3})["triceps.length"] + 1e-3
    with pytest.raises(mbd.ModelError, match=r"triceps point 2\.radius|radius"):
        mbd.assemble(model, {"elbow.angle": 1.3}, parameters={"triceps point 2.radius": -0.03})


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda g: mbd.WrappingSphere(g.origin, 0.0), "radius of a WrappingSphere must be positive"),
        (lambda g: mbd.WrappingCylinder(g.origin, 0.1, side=(0.0, 0.0, 1.0)), "a direction across its z axis"),
        (lambda g: mbd.WrappingCylinder(g.origin, 0.1, length=-0.1), "length of a WrappingCylinder must be positive"),
        (
            lambda g: mbd.WrappingEllipsoid(g.origin, (0.1, 0.0, 0.1)),
            "the radius along y of a WrappingEllipsoid",
        ),
        (lambda g: mbd.WrappingEllipsoid(g.origin, 0.1), "radii of a WrappingEllipsoid"),
        (lambda g: mbd.WrappingEllipsoid(g.origin, (0.1,) * 3, (0, 0, 0)), "is a direction, such as"),
        (lambda g: mbd.WrappingSphere("knee", 0.1), "frame of a WrappingSphere"),
        (lambda g: mbd.Muscle("m", (g.origin, mbd.WrappingSphere(g.origin, 0.1)), 1.0, 0.1, 0.1), "between points"),
    ],
)
def test_wrong_surfaces_are_refused(make, sentence):
    with pytest.raises(mbd.ModelError, match=sentence):
        make(mbd.Model("m").ground)


@pytest.mark.parametrize(("side", "doubted"), [(None, True), ((0.0, 1.0, 0.0), False)])
def test_two_cylinders_without_a_side_are_doubted(side, doubted):
    model = mbd.Model("arm")
    rod = mbd.Link("rod", mass=1.0, length=0.5, center=0.2, inertia=0.02)
    model.connect(mbd.Revolute("elbow", model.ground.origin, rod.start))
    ground = model.ground
    over = [mbd.WrappingCylinder(ground.point(x, 0.3), 0.03, side) for x in (0.0, 0.2)]
    model.apply(mbd.Muscle("strap", (ground.point(-0.2, 0.3), *over, rod.end), 10.0, 0.2, 0.3, tendon="rigid"))
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        mbd.assemble(model, {"elbow.angle": 0.4})
    assert any("two cylinders that follow each other" in str(each.message) for each in told) is doubted
