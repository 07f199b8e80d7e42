"""The scenes that other systems are compared on: their references, and that `mbd` moves as these say."""

import math

import numpy as np
import pytest

import mbd

pytest.importorskip("benchmarks")

from benchmarks.peers import report, schemes
from benchmarks.peers.command import Comparison
from benchmarks.peers.equations import LOOPS, problem
from benchmarks.peers.models import posed
from benchmarks.peers.race import Attempt, Outcome, Result, measured
from benchmarks.peers.references import bounces, smooth
from benchmarks.peers.scenes import BALL, CHAINS, SCENES, G, chosen
from benchmarks.peers.space import centers, tree, tree_motion
from tests.problems import case

PUBLISHED = np.array([
    15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948, 0.5244099658805304,
    0.5347301163226948, 1.048080741042263,
])  # fmt: skip
"""Andrews' mechanism at 0.03 s (Mazzia & Magherini 2008, test set for IVP solvers, II-7) [rad]."""

TRAPEZOID, DAMPED, UNDAMPED = mbd.GeneralizedAlpha(1.0), mbd.GeneralizedAlpha(0.9), mbd.HHT(0.0)
REACHED = {
    "S1": (TRAPEZOID, 1e-3, 3e-4), "S1d": (TRAPEZOID, 1e-3, 4e-5), "S2_2": (TRAPEZOID, 1e-3, 1e-5),
    "S2_8": (TRAPEZOID, 1e-3, 4e-4), "S3a_1": (DAMPED, 1e-2, 1e-3), "S3b": (DAMPED, 1e-5, 1e-4),
    "S4a": (UNDAMPED, 1e-2, 1e-12), "S4b": (UNDAMPED, 1e-3, 2e-6), "S4b_point": (UNDAMPED, 1e-3, 6e-6),
    "S4c": (UNDAMPED, 1e-3, 2e-5), "S4d": (UNDAMPED, 1e-3, 4e-4), "S5": (TRAPEZOID, 1e-3, 2e-5),
    "S5b": (UNDAMPED, 1e-5, 2e-4), "S7_top": (mbd.RungeKutta853(), 0.005, 1e-7),
    "S7_double": (mbd.RungeKutta853(), 0.025, 1e-9), "S7_coin": (mbd.RungeKutta853(), 0.05, 5e-8),
    "S7_human": (TRAPEZOID, 0.0125, 3e-4), "S7_chain": (mbd.RungeKutta853(), 0.005, 5e-7),
}  # fmt: skip
"""Integrator, dt [s], error that it stays below."""
REACHED_SLOWLY = {"S2_32": (TRAPEZOID, 1e-3, 1e-2), "S3a_10": (DAMPED, 1e-2, 1e-3), "S3a_40": (DAMPED, 1e-2, 1e-3)}


def error_of(name, integrator, dt):
    scene = SCENES[name]
    case = posed(scene)
    run = mbd.simulate(case.model, case.start, integrator, dt=dt, until=scene.until)
    return scene.error(case.read(run, scene.times))


@pytest.mark.parametrize("name", REACHED)
def test_a_scene_moves_as_its_reference(name):
    integrator, dt, bound = REACHED[name]
    assert error_of(name, integrator, dt) < bound


@pytest.mark.slow
@pytest.mark.parametrize("name", REACHED_SLOWLY)
def test_a_large_scene_moves_as_its_reference(name):
    integrator, dt, bound = REACHED_SLOWLY[name]
    assert error_of(name, integrator, dt) < bound


def test_every_scene_is_tried():
    assert {*REACHED, *REACHED_SLOWLY} == set(SCENES)
    assert all(schemes.settings(scene) for scene in SCENES.values())


# references ---------------------------------------------------------------------------------------------------------
def test_andrews_mechanism_ends_where_it_is_published():
    assert np.abs(SCENES["S3b"].reference[-1] - PUBLISHED).max() < 2e-9


