"""Controllers and sampled signals: their instants are step boundaries, and accuracy does not suffer from them."""

from dataclasses import replace

import numpy as np
import pytest

import mbd
from tests.simulation.mechanisms import G, ball, falling, pendulum, run


def pushed(*controllers, force=0.0):
    """A point on a rail along x, pushed by the parameter 'push.force.x'."""
    model = mbd.Model("cart", gravity=(0, 0, 0))
    body = mbd.PointMass("cart", mass=1.0)
    model.tunable = ("push.force.x",)
    model.connect(mbd.Prismatic("rail", model.ground.origin, body.origin))
    model.apply(mbd.Applied("push", body.origin, force=(force, 0.0, 0.0)), *controllers)
    return model


def test_a_sampled_controller_is_called_at_its_instants_with_what_it_reads():
    calls = []

    def update(t, values, state):
        calls.append((t, values["rail.displacement"], state))
        return {}, (state or 0) + 1

    model = pushed(mbd.Controller("clock", update, period=0.03, reads=("rail.displacement",)))
    trajectory = run(model, {"rail.displacement": 0.0}, {"rail.displacement": 2.0}, until=0.1)
    times, places, states = zip(*calls, strict=True)
    np.testing.assert_allclose(times, [0.0, 0.03, 0.06, 0.09], atol=1e-15)
    np.testing.assert_allclose(places, [0.0, 0.06, 0.12, 0.18], atol=1e-12)
    assert states == (None, 1, 2, 3)
    assert trajectory.final.time == 0.1


@pytest.mark.parametrize("written", [0.0, 1.0, 0.5])
def test_what_a_controller_writes_is_an_input_from_the_first_derivation_on(written):
    def twice(name):
        return mbd.Controller("law", lambda t, values, state: {name: 2.0}, period=0.1, writes=[name])

    model = pushed(twice("push.force.x"), force=written)
    model.tunable = ()
    energies = mbd.Lagrangian(
        "cart", ["x"], kinetic=lambda x_rate: x_rate**2 / 2, potential=lambda x, f: -f * x, parameters={"f": written},
        controllers=[twice("f")],
    )  # fmt: skip
    for trajectory in run(model), mbd.simulate(energies, mbd.assemble(energies), dt=0.01, until=1.0):
        assert trajectory.record.q[-1, 0] == pytest.approx(1.0, abs=1e-10)
        assert not any("derived once more" in note for note in trajectory.stats["notes"])


@pytest.mark.parametrize("period", [0.03, 0.0042, 0.0137])
@pytest.mark.parametrize("formulation", ["ggl", "index3"])
def test_steps_never_exceed_dt_at_the_instants_of_a_controller(period, formulation):
    model = pushed(mbd.Controller("clock", lambda t, values, state: None, period=period))
    trajectory = run(model, dt=0.01, until=0.2, integrator=mbd.HHT(0.05, formulation=formulation))
    steps = np.diff(trajectory.time)
    assert steps.max() < 0.01 * (1.0 + 1e-6)
    instants = np.arange(1, int(0.2 / period)) * period
    assert np.abs(trajectory.time[:, None] - instants).min(axis=0).max() < 1e-15


def test_a_parameter_written_by_a_controller_acts_from_its_instant_on():
    model = pushed(
        mbd.Controller(
            "bang", lambda t, values, state: {"push.force.x": 1.0 if t < 0.5 else -1.0}, period=0.25,
            writes=("push.force.x",),
        )
    )  # fmt: skip
    trajectory = run(model, dt=0.013)
    assert trajectory["rail.displacement"][-1] == pytest.approx(0.25, abs=1e-12)
    assert trajectory["rail.rate"][-1] == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(trajectory.at(0.5, side="left")["rail.acceleration"], 1.0)
    np.testing.assert_allclose(trajectory.at(0.5, side="right")["rail.acceleration"], -1.0)
    assert trajectory.at(0.25)["rail.acceleration"] == pytest.approx(1.0)


def test_feedback_through_samples_is_the_discrete_loop():
    """x¨ = −k x(t_n) held over each sample has an exact solution."""
    k, T = 4.0, 0.1
    model = pushed(
        mbd.Controller(
            "hold", lambda t, values, state: {"push.force.x": -k * values["rail.displacement"]}, period=T,
            reads=("rail.displacement",), writes=("push.force.x",),
        )
    )  # fmt: skip
    trajectory = run(model, {"rail.displacement": 1.0}, dt=0.01)
    x, v = 1.0, 0.0
    for _ in range(10):
        u = -k * x
        x, v = x + T * v + 0.5 * T * T * u, v + T * u
    assert trajectory["rail.displacement"][-1] == pytest.approx(x, abs=1e-11)
    assert trajectory["rail.rate"][-1] == pytest.approx(v, abs=1e-11)


