"""Learn a joint's restoring force from logs, find the physical effect that a model lacks, add it, export it.

    import jointwatch as jw

    study = jw.Study.from_arrays(t=t, force=force, displacement=x, inertia=1.7, validate=0.3)
    model = study.identify("physical", terms=["stiffness@x", "viscous@x"])
    diagnosis = model.diagnose(study)
    added = model.add(diagnosis.effects, study)
    added.model.export("model.bin")

Results are those of the command line, to the bit; errors are exceptions with the same sentences.
"""

from ._errors import DataError, Error, FailedError, UsageError
from ._logs import Record
from ._model import Model
from ._native import __version__
from ._results import Added, Comparison, Diagnosis, Exported, Response
from ._study import Study
from ._sums import Sums

__all__ = [
    "Added",
    "Comparison",
    "DataError",
    "Diagnosis",
    "Error",
    "Exported",
    "FailedError",
    "Model",
    "Record",
    "Response",
    "Study",
    "Sums",
    "UsageError",
    "__version__",
]
