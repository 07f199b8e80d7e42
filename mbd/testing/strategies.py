"""Hypothesis strategies; they need the `test` extra.

Everything random is made from a seed, so a failing example prints as short as ``random_tree(seed=7, bodies=2, …)``.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import mbd
from mbd.bodies.base import Body, Frame
from mbd.errors import MbdError
from mbd.testing.mechanisms import random_loop, random_scene, random_tree

try:
    from hypothesis import strategies as st
except ImportError as error:
    raise MbdError(
        "the strategies of mbd.testing need Hypothesis, which comes with the extra 'test': "
        "python -m pip install 'mbd[test]'; the checks (check_constraint, …) run without it"
    ) from error

SEEDS = st.integers(0, 2**32 - 1)


def postures(*names: str, size: float = 1.0) -> st.SearchStrategy[Any]:
    """{'left hip.angle': 0.3, …}: numbers between −size and size for some names, for `mbd.assemble` [m, rad, …]."""
    return st.fixed_dictionaries({name: st.floats(-size, size, allow_subnormal=False) for name in names})


def frames(body: Body, spatial: bool = False, size: float = 0.6) -> st.SearchStrategy[Frame]:
    """Points of a body, some with axes turned (about z unless spatial)."""
    place = st.floats(-size, size, allow_subnormal=False)
    points = st.builds(body.point, place, place, place if spatial else st.just(0.0))
    unit = st.sampled_from([(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 2.0, -2.0)])
    angles = st.floats(-math.pi, math.pi, allow_subnormal=False).filter(bool)
    turned = st.builds(Frame.turned, points, angles, unit if spatial else st.just((0.0, 0.0, 1.0)))
    return st.one_of(points, turned)


def trees(bodies: int = 4, spatial: bool | None = None, most: int = 6) -> st.SearchStrategy[mbd.Model]:
    """Models of up to `bodies` bodies in a tree with joints of any kind and at most `most` coordinates.

    spatial : joints in space, in the plane, or (None) either
    """
    either = st.booleans() if spatial is None else st.just(spatial)
    return st.builds(random_tree, seed=SEEDS, bodies=st.integers(1, bodies), spatial=either, most=st.just(most))


def loops(bars: int = 5) -> st.SearchStrategy[tuple[mbd.Model, dict[str, float]]]:
    """(model, angles at which it closes) of planar loops of 3 to `bars` bars between two points of the ground."""
    return st.builds(random_loop, seed=SEEDS, bars=st.integers(3, max(bars, 3)))


def scenes(bodies: int = 4) -> st.SearchStrategy[mbd.Model]:
    """Planar models with feet, bumpers, stops, losses and springs."""
    return st.builds(random_scene, seed=SEEDS, bodies=st.integers(1, bodies))


def states(
    model: mbd.Model, around: Mapping[str, float] | None = None, size: float = 0.5, closed: Sequence[str] = ()
) -> st.SearchStrategy[mbd.State]:
    """Consistent states of a model: coordinates and rates drawn within `size`, then assembled.

    around : positions that the drawn ones are added to, such as those at which a loop closes
    closed : contacts that are closed; the others are taken as open, wherever they are
    """
    from mbd.compile.mechanisms import mechanism_of

    equations = mechanism_of(model, "python").equations
    names = [coordinate.name for coordinate in equations.coordinates]
    opened = [contact.name for contact in equations.contacts if contact.name not in closed]

    def made(place: dict[str, float], speed: dict[str, float]) -> mbd.State:
        moved = {name: value + (around or {}).get(name, 0.0) for name, value in place.items()}
        return mbd.assemble(
            model, position=moved, velocity=speed, closed=closed, open=opened, project=True, backend="python"
        )

    return st.builds(made, postures(*names, size=size), postures(*equations.velocity_names, size=size))
