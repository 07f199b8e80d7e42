"""The order of accuracy that each scheme promises is the one observed, with multipliers, in every formulation."""

import functools

import numpy as np
import pytest

import mbd
from mbd.compile.mechanisms import mechanism_of
from mbd.kernel.contact.active_set import ActiveSetManager
from mbd.simulation.run.stepper import Stepper

T = 0.5
"""Length of every run [s]."""
STEPS = (64, 128, 256, 512, 1024)
"""Steps in T: four halvings."""


def double_pendulum(cut="auto"):
    model = mbd.Model("double pendulum", cut=cut)
    rods = [mbd.Link(name, mass=1.0, length=1.0, center=0.5, inertia=0.1) for name in ("upper", "lower")]
    model.connect(mbd.Revolute("u", model.ground.origin, rods[0].start), mbd.Revolute("w", rods[0].end, rods[1].start))
    return model


def duffing():
    """A point on a stiffening spring: its mass is constant."""
    model = mbd.Model("oscillator", gravity=(0, 0, 0))
    body = mbd.PointMass("body", mass=1.0)
    model.connect(mbd.Translation("place", model.ground.origin, body.origin))
    model.apply(mbd.Potential("spring", lambda x, y: 20.0 * (x * x + y * y) + 30.0 * (x * x + 2.0 * y * y) ** 2,
                              arguments=("place.x", "place.y")))  # fmt: skip
    return model


SCENES = {
    "double pendulum": (
        double_pendulum, {"u.angle": 1.0, "w.angle": 0.5}, {"u.angle": 1.0, "w.angle": -2.0},
    ),
    "double pendulum in absolute coordinates": (
        lambda: double_pendulum("all"), {"upper floating.angle": 1.0, "lower floating.angle": 1.5},
        {"upper floating.angle": 1.0, "lower floating.angle": -1.0},
    ),
    "duffing": (duffing, {"place.x": 0.4, "place.y": 0.1}, {"place.x": 0.0, "place.y": 1.5}),
}  # fmt: skip


@functools.cache
def started(scene):
    make, position, velocity = SCENES[scene]
    model = make()
    return model, mbd.assemble(model, position, velocity)


@functools.cache
def reference(scene):
    model, start = started(scene)
    return mbd.simulate(model, start, mbd.GeneralizedAlpha(0.9), dt=T / 16384, until=T).record


def errors(scene, scheme):
    """Largest error at the end and over all rows after the start, of q, v, a, λ, for each number of steps."""
    model, start = started(scene)
    exact = reference(scene)
    table: dict[str, list[tuple[float, float]]] = {}
    for steps in STEPS:
        record = mbd.simulate(model, start, scheme, dt=T / steps, until=T).record
        every = (len(exact.time) - 1) // steps
        for part in ("q", "v", "a", "lam"):
            difference = np.abs(getattr(record, part) - getattr(exact, part)[::every])
            if difference.size:
                table.setdefault(part, []).append((difference[-1].max(), difference[1:].max()))
    return {part: np.array(rows) for part, rows in table.items()}


def observed(values):
    return np.log2(values[:-1] / values[1:])


TREE = [
    mbd.Newmark(), mbd.HHT(0.0), mbd.HHT(0.05), mbd.HHT(1 / 3), mbd.GeneralizedAlpha(1.0), mbd.GeneralizedAlpha(0.9),
    mbd.GeneralizedAlpha(0.5), mbd.HHT(0.3, start="consistent"), mbd.GeneralizedAlpha(0.5, start="consistent"),
]  # fmt: skip


@pytest.mark.parametrize("scheme", TREE, ids=repr)
def test_positions_velocities_and_accelerations_of_a_tree_are_of_second_order(scheme):
    assert scheme.order() == 2
    for part, values in errors("double pendulum", scheme).items():
        orders = observed(values[:, 1])
        assert np.all((orders > 1.85) & (orders < 2.15)), (part, orders)


STABILIZED = [mbd.Newmark(), mbd.HHT(0.1), mbd.GeneralizedAlpha(0.8), mbd.GeneralizedAlpha(1.0)]


@pytest.mark.parametrize("scheme", STABILIZED, ids=repr)
def test_multipliers_of_the_stabilized_form_are_of_second_order_from_the_first_step_on(scheme):
    for part, values in errors("double pendulum in absolute coordinates", scheme).items():
        orders = observed(values[:, 1])
        assert np.all((orders > 1.85) & (orders < 2.15)), (part, orders)


INDEX3 = [mbd.HHT(0.1, formulation="index3"), mbd.GeneralizedAlpha(0.8, formulation="index3")]


@pytest.mark.parametrize("scheme", INDEX3, ids=repr)
def test_index_3_is_of_second_order_once_its_start_has_died_away(scheme):
    table = errors("double pendulum in absolute coordinates", scheme)
    for part, values in table.items():
        orders = observed(values[1:, 0])
        assert np.all((orders > 1.85) & (orders < 2.15)), (part, orders)
    transient = observed(table["lam"][:, 1])
    assert np.all((transient > 0.8) & (transient < 1.2)), "its multipliers carry a first-order error at the start"


