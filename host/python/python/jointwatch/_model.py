"""Models: they predict, are compared, diagnosed, widened and exported."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from os import PathLike
from typing import TYPE_CHECKING, Any, Optional, Union

from . import _html, _native
from ._columns import as_column
from ._errors import UsageError
from ._progress import Progress, shown
from ._results import Added, Comparison, Diagnosis, Exported, Response

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from ._study import Study

    Array = npt.NDArray[np.float64]

_Path = Union[str, PathLike[str]]


class Model:
    """A learnt model: a polynomial, a network or nothing, and physical effects."""

    def __init__(self, native: _native.Model) -> None:
        self._native = native

    @classmethod
    def open(cls, path: _Path) -> Model:
        """Reads a model.json."""
        return cls(_native.Model.open(path))

    def save(self, path: _Path) -> None:
        """Writes model.json in one step."""
        self._native.save(path)

    def to_dict(self) -> dict[str, Any]:
        """The content of model.json."""
        said: dict[str, Any] = json.loads(self._native.to_json())
        return said

    @property
    def axes(self) -> list[str]:
        """The names of its axes."""
        return [axis["name"] for axis in self.to_dict()["axes"]]

    @property
    def effects(self) -> list[str]:
        """Its physical effects, as `add` takes them."""
        return _html.names_of_effects(self.to_dict())

    @property
    def warnings(self) -> list[str]:
        """What the training records cannot support, one sentence each."""
        said: list[str] = self.to_dict()["warnings"]
        return said

    def predict(
        self,
        displacement: Any,
        velocity: Any,
        inputs: Optional[Mapping[str, Any]] = None,
    ) -> Any:
        """The restoring force in N or N·m along rows that follow each other at the model's sample rate, in SI.

        Arrays for one axis, and an array comes back; mappings with an array per axis for two, and a mapping comes back.
        """
        axes = self._axes
        given = isinstance(displacement, Mapping)
        if given != isinstance(velocity, Mapping) or (not given and len(axes) > 1):
            raise UsageError(
                f"give displacement and velocity as mappings with an array for each axis: {', '.join(axes)}."
            )
        states = []
        for axis in axes:
            for what, series in (("displacement", displacement), ("velocity", velocity)):
                if given and axis not in series:
                    raise UsageError(f"{what} has no axis {axis!r}; give an array for each of {', '.join(axes)}.")
                states.append(as_column(series[axis] if given else series, "predict", what))
        columns = [(name, as_column(values, "predict", name)) for name, values in (inputs or {}).items()]
        forces = self._native.predict(states, columns)
        return dict(zip(axes, forces)) if given else forces[0]

    @property
    def _axes(self) -> list[str]:
        if not hasattr(self, "_names"):
            self._names = self.axes
        return self._names

    def predict_study(self, study: Study) -> list[dict[str, Any]]:
        """Along every record of a study, per axis: `time_s`, `displacement`, `velocity`, and `measured` and `predicted` force.

        Both forces are low-passed alike, as the error figures have them. Of a log without time, `time_s` counts the rows.
        """
        keys = ("time_s", "displacement", "velocity", "measured", "predicted")
        seen = self._native.predict_study(study._native)
        return [
            {"file": file, "axes": {axis: dict(zip(keys, series)) for axis, series in axes}} for file, axes in seen
        ]

    def compare(self, study: Study, *, progress: Progress = None) -> Comparison:
        """Holds it against every record of a study."""
        with shown(progress) as told:
            return Comparison(self._native.compare(study._native, told), self.to_dict())

    def diagnose(
        self, study: Study, *, without: Iterable[str] = (), explain: bool = False, progress: Progress = None
    ) -> Diagnosis:
        """Says which physical effect it lacks, or that nothing is missing, or that the data are at fault.

        Effects that stand in `without` are not thought of; `explain` lists everything that was looked at.
        """
        without = [without] if isinstance(without, str) else list(without)
        with shown(progress) as told:
            return Diagnosis(self._native.diagnose(study._native, (without, explain), told))

    def add(self, effects: Union[str, Iterable[str]], study: Study, *, progress: Progress = None) -> Added:
        """Adds effects, `"coulomb@x"` or several, and finds all values anew; `Added.model` is the wider model."""
        names = [effects] if isinstance(effects, str) else list(effects)
        if not names:
            raise UsageError("there is no effect to add; name at least one, such as 'coulomb@x'.")
        with shown(progress) as told:
            native = self._native.add(study._native, names, told)
        return Added(native, Model(native.model()), names)

    def respond(
        self,
        study: Study,
        *,
        record: Optional[str] = None,
        restart_s: Optional[float] = None,
        measured: bool = False,
        progress: Progress = None,
    ) -> Response:
        """Simulates the records of a study with the model in place of the joint, and compares the motions."""
        with shown(progress) as told:
            return Response(self._native.respond(study._native, (record, restart_s, measured), told))

    def export(self, path: _Path, *, budget: Optional[float] = None) -> Exported:
        """Writes the blob that a device evaluates, and says what fixed point costs."""
        return Exported(json.loads(self._native.export(path, budget)))

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (self._native.to_json(),)

    def __repr__(self) -> str:
        said = self.to_dict()
        parts = [_html.base_of(said), *_html.names_of_effects(said)]
        return f"<Model of {said['study']!r}: {' + '.join(parts)}>"

    def _repr_html_(self) -> str:
        return _html.of_model(self.to_dict())


def _restored(text: str) -> Model:
    return Model(_native.Model.parse("the pickled model", text))
