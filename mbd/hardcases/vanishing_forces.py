"""Mechanisms in which forces vanish: one that its drive has moved and holds (j21), balanced shafts (p7)."""

import math
from typing import Any

import numpy as np

import mbd
from mbd.hardcases.case import Curve, Figure, HardCase, Outcome
from mbd.hardcases.references import numbers, quantity, size
from mbd.hardcases.schemes import EVERY

J21, P7 = "j21-moved-and-held", "p7-balanced-cardan"
STEPS = (1e-3, 2e-4)
"""Steps of the slider-crank [s]."""


def slider_crank(gravity: float, cut: str) -> tuple[mbd.Model, mbd.State]:
    """A crank that turns by `rise` within `time`, with continuous accelerations, and is held then."""
    case = numbers(J21)
    R, L, start = case["crank"], case["rod"], case["angle"]
    model = mbd.Model("slider-crank", gravity=(0.0, -gravity, 0.0), cut=cut)
    arm = mbd.Link("arm", case["m_crank"], R, 0.5 * R, case["m_crank"] * R**2 / 12.0)
    rod = mbd.Link("rod", case["m_rod"], L, 0.5 * L, case["m_rod"] * L**2 / 12.0)
    piston = mbd.PointMass("piston", case["m_piston"])
    crank = mbd.Revolute("crank", model.ground.origin, arm.start)
    model.connect(
        crank,
        mbd.Revolute("pin", arm.end, rod.start),
        mbd.Prismatic("bore", model.ground.origin, piston.origin),
        mbd.Revolute("wrist", rod.end, piston.origin),
    )

    def way(t: Any) -> Any:
        s = mbd.clip(t / case["time"], 0.0, 1.0)
        return start + case["rise"] * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)

    model.constrain(mbd.Bilateral("drive", crank, value=way))
    place = R * math.sin(start) + math.sqrt(L**2 - (R * math.cos(start)) ** 2)
    return model, mbd.assemble(model, position={"crank.angle": start, "bore.displacement": place})


def judge_held(integrator: Any) -> Outcome:
    """It rests where it was moved to, and the drive holds its weight, or nothing; no step is in doubt."""
    case = numbers(J21)
    torque, place = (quantity(J21, name) for name in ("torque at rest", "place of the piston"))
    off, moved, doubts, curves = 0.0, 0.0, 0, []
    for cut in ("auto", "all"):
        for gravity in (case["g"], 0.0):
            for dt in STEPS:
                model, start = slider_crank(gravity, cut)
                run = mbd.simulate(model, start, integrator, dt=dt, until=case["until"])
                wanted = float(torque.value) if gravity else 0.0
                off = max(off, abs(float(run["drive.torque"][-1]) - wanted))
                moved = max(moved, abs(float(run["piston.origin.x"][-1]) - float(place.value)))
                doubts += any("singular" in note or "shortened" in note for note in run.stats["notes"])
                curves.append(Curve("torque of the drive", run.time, run["drive.torque"], y_label="[N m]"))
    figures = [
        Figure("error of the torque at rest [N m]", off, torque.accuracy),
        Figure("error of the place of the piston at rest [m]", moved, place.accuracy),
        Figure("runs that shorten steps or see a singular configuration", doubts, 0),
    ]
    return Outcome(figures, curves[:1])


def cardan(angle: float, cut: str) -> tuple[mbd.Model, mbd.State]:
    """Two shafts with their mass centers on their axes, which meet at an angle `bend` in a Cardan joint."""
    case = numbers(P7)
    bend = case["bend"]
    along, across = (math.cos(bend), math.sin(bend), 0.0), (-math.sin(bend), math.cos(bend), 0.0)
    model = mbd.Model("cardan", gravity=(0.0, 0.0, 0.0), cut=cut)
    one, other = (mbd.RigidBody(name, case["m"], tuple(case[f"I_{name}"])) for name in ("in", "out"))
    model.connect(
        mbd.Revolute("first", model.ground.origin, one.origin, axis=(1.0, 0.0, 0.0)),
        mbd.Universal("cross", one.origin, other.origin, axis=(0.0, 0.0, 1.0), second_axis=across),
        mbd.Revolute("second", model.ground.origin, other.origin, axis=along),
    )
    return model, mbd.assemble(model, position={"first.angle": angle}, velocity={"first.angle": case["speed"]})


def judge_cardan(integrator: Any) -> Outcome:
    """``tan φ₂ = cos β tan φ₁`` and, by energy, ``φ̇₁² (I₁ + I₂ ρ²)`` as it was, with ρ = dφ₂/dφ₁."""
    case = numbers(P7)
    bend, (along, across, _) = case["bend"], case["I_out"]
    second = along * math.cos(bend) ** 2 + across * math.sin(bend) ** 2

    def inertia(angle: Any) -> Any:
        ratio = math.cos(bend) / (1.0 - (math.sin(bend) * np.sin(angle)) ** 2)
        return case["I_in"][0] + second * ratio**2

    turned, fast, gained, curves = 0.0, 0.0, 0.0, []
    for cut in ("auto", "all"):
        for angle in case["angles"]:
            model, start = cardan(angle, cut)
            run = mbd.simulate(model, start, integrator, dt=case["dt"], until=case["until"])
            first, speed = np.asarray(run["first.angle"]), np.asarray(run["first.angle.rate"])
            wanted = np.unwrap(np.arctan2(math.cos(bend) * np.sin(first), np.cos(first)))
            turned = max(turned, size(np.unwrap(run["second.angle"]) - wanted))
            exact = case["speed"] * np.sqrt(inertia(angle) / inertia(first))
            fast = max(fast, size(speed - exact))
            gained = max(gained, float(np.ptp(run.energy.total)) / float(run.energy.kinetic[0]))
            curves.append(Curve("speed of the driving shaft", run.time, speed, y_label="[rad/s]"))
    figures = [
        Figure("error of the angle of the other shaft [rad]", turned, 1e-9),
        Figure("error of the speed at an angle [rad/s]", fast, 1e-3),
        Figure("change of the energy over the kinetic one [-]", gained, 1e-3),
    ]
    return Outcome(figures, curves[:1])


CASES = (
    HardCase(J21, "A mechanism that its drive has moved and holds is at rest; the drive holds its weight, or nothing.",
             judge_held, EVERY),
    HardCase(P7, "Balanced shafts on a Cardan joint, on which no force acts, turn by its law and keep their energy.",
             judge_cardan, EVERY),
)  # fmt: skip
