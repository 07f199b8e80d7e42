"""Starts and ends with derivatives on one side only are refused with both values; elsewhere both sides agree."""

import math

import numpy as np
import pytest

import mbd

RATE, PLACE = "x.displacement.rate", "x.displacement"


def block(k: float, friction: float, wall: bool = False, e: float = 0.0) -> mbd.Model:
    """A block of 1 kg on a spring with dry friction, before a wall at x = 0."""
    model = mbd.Model("block")
    body = mbd.PointMass("m", 1.0)
    loss = mbd.Coulomb(friction) if friction else None
    model.connect(mbd.Prismatic("x", model.ground.origin, body.origin, axis="x", stiffness=k, loss=loss))
    if wall:
        model.constrain(mbd.Unilateral("wall", mbd.measure(lambda x: x, PLACE, unit="m"), restitution=e))
    return model


def start(model: mbd.Model, x: float, v: float) -> mbd.State:
    return mbd.assemble(model, position={PLACE: x}, velocity={PLACE: v})


def sides_of(model, x, v, by, of, until, scheme=None):
    with pytest.raises(mbd.errors.OneSidedError, match="on one side only") as caught:
        mbd.sensitivities(
            model, start(model, x, v), scheme or mbd.RungeKutta853(), 0.01, until=until, wrt=[by], of=[of]
        )
    return caught.value.sides[of, by]


def test_what_slides_from_rest_has_derivatives_by_its_velocity_on_one_side_only():
    """Against the way that it slides it stops first: (k x − F)/(k x + F); by its place it has a derivative."""
    random = np.random.default_rng(9)
    for scheme in (mbd.RungeKutta853(), mbd.HHT()):
        k, x, friction = random.uniform(20.0, 40.0), random.uniform(0.4, 0.6), random.uniform(1.0, 3.0)
        model = block(k, friction)
        below, above = sides_of(model, x, 0.0, RATE, RATE, 0.2, scheme)
        assert math.isclose(above / below, (k * x - friction) / (k * x + friction), rel_tol=2e-3)
        found = mbd.sensitivities(model, start(model, x, 0.0), scheme, 0.01, until=0.2, wrt=[PLACE], of=[RATE])
        assert math.isclose(found[RATE, PLACE], -math.sqrt(k) * math.sin(math.sqrt(k) * 0.2), rel_tol=2e-3)


def test_a_run_that_ends_as_a_body_strikes_has_two_derivatives_and_one_that_ends_beside_it_has_one():
    """v = −√k x₀ sin √k t before the wall, from which it comes back with −e v."""
    random = np.random.default_rng(10)
    k, e = random.uniform(20.0, 40.0), random.uniform(0.2, 0.9)
    model, strike = block(k, 0.0, wall=True, e=e), 0.5 * math.pi / math.sqrt(k)
    root = math.sqrt(k)
    for until in (strike, strike * (1.0 - 1e-12), strike * (1.0 + 1e-12)):
        with pytest.raises(mbd.errors.OneSidedError, match="'wall' happens as the run ends") as caught:
            mbd.sensitivities(model, start(model, 0.5, 0.1), mbd.RungeKutta853(), 0.01,
                              until=until + math.atan(0.1 / root / 0.5) / root, wrt=[RATE], of=[RATE])  # fmt: skip
        assert len(caught.value.sides) == 1
    latest = strike + math.atan(0.1 / root / 0.5) / root
    assert len(sides_of(model, 0.5, 0.1, RATE, RATE, ("wall", latest))) == 2
    for until in (0.9 * strike, 1.1 * strike):
        found = mbd.sensitivities(model, start(model, 0.5, 0.1), mbd.RungeKutta853(), 0.01, until=until, wrt=[RATE],
                                  of=[RATE])  # fmt: skip
        assert np.isfinite(found[RATE, RATE])


