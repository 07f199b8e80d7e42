"""The parameter section of a ``.c3d``, walked before a library reads it: a damaged one makes libraries run for ever.

The first byte of a file is the number of the block of 512 bytes where the section begins. Each entry has the length of
its name, the number of its group (negative: a group), the name, and how many bytes lie between the number that says so
and the next entry, 0 at the last one; a parameter then has a type, dimensions and data (The C3D file format, user
guide, ch. 5, 2008).
"""

import math
import struct
from pathlib import Path

from mbd.errors import TrajectoryError

BLOCK_BYTES = 512
PROCESSORS = {84: "<", 85: "<", 86: ">"}
"""Order of bytes by the kind of the processor: Intel, DEC, MIPS."""
TYPES = (-1, 1, 2, 4)
"""Sizes of numbers: characters, bytes, integers, reals."""


def check_parameters(path: Path) -> None:
    """Walk from entry to entry.

    Raises
    ------
    TrajectoryError
        for a section that has no end, or an entry that does not fit, with the place of its first byte.
    """
    data = path.read_bytes()
    if len(data) < 2 * BLOCK_BYTES or data[1] != 0x50:
        raise TrajectoryError(f"{path.name}: no .c3d, whose second byte is 80 and which has a header of 512 bytes")
    first = (data[0] - 1) * BLOCK_BYTES
    if first < 0 or first + 4 > len(data) or data[first + 3] not in PROCESSORS:
        raise TrajectoryError(f"{path.name}: its parameters should begin in block {data[0]}, where none do")
    order, at = PROCESSORS[data[first + 3]], first + 4
    while at + 2 <= len(data) and data[at]:
        length = abs(struct.unpack_from("b", data, at)[0])
        group = struct.unpack_from("b", data, at + 1)[0]
        place = at + 2 + length
        name = data[at + 2 : place]
        if place + 2 > len(data) or not all(32 <= byte < 127 for byte in name):
            raise TrajectoryError(f"{path.name}: a damaged name in the parameters, byte {at}")
        step = struct.unpack_from(f"{order}H", data, place)[0]
        room = step - 2 if step else len(data) - place - 2
        whole = _fits(data, place + 2, room) if group > 0 else _described(data, place + 2, 0, room)
        if not whole:
            raise TrajectoryError(
                f"{path.name}: {name.decode()!r} of its parameters does not fit into its place, byte {at}"
            )
        if step == 0:
            return
        at = place + step
    if at + 2 > len(data):
        raise TrajectoryError(f"{path.name}: its parameters run beyond the end of the file")


def _fits(data: bytes, place: int, room: int) -> bool:
    """Whether type, dimensions, numbers and description of a parameter fit into so many bytes."""
    if room < 2 or place + 2 > len(data):
        return False
    size, count = struct.unpack_from("bB", data, place)
    if size not in TYPES or count > 7 or place + 2 + count > len(data):
        return False
    numbers = math.prod(data[place + 2 : place + 2 + count])
    return _described(data, place, 2 + count + abs(size) * numbers, room)


def _described(data: bytes, place: int, before: int, room: int) -> bool:
    """Whether a description that follows so many bytes fits too, if there is room for one."""
    if before >= room:
        return before == room
    at = place + before
    return at < len(data) and before + 1 + data[at] <= room
