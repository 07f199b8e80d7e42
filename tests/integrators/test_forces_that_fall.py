"""Newton's method ends beside the forces of now, whatever larger ones acted before, and whatever else moves fast."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import mbd
from mbd.compile.mechanisms import mechanism_of

GRAVITY = np.array([2.0, -9.81, 9.0])
FRICTION = 0.3


def residuals(model, run):
    """``M v̇ + f`` at all rows but the first over the largest magnitude of its terms, of a tree of joints."""
    mechanism, record = mechanism_of(model, "auto"), run.record
    layout, n = mechanism.layout, record.v.shape[1]
    found, sizes = [], np.zeros(mechanism.sizes["scales"])
    for t, q, v, a in zip(record.time[1:], record.q[1:], record.v[1:], record.a[1:], strict=True):
        terms = mechanism.acceleration_terms(float(t), q, v, record.parameters, np.zeros(layout.n_anchors))
        block = mechanism.block(float(t), q, v, np.zeros(layout.n_anchors), ())
        block[layout.a : layout.a + n] = a
        mechanism.common["scales"](block, record.parameters, sizes)
        found.append(np.max(np.abs(terms.M @ a + terms.f)) / np.max(sizes[:n]))
    return np.array(found)


@pytest.mark.parametrize("scheme", [mbd.HHT(alpha=0.05), mbd.GeneralizedAlpha(0.8), mbd.Newmark()], ids=repr)
@pytest.mark.parametrize("rate", [100.0, 400.0])
def test_residuals_are_small_beside_the_forces_of_now(scheme, rate):
    """Two rods whose forces die away by 10⁶: magnitudes were those of the start, and residuals 2e-8 to 4.5e-8."""
    model = mbd.Model("rods that spin down")
    rods = [mbd.Link(f"rod {k}", mass=1.0, length=1.0, center=0.5, inertia=0.1) for k in range(2)]
    model.connect(
        mbd.Revolute("a", model.ground.origin, rods[0].start, loss=mbd.Viscous(2.0)),
        mbd.Revolute("b", rods[0].end, rods[1].start, loss=mbd.Viscous(2.0)),
    )
    start = mbd.assemble(model, {"a.angle": 0.1, "b.angle": 0.3}, {"a.rate": rate, "b.rate": -0.5 * rate})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        run = mbd.simulate(model, start, scheme, dt=4e-3, until=3.0)
    assert np.max(residuals(model, run)) < 6e-9


def off_law(scheme, speed, fast, tied):
    """How far accelerations of a puck on a slope are from ``g − μ g_n γ/|γ|``, over g, beside a body of this speed."""
    model = mbd.Model("puck", gravity=tuple(GRAVITY))
    puck, other = mbd.PointMass("puck", mass=2.0), mbd.PointMass("other", mass=1.0)
    model.connect(
        mbd.Translation("slide", model.ground.origin, puck.origin, axes="xyz"),
        mbd.Translation("fly", model.ground.point(0.0, 5.0), other.origin),
    )
    if tied:
        model.apply(mbd.Spring("thread", puck.origin, other.origin, stiffness=1e-12, length=5.0))
    model.constrain(mbd.Unilateral("floor", mbd.touchdown(puck.origin), friction=mbd.Coulomb(FRICTION)))
    start = mbd.assemble(model, {"slide.y": 0.0}, {"slide.x": speed, "fly.x": fast}, closed=["floor"])
    run = mbd.simulate(model, start, scheme, dt=5e-3, until=0.05)
    v, a = (np.stack([run[f"slide.{x}.{kind}"] for x in "xz"], axis=1) for kind in ("rate", "acceleration"))
    wanted = GRAVITY[[0, 2]] + FRICTION * GRAVITY[1] * v / np.linalg.norm(v, axis=1)[:, None]
    return np.max(np.linalg.norm(a - wanted, axis=1)[1:]) / np.linalg.norm(GRAVITY)


@pytest.mark.parametrize("scheme", [mbd.HHT(alpha=0.05), mbd.Newmark(), mbd.RadauIIA()], ids=repr)
@pytest.mark.parametrize("fast", [0.0, 1e4, 1e6])
def test_friction_does_not_hang_on_how_fast_a_body_apart_moves(scheme, fast):
    """What may be round-off of γ was that of the fastest body: 5e-7 of the forces beside 10⁴ m/s."""
    assert off_law(scheme, 1e-3, fast, False) < 3e-9


def test_friction_is_as_exact_as_the_velocity_at_the_end_of_a_step_lets_it_be():
    """γ grows as sliding begins, and the part of it that is round-off was that of the start: 4e-8 of the forces."""
    assert off_law(mbd.HHT(alpha=0.05, formulation="index3"), 1e-3, 1e4, True) < 6e-9