@pytest.mark.parametrize("scheme", [mbd.RungeKutta853(), mbd.RungeKutta4(), mbd.HHT(), mbd.GeneralizedAlpha(0.8)])
def test_a_slide_that_ends_as_a_step_does_has_the_derivative_of_one_that_ends_beside_it(scheme):
    """A cart slides to a stop in t = m v/F, and a free block on it keeps its velocity: du/dv = T − t."""
    model = mbd.Model("cart", gravity=(0.0, 0.0, 0.0))
    cart, block = mbd.PointMass("cart", 1.3), mbd.PointMass("block", 0.5)
    loss = mbd.Coulomb(2.5)
    model.connect(mbd.Prismatic("x", model.ground.origin, cart.origin, loss=loss))
    model.connect(mbd.Prismatic("u", cart.origin, block.origin))
    for steps, dt in (20, 0.013), (26, 0.01), (25.5, 0.01):
        time = steps * dt
        begin = mbd.assemble(model, velocity={PLACE: time * 2.5 / 1.3, "u.displacement": 0.7})
        of = [PLACE, "u.displacement"]
        found = mbd.sensitivities(model, begin, scheme, dt, until=0.5, wrt=[RATE], of=of)
        np.testing.assert_allclose([found[name, RATE] for name in of], [time, 0.5 - time], atol=1e-9)


def test_a_start_on_an_event_that_changes_something_is_refused_and_one_that_leaves_it_is_not():
    model = block(30.0, 0.0)
    model.constrain(mbd.Event("turn", mbd.measure(lambda v: v, RATE, unit="m"), direction=-1, reset={RATE: -1.0}))
    below, above = sides_of(model, 0.5, 0.0, RATE, RATE, 0.1)
    assert np.isfinite(below) and np.isfinite(above)
    found = mbd.sensitivities(
        model, start(model, -0.5, 0.0), mbd.RungeKutta853(), 0.01, until=0.1, wrt=[RATE], of=[RATE]
    )
    assert math.isclose(found[RATE, RATE], math.cos(math.sqrt(30.0) * 0.1), rel_tol=1e-9)


def test_a_contact_that_closes_as_the_run_starts_is_named_and_has_derivatives_once_it_is_closed():
    model, body = mbd.Model("block"), mbd.PointMass("block", 2.0)
    model.connect(mbd.Translation("slide", model.ground.origin, body.origin))
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(body.origin), friction=0.3))
    asked = {"dt": 0.01, "until": 0.1, "wrt": ["gravity.y"], "of": ["slide.x"]}
    with pytest.raises(mbd.errors.OneSidedError, match="'foot' happens as the run starts.*closed='foot'"):
        mbd.sensitivities(model, mbd.assemble(model, {"slide.y": 0.0}, {"slide.x": 1.0}), **asked)
    start = mbd.assemble(model, {"slide.y": 0.0}, {"slide.x": 1.0}, closed="foot")
    found = mbd.sensitivities(model, start, **asked)["slide.x", "gravity.y"]
    assert found == pytest.approx(0.5 * 0.3 * 0.1**2, rel=1e-12)


def test_a_derivative_is_that_of_both_sides_or_it_is_refused():
    """Random blocks, from rest or not, to an instant of an event or another one."""
    random, judged, refused = np.random.default_rng(11), 0, 0
    for _ in range(12):
        k, friction, e = (
            random.uniform(10.0, 50.0),
            random.choice([0.0, random.uniform(0.5, 3.0)]),
            random.uniform(0, 1),
        )
        model = block(float(k), float(friction), wall=bool(random.integers(2)), e=float(e))
        x, v = random.uniform(0.2, 0.6), random.choice([0.0, random.uniform(-1.0, 1.0)])
        until, by = random.uniform(0.1, 1.0), str(random.choice([RATE, PLACE]))
        run = mbd.simulate(model, start(model, x, v), mbd.RungeKutta853(), dt=0.01, until=until)
        if run.events and random.integers(2):
            until = run.events[-1].time

        def rate(change, model=model, x=x, v=v, by=by, until=until):
            moved = start(model, x + change * (by == PLACE), v + change * (by == RATE))
            return float(mbd.simulate(model, moved, mbd.RungeKutta853(), dt=0.01, until=until).final[RATE])

        h = 1e-6
        below, above = (rate(0.0) - rate(-h)) / h, (rate(h) - rate(0.0)) / h
        agree = abs(above - below) < 1e-3 * max(1.0, abs(above), abs(below))
        try:
            found = mbd.sensitivities(
                model, start(model, x, v), mbd.RungeKutta853(), 0.01, until=until, wrt=[by], of=[RATE]
            )
        except mbd.CapabilityError:
            assert not agree or below == above == 0.0  # at rest whatever happened before
            refused += 1
            continue
        judged += 1
        assert agree and abs(found[RATE, by] - 0.5 * (above + below)) < 1e-4 * max(1.0, abs(above))
    assert judged > 2 and refused > 2


