"""Small mechanisms for tests of graphs and models."""

from functools import partial

import mbd
from mbd.model import Model
from tests.simulation import mechanisms as simulation


def four_bar(cut="auto") -> Model:
    """Ground, crank, coupler, rocker: one loop."""
    model = Model("four-bar", cut=cut)
    crank = mbd.Link("crank", 1.0, 0.3, 0.15, 0.01)
    coupler = mbd.Link("coupler", 1.0, 0.8, 0.4, 0.05)
    rocker = mbd.Link("rocker", 1.0, 0.6, 0.3, 0.03)
    model.connect(
        mbd.Revolute("A", model.ground.origin, crank.start),
        mbd.Revolute("B", crank.end, coupler.start),
        mbd.Revolute("C", coupler.end, rocker.end),
        mbd.Revolute("D", model.ground.point(1.0, 0.0, name="post"), rocker.start),
    )
    return model


def chain(n: int, cut="auto", reverse: bool = False) -> Model:
    """n links that hang from the ground; `reverse` describes every joint from the child's side."""
    model = Model("chain", cut=cut)
    above = model.ground.origin
    for k in range(n):
        link = mbd.Link(f"link {k}", 1.0, 0.5, 0.25, 0.02)
        ends = (link.start, above) if reverse else (above, link.start)
        model.connect(mbd.Revolute(f"joint {k}", *ends))
        above = link.end
    return model


kneed_walker = partial(simulation.kneed_walker, loss=mbd.Viscous(0.1))
"""With a loss in each knee."""


def bricard() -> Model:
    """Bricard's six hinges in space: Grübler counts no freedom, yet it moves."""
    model = Model("bricard")
    axes = [(0, 0, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 0), (0, 1, 0)]
    frame = model.ground.origin
    for k in range(5):
        body = mbd.RigidBody(f"rod {k}", 1.0, (0.1, 0.1, 0.1))
        model.connect(mbd.Revolute(f"hinge {k}", frame, body.origin, axis=axes[k]))
        frame = body.point(0.0, -1.0, name="end")
    model.connect(mbd.Revolute("hinge 5", frame, model.ground.point(1.0, 0.0, name="post"), axis=axes[5]))
    return model
