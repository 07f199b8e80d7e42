"""Sampled feedback: difference equations, hold, delay and resolution against an integration beside it; gaits of it."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mbd
from mbd.errors import ModelError

PERIOD, INERTIA, END = 0.01, 0.11, 0.505


def law(q: Any, v: Any, total: Any) -> Any:
    return -60.0 * (q - 1.0) - 6.0 * v - 20.0 * total


def arm(**more: Any) -> tuple[mbd.Model, mbd.State]:
    """A pendulum held up by a sampled PID."""
    model = mbd.Model("arm")
    rod = mbd.Link("rod", mass=2.0, length=0.4, center=0.2, inertia=0.03)
    hinge = mbd.Revolute("hinge", model.ground.origin, rod.start)
    model.connect(hinge)
    model.apply(
        mbd.Motor("motor", hinge, torque=0.5),
        mbd.SampledLaw(
            "PID", PERIOD, {"motor.torque": law}, arguments=("hinge.angle", "hinge.rate", "PID.sum"),
            states={"sum": lambda q, v, total: total + PERIOD * (q - 1.0)}, **more,
        ),
    )  # fmt: skip
    return model, mbd.assemble(model, {"hinge.angle": 0.2})


def oracle(delay: float = 0.0, resolution: float = 0.0) -> tuple[float, float, float, float]:
    """The same by scipy at 1e-13 between the instants: q, v, sum and torque at the end."""
    t, y, total, torque, sample, coming = 0.0, np.array([0.2, 0.0]), 0.0, 0.5, 0, list[tuple[float, float]]()
    while t < END:
        while coming and coming[0][0] <= t + 1e-12:
            torque = coming.pop(0)[1]
        if abs(t - PERIOD * sample) < 1e-12:
            q = resolution * np.floor(y[0] / resolution + 0.5) if resolution else y[0]
            computed, total, sample = law(q, y[1], total), total + PERIOD * (q - 1.0), sample + 1
            if delay:
                coming.append((t + delay, computed))
            else:
                torque = computed
        after = min([PERIOD * sample, END, *(instant for instant, _ in coming)])

        def rate(t: float, y: Any, u: float = torque) -> list[float]:
            return [y[1], (u - 2.0 * 9.81 * 0.2 * np.sin(y[0])) / INERTIA]

        y = solve_ivp(rate, (t, after), y, rtol=1e-13, atol=1e-14, method="DOP853").y[:, -1]
        t = after
    return float(y[0]), float(y[1]), total, torque


@pytest.mark.parametrize("delay", [0.0, 0.004, 0.01, 0.02, 0.023])
@pytest.mark.parametrize("backend", ["auto", "python"])
def test_samples_are_held_and_late_as_in_an_integration_beside_it(delay: float, backend: str) -> None:
    model, start = arm(delay=delay)
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=PERIOD, until=END, backend=backend)
    found = [run[name][-1] for name in ("hinge.angle", "hinge.rate", "PID.sum", "motor.torque")]
    np.testing.assert_allclose(found, oracle(delay), rtol=1e-9, atol=1e-11)
    samples = [event.time for event in run.events if event.name == "PID: sample"]
    np.testing.assert_allclose(samples, PERIOD * np.arange(1, 51), rtol=0.0, atol=1e-15)


def test_what_is_held_at_rows_hangs_on_all_samples_before() -> None:
    model, start = arm(delay=0.004)
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=PERIOD, until=END)
    early = mbd.simulate(model, start, mbd.RungeKutta853(), dt=PERIOD, until=0.6 * END)
    np.testing.assert_array_equal(run.columns.anchors[-1], run.final.anchors)
    row = int(np.searchsorted(run.time, 0.6 * END)) - 1
    np.testing.assert_array_equal(run.columns.anchors[row], early.final.anchors)


def test_values_are_rounded_to_their_resolution() -> None:
    model, start = arm(resolution={"hinge.angle": 0.01})
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=PERIOD, until=END)
    np.testing.assert_allclose([run.final.q[0], run.final.v[0]], oracle(resolution=0.01)[:2], rtol=1e-9)
    model, start = arm(resolution={"motor.torque": 0.5})
    torque = mbd.simulate(model, start, mbd.RungeKutta853(), dt=PERIOD, until=END)["motor.torque"]
    np.testing.assert_allclose(torque, 0.5 * np.round(torque / 0.5), atol=1e-12)


def test_derivatives_go_through_samples() -> None:
    model, start = arm(delay=0.0035)
    names, of = ["hinge.angle", "PID.period", "PID.delay", "rod.mass"], ["hinge.angle", "hinge.rate", "PID.sum"]
    found = mbd.sensitivities(model, start, mbd.RungeKutta853(), dt=PERIOD, until=0.105, wrt=names, of=of)

    def ends(name: str, change: float) -> Any:
        angle = 0.2 + (change if name == "hinge.angle" else 0.0)
        values = {} if name == "hinge.angle" else {name: model.parameters[name] + change}
        begun = mbd.assemble(model, {"hinge.angle": angle}, parameters=values)
        run = mbd.simulate(model, begun, mbd.RungeKutta853(), dt=PERIOD, until=0.105, parameters=values)
        return np.array([run[each][-1] for each in of])

    for name in names:
        h = 1e-5 if name.startswith("PID") else 1e-3
        near, far = (ends(name, step) - ends(name, -step) for step in (h, 2.0 * h))
        wanted = (8.0 * near - far) / (12.0 * h)
        np.testing.assert_allclose([found[each, name] for each in of], wanted, rtol=2e-7, atol=1e-8)


@pytest.mark.parametrize("made", [0.004, 0.01, 0.013, 0.02])
@pytest.mark.parametrize(("name", "value"), [
    *(("delay", value) for value in (0.0, 0.0035, 0.01, 0.0125, 0.02, 0.023)),
    *(("period", value) for value in (0.002, 0.005, 0.012, 0.03)),
])  # fmt: skip
def test_a_delay_or_period_of_a_run_is_that_of_a_model_made_with_it_or_an_error(
    made: float, name: str, value: float
) -> None:
    model, _ = arm(delay=made)
    late = made % PERIOD > 1e-9
    if name == "delay" and not late:  # a number of samples
        assert "PID.delay" not in model.parameters
        return
    period, delay = (value, made) if name == "period" else (PERIOD, value)
    if not late:
        delay = made / PERIOD * period
    if late and not np.ceil(made / PERIOD) - 1.0 <= delay / period <= np.ceil(made / PERIOD):
        with pytest.raises(ModelError, match="make a model with a SampledLaw of these values"):
            mbd.assemble(model, parameters={f"PID.{name}": value})
        return
    other = model.without("PID")
    word = next(each for each in model.constraints if each.name == "PID")
    other.apply(replace(word, period=period, delay=delay))
    ends = []
    for each, values in (model, {f"PID.{name}": value}), (other, {}):
        begun = mbd.assemble(each, {"hinge.angle": 0.2}, parameters=values)
        run = mbd.simulate(each, begun, mbd.RungeKutta853(), dt=PERIOD, until=0.2031)
        ends.append([run[result][-1] for result in ("hinge.angle", "hinge.rate", "motor.torque")])
    np.testing.assert_allclose(ends[0], ends[1], rtol=1e-9)


@pytest.mark.parametrize("delay", [0.0, 0.004, 0.01, 0.023])
def test_the_first_sample_is_that_of_the_start_and_parameters_of_the_run(delay: float) -> None:
    model, start = arm(delay=delay)
    values, until = {"motor.torque": -1.5, "PID.period": 1.05 * PERIOD, "rod.mass": 2.2}, 0.0531

    def end(start: mbd.State, values: Any) -> float:
        return mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.004, until=until, parameters=values).final.q[0]

    wanted = [end(mbd.assemble(model, {"hinge.angle": angle}, parameters=values), {}) for angle in (0.2, 0.9)]
    assert end(start, values) == wanted[0] == end(mbd.project(model, start, values), {})
    assert end(replace(start, anchors=np.zeros(0)), values) == wanted[0]
    assert end(replace(start, q=np.array([0.9])), values) == wanted[1]
    starts = start, {"hinge.angle": [0.2, 0.9]}
    found = mbd.batch(
        model, starts, mbd.RungeKutta853(), dt=0.004, until=until, parameters=values, results=["hinge.angle"]
    )
    np.testing.assert_array_equal(found["hinge.angle"], wanted)
    if delay:  # until the first outputs the parameter has its own value
        rate = mbd.sensitivities(
            model, start, mbd.RungeKutta853(), dt=0.004, until=until, wrt=["motor.torque"], of=["hinge.angle"]
        ).matrix[0, 0]
        change = end(start, {"motor.torque": 0.501}) - end(start, {"motor.torque": 0.499})
        assert rate == pytest.approx(500.0 * change, rel=1e-5) != 0.0


@pytest.mark.parametrize("has_state", [False, True])
@pytest.mark.parametrize("instant", [0.02, 0.023])
def test_a_sample_at_the_end_of_a_run_is_not_taken_again_with_other_parameters(instant: float, has_state: bool) -> None:
    """Nor do derivatives, and runs in other forms, take it again; a state without its memory may be a start."""
    model = mbd.Model("arm")
    hinge = mbd.Revolute("hinge", model.ground.origin, mbd.Link("rod", 2.0, 0.4, 0.2, 0.03).start)
    model.connect(hinge)
    states = {"n": lambda q, n, k: n + 1.0} if has_state else {}
    own = ("hinge.angle", "law.n", ("gain", 20.0)) if has_state else ("hinge.angle", ("gain", 20.0))
    model.apply(
        mbd.Motor("motor", hinge, torque=lambda u: u, arguments=["law.u"]),
        mbd.SampledLaw("law", PERIOD, {"u": lambda q, *more: -more[-1] * q}, arguments=own, states=states),
    )
    options: dict[str, Any] = {"integrator": mbd.RungeKutta853(), "dt": 2e-3}
    first = mbd.simulate(model, mbd.assemble(model, {"hinge.angle": 0.3}), until=instant, **options)

    def end(gain: float) -> float:
        run = mbd.simulate(model, first.final, until=0.0525, parameters={"law.gain": gain}, **options)
        assert run["law.u"][0] == first["law.u"][-1]
        return float(run["hinge.angle"][-1])

    gains = {"law.gain": [15.0, 20.0]}
    many = mbd.batch(model, first.final, until=0.0525, parameters=gains, results=["hinge.angle"], **options)
    assert many["hinge.angle"] == pytest.approx([end(15.0), end(20.0)], abs=1e-14)
    wanted = (8.0 * (end(20.01) - end(19.99)) - (end(20.02) - end(19.98))) / 0.12
    found = mbd.sensitivities(model, first.final, until=0.0525, wrt=["law.gain"], of=["hinge.angle"], **options)
    assert found["hinge.angle", "law.gain"] == pytest.approx(wanted, rel=1e-7)


def test_an_output_of_its_own_is_a_quantity_and_samples_restart_with_a_contact() -> None:
    model = mbd.Model("ball")
    ball = mbd.PointMass("ball", mass=1.0)
    rail = mbd.Prismatic("rail", model.ground.origin, ball.origin, axis="y")
    model.connect(rail)
    model.constrain(mbd.Unilateral("floor", mbd.height(ball.origin), restitution=0.8))
    model.apply(
        mbd.SampledLaw("brake", 0.1, {"u": lambda v: -0.5 * v}, arguments=("rail.rate",), restart_on="floor"),
        mbd.Motor("drive", rail, force=lambda u: u, arguments=("brake.u",)),
    )
    start = mbd.assemble(model, {"rail.displacement": 1.0})
    run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.02, until=1.2)
    struck = run.events[[event.name for event in run.events].index("floor")]
    after = run.at(struck.time)
    np.testing.assert_allclose(after["brake.u"], -0.5 * after["rail.rate"], rtol=1e-14)
    nexts = [event.time for event in run.events if event.name == "brake: sample" and event.time > struck.time]
    np.testing.assert_allclose(nexts[0], struck.time + 0.1, atol=1e-15)


L = mbd.SampledLaw


@pytest.mark.parametrize(("make", "message"), [
    (lambda: L("s", 0.0, {"u": law}), "period of SampledLaw 's', 0 s, is not positive"),
    (lambda: L("s", 0.1, {"u": law}, delay=-0.1), "is negative"),
    (lambda: L("s", 0.1, {}), "has no outputs"),
    (lambda: L("s", 0.1, {"u": 3.0}), "'u' is given by 3.0; give a function"),
    (lambda: L("s", 0.1, {"u": law}, start={"x": 1.0}), "no state named 'x'"),
    (lambda: L("s", 0.1, {"u": law}, resolution={"x": 1.0}), "no output or argument named 'x'"),
    (lambda: L("s", 0.1, {"u": law}, states={"u": law}), "'u' names two things"),
])  # fmt: skip
def test_bad_sampled_laws_are_errors_by_name(make: Any, message: str) -> None:
    with pytest.raises(ModelError, match=message):
        make()


@pytest.mark.parametrize(("more", "message"), [
    ({"outputs": {"motor.trque": law}}, "sets 'motor.trque'"),
    ({"outputs": {"rod.mass": law}}, "which bodies are made of"),
    ({"outputs": {"u": law}, "restart_on": "foot"}, "no contact, event or mode named 'foot'"),
])  # fmt: skip
def test_bad_names_of_sampled_laws_are_errors_at_build(more: Any, message: str) -> None:
    model, _ = arm()
    model.apply(L(**{"name": "s", "period": 0.1, "arguments": ("hinge.angle", "hinge.rate", "PID.sum"), **more}))
    with pytest.raises(ModelError, match=message):
        mbd.assemble(model, {"hinge.angle": 0.2})


def test_an_output_with_the_name_of_an_element_is_a_fault():
    """It would be a quantity of its own, and the motor would do nothing."""
    model = mbd.Model("arm")
    hinge = mbd.Revolute("hinge", model.ground.origin, mbd.Link("rod", mass=2.0, length=0.4, center=0.2).start)
    model.connect(hinge)
    law = mbd.SampledLaw("PD", period=0.01, outputs={"motor": lambda q: -q}, arguments=["hinge.angle"])
    model.apply(mbd.Motor("motor", hinge, torque=0.0), law)
    assert "name a parameter, 'motor.torque'" in model.check()[0]


@pytest.mark.parametrize(("period", "delay"), [(0.02, 0.005), (0.01, 0.0), (0.013, 0.006)])
def test_the_energy_ledger_closes_though_each_step_ends_at_a_sample(period: float, delay: float) -> None:
    """A stiff drive beside a sampled one: its work is integrated within steps that have a switch on either side."""
    model, rod = mbd.Model("arm"), mbd.Link("rod", mass=2.0, length=0.4, center=0.2, inertia=0.03)
    hinge = mbd.Revolute("hinge", model.ground.origin, rod.start)
    model.connect(hinge)
    law = {"held.torque": lambda q, v: -2.0 * (q - 1.0) - 0.2 * v}
    model.apply(
        mbd.Motor("spring", hinge, lambda q, v: -40.0 * (q - 0.5) - 1.5 * v, arguments=["hinge.angle", "hinge.rate"]),
        mbd.Motor("held", hinge, torque=0.0),
        mbd.SampledLaw("PD", period, law, arguments=["hinge.angle", "hinge.rate"], delay=delay),
    )
    run = mbd.simulate(model, mbd.assemble(model, {"hinge.angle": 0.0}), mbd.RungeKutta853(), dt=0.01, until=1.0)
    assert abs(run.energy.sums["numerical"]) < 1e-10


@pytest.mark.parametrize("law_first", [True, False])
def test_what_falls_on_one_instant_follows_the_order_of_the_model_however_its_sum_is_rounded(law_first: bool) -> None:
    """17 periods of 0.05 s and 0.35 s + 0.15 s + 0.35 s are one instant, also for controllers and at the end."""
    model, _ = arm()
    model = model.without("PID")
    seen = list[tuple[float, float, float]]()

    def note(t: float, values: Any, state: Any) -> None:
        seen.append((t, values["inner.seen"], values["phase"]))

    words = [
        mbd.SampledLaw("outer", 0.05, {"u": lambda phase: phase}, arguments=["phase"]),
        mbd.Mode("phase", ("a", "b"), transitions=[
            mbd.Transition("a", "b", after=0.35), mbd.Transition("b", "a", after=0.15),
        ]),
    ]  # fmt: skip
    inner = mbd.SampledLaw("inner", 0.01, {"seen": lambda u, t: u + 0.0 * t}, arguments=["outer.u", "t"])
    model.apply(*words[:: 1 if law_first else -1], inner)
    model.apply(mbd.Controller("note", note, period=0.05, reads=("inner.seen", "phase"), writes=("motor.torque",)))
    run = mbd.simulate(model, mbd.assemble(model), mbd.RungeKutta853(), dt=0.05, until=10.0)
    turns = [event.time for event in run.events if event.name.startswith("phase")]
    assert len(turns) == 40
    at_turns = [(heard, phase) for t, heard, phase in seen if min(abs(t - turn) for turn in turns) < 1e-9]
    at_turns.append((run["inner.seen"][-1], run["phase.index"][-1]))
    assert [heard == phase for heard, phase in at_turns] == [not law_first] * len(at_turns)


@pytest.mark.parametrize("outer_first", [True, False])
def test_cascades_are_an_integration_beside_them_and_have_its_derivatives(outer_first: bool) -> None:
    """A slow law gives a fast one what it follows, also in the first sample; samples of both fall on one instant."""

    def end(angle: float) -> list[float]:
        y, follows = np.array([angle, 0.0]), 0.0
        for k in range(60):
            new = 0.5 * y[0] if k % 5 == 0 else follows
            torque = -3.0 * (y[0] - (new if outer_first else follows)) - 0.1 * y[1]
            follows = new

            def rates(t: float, y: Any, torque: float = torque) -> list[float]:
                return [y[1], (torque - 2.0 * 9.81 * 0.2 * np.sin(y[0])) / INERTIA]

            y = solve_ivp(rates, (0.0, 0.01), y, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
        return list(y)

    model, _ = arm()
    model = model.without("PID")
    laws = [
        mbd.SampledLaw("outer", 0.05, {"u": lambda q: 0.5 * q}, arguments=["hinge.angle"]),
        mbd.SampledLaw("inner", 0.01, {"motor.torque": lambda u, q, v: -3.0 * (q - u) - 0.1 * v},
                       arguments=["outer.u", "hinge.angle", "hinge.rate"]),
    ]  # fmt: skip
    model.apply(*laws[:: 1 if outer_first else -1])
    start, of = mbd.assemble(model, {"hinge.angle": 0.9}), ["hinge.angle", "hinge.rate"]
    scheme = {"dt": 0.01, "until": 0.6}
    found = mbd.sensitivities(model, start, mbd.RungeKutta853(), wrt=["hinge.angle"], of=of, **scheme)
    np.testing.assert_allclose([found.run.final[name] for name in of], end(0.9), rtol=1e-9)
    slope = (np.array(end(0.9 + 1e-5)) - np.array(end(0.9 - 1e-5))) / 2e-5
    np.testing.assert_allclose([found[name, "hinge.angle"] for name in of], slope, rtol=1e-7)
    with pytest.raises(mbd.CapabilityError, match="with no time between"):
        mbd.sensitivities(model, start, mbd.RungeKutta853(), wrt=["outer.period"], of=of, **scheme)


@pytest.mark.parametrize("waits", ["angle", "number"])
def test_timers_that_wait_for_what_they_remember_move_with_it(waits: str) -> None:
    """Two timers fall on one instant by chance: one waits 0.2 s, the other 0.2 s as stored from the motion or not."""
    model, _ = arm()
    model = model.without("PID")
    ways = [mbd.Transition("wait", "push", after=0.2)], [mbd.Transition("wait", "push", after="second.for")]
    stored: dict[str, Any] = {"remembers": {"for": "hinge.angle"}} if waits == "angle" else {"numbers": {"for": 0.2}}
    model.apply(mbd.Mode("first", ("wait", "push"), transitions=ways[0]),
                mbd.Mode("second", ("wait", "push"), transitions=ways[1], **stored),
                mbd.Motor("push", model.joints[0], torque={"push": lambda: 0.4}, by="second",
                          arguments=[]))  # fmt: skip
    start, of = mbd.assemble(model, {"hinge.angle": 0.2}), ["hinge.angle"]
    scheme: dict[str, Any] = {"dt": 0.01, "until": 0.5, "of": of}
    of_angle = lambda: mbd.sensitivities(model, start, mbd.RungeKutta853(), wrt=["hinge.angle"], **scheme)  # noqa: E731
    if waits == "angle":
        with pytest.raises(mbd.CapabilityError, match="with no time between"):
            of_angle()
        return
    ends = [mbd.simulate(model, mbd.assemble(model, {"hinge.angle": 0.2 + h}), mbd.RungeKutta853(), dt=0.01,
                         until=0.5).final["hinge.angle"] for h in (-1e-5, 1e-5)]  # fmt: skip
    np.testing.assert_allclose(of_angle()["hinge.angle", "hinge.angle"], (ends[1] - ends[0]) / 2e-5, rtol=1e-7)
