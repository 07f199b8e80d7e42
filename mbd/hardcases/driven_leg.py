"""A leg whose joints are driven and held, with steps that follow a tolerance (j18): inverse dynamics."""

from typing import Any

import mbd
from mbd.hardcases.case import Curve, Figure, HardCase, Outcome
from mbd.hardcases.references import numbers, quantity, size
from mbd.hardcases.schemes import EVERY

ID = "j18-driven-leg"


def leg(given: dict[str, Any]) -> mbd.Model:
    """Two links below a fixed hip; the hip swings, the knee stretches and is held."""
    model = mbd.Model("driven leg", gravity=(0.0, -given["g"], 0.0))
    parts = zip(
        ("thigh", "shank"), *(given[name] for name in ("masses", "lengths", "centers", "inertias")), strict=True
    )
    thigh, shank = (mbd.Link(*each) for each in parts)
    hip, knee = mbd.Revolute("hip", model.ground.origin, thigh.start), mbd.Revolute("knee", thigh.end, shank.start)
    model.connect(hip, knee)

    def swing(t: Any) -> Any:
        return given["hip_amplitude"] * mbd.sin(given["hip_frequency"] * t)

    def stretch(t: Any) -> Any:
        x = t / given["knee_time"]
        moved = mbd.where(t < given["knee_time"], x * x * x * (10.0 + x * (6.0 * x - 15.0)), 1.0)
        return given["knee_from"] + given["knee_by"] * moved

    model.constrain(mbd.Bilateral("hip drive", hip, value=swing), mbd.Bilateral("knee drive", knee, value=stretch))
    return model


def judge(integrator: Any) -> Outcome:
    """Errors of both torques over the largest torque and the tolerance that was asked for."""
    given = numbers(ID)
    model = leg(given)
    start = mbd.assemble(model)
    wanted = {f"{joint} drive.torque": quantity(ID, f"{joint} torque") for joint in ("hip", "knee")}
    largest = max(reference.size for reference in wanted.values())
    figures, curves = [], []
    for tol in given["tolerances"]:
        run = mbd.simulate(model, start, integrator, tol=tol, until=given["until"])
        for name, reference in wanted.items():
            error = size(run.at(reference.times)[name] - reference.value)
            figures.append(
                Figure(f"error of the {name[:4].strip()} torque, tol = {tol:g} [tol]", error / largest / tol, 1.0)
            )
        estimated = float(run.stats["tolerance"]["estimated"])
        figures.append(Figure(f"estimated error, tol = {tol:g} [tol]", estimated / tol, 1.0))
        figures.append(Figure(f"steps, tol = {tol:g}", float(run.stats["steps"])))
        curves = [Curve(name, run.time, run[name], y_label="torque [N m]") for name in wanted]
    return Outcome(figures, curves)


CASES = (
    HardCase(
        ID,
        "Torques of drives are as accurate as tol asks for, though coordinates are exact in steps of any size.",
        judge,
        tuple(name for name in EVERY if "index3" not in name),
        notes={"index 3": "its steps follow no tolerance"},
    ),
)
