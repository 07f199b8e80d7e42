"""Linear equations with names: sampled, in other libraries, old names, and what is refused."""

import sys
import types

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.linalg import expm

import mbd
from tests.cases.linkages import parallel_cranks
from tests.cases.small_motions import PLAIN, four_bar, on_spring, pendulums


def driven(inputs="drive.torque", outputs=("second.end.x", "second pin.angle.acceleration")):
    """A double pendulum with a motor at its upper hinge."""
    model = pendulums([1.0, 0.6], [0.5, 0.4], loss=mbd.Viscous(0.1))
    model.apply(mbd.Motor("drive", model.joints[0], torque=0.0))
    return mbd.linearize(model, mbd.assemble(model, backend=PLAIN), backend=PLAIN, inputs=inputs, outputs=outputs)


def test_states_are_the_outputs_where_none_are_asked_for():
    found = driven(outputs=None)
    assert found.outputs == found.states and found.inputs == ("drive.torque",)
    assert pytest.approx(np.eye(4)) == found.C and not np.any(found.D)
    assert found.state_space.output_units == found.state_space.state_units == ("rad", "rad", "rad/s", "rad/s")
    assert found.state_space.input_units == ("N m",)
    assert np.sort_complex(found.state_space.poles) == pytest.approx(np.sort_complex(found.eigenvalues))


@given(st.floats(1e-3, 0.5))
@settings(max_examples=10)
def test_sampled_equations_are_the_exact_motion_under_held_inputs(dt):
    """A and B by one exponential of [A B; 0 0]; the same poles exp(s dt)."""
    found = driven()
    sampled = found.discrete(dt)
    whole = expm(np.block([[found.A, found.B], [np.zeros((1, 5))]]) * dt)
    assert sampled.dt == dt and sampled.states == found.states
    assert np.hstack([sampled.A, sampled.B]) == pytest.approx(whole[:4], rel=1e-9, abs=1e-12)
    assert pytest.approx(found.C) == sampled.C and pytest.approx(found.D) == sampled.D
    assert np.sort_complex(sampled.poles) == pytest.approx(np.sort_complex(np.exp(found.eigenvalues * dt)), rel=1e-6)
    assert sampled.is_stable and found.state_space.is_stable


@given(st.lists(st.floats(0.5, 2.0), min_size=1, max_size=3), st.sampled_from([0.0, 1e-7, 1e-2]))
@settings(max_examples=25)
def test_what_nothing_damps_is_not_stable_by_round_off(masses, damping):
    """Real parts of its poles are round-off of either sign; a little damping is none."""
    model = pendulums(masses, [0.4] * len(masses), loss=mbd.Viscous(damping) if damping else None)
    model.apply(mbd.Motor("drive", model.joints[0], torque=0.0))
    state = mbd.assemble(model, backend=PLAIN)
    found = mbd.linearize(model, state, backend=PLAIN, inputs=["drive.torque"])
    assert found.state_space.is_stable == found.discrete(0.1).is_stable == (damping > 0.0)


@pytest.mark.parametrize("method", ["zoh", "bilinear", "euler", "backward_diff", "foh", "impulse"])
def test_slow_motions_are_the_same_sampled_or_not(method):
    found, w = driven(outputs=["second.end.x"]), np.array([0.5, 2.0])
    sampled = found.discrete(1e-4, method).frequency_response(w)
    assert sampled == pytest.approx(found.frequency_response(w), rel=2e-3)


def test_scipy_has_the_same_equations():
    from scipy.signal import step

    found = driven(outputs="second.end.x")
    times, response = step(found.to_scipy(), T=np.linspace(0.0, 2.0, 41))
    sampled, x = found.discrete(times[1]), np.zeros(4)
    for value in response:
        assert (sampled.C @ x + sampled.D[:, 0])[0] == pytest.approx(value, abs=1e-9)
        x = sampled.A @ x + sampled.B[:, 0]
    assert found.discrete(0.01).to_scipy().dt == 0.01


def test_control_gets_the_names(monkeypatch):
    made = types.SimpleNamespace(ss=lambda *matrices, **names: (matrices, names))
    monkeypatch.setitem(sys.modules, "control", made)
    matrices, names = driven().to_control()
    assert names["inputs"] == ["drive_torque"] and names["outputs"][0] == "second_end_x"
    assert matrices[4] == 0 and driven().discrete(0.1).to_control()[0][4] == 0.1
    monkeypatch.setitem(sys.modules, "control", None)
    with pytest.raises(ModuleNotFoundError, match=r"needs control.*mbd\[control\]"):
        driven().to_control()


