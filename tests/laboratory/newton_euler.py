"""Recursive Newton–Euler in plain numpy and ground axes, written apart from the library's own equations."""

import numpy as np

from tests.forward_kinematics import placed, turn


def rotation(q):
    """Rotation of a unit quaternion (w, x, y, z)."""
    w, v = q[0], np.asarray(q[1:])
    skew = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + 2.0 * w * skew + 2.0 * skew @ skew


def joint_motion(joint, q, v, a):
    """Rotation, shift, columns (angular, linear) in parent axes, and what accelerates without v̇, of the child frame."""
    kind = type(joint).__name__
    zero = np.zeros(3)
    if kind == "Weld":
        return np.eye(3), zero, [], zero
    if kind == "Revolute":
        axis = np.asarray(joint.axis, dtype=float)
        return turn(axis, q[0]), zero, [(axis, zero)], zero
    if kind == "Universal":
        first, second = np.asarray(joint.axis, dtype=float), np.asarray(joint.second_axis, dtype=float)
        R1 = turn(first, q[0])
        return (
            R1 @ turn(second, q[1]),
            zero,
            [(first, zero), (R1 @ second, zero)],
            np.cross(first * v[0], R1 @ second * v[1]),
        )
    if kind == "Prismatic":
        axis = np.asarray(joint.axis, dtype=float)
        return np.eye(3), axis * q[0], [(zero, axis)], zero
    if kind == "Spherical":
        R = rotation(q)
        return R, zero, [(R[:, k], zero) for k in range(3)], zero
    assert kind == "Free", kind
    R = rotation(q[3:])
    columns = [(zero, axis) for axis in np.eye(3)] + [(R[:, k], zero) for k in range(3)]
    return R, np.asarray(q[:3]), columns, zero


def inertia_of(body):
    """Mass, center and inertia about it, in axes of the body."""
    fields = body.fields()
    tensor = np.diag([fields[f"inertia.{axis}"] for axis in ("xx", "yy", "zz")])
    for i, j in ((0, 1), (0, 2), (1, 2)):
        tensor[i, j] = tensor[j, i] = fields.get(f"inertia.{'xyz'[i]}{'xyz'[j]}", 0.0)
    center = [fields.get(f"center.{axis}", 0.0) for axis in "xyz"]
    if "center" in fields:  # of a link, along −y
        center = [0.0, -fields["center"], 0.0]
    return fields["mass"], np.array(center), tensor


def inverse(joints, masses, gravity, q, v, a):
    """Generalized forces of a tree by joint; q, v, a by joint name; masses by body: (m, center, inertia)."""
    motion = {"ground": (np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3))}
    hinges, loads = {}, {}
    for joint in joints:
        R_P, p_P, w_P, al_P, acc_P = motion[joint.parent.body.name]
        (A, at), (C, c) = placed(joint.parent), placed(joint.child)
        J, j, columns, extra = joint_motion(joint, q[joint.name], v[joint.name], a[joint.name])
        R_A = R_P @ A
        angular, linear = (np.array([column[k] for column in columns]).reshape(-1, 3) for k in (0, 1))
        w_rel, v_rel = (R_A @ (side.T @ v[joint.name]) for side in (angular, linear))
        al_rel = R_A @ (angular.T @ a[joint.name] + extra)
        a_rel = R_A @ (linear.T @ a[joint.name])
        R = R_A @ J @ C.T
        w, al = w_P + w_rel, al_P + np.cross(w_P, w_rel) + al_rel
        arm = R_P @ at + R_A @ j
        hinge = p_P + arm
        acc = acc_P + np.cross(al_P, arm) + np.cross(w_P, np.cross(w_P, arm)) + 2.0 * np.cross(w_P, v_rel) + a_rel
        back = -R @ c
        acc = acc + np.cross(al, back) + np.cross(w, np.cross(w, back))
        name = joint.child.body.name
        motion[name] = (R, hinge + back, w, al, acc)
        hinges[name] = (hinge, [(R_A @ turn_, R_A @ shift) for turn_, shift in columns])
        m, center, tensor = masses[name]
        r, inertia = R @ center, R @ tensor @ R.T
        force = m * (acc + np.cross(al, r) + np.cross(w, np.cross(w, r)) - gravity)
        torque = inertia @ al + np.cross(w, inertia @ w)
        loads[name] = (force, torque + np.cross(hinge + back + r, force))  # about the ground's origin
    found = {}
    for joint in reversed(joints):
        name = joint.child.body.name
        hinge, columns = hinges[name]
        force, torque = loads[name]
        about = torque - np.cross(hinge, force)
        found[joint.name] = np.array([turn_ @ about + shift @ force for turn_, shift in columns])
        parent = joint.parent.body.name
        if parent in loads:
            loads[parent] = tuple(x + y for x, y in zip(loads[parent], (force, torque), strict=False))
    return found
