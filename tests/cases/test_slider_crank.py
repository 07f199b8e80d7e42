"""Case c3: a slider-crank turned at constant speed by a prescribed motion; the drive torque is its multiplier."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import mbd
from mbd.integrators.family import NewmarkFamily
from tests.cases.schemes import WITH_ROWS, name_of
from tests.helpers import assert_second_order
from tests.problems import case

C3 = case("c3-slider-crank-rigid-driven")
ANGLES = (0.4, 1.9, 3.3, 5.2)
OMEGA = C3.definition["omega"]


def slider_crank(
    turned: Callable[[float], float], crank: float, rod: float, rod_mass: float, slider_mass: float, cut: Any = "auto"
) -> mbd.Model:
    """Crank from +x by the angle `turned(t)`, without inertia of its own; uniform rod; slider on the x axis."""
    model = mbd.Model("slider-crank", gravity=(0.0, 0.0, 0.0), cut=cut)
    arm = mbd.Link("crank", mass=0.0, length=crank, center=0.5 * crank)
    bar = mbd.Link("rod", mass=rod_mass, length=rod, center=0.5 * rod, inertia=rod_mass * rod**2 / 12)
    slider = mbd.PointMass("slider", mass=slider_mass)
    main = mbd.Revolute("main bearing", model.ground.origin, arm.start)
    model.connect(
        main,
        mbd.Revolute("crank pin", arm.end, bar.start),
        mbd.Prismatic("guide", model.ground.origin, slider.origin),
        mbd.Revolute("wrist", bar.end, slider.origin),
    )
    model.constrain(mbd.Bilateral("drive", main, value=lambda t: 0.5 * math.pi + turned(t)))
    return model


def assembled(model: mbd.Model, crank: float, rod: float) -> mbd.State:
    """Both links along +x, by the names of the joints, whether they are cut or not."""
    return mbd.assemble(model, position={"main bearing.angle": 0.5 * math.pi, "guide.displacement": crank + rod})


@pytest.mark.covering
@pytest.mark.parametrize("cut", ["auto", "all", ("crank pin",), ("guide",)], ids=str)
@pytest.mark.parametrize("scheme", WITH_ROWS, ids=name_of)
def test_slider_motion_and_drive_torque_meet_the_reference(scheme: NewmarkFamily, cut: Any) -> None:
    """Places follow from the rows alone; accelerations and the torque are of second order.

    At position level only, also velocities, and multipliers once the transient of the start has died out.
    """
    sizes = [C3.definition[name] for name in ("crank", "rod", "rod_mass", "slider_mass")]
    model = slider_crank(lambda t: OMEGA * t, *sizes, cut=cut)
    stabilized = scheme.formulation == "ggl"
    first = 0 if stabilized else 2
    start, reference = assembled(model, *sizes[:2]), C3["[x, xdot"].value[first:]

    def errors(dt: float) -> list[float]:
        run = mbd.simulate(model, start, scheme, dt=dt, until=ANGLES[-1] / OMEGA)
        moments = run.at([angle / OMEGA for angle in ANGLES[first:]])
        assert moments["guide.displacement"] == pytest.approx(reference[:, 0], abs=5e-11)
        if stabilized:
            assert moments["guide.rate"] == pytest.approx(reference[:, 1], abs=1e-8)
        found = [moments["guide.acceleration"] - reference[:, 2], moments["drive.torque"] - reference[:, 3]]
        if not stabilized:
            found.append(moments["guide.rate"] - reference[:, 1])
        return [float(np.linalg.norm(each)) for each in found]

    # without the last halving in index 3, where the round-off ε L/dt² of accelerations is a tenth of their error
    assert_second_order(errors, (0.0125 if stabilized else 0.02) / OMEGA, 3 if stabilized else 2)


@pytest.mark.parametrize("scheme", WITH_ROWS, ids=name_of)
def test_an_unevenly_turned_crank_needs_the_torque_of_its_kinetic_energy(scheme: NewmarkFamily) -> None:
    """Angle φ(t) = 3 t + 0.4 sin 5 t. With T = ½ J(φ) φ˙² the torque is J φ¨ + ½ J′ φ˙²."""
    crank, rod, rod_mass, slider_mass = 0.2, 0.7, 1.3, 0.6
    model = slider_crank(lambda t: 3.0 * t + 0.4 * mbd.sin(5.0 * t), crank, rod, rod_mass, slider_mass)
    start = assembled(model, crank, rod)
    until = 1.7
    phi, rate = 3.0 * until + 0.4 * math.sin(5.0 * until), 3.0 + 2.0 * math.cos(5.0 * until)
    acceleration = -10.0 * math.sin(5.0 * until)

    def inertia(angle: complex) -> complex:
        """J(φ) from the velocities of the rod's center and of the slider for φ˙ = 1, all by hand."""
        sine, cosine = np.sin(angle), np.cos(angle)
        below = np.sqrt(1.0 - (crank / rod * sine) ** 2)  # cos of the rod's angle β, sin β = crank/rod sin φ
        swing = crank / rod * cosine / below  # β˙
        slide = -crank * sine - rod * (crank / rod * sine) * swing
        center = (-crank * sine - 0.5 * rod * (crank / rod * sine) * swing, 0.5 * crank * cosine)
        moving = center[0] ** 2 + center[1] ** 2
        return slider_mass * slide**2 + rod_mass * moving + rod_mass * rod**2 / 12 * swing**2

    slope = inertia(phi + 1e-30j).imag / 1e-30
    torque = inertia(phi).real * acceleration + 0.5 * slope * rate**2
    place = crank * math.cos(phi) + math.sqrt(rod**2 - (crank * math.sin(phi)) ** 2)

    def error(dt: float) -> float:
        run = mbd.simulate(model, start, scheme, dt=dt, until=until)
        assert run["guide.displacement"][-1] == pytest.approx(place, abs=1e-12)
        return float(run["drive.torque"][-1] - torque)

    assert_second_order(error, 1.7 / 400)


def test_the_work_of_the_drive_is_the_change_of_kinetic_energy() -> None:
    sizes = [C3.definition[name] for name in ("crank", "rod", "rod_mass", "slider_mass")]
    model = slider_crank(lambda t: OMEGA * t, *sizes)
    start = assembled(model, *sizes[:2])

    def error(dt: float) -> float:
        energy = mbd.simulate(model, start, mbd.GeneralizedAlpha(0.9), dt=dt, until=1.9 / OMEGA).energy
        assert set(energy.sums) == {"drive", "numerical"}
        return energy.sums["drive"] - energy.change

    assert_second_order(error, 0.05 / OMEGA)
