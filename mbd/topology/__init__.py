"""Topology: spanning tree, cut joints, mobility; graph queries only."""

from mbd.topology.graph import disconnected, graph_of, mobility
from mbd.topology.plan import Plan, plan

__all__ = ["Plan", "disconnected", "graph_of", "mobility", "plan"]
