"""What each effect of a scene costs and what it changes: which may be left out, and at what price."""

from mbd.analysis.effects.contribution import Change, Contribution
from mbd.analysis.effects.lab import effects
from mbd.analysis.effects.result import Effects

__all__ = ["Change", "Contribution", "Effects", "effects"]
