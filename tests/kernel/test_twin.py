"""Machine code and plain Python take the same steps, find the same events and give the same rows."""

import functools
import random
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.compile.mechanisms import mechanism_of
from mbd.forces.base import Action, Force
from mbd.kernel.contact.active_set import ActiveSetManager
from mbd.simulation.run.stepper import Stepper
from mbd.state import Mode
from mbd.testing.mechanisms import random_body, random_frame
from tests.comparisons import at_least, compared
from tests.equations.mechanisms import furnished, random_tree
from tests.joints.quaternion_ball import CayleyBall, QuaternionBall
from tests.simulation.mechanisms import ball, box, falling, kneed_walker, kneed_walker_start, pendulum, run

TIGHT = 1e-13
"""Newton's tolerance: both forms iterate to round-off."""

SCHEMES = {
    "newmark": mbd.Newmark(),
    "newmark with damping": mbd.Newmark(0.3025, 0.6, tolerance=TIGHT),
    "hht": mbd.HHT(0.05, tolerance=TIGHT),
    "generalized alpha": mbd.GeneralizedAlpha(0.8, tolerance=TIGHT),
    "undamped generalized alpha": mbd.GeneralizedAlpha(1.0),
    "hht index 3": mbd.HHT(0.05, formulation="index3", tolerance=TIGHT),
    "generalized alpha index 3": mbd.GeneralizedAlpha(0.5, formulation="index3", tolerance=TIGHT),
    "radau": mbd.RadauIIA(tolerance=TIGHT),
    "textbook start": mbd.HHT(0.1, start="consistent", tolerance=TIGHT),
    "runge-kutta 8(5,3)": mbd.RungeKutta853(),
}


@dataclass(frozen=True)
class Drive(Force):
    """A servo with a first-order lag: τ Ṫ = k (sin 3t − q) − T, torque T on a joint."""

    name: str
    joint: Any
    gain: float = 20.0
    lag: float = 0.05

    @property
    def kind(self):
        return "applied"

    def mentions(self):
        return [self.joint]

    def parameters(self):
        return {f"{self.name}.gain": self.gain}

    def act(self, scope):
        motion = scope.joint(self.joint.name)
        torque = scope.state(self.name, "torque", 0.5)
        error = mbd.sin(3.0 * scope.time) - motion.coordinates[0]
        gain = scope.parameter(self.name, "gain", self.gain)
        return Action(pairs=((motion.rates[0], torque),), rates=((torque, (gain * error - torque) / self.lag),))


def served_pendulum():
    """A pendulum whose torque lags behind its command."""
    model = pendulum(loss=mbd.Viscous(0.1))
    model.apply(Drive("drive", model.joints[0]))
    return model


def rubber_ball():
    """A ball on a rubber floor, released on pull."""
    model, body = falling()
    model.constrain(
        mbd.Penalty("floor", mbd.height(body.origin), stiffness=2e4, damping=30.0, exponent=1.5, release="pull")
    )
    return model


def walk(scheme, backend, dt):
    walker = kneed_walker()
    start = kneed_walker_start(walker, backend=backend)
    return mbd.simulate(walker, start, scheme, dt=dt, until=0.7, backend=backend)


SCENES = {
    "walker": lambda scheme, backend: walk(scheme, backend, 4e-3),
    "bouncing ball": lambda scheme, backend: run(
        ball(restitution=0.6), {"fall.displacement": 1.0}, integrator=scheme, backend=backend, until=1.0
    ),
    "tumbling box": lambda scheme, backend: run(
        box(), {"place.y": 0.6, "place.angle": 0.3}, {"place.angle": 0.5, "place.x": 0.2},
        integrator=scheme, backend=backend, dt=5e-3, until=0.6,
    ),
    "ball on rubber": lambda scheme, backend: run(
        rubber_ball(), {"fall.displacement": 0.2}, integrator=scheme, backend=backend, dt=2e-3, until=0.4
    ),
    "lagging servo": lambda scheme, backend: run(
        served_pendulum(), {"hinge.angle": 0.3}, integrator=scheme, backend=backend, dt=5e-3, until=0.5
    ),
}  # fmt: skip


@pytest.mark.covering
@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("scheme", SCHEMES)
def test_both_paths_find_the_same_events_and_rows(scene, scheme):
    integrator = SCHEMES[scheme]
    fast, plain = (SCENES[scene](integrator, backend) for backend in ("auto", "python"))
    assert fast.stats["compiled"] and not plain.stats["compiled"]
    assert [(e.name, e.kind) for e in fast.events] == [(e.name, e.kind) for e in plain.events]
    np.testing.assert_allclose([e.time for e in fast.events], [e.time for e in plain.events], rtol=0, atol=1e-10)
    for a, b in zip(fast.events, plain.events, strict=True):
        np.testing.assert_allclose(a.impulse, b.impulse, rtol=0, atol=1e-9)
        assert a.row == b.row and a.energy_loss == pytest.approx(b.energy_loss, abs=1e-9)
    one, two = fast.record, plain.record
    for part, bound in (("time", 1e-10), ("q", 1e-10), ("v", 1e-9), ("z", 1e-10), ("a", 1e-6), ("lam", 1e-6)):
        scale = max(1.0, float(np.max(np.abs(getattr(two, part)), initial=0.0)))
        np.testing.assert_allclose(
            getattr(one, part), getattr(two, part), rtol=0, atol=bound * scale, err_msg=f"{scene}, {scheme}: {part}"
        )
    np.testing.assert_array_equal(one.closed, two.closed)


