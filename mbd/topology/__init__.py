"""Topology: spanning tree, cut joints, mobility; graph queries only."""

from mbd.topology.graph import disconnected, mobility
from mbd.topology.plan import Plan, plan

__all__ = ["Plan", "disconnected", "mobility", "plan"]
