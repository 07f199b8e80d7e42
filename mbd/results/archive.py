"""Arrays and words in one ``.npz`` file: written whole or not at all, read no further than they are told to be.

A file is read in three looks. The words (JSON, the member `meta`) tell which arrays there must be. The heads of these,
some hundred bytes each, tell their shapes and kinds, which the caller judges; what they would take must fit into
memory. Only then are the numbers read. Members that nobody asked for are never opened, and a hash over all others tells
of any change.
"""

from __future__ import annotations

import hashlib
import json
import os
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from mbd.dataclass import dataclass
from mbd.errors import MbdError, TrajectoryError
from mbd.free_memory import available, size_in_words

COMPRESSION = 1
"""Level of zlib: higher levels take five times as long for a few percent [-]."""
SAMPLE, WORTH = 1 << 15, 0.5
"""How much of an array is compressed to see whether that pays [bytes], and how small it must become for it [-]."""
WORDS, TIMES = 200, 200
"""How many times larger than in the file the words, and the instants, may become [-]."""
META, HASH = "meta", "hash"
"""Members beside the arrays: words, and the hash of all others."""

Arrays = dict[str, NDArray[Any]]


class Unreadable(Exception):
    """What in a file is not as `write` left it; becomes a `TrajectoryError` that names the file."""


@dataclass(frozen=True)
class Head:
    """Kind ('f', 'i', 'u', 'b') and shape of an array in a file, before it is read."""

    kind: str
    shape: tuple[int, ...]


def plain(value: Any) -> Any:
    """A number, list or text for JSON in place of a numpy value; the printed form of anything else."""
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.tolist()
    return repr(value)


WRITERS = {
    ".csv": "run.to_csv(path)", ".html": "run.page(path)", ".png": "run.plot(path=…)", ".sto": "run.to_sto(path)",
    ".xlsx": "run.to_dataframe().to_excel(path)",
}  # fmt: skip
"""What writes a file of a run, by how its name ends."""


def named_file(path: Any, suffix: str = "") -> Path:
    """Where a file is to be written, with `suffix` if its name has none.

    Raises
    ------
    TrajectoryError
        for what names no file, and a name that ends as files of another kind do.
    """
    target = Path(path) if isinstance(path, str | os.PathLike) else Path()
    writer = WRITERS.get(target.suffix.lower(), "")
    if suffix and writer and target.suffix.lower() != suffix:
        raise TrajectoryError(f"a file that ends in {suffix} is written here, not {str(path)!r}; for that: {writer}")
    if not target.name or target.is_dir():
        known = ", which is a folder" if target.name and target.is_dir() else ""
        raise TrajectoryError(f"a file to write to is expected, such as 'run{suffix}', not {path!r}{known}")
    is_device = target.exists() and not target.is_file()  # such as /dev/full, beside which nothing is to be written
    return target if target.suffix or not suffix or is_device else target.with_name(target.name + suffix)


class NotWritten(TrajectoryError, OSError):
    """A file that cannot be written; for who expects an `OSError` it is one."""


@contextmanager
def writing(target: Path) -> Iterator[None]:
    """Name the file in the error of one that cannot be written, such as on a full disk (a `TrajectoryError`)."""
    try:
        yield
    except OSError as error:
        if isinstance(error, NotWritten):
            raise
        raise NotWritten(f"'{target}' cannot be written: {error.strerror or error}") from error


def file_to_read(path: Any) -> Path:
    """A path; a `TrajectoryError` for what is none."""
    if isinstance(path, str | os.PathLike):
        return Path(path)
    raise TrajectoryError(f"the path of a file to read is expected, such as 'run.mbd.npz', not {path!r}")


