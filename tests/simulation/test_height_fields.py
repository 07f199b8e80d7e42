"""Points that slide with friction on smooth heights y = H(x, z): Newton's equations by hand, and rest."""

from functools import lru_cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mbd

G, MU = 9.81, 0.15
A, B = 0.5, 0.8
START, SPEED = (0.6, -0.2), (0.3, 1.5)
END = 0.8


def bowl(x, z):
    return 0.5 * A * x * x + 0.5 * B * z * z


def trough(x):
    return 0.5 * A * x * x


@lru_cache(maxsize=8)
def on(ground, friction=MU, gravity=(0.0, -G, 0.0)):
    model = mbd.Model("hill", gravity=gravity)
    mass = mbd.PointMass("block", mass=2.0)
    model.connect(mbd.Translation("slide", model.ground.origin, mass.origin, axes="xyz"))
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(mass.origin, ground), friction=friction))
    return model


def by_hand(b):
    """a = N n/m − μ N v/(m ‖v‖) − g with n · a = curvature of H along v, by DOP853."""

    def change(t, y):
        x, z, vx, vz = y
        slope = np.array([-A * x, 1.0, -b * z])
        length = np.linalg.norm(slope)
        v = np.array([vx, A * x * vx + b * z * vz, vz])
        push = (A * vx * vx + b * vz * vz + G) / length
        a = push * (slope / length - MU * v / np.linalg.norm(v)) - np.array([0.0, G, 0.0])
        return [vx, vz, a[0], a[2]]

    return solve_ivp(change, (0.0, END), [*START, *SPEED], method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]


def slid(model, b, scheme, **how):
    (x, z), (vx, vz) = START, SPEED
    place = {"slide.x": x, "slide.y": 0.5 * A * x * x + 0.5 * b * z * z, "slide.z": z}
    speed = {"slide.x": vx, "slide.y": A * x * vx + b * z * vz, "slide.z": vz}
    return mbd.simulate(model, mbd.assemble(model, position=place, velocity=speed, closed="foot"), scheme, **how)


@pytest.mark.parametrize(("ground", "b"), [(bowl, B), (trough, 0.0)])
def test_a_point_slides_as_newton_says(ground, b):
    exact, errors = by_hand(b), []
    for scheme, how in (
        (mbd.HHT(0.05), {"dt": 4e-3}), (mbd.HHT(0.05), {"dt": 2e-3}),
        (mbd.RadauIIA(), {"dt": 5e-3}), (mbd.RungeKutta853(), {"tol": 1e-10}),
    ):  # fmt: skip
        run = slid(on(ground), b, scheme, until=END, **how)
        found = [run[name][-1] for name in ("slide.x", "slide.z", "slide.x.rate", "slide.z.rate")]
        errors.append(np.max(np.abs(np.array(found) - exact)))
        books = run.energy["kinetic"] + run.energy["potential"]
        assert np.max(np.diff(books)) <= 0.0  # friction takes energy
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)
    assert errors[2] < 1e-9
    assert errors[3] < 1e-9


def test_it_comes_to_rest_within_the_cone_and_stays():
    run = slid(on(bowl), B, mbd.RadauIIA(), dt=5e-3, until=3.0)
    assert [event.kind for event in run.events] == ["stuck"]
    x, z = run["slide.x"][-1], run["slide.z"][-1]
    assert np.hypot(A * x, B * z) <= MU
    after = run.time > run.events[0].time
    assert np.ptp(run["slide.x"][after]) < 1e-12
    assert np.ptp(run["slide.z"][after]) < 1e-12
