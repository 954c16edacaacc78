"""What goes wrong."""

from __future__ import annotations

__all__ = ["N3PError", "BadInput", "NoPath"]


class N3PError(Exception):
    """Anything of n3p that goes wrong. Raised itself only for bugs and for calls out of order."""


class BadInput(N3PError, ValueError):
    """What was given cannot be used; the message says what, and what would be right."""


class NoPath(N3PError):
    """There is no path, or none was found within the budget.

    Attributes
    ----------
    reason : str
        "budget spent", "no path at this resolution", "goal not reachable from the start", …
    """

    def __init__(self, reason: str) -> None:
        super().__init__(f"no path: {reason}")
        self.reason = reason

    def __reduce__(self) -> tuple[type[NoPath], tuple[str]]:
        return type(self), (self.reason,)
