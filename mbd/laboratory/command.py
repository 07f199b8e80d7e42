"""``mbd gait recording.c3d``: a recording alone, or with a model whose moments stand behind its motion."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mbd.errors import ModelError
from mbd.laboratory.assignment import assign_plates
from mbd.laboratory.inverse_dynamics import inverse_dynamics
from mbd.laboratory.inverse_kinematics import inverse_kinematics
from mbd.laboratory.read import read

__all__ = ["measured"]

PLATES = (".mot", ".sto")
"""Files of forces, looked for beside markers."""


def measured(path: str, model: Any, feet: Any = ()) -> Any:
    """The recording itself, or, with a model and its feet, its inverse dynamics.

    Plates come from the recording, or from the file of the same name with ``.mot`` or ``.sto``.

    Parameters
    ----------
    path : of a recording
    model : with the recording's markers, or None
    feet : a point of each foot
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
    motion = inverse_kinematics(model, recording, cutoff=6.0)  # Hz, before rates are taken
    return inverse_dynamics(model, motion, plates=assign_plates(motion, loads, list(feet)))