def test_feedback_closes_the_loop():
    """Of all states it places poles; of accelerations, which follow torques at once, it is a changed inertia."""
    from scipy.signal import place_poles

    found, wanted = driven(outputs=None), np.array([-2.0, -3.0, -4.0, -5.0])
    gain = place_poles(found.A, found.B, wanted).gain_matrix
    assert np.sort(found.state_space.feedback(gain).poles.real) == pytest.approx(np.sort(wanted), rel=1e-6)
    model = on_spring()
    model.apply(mbd.Motor("drive", model.joints[0], torque=0.0))
    state = mbd.assemble(model, backend=PLAIN)
    slider = mbd.linearize(model, state, backend=PLAIN, inputs="drive.torque", outputs="rail.acceleration")
    closed = slider.state_space.feedback([[3.0]])  # 2 a + 40 x = −3 a
    assert slider.state_space.input_units == ("N",)
    assert np.sort(closed.poles.imag) == pytest.approx([-np.sqrt(8.0), np.sqrt(8.0)])
    with pytest.raises(mbd.ModelError, match="1 \\+ D K is singular"):
        slider.state_space.feedback([[-2.0]])
    with pytest.raises(mbd.ModelError, match=r"shape \(1, 4\)"):
        found.state_space.feedback([1.0, 2.0])


def test_a_table_names_everything():
    text = repr(driven().state_space)
    for word in "second pin.angle.rate [rad/s]", "drive.torque [N m]", "d/dt first pin.angle", "second.end.x":
        assert word in text
    assert "4 states, 1 input, 2 outputs, continuous" in text
    assert "first pin.angle⁺" in repr(driven().discrete(0.1)) and "every 0.1 s" in repr(driven().discrete(0.1))
    assert "inputs: drive.torque" in str(driven()) and "outputs: second.end.x" in str(driven())


def test_old_names_warn_and_give_what_they_gave():
    model = four_bar()
    found = mbd.linearize(model, mbd.assemble(model, position={"a.angle": 0.4}, backend=PLAIN), backend=PLAIN)
    with pytest.warns(mbd.MbdWarning, match="B is now called constraint_jacobian"):
        assert found.B is found.constraint_jacobian
    with pytest.warns(mbd.MbdWarning, match="C is now called damping_matrix"):
        assert found.C is found.damping_matrix
    assert found.M is found.mass_matrix and found.K is found.stiffness_matrix


# refusals ---------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("inputs", "outputs", "told"),
    [
        ("drive.torqe", None, "no input named 'drive.torqe'; did you mean 'drive.torque'"),
        ("drive", None, "no input named 'drive'; it has 'drive.torque'"),
        (["drive.torque", "drive.torque"], None, "'drive.torque' is given twice in inputs"),
        (3, None, "inputs must be a name or several"),
        ("drive.torque.acceleration", None, "acts by its value; ask for the input 'drive.torque'"),
        (None, "first pin.angel", "no result named 'first pin.angel'; did you mean 'first pin.angle'"),
        (None, ["second.end", "second.end.x"], "'second.end.x' is given twice in outputs"),
        (None, [1], "outputs must be a name or several"),
    ],
)
def test_names_that_cannot_be_meant_are_refused(inputs, outputs, told):
    with pytest.raises(mbd.ModelError, match=told):
        driven(inputs, outputs)


def test_parts_of_the_mechanism_in_rows_are_no_inputs():
    model = four_bar("all")
    state = mbd.assemble(model, position={"a.angle": 0.4}, backend=PLAIN)
    with pytest.raises(mbd.ModelError, match="'coupler.length' is a part of the mechanism"):
        mbd.linearize(model, state, backend=PLAIN, inputs=["coupler.length"])


def test_a_motion_that_rows_hold_twice_is_no_input():
    model = pendulums([1.0], [0.5])
    for name in "drive", "lock":
        model.constrain(mbd.Bilateral(name, model.joints[0], 0.3))
    state = mbd.assemble(model, backend=PLAIN)
    with pytest.raises(mbd.ModelError, match=r"the rows leave 'drive.value'.* no freedom: .*'(drive|lock)'"):
        mbd.linearize(model, state, backend=PLAIN, inputs="drive.value.acceleration")


def test_loads_that_redundant_rows_share_are_no_outputs():
    """Three cranks carry a coupler: how they share its weight is open, where it goes is not."""
    model = parallel_cranks(3)
    model.apply(mbd.Motor("drive", model.joints[0], torque=0.0))
    state = mbd.assemble(model, backend=PLAIN)

    def look(outputs):
        return mbd.linearize(model, state, backend=PLAIN, inputs="drive.torque", outputs=outputs)

    assert pytest.approx(0.0) == look([model.joints[0].coordinate_names[0]]).D
    with pytest.raises(mbd.ModelError, match=r"'pin 1.reaction_force.\w'.*redundant rows .* share their load"):
        look(["pin 1.reaction_force"])


