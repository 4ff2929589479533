"""scikit-learn's protocol, and its own checks as far as they apply."""

import numpy as np
import pytest

from conftest import RATE_HZ, motion

pytest.importorskip("sklearn")

from jointwatch.sklearn import RestoringForceRegressor  # noqa: E402
from sklearn.base import clone  # noqa: E402
from sklearn.exceptions import NotFittedError  # noqa: E402
from sklearn.utils.estimator_checks import parametrize_with_checks  # noqa: E402

INAPPLICABLE = {
    "check_regressors_train": "its target follows other columns than a displacement and a velocity",
    "check_regressor_multioutput": "it fits two targets with other than the four columns of two axes",
}


class OwnMotion(RestoringForceRegressor):
    """The same protocol, learning from a motion of its own: so that checks apply that bring rows of other shapes."""

    _fewest_rows = 1

    def _study(self, X, forces):
        _, x, v, _ = motion(1000)
        axes = forces.shape[1]
        force = np.outer(9e3 * x + 25.0 * v, 1.0 + np.abs(forces).mean(axis=0))
        return super()._study(np.column_stack([x, v] * axes), force)


def data(rows: int = 4000) -> tuple:
    _, x, v, _ = motion(rows)
    return np.column_stack([x, v]), 9e3 * x + 25.0 * v + 2e9 * x**3


@pytest.mark.parametrize("kind", ["polynomial", "physical"])
def test_it_learns_a_force(kind) -> None:
    X, y = data()
    regressor = RestoringForceRegressor(kind, sample_rate_hz=RATE_HZ)
    if kind == "physical":
        regressor.set_params(terms=["stiffness@x", "viscous@x", "cubic_hardening@x"])
    assert regressor.fit(X[:3000], y[:3000]) is regressor
    assert regressor.score(X[3000:], y[3000:]) > 0.9999
    assert regressor.predict(X).shape == y.shape and regressor.n_features_in_ == 2
    assert clone(regressor).get_params() == regressor.get_params()


def test_two_axes() -> None:
    X, y = data()
    both = RestoringForceRegressor(sample_rate_hz=RATE_HZ).fit(np.hstack([X, X[::-1]]), np.column_stack([y, y[::-1]]))
    assert both.predict(np.hstack([X, X[::-1]])).shape == (4000, 2)


def test_what_is_refused() -> None:
    X, y = data()
    regressor = RestoringForceRegressor(sample_rate_hz=RATE_HZ)
    for bad_X, bad_y, words in ((X[:, :1], y, "feature"), (np.hstack([X, X]), y, "one force per axis"), (X[:50], y[:50], "50 sample")):
        with pytest.raises(ValueError, match=words):
            regressor.fit(bad_X, bad_y)
    with pytest.raises(NotFittedError):
        regressor.predict(X)


@parametrize_with_checks([OwnMotion()], expected_failed_checks=lambda _: INAPPLICABLE)
def test_checks_of_sklearn(estimator, check) -> None:
    check(estimator)
