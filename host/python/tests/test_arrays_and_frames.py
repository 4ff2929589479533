"""Studies of arrays and frames: known truth, the same model whatever held the numbers."""

import jointwatch as jw
import numpy as np
import pytest

from conftest import RATE_HZ, joint, motion

KNOWN = {"inertia": 1.7, "terms": ["stiffness@x", "viscous@x"], "validate": 0.3}


def test_first_diagnosis_from_arrays_in_ten_lines() -> None:
    data = joint()
    study = jw.Study.from_arrays(t=data["t"], force=data["force"], displacement=data["displacement"], **KNOWN)
    model = study.identify("physical")
    diagnosis = model.diagnose(study)
    assert diagnosis.verdict == "effect"
    assert len(diagnosis.found) == 1
    added = model.add(diagnosis.effects, study)
    assert added.helps and added.errors["x"][1] < 0.02
    values = {p["name"]: p["value"] for e in added.model.to_dict()["effects"] for p in e["parameters"]}
    assert abs(values["stiffness"] / 9e3 - 1) < 0.02


def test_units_scale_and_convert() -> None:
    data = joint(3000)
    si = jw.Study.from_arrays(t=data["t"], force=data["force"], displacement=data["displacement"], **KNOWN)
    other = jw.Study.from_arrays(
        t=1e3 * data["t"],
        force=1e-3 * data["force"],
        displacement=1e3 * data["displacement"],
        units={"t": "ms", "force": "kN", "displacement": "mm"},
        **KNOWN,
    )
    values = [
        [p["value"] for e in s.identify("physical").to_dict()["effects"] for p in e["parameters"]] for s in (si, other)
    ]
    assert np.allclose(values[0], values[1], rtol=1e-9)


def test_several_records_and_axes() -> None:
    def run(seed: int, role: str, name=None) -> jw.Record:
        t, x, v, a = motion(3000, seed)
        _, phi, w, alpha = motion(3000, seed + 50)
        return jw.Record(
            t=t,
            displacement={"x": x, "phi": phi},
            force={"x": 1.7 * a + 9e3 * x + 25 * v, "phi": 0.07 * alpha + 300 * phi + 0.9 * w},
            role=role,
            name=name,
        )

    study = jw.Study.from_arrays(
        run(1, "train"),
        run(2, "train"),
        run(3, "validate", "the last"),
        kind={"x": "translation", "phi": "rotation"},
        inertia={"x": 1.7, "phi": 0.07},
        terms=["stiffness@x", "viscous@x", "stiffness@phi", "viscous@phi"],
    )
    said = study.to_dict()
    assert [(r["file"], r["role"]) for r in said["records"]] == [
        ("record 1", "train"),
        ("record 2", "train"),
        ("the last", "validate"),
    ]
    model = study.identify("physical")
    values = [p["value"] for e in model.to_dict()["effects"] for p in e["parameters"]]
    assert np.allclose(values, [9e3, 25.0, 300.0, 0.9], rtol=2e-3)
    x, v = np.linspace(-1e-3, 1e-3, 50), np.linspace(0.1, -0.1, 50)
    forces = model.predict({"x": x, "phi": x}, {"x": v, "phi": v})
    assert np.allclose(forces["x"], values[0] * x + values[1] * v)
    assert np.allclose(forces["phi"], values[2] * x + values[3] * v)


def test_an_input_that_a_force_follows() -> None:
    t, x, v, a = motion(4000)
    voltage = 2.0 + np.sin(2 * np.pi * 0.7 * t)
    study = jw.Study.from_arrays(
        t=t,
        displacement=x,
        force=1.7 * a + 9e3 * x + 20.0 * voltage * v,
        inputs={"voltage": voltage},
        units={"voltage": "V"},
        inertia=1.7,
    )
    model = study.identify("physical", terms=["stiffness@x", "viscous*voltage@x"])
    values = [p["value"] for e in model.to_dict()["effects"] for p in e["parameters"]]
    assert np.allclose(values, [9e3, 20.0], rtol=2e-3)
    at = np.ones(10)
    assert np.allclose(model.predict(0 * at, at, inputs={"voltage": 3 * at}), 3 * values[1])
    with pytest.raises(jw.DataError, match="voltage"):
        model.predict(0 * at, at)
    # A polynomial takes it as its third state, unless it is told not to.
    for kind in ["polynomial", "network"]:
        model = study.identify(kind, **({"neurons": 8, "restarts": 1} if kind == "network" else {}))
        assert model.to_dict()["state_input"] == "voltage"
        force = model.predict(2e-4 * at, 0.01 * at, inputs={"voltage": 2.5 * at})
        assert np.allclose(force, 9e3 * 2e-4 + 20.0 * 2.5 * 0.01, rtol=0.02)
    assert "state_input" not in study.identify("polynomial", input="none").to_dict()
    with pytest.raises(jw.UsageError, match="input"):
        study.identify("physical", input="voltage")


