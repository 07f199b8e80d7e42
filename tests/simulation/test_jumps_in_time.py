"""Forces that jump in time: steps end there, whatever function, table or parameter says when."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.integrate import solve_ivp

import mbd

SCHEMES = {
    "HHT": mbd.HHT(0.05), "Newmark": mbd.Newmark(), "generalized alpha": mbd.GeneralizedAlpha(0.8),
    "Radau": mbd.RadauIIA(), "RK4": mbd.RungeKutta4(), "RK853": mbd.RungeKutta853(),
}  # fmt: skip
ORDERS = {"HHT": 2, "Newmark": 2, "generalized alpha": 2, "Radau": 5, "RK4": 4}
INERTIA, TORQUE = 1.0 / 12.0 + 0.25, 20.0


def pendulum(torque, *arguments):
    """A rod under a torque of time, and a start."""
    model = mbd.Model("pendulum")
    rod = mbd.Link("rod", mass=1.0, length=1.0, center=0.5, inertia=1.0 / 12.0)
    hinge = mbd.Revolute("hinge", model.ground.origin, rod.start)
    model.connect(hinge)
    model.apply(mbd.Motor("motor", hinge, torque=torque, arguments=("t", *arguments)))
    return model, mbd.assemble(model, position={"hinge.angle": 0.3})


def exact(jumps, first, end):
    """The angle at the end with a torque that is on or off between the jumps, `first` before all of them."""
    state, on, begin = [0.3, 0.0], first, 0.0
    for instant in [*(t for t in sorted(jumps) if 0.0 < t < end), end]:
        torque = TORQUE * on
        state = solve_ivp(
            lambda t, y, torque=torque: [y[1], (torque - 4.905 * np.sin(y[0])) / INERTIA],
            (begin, instant), state, rtol=1e-13, atol=1e-13, method="DOP853",
        ).y[:, -1]  # fmt: skip
        on, begin = not on, instant
    return state[0]


FORMS = {
    "before": (lambda t, T: mbd.where(t < T, 0.0, TORQUE), lambda T: [T], False),
    "after": (lambda t, T: mbd.where(t >= T, TORQUE, 0.0), lambda T: [T], False),
    "up to": (lambda t, T: mbd.where(t <= T, 0.0, TORQUE), lambda T: [T], False),
    "beyond": (lambda t, T: mbd.where(t > T, TORQUE, 0.0), lambda T: [T], False),
    "scaled": (lambda t, T: mbd.where(3.0 * t - 1.0 < 3.0 * T - 1.0, 0.0, TORQUE), lambda T: [T], False),
    "sign": (lambda t, T: 0.5 * TORQUE * (1.0 + mbd.sign(t - T)), lambda T: [T], False),
    "pulse": (lambda t, T: mbd.where((t > T) & (t < 2.0 * T), TORQUE, 0.0), lambda T: [T, 2.0 * T], False),
    "distance": (lambda t, T: mbd.where(abs(t - T) < 0.3 * T, TORQUE, 0.0), lambda T: [0.7 * T, 1.3 * T], False),
    "bounded": (lambda t, T: mbd.where(mbd.minimum(t, 2.0) < T, 0.0, TORQUE), lambda T: [T], False),
    "floor": (lambda t, T: TORQUE * mbd.minimum(mbd.floor(t / T), 1.0), lambda T: [T], False),
    "repeated": (
        lambda t, T: mbd.where(mbd.mod(t, T) < 0.4 * T, TORQUE, 0.0),
        lambda T: [k * T + part for k in range(60) for part in (0.0, 0.4 * T)], True,
    ),
    "wave": (
        lambda t, T: mbd.where(mbd.sin(2.0 * np.pi / T * t) > 0.0, TORQUE, 0.0),
        lambda T: [0.5 * k * T for k in range(120)], True,
    ),
    "curved": (lambda t, T: mbd.where(t * t < T * T, 0.0, TORQUE), lambda T: [T], False),
}  # fmt: skip


@settings(max_examples=8, deadline=None)
@given(
    form=st.sampled_from(sorted(FORMS)), instant=st.floats(0.05, 0.6), scheme=st.sampled_from(sorted(SCHEMES)),
    tol=st.sampled_from([1e-4, 1e-6]),
)  # fmt: skip
def test_a_tolerance_is_met_across_jumps(form, instant, scheme, tol):
    function, jumps, first = FORMS[form]
    model, start = pendulum(function, ("instant", instant))
    if scheme == "generalized alpha" and tol < 1e-5:
        scheme = "HHT"
    run = mbd.simulate(model, start, SCHEMES[scheme], tol=tol, until=0.8)
    assert run["hinge.angle"][-1] == pytest.approx(exact(jumps(instant), first, 0.8), abs=3.0 * tol)
    assert not any("round-off" in note for note in run.stats["notes"])


@pytest.mark.parametrize(
    ("form", "backend"), [*((form, "llvm") for form in sorted(FORMS)), ("up to", "python"), ("repeated", "python")]
)
def test_jumps_are_ends_of_fixed_steps(form, backend):
    function, jumps, first = FORMS[form]
    model, start = pendulum(function, ("instant", 0.1837))
    run = mbd.simulate(model, start, mbd.RadauIIA(), dt=0.02, until=0.5, backend=backend)
    for instant in jumps(0.1837):
        assert not 0.0 < instant < 0.5 or np.min(np.abs(run.time - instant)) < 1e-12
    assert run["hinge.angle"][-1] == pytest.approx(exact(jumps(0.1837), first, 0.5), abs=1e-8)


@pytest.mark.parametrize("scheme", sorted(ORDERS))
def test_a_jump_does_not_cost_order(scheme):
    """Mean order over random instants; Radau's errors soon are round-off."""
    rng, dts = np.random.default_rng(5), (0.08, 0.04, 0.02) if scheme == "Radau" else (0.02, 0.01, 0.005)
    logs = []
    for instant in rng.uniform(0.1, 0.9, 4):
        model, start = pendulum(FORMS["before"][0], ("instant", instant))
        end = exact([instant], False, 1.0)
        runs = [mbd.simulate(model, start, SCHEMES[scheme], dt=dt, until=1.0) for dt in dts]
        logs.append(np.log2([abs(run["hinge.angle"][-1] - end) for run in runs]))
    order = np.mean(-np.diff(logs, axis=1))
    assert order > ORDERS[scheme] - 0.4