GRIPS = ("joint", "plane", "space", "after a slide")


def gripping(case, random):
    """What sticks by all the friction that it can have: model, start, by what it is differentiated, and of what."""
    mass, mu, load = random.uniform(0.5, 3.0), random.uniform(0.2, 0.9), random.uniform(1.0, 12.0)
    angle = 0.0 if case != "space" else random.uniform(0.1, 1.4)
    along, down = mu * load * np.array([math.cos(angle), math.sin(angle)]), -load
    gravity = (along[0], 0.0, 0.0) if case == "joint" else (along[0], down, along[1])
    model, body = mbd.Model("grip", gravity=gravity), mbd.PointMass("m", mass)
    if case == "joint":
        model.connect(mbd.Prismatic("x", model.ground.origin, body.origin, loss=mbd.Coulomb(mass * along[0])))
        return model, start(model, 0.0, 0.0), ["gravity.x", "m.mass"], PLACE
    model.connect(mbd.Translation("p", model.ground.origin, body.origin, axes="xyz" if case == "space" else "xy"))
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(body.origin), friction=mu))
    speed = {"p.x": -random.uniform(0.1, 0.3)} if case == "after a slide" else {}
    begin = mbd.assemble(model, {"p.x": 0.0, "p.y": 0.0}, speed, closed="foot")
    return model, begin, ["gravity.x", "gravity.y", "foot.mu"], "p.x"


@pytest.mark.parametrize("scheme", [mbd.RungeKutta853(), mbd.HHT(), mbd.RadauIIA()], ids=lambda s: type(s).__name__)
@pytest.mark.parametrize("case", GRIPS)
def test_what_sticks_by_all_its_friction_has_derivatives_on_one_side_only(case, scheme):
    """Pulled harder or pressed less it slides; both values are those of runs on each side."""
    random = np.random.default_rng(GRIPS.index(case))
    model, begin, by, of = gripping(case, random)
    with pytest.raises(mbd.errors.OneSidedError, match="sticks at t = .* all the friction that it can have") as caught:
        mbd.sensitivities(model, begin, scheme, 0.01, until=0.4, wrt=by, of=[of])
    known = mbd.simulate(model, begin, scheme, dt=0.01, until=0.4)
    values = dict(zip(known.record.parameter_names, known.record.parameters, strict=True))
    for name in by:
        h = 1e-5 * abs(values[name])

        def moved(change, name=name):
            changed = {name: values[name] + change}
            return float(mbd.simulate(model, begin, scheme, dt=0.01, until=0.4, parameters=changed).final[of])

        below, above = (moved(0.0) - moved(-h)) / h, (moved(h) - moved(0.0)) / h
        assert abs(below - above) > 1e-3
        np.testing.assert_allclose(caught.value.sides[of, name], (below, above), rtol=2e-3, atol=1e-6)
    found = mbd.sensitivities(model, begin, scheme, 0.01, until=0.4, wrt=[of], of=[of])
    assert found[of, of] == pytest.approx(1.0), "what leaves both forces as they are has a derivative"
