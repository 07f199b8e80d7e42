"""Names of what is read off joints besides their coordinates and velocities."""

from mbd.joints.anatomy import angles_of
from mbd.joints.base import Joint
from mbd.joints.euler import ANGLE_SUFFIXES, SEQUENCES


def orientation_names(joint: Joint) -> list[str]:
    """The names of what is read off a joint with a quaternion or of the body, besides coordinates and velocities."""
    named = [f"{joint.name}.{angle.name}" for angles, _ in angles_of(joint.anatomy) for angle in angles]
    named += [f"{name}.rate" for name in named]
    if joint.orientation is None:
        return named
    vectors = ("angular_velocity.parent", "angular_velocity.ground", "rotation_vector")
    names = [f"{joint.name}.{vector}.{axis}" for vector in vectors for axis in "xyz"]
    euler = [f"{joint.name}.euler.{sequence}.{place}" for sequence in SEQUENCES for place in ANGLE_SUFFIXES]
    return names + named + euler + [f"{name}.rate" for name in euler]
