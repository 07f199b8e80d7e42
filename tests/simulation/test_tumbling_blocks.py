"""Blocks in space that fall onto their corners, bounce, slide to rest there and tip over, with steps of any size."""

import itertools

import numpy as np
import pytest

import mbd

G = 9.81


def block(seed):
    """A block of random edges on eight corners, let go on one of them or a little above; its start, and a dt [s]."""
    rng = np.random.default_rng(seed)
    edges, mass = rng.uniform(0.1, 0.5, 3), rng.uniform(0.5, 5.0)
    friction, restitution = rng.choice([None, 0.3, 0.8]), float(rng.choice([0.0, 0.0, 0.3]))
    model = mbd.Model("block", gravity=(0.0, -G, 0.0))
    body = mbd.RigidBody("block", mass, tuple(mass / 12.0 * (np.sum(edges**2) - edges**2)))
    model.connect(mbd.Free("free", model.ground.origin, body.origin))
    corners = [np.array(sides) * edges / 2.0 for sides in itertools.product((-1, 1), repeat=3)]
    for k, corner in enumerate(corners):
        law = {} if friction is None else {"friction": friction}
        model.constrain(
            mbd.Unilateral(f"corner {k}", mbd.touchdown(body.point(*corner)), restitution=restitution, **law)
        )
    turned = rng.normal(size=4)
    w, x, y, z = turned = turned / np.linalg.norm(turned)
    up = np.array([2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)])
    heights = np.array([up @ corner for corner in corners])
    above, lowest = rng.choice([0.0, 0.05]), int(np.argmin(heights))
    place = {"free.x": 0.0, "free.y": above - heights[lowest], "free.z": 0.0, "free.orientation": tuple(turned)}
    start = mbd.assemble(model, place, closed=[f"corner {lowest}"] if above == 0.0 else [])
    return model, start, float(10.0 ** rng.uniform(-3.0, -2.0))


@pytest.mark.parametrize("seed", [1047, 1052, *(pytest.param(k, marks=pytest.mark.slow) for k in range(1001, 1030))])
def test_a_block_with_friction_tumbles_to_the_end_whatever_the_step(seed):
    """Where sliding comes to rest the direction is held for a whole step: in parts of it nothing came to rest."""
    model, start, dt = block(seed)
    if model.contacts[0].friction is None:  # may have no motion: it pulls, or sinks in
        pytest.skip("of blocks without friction")
    runs = [mbd.simulate(model, start, mbd.RadauIIA(), dt=part * dt, until=0.62) for part in (1.0, 0.9)]
    for run in runs:
        total = run.energy.total
        assert np.max(np.diff(total)) < 1e-3 * total[0]
        assert min(np.min(run[f"corner {k}.gap"]) for k in range(8)) > -1e-6
    first, second = (np.array([run[f"free.{c}"][-1] for c in "xyz"]) for run in runs)
    np.testing.assert_allclose(first, second, rtol=0, atol=1e-3)


@pytest.mark.parametrize("part", [1.0, 0.9, 0.5])
def test_an_explicit_step_just_after_an_event_is_judged_as_it_is_where_friction_turns_fast(part):
    """Steps of 1e-7 s behind an impact, in which friction at slow sliding turns by radians, are no runaway."""
    model, start, dt = block(1052)
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=part * dt, until=0.3)
    assert np.max(np.diff(run.energy.total)) < 1e-3 * run.energy.total[0]


@pytest.mark.parametrize(("seed", "until"), [(1015, 0.8), (1018, 0.9), (1030, 0.5)])
@pytest.mark.parametrize("part", [1.0, 0.9])
def test_a_step_fails_at_no_length_where_a_corner_begins_to_slip_behind_a_sequence_of_impacts(seed, until, part):
    """A whole step comes through, one of a hundredth fails, a far shorter one follows how friction turns."""
    model, start, dt = block(seed)
    run = mbd.simulate(model, start, mbd.HHT(0.05), dt=part * dt, until=until)
    other = mbd.simulate(model, start, mbd.RungeKutta853(), dt=part * dt, until=until)
    assert np.max(np.diff(run.energy.total)) < 1e-3 * run.energy.total[0]
    for c in "xyz":
        assert abs(run[f"free.{c}"][-1] - other[f"free.{c}"][-1]) < 2e-3
