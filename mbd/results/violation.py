"""How far the active constraints of a run are from holding."""

import numpy as np

from mbd.dataclass import dataclass
from mbd.results.columns import ModelColumns


@dataclass(frozen=True)
class Violation:
    """Largest |h| of the active rows over a run, by unit, and where it occurred.

    length [m], angle [rad] (about π where a cut joint in space is put together the wrong way round), rate: largest
    |ḣ|, also of rows on velocities [m/s or rad/s]; worst : owner and part of the row with the largest |h|, '' without
    rows; unit : its unit
    """

    length: float = 0.0
    angle: float = 0.0
    rate: float = 0.0
    worst: str = ""
    unit: str = "m"

    def __str__(self) -> str:
        if not self.worst:
            return "no constraint rows"
        turns = bool(self.angle) or self.unit == "rad"
        sizes = [f"{self.length:.2g} m"] if self.length or not turns else []
        sizes += [f"{self.angle:.2g} rad"] if turns else []
        return f"{' and '.join(sizes)} ({self.worst}), {self.rate:.2g} /s in rate"


def violation(columns: ModelColumns) -> Violation:
    """max |h| and max |ḣ| over the stored rows, each constraint row only while it is active.

    Rows of dry friction are left out: they hold only while it sticks, which rows of results do not tell.
    """
    rows = columns.equations.rows
    if not rows:
        return Violation()
    values = columns.evaluate([row.value for row in rows] + [row.rate for row in rows], columns.rows)
    largest: dict[str, float] = {}
    fastest, worst, unit, highest = 0.0, "", "m", -1.0
    facings = columns.equations.facings
    for facing, cosine in zip(facings, columns.evaluate([f.cosine for f in facings], columns.rows), strict=True):
        if float(np.min(cosine)) < 0.0:  # its rows are small, but those of a joint half a turn off
            highest, worst, unit = float(np.arccos(max(-1.0, float(np.min(cosine))))), facing.joint, "rad"
            largest["rad"] = max(largest.get("rad", 0.0), highest)
    for number, row in enumerate(rows):
        if row.friction >= 0:
            continue
        active = columns.record.closed[:, row.contact].astype(bool) if row.contact >= 0 else np.True_
        size = float(np.max(np.abs(values[number]), initial=0.0, where=active))
        size = 0.0 if row.is_velocity else size
        largest[row.unit] = max(largest.get(row.unit, 0.0), size)
        fastest = max(fastest, float(np.max(np.abs(values[len(rows) + number]), initial=0.0, where=active)))
        if size > highest:
            highest, worst, unit = size, f"{row.owner}.{row.part}" if row.part else row.owner, row.unit
    return Violation(largest.get("m", 0.0), largest.get("rad", 0.0), fastest, worst, unit)
