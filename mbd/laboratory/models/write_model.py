"""Models written for other programs."""

from pathlib import Path
from typing import Any

from mbd.bodies.values import shown
from mbd.errors import ModelError
from mbd.laboratory.models.report import ImportReport
from mbd.laboratory.models.write_osim import osim_of
from mbd.laboratory.models.write_urdf import urdf_of
from mbd.results.archive import named_file, write_whole

WRITERS = {".urdf": urdf_of, ".osim": osim_of}


def write_model(model: Any, path: str | Path) -> ImportReport:
    """Write a model as ``.urdf`` or ``.osim`` (format 40000), and report what of it the file tells.

    Numbers keep all digits, so that `mbd.read_model` gives a model with the same mass matrix and bias. In a ``.urdf``
    stops on coordinates become limits, viscous and dry friction of joints dynamics; joints of several coordinates
    become chains. An ``.osim`` has stops as clamped ranges, markers, and muscles on points. Springs, other forces,
    contacts, rows and joints that close loops are left out, and listed. Links of the plane, which have no moments about
    x and y, get half of that about z.

    Parameters
    ----------
    model : a `Model`
    path : ends in .urdf or .osim

    Returns
    -------
    ImportReport
        ``print(mbd.write_model(model, "leg.urdf"))``

    Raises
    ------
    ModelError
        for a `Lagrangian`, and joints that the format lacks.
    """
    target = named_file(path)
    writer = WRITERS.get(target.suffix.lower())
    if writer is None:
        raise ModelError(f"a model is written as .urdf or .osim, got {str(path)!r}")
    if not hasattr(model, "joints") or not hasattr(model, "bodies"):
        raise ModelError(f"write_model takes a Model of bodies and joints, got {shown(model)[:80]}")
    model.require_valid()
    text, report = writer(model)
    write_whole(target, lambda partial: partial.write_text(text, encoding="utf-8"))
    return report
