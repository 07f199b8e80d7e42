"""Models from files of other programs."""

from __future__ import annotations

from pathlib import Path

from mbd.bodies.values import among, flag
from mbd.errors import ModelError
from mbd.laboratory.models.mjcf import read_mjcf
from mbd.laboratory.models.report import ImportedModel
from mbd.laboratory.models.urdf import read_urdf
from mbd.results.archive import file_to_read

__all__ = ["read_model"]


def read_model(
    path: str | Path, base: str = "fixed", stops: bool = True, losses: bool = True, repair: bool = False
) -> ImportedModel:
    """A model of plain words from a ``.urdf`` or MuJoCo's ``.xml``, with a report of what was understood and left out.

    The file's z is turned to y: x forward, y up, z to the right; coordinates of a joint that floats stay along the axes
    of the file. Names stay as they are, but for dots, which become underscores.

    Files of MuJoCo are compiled by it (``pip install 'mbd[mjcf]'``): bodies, joints, gravity, damping, friction and
    springs. Soft limits become rigid stops, soft equations between joints rigid couplings, and coordinates count from
    the posture of the file. Contacts, actuators, tendons and the inertia of rotors are left out, and listed.

    A robot of a ``.urdf`` stands on the ground by its root link; 'base' is the joint between them. Limits become
    `Unilateral` stops 'elbow upper stop', damping and friction `Viscous` and `Coulomb` losses, mimics `Bilateral`
    couplings. Shapes, transmissions and the like are left out, and listed.

    Parameters
    ----------
    path : of the file
    base : 'fixed' or 'floating', how the root link is connected to the ground
    stops, losses : whether limits, and damping, friction and springs, are read
    repair : whether moments of inertia that no body can have are replaced by the nearest that one can

    Raises
    ------
    ModelError
        for a file that is damaged, with line and element; for entities, macros and links without a body's inertia.

    ``found = mbd.read_model("robot.urdf")``, then ``print(found.report)`` and ``mbd.assemble(found.model)``.
    """
    target = file_to_read(path)
    if not among(base, ("fixed", "floating")):
        raise ModelError(f"base must be 'fixed' or 'floating', got {base!r}")
    stops, losses, repair = flag(stops, "stops"), flag(losses, "losses"), flag(repair, "repair")
    if target.suffix.lower() not in (".urdf", ".xml"):
        raise ModelError(f"a model ends in .urdf, or in .xml of MuJoCo; got {str(path)!r}")
    if not target.is_file():
        raise ModelError(f"there is no file '{target}'")
    if target.suffix.lower() == ".xml":
        if base != "fixed" or repair:
            raise ModelError(
                "a model of MuJoCo says itself how its bodies float, and has possible inertias; leave base= "
                "and repair= out"
            )
        return read_mjcf(target, stops, losses)
    return read_urdf(target, base, stops, losses, repair)