@pytest.mark.parametrize(("name", "published", "quantity"), [
    ("S7_top", "e2-heavy-top-nutation", "axis"), ("S7_double", "e4-3d-double-pendulum", "[centre1"),
    ("S7_coin", "d4-rolling-disk", "centre of disk"),
])  # fmt: skip
def test_scenes_in_space_pass_where_two_other_integrations_do(name, published, quantity):
    """Cases e2 (Euler angles in Taylor series), e4 (Kane and multipliers) and d4 (O'Reilly 1996), to 1e-11."""
    scene, known = SCENES[name], case(published)[quantity]
    for at, values in [*zip(known.t, known.value, strict=True)][1:]:
        assert np.abs(scene.reference[round(at / scene.every)][: len(values)] - values).max() < 1e-11


def test_trees_by_hinges_move_as_those_with_ball_joints():
    for name in ("S7_top", "S7_human"):
        own = tree(name)
        hinges, q = own.by_hinges, own.q + 1e-3 * np.arange(len(own.q))
        assert np.abs(centers(own, own.q) - centers(hinges, hinges.q)).max() < 1e-15
        assert np.isfinite(centers(own, q)).all()
    own, times = tree("S7_double"), np.array([0.0, 0.05])
    assert np.abs(tree_motion(own, times, 1e-11) - tree_motion(own.by_hinges, times, 1e-11)).max() < 1e-10


def test_stored_references_are_those_of_the_equations():
    for name in ("S1d", "S2_2", "S5b"):
        few = slice(0, 11)
        found = smooth(problem(name), SCENES[name].times[few], 1e-12)
        assert np.abs(found - SCENES[name].reference[few]).max() < 1e-10


def test_the_energy_of_a_chain_is_kept_by_its_equations():
    """Power of gravity and change of kinetic energy cancel at any state."""
    chain, rng, h = CHAINS["S2_8"], np.random.default_rng(3), 1e-6
    posed = problem("S2_8")

    def energy(y):
        n, length, mass = chain.n, chain.length, chain.mass
        along, turn = np.exp(1j * (y[:n] - np.pi / 2)), 1j * y[n:] * np.exp(1j * (y[:n] - np.pi / 2))
        ends, speeds = length * np.cumsum(along), length * np.cumsum(turn)
        centers, rates = ends - 0.5 * length * along, speeds - 0.5 * length * turn
        spin = mass * length**2 / 24.0 * np.sum(y[n:] ** 2)
        return 0.5 * mass * np.sum(np.abs(rates) ** 2) + spin + mass * G * np.sum(centers.imag)

    y, rate = rng.normal(size=16), np.zeros(16)
    posed.f(y, rate, posed.P)
    assert (energy(y + h * rate) - energy(y - h * rate)) / (2.0 * h) == pytest.approx(0.0, abs=1e-7)


def test_the_loops_of_andrews_mechanism_stay_closed():
    """At rest they change by ½ h² (B a), which vanishes: accelerations of 1e4 rad/s² move no gap of some 0.03 m."""
    posed, h = problem("S3b"), 1e-6

    def gaps(angles):
        turn, P = np.exp(1j * angles), posed.P
        common = P[28] * turn[0] + P[29] * turn[1]
        return np.array([common - P[30 + 2 * k] * turn[i] - P[31 + 2 * k] * turn[j] for k, (i, j) in enumerate(LOOPS)])

    a, out = posed.start[:7], np.zeros(14)
    posed.f(posed.start, out, posed.P)
    change = 0.5 * h**2 * out[7:]
    assert np.abs(gaps(a + change) - gaps(a)).max() < 1e-4 * 0.03 * np.abs(change).max()


def test_the_ball_comes_to_rest_after_its_last_bounce():
    end = (1.0 + 2.0 * BALL.restitution / (1.0 - BALL.restitution)) * math.sqrt(2.0 * BALL.height / G)
    times = np.array([0.0, 0.5 * math.sqrt(2.0 * BALL.height / G), end + 1e-3])
    np.testing.assert_allclose(bounces(times)[:, 0], [1.0, 0.75, 0.0], atol=1e-12)


