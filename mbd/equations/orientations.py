"""What is read off joints that turn freely: angular velocities in three frames, rotation vector, Euler angles."""

from collections.abc import Callable, Sequence
from functools import partial

from mbd.bodies.algebra import rotate
from mbd.bodies.scope import Scope
from mbd.equations.outputs import Outputs
from mbd.joints.anatomy import System, angles_of, measured
from mbd.joints.base import Joint
from mbd.joints.euler import ANGLE_SUFFIXES, SEQUENCES, euler_angles
from mbd.joints.quaternions import rotation_of, rotation_vector
from mbd.joints.reversed import Reversed
from mbd.tape.node import Scalar


def offer_orientations(outputs: Outputs, scope: Scope, joints: Sequence[Joint]) -> None:
    """'ball.angular_velocity.parent' and '.ground', and among the names that are not listed '.rotation_vector' and
    '.euler.zxy', whose angles are '.euler.zxy.1', '.2', '.3'; of joints of the body angles of ISB, 'hip.flexion'. Rates
    of angles, 'hip.flexion.rate', are not listed either: next to singularities they have no bound.
    """
    for each in joints:
        joint = each.joint if isinstance(each, Reversed) else each
        for named, system in angles_of(joint.anatomy):
            names = [angle.name for angle in named]
            angles = partial(_anatomical, scope, joint, system)
            outputs.triple(joint.name, angles, names)
            outputs.triple(joint.name, partial(_rates, scope, angles), [f"{each}.rate" for each in names], listed=False)
        if joint.orientation is None:
            continue
        name = joint.name
        outputs.triple(f"{name}.angular_velocity.parent", partial(_in_parent, scope, joint))
        outputs.triple(f"{name}.angular_velocity.ground", partial(_in_ground, scope, joint))
        outputs.triple(f"{name}.rotation_vector", partial(_vector, scope, joint), listed=False)
        for sequence in SEQUENCES:
            euler = partial(_angles, scope, joint, sequence)
            outputs.triple(f"{name}.euler.{sequence}", euler, ANGLE_SUFFIXES, listed=False)
            rates = [f"{place}.rate" for place in ANGLE_SUFFIXES]
            outputs.triple(f"{name}.euler.{sequence}", partial(_rates, scope, euler), rates, listed=False)


def _rates(scope: Scope, angles: Callable[[], Sequence[Scalar]]) -> Sequence[Scalar]:
    return [scope.rate(angle) for angle in angles()]


def _quaternion(scope: Scope, joint: Joint) -> Sequence[Scalar]:
    first = joint.orientation or 0
    return scope.joint(joint.name).coordinates[first : first + 4]


def _in_parent(scope: Scope, joint: Joint) -> Sequence[Scalar]:
    x, y, z = scope.joint(joint.name).rates[-3:]
    return rotate(rotation_of(_quaternion(scope, joint)), (x, y, z))


def _in_ground(scope: Scope, joint: Joint) -> Sequence[Scalar]:
    x, y, z = scope.joint(joint.name).rates[-3:]
    return rotate(scope.frame(joint.child).rotation, (x, y, z))


def _vector(scope: Scope, joint: Joint) -> Sequence[Scalar]:
    return rotation_vector(_quaternion(scope, joint))


def _angles(scope: Scope, joint: Joint, sequence: str) -> Sequence[Scalar]:
    return euler_angles(rotation_of(_quaternion(scope, joint)), sequence)


def _anatomical(scope: Scope, joint: Joint, system: System) -> Sequence[Scalar]:
    R, _ = joint.transform(scope.joint(joint.name).coordinates, scope)
    return measured(R, system, joint.anatomy.startswith("left"))
