"""Scenes on which multibody systems fail, often silently: definitions, references, and what must hold."""

from mbd.hardcases import balls, blocks, clearances, cradles, grazes, knees, mats, rods, shakers, walls

__all__ = ["CASES"]

CASES = (
    balls.BOUNCING,
    cradles.ONE_IN,
    cradles.TWO_IN,
    blocks.ROCKING,
    rods.DROPPED,
    walls.DOUBLE_PENDULUM,
    clearances.SLIDER_CRANK,
    knees.GAP,
    knees.PULL,
    mats.STIFF,
    grazes.GRAZING,
    balls.ZENO,
    blocks.FLAT,
    balls.CORNER,
    shakers.SHAKEN,
)
"""Every case, in the order of the table."""