@pytest.mark.parametrize("scheme", [mbd.HHT(0.1, start="consistent"), mbd.GeneralizedAlpha(0.8, start="consistent")],
                         ids=repr)  # fmt: skip
def test_the_textbook_start_costs_the_multipliers_one_order_at_first(scheme):
    table = errors("double pendulum in absolute coordinates", scheme)
    jerk = errors("double pendulum in absolute coordinates", type(scheme)(next(iter(vars(scheme).values()))))
    assert np.all(observed(table["q"][:, 0]) > 1.85), "positions do not suffer"
    assert np.mean(observed(table["lam"][2:, 1])) < 1.2
    assert table["lam"][-1, 1] > 4.0 * jerk["lam"][-1, 1]


def test_newmark_with_gamma_above_one_half_is_of_first_order():
    scheme = mbd.Newmark(0.3025, 0.6)
    assert scheme.order() == 1
    table = errors("double pendulum", scheme)
    for part in ("v", "a"):
        assert observed(table[part][:, 1])[-1] == pytest.approx(1.0, abs=0.15)


@pytest.mark.slow
def test_the_averaged_form_is_of_first_order_because_it_does_not_average_the_mass():
    scheme = mbd.HHT(0.3, form="averaged")
    table = errors("double pendulum", scheme)
    for part in ("q", "v"):
        orders = observed(table[part][:, 1])
        assert np.all((orders > 0.8) & (orders < 1.2)), (part, orders)
    assert scheme.order(system_of("double pendulum", scheme)) == scheme.order() == 1


def test_the_averaged_form_is_of_second_order_where_the_mass_is_constant():
    scheme = mbd.HHT(0.3, form="averaged")
    table = errors("duffing", scheme)
    for part in ("q", "v"):
        orders = observed(table[part][:, 1])
        assert np.all((orders > 1.85) & (orders < 2.15)), (part, orders)
    assert scheme.order(system_of("duffing", scheme)) == 2


def system_of(scene, scheme):
    """The scene as numbers."""
    model, _start = started(scene)
    mechanism = mechanism_of(model)
    manager = ActiveSetManager(mechanism.equations)
    return Stepper(mechanism, manager, scheme, mechanism.parameters(), 1e-3, {"capacity": 8}).system


def energies(scheme, omega, steps):
    """Twice the energy of an undamped oscillator with ω dt = omega at every step."""
    model = mbd.Model("oscillator", gravity=(0, 0, 0))
    body = mbd.PointMass("body", mass=1.0)
    model.connect(mbd.Prismatic("slide", model.ground.origin, body.origin, stiffness=omega**2))
    start = mbd.assemble(model, {"slide.displacement": 1.0})
    trajectory = mbd.simulate(model, start, scheme, dt=1.0, until=float(steps))
    return trajectory["slide.rate"] ** 2 + (omega * trajectory["slide.displacement"]) ** 2


def amplification(scheme, omega, steps=60):
    """Growth of the energy norm per step."""
    energy, third = energies(scheme, omega, steps), steps // 3
    return (energy[-third:].max() / energy[-2 * third : -third].max()) ** (0.5 / third)


def forces_of_a_driven_table(scheme, steps):
    """Largest error of the force under a block that is pressed by 3 sin 5t on a table that moves by 0.05 sin 5t [N]."""
    model = mbd.Model("press", gravity=(0.0, -9.81, 0.0))
    block, table = mbd.PointMass("block", mass=1.0), mbd.PointMass("table", mass=1.0)
    lift = mbd.Prismatic("lift", model.ground.origin, table.origin, axis=(0.0, 1.0, 0.0))
    model.connect(lift, mbd.Translation("place", model.ground.origin, block.origin))
    top = mbd.Plane(normal=(0.0, 1.0, 0.0), frame=table.origin)
    model.constrain(mbd.Bilateral("drive", lift, value=lambda t: 0.05 * mbd.sin(5.0 * t)))
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(block.origin, top)))
    press = mbd.Applied("press", block.origin, lambda t: (0.0, -3.0 * mbd.sin(5.0 * t), 0.0), arguments=("t",))
    model.apply(press)
    start = mbd.assemble(model, velocity={"lift.displacement": 0.25}, closed="foot")
    run = mbd.simulate(model, start, scheme, dt=0.8 / steps, until=0.8)
    assert not run.events
    return np.abs(run["foot.force"] - 9.81 - 1.75 * np.sin(5.0 * run.time)).max()


@pytest.mark.parametrize("scheme", [mbd.HHT(0.05), mbd.HHT(0.3), mbd.GeneralizedAlpha(0.8), mbd.Newmark()], ids=repr)
def test_forces_of_driven_contacts_are_those_of_their_row(scheme):
    """A force of an instant within the step would lag by a part of dt: order 1."""
    errors = [forces_of_a_driven_table(scheme, steps) for steps in (40, 80)]
    assert errors[0] < 2e-3 and errors[0] / errors[1] > 3.5
