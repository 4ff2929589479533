"""What comes from Python is what comes from the command line, to the bit."""

import json

import jointwatch as jw
import pytest

from conftest import Rig


@pytest.mark.parametrize(
    ("kind", "options", "words"),
    [
        ("physical", {}, []),
        ("physical", {"terms": ["stiffness@x", "viscous@x"]}, None),
        ("polynomial", {}, []),
        ("polynomial", {"fit": "select"}, ["--fit", "select"]),
        ("network", {"neurons": 6, "restarts": 2, "seed": 5}, ["--neurons", "6", "--restarts", "2", "--seed", "5"]),
    ],
)
def test_model_json_has_the_same_bytes(rig: Rig, tmp_path, kind, options, words) -> None:
    study = rig.study
    if words is None:
        # The same terms, written where the command line reads them.
        text = study.read_text()
        before, after = text.split("[base]")
        study = rig.folder / "terms.toml"
        study.write_text(f'{before}[base]\nterms = ["stiffness@x", "viscous@x"]\n')
        words = []
        assert "terms" in after
    written = tmp_path / "command.json"
    done = rig.run("identify", study.name, "--model", kind, *words, "-o", str(written))
    assert done.returncode == 0, done.stderr
    model = jw.Study.open(rig.study).identify(kind, **options)
    model.save(tmp_path / "python.json")
    assert (tmp_path / "python.json").read_bytes() == written.read_bytes()


def test_compare_diagnose_add_respond_and_export_say_the_same(rig: Rig, tmp_path) -> None:
    study, base = jw.Study.open(rig.folder), jw.Model.open(rig.folder / "base.json")
    assert base.compare(study).to_dict() == rig.json("compare", "study.toml", "base.json")

    diagnosis = base.diagnose(study)
    assert diagnosis.to_dict() == rig.json("diagnose", "study.toml", "base.json")
    assert (diagnosis.verdict, diagnosis.effects) == ("effect", ["coulomb@x"])
    explained = rig.json("diagnose", "study.toml", "base.json", "--explain", "--without", "coulomb")
    assert base.diagnose(study, explain=True, without=["coulomb"]).to_dict() == explained

    added = base.add(diagnosis.effects, study)
    told = rig.json("add", "study.toml", "base.json", "coulomb@x", "-o", "added.json")
    assert told.pop("model") == "added.json"
    said = added.to_dict()
    assert said.pop("model") is None
    assert said == told and added.helps
    added.model.save(tmp_path / "added.json")
    assert (tmp_path / "added.json").read_bytes() == (rig.folder / "added.json").read_bytes()
    before, after = added.errors["x"]
    assert after < 0.5 * before

    assert added.model.respond(study).to_dict() == rig.json("respond", "study.toml", "added.json")

    exported = added.model.export(tmp_path / "model.bin")
    told = rig.json("export", "added.json", "-o", "model.bin")
    assert (tmp_path / "model.bin").read_bytes() == (rig.folder / "model.bin").read_bytes()
    assert exported.to_dict()["axes"] == told["axes"] and exported.bytes == told["bytes"]


def test_refusals_are_the_same_sentences(rig: Rig, tmp_path) -> None:
    def raised(error, work) -> str:
        with pytest.raises(error) as caught:
            work()
        return str(caught.value)

    study, base = jw.Study.open(rig.study), jw.Model.open(rig.folder / "base.json")
    missing = str(tmp_path / "no.toml")
    assert raised(jw.DataError, lambda: jw.Study.open(missing)) == rig.sentence("compare", missing, "base.json").replace(
        "base.json: ", ""
    )
    assert raised(jw.DataError, lambda: jw.Model.open(rig.study)) == rig.sentence(
        "compare", "study.toml", str(rig.study)
    )
    assert raised(jw.DataError, lambda: base.add("coulom@x", study)) == rig.sentence(
        "add", "study.toml", "base.json", "coulom@x"
    )
    assert raised(jw.UsageError, lambda: base.diagnose(study, without=["nothing"])) == rig.sentence(
        "diagnose", "study.toml", "base.json", "--without", "nothing"
    )
    assert raised(jw.FailedError, lambda: base.save(tmp_path / "none" / "m.json")).startswith(str(tmp_path))


def test_a_model_comes_back_from_its_dictionary_and_its_pickle(rig: Rig) -> None:
    import pickle

    base = jw.Model.open(rig.folder / "base.json")
    assert base.to_dict() == json.loads((rig.folder / "base.json").read_text())
    assert pickle.loads(pickle.dumps(base)).to_dict() == base.to_dict()
