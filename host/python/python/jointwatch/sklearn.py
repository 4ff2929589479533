"""scikit-learn's protocol on a model: `fit`, `predict`, `score`.

Rows of X are samples of one motion at an even rate: displacement and velocity of every axis, in SI. y is the restoring force.
"""

from __future__ import annotations

from typing import Any, Optional

import numpy as np
import numpy.typing as npt
from sklearn.base import BaseEstimator, RegressorMixin  # type: ignore[import-untyped, unused-ignore]
from sklearn.utils.validation import check_is_fitted, validate_data  # type: ignore[import-untyped, unused-ignore]

from ._study import Study

_Array = npt.NDArray[np.float64]


class RestoringForceRegressor(RegressorMixin, BaseEstimator):  # type: ignore[misc]
    """A restoring force learnt from states: X has two columns per axis (one or two axes), y one column per axis.

    Rows follow each other at `sample_rate_hz`: effects may have memory, so neither fit nor predict may shuffle them. `kind` and the
    options are those of `Study.identify`; `terms` name the axes x, and for two axes x and phi.
    """

    # A record has no fewer.
    _fewest_rows = 100

    def __init__(
        self,
        kind: str = "polynomial",
        *,
        sample_rate_hz: float = 1000.0,
        band_hz: Optional[float] = None,
        terms: Optional[list[str]] = None,
        fit_method: Optional[str] = None,
        neurons: Optional[int] = None,
        restarts: Optional[int] = None,
        seed: Optional[int] = None,
    ) -> None:
        self.kind = kind
        self.sample_rate_hz = sample_rate_hz
        self.band_hz = band_hz
        self.terms = terms
        self.fit_method = fit_method
        self.neurons = neurons
        self.restarts = restarts
        self.seed = seed

    def fit(self, X: Any, y: Any) -> RestoringForceRegressor:
        """Learns the force."""
        X, y = validate_data(
            self, X, y, dtype=np.float64, multi_output=True, y_numeric=True, ensure_min_samples=self._fewest_rows
        )
        study = self._study(X, np.asarray(y, dtype=np.float64).reshape(len(X), -1))
        self.model_ = study.identify(
            self.kind,
            self.terms,
            fit=self.fit_method,
            neurons=self.neurons,
            restarts=self.restarts,
            seed=self.seed,
        )
        self.one_dimension_ = np.ndim(y) == 1
        return self

    def _study(self, X: _Array, forces: _Array) -> Study:
        axes = X.shape[1] // 2
        if X.shape[1] not in (2, 4):
            raise ValueError(
                f"X has {X.shape[1]} feature(s), and a joint has 2 per axis, displacement and velocity, for one or two axes"
            )
        if forces.shape[1] != axes:
            raise ValueError(f"y has {forces.shape[1]} columns where X has {axes} axes; give one force per axis")
        names = ("x", "phi")[:axes]
        return Study.from_arrays(
            displacement={axis: X[:, 2 * i] for i, axis in enumerate(names)},
            velocity={axis: X[:, 2 * i + 1] for i, axis in enumerate(names)},
            force={axis: forces[:, i] for i, axis in enumerate(names)},
            kind={axis: kind for axis, kind in zip(names, ("translation", "rotation"))},
            # The force is the joint's own already.
            inertia=0.0,
            sample_rate_hz=float(self.sample_rate_hz),
            band_hz=self.band_hz,
            name="X and y",
        )

    def predict(self, X: Any) -> _Array:
        """The force at every row."""
        check_is_fitted(self, "model_")
        X = validate_data(self, X, dtype=np.float64, reset=False)
        axes = self.model_.axes
        forces = self.model_.predict(
            {axis: X[:, 2 * i] for i, axis in enumerate(axes)},
            {axis: X[:, 2 * i + 1] for i, axis in enumerate(axes)},
        )
        if self.one_dimension_:
            single: _Array = forces[axes[0]]
            return single
        return np.column_stack([forces[axis] for axis in axes])

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.target_tags.multi_output = True
        return tags