def test_a_controller_hears_a_contact_and_changes_the_swing():
    """The push lifts the ball only after its first landing."""
    model = ball(restitution=0.0)
    (body,) = [b for b in model.bodies.values() if b.name == "ball"]
    model.tunable = ("lift.force.y",)
    heard = []

    def update(t, values, state):
        heard.append((t, values["floor.gap"]))
        return {"lift.force.y": 2.0 * (G + 1.0)}

    model.apply(
        mbd.Applied("lift", body.origin, force=(0.0, 0.0, 0.0)),
        mbd.Controller("wake", update, on=("floor",), reads=("floor.gap",), writes=("lift.force.y",)),
    )
    trajectory = run(model, {"fall.displacement": 1.0})
    land = np.sqrt(2.0 / G)
    assert heard == [(pytest.approx(land), pytest.approx(0.0, abs=1e-12))]
    assert [event.kind for event in trajectory.events] == ["closed", "opened"]
    assert trajectory["fall.displacement"][-1] == pytest.approx(0.5 * (1.0 - land) ** 2, abs=1e-9)


def test_a_controller_hears_a_users_event_after_its_reset():
    model, body = falling()
    heard = []

    def update(t, values, state):
        heard.append(values["fall.rate"])

    model.constrain(mbd.Event("floor", mbd.height(body.origin), direction=-1, reset={"fall.rate": 1.0}))
    model.apply(mbd.Controller("ear", update, on="floor", reads="fall.rate"))
    run(model, {"fall.displacement": 1.0}, until=0.5)
    assert heard == [1.0]


def test_a_state_machine_switches_the_damping_of_a_knee_between_phases():
    model = pendulum(loss=mbd.Viscous(0.2))
    model.constrain(mbd.Event("bottom", mbd.measure("hinge.angle")))

    def update(t, values, phase):
        phase = "swing" if phase == "stance" else "stance"
        return {"hinge loss.coefficient": 2.0 if phase == "stance" else 0.2}, phase

    model.apply(mbd.Controller("phase", update, on="bottom", writes="hinge loss.coefficient", state="swing"))
    trajectory = run(model, {"hinge.angle": 1.0}, dt=1e-3, until=2.0)
    first, second = (event.row for event in trajectory.events[:2])
    free = run(pendulum(loss=mbd.Viscous(0.2)), {"hinge.angle": 1.0}, dt=1e-3, until=2.0)
    np.testing.assert_allclose(trajectory["hinge.angle"][: first - 1], free["hinge.angle"][: first - 1], atol=1e-9)
    assert abs(trajectory["hinge.angle"][second:]).max() < 0.6 * abs(free["hinge.angle"][second:]).max()


BAD = {
    "raises": (lambda t, values, state: 1 / 0, "ZeroDivisionError"),
    "nan": (lambda t, values, state: {"push.force.x": float("nan")}, "nan"),
    "writes another name": (lambda t, values, state: {"push.force.y": 1.0}, "push.force.x"),
    "text": (lambda t, values, state: {"push.force.x": "hard"}, "'hard'; give a finite number"),
    "words": (lambda t, values, state: "hard", "must return the parameters to write"),
    "one of a pair": (lambda t, values, state: ({"push.force.x": 1.0},), "must return the parameters to write"),
    "an array": (lambda t, values, state: {"push.force.x": np.zeros(2)}, "give a finite number"),
    "not read": (lambda t, values, state: {"push.force.x": values["hip.angle"]}, "name it in reads="),
    "list": (lambda t, values, state: [1.0], "must return the parameters to write"),
}


@pytest.mark.parametrize(("update", "said"), BAD.values(), ids=BAD)
def test_a_controller_that_fails_ends_the_run_by_name_and_keeps_it(update, said):
    def late(t, values, state):
        return update(t, values, state) if t > 0.25 else {}

    model = pushed(mbd.Controller("brain", late, period=0.1, writes=("push.force.x",)))
    with pytest.raises(mbd.SimulationError, match=said) as failed:
        run(model, velocity={"rail.displacement": 1.0})
    assert "'brain'" in str(failed.value) and "0.3" in str(failed.value)
    assert failed.value.run.time[-1] == pytest.approx(0.3)