def test_results_beside_a_jump_are_those_of_their_side():
    model, start = pendulum(FORMS["before"][0], ("instant", 0.0537))
    run = mbd.simulate(model, start, dt=0.01, until=0.2)
    (row,) = np.flatnonzero(np.diff(run.time) == 0.0)
    assert run.time[row] == 0.0537
    for name, force in (("motor.torque", (0.0, TORQUE)), ("hinge.acceleration", None)):
        sides = run[name][row], run[name][row + 1]
        assert sides == pytest.approx([run.at(0.0537, side=side)[name] for side in ("left", "right")])
        assert force is None or sides == pytest.approx(force)
    assert run["hinge.acceleration"][row + 1] - run["hinge.acceleration"][row] == pytest.approx(TORQUE / INERTIA)


@pytest.mark.parametrize("scheme", ["HHT", "Radau", "RK853"])
@pytest.mark.parametrize("guard", [lambda t: t - 0.3, lambda t: mbd.where(t < 0.3, -1.0, 1.0), lambda t: t - 0.31])
def test_an_event_at_a_jump_happens_once_behind_it(guard, scheme):
    model, start = pendulum(FORMS["before"][0], ("instant", 0.3))
    model.constrain(mbd.Event("bell", mbd.measure(guard, "t")))
    run = mbd.simulate(model, start, SCHEMES[scheme], dt=0.01, until=0.6)
    (bell,) = run.events
    assert bell.time == pytest.approx(0.3 if guard(0.305) > 0.0 else 0.31)
    forces = run["motor.torque"]
    assert forces[0] == 0.0 and np.count_nonzero(np.diff(forces)) == 1
    assert run["hinge.angle"][-1] == pytest.approx(exact([0.3], False, 0.6), abs=1e-3)


def test_a_run_that_ends_at_a_jump_ends_before_it_and_goes_on_behind():
    model, start = pendulum(FORMS["before"][0], ("instant", 0.3))
    first = mbd.simulate(model, start, mbd.RadauIIA(), dt=0.01, until=0.3)
    assert first.time[-1] == 0.3 and first["motor.torque"][-1] == 0.0
    second = mbd.simulate(model, first.final, mbd.RadauIIA(), dt=0.01, until=0.8)
    assert second["hinge.angle"][-1] == pytest.approx(exact([0.3], False, 0.8), abs=1e-8)


def test_a_controller_may_move_the_instant():
    model, start = pendulum(FORMS["before"][0], ("instant", 5.0))
    update = lambda t, values, state: {"motor.instant": 0.4321}  # noqa: E731
    model.apply(mbd.Controller("late", update, period=0.1, writes=("motor.instant",)))
    run = mbd.simulate(model, start, mbd.RadauIIA(), dt=0.01, until=0.8)
    assert run["hinge.angle"][-1] == pytest.approx(exact([0.4321], False, 0.8), abs=1e-8)


@pytest.mark.parametrize(
    ("form", "scheme"), [("before", "HHT"), ("pulse", "Radau"), ("repeated", "RK853"), ("wave", "RK4"), ("wave", "HHT")]
)
def test_derivatives_by_the_instant_are_differences(form, scheme):
    model, start = pendulum(FORMS[form][0], ("instant", 0.1537))
    how = {"dt": 2e-3, "until": 0.5}
    found = mbd.sensitivities(model, start, SCHEMES[scheme], wrt=["motor.instant"], of=["hinge.angle"], **how)

    def end(instant):
        run = mbd.simulate(model, start, SCHEMES[scheme], parameters={"motor.instant": instant}, **how)
        return run["hinge.angle"][-1]

    difference = (end(0.1537 + 1e-5) - end(0.1537 - 1e-5)) / 2e-5
    loose = 1e-3 if scheme == "HHT" else 1e-5
    assert found["hinge.angle", "motor.instant"] == pytest.approx(difference, rel=loose)


