"""Sums of records: parts that merge to the same bytes in any order, and the models that they give."""

from __future__ import annotations

import json
from collections.abc import Iterable
from os import PathLike
from pathlib import Path
from typing import Any, Optional, Union

from . import _native
from ._errors import DataError
from ._model import Model
from ._study import Study


class Sums:
    """The sums of some records. `bytes(sums)` is the file that `jointwatch accumulate` writes."""

    def __init__(self, content: bytes, called: str = "sums") -> None:
        self._bytes = content
        self._called = called
        about = json.loads(_native.describe_sums(called, content))
        self.study: str = about["study"]
        self.rows: int = about["rows"]
        self.records: list[dict[str, Any]] = about["records"]
        self.beyond: float = about["beyond"]
        """How far the records went beyond the range of the study's own training records, as a factor."""

    @classmethod
    def of_files(cls, study: Study, files: Iterable[Union[str, PathLike[str]]]) -> Sums:
        """Sums log files with the channels that a study describes."""
        plan = plan_of(study)
        return merge_bytes([(str(file), plan.sum_file(file)) for file in files])

    @classmethod
    def open(cls, path: Union[str, PathLike[str]]) -> Sums:
        """Reads a file that `jointwatch accumulate` or `merge` wrote."""
        try:
            return cls(Path(path).read_bytes(), str(path))
        except OSError as problem:
            raise DataError(f"{path}: could not be read ({problem}); give a file of sums.") from problem

    def save(self, path: Union[str, PathLike[str]]) -> None:
        """Writes them."""
        Path(path).write_bytes(self._bytes)

    def __bytes__(self) -> bytes:
        return self._bytes

    def __add__(self, other: Sums) -> Sums:
        return merge_bytes([(self._called, self._bytes), (other._called, other._bytes)])

    def identify(self, kind: str, *, fit: Optional[str] = None, study: Optional[Study] = None) -> Model:
        """A model of the sums: `"polynomial"` or `"physical"`; with a study, its errors are measured on the study's records."""
        native = None if study is None else study._native
        return Model(_native.identify_sums(self._called, self._bytes, (kind, fit), native))

    def __repr__(self) -> str:
        return f"<Sums of {self.study!r}: {len(self.records)} records, {self.rows} rows>"


def plan_of(study: Study) -> _native.Plan:
    """How logs are summed with a study."""
    return _native.Plan.of(study._native, study.description)


def merge_bytes(parts: list[tuple[str, bytes]]) -> Sums:
    """The sums of parts, each with a name for messages."""
    return Sums(_native.merge_sums(parts))
