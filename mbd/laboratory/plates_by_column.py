"""Force plates in columns of numbers: ``ground_force_vx``, ``1_ground_force_px``, ``plate_1_torque_y``, …"""

import re
from collections.abc import Mapping

import numpy as np

from mbd.arrays import Vector
from mbd.laboratory.recording import PlateRecord

COLUMN = re.compile(r"^(?P<stem>.*?)_?(?P<kind>force|torque|moment)(?P<number>_?\d+)?_(?P<part>v|p|m)?(?P<axis>[xyz])$")
"""OpenSim's names of loads that act from outside: force (v), point (p) and torque along an axis."""


def plates_by_column(
    time: Vector, channels: Mapping[str, Vector]
) -> tuple[dict[str, Vector], tuple[PlateRecord, ...], list[str]]:
    """The channels that are no loads, the plates, and what was done.

    A load needs a force and a point in three components; torques about its point are optional.
    """
    groups: dict[tuple[str, str], dict[str, str]] = {}
    for name in channels:
        found = COLUMN.match(name)
        if found is None:
            continue
        kind = "m" if found["kind"] in ("torque", "moment") else found["part"] or ""
        if kind in ("v", "p", "m"):
            groups.setdefault((found["stem"], (found["number"] or "").strip("_")), {})[kind + found["axis"]] = name
    plates, used = list[PlateRecord](), set[str]()
    for (stem, number), names in groups.items():
        if not all(f"{kind}{axis}" in names for kind in "vp" for axis in "xyz"):
            continue
        force, point, torque = (
            np.column_stack([channels[names[kind + axis]] if kind + axis in names else np.zeros(len(time))
                             for axis in "xyz"]) for kind in "vpm"
        )  # fmt: skip
        force, torque = np.nan_to_num(force, nan=0.0), np.nan_to_num(torque, nan=0.0)
        plate = PlateRecord.at(f"plate {len(plates) + 1}", time, force, point)
        plates.append(PlateRecord(plate.name, time, force, plate.moment + torque, None, plate.height))
        used |= set(names.values())
        del stem, number
    rest = {name: values for name, values in channels.items() if name not in used}
    remarks = [f"{len(plates)} plates from columns of forces and points"] if plates else []
    return rest, tuple(plates), remarks
