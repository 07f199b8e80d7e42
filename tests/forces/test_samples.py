"""Signals from tables: what curve goes through them, and what motion they may drive."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.interpolate import (
    Akima1DInterpolator,
    BarycentricInterpolator,
    CubicSpline,
    InterpolatedUnivariateSpline,
    PchipInterpolator,
    interp1d,
    make_interp_spline,
    make_smoothing_spline,
)

import mbd

SCHEMES = (mbd.HHT(0.05), mbd.Newmark(), mbd.GeneralizedAlpha(0.8), mbd.RadauIIA(), mbd.RungeKutta853())
X = np.array([0.0, 0.11, 0.2, 0.34, 0.41, 0.6])
Y = np.array([0.0, 0.3, -0.2, 0.1, 0.5, 0.0])


def arm(values, bars=2, seed=1):
    """A chain of bars of which every joint is driven by a value, with the same chain free to move."""
    rng = np.random.default_rng(seed)
    model = mbd.Model("arm")
    end, joints = model.ground.origin, []
    for k in range(bars):
        mass, length = rng.uniform(0.5, 3.0), rng.uniform(0.2, 0.6)
        bar = mbd.Link(f"bar {k}", mass=mass, length=length, center=0.4 * length, inertia=0.1 * mass * length**2)
        joint = mbd.Revolute(f"joint {k}", end, bar.start, loss=mbd.Viscous(rng.uniform(0.0, 0.2)))
        model.connect(joint)
        joints.append(joint)
        end = bar.end
    for joint, value in zip(joints, values, strict=True):
        model.constrain(mbd.Bilateral(f"drive of {joint.name}", joint, value=value))
    return model, joints


def balance(model, q, v, a):
    """The torques of drives that move the model so: M v̇ + f."""
    mechanism = mbd.compile.mechanisms.mechanism_of(model)
    terms = mechanism.acceleration_terms(0.0, q, v, mechanism.parameters(), np.zeros(mechanism.layout.n_anchors))
    return np.asarray(terms.M) @ a + np.asarray(terms.f)


@settings(max_examples=4, deadline=None)
@given(seed=st.integers(0, 10**6), scheme=st.sampled_from(SCHEMES), way=st.sampled_from([0.01, 0.004, "tol"]))
def test_a_table_drives_as_the_spline_through_its_samples(seed, scheme, way):
    """The torques of all drives against M v̇ + f with q, v, v̇ of scipy's own spline, at every row."""
    rng = np.random.default_rng(seed)
    times = np.sort(rng.choice(np.linspace(0.0, 1.0, 41), 12, replace=False))
    times[0], times[-1] = 0.0, 1.0
    tables = rng.uniform(-0.8, 0.8, (2, 12))
    model, _ = arm([mbd.Samples(times, row) for row in tables], seed=seed)
    how = {"tol": 1e-6} if way == "tol" else {"dt": way}
    run = mbd.simulate(model, mbd.assemble(model), scheme, until=1.0, **how)
    curves = [CubicSpline(times, row) for row in tables]
    free = model.without("drive of joint 0", "drive of joint 1")
    angles, rates, rest = (np.array([c(run.time, k) for c in curves]).T for k in range(3))
    wanted = np.array([balance(free, *state) for state in zip(angles, rates, rest, strict=True)])
    found = np.array([run[f"drive of joint {k}.torque"] for k in range(2)]).T
    np.testing.assert_allclose(found, wanted, atol=1e-6 * np.abs(wanted).max())


CURVES = {
    "spline": lambda t, y: CubicSpline(t, y),
    "monotone": lambda t, y: PchipInterpolator(t, y),
    "linear": lambda t, y: make_interp_spline(t, y, k=1),
    "hold": lambda t, y: interp1d(t, y, kind="previous", fill_value="extrapolate"),
}


@pytest.mark.parametrize("kind", CURVES)
def test_each_kind_is_the_curve_of_its_name(kind):
    at = np.linspace(0.0, 0.6, 301)
    signal = mbd.Samples(X, Y, kind=kind)
    np.testing.assert_allclose(signal(at), CURVES[kind](X, Y)(at), atol=1e-12)
    assert signal(-3.0) == Y[0] and signal(9.0) == Y[-1]


