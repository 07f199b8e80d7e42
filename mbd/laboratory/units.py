"""Units that files are written in."""

import math

FACTORS = {
    "m": 1.0, "meter": 1.0, "meters": 1.0, "metre": 1.0, "metres": 1.0,
    "mm": 1e-3, "millimeter": 1e-3, "millimeters": 1e-3, "millimetre": 1e-3, "millimetres": 1e-3,
    "cm": 1e-2, "centimeter": 1e-2, "centimeters": 1e-2, "dm": 1e-1, "in": 0.0254, "inch": 0.0254, "inches": 0.0254,
    "rad": 1.0, "radian": 1.0, "radians": 1.0, "deg": math.pi / 180.0, "degree": math.pi / 180.0,
    "degrees": math.pi / 180.0, "°": math.pi / 180.0,
    "n": 1.0, "kn": 1e3, "nm": 1.0, "n m": 1.0, "n*m": 1.0, "n·m": 1.0, "nmm": 1e-3, "n mm": 1e-3, "n*mm": 1e-3,
    "knm": 1e3, "s": 1.0, "sec": 1.0, "seconds": 1.0, "ms": 1e-3, "w": 1.0, "j": 1.0, "v": 1.0, "mv": 1e-3, "": 1.0,
    "rad/s": 1.0, "deg/s": math.pi / 180.0, "°/s": math.pi / 180.0, "m/s": 1.0, "mm/s": 1e-3, "m/s^2": 1.0,
    "g": 9.80665, "%": 1.0, "-": 1.0, "1": 1.0,
}  # fmt: skip
LENGTHS = {"m", "mm", "cm", "dm", "in", "inch", "inches"}


def factor_of(unit: str) -> float | None:
    """What a number in a unit is multiplied by to be in SI units and radians; None for a unit that is not known.

    >>> factor_of("mm"), factor_of("Nmm"), factor_of("furlong")
    (0.001, 0.001, None)
    """
    return FACTORS.get(unit.strip().lower())


def is_length(unit: str) -> bool:
    """Whether a unit is one of lengths."""
    plain = unit.strip().lower()
    return plain in LENGTHS or plain.rstrip("s").removesuffix("re").removesuffix("er").endswith("met")


def split_unit(label: str) -> tuple[str, str]:
    """A column's name and unit: 'knee angle [deg]', 'time (s)'.

    >>> split_unit("knee angle [deg]"), split_unit("RHEE.x")
    (('knee angle', 'deg'), ('RHEE.x', ''))
    """
    text = label.strip().strip('"').strip("'").strip()
    for left, right in ("[]", "()"):
        if text.endswith(right) and left in text:
            name, _, unit = text[:-1].rpartition(left)
            if name.strip() and factor_of(unit) is not None:
                return name.strip(), unit.strip()
    return text, ""
