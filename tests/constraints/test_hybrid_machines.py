"""Random machines with modes, timers, thresholds, memories, resets, samples and impulses, beside scipy's DOP853.

The other simulation shares no line with `mbd`: see `tests.hybrid_machines`.
"""

import math
from typing import Any

import numpy as np
import pytest

import mbd
from tests.hybrid_machines import HybridMachine

GRAVITY = 9.81
EXACT = [(mbd.RungeKutta853(), 5e-3, 1e-9), (mbd.RadauIIA(), 5e-3, 1e-6), (mbd.RungeKutta4(), 2.5e-3, 1e-5)]


def named(mode: str, states: list[str], changes: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The changes with the names that `mbd` gives them."""
    counts: dict[str, int] = {}
    for change in changes:
        title = f"{mode}: {states[change['source']]} to {states[change['target']]}"
        counts[title] = counts.get(title, 0) + 1
        change["name"] = title if counts[title] == 1 else f"{title} ({counts[title]})"
    return changes


def assert_same(machine, start, model, y0, names, until):
    """The same changes at the same instants, the same end by every scheme, and order 2 of HHT."""
    end = machine.run(y0, until)
    for scheme, dt, tolerance in EXACT:
        run = mbd.simulate(model, start, scheme, dt=dt, until=until)
        events = [event for event in run.events if event.kind != "pushed" and not event.name.startswith("PD")]
        assert [event.name for event in events] == [name for _, name in machine.log]
        times = [time for time, _ in machine.log]
        np.testing.assert_allclose([event.time for event in events], times, rtol=0.0, atol=tolerance)
        np.testing.assert_allclose([run.final[name] for name in names], end, rtol=tolerance, atol=tolerance)
    errors = []
    for dt in 1e-3, 2.5e-4:
        run = mbd.simulate(model, start, mbd.HHT(0.05), dt=dt, until=until)
        errors.append(max(abs(run.final[name] - x) for name, x in zip(names, end, strict=True)))
    assert errors[1] < max(errors[0] / 8.0, 1e-7)
    return len(machine.log)


def assert_continues(model, start, names, until, path):
    half = mbd.simulate(model, start, mbd.HHT(0.05), dt=1e-3, until=0.4 * until)
    loaded = mbd.load(half.save(path / "half"))
    ends = [
        mbd.simulate(model, state, mbd.HHT(0.05), dt=1e-3, until=until).final for state in (half.final, loaded.final)
    ]
    for name in names:
        assert ends[0][name] == ends[1][name]


def pendulum(seed: int):
    """Two links with two modes, a motor by state in each joint, an event that turns a rate around, a sampled law."""
    random = np.random.default_rng(seed)
    m1, m2 = map(float, random.uniform(0.5, 2.0, 2))
    length, c1, c2 = (float(random.uniform(*each)) for each in ((0.3, 0.5), (0.1, 0.25), (0.1, 0.25)))
    I1, I2, loss = (float(random.uniform(*each)) for each in ((0.01, 0.05), (0.01, 0.05), (0.02, 0.1)))
    counts = {"one": int(random.integers(2, 5)), "two": int(random.integers(2, 4))}
    gains = {mode: random.uniform(-1.0, 1.0, size=(count, 3)).tolist() for mode, count in counts.items()}
    back, kicked = float(random.uniform(-0.9, -0.3)), float(random.uniform(-0.3, 0.3))
    period, stiffness = float(random.uniform(0.01, 0.04)), float(random.uniform(0.2, 1.0))
    delay = (0.0, 0.4 * period, 1.7 * period)[seed % 3]
    model = mbd.Model(f"two links {seed}")
    upper = mbd.Link("upper", mass=m1, length=length, center=c1, inertia=I1)
    lower = mbd.Link("lower", mass=m2, length=0.4, center=c2, inertia=I2)
    joints = (mbd.Revolute("j0", model.ground.origin, upper.start, loss=mbd.Viscous(loss)),
              mbd.Revolute("j1", upper.end, lower.start, loss=mbd.Viscous(loss)))  # fmt: skip
    model.connect(*joints)
    modes: dict[str, list[dict[str, Any]]] = {}
    for mode, count in counts.items():
        other, states = ("two" if mode == "one" else "one"), [f"s{k}" for k in range(count)]
        changes, words = [], []
        for k in range(count):
            j, limit, way = int(random.integers(2)), float(random.uniform(-0.6, 0.6)), int(random.integers(-1, 2))
            times = [float(each) for each in random.uniform(0.05, 0.4, 2)]
            choices = [
                ({"after": times[0]}, {"after": times[0]}),
                ({"when": lambda y, held, j=j: y[2 + j], "direction": way}, {"when": f"j{j}.rate", "direction": way}),
                ({"when": lambda y, held, j=j, limit=limit: y[j] - limit},
                 {"when": mbd.measure(lambda q, limit=limit: q - limit, f"j{j}.angle")}),
                ({"when": lambda y, held, j=j, mode=mode: y[j] - held.memory[mode][j] - 0.15},
                 {"when": mbd.measure(lambda q, m: q - m - 0.15, f"j{j}.angle", f"{mode}.m{j}")}),
                ({"after": times[1], "state": (other, 0)}, {"after": times[1], "only_while": f"{other}: s0"}),
            ]  # fmt: skip
            for choice in random.choice(len(choices), size=2, replace=False):
                changes.append({"source": k, "target": (k + 1) % count, **choices[choice][0]})
                words.append(mbd.Transition(states[k], states[(k + 1) % count], **choices[choice][1]))
        if mode == "two":
            changes.append({"source": 0, "target": 1, "on": ("enters", "one", 1)})
            words.append(mbd.Transition("s0", "s1", on="one: s1"))
        else:
            changes.append({"source": 1, "target": 0, "on": ("event", "kick")})
            words.append(mbd.Transition("s1", "s0", on="kick"))
        modes[mode] = named(mode, states, changes)
        model.constrain(mbd.Mode(mode, states, transitions=words, remembers={"m0": "j0.angle", "m1": "j1.angle"}))
    torque = {
        f"s{k}": lambda q, m, tau, a=a, b=b, c=c: -2.0 * abs(a) * (q - m) + b + c * tau
        for k, (a, b, c) in enumerate(gains["one"]) if k
    }  # fmt: skip
    model.apply(
        mbd.Motor("first", joints[0], torque=torque, by="one", arguments=["j0.angle", "one.m0", "one.time"]),
        mbd.Motor("second", joints[1], torque={f"s{k}": 0.5 * g[1] for k, g in enumerate(gains["two"]) if k}, by="two"),
        mbd.Motor("third", joints[1], torque=0.0),
        mbd.SampledLaw("PD", period, {"third.torque": lambda q, v: -stiffness * q - 0.05 * v},
                       arguments=["j1.angle", "j1.rate"], delay=delay),
    )  # fmt: skip
    model.constrain(
        mbd.Event("kick", mbd.measure(lambda q: q - kicked, "j0.angle"), direction=1,
                  reset=lambda values: {"j1.rate": back * values["j1.rate"]})
    )  # fmt: skip

    def rates(t: float, y: Any, held: Any) -> list[float]:
        """Lagrange's equations in the absolute angles a and a + b."""
        a, b, w, v = y
        one, two = held.state["one"], held.state["two"]
        k, g, slope = gains["one"][one]
        first = -2.0 * abs(k) * (a - held.memory["one"][0]) + g + slope * (t - held.since["one"]) if one else 0.0
        second = (0.5 * gains["two"][two][1] if two else 0.0) + held.output
        first, second = first - loss * w, second - loss * v
        M = np.array([[I1 + m1 * c1**2 + m2 * length**2, m2 * length * c2 * math.cos(b)], [0.0, I2 + m2 * c2**2]])
        M[1, 0], turn = M[0, 1], m2 * length * c2 * math.sin(b)
        forces = [turn * (w + v) ** 2 - (m1 * c1 + m2 * length) * GRAVITY * math.sin(a) + first - second,
                  -turn * w**2 - m2 * c2 * GRAVITY * math.sin(a + b) + second]  # fmt: skip
        aw, at = np.linalg.solve(M, forces)
        return [w, v, aw, at - aw]

    jump = (("event", "kick"), lambda y: y[0] - kicked, 1, lambda y: np.array([*y[:3], back * y[3]]))
    machine = HybridMachine(rates, modes, lambda y: (y[0], y[1]), [jump],
                            (period, delay, lambda y: -stiffness * y[1] - 0.05 * y[3]))  # fmt: skip
    y0 = [float(random.uniform(0.7, 1.4)), float(random.uniform(-0.5, 0.5)), 0.0, float(random.uniform(-1.0, 1.0))]
    names = ("j0.angle", "j1.angle", "j0.rate", "j1.rate")
    start = mbd.assemble(model, dict(zip(names[:2], y0, strict=False)), dict(zip(names[2:], y0[2:], strict=True)))
    return machine, start, model, y0, names


def ball(seed: int):
    """A ball in space that bounces, with an impulse at each strike and a wind by mode."""
    random = np.random.default_rng(1000 + seed)
    mass, e, drag = (float(random.uniform(*each)) for each in ((0.5, 2.0), (0.75, 0.95), (0.02, 0.2)))
    order, count = ("before", "with", "after")[seed % 3], int(random.integers(2, 4))
    direction = random.normal(size=3)
    direction[1] = 0.1 * abs(direction[1])
    direction /= np.linalg.norm(direction)
    size = float(random.uniform(0.05, 0.3)) * mass
    winds, states = random.uniform(-1.5, 1.5, size=(count, 3)), [f"s{k}" for k in range(count)]
    changes, words = [], []
    for k in range(count):
        height, way, time = (
            float(random.uniform(0.2, 0.5)),
            int(random.integers(-1, 2)),
            float(random.uniform(0.1, 0.5)),
        )
        choices = [
            ({"on": ("closed", "floor")}, {"on": "floor"}), ({"after": time}, {"after": time}),
            ({"when": lambda y, held: y[4], "direction": way}, {"when": "p.y.rate", "direction": way}),
            ({"when": lambda y, held, height=height: y[1] - height},
             {"when": mbd.measure(lambda q, height=height: q - height, "p.y")}),
        ]  # fmt: skip
        for choice in random.choice(len(choices), size=2, replace=False):
            changes.append({"source": k, "target": (k + 1) % count, **choices[choice][0]})
            words.append(mbd.Transition(states[k], states[(k + 1) % count], **choices[choice][1]))
    model = mbd.Model(f"ball {seed}")
    body = mbd.PointMass("ball", mass=mass)
    model.connect(mbd.Translation("p", model.ground.origin, body.origin, axes="xyz"))
    model.constrain(
        mbd.Unilateral("floor", mbd.touchdown(body.origin), restitution=e, friction=0),
        mbd.Impulse("push", body.origin, size, "floor", direction=tuple(map(float, direction)), order=order),
        mbd.Mode("wind", states, transitions=words, remembers={"x": "p.x"}),
    )
    laws = {f"s{k}": lambda x, f=winds[k]: (float(f[0]), float(f[1]), float(f[2]) + 0.5 * x) for k in range(1, count)}
    against = mbd.Applied("drag", body.origin, lambda x, y, z: (-drag * x, -drag * y, -drag * z),
                          arguments=["p.x.rate", "p.y.rate", "p.z.rate"])  # fmt: skip
    model.apply(against, mbd.Applied("wind force", body.origin, laws, by="wind", arguments=["wind.x"]))

    def rates(t: float, y: Any, held: Any) -> list[float]:
        state = held.state["wind"]
        force = winds[state] + np.array([0.0, 0.0, 0.5 * held.memory["wind"][0]]) if state else np.zeros(3)
        x, upward, z = (force - drag * y[3:]) / mass
        return [*y[3:], x, upward - GRAVITY, z]

    def strike(y: Any) -> Any:
        after, push = y.copy(), size / mass * direction
        after[3:] += push
        after[4] = -e * y[4] + push[1] if order == "after" else -e * after[4]
        return after

    modes = {"wind": named("wind", states, changes)}
    machine = HybridMachine(rates, modes, lambda y: (y[0],), [(("closed", "floor"), lambda y: y[1], -1, strike)])
    y0 = [0.0, float(random.uniform(0.4, 0.8)), 0.0, *map(float, random.uniform(-0.5, 0.5, 3))]
    names = ("p.x", "p.y", "p.z", "p.x.rate", "p.y.rate", "p.z.rate")
    start = mbd.assemble(model, dict(zip(names[:3], y0, strict=False)), dict(zip(names[3:], y0[3:], strict=True)))
    return machine, start, model, y0, names


@pytest.mark.parametrize(
    "seed", [0, 5, *(pytest.param(k, marks=pytest.mark.slow) for k in (1, 2, 3, 4, *range(6, 20)))]
)
def test_random_links_with_modes_move_as_simulated_by_hand(seed, tmp_path):
    machine, start, model, y0, names = pendulum(seed)
    assert assert_same(machine, start, model, y0, names, 1.2) > 1
    assert_continues(model, start, names, 1.2, tmp_path)


@pytest.mark.parametrize("seed", [0, 1, 2, *(pytest.param(k, marks=pytest.mark.slow) for k in range(3, 10))])
def test_random_balls_with_impulses_and_modes_move_as_simulated_by_hand(seed, tmp_path):
    machine, start, model, y0, names = ball(seed)
    assert assert_same(machine, start, model, y0, names, 1.3) > 3
    assert_continues(model, start, names, 1.3, tmp_path)