def test_the_interpreted_kernel_on_machine_code_equals_the_compiled_one():
    """The same switching code, the same model code: only the scheme's step differs in form."""

    class Interpreted(mbd.HHT):
        """HHT that is not the compiled one."""

        def step(self, system, state, dt, mode, memory):
            return super().step(system, state, dt, mode, memory)

    fast = walk(mbd.HHT(0.05, tolerance=TIGHT), "auto", 4e-3)
    own = walk(Interpreted(0.05, tolerance=TIGHT), "auto", 4e-3)
    assert fast.stats["compiled"] and not own.stats["compiled"]
    np.testing.assert_allclose(own.record.q, fast.record.q, rtol=0, atol=1e-10)
    assert [(e.name, e.kind) for e in own.events] == [(e.name, e.kind) for e in fast.events]


# single steps -------------------------------------------------------------------------------------------------------
@functools.cache
def random_mechanism(seed, spatial, loops):
    """A small mechanism with a spring, a damper, forces, and rows if it has loops."""
    model = random_tree(seed, 3, spatial, most=4)
    model = furnished(model, seed)
    if not loops:
        model.constraints = []
    return model


@at_least(4)
@settings(max_examples=10)
@given(seed=st.integers(0, 40), spatial=st.booleans(), loops=st.booleans(), scheme=st.sampled_from(sorted(SCHEMES)))
def test_integrator_advance_and_the_compiled_kernel_agree_on_random_mechanisms(seed, spatial, loops, scheme):
    integrator = SCHEMES[scheme]
    if loops and integrator.check(1):
        return
    model = random_mechanism(seed, spatial, loops)
    try:
        start = mbd.assemble(model)
    except mbd.AssemblyError:
        return
    dt, steps = 1e-3, 20
    fast = mbd.simulate(model, start, integrator, dt=dt, until=steps * dt, on_failure="return")
    if not fast.success:
        return
    compared()
    mechanism = mechanism_of(model)
    manager = ActiveSetManager(mechanism.equations)
    system = Stepper(mechanism, manager, integrator, mechanism.parameters(), dt, {"capacity": 8}).system
    memory = integrator.start(system, start, Mode(), dt)
    result = integrator.advance(system, start, dt, steps * dt, Mode(), memory)
    assert result.report.converged and result.steps == steps
    speed = 1.0 + np.abs(fast.record.v).max()
    rate = 1.0 + np.abs(fast.record.a).max()
    np.testing.assert_allclose(result.state.q, fast.record.q[-1], rtol=0, atol=1e-11 * speed * rate)
    np.testing.assert_allclose(result.state.v, fast.record.v[-1], rtol=0, atol=1e-10 * speed * rate)
    np.testing.assert_allclose(result.memory.rate, fast.record.a[-1], rtol=0, atol=1e-6 * rate)


@settings(max_examples=2)
@given(
    seed=st.integers(0, 1000),
    kind=st.sampled_from([QuaternionBall, CayleyBall]),
    scheme=st.sampled_from([mbd.HHT(0.05, tolerance=1e-12), mbd.GeneralizedAlpha(0.8, tolerance=1e-12)]),
)
def test_twins_estimate_the_same_errors_where_coordinates_do_not_add(seed, kind, scheme):
    """A body on a ball joint, n_q = n_v + 1, and another on that: what ẋ = v leaves counts on both paths."""
    rng, model = random.Random(seed), mbd.Model("chain")
    upper, lower = random_body(rng, "upper", True), random_body(rng, "lower", True)
    model.connect(
        kind("ball", model.ground.origin, random_frame(rng, upper, True, 0.3)),
        mbd.Revolute("pin", random_frame(rng, upper, True, 0.3), random_frame(rng, lower, True, 0.3)),
    )
    names = [name for joint in model.joints for name in joint.velocity_names]
    start = mbd.assemble(model, velocity={name: rng.uniform(-2.0, 2.0) for name in names})
    one, two = (mbd.simulate(model, start, scheme, tol=1e-3, until=0.04, backend=each) for each in ("llvm", "python"))
    np.testing.assert_allclose(one.time, two.time, rtol=1e-10)
    assert one.stats["local_errors"] == pytest.approx(two.stats["local_errors"], rel=1e-8)