def test_an_input_that_does_nothing_is_told():
    model = pendulums([1.0], [0.5])
    model.apply(mbd.Applied("push", model.joints[0].child, force=(1.0, 0.0, 0.0)))
    state = mbd.assemble(model, backend=PLAIN)
    with pytest.warns(mbd.MbdWarning, match="'push.force.y': nothing depends on it at this state") as told:
        found = mbd.linearize(model, state, backend=PLAIN, inputs="push.force.y")
    assert told[0].filename == __file__
    assert not np.any(found.B) and found.inputs == ("push.force.y",)


def test_what_cannot_be_sampled_is_refused():
    with pytest.raises(mbd.ModelError, match="dt must be a time between samples > 0"):
        driven().discrete(-1.0)
    with pytest.raises(mbd.ModelError, match="method must be one of 'zoh'"):
        driven().discrete(0.1, "exact")
    with pytest.raises(mbd.ModelError, match="sampled already, every 0.1 s"):
        driven().discrete(0.1).discrete(0.1)
    with pytest.raises(mbd.ModelError, match="to_scipy needs equations with inputs"):
        driven(None).to_scipy()
    with pytest.raises(mbd.ModelError, match="which is a pole"):
        mbd.StateSpace(*(np.zeros((1, 1)),) * 4, ("x",), ("u",), ("y",)).transfer(0.0)


def test_changes_from_a_motion_that_goes_on_are_told():
    model = pendulums([1.0], [0.5])
    model.apply(mbd.Motor("drive", model.joints[0], torque=0.0))
    state = mbd.assemble(model, position={"first pin.angle": 0.4}, backend=PLAIN)
    linear = mbd.linearize(model, state, backend=PLAIN, inputs="drive.torque")
    with pytest.warns(mbd.MbdWarning, match="not in equilibrium at t = 0 s: .* changes from a motion that goes on"):
        linear.discrete(0.1)


def test_derivatives_that_are_no_numbers_are_named():
    model = pendulums([1.0], [0.5])
    model.observe("root", lambda angle: mbd.sqrt(angle), "first pin.angle")
    state = mbd.assemble(model, backend=PLAIN)
    with pytest.raises(mbd.ModelError, match="the output 'root' has no finite value or derivative"):
        mbd.linearize(model, state, backend=PLAIN, outputs="root")
    odd = mbd.Motor("odd", model.joints[0], torque=lambda angle: mbd.sqrt(abs(angle)), arguments=["first pin.angle"])
    model.apply(odd)
    with pytest.raises(mbd.ModelError, match="no finite derivative by 'first pin.angle'"):
        mbd.linearize(model, state, backend=PLAIN)


@pytest.mark.parametrize("period", [0.02, 0.1])
def test_a_controller_moves_a_run_as_the_sampled_closed_loop_says(period):
    """x⁺ = (A − B K) x from sample to sample; what is left is of third order in the disturbance, as forces are odd."""
    model = pendulums([1.0, 0.6], [0.5, 0.4])
    model.apply(mbd.Motor("drive", model.joints[0], torque=0.0))
    state = mbd.assemble(model, backend=PLAIN)
    linear = mbd.linearize(model, state, backend=PLAIN, inputs="drive.torque")
    gain = np.array([[0.8, -0.3, 0.4, 0.1]])
    loop = linear.discrete(period).feedback(gain)

    def update(t, values, memory):
        return {"drive.torque": -float(gain[0] @ [values[name] for name in linear.states])}

    model.apply(mbd.Controller("loop", update, period=period, reads=linear.states, writes=["drive.torque"]))
    left, times = [], np.arange(round(0.6 / period) + 1) * period
    for size in (0.08, 0.04):
        start = mbd.assemble(model, position={"first pin.angle": size}, backend=PLAIN)
        run = mbd.simulate(model, start, mbd.RungeKutta853(), tol=1e-9, until=0.6 + period)
        seen = np.column_stack([run.at(times)[name] for name in linear.states])
        wanted = [seen[0]]
        for _ in times[1:]:
            wanted.append(loop.A @ wanted[-1])
        left.append(np.max(np.abs(seen - wanted)))
        assert left[-1] < 0.02 * np.max(np.abs(seen))
    assert left[0] / left[1] == pytest.approx(8.0, rel=0.2)
