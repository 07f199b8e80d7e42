"""Parts of a leg: feet, knees, ankles, sockets and the body, each a function that adds words to a model.

A part takes the model, its name, the frames that it joins and its numbers; everything that it adds begins with the
name, so that two of a kind live side by side. ``mbd.parts.locking_knee(model, "left knee", thigh.end, shank.start)``
connects 'left knee' and constrains 'left knee lock'. See docs/parts.md for equations and sources.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mbd.parts.ankles.bumpers import bumper_ankle as bumper_ankle
    from mbd.parts.ankles.hydraulic import hydraulic_ankle as hydraulic_ankle
    from mbd.parts.ankles.series_elastic import series_elastic_ankle as series_elastic_ankle
    from mbd.parts.ankles.tabulated import tabulated_ankle as tabulated_ankle
    from mbd.parts.body.moments import PASSIVE_MOMENTS as PASSIVE_MOMENTS, passive_moment as passive_moment
    from mbd.parts.body.segments import BodySegment as BodySegment, Person as Person, person as person
    from mbd.parts.body.socket import elastic_socket as elastic_socket
    from mbd.parts.feet.arc import arc_foot as arc_foot
    from mbd.parts.feet.capsule import capsule_foot as capsule_foot
    from mbd.parts.feet.heel_and_toe import heel_and_toe as heel_and_toe
    from mbd.parts.feet.keel import keel_foot as keel_foot
    from mbd.parts.feet.point import point_foot as point_foot
    from mbd.parts.feet.polygon import polygon_foot as polygon_foot
    from mbd.parts.feet.profile import profile_foot as profile_foot
    from mbd.parts.knees.four_bar import (
        HEIGHT_3R60 as HEIGHT_3R60,
        PIVOTS_3R60 as PIVOTS_3R60,
        STANCE_3R60 as STANCE_3R60,
        SWING_3R60 as SWING_3R60,
        four_bar_knee as four_bar_knee,
    )
    from mbd.parts.knees.friction_brake import friction_brake_knee as friction_brake_knee
    from mbd.parts.knees.hinge import stop_knee as stop_knee
    from mbd.parts.knees.hydraulic import hydraulic_knee as hydraulic_knee, orifice as orifice
    from mbd.parts.knees.locking import locking_knee as locking_knee
    from mbd.parts.knees.magnetorheological import (
        PHASES as PHASES,
        magnetorheological_knee as magnetorheological_knee,
        phase as phase,
    )
    from mbd.parts.knees.pneumatic import gas_energy as gas_energy, pneumatic_knee as pneumatic_knee
    from mbd.parts.knees.powered import powered_knee as powered_knee

_HOMES = {
    "ankles.bumpers": "bumper_ankle",
    "ankles.hydraulic": "hydraulic_ankle",
    "ankles.series_elastic": "series_elastic_ankle",
    "ankles.tabulated": "tabulated_ankle",
    "body.moments": "PASSIVE_MOMENTS passive_moment",
    "body.segments": "BodySegment Person person",
    "body.socket": "elastic_socket",
    "feet.arc": "arc_foot",
    "feet.capsule": "capsule_foot",
    "feet.heel_and_toe": "heel_and_toe",
    "feet.keel": "keel_foot",
    "feet.point": "point_foot",
    "feet.polygon": "polygon_foot",
    "feet.profile": "profile_foot",
    "knees.four_bar": "HEIGHT_3R60 PIVOTS_3R60 STANCE_3R60 SWING_3R60 four_bar_knee",
    "knees.friction_brake": "friction_brake_knee",
    "knees.hinge": "stop_knee",
    "knees.hydraulic": "hydraulic_knee orifice",
    "knees.locking": "locking_knee",
    "knees.magnetorheological": "PHASES magnetorheological_knee phase",
    "knees.pneumatic": "gas_energy pneumatic_knee",
    "knees.powered": "powered_knee",
}

_NAMES = {name: module for module, names in _HOMES.items() for name in names.split()}

__all__ = [*_NAMES]


if not TYPE_CHECKING:  # type checkers know the names above, and that there are no others

    def __getattr__(name: str) -> Any:
        """A part, from its module, when it is first used (PEP 562)."""
        if name not in _NAMES:
            raise AttributeError(f"mbd.parts has no {name!r}; it has {', '.join(_NAMES)}")
        from mbd.arguments import explained

        value = globals()[name] = explained(getattr(importlib.import_module(f"mbd.parts.{_NAMES[name]}"), name))
        return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_NAMES})
