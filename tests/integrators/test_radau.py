"""Radau IIA: order five of everything, stability at any stiffness, an error estimate of order three."""

import functools

import numpy as np
import pytest

import mbd
from mbd.analysis.amplification import oscillated
from mbd.analysis.numerical import spectrum
from mbd.hardcases.mass_ratios import heavy_below_light
from mbd.state import Mode
from mbd.testing.problems import problem
from tests.integrators.test_order import SCENES, T, observed, started
from tests.simulation.mechanisms import ball, falling, run

STEPS = (8, 16, 32, 64)
"""Steps in half a second; twice as many would meet round-off."""


@functools.cache
def fine(scene):
    """A run of 512 steps, whose error is a thousandth of that of the finest judged."""
    return mbd.simulate(*started(scene), mbd.RadauIIA(), dt=T / 512, until=T).record


def errors(scene, steps=STEPS):
    """Largest error over all rows after the start, of q, v, a, λ, one line a number of steps."""
    table: dict[str, list[float]] = {}
    for count in steps:
        record = mbd.simulate(*started(scene), mbd.RadauIIA(), dt=T / count, until=T).record
        for part in ("q", "v", "a", "lam"):
            difference = np.abs(getattr(record, part) - getattr(fine(scene), part)[:: 512 // count])
            if difference.size:
                table.setdefault(part, []).append(difference[1:].max())
    return {part: np.array(values) for part, values in table.items()}


@pytest.mark.parametrize("scene", SCENES)
def test_everything_is_of_order_five_with_and_without_rows(scene):
    for part, values in errors(scene).items():
        orders = observed(values)
        assert orders[-1] == pytest.approx(mbd.RadauIIA().order(), abs=0.15), (part, orders)


def test_a_mass_of_a_gram_above_one_of_a_ton_keeps_the_order():
    """The light one snaps through at 23 ms: small residuals of the forces are no small errors of its acceleration."""
    model, start = heavy_below_light()
    drifts = []
    for dt in (1e-6, 5e-7):
        total = mbd.simulate(model, start, mbd.RadauIIA(), dt=dt, until=0.03, store=400).energy.total
        drifts.append(np.max(np.abs(total - total[0])))
    assert drifts[1] < 1e-6 and drifts[0] > 2**4 * drifts[1]


def test_rows_give_the_motion_of_the_tree():
    """Two formulations of one mechanism agree far below what a scheme of second order reaches."""
    rows = mbd.simulate(*started("double pendulum in absolute coordinates"), mbd.RadauIIA(), dt=T / 128, until=T)
    exact = fine("double pendulum")
    assert rows["upper floating.angle"][-1] == pytest.approx(exact.q[-1, 0], abs=1e-9)
    assert rows["lower floating.angle"][-1] == pytest.approx(exact.q[-1].sum(), abs=1e-9)
    assert rows.violation.length < 1e-13 and rows.violation.rate < 1e-12


# stability ----------------------------------------------------------------------------------------------------------
def test_nothing_of_an_infinitely_fast_oscillation_is_kept():
    for turn in (10.0, 1e3, 1e5):  # R(z) = O(1/z)
        assert spectrum(mbd.RadauIIA(), turn).radius * turn == pytest.approx(3.0, rel=0.1)
    assert all(spectrum(mbd.RadauIIA(), turn).radius < 1.0 for turn in (0.1, 0.5, 1.0, 2.0, 5.0))
    assert spectrum(mbd.RadauIIA(), 0.1).damping == pytest.approx(0.1**5 / 7200.0, rel=1e-2)


def test_a_stiff_damped_spring_is_stable_at_steps_far_above_its_period():
    """A mass of 1 kg on 1e7 N/m, whose period is 2 ms, swings like one on a rod at steps of 20 ms."""
    stiffness, damping, g = 1e7, 300.0, 9.81
    elastic = mbd.Lagrangian(
        "elastic pendulum", ["r", "phi"],
        kinetic=lambda r, r_rate, phi_rate: 0.5 * (r_rate**2 + (r * phi_rate) ** 2),
        potential=lambda r, phi: 0.5 * stiffness * (r - 1.0) ** 2 - g * r * mbd.cos(phi),
        dissipation=lambda r_rate: 0.5 * damping * r_rate**2,
    )  # fmt: skip
    rigid = mbd.Lagrangian(
        "pendulum", ["phi"], kinetic=lambda phi_rate: 0.5 * phi_rate**2, potential=lambda phi: -g * mbd.cos(phi)
    )
    hung = mbd.assemble(elastic, {"r": 1.0, "phi": 1.0})
    ran = mbd.simulate(elastic, hung, mbd.RadauIIA(), dt=0.02, until=4.0)
    held = mbd.simulate(rigid, mbd.assemble(rigid, {"phi": 1.0}), mbd.RadauIIA(), dt=0.02, until=4.0)
    assert np.max(np.abs(ran["r"] - 1.0)) < 1e-5
    np.testing.assert_allclose(ran["phi"], held["phi"], rtol=0, atol=1e-4)
    assert ran.stats["shortened"] == 0


# error estimate -----------------------------------------------------------------------------------------------------
def estimates(name, sizes, steps=3):
    """The embedded error of a step that follows some others, for each dt."""
    posed, found = problem(name), []
    for dt in sizes:
        scheme, state = mbd.RadauIIA(), posed.start
        memory = scheme.start(posed.system, state, Mode(), dt)
        result = scheme.advance(posed.system, state, dt, steps * dt, Mode(), memory)
        found.append(float(np.max(np.abs(result.memory.error))))
    return np.array(found)


@pytest.mark.parametrize("name", ["varying mass", "driven pendulum", "first-order state", "row"])
def test_the_error_estimate_is_of_order_three(name):
    falls = np.log2(estimates(name, (0.1, 0.05, 0.025, 0.0125)))
    assert -np.diff(falls)[-1] == pytest.approx(4.0, abs=0.4), "of a single step, h⁴"


def test_the_error_estimate_does_not_see_what_is_infinitely_fast():
    """Unfiltered it would grow with the stiffness."""
    sizes = []
    for turn in (1e2, 1e4):
        _, memory = oscillated(mbd.RadauIIA(), turn, 0.7, np.array([1.0, 0.0]), 1)[-1]
        sizes.append(np.max(np.abs(memory.error / [1.0, turn])))
    assert max(sizes) < 2.0


# switching ----------------------------------------------------------------------------------------------------------
def test_bounces_are_found_where_a_parabola_meets_the_floor():
    bounced = run(ball(restitution=0.5), {"fall.displacement": 1.0}, integrator=mbd.RadauIIA(), dt=0.03, until=1.0)
    first = np.sqrt(2.0 / 9.81)
    times = [event.time for event in bounced.events if event.kind == "closed"]
    np.testing.assert_allclose(times[:2], [first, 2.0 * first], rtol=0, atol=1e-12)


@pytest.mark.parametrize("backend", ["auto", "python"])
def test_a_motion_that_is_predicted_exactly_needs_no_iteration(backend):
    """Of a free fall the first residual is round-off; its error estimate still needs the factors of the step."""
    fallen = run(
        falling()[0], {"fall.displacement": 0.0}, integrator=mbd.RadauIIA(), dt=0.1, until=2.0, backend=backend
    )
    np.testing.assert_allclose(fallen["fall.displacement"], -0.5 * 9.81 * fallen.time**2, rtol=0, atol=1e-12)
    assert fallen.stats["shortened"] == 0 and fallen.stats["iterations"] == fallen.stats["steps"] == 20


@pytest.mark.parametrize("backend", ["auto", "python"])
def test_a_force_that_is_no_number_ends_the_run_with_its_name(backend):
    model, body = falling()
    model.apply(mbd.Applied("gust", body.origin, force=lambda t: (0.0, mbd.sqrt(0.5 - t)), arguments=("t",)))
    with pytest.raises(mbd.SimulationError, match=r"gust|not finite") as caught:
        mbd.simulate(model, mbd.assemble(model), mbd.RadauIIA(), dt=0.03, until=1.0, backend=backend)
    assert caught.value.run.time[-1] <= 0.5


def test_a_motion_too_fast_to_be_resolved_is_refused():
    model, _ = started("double pendulum")
    wild = mbd.assemble(model, {"u.angle": 1.0}, {"u.angle": 300.0, "w.angle": -700.0})
    with pytest.raises(mbd.SimulationError, match="Newton stalled|half a radian"):
        mbd.simulate(model, wild, mbd.RadauIIA(), dt=0.1, until=1.0)


def test_a_tolerance_out_of_range_is_refused():
    with pytest.raises(mbd.CapabilityError, match="between 0 and 1e-3, not 0"):
        mbd.RadauIIA(tolerance=0)
    assert repr(mbd.RadauIIA()) == "RadauIIA()" and repr(mbd.RadauIIA(1e-8)) == "RadauIIA(tolerance=1e-08)"
