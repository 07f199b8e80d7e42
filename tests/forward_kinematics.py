"""Forward kinematics of joints in plain numpy, written apart from the library's own."""

import math

import numpy as np


def turn(axis, angle):
    """Rodrigues' rotation about an axis."""
    axis = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    skew = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + math.sin(angle) * skew + (1.0 - math.cos(angle)) * skew @ skew


def relative(joint, values):
    """Rotation and place of a joint's child frame in its parent frame; `values` by label."""
    kind = type(joint).__name__
    axis = np.asarray(getattr(joint, "axis", (0.0, 0.0, 1.0)))
    if kind == "Revolute":
        return turn(axis, values["angle"]), np.zeros(3)
    if kind == "Prismatic":
        return np.eye(3), axis * values["displacement"]
    if kind == "Cylindrical":
        return turn(axis, values["angle"]), axis * values["displacement"]
    if kind == "Screw":
        return turn(axis, values["angle"]), axis * joint.pitch * values["angle"] / (2.0 * math.pi)
    if kind == "Universal":
        return turn(axis, values["first"]) @ turn(joint.second_axis, values["second"]), np.zeros(3)
    if kind == "Planar":
        return turn((0, 0, 1), values["angle"]), np.array([values["x"], values["y"], 0.0])
    if kind == "Translation":
        return np.eye(3), np.array([values.get(label, 0.0) for label in "xyz"])
    assert kind == "Weld", kind
    return np.eye(3), np.zeros(3)


def placed(frame):
    """Rotation and place of a frame in its body."""
    return np.eye(3) if frame.rotation is None else np.array(frame.rotation), np.array(frame.offset)


def beyond(joint, pose, values):
    """Pose of the child body from that of the parent body."""
    (R, p), (A, a), (C, c), (J, j) = pose, placed(joint.parent), placed(joint.child), relative(joint, values)
    turned = R @ A @ J @ C.T
    return turned, p + R @ (a + A @ j) - turned @ c


def poses(model, joints, value):
    """Pose (R, p) of every body by name, walking `joints` from the ground; value(name) of each coordinate."""
    found = {model.ground.name: (np.eye(3), np.zeros(3))}
    for joint in joints:
        values = {label.name: value(f"{joint.name}.{label.name}") for label in joint.labels}
        found[joint.child.body.name] = beyond(joint, found[joint.parent.body.name], values)
    return found


def misfit(joint, pose_of, values):
    """(largest element of R − R', largest component of p − p') between where a joint and its bodies put its child."""
    R, p = beyond(joint, pose_of[joint.parent.body.name], values)
    at = pose_of[joint.child.body.name]
    return float(np.max(np.abs(R - at[0]))), float(np.max(np.abs(p - at[1])))