@pytest.mark.parametrize("scheme", ["HHT", "Radau", "RK853"])
@pytest.mark.parametrize(
    "value",
    [lambda t: mbd.where(t < 0.2, 0.0, t - 0.2), lambda t: mbd.where(t < 0.2, 0.0, 0.1), lambda t: abs(t - 0.2)],
)
def test_a_prescribed_motion_that_jumps_ends_the_run_by_name(value, scheme):
    model, _ = pendulum(0.0)
    model = model.without("motor")
    model.constrain(mbd.Bilateral("drive", model.joints[0], value=value))
    with pytest.raises(mbd.SimulationError, match="t = 0.2 s: a prescribed motion jumps there.*'drive'"):
        mbd.simulate(model, mbd.assemble(model), SCHEMES[scheme], dt=0.01, until=0.5)


def test_a_prescribed_acceleration_may_jump():
    model, _ = pendulum(0.0)
    model = model.without("motor")
    hinge = model.joints[0]
    model.constrain(mbd.Bilateral("drive", hinge, value=lambda t: mbd.maximum(t - 0.2137, 0.0) ** 2))
    for scheme in SCHEMES.values():
        run = mbd.simulate(model, mbd.assemble(model), scheme, dt=0.01, until=0.5)
        angle, bend = np.maximum(run.time - 0.2137, 0.0) ** 2, 2.0 * (run.time > 0.2137)
        wanted = INERTIA * bend + 4.905 * np.sin(angle)
        away = np.abs(run.time - 0.2137) > 1e-9
        np.testing.assert_allclose(run["drive.torque"][away], wanted[away], atol=2e-2)
        (row,) = np.flatnonzero(np.diff(run.time) == 0.0)
        assert run["drive.torque"][row : row + 2] == pytest.approx([0.0, 2.0 * INERTIA], abs=1e-6)


def test_dense_jumps_are_stepped_over():
    model, start = pendulum(lambda t: mbd.where(mbd.mod(t, 1e-5) < 5e-6, TORQUE, 0.0))
    run = mbd.simulate(model, start, dt=1e-3, until=0.1)
    assert len(run.time) < 300


@pytest.mark.parametrize("scheme", [mbd.RadauIIA(), mbd.RungeKutta853(), mbd.HHT(0.05), mbd.Newmark()], ids=repr)
def test_accelerations_in_the_step_before_a_jump_are_those_before_it(scheme):
    """The end of that step was read behind the jump, and its force was taken for an error of the rows."""
    model = mbd.Model("jump")
    upper, lower = mbd.Link("upper", 1.0, 0.5, 0.25, 0.02), mbd.Link("lower", 0.7, 0.4, 0.2, 0.01)
    hip = mbd.Revolute("hip", model.ground.origin, upper.start)
    model.connect(hip, mbd.Revolute("knee", upper.end, lower.start))
    model.apply(mbd.Motor("motor", hip, torque=lambda t: mbd.where(t < 0.123, 2.0, -3.0)))
    start = mbd.assemble(model, {"hip.angle": 0.5, "knee.angle": 0.8})
    run = mbd.simulate(model, start, scheme, dt=5e-3, until=0.2)
    exact = mbd.simulate(model, start, mbd.RungeKutta853(), dt=1e-4, until=0.2)
    times = np.linspace(0.1201, 0.1229, 9)
    for name in ("hip.acceleration", "knee.acceleration"):
        true = exact.at(times)[name]
        jump = np.ptp(exact[name][np.abs(exact.time - 0.123) < 2e-4])
        assert np.max(np.abs(run.at(times)[name] - true)) < 2e-3 * jump


@pytest.mark.parametrize("scheme", [mbd.HHT(), mbd.GeneralizedAlpha(0.5), mbd.Newmark(), mbd.RadauIIA()], ids=str)
def test_a_push_far_shorter_than_dt_gives_its_impulse(scheme):
    """The jerk with which a scheme starts behind the first jump is not looked for behind the second."""
    rng = np.random.default_rng(7)
    for width in 10.0 ** rng.uniform(-5.0, -2.2, 8):
        begin, impulse = rng.uniform(0.2, 0.4), rng.uniform(-2.0, 2.0)
        model = mbd.Model("pushed", gravity=(0.0, 0.0, 0.0))
        body = mbd.PointMass("body", 1.0)
        model.connect(mbd.Prismatic("x", model.ground.origin, body.origin))

        def push(t, begin=begin, width=width, impulse=impulse):
            return mbd.where((t > begin) & (t < begin + width), impulse / width, 0.0)

        model.apply(mbd.Applied("push", body.origin, force=(push, 0.0, 0.0), arguments=("t",)))
        run = mbd.simulate(model, mbd.assemble(model), scheme, dt=0.01, until=0.5)
        assert abs(run["x.displacement.rate"][-1] - impulse) < 1e-9
        assert abs(run["x.displacement"][-1] - impulse * (0.5 - begin - 0.5 * width)) < 1e-9
