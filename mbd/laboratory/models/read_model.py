"""Models from files of other programs."""

from pathlib import Path

from mbd.bodies.values import among, flag
from mbd.errors import ModelError
from mbd.laboratory.models.mjcf import read_mjcf
from mbd.laboratory.models.osim import read_osim
from mbd.laboratory.models.report import ImportedModel
from mbd.laboratory.models.urdf import read_urdf
from mbd.results.archive import file_to_read


def read_model(
    path: str | Path, base: str = "fixed", stops: bool | None = None, losses: bool = True, repair: bool = False
) -> ImportedModel:
    """A model of plain words from a ``.urdf``, MuJoCo's ``.xml`` or OpenSim's ``.osim``, and a report of what is in it.

    In the first two the file's z is turned to y: x forward, y up, z to the right; coordinates of a joint that floats
    stay along the axes of the file. Names stay as they are, but for dots, which become underscores.

    Files of MuJoCo are compiled by it (``pip install 'mbd[mjcf]'``): bodies, joints, gravity, damping, friction and
    springs. Soft limits become rigid stops, soft equations between joints rigid couplings, and coordinates count from
    the posture of the file. Armature becomes a `Rotor`. Contacts, actuators and tendons are left out, and listed.

    A robot of a ``.urdf`` stands on the ground by its root link; 'base' is the joint between them,
    or 'base ground' where a joint of the file is called so. Limits become
    `Unilateral` stops 'elbow upper stop', damping and friction `Viscous` and `Coulomb` losses, mimics `Bilateral`
    couplings. Shapes, transmissions and the like are left out, and listed.

    A model of OpenSim (formats 20303, 30000, 40000) keeps its axes and the values of its coordinates. A joint of
    several coordinates is a chain of `Revolute` and `Prismatic` joints with the names of the coordinates,
    'knee_angle_r.angle', with bodies without mass between them; a BallJoint or FreeJoint without locks, stops and
    couplers is one joint. Motions of a CustomJoint that are functions of coordinates, couplers and locks are
    `Bilateral` rows; `posture` of what is returned has the default values. OpenSim does not enforce ranges in forward
    dynamics, so that they are read with stops=True only. Weld and point constraints close loops; muscles are in
    `muscles` of what is returned. Other forces and constraints, and shapes are left out, and listed.

    Parameters
    ----------
    path : of the file
    base : 'fixed' or 'floating', how the root link of a ``.urdf`` is connected to the ground
    stops : whether limits are read; by default those of a ``.urdf`` and of MuJoCo
    losses : whether damping, friction and springs are read
    repair : whether moments of inertia that no body can have are replaced by the nearest that one can

    Raises
    ------
    ModelError
        for a file that is damaged, with line and element; for entities, macros and links without a body's inertia; for
        joints of OpenSim that cannot be stated exactly, with the joint and the function.

    ``found = mbd.read_model("robot.urdf")``, then ``print(found.report)`` and ``mbd.assemble(found.model)``.
    """
    target = file_to_read(path)
    if not among(base, ("fixed", "floating")):
        raise ModelError(f"base must be 'fixed' or 'floating', got {base!r}")
    suffix = target.suffix.lower()
    stops = suffix != ".osim" if stops is None else flag(stops, "stops")
    losses, repair = flag(losses, "losses"), flag(repair, "repair")
    if suffix not in (".urdf", ".xml", ".osim"):
        hint = "; xacro makes a .urdf of it: xacro robot.xacro > robot.urdf" if suffix == ".xacro" else ""
        raise ModelError(f"a model ends in .urdf, .osim, or in .xml of MuJoCo; got {str(path)!r}{hint}")
    if not target.is_file():
        raise ModelError(f"there is no file '{target}'")
    if suffix != ".urdf" and base != "fixed":
        raise ModelError("a model of MuJoCo or OpenSim says itself how its bodies float; leave base= out")
    if suffix == ".xml" and repair:
        raise ModelError("a model of MuJoCo has possible inertias; leave repair= out")
    try:
        if suffix == ".xml":
            return read_mjcf(target, stops, losses)
        if suffix == ".osim":
            return read_osim(target, stops, repair)
        return read_urdf(target, base, stops, losses, repair)
    except ModelError as error:  # of a word that the file gave wrong values
        raise error if target.name in str(error) else ModelError(f"{target.name}: {error}") from None
