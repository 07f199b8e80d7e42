"""Points to look at: places on bodies that results, plots and pages show under a name of their own."""

from typing import Any

from mbd.bodies.base import Body, Frame
from mbd.bodies.values import name_of, triple
from mbd.dataclass import dataclass
from mbd.errors import ModelError


@dataclass(frozen=True, repr=False, init=False)
class Marker(Frame):
    """A point of a body under a name of its own, as markers of a gait laboratory have: ``run["heel.x"]``.

    It is among the results of every model that has the body, with its velocity ``heel.vx`` and acceleration
    ``heel.ax``, in ground axes, and on the page, whether anything uses it or not. The motion does not change, and steps
    cost nothing for it. It is a frame as any other: joints, forces and measures may hold it.

    Parameters
    ----------
    name : its name in results
    body : the body that carries it, or a frame at whose place it is (it takes no `place` then)
    place : (x, y) or (x, y, z) in body axes [m]; the run-time parameters 'heel.x', …

    Raises
    ------
    ModelError
        for a name that is none, what is neither body nor frame, and a place that is no point.

    >>> from mbd.bodies.link import Link
    >>> shank = Link("shank", mass=3.0, length=0.4, center=0.2)
    >>> Marker("heel", shank, (-0.05, -0.4))
    <heel>
    """

    def __init__(self, name: str, body: Body | Frame, place: Any = None) -> None:
        name_of(name, "Marker")
        if not isinstance(body, Body | Frame):
            raise ModelError(f"Marker '{name}' lies on a body or at a frame of one, such as shank.end; got {body!r}")
        frame = body if isinstance(body, Frame) else body.origin
        if isinstance(body, Frame) and place is not None:
            raise ModelError(f"Marker '{name}' lies at '{frame.full_name}'; give a place to a body, not to a frame")
        if isinstance(body, Body) and place is None:
            raise ModelError(f"Marker '{name}': give its place on '{body.name}', such as (0.1, -0.4), or a frame")
        known = place is None and frame.landmark is not None
        put = object.__setattr__
        put(self, "body", frame.body)
        put(self, "name", name)
        put(self, "offset", frame.offset if place is None else triple(place, f"place of Marker '{name}'"))
        put(self, "rotation", frame.rotation if place is None else None)
        put(self, "landmark", frame.landmark if known else None)
        frame.body.remember(self)

    @property
    def full_name(self) -> str:
        """'heel': without its body."""
        return self.name
