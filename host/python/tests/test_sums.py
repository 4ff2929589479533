"""Sums of records: the bytes of the command line, and its models."""

from pathlib import Path

import jointwatch as jw
import pytest

from conftest import Rig


def test_sums_have_the_bytes_of_the_command_line_and_give_its_models(rig: Rig, tmp_path: Path) -> None:
    logs = sorted(rig.folder.glob("train*.csv"))
    assert len(logs) >= 1
    study = jw.Study.open(rig.study)
    done = rig.run("accumulate", "study.toml", *(log.name for log in logs), "-o", str(tmp_path / "all.acc"))
    assert done.returncode == 0, done.stderr
    parts = [jw.Sums.of_files(study, [log]) for log in reversed(logs)]
    whole = parts[0]
    for part in parts[1:]:
        whole = whole + part
    assert bytes(whole) == (tmp_path / "all.acc").read_bytes()
    assert whole.rows > 0 and {r["file"] for r in whole.records} == {log.name for log in logs}

    whole.save(tmp_path / "again.acc")
    assert bytes(jw.Sums.open(tmp_path / "again.acc")) == bytes(whole)
    written = tmp_path / "model.json"
    words = ["identify", "study.toml", "--from", str(tmp_path / "all.acc"), "--model", "polynomial", "-o", str(written)]
    done = rig.run(*words)
    assert done.returncode == 0, done.stderr
    whole.identify("polynomial", study=study).save(tmp_path / "python.json")
    assert (tmp_path / "python.json").read_bytes() == written.read_bytes()

    with pytest.raises(jw.DataError, match="counted already"):
        whole + parts[0]
    with pytest.raises(jw.UsageError, match="no model that sums give"):
        whole.identify("network")
    with pytest.raises(jw.DataError, match="no sums"):
        jw.Sums(b"nothing")
    with pytest.raises(jw.DataError, match="gone.acc"):
        jw.Sums.open(tmp_path / "gone.acc")


def test_sums_of_arrays_know_their_records_by_their_numbers(tmp_path: Path) -> None:
    from conftest import joint
    from jointwatch._sums import merge_bytes, plan_of

    arrays = joint(6000)
    study = jw.Study.from_arrays(**arrays, inertia=1.7, terms=["stiffness@x", "viscous@x"])
    plan = plan_of(study)
    columns = plan.columns()[0]
    study_log = dict(zip(columns, columns))
    assert len(study_log) >= 3
    # Columns as the study's own description names them.
    given = {"t": "t", "displacement": "displacement", "force": "force", "acceleration": "acceleration"}
    log = [(column, arrays[next(key for key in given if column.startswith(key))]) for column in columns]
    one, again = plan.sum_log(("one", log)), plan.sum_log(("two", log))
    with pytest.raises(jw.DataError, match="counted already"):
        merge_bytes([("one", one), ("two", again)])
    model = jw.Sums(one).identify("physical")
    assert abs(model.to_dict()["effects"][0]["parameters"][0]["value"] / 9e3 - 1) < 0.05
