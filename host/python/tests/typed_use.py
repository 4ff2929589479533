"""Typed use of the package; `mypy --strict` goes through it, nobody runs it."""

from __future__ import annotations

from pathlib import Path
from typing import Optional

import numpy as np
import numpy.typing as npt

import jointwatch as jw


def told(what: str, share: Optional[float], steps: int) -> None:
    print(what, share, steps)


def whole_way(t: npt.NDArray[np.float64], force: list[float], x: npt.NDArray[np.float64]) -> int:
    study: jw.Study = jw.Study.from_arrays(t=t, force=force, displacement={"x": x}, units={"force": "kN"}, validate=0.3)
    model: jw.Model = study.identify("physical", terms=["stiffness@x"], progress=told)
    diagnosis: jw.Diagnosis = model.diagnose(study, progress=True)
    verdict: str = diagnosis.verdict
    names: list[str] = diagnosis.effects
    added: jw.Added = model.add(names, study)
    before, after = added.errors["x"]
    gain: float = before - after
    wider: jw.Model = added.model
    comparison: jw.Comparison = wider.compare(study)
    pictures: dict[str, str] = comparison.pictures()
    response: jw.Response = wider.respond(study, restart_s=1.0)
    simulated, measured = response.states()
    largest: float = float(np.max(np.abs(simulated[0] - measured[0])))
    wider.save(Path("model.json"))
    try:
        exported: jw.Exported = wider.export("model.bin")
    except jw.DataError as error:
        raise SystemExit(str(error)) from error
    print(verdict, gain, pictures, largest)
    return exported.bytes