def test_a_period_far_below_the_step_is_refused():
    model = pushed(mbd.Controller("mad", lambda t, values, state: None, period=1e-300))
    with pytest.raises(mbd.ModelError, match="'mad'"):
        run(model)


# sampled signals ----------------------------------------------------------------------------------------------------
def driven(times, values, dt, kind="linear"):
    model = mbd.Model("cart", gravity=(0, 0, 0))
    body = mbd.PointMass("cart", mass=1.0)
    model.connect(mbd.Prismatic("rail", model.ground.origin, body.origin))
    model.apply(mbd.Applied("push", body.origin, force=(mbd.Samples(times, values, kind=kind), 0.0, 0.0)))
    return run(model, dt=dt)


def test_a_kink_between_grid_points_does_not_cost_order():
    times, values = [0.0, 0.3333, 0.6667, 1.0], [0.0, 3.0, -1.0, 2.0]
    exact = speed = 0.0
    for k in range(3):
        h, a, b = times[k + 1] - times[k], values[k], values[k + 1]
        exact += h * speed + h * h * (2 * a + b) / 6
        speed += h * (a + b) / 2
    errors = [abs(driven(times, values, dt)["rail.displacement"][-1] - exact) for dt in (0.02, 0.01, 0.005)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all((orders > 1.8) & (orders < 2.2))


def test_kinks_are_step_boundaries():
    trajectory = driven([0.0, 0.3333, 0.6667, 1.0], [0.0, 3.0, -1.0, 0.0], dt=0.01)
    assert 0.3333 in trajectory.time and 0.6667 in trajectory.time
    assert np.diff(trajectory.time).max() < 0.01 * (1 + 1e-6)


def test_a_jump_keeps_its_two_sides_and_the_order_of_the_scheme():
    jump = 0.35711
    exact = 0.5 * jump**2 + jump * (1 - jump) - (1 - jump) ** 2
    for dt in (0.02, 0.005):
        trajectory = driven([0.0, jump, jump + 1e-9, 1.0], [1.0, 1.0, -2.0, -2.0], dt)
        assert trajectory["rail.displacement"][-1] == pytest.approx(exact, abs=1e-8)
    assert trajectory.at(jump - 1e-6)["rail.acceleration"] == pytest.approx(1.0)
    assert trajectory.at(jump + 1e-6)["rail.acceleration"] == pytest.approx(-2.0)


def test_multipliers_between_rows_stay_bounded_beside_a_kink():
    model, body = falling()
    model.constrain(mbd.Unilateral("floor", mbd.height(body.origin)))
    push = mbd.Samples([0.0, 0.1234, 0.5], [0.0, -10.0, 0.0], kind="linear")
    model.apply(mbd.Applied("push", body.origin, force=(0.0, push, 0.0)))
    trajectory = run(model, closed=["floor"], until=0.5)
    force = trajectory.at(np.linspace(0.0, 0.5, 2001))["floor.force"]
    exact = 2 * G - np.interp(np.linspace(0.0, 0.5, 2001), [0.0, 0.1234, 0.5], [0.0, -10.0, 0.0])
    np.testing.assert_allclose(force, exact, atol=1e-6)


def test_a_stride_keeps_its_rows_between_the_samples_of_a_controller():
    """A controller at every step that writes only twice: rows at the stride, and both sides of what it changed."""
    calls = []

    def update(t, values, state):
        calls.append(t)
        return {"push.force.x": 1.0 if t < 0.4995 else -1.0}

    model = pushed(mbd.Controller("fast", update, period=1e-3, writes=("push.force.x",)))
    trajectory = run(model, dt=1e-3, store=100)
    assert len(calls) == 1000 and len(trajectory.time) < 20
    assert trajectory.at(0.5, side="left")["rail.acceleration"] == pytest.approx(1.0)
    assert trajectory.at(0.5, side="right")["rail.acceleration"] == pytest.approx(-1.0)
    assert trajectory["rail.displacement"][-1] == pytest.approx(0.25, abs=1e-9)


def test_parameters_of_a_late_start_are_judged_at_its_time():
    model, body = falling()
    model.apply(mbd.Applied("late", body.origin, force=(0.0, lambda t: mbd.sqrt(t - 1.0), 0.0)))
    start = replace(mbd.assemble(falling()[0], {"fall.displacement": 1.0}), time=2.0)
    trajectory = mbd.simulate(model, start, mbd.HHT(0.05), dt=0.01, until=2.5, parameters={"ball.mass": 3.0})
    assert trajectory.success
