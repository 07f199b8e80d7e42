"""Faults of words, gathered while a model is derived, so that one error reports all of them."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from mbd.errors import ModelError, TraceError


class Gathered:
    """Errors of the words of a model, each of which may say more than one fault."""

    def __init__(self) -> None:
        self.errors: list[ModelError | TraceError] = []

    @contextmanager
    def catch(self, owner: str = "") -> Iterator[None]:
        """Keep what a word of the name `owner` raises, which then says so, and continue with the next word."""
        try:
            yield
        except (ModelError, TraceError) as error:
            self.errors.append(_named(error, owner))

    def add(self, faults: Sequence[str]) -> None:
        """Further faults, a sentence each."""
        if faults:
            self.errors.append(ModelError(faults))

    def raise_all(self) -> None:
        """Raise a single error as it is, and several as one `ModelError`."""
        if len(self.errors) == 1:
            raise self.errors[0]
        if self.errors:
            raise ModelError([fault for error in self.errors for fault in getattr(error, "faults", (str(error),))])


def _named(error: ModelError | TraceError, owner: str) -> ModelError | TraceError:
    """The error with the name of its owner in each sentence."""
    faults = error.faults if isinstance(error, ModelError) else (str(error),)
    if not owner or all(f"'{owner}" in fault for fault in faults):
        return error
    named = [fault if f"'{owner}" in fault else f"'{owner}': {fault}" for fault in faults]
    found = type(error)(named if isinstance(error, ModelError) else named[0])
    found.__cause__ = error
    return found
