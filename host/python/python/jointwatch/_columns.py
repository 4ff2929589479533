"""Columns of numbers from whatever holds them: arrays, lists, and the frames of pandas, polars and pyarrow."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ._errors import DataError, UsageError

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt


def as_column(values: Any, record: str, name: str) -> npt.NDArray[np.float64]:
    """One dimension of float64, one after the other in memory; a view where it is that already."""
    import numpy as np

    where = f"{record}, column {name!r}"
    array = np.asarray(values)
    if array.dtype.kind == "O" and hasattr(values, "to_numpy"):
        array = _without_missing(values, array)
    if array.ndim != 1:
        raise DataError(f"{where}: an array of shape {array.shape} is no column; give one dimension.")
    if array.dtype.kind in "mM":
        return _seconds(array, where)
    if array.dtype.kind not in "fiu":
        raise DataError(f"{where}: {array.dtype} are no measurements; convert it to float64.")
    return np.ascontiguousarray(array, dtype=np.float64)


def _without_missing(values: Any, array: Any) -> Any:
    """A nullable column of pandas, its missing values as NaN."""
    import numpy as np

    try:
        return values.to_numpy(dtype="float64", na_value=np.nan)
    except (TypeError, ValueError):
        return array


def _seconds(array: Any, where: str) -> npt.NDArray[np.float64]:
    """Dates and durations as seconds since the first."""
    import numpy as np

    if np.isnat(array).any():
        raise DataError(f"{where}: NaT is no time; leave that row out.")
    if array.size == 0:
        return np.zeros(0)
    since = (array - array[0]).astype("timedelta64[ns]").astype(np.int64)
    seconds: npt.NDArray[np.float64] = since * 1e-9
    return seconds


def column_of(frame: Any, record: str, name: str) -> npt.NDArray[np.float64]:
    """A column of a frame."""
    return as_column(frame[name], record, name)


def as_frame(frame: Any, record: str) -> Any:
    """Something with named columns: itself, or a pyarrow table of what offers the Arrow PyCapsule interface."""
    if hasattr(frame, "__getitem__") and names_of(frame) is not None:
        return frame
    if hasattr(frame, "__arrow_c_stream__"):
        try:
            import pyarrow  # type: ignore[import-untyped, import-not-found, unused-ignore]
        except ImportError:
            raise UsageError(
                f"{record}: reading {type(frame).__name__} through Arrow needs the package pyarrow; install it."
            ) from None
        return pyarrow.table(frame)
    raise UsageError(
        f"{record}: {type(frame).__name__} is no frame with named columns; give one of pandas, polars or pyarrow, or use from_arrays."
    )


def names_of(frame: Any) -> Any:
    """The names of a frame's columns; None where it has none."""
    if isinstance(frame, dict):
        return list(frame)
    names = getattr(frame, "column_names", None)
    if names is None:
        names = getattr(frame, "columns", None)
    if names is None or callable(names):
        return None
    names = list(names)
    return names if all(isinstance(n, (str, int)) for n in names) else None
