"""Four-bars that begin at rest with friction in their pins, which follows what these carry: an oracle by hand.

One motion is left, with the velocities d of the bodies. Friction in each pin is against it, ``M a = f + Jᵀ λ + τ`` and
``J a = 0`` with ``τ_k = −s sign(rate_k) μ_k r_k |λ_k|``, and ``s dᵀ M a > 0`` on the side s to which it moves.
Close to a toggle one pin hardly turns: were it held, it would load the others by many times of what they carry.
"""

import random

import numpy as np
import pytest
from scipy.optimize import fsolve

import mbd

GRAVITY = np.array([2.0, -9.81])


def four_bar(number):
    """Angles of three links on two pins of the ground, masses and losses: (N m, or μ and r) of four pins."""
    rng = random.Random(f"pins {number}")
    lengths, mass = [rng.uniform(0.3, 1.0) for _ in range(3)], [rng.uniform(0.5, 2.0) for _ in range(3)]
    first, reach = rng.uniform(-3.0, 3.0), rng.uniform(abs(lengths[1] - lengths[2]), lengths[1] + lengths[2])
    if number % 2:  # the second and the third link are almost in line
        reach = lengths[1] + lengths[2] - 10.0 ** rng.uniform(-4.0, -2.0)
    along = rng.uniform(-3.0, 3.0)
    inner = np.arccos((lengths[1] ** 2 + reach**2 - lengths[2] ** 2) / (2.0 * lengths[1] * reach))
    ends = np.cumsum([[0.0, 0.0]] + [
        [size * np.cos(angle), size * np.sin(angle)]
        for size, angle in ((lengths[0], first), (lengths[1], along + inner), (reach, 0.0))
    ], axis=0)  # fmt: skip
    ends[3] = ends[1] + reach * np.array([np.cos(along), np.sin(along)])
    losses = [
        mbd.PinFriction(rng.uniform(0.1, 0.4), rng.uniform(0.01, 0.05)) if rng.random() < 0.6
        else mbd.Coulomb(torque=rng.uniform(0.01, 0.3))
        for _ in range(4)
    ]  # fmt: skip
    return ends, mass, losses


def consistent(number):
    """(K, 3) accelerations of the angles of the links on each side on which the four-bar may begin to move."""
    ends, mass, losses = four_bar(number)
    middles, spans = (ends[1:] + ends[:-1]) / 2.0, np.diff(ends, axis=0)
    inertia = np.ravel([[m, m, m * span @ span / 12.0] for m, span in zip(mass, spans, strict=True)])
    maps, turns = np.zeros((8, 9)), np.zeros((4, 9))
    for k in range(4):
        for body, sign in ((k, 1.0), (k - 1, -1.0)):
            if 0 <= body < 3:
                arm = ends[k] - middles[body]
                maps[2 * k : 2 * k + 2, 3 * body : 3 * body + 3] = sign * np.array([[1, 0, -arm[1]], [0, 1, arm[0]]])
                turns[k, 3 * body + 2] = sign
    motion = np.linalg.svd(maps)[2][-1]
    weight = np.ravel([[*(m * GRAVITY), 0.0] for m in mass])
    found = []
    for side in (1.0, -1.0):

        def accelerations(loads, side=side):
            limits = [
                loss.mu * loss.radius * load if isinstance(loss, mbd.PinFriction) else loss.torque
                for loss, load in zip(losses, loads, strict=True)
            ]
            friction = turns.T @ (-side * np.sign(turns @ motion) * limits)
            matrix = np.block([[np.diag(inertia), -maps.T], [maps, np.zeros((8, 8))]])
            return np.linalg.solve(matrix, np.concatenate([weight + friction, np.zeros(8)]))

        def change(loads, accelerations=accelerations):
            return np.hypot(*accelerations(loads)[9:].reshape(4, 2).T) - loads

        loads, _, ended, _ = fsolve(change, np.full(4, 10.0), xtol=1e-13, full_output=True)
        a = accelerations(loads)[:9]
        if ended == 1 and np.min(loads) >= 0.0 and side * (motion * inertia) @ a > 0.0:
            found.append(a[2::3])
    return found


def model_of(number):
    ends, mass, losses = four_bar(number)
    model = mbd.Model("four-bar", gravity=(*GRAVITY, 0.0))
    frame, position = model.ground.origin, {}
    for k, (m, span) in enumerate(zip(mass, np.diff(ends, axis=0), strict=True)):
        size = float(np.hypot(*span))
        link = mbd.Link(f"link {k}", m, size, 0.5 * size, m * size**2 / 12.0)
        model.connect(mbd.Revolute(f"pin {k}", frame, link.start, loss=losses[k]))
        frame = link.end
        position[k] = np.arctan2(span[1], span[0])
    model.connect(mbd.Revolute("pin 3", model.ground.point(*ends[3]), frame, loss=losses[3]))
    return model, position


@pytest.mark.parametrize(
    "numbers", [range(12), *(pytest.param(range(k, k + 40), marks=pytest.mark.slow) for k in (12, 52))]
)
def test_a_four_bar_begins_to_move_to_the_side_where_friction_is_against_it(numbers):
    moved = 0
    for number in numbers:
        known = consistent(number)
        if len(known) != 1:
            continue
        model, angles = model_of(number)
        named = {f"pin {k}.angle": angles[k] - (angles[k - 1] if k else -0.5 * np.pi) for k in range(3)}  # links hang
        start = mbd.assemble(model, named)
        run = mbd.simulate(model, start, mbd.HHT(), dt=1e-6, until=1e-6)
        a = np.array([run[f"pin {k}.angle.acceleration"][0] for k in range(3)])
        np.testing.assert_allclose(np.cumsum(a), known[0], rtol=1e-5, atol=1e-5 * np.max(np.abs(known[0])))
        moved += 1
    assert 2 * moved > len(numbers)
