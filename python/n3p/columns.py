"""Tables: dicts of numpy arrays of one length."""

import numpy as np

__all__ = ["Columns", "Rows", "Trajectory"]


class Columns(dict):
    """Columns by name, each a numpy array (N,).

    ``pandas.DataFrame(columns)``, ``polars.DataFrame(columns)`` and ``pyarrow.table(columns)`` take
    it as it is; the methods below do just that.
    """

    def __init__(self, columns):
        super().__init__(
            (name, np.array(values, dtype=np.str_) if isinstance(values, list) else values)
            for name, values in columns.items()
        )

    def to_pandas(self):
        """The same as a ``pandas.DataFrame``; needs pandas."""
        import pandas

        return pandas.DataFrame(dict(self))

    def to_polars(self):
        """The same as a ``polars.DataFrame``; needs polars."""
        import polars

        return polars.DataFrame(dict(self))

    def to_arrow(self):
        """The same as a ``pyarrow.Table``; needs pyarrow."""
        import pyarrow

        return pyarrow.table(dict(self))

    def __repr__(self):
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

    def __init__(self, columns, report):
        super().__init__(columns)
        self.report = report