def test_ends_of_splines_are_scipys():
    at = np.linspace(0.0, 0.6, 301)
    for ends in ("natural", "clamped"):
        for k in range(3):
            signal = mbd.Samples(X, Y, ends=ends)
            np.testing.assert_allclose(signal(at, k), CubicSpline(X, Y, bc_type=ends)(at, k), atol=1e-9)
    repeated, at = mbd.Samples(X, Y, periodic=True), np.linspace(-2.0, 2.0, 400)
    np.testing.assert_allclose(repeated(at), CubicSpline(X, Y, bc_type="periodic")(at), atol=1e-12)


def test_smooth_samples_lose_their_noise():
    rng, at = np.random.default_rng(4), np.linspace(0.0, 2.0, 201)
    true = 0.4 * np.sin(2.0 * np.pi * at)
    noisy = true + 2e-3 * rng.normal(size=len(at))
    acceleration = -0.4 * (2.0 * np.pi) ** 2 * np.sin(2.0 * np.pi * at)
    rough = np.abs(mbd.Samples(at, noisy)(at, 2) - acceleration)[20:-20].max()
    for signal in (mbd.Samples(at, noisy, "smooth"), mbd.Samples(at, noisy, "smooth", cutoff=5.0)):
        assert np.abs(signal(at) - true)[20:-20].max() < 3e-3
        assert np.abs(signal(at, 2) - acceleration)[20:-20].max() < 0.1 * rough
    noisy[-1] = noisy[0]
    cycle = mbd.Samples(at, noisy, "smooth", periodic=True)
    for k in range(3):
        assert cycle(0.0, k) == pytest.approx(cycle(2.0 - 1e-12, k), rel=1e-6, abs=1e-6)


def test_a_filter_passes_half_of_the_power_at_its_cutoff():
    at = np.linspace(0.0, 20.0, 2001)
    wave = np.sin(2.0 * np.pi * 3.0 * at)
    passed = mbd.Samples(at, wave, "smooth", cutoff=3.0)(at)[500:-500]
    assert np.abs(passed).max() == pytest.approx(np.sqrt(0.5), rel=2e-3)


@pytest.mark.parametrize(
    "curve",
    [
        CubicSpline(X, Y), CubicSpline(X, Y, bc_type="natural"), CubicSpline(X, [*Y[:-1], Y[0]], bc_type="periodic"),
        make_interp_spline(X, Y), make_smoothing_spline(X, Y), InterpolatedUnivariateSpline(X, Y),
    ],
)  # fmt: skip
def test_splines_of_scipy_drive_as_they_are(curve):
    model, _ = arm([curve], bars=1)
    run = mbd.simulate(model, mbd.assemble(model), mbd.RadauIIA(), dt=0.01, until=0.55)
    np.testing.assert_allclose(run["joint 0.angle"], curve(run.time), atol=1e-9)
    slope, bend = (d if callable(d) else None for d in (curve.derivative(1), curve.derivative(2)))
    np.testing.assert_allclose(run["joint 0.rate"], slope(run.time), atol=1e-7)
    np.testing.assert_allclose(run["joint 0.acceleration"], bend(run.time), atol=1e-5)


@pytest.mark.parametrize(
    ("curve", "said"),
    [
        (PchipInterpolator(X, Y), "no second derivative"),
        (Akima1DInterpolator(X, Y), "no second derivative"),
        (make_interp_spline(X, Y, k=1), "no second derivative"),
        (make_interp_spline(X, Y, k=5), "degree 5 .* take k=3"),
        (interp1d(X, Y), r"mbd.Samples\(curve.x, curve.y, kind='linear'\)"),
        (BarycentricInterpolator(X, Y), r"mbd.Samples\(time, values\)"),
        (CubicSpline(X, np.array([Y, Y]).T), "one component"),
        (mbd.Samples(X, Y, "linear"), "kind='spline'"),
        (mbd.Samples(X, Y, "hold"), "kind='spline'"),
        (mbd.Samples(X, Y, "monotone"), "kind='spline'"),
        (lambda t: mbd.Samples(X, Y, "monotone")(t), "kind='spline'"),
        (lambda t: np.interp(t, X, Y), r"mbd.Samples\(time, values\)"),
        (lambda t: CubicSpline(X, Y)(t), r"mbd.Samples.of\(curve\)"),
    ],
)
def test_what_has_no_acceleration_is_refused_with_the_cure(curve, said):
    with pytest.raises(mbd.MbdError, match=said):
        mbd.assemble(arm([curve], bars=1)[0])


