"""Random machines: machine code and plain Python agree, and each state's law is what acts in it."""

from dataclasses import replace

import numpy as np
import pytest

import mbd


def scene(seed: int) -> tuple[mbd.Model, mbd.State]:
    """A chain over a floor with two modes of random transitions, and drives by state."""
    random = np.random.default_rng(seed)
    model, place, joints = mbd.Model(f"random {seed}"), None, list[mbd.Revolute]()
    for k in range(int(random.integers(1, 4))):
        link = mbd.Link(f"link {k}", mass=random.uniform(0.5, 2.0), length=0.4, center=random.uniform(0.1, 0.3),
                        inertia=random.uniform(0.01, 0.05))  # fmt: skip
        joints.append(mbd.Revolute(f"joint {k}", place or model.ground.origin, link.start, loss=mbd.Viscous(0.05)))
        place = link.end
    model.connect(*joints)
    model.constrain(mbd.Unilateral("floor", mbd.touchdown(link.end, ground=lambda x: -0.3 * len(joints)), friction=0))
    for which in ("one", "two"):
        states = [f"s{k}" for k in range(int(random.integers(2, 5)))]
        other = "two" if which == "one" else "one"
        transitions = []
        for k, state in enumerate(states):
            joint = joints[int(random.integers(len(joints)))].name
            causes = [
                {"after": float(random.uniform(0.02, 0.3))},
                {"when": f"{joint}.rate", "direction": int(random.integers(-1, 2))},
                {"on": "floor"},
                {"when": mbd.measure(lambda q, a: q - a, f"{joint}.angle", f"{which}.angle")},
                {"after": float(random.uniform(0.1, 0.4)), "only_while": f"{other}: s0"},
            ]
            target = states[(k + 1) % len(states)]
            for cause in random.choice(len(causes), size=2, replace=False):
                transitions.append(mbd.Transition(state, target, **causes[cause]))
        if which == "two":
            transitions.append(mbd.Transition(states[0], states[1], on="one"))
        model.constrain(
            mbd.Mode(which, states, transitions=transitions, remembers={"angle": f"{joints[0].name}.angle"})
        )
        pushes = {state: float(random.uniform(-2.0, 2.0)) for state in states[1:]}
        joint = joints[int(random.integers(len(joints)))]
        model.apply(mbd.Motor(f"{which} drive", joint, torque=pushes, by=which))
    angles = {joint.name + ".angle": float(random.uniform(-0.3, 0.3)) for joint in joints}
    angles["joint 0.angle"] += 1.3
    return model, mbd.assemble(model, angles)


@pytest.mark.parametrize("seed", range(4))
def test_machine_code_and_plain_python_take_the_same_transitions(seed: int) -> None:
    model, start = scene(seed)
    scheme = (mbd.RungeKutta853(), mbd.HHT(), mbd.RadauIIA())[seed % 3]
    runs = [
        mbd.simulate(model, start, scheme, dt=0.01, until=0.6, backend=backend, on_failure="return")
        for backend in ("auto", "python")
    ]
    one, other = runs
    assert one.success, one.message
    assert [event.name for event in one.events] == [event.name for event in other.events]
    np.testing.assert_allclose([event.time for event in one.events], [event.time for event in other.events], atol=1e-12)
    for name in ("q", "v", "anchors"):
        np.testing.assert_allclose(getattr(one.final, name), getattr(other.final, name), rtol=1e-9, atol=1e-11)
    # what results tell of modes at every row is what the kernel held at the end, and laws follow it
    for which in ("one", "two"):
        held = one.final.anchors[_anchor(one, which, "angle")]
        np.testing.assert_allclose(one[f"{which}.angle"][-1], held, rtol=1e-14)
        torque = one[f"{which} drive.torque"]
        for state in np.unique(one[which]):
            pushes = {name.rpartition(".")[2]: value for name, value in one.parameters.items()
                      if name.startswith(f"{which} drive.torque.")}  # fmt: skip
            np.testing.assert_array_equal(torque[one[which] == state], pushes.get(state, 0.0))
    assert np.all(np.diff(one.time) >= 0.0)


@pytest.mark.parametrize("seed", range(6))
def test_modes_begin_with_a_start_that_was_replaced_and_hold_no_instant_after_one(seed: int) -> None:
    model, start = scene(seed)
    angles = {name: float(q) + 0.1 for name, q in zip(start.names, start.q, strict=True)}
    wanted, moved = (
        mbd.simulate(model, begun, mbd.RungeKutta853(), dt=0.01, until=begun.time + 0.5)
        for begun in (mbd.assemble(model, angles), replace(start, time=-1.0, q=start.q + 0.1))
    )
    assert [event.name for event in moved.events] == [event.name for event in wanted.events]
    times = [event.time for event in moved.events]
    np.testing.assert_allclose(times, [event.time - 1.0 for event in wanted.events], atol=1e-9)
    for name in ("one.angle", "two.angle", "one.time", "two.time"):
        np.testing.assert_allclose(moved[name][0], wanted[name][0], atol=1e-15)
    for change in ({"time": -2.0}, {"time": 0.5 * min(moved["one.time"][-1], moved["two.time"][-1]) - 1.5}):
        with pytest.raises(mbd.ModelError, match="'(one|two).since' is at most .* anchors="):
            mbd.simulate(model, replace(moved.final, **change), dt=0.01, until=0.1)
        with pytest.raises(mbd.ModelError, match="'(one|two).since' is at most .* anchors="):
            mbd.batch(model, [replace(moved.final, **change)], dt=0.01, until=0.1, results=["joint 0.angle"])


def _anchor(run: mbd.Trajectory, mode: str, field: str) -> int:
    machine = next(each for each in run.record.equations.machines if each.name == mode)
    return machine.anchors[machine.fields.index(field)]
