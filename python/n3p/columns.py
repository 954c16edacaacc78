"""Tables: dicts of numpy arrays of one length."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import pandas
    import polars
    import pyarrow

__all__ = ["Columns", "Rows", "Trajectory"]


class Columns(dict[str, "np.ndarray[Any, Any]"]):
    """Columns by name, each a numpy array (N,).

    ``pandas.DataFrame(columns)``, ``polars.DataFrame(columns)`` and ``pyarrow.table(columns)`` take
    it as it is; the methods below do just that.
    """

    def __init__(self, columns: dict[str, Any]) -> None:
        super().__init__(
            (name, np.array(values, dtype=np.str_) if isinstance(values, list) else values)
            for name, values in columns.items()
        )

    def to_pandas(self) -> pandas.DataFrame:
        """The same as a ``pandas.DataFrame``; needs pandas."""
        import pandas

        return pandas.DataFrame(dict(self))

    def to_polars(self) -> polars.DataFrame:
        """The same as a ``polars.DataFrame``; needs polars."""
        import polars

        return polars.DataFrame(dict(self))

    def to_arrow(self) -> pyarrow.Table:
        """The same as a ``pyarrow.Table``; needs pyarrow."""
        import pyarrow

        return pyarrow.table(dict(self))

    def __repr__(self) -> str:
        length = len(next(iter(self.values()), ()))
        return f"<{type(self).__name__}: {length} × {', '.join(self)}>"


class Rows(Columns):
    """One row for each scene and method; the columns are those of docs/formats.md."""


class Trajectory(Columns):
    """A path in time, one row for each moment.

    Attributes
    ----------
    report : dict
        Extremes, times and steering jumps: the ``report`` of docs/formats.md.
    """

    def __init__(self, columns: dict[str, Any], report: dict[str, Any]) -> None:
        super().__init__(columns)
        self.report = report
