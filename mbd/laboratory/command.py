"""``mbd gait recording.c3d``: a recording alone, or with a model whose moments stand behind its motion."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from mbd.errors import ModelError, nearest
from mbd.laboratory.assignment import assign_plates
from mbd.laboratory.inverse_dynamics import inverse_dynamics
from mbd.laboratory.inverse_kinematics import inverse_kinematics
from mbd.laboratory.models.read_model import read_model
from mbd.laboratory.read import read

MODELS = (".osim", ".urdf", ".xml")
"""Endings of files that `mbd.read_model` reads."""
FEET = (re.compile(r"calcn|calcaneus", re.IGNORECASE), re.compile(r"foot", re.IGNORECASE))
"""Names of bodies that stand on plates; those of the first kind that the file has."""

PLATES = (".mot", ".sto")
"""Files of forces, looked for beside markers."""


def measured(path: str, model: Any, feet: Any = (), joints: Sequence[str] | None = None) -> Any:
    """The recording itself, or, with a model and its feet, its inverse dynamics.

    Plates come from the recording, or from the file of the same name with ``.mot`` or ``.sto``.

    Parameters
    ----------
    path : of a recording
    model : with the recording's markers, or None
    feet : each foot, or a point of it
    joints : that are driven; by default all but those with which a body floats
    """
    recording = read(path)
    if model is None:
        return recording
    loads = recording
    if not loads.plates:
        beside = [Path(path).with_suffix(suffix) for suffix in PLATES if Path(path).with_suffix(suffix).is_file()]
        if not beside:
            raise ModelError(f"{Path(path).name} has no force plates, and no .mot or .sto lies beside it")
        loads = read(beside[0])
    for sentence in recording.notes:
        print(f"recording: {sentence}")
    motion = inverse_kinematics(model, recording, cutoff=6.0)  # Hz, before rates are taken
    print(motion)
    plates = assign_plates(motion, loads, list(feet))
    for plate in plates:
        times = " and ".join(f"{a:.3g} to {b:.3g} s" for a, b in plate.during or ())
        print(f"{plate.record.name}: {plate.foot.body.name!r} from {times}")
    return inverse_dynamics(model, motion, joints, plates=plates)


def is_model_file(name: str) -> bool:
    """Whether a name is that of a model of another program."""
    return name.lower().endswith(MODELS)


def model_of_file(path: str, feet: Sequence[str] | None) -> tuple[Any, list[Any], list[str] | None]:
    """The model of a file, its feet and its driven joints.

    Feet are the bodies called so, or those with 'calcn' or 'foot' in their names.

    What became of the file is printed. Inertias that no body can have are repaired, which the report says too.
    """
    found = read_model(path, repair=True)
    print(f"{Path(path).name}\n{found.report}")
    if feet:
        unknown = [name for name in feet if name not in found.bodies]
        if unknown:
            raise ModelError(f"--feet: {nearest(unknown[0], found.bodies, 'body', 'The file has')}")
        return found.model, [found.bodies[name] for name in feet], found.driven
    for pattern in FEET:
        own = [body for name, body in found.bodies.items() if pattern.search(name)]
        if own:
            print(f"feet: {', '.join(repr(body.name) for body in own)}")
            return found.model, own, found.driven
    raise ModelError(f"{Path(path).name} has no body called calcn or foot; name those that stand on plates with --feet")