def shrinks(array: NDArray[Any]) -> bool:
    """Whether compressing pays: it takes four times as long as writing, and most reals of a motion keep their size."""
    data = array.reshape(-1).view(np.uint8)
    sample = data[: SAMPLE // 2].tobytes() + data[-(SAMPLE // 2) :].tobytes()
    return len(zlib.compress(sample, COMPRESSION)) < WORTH * len(sample)


def write(target: Path, arrays: Arrays, meta: Mapping[str, Any]) -> None:
    """Write arrays and words, with a hash over both."""
    text = json.dumps({**meta, "hashed": True}, default=plain)
    every = {**arrays, META: np.frombuffer(text.encode(), dtype=np.uint8)}
    every = {name: np.ascontiguousarray(array) for name, array in every.items()}
    every[HASH] = np.frombuffer(_hash(every), dtype=np.uint8)

    def fill(partial: Path) -> None:
        with zipfile.ZipFile(partial, "w", compresslevel=COMPRESSION) as archive:
            for name, array in every.items():
                entry = zipfile.ZipInfo(f"{name}.npy")
                entry.compress_type = zipfile.ZIP_DEFLATED if shrinks(array) else zipfile.ZIP_STORED
                with archive.open(entry, "w", force_zip64=True) as member:
                    np.lib.format.write_array(member, array, allow_pickle=False)

    write_whole(target, fill)


def write_whole(target: Path, fill: Callable[[Path], Any]) -> None:
    """Write beside the target, then rename, so that a reader never sees half a file; not beside a device or a pipe."""
    with writing(target):
        target.parent.mkdir(parents=True, exist_ok=True)
        if target.exists() and not target.is_file():
            fill(target)
            return
        partial = target.with_name(f".{target.name}.{os.getpid()}.{os.urandom(4).hex()}")
        try:
            fill(partial)
            partial.replace(target)
        finally:
            partial.unlink(missing_ok=True)


def _hash(arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Hash of names, kinds, shapes and numbers of all arrays but the hash itself."""
    digest = hashlib.sha256()
    for name in sorted(arrays):
        if name != HASH:
            array = np.ascontiguousarray(arrays[name])
            digest.update(f"{name}\0{array.dtype.str}\0{array.shape}\0".encode())
            digest.update(array.reshape(-1).view(np.uint8).data if array.size else b"")
    return digest.digest()


class Members:
    """An open file: heads at once, numbers on demand."""

    def __init__(self, archive: zipfile.ZipFile) -> None:
        self._archive = archive
        self._known = {info.filename.removesuffix(".npy"): info for info in archive.infolist()}
        if len(self._known) != len(archive.infolist()):
            raise Unreadable("two members have one name")

    @property
    def names(self) -> frozenset[str]:
        """Names of all members."""
        return frozenset(self._known)

    def head(self, name: str) -> Head:
        """Kind and shape of an array, whose size must be what the file says of it."""
        with self._archive.open(self._info(name)) as member:
            shape, dtype, _ = self._checked_head(name, member)
        return Head(dtype.kind, shape)

    def size(self, name: str) -> int:
        """Bytes of a member when it is read."""
        return self._info(name).file_size

    def growth(self, name: str) -> float:
        """How many times larger than in the file a member becomes; 1 for a small one."""
        info = self._info(name)
        # size below which no member is too large [bytes]
        return info.file_size / max(info.compress_size, 1) if info.file_size > (1 << 22) else 1.0

    def read(self, name: str) -> NDArray[Any]:
        """The numbers of an array."""
        with self._archive.open(self._info(name)) as member:
            shape, dtype, fortran = self._checked_head(name, member)
            array: NDArray[Any] = np.empty(shape, dtype, order="F" if fortran else "C")
            view = array.reshape(-1, order="A").view(np.uint8).data
            place = 0
            while place < len(view):
                count = member.readinto(view[place : place + (1 << 20)])  # type: ignore[attr-defined]
                if not count:
                    raise Unreadable(f"{name!r} ends too soon")
                place += count
            if member.read(1):
                raise Unreadable(f"{name!r} is longer than it says")
        return array

    def _info(self, name: str) -> zipfile.ZipInfo:
        if name not in self._known:
            raise Unreadable(f"it has no {name!r}")
        return self._known[name]

    def _checked_head(self, name: str, member: Any) -> tuple[tuple[int, ...], np.dtype[Any], bool]:
        """Shape, kind and order of an array whose head is read from the member."""
        version = np.lib.format.read_magic(member)
        readers = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
        if version not in readers:
            raise Unreadable(f"{name!r} is no array")
        shape, fortran, dtype = readers[version](member)
        if dtype.kind not in "fiub" or dtype.itemsize > 8 or not dtype.isnative or len(shape) > 2:
            raise Unreadable(f"{name!r} has the kind {dtype} and the shape {shape}")
        size = dtype.itemsize
        for length in shape:
            if not isinstance(length, int) or length < 0:
                raise Unreadable(f"{name!r} has the shape {shape}")
            size *= length
        if member.tell() + size != self.size(name):
            raise Unreadable(f"{name!r} has another size than it says")
        return shape, dtype, fortran


Content = TypeVar("Content")
Judge = Callable[[dict[str, Any], Members], Iterable[str]]
"""Names of the arrays that are to be read, from the words and the heads; raises `Unreadable` if these disagree."""


def read(
    source: Path,
    kind: str,
    version: int,
    written_by: str,
    judge: Judge,
    make: Callable[[dict[str, Any], Arrays], Content],
) -> Content:
    """What a file of one kind ('mbd run', 'mbd failure') holds, made by `make` from its words and arrays.

    Raises
    ------
    FileNotFoundError
        where there is no file.
    TrajectoryError
        for anything in it that `write` has not left so, whatever it is.
    """
    name = kind.removeprefix("mbd ")
    if not source.is_file():
        raise FileNotFoundError(f"no {name} file at '{source}'")
    refusal = f"'{source}' is not a {name} of mbd; expected a file written by {written_by}"
    try:
        with zipfile.ZipFile(source) as archive:
            members = Members(archive)
            meta = _words(members, source, kind, version, refusal)
            arrays = _arrays(members, judge(meta, members), meta)
        return make(meta, arrays)
    except (TrajectoryError, PermissionError):
        raise
    except Exception as error:  # of bytes from anywhere: zipfile, zlib, JSON raise what they like
        raise TrajectoryError(f"{refusal} ({_short(error)})") from error


def _short(error: Exception) -> str:
    """What was wrong, on one line."""
    text = " ".join(str(error).split()) or type(error).__name__
    words = text if isinstance(error, Unreadable | MbdError) else f"{type(error).__name__}: {text}"
    return words if len(words) <= 200 else words[:200] + " …"


def _words(members: Members, source: Path, kind: str, version: int, refusal: str) -> dict[str, Any]:
    """The words of a file, if it is of this kind and no newer than we are."""
    if members.growth(META) > WORDS:
        raise Unreadable(f"its words would take {size_in_words(members.size(META))}")
    meta = json.loads(members.read(META).tobytes())
    if not isinstance(meta, dict) or meta.get("format") != kind:
        raise TrajectoryError(refusal)
    number = meta.get("version")
    if not isinstance(number, int) or isinstance(number, bool) or number < 1:
        raise Unreadable(f"its version is {number!r}")
    if number > version:
        raise TrajectoryError(f"'{source}' was written by a newer mbd (format {number}, here {version}); update mbd")
    return meta


def _arrays(members: Members, wanted: Iterable[str], meta: Mapping[str, Any]) -> Arrays:
    """The arrays that were asked for, if they fit into memory and agree with the hash; older files have none."""
    names = sorted(set(wanted))
    for name in names:
        members.head(name)
        if name == "time" and members.growth(name) > TIMES:
            raise Unreadable(f"its instants would take {size_in_words(members.size(name))}")
    size, free = sum(members.size(name) for name in names), available()
    if size > 0.5 * free:
        raise Unreadable(f"it needs {size_in_words(size)} of memory, of which {size_in_words(free)} are free")
    arrays = {name: members.read(name) for name in names}
    if HASH in members.names or meta.get("hashed"):
        if members.head(HASH) != Head("u", (32,)):
            raise Unreadable("its hash is none")
        if members.read(HASH).tobytes() != _hash({**arrays, META: members.read(META)}):
            raise Unreadable("it was changed after it had been written")
    return arrays
