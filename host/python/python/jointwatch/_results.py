"""What the commands answer, as objects: the command line's JSON, its pictures, its page."""

from __future__ import annotations

import json
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Union

from . import _html, _native

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from ._model import Model

    Array = npt.NDArray[np.float64]

_Path = Union[str, PathLike[str]]


class _Result:
    def __init__(self, said: dict[str, Any]) -> None:
        self._said = said

    def to_dict(self) -> dict[str, Any]:
        """What the command writes with `--json`."""
        return self._said


class _Shown(_Result):
    """One that can be shown as a page."""

    _command: str

    def __init__(self, native: Any) -> None:
        super().__init__(json.loads(native.to_json()))
        self._native = native

    def report(self, path: _Path) -> None:
        """Writes the page of `--report`: one HTML file that opens without a network."""
        Path(path).write_text(self._native.page(self._command), encoding="utf-8")


class _Drawn(_Shown):
    """One of which there are pictures."""

    def pictures(self) -> dict[str, str]:
        """The SVG documents of `--plots`, by the names of their files."""
        return dict(self._native.pictures())


class Comparison(_Drawn):
    """Errors of a model on every record, where they sit, and what is wrong with the data."""

    _command = "model.compare(study)"

    def __init__(self, native: _native.Comparison, model: dict[str, Any]) -> None:
        super().__init__(native)
        self._model = model

    @property
    def records(self) -> list[dict[str, Any]]:
        """Record by record: `file`, `role`, `rows`, and figures per axis."""
        records: list[dict[str, Any]] = self._said["records"]
        return records

    @property
    def validation(self) -> dict[str, float]:
        """Relative error per axis on validation records."""
        return {e["axis"]: e["relative_error"] for e in self._said["validation"]}

    @property
    def data_problems(self) -> list[str]:
        """What is wrong with the data, one sentence each."""
        problems: list[str] = self._said["data_problems"]
        return problems

    def __repr__(self) -> str:
        errors = ", ".join(f"{axis} {100 * e:.2f} %" for axis, e in self.validation.items())
        return f"<Comparison: {len(self.records)} records; relative error on validation records: {errors or 'none'}>"

    def _repr_html_(self) -> str:
        return _html.of_comparison(self._said, self.pictures())


class Diagnosis(_Drawn):
    """What a model lacks."""

    _command = "model.diagnose(study)"

    @property
    def verdict(self) -> str:
        """`"effect"`, `"none"`, `"unknown"` or `"data"`."""
        verdict: str = self._said["verdict"]
        return verdict

    @property
    def found(self) -> list[dict[str, str]]:
        """Everything that is missing: `effect` and `axis`, which is `"both"` for the same effect on each."""
        found: list[dict[str, str]] = self._said["found"]
        return found

    @property
    def effects(self) -> list[str]:
        """The same as `add` takes it."""
        effects: list[str] = self._native.effects()
        return effects

    @property
    def ranked(self) -> list[dict[str, Any]]:
        """Candidates for the first of them, best first."""
        ranked: list[dict[str, Any]] = self._said["ranked"]
        return ranked

    @property
    def data_problems(self) -> list[str]:
        """What is wrong with the data, one sentence each."""
        problems: list[str] = self._said["data_problems"]
        return problems

    def __repr__(self) -> str:
        return f"<Diagnosis: {_html.verdict_in_words(self._said)}>"

    def _repr_html_(self) -> str:
        return _html.of_diagnosis(self._said, self.pictures())


class Added(_Drawn):
    """A model with more effects, and what they brought."""

    _command = "model.add(effects, study)"

    def __init__(self, native: _native.Added, model: Model, effects: list[str]) -> None:
        super().__init__(native)
        self.model = model
        """The wider model."""
        self.effects = effects
        """What was added."""

    @property
    def helps(self) -> bool:
        """Whether an axis's error falls by at least a hundredth, on rows that the model was not fitted to."""
        return bool(self._said["helps"])

    @property
    def errors(self) -> dict[str, tuple[float, float]]:
        """Relative error per axis before and after."""
        errors = self._said["errors"]
        pairs = zip(errors["before"], errors["after"])
        return {b["axis"]: (b["relative_error"], a["relative_error"]) for b, a in pairs}

    def __repr__(self) -> str:
        errors = "; ".join(f"{axis} {100 * b:.2f} % -> {100 * a:.2f} %" for axis, (b, a) in self.errors.items())
        return f"<Added {', '.join(self.effects)}: relative error {errors}{'' if self.helps else '; it does not help'}>"

    def _repr_html_(self) -> str:
        return _html.of_added(self._said, self.effects, self.pictures())


class Response(_Shown):
    """How the rig would move with a model in place of its joint."""

    _command = "model.respond(study)"

    @property
    def records(self) -> list[dict[str, Any]]:
        """Record by record: figures per axis, and how much of it was simulated."""
        records: list[dict[str, Any]] = self._said["records"]
        return records

    def states(self, record: int = 0) -> tuple[list[Array], list[Array]]:
        """Simulated and measured states of a record by its number: displacement and velocity of each axis, SI."""
        states = self._native.states(record)
        if states is None:
            raise IndexError(f"there is no record {record}; there are {len(self.records)}")
        simulated, measured = states
        return simulated, measured

    def __repr__(self) -> str:
        return f"<Response: {len(self.records)} records against the {self._said['against']}>"

    def _repr_html_(self) -> str:
        return _html.of_response(self._said)


class Exported(_Result):
    """What fixed point costs a model on the device."""

    @property
    def bytes(self) -> int:
        """The size of the blob."""
        return int(self._said["bytes"])

    def __repr__(self) -> str:
        return f"<Exported: {self.bytes} bytes in {self._said['blob']}>"

    def _repr_html_(self) -> str:
        return _html.of_export(self._said)
