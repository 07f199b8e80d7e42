"""A run by name: what `simulate` returns and `load` reads."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from mbd.arrays import Matrix, Vector
from mbd.bodies.values import shown
from mbd.errors import TrajectoryError
from mbd.later import later
from mbd.notebook import Values, folded, table
from mbd.results.columns import Columns, ModelColumns, gather
from mbd.results.facts import Facts
from mbd.results.finite import require_finite
from mbd.results.interpolation import OneSide, Side
from mbd.results.names import scalars_behind
from mbd.results.orientations import doubt_singular
from mbd.results.record import EventRecord, Events, Record
from mbd.state import State

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from mbd.results.failure import Failure
    from mbd.results.impulses import Impulses
    from mbd.results.ledger import Ledger
    from mbd.results.storage import Archive
    from mbd.results.violation import Violation

__all__ = ["EventRecord", "Record", "Moments", "Trajectory", "load"]


class Trajectory:
    """The motion of a model, asked for by name.

    ``run["left hip.angle"]`` is an (R,) array over `run.time`; ``run["left shank.end"]`` is (R, 3). Rows just before
    and just after a switch are both stored, with equal times.

    Parameters
    ----------
    record : the run as numbers
    archive : the named columns of a run read from a file; None evaluates them with the model's equations
    """

    def __init__(self, record: Record, archive: Archive | None = None) -> None:
        self.record = record
        self._archive = archive
        self._known: dict[str, Vector | Matrix] = {}

    @cached_property
    def columns(self) -> Columns:
        """Where named quantities come from."""
        if self._archive is not None:
            return self._archive.columns
        return self._model_columns

    @cached_property
    def _model_columns(self) -> ModelColumns:
        if self.record.equations is None:
            raise TrajectoryError("this run has neither equations nor stored columns")
        return ModelColumns(self.record, self.record.equations)

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """Asked for what is no attribute: results go by their names."""
            hidden = name.startswith("_") or name == "columns" or "record" not in self.__dict__
            known = () if hidden else self.columns.names
            same = [each for each in known if each.startswith(f"{name}.") or each.split()[0] == name]
            near = next(iter([*same, *(each for each in known if "." in each)]), None)
            hint = "" if near is None else f"; results are asked for by name, such as run[{near!r}]"
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}{hint}")

    # values -----------------------------------------------------------------------------------------------------
    @property
    def time(self) -> Vector:
        """Times of the stored rows (R,) [s]."""
        return self.record.time

    @property
    def t(self) -> Vector:
        """`time`, under the name of ``scipy.integrate.solve_ivp``."""
        return self.record.time

    def __getitem__(self, name: str) -> Vector:
        """A named quantity at every stored row: (R,), or (R, 3) for a vector."""
        if not isinstance(name, str):
            raise TrajectoryError(
                f"a run is asked for one quantity by its name, such as run['hip.angle'], not {name!r}"
            )
        if name not in self._known:
            value = gather(self.columns, self.columns.at_rows, name)
            require_finite(name, value, self.time, self.facts)
            doubt_singular(name, value, self.facts, lambda other: gather(self.columns, self.columns.at_rows, other))
            value = self.facts.worded(name, value)
            value.flags.writeable = False
            self._known[name] = value
        return self._known[name]

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and bool(scalars_behind(name, self.columns.knows))

    def __len__(self) -> int:
        return len(self.record.time)

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    @property
    def names(self) -> tuple[str, ...]:
        """Every named scalar of the run; ``name.x``, ``name.y``, ``name.z`` are also one vector ``name``."""
        return self.columns.names

    def _ipython_key_completions_(self) -> list[str]:
        return [*self.columns.names, *self.columns.vectors]

    def at(self, times: ArrayLike, side: Side = "right") -> Moments:
        """Named quantities at any times of the run.

        The state is interpolated within the smooth segment that holds the time, never across a switch, and quantities
        are evaluated from it. For `mbd.RungeKutta853` a step from the row before ends there, as accurate as the rows.
        With dry friction, with ``store`` other than 1, in a run that was read from a file, and for `mbd.RadauIIA`,
        positions are polynomials of degree 8 through q, v and v̇ of three rows (degree 5 where fewer lie between two
        events); for other schemes cubic Hermite polynomials (q with v, v with v̇), whose error is of order dt⁴.
        Accelerations, multipliers and all forces and reactions that follow from them are solved from the balance of
        forces there, with the contacts and frictions of the interval, and are as accurate as at the rows; where forces
        are too stiff for the steps, interpolated. A run that was read from a file does the same if it has its
        equations (`save`).

        Parameters
        ----------
        times : one time or several [s]
        side : at a switch, the values after it ('right' or 'after') or before it ('left' or 'before')

        Then ``run.at([0.1, 0.2])["left hip.angle"]``.
        """
        return Moments(self.columns, times, side, self.facts)

    # what happened ----------------------------------------------------------------------------------------------
    @property
    def events(self) -> Events:
        """What happened, in order: `time`, `kind`, `name`, `impulse`, `energy_loss`.

        kind is 'closed' or 'opened' of a contact, 'stuck' or 'slipped' of dry friction, or 'event'.
        """
        return Events(self.record.events)

    @property
    def impulses(self) -> Impulses:
        """The impulses of all impacts, a line each: of the contacts that closed, of those closed before, of friction.

        ``run.impulses.to_dataframe()`` has columns time, event, name, part, impulse, unit. Their sum over an impact
        changes the momentum: ``M (v⁺ − v⁻) = Bᵀ Λ``.
        """
        from mbd.results.impulses import impulses_of

        return impulses_of(self.record.events, self.facts, self.names)

    @cached_property
    def energy(self) -> Ledger:
        """The energy ledger: kinetic, potential, and every part that changed them, with what is numerical apart."""
        if self._archive is not None:
            return self._archive.ledger
        from mbd.results.energy import ledger

        return ledger(self._model_columns)

    @cached_property
    def violation(self) -> Violation:
        """How far the active constraints are from holding."""
        if self._archive is not None:
            return self._archive.violation
        from mbd.results.violation import violation

        return violation(self._model_columns)

    @property
    def stats(self) -> dict[str, Any]:
        """Counts and wall times."""
        return Values("counts and wall times", self.record.stats)

    @property
    def settings(self) -> dict[str, Any]:
        """How the run was made."""
        return Values("settings", self.record.settings)

    @property
    def parameters(self) -> dict[str, float]:
        """Values of the run-time parameters at the start, by name."""
        values = self.record.parameters[: len(self.record.parameter_names)]
        return Values("parameters", dict(zip(self.record.parameter_names, map(float, values), strict=True)))

    @property
    def success(self) -> bool:
        """Whether the run went as far as it was asked to."""
        return self.record.success

    @property
    def message(self) -> str:
        """How the run ended, in a sentence."""
        return self.record.message

    @property
    def failure(self) -> Failure | None:
        """What is needed to replay the step that failed, with `mbd.replay`; None after a success."""
        failure: Failure | None = self.record.failure
        return failure

    @property
    def status(self) -> int:
        """0: reached its end time, 1: an event ended it, −1: it failed (as in ``scipy.integrate.solve_ivp``)."""
        if not self.record.success:
            return -1
        return int(self.record.message.startswith("ended by"))

    @cached_property
    def sensitivities(self) -> Any:
        """Derivatives of the final state and its instant, of a run by ``mbd.simulate(…, wrt=[…])``."""
        words = self.record.stats.get("sensitivities")
        if words is None:
            raise TrajectoryError("this run has no derivatives; give what they are by: mbd.simulate(…, wrt=[…])")
        return later("Trajectory.sensitivities")(words, self)

    @property
    def final(self) -> State:
        """The state at the end, to go on from; with the same scheme and step as if there had been no end."""
        final: State = self.record.final
        return final

    @cached_property
    def facts(self) -> Facts:
        """Names and units of the model."""
        if self._archive is not None:
            return self._archive.facts
        equations = self._model_columns.equations
        known: Facts | None = equations.memory.get("facts")
        if known is None:
            known = equations.memory["facts"] = Facts.of(equations)
        return known

    @property
    def name(self) -> str:
        """Name of the model."""
        return self.facts.model

    def summary(self) -> str:
        """The run in a few lines of text: what ran, how it ended, what it came to, energy, constraints, cost.

        What it came to is said by these rules, and nothing where none holds:

        - came to rest: over the last 5 % of the time the kinetic energy was below 10⁻⁶ of its largest of the run.
        - fell: of a mechanism with contacts at places of its bodies, and no other point that stays where it is, the
          height (of the highest point of the figure over the lowest, along gravity) is at the end below half of that
          at the start; or a contact that is ignored is further below its surface than a quarter of it.
        - walks: it did not fall, it has three steps at least (`mbd.analysis.gait`: touchdowns of one foot after the
          other), and its last touchdown is at least half as far from the first as the way from one to the next.
        - in motion: none of these.

        Contacts that are closed at the end are named. Of runs that fail the message says why.
        """
        text: str = later("Trajectory.summary")(self)
        return text

    # pictures and files -----------------------------------------------------------------------------------------
    def plot(self, *names: str, path: str | Path | None = None, degrees: bool = True) -> Figure:
        """Time histories, one panel per kind of quantity, with the events marked and times of contact shaded.

        Without names the model's coordinates. Axes of angles are in degrees, or in radians with ``degrees=False``;
        results are in radians whatever is drawn. Returns the matplotlib figure, also saved when a path is given: SVG
        follows the reader's light or dark page, others the paper of matplotlib's present style.
        """
        figure: Figure = later("Trajectory.plot")(self, *names, path=path, degrees=degrees)
        return figure

    def page(self, path: str | Path) -> Path:
        """One self-contained HTML file with the animated mechanism, its contacts, energies and events."""
        written: Path = later("Trajectory.page")(self, path)
        return written

    def save(self, path: str | Path, names: Sequence[str] | None = None) -> Path:
        """The run as one ``.npz`` file, with every named quantity (or those listed), readable without the model.

        Read it with `mbd.load`.
        """
        from mbd.results.storage import Archive, save

        return save(self.record, Archive.of(self), path, names)

    def animate(self, height: int = 640) -> Any:
        """The page's animation in the cell of a notebook, `height` pixels high; the notebook holds it when it is saved.

        Shown by Jupyter, VS Code and Colab without an extension; `page` writes the same as a file.
        """
        return later("Trajectory.animate")(self, height)

    def __reduce__(self) -> tuple[Any, ...]:
        """To another process it travels as the file that `save` writes."""
        with TemporaryDirectory() as folder:
            return _received, (self.save(Path(folder) / "run").read_bytes(),)

    def to_dataframe(
        self, names: Sequence[str] | None = None, at: ArrayLike | None = None, side: OneSide | None = None
    ) -> Any:
        """A pandas table with `time` as index and a column per name (all of `names` by default).

        Parameters
        ----------
        names : of scalars and vectors; a vector gives three columns
        at : times in order [s], or a distance in time [s] for equal intervals from the start; None for the stored rows
        side : at an event the values 'after' or 'before' it, once. None gives both, in two rows of equal time, where
            `at` is None, and those after it else

        Units are in ``attrs["units"]``, words in ``attrs["long_names"]``, by column.
        """
        from mbd.results.tables import dataframe

        return dataframe(self, names, at, side)

    def to_csv(
        self, path: str | Path, names: Sequence[str] | None = None, at: ArrayLike | None = None,
        side: OneSide | None = None,
    ) -> Path:  # fmt: skip
        """Write `to_dataframe` as a file of comma-separated values."""
        from mbd.results.tables import csv_file

        return csv_file(self, path, names, at, side)

    def to_xarray(
        self, names: Sequence[str] | None = None, at: ArrayLike | None = None, side: OneSide | None = None
    ) -> Any:
        """An xarray dataset over `time`; vectors asked for by name have a further dimension `axis`.

        That of a quaternion is `part` (w, x, y, z), that of Euler angles `turn` (1, 2, 3).

        `at` and `side` as for `to_dataframe`: with one of them every time is there once, so that
        ``sel(time=0.3, method="nearest")`` works. Each variable has its unit and a name in words in ``attrs``.
        """
        from mbd.results.tables import dataset

        return dataset(self, names, at, side)

    def to_sto(
        self, path: str | Path, names: Sequence[str] | None = None, at: ArrayLike | None = None,
        degrees: bool | None = None,
    ) -> Path:  # fmt: skip
        """Write columns over time as a storage file of OpenSim, ``run.to_sto("swing.mot", ["hip.angle"])``.

        Parameters
        ----------
        path : ending in .sto, or in .mot, a motion
        names : of scalars and vectors; a vector gives three columns; all of `names` by default. Spaces in them become
            underscores, 'left_hip.angle'; discrete states are numbers from 0
        at : as for `to_dataframe`; at an event the values after it
        degrees : whether angles and their rates are in degrees; None: in a .mot file

        Raises
        ------
        TrajectoryError
            for another ending, unknown names, times outside the run.
        """
        from mbd.results.opensim import storage_file

        return storage_file(self, path, names, at, degrees)

    def __repr__(self) -> str:
        from mbd.results.summary import text

        return text(self)

    def _repr_html_(self) -> str:
        from mbd.results.summary import facts

        rows = table(f"Trajectory of {self.name!r}", (), facts(self))
        count = len(self.record.events)
        return rows + (folded(f"{count} events", self.events._repr_html_()) if count else "")


class Moments(Mapping[str, Any]):
    """Named quantities of a run at chosen times: ``run.at(0.3)["left hip.angle"]``.

    One time gives a float, or (3,) for a vector; k times give (k,) or (k, 3).
    """

    def __init__(self, columns: Columns, times: ArrayLike, side: Side, facts: Facts | None = None) -> None:
        try:
            self.time = np.asarray(times, dtype=np.float64)
        except (TypeError, ValueError, OverflowError):
            raise TrajectoryError(f"times must be one number or several [s], not {shown(times)}") from None
        self.side = side
        self._columns, self._facts = columns, facts
        self._places = columns.grid.places(self.time, side)

    def __getitem__(self, name: str) -> Any:
        found = self._read(name)
        if self._facts is not None:
            require_finite(name, found, self._places.time, self._facts)
        doubt_singular(name, found, self._facts, self._read)
        shaped = found.reshape(self.time.shape + found.shape[1:])
        worded = shaped if self._facts is None else self._facts.worded(name, shaped)
        return worded if shaped.ndim else str(worded) if worded is not shaped else float(shaped)

    def _read(self, name: str) -> Vector:
        return gather(self._columns, lambda names: self._columns.at_places(names, self._places), name)

    def read(self, *names: str) -> dict[str, Vector]:
        """Several scalars at once, each (k,); faster than one after the other."""
        scalars = [scalar for name in names for scalar in self._columns.components(name)]
        return dict(zip(scalars, self._columns.at_places(scalars, self._places), strict=True))

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns.names)

    def __len__(self) -> int:
        return len(self._columns.names)

    def __repr__(self) -> str:
        times = self.time.ravel()
        span = f"t = {times[0]:g} s" if times.size == 1 else f"{times.size} times"
        return f"<values at {span}, side={self.side!r}: {len(self)} names>"


def _received(content: bytes) -> Trajectory:
    """A run that came from another process."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "run.npz"
        path.write_bytes(content)
        return load(path)


def load(path: str | Path) -> Trajectory:
    """A run read from a file that `Trajectory.save` wrote; its names, plots and pages need no model."""
    from mbd.results.archive import file_to_read
    from mbd.results.storage import load as read

    return Trajectory(*read(file_to_read(path)))
