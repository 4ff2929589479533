"""What is refused, with one sentence each."""

import re

import jointwatch as jw
import numpy as np
import pytest

from conftest import joint

GOOD = {k: v for k, v in joint(2000).items() if k != "acceleration"}


def refused(error=jw.DataError, **changed) -> str:
    with pytest.raises(error) as caught:
        jw.Study.from_arrays(**{**GOOD, "inertia": 1.7, **changed})
    sentence = str(caught.value)
    assert "\n" not in sentence and re.search(r"[.?]$", sentence), sentence
    assert len(re.findall(r"\. [A-Z]", sentence)) == 0, sentence
    return sentence


def with_value(key: str, value: float) -> np.ndarray:
    array = GOOD[key].copy()
    array[16] = value
    return array


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"force": GOOD["force"][:-1]}, ["record", "2000", "1999", "force", "equal length"]),
        ({"force": with_value("force", np.nan)}, ["row 17", "force", "NaN"]),
        ({"displacement": with_value("displacement", np.inf)}, ["row 17", "displacement", "inf"]),
        ({"t": with_value("t", 0.5)}, ["record", '"t"']),
        ({"force": GOOD["force"].astype(str)}, ["force", "float64"]),
        ({"force": GOOD["force"] > 0}, ["force", "bool"]),
        ({"force": GOOD["force"].astype(complex)}, ["force", "complex128"]),
        ({"force": [None] * 2000}, ["force", "object"]),
        ({"force": GOOD["force"].reshape(-1, 2)}, ["force", "(1000, 2)"]),
        ({"units": {"force": "mm"}}, ["force", "mm"]),
        ({"units": {"t": "fortnight"}}, ["time", "fortnight"]),
        ({"inertia": -1.0}, ["inertia", "-1"]),
        ({"kind": "sideways"}, ["sideways", "translation"]),
        ({"displacement": np.zeros(2000)}, ["displacement"]),
        ({k: v[:0] for k, v in GOOD.items()}, ["record", "0 rows", "100"]),
        ({k: v[:99] for k, v in GOOD.items()}, ["record", "99 rows", "100"]),
        ({"t": None}, ["sample_rate_hz"]),
    ],
)
def test_data(changed, words) -> None:
    sentence = refused(**changed)
    for word in words:
        assert word in sentence, sentence
    assert ", line " not in sentence, "nobody wrote these lines"


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"displacement": None}, ["displacement is missing"]),
        ({"force": None}, ["force is missing"]),
        ({"units": {"forces": "N"}}, ["forces", "known"]),
        ({"inertia": {"y": 1.7}}, ["inertia", "'y'"]),
        ({"validate": 1.5}, ["validate = 1.5"]),
        ({"force": {"y": GOOD["force"]}}, ["force", "'y'"]),
    ],
)
def test_use(changed, words) -> None:
    sentence = refused(jw.UsageError, **changed)
    for word in words:
        assert word in sentence, sentence


def test_records() -> None:
    def made(*records: jw.Record) -> str:
        with pytest.raises(jw.UsageError) as caught:
            jw.Study.from_arrays(*records)
        return str(caught.value)

    assert "verify" in made(jw.Record(**GOOD, role="verify"))
    assert "'a'" in made(jw.Record(**GOOD, name="a"), jw.Record(**GOOD, name="a"))
    with pytest.raises(jw.UsageError, match="not both"):
        jw.Study.from_arrays(jw.Record(**GOOD), **GOOD)


def test_frames() -> None:
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(GOOD)
    good = {"t": "t", "force": "force", "displacement": "displacement"}

    def made(error, frames, **changed) -> str:
        with pytest.raises(error) as caught:
            jw.Study.from_dataframe(frames, **{**good, **changed})
        assert "\n" not in str(caught.value)
        return str(caught.value)

    assert "forse" in made(jw.DataError, frame, force="forse")
    assert "0 rows" in made(jw.DataError, frame[:0])
    assert "no column" in made(jw.DataError, pandas.DataFrame())
    assert "ndarray" in made(jw.UsageError, frame.to_numpy())
    assert "nobody" in made(jw.UsageError, {"a": frame}, validate=["nobody"])
    assert "wight" in made(jw.UsageError, frame, units={"wight": "N"})


def test_models() -> None:
    study = jw.Study.from_arrays(**GOOD, inertia=1.7, terms=["stiffness@x", "viscous@x"])
    for options, words in (
        ({"kind": "magic"}, ["magic", "physical"]),
        ({"kind": "physical", "fit": "ridge"}, ["fit", "polynomial"]),
        ({"kind": "polynomial", "terms": ["stiffness@x"]}, ["terms", "physical"]),
        ({"kind": "polynomial", "fit": "best"}, ["best", "ridge"]),
        ({"kind": "network", "neurons": "many"}, ["many", "auto"]),
        ({"kind": "network", "neurons": 1000}, ["1000", "200"]),
    ):
        with pytest.raises(jw.UsageError) as caught:
            study.identify(**options)
        for word in words:
            assert word in str(caught.value)
    with pytest.raises(jw.DataError, match="stifness"):
        study.identify("physical", terms=["stifness@x"])
    model = study.identify("physical")
    x = np.zeros(100)
    with pytest.raises(jw.DataError, match="rows|length|values"):
        model.predict(x, x[:-1])
    with pytest.raises(jw.UsageError, match="mapping"):
        model.predict({"x": x}, x)
    with pytest.raises(jw.UsageError, match="velocity has no axis"):
        model.predict({"x": x}, {"phi": x})
    with pytest.raises(jw.DataError, match="coulomb"):
        model.add("coulom@x", study)
    with pytest.raises(jw.UsageError, match="no effect"):
        model.add([], study)
    with pytest.raises(jw.DataError, match="no record"):
        model.respond(study, record="nowhere")