def test_a_rate_in_straight_lines_is_told_of():
    with pytest.warns(mbd.MbdWarning, match="accelerations jump at every sample"):
        mbd.Nonholonomic("feed", lambda v: v, mbd.Samples([0.0, 1.0], [0.0, 1.0], "linear"), arguments=("rail.rate",))


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_drive_that_leaves_its_table_in_motion_ends_the_run_by_name(scheme):
    model, _ = arm([mbd.Samples(X, Y + X)], bars=1)
    with pytest.raises(mbd.SimulationError, match=r"'drive of joint 0' .* velocity.*periodic=True"):
        mbd.simulate(model, mbd.assemble(model), scheme, dt=0.01, until=1.0)
    rest, _ = arm([mbd.Samples(X, Y + X, ends="clamped")], bars=1)
    run = mbd.simulate(rest, mbd.assemble(rest), scheme, dt=0.01, until=1.0)
    assert run["joint 0.rate"][-1] == pytest.approx(0.0, abs=1e-9)


def test_tables_in_functions_are_those_alone():
    """Several tables of one owner, scaled, shifted and repeated, against functions of scipy's splines."""
    a, b = mbd.Samples(X, Y), mbd.Samples(X, Y[::-1], periodic=True)
    model, _ = arm([lambda t: 2.0 * a(t) - b(0.3 * t + 0.05) * mbd.sin(t)], bars=1)
    run = mbd.simulate(model, mbd.assemble(model), mbd.RadauIIA(), dt=0.005, until=0.6)
    first, second = CubicSpline(X, Y), CubicSpline(X, Y[::-1], bc_type="periodic")
    wanted = 2.0 * first(run.time) - second(0.3 * run.time + 0.05) * np.sin(run.time)
    np.testing.assert_allclose(run["joint 0.angle"], wanted, atol=1e-9)


def test_tables_of_one_owner_are_told_apart():
    from mbd.testing.scope import FreeScope

    scope = FreeScope()
    scope.numbers[scope.time] = 0.5
    signals = [mbd.Samples([0.0, 1.0], [size, size]).signal(scope, "push") for size in (1.0, 5.0)]
    assert scope.value(*signals) == pytest.approx([1.0, 5.0])


def test_the_old_name_of_monotone_warns():
    with pytest.warns(mbd.MbdWarning, match="'monotone'"):
        assert mbd.Samples(X, Y, kind="cubic").kind == "monotone"


@pytest.mark.parametrize("kind", ["linear", "hold"])
def test_data_up_to_the_end_of_a_table_are_fitted(kind):
    """A fit of a model under a table whose last sample is the last datum, with rows stored twice at its kinks."""
    t = np.linspace(0.0, 0.6, 7)
    model = mbd.Model("swing")
    bar = mbd.Link("bar", mass=1.0, length=0.5, center=0.25, inertia=0.02)
    hip = mbd.Revolute("hip", model.ground.origin, bar.start, loss=mbd.Viscous(0.3))
    model.connect(hip)
    model.apply(mbd.Motor("motor", hip, torque=mbd.Samples(t, np.sin(9.0 * t), kind)))
    if kind == "hold":  # a prescribed motion whose table ends with the data
        shank = mbd.Link("shank", mass=0.6, length=0.4, center=0.2, inertia=0.01)
        hinge = mbd.Revolute("top", model.ground.point(1.0, 0.0), shank.start)
        model.connect(hinge)
        model.constrain(mbd.Bilateral("drive", hinge, value=mbd.Samples(t, np.sin(4.0 * t))))
    start = mbd.assemble(model, {"hip.angle": 0.4})
    seen = mbd.simulate(model, start, dt=0.005, until=0.6).at(t[1:])["hip.angle"]
    found = mbd.fit(model, start, {"time": t[1:], "hip.angle": seen}, {"hip loss.coefficient": 0.1}, dt=0.005)
    assert found.values["hip loss.coefficient"] == pytest.approx(0.3, rel=1e-6)
