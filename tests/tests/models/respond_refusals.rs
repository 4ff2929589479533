//! What `jointwatch respond` refuses: records, models and truths that do not belong to the study.

use jointwatch_tests::program::{fail, read_json, says, succeed};
use jointwatch_tests::story::{copy_of_rig, story};
use std::fs;

#[test]
fn what_cannot_be_simulated_is_refused_in_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let rig = copy_of_rig(folder.path());
    let study = rig.join("study.toml");
    let good = fs::read_to_string(&study).unwrap();
    let model = story().join("model.json").to_str().unwrap().to_owned();
    let refused = |arguments: &[&str], code: i32, parts: &[&str]| {
        let mut all = vec!["respond", "rig", &model];
        all.extend(arguments);
        let sentence = fail(folder.path(), &all, code);
        says(&sentence, parts);
    };
    refused(
        &["--record", "vald.csv"],
        3,
        &["vald.csv", "did you mean \"valid.csv\""],
    );
    refused(&["--restart", "0"], 2, &["--restart 0", "2000 Hz"]);
    refused(&["--restart", "nan"], 2, &["--restart"]);
    refused(&["-o", "states.csv"], 2, &["--record"]);
    assert!(!folder.path().join("states.csv").exists());

    // Another joint.
    let (other, _) = good.split_once("[base]").unwrap();
    fs::write(&study, other.replace("name = \"phi\"", "name = \"theta\"")).unwrap();
    refused(&[], 3, &["theta (rotation)"]);
    fs::write(&study, &good).unwrap();

    // A force that already is the restoring force has no body to move.
    let mut massless = read_json(&model);
    massless["axes"][1]["inertia"] = 0.0.into();
    fs::write(folder.path().join("massless.json"), massless.to_string()).unwrap();
    let sentence = fail(folder.path(), "respond rig massless.json --measured", 3);
    says(&sentence, &["phi", "inertia 0"]);

    // A truth that is not that of the log: another seed, another rig, or no rig at all.
    let truth = rig.join("truth");
    fs::create_dir(&truth).unwrap();
    let original = story().join("rig/truth");
    for entry in fs::read_dir(&original).unwrap() {
        let entry = entry.unwrap();
        fs::copy(entry.path(), truth.join(entry.file_name())).unwrap();
    }
    let text = fs::read_to_string(original.join("truth.json")).unwrap();
    let said = succeed(folder.path(), &["respond", "rig", &model]);
    assert!(said.contains("its true motion"), "{said}");
    for (from, to) in [
        ("\"seed\": 3", "\"seed\": 4"),
        ("\"contact_stiffness\"", "\"contact_stiffness_\""),
        ("14000.0", "18000.0"),
    ] {
        let changed = text.replace(from, to);
        assert_ne!(changed, text, "{from} is not in the truth");
        fs::write(truth.join("truth.json"), changed).unwrap();
        refused(&[], 3, &["truth.json", "--measured"]);
    }
    let said = succeed(folder.path(), &["respond", "rig", &model, "--measured"]);
    assert!(said.contains("the logged force"), "{said}");
}