# measuring ----------------------------------------------------------------------------------------------------------
def test_an_error_counts_only_what_is_complete_and_finite():
    scene = SCENES["S1"]
    exact = scene.reference
    assert scene.error(exact) == 0.0
    assert scene.error(exact[:-1]) == math.inf
    assert scene.error(np.where(exact == exact[5, 0], np.nan, exact)) == math.inf


def test_rates_next_to_a_strike_are_not_compared():
    scene = SCENES["S4d"]
    wrong = scene.reference.copy()
    strikes = np.load(report.__file__.replace("report.py", "references.npz"))["S4d_strikes"]
    near = np.abs(scene.times[:, None] - strikes).min(axis=1) < scene.skipped
    wrong[near] += 1.0
    assert scene.error(wrong) == 0.0


def test_a_system_that_fails_is_a_result_and_not_the_end():
    scene = SCENES["S1"]

    def fails():
        raise RuntimeError("went away")

    right = Attempt("right", lambda: Outcome(scene.reference, 1e-3, 10))
    found = list(measured(scene, "own", [[Attempt("wrong", fails), right]]))
    assert found[0].fault == "RuntimeError: went away"
    assert (found[1].error, found[1].seconds, found[1].steps) == (0.0, 1e-3, 10)


def test_the_table_shows_the_fastest_that_reaches_an_error_and_a_dash_where_none_does():
    results = (
        Result("S1", "mbd", "fine", 1e-7, 2.0, 3.0, 100, 1, words=4.0),
        Result("S1", "mbd", "coarse", 1e-4, 1e-3, 2e-3, 10, 1, words=0.06),
        Result("S1", "mujoco", "RK4", 1e-2, 0.5, None, 10, 1, words=0.6),
        Result("S1", "mujoco", "RK4, finer", 1e-4, 1.5e-3, None, 20, 1, words=0.05),
    )  # fmt: skip
    text = report.page(Comparison(results, {"mbd": "1", "mujoco": "2"}, {}, ("drake",), "a machine"))
    assert "| S1 ≤ 0.001 | 2 ms | 1 ms |" in text
    assert "| S1 ≤ 1e-06 | 3 s | 2 s |" in text
    assert "| S1 ≤ 1e-09 | - | - |" in text
    assert "| S1 ≤ 0.001 | 60 ms | 50 ms |" in text
    assert "fastest system in 1 of 1 cells by its loop, in 0 of 1 by its call, and in 0 of 1 from words" in text
    assert "Not installed, and left out: drake." in text


def test_a_model_that_run_keeps_is_made_anew_to_time_words():
    scene = SCENES["S1"]
    made = list[int]()
    busy = lambda: sum(range(300_000)) and None  # noqa: E731
    slow = Attempt("kept", lambda: Outcome(scene.reference, 1e-3, 10), lambda: made.append(1) or busy())
    built = Attempt("built", lambda: busy() or Outcome(scene.reference, 1e-3, 10))
    found = list(measured(scene, "own", [[slow, built]]))
    assert made
    assert all(each.words > each.seconds for each in found)


def test_an_integrator_that_does_not_exist_is_left_out(monkeypatch):
    unknown = schemes.Scheme("NotYetThere", dts=(0.1,), tols=(1e-3,))
    monkeypatch.setitem(schemes.TABLE, "S1", (unknown, schemes.Scheme("HHT", (0.0,), dts=(0.1,))))
    assert [[setting.words for setting in sweep] for sweep in schemes.settings(SCENES["S1"])] == [[{"dt": 0.1}]]


def test_scenes_are_chosen_by_name_or_family():
    assert [scene.name for scene in chosen(["S2", "S4d"])] == ["S2_2", "S2_8", "S2_32", "S4d"]
    with pytest.raises(ValueError, match="no scene 'S9'; there are S1, "):
        chosen(["S9"])