def frames():
    """The same numbers as frames of every kind that is installed."""
    pandas, pyarrow = pytest.importorskip("pandas"), pytest.importorskip("pyarrow")
    data = {k: v for k, v in joint(3000).items() if k != "acceleration"}
    made = [pandas.DataFrame(data), pyarrow.table(data), data]

    class Capsule:
        """Offers the Arrow PyCapsule interface and nothing else."""

        def __arrow_c_stream__(self, requested_schema=None):
            return pyarrow.table(data).__arrow_c_stream__(requested_schema)

    made.append(Capsule())
    try:
        import polars
    except ImportError:
        return made
    return [*made, polars.DataFrame(data)]


def test_frames_give_what_arrays_give() -> None:
    arrays = {k: v for k, v in joint(3000).items() if k != "acceleration"}
    wanted = jw.Study.from_arrays(**arrays, **KNOWN).identify("physical").to_dict()
    for frame in frames():
        study = jw.Study.from_dataframe(frame, t="t", force="force", displacement="displacement", **KNOWN)
        got = study.identify("physical").to_dict()
        assert got["effects"] == wanted["effects"], type(frame)
        assert got["validation"] == wanted["validation"], type(frame)


def test_frames_with_channels_units_dates_and_roles() -> None:
    pandas = pytest.importorskip("pandas")
    data = joint(3000)
    near = 0.01 * np.sin(np.arange(3000) / 300)
    frame = pandas.DataFrame(
        {
            "when": pandas.Timestamp("2026-03-14 12:00") + pandas.to_timedelta(data["t"], unit="s"),
            "far": 1e3 * (data["displacement"] + near),
            "near": 1e3 * near,
            "load": data["force"] / 4.4482216152605,
            "spare": "text",
        }
    )
    study = jw.Study.from_dataframe(
        {"one": frame, "two": frame},
        t="when",
        displacement=["far", "near"],
        force={"column": "load", "unit": "lbf"},
        units={"far": "mm", "near": "mm"},
        acceleration=None,
        inertia=1.7,
        terms=["stiffness@x", "viscous@x", "coulomb@x"],
        validate=["two"],
    )
    assert study.to_dict()["sample_rate_hz"] == RATE_HZ
    assert [r["role"] for r in study.to_dict()["records"]] == ["train", "validate"]
    values = [p["value"] for e in study.identify("physical").to_dict()["effects"] for p in e["parameters"]]
    assert abs(values[0] / 9e3 - 1) < 0.02
    nullable = frame.assign(load=frame["load"].astype("Float64"))
    jw.Study.from_dataframe(nullable, t="when", force="load", displacement="far", units={"far": "mm", "load": "lbf"})
    nullable.loc[7, "load"] = pandas.NA
    with pytest.raises(jw.DataError, match="row 8 .*NaN"):
        jw.Study.from_dataframe(nullable, t="when", force="load", displacement="far", units={"far": "mm", "load": "lbf"})


def test_arrays_of_any_layout_and_type_give_the_same() -> None:
    data = joint(3000)
    wanted = jw.Study.from_arrays(t=data["t"], force=data["force"], displacement=data["displacement"], **KNOWN)
    wanted = wanted.identify("physical").to_dict()["effects"]
    both = np.column_stack([data["force"], data["displacement"]])
    locked = data["t"].copy()
    locked.flags.writeable = False
    swapped = both[:, 1].astype(">f8")
    for force, displacement in ((both[:, 0], both[:, 1]), (both[::-1, 0][::-1], swapped), (list(both[:, 0]), swapped)):
        study = jw.Study.from_arrays(t=locked, force=force, displacement=displacement, **KNOWN)
        assert study.identify("physical").to_dict()["effects"] == wanted
    # A read-only or strided array predicts as well.
    model = study.identify("physical")
    plain = model.predict(np.ascontiguousarray(both[:, 1]), locked)
    assert np.array_equal(model.predict(both[:, 1], locked), plain)
