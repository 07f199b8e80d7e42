"""`Scope` and what it returns, for words of users (see `mbd.bodies.scope`)."""

from mbd.bodies.scope import FrameMotion, JointMotion, Rotation, Scope, Triple

__all__ = ["FrameMotion", "JointMotion", "Rotation", "Scope", "Triple"]
