//! The lab on a log too long to be held in memory: every peak is drawn, segments are chosen and
//! worked on, and the whole is a click away.
//!
//! A low limit in the environment makes a short log a long one.

use jointwatch_tests::lab::Lab;
use jointwatch_tests::program::succeed;
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

const LIMIT: [(&str, &str); 1] = [("JOINTWATCH_MAX_FILE_BYTES", "1000000")];
/// A row that holds a peak in the force.
const PEAK: usize = 12_345;

/// A simulated record as a NumPy array of a few megabytes, and a study that names it.
fn long_study() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let words = "simulate --out rig --axes 1 --duration 30 --seed 4";
    succeed(folder.path(), words);
    let rig = folder.path().join("rig");
    let text = fs::read_to_string(rig.join("train_x.csv")).unwrap();
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let mut rows: Vec<Vec<f64>> = lines
        .map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect())
        .collect();
    let force = names.iter().position(|n| n.starts_with("force")).unwrap();
    rows[PEAK][force] = 300.0;
    let fields: Vec<String> = names.iter().map(|n| format!("('{n}', '<f8')")).collect();
    let head = format!(
        "{{'descr': [{}], 'fortran_order': False, 'shape': ({},), }}\n",
        fields.join(", "),
        rows.len()
    );
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((head.len() as u16).to_le_bytes());
    bytes.extend(head.as_bytes());
    bytes.extend(rows.iter().flatten().flat_map(|v| v.to_le_bytes()));
    fs::write(rig.join("run.npy"), bytes).unwrap();
    let study = fs::read_to_string(rig.join("study.toml")).unwrap();
    let end = study.find("[[record]]").unwrap();
    let base = &study[study.find("[base]").unwrap()..];
    let record = |rows: &str| {
        format!(
            "{}[[record]]\nfile = \"run.npy\"\nrole = \"train\"\n{rows}\n{base}",
            &study[..end]
        )
    };
    fs::write(rig.join("study.toml"), record("")).unwrap();
    fs::write(rig.join("part.toml"), record("rows = [4000, 20000]\n")).unwrap();
    (folder, rig)
}

fn overview(lab: &Lab, rows: [usize; 2]) -> Value {
    let path = format!("/api/overview/0/{}/{}", rows[0], rows[1]);
    let (code, body) = lab.request("GET", &path, &[], b"");
    assert_eq!(code, 200, "{}", String::from_utf8_lossy(&body));
    serde_json::from_slice(&body).unwrap()
}

fn force(overview: &Value) -> &Value {
    let channels = overview["channels"].as_array().unwrap();
    let found = channels
        .iter()
        .find(|c| c["name"].as_str().unwrap().starts_with("force"));
    found.unwrap()
}

fn numbers(values: &Value) -> Vec<f64> {
    values
        .as_array()
        .unwrap()
        .iter()
        .map(|v| v.as_f64().unwrap())
        .collect()
}

fn read(lab: &Lab) -> Value {
    let mut state = lab.rest();
    while state["long"]["logs"][0]["read"] != state["long"]["logs"][0]["rows"] {
        state = lab.state(state["revision"].as_u64().unwrap());
    }
    state
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap();
    entries.map(|e| e.unwrap().path()).collect()
}

#[test]
fn a_long_log_is_drawn_with_its_peaks_and_worked_on_by_segments() {
    let (_folder, rig) = long_study();
    let before = files(&rig);
    let lab = Lab::start_with(&rig, &["study.toml"], &LIMIT);
    let state = read(&lab);
    assert_eq!(
        (&state["opened"], &state["study"]),
        (&json!("long"), &Value::Null)
    );
    let rows = state["long"]["logs"][0]["rows"].as_u64().unwrap() as usize;
    let whole = overview(&lab, [0, rows]);
    let [low, high] = ["low", "high"].map(|side| numbers(&force(&whole)[side]));
    assert!((600..=800).contains(&low.len()), "{}", low.len());
    let peak = high.iter().copied().fold(f64::MIN, f64::max);
    // The same row alone, and in a part of which every row is drawn.
    let near = overview(&lab, [PEAK - 50, PEAK + 50]);
    let highs = numbers(&force(&near)["high"]);
    assert_eq!(highs.len(), 100);
    let at = |of: &[f64]| of.iter().position(|v| *v == peak);
    assert_eq!(at(&highs), Some(50), "{peak} in {highs:?}");
    let part = at(&high).unwrap();
    let edges: Vec<u64> = serde_json::from_value(whole["rows"].clone()).unwrap();
    assert!((edges[part]..edges[part + 1]).contains(&(PEAK as u64)));
    let times = numbers(&whole["times"]);
    assert!(times.windows(2).all(|pair| pair[0] < pair[1]));

    // Nothing can be learnt from it, until segments are chosen.
    let (code, _) = lab.act(&json!({ "do": "work", "study": "part.toml" }));
    assert_eq!(code, 409);
    let state = lab.done(&json!({ "do": "select", "segments": 6, "seconds": 2 }));
    let chosen = "jointwatch-lab/segments/study.toml";
    assert_eq!(
        (&state["opened"], &state["file"]),
        (&json!("study"), &json!(chosen))
    );
    assert_eq!(
        state["done"].as_array().unwrap().last().unwrap()["command"],
        "jointwatch select study.toml --segments 6 --seconds 2 -o jointwatch-lab/segments"
    );
    assert_eq!(state["study"]["records"].as_array().unwrap().len(), 6);
    let state = lab.done(&json!({ "do": "identify", "kind": "polynomial" }));
    assert_eq!(state["current"], "jointwatch-lab/polynomial.json");
    let state = lab.done(&json!({ "do": "work", "study": "study.toml" }));
    assert_eq!(state["studies"], json!(["study.toml", chosen]));
    assert_eq!(read(&lab)["opened"], "long");
    let written: Vec<_> = files(&rig)
        .into_iter()
        .filter(|f| !before.contains(f))
        .collect();
    assert_eq!(written, [rig.join("jointwatch-lab")]);
}

#[test]
fn a_stretch_of_a_long_log_gives_the_model_of_the_same_rows() {
    let (_folder, rig) = long_study();
    let model = |name: &str, variables: &[(&str, &str)]| {
        let output = std::process::Command::new(jointwatch_tests::program::jointwatch())
            .current_dir(&rig)
            .args(["identify", "part.toml", "--model", "physical", "-o", name])
            .envs(variables.iter().copied())
            .output()
            .unwrap();
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        fs::read(rig.join(name)).unwrap()
    };
    assert_eq!(model("long.json", &LIMIT), model("short.json", &[]));
}

#[test]
fn a_long_log_in_text_is_drawn_as_the_same_log_in_an_array() {
    let (_folder, rig) = long_study();
    let array = fs::read(rig.join("run.npy")).unwrap();
    let study = fs::read_to_string(rig.join("study.toml")).unwrap();
    let text = fs::read_to_string(rig.join("train_x.csv")).unwrap();
    let head = text.lines().find(|line| !line.starts_with('#')).unwrap();
    let columns = head.split(',').count();
    let rows = array[array.len() - 60_000 * 8 * columns..].chunks_exact(8 * columns);
    let line = |row: &[u8]| {
        let cells = row.chunks_exact(8);
        let numbers = cells.map(|c| f64::from_le_bytes(c.try_into().unwrap()).to_string());
        numbers.collect::<Vec<_>>().join(",")
    };
    let lines: Vec<String> = rows.map(line).collect();
    fs::write(
        rig.join("run.csv"),
        format!("{head}\n{}\n", lines.join("\n")),
    )
    .unwrap();
    fs::write(rig.join("text.toml"), study.replace("run.npy", "run.csv")).unwrap();
    let seen = ["study.toml", "text.toml"].map(|study| {
        let lab = Lab::start_with(&rig, &[study], &LIMIT);
        let state = read(&lab);
        assert_eq!(state["opened"], "long");
        [[0, 60_000], [PEAK - 50, PEAK + 50]].map(|rows| overview(&lab, rows))
    });
    assert_eq!(seen[0], seen[1]);
}

#[test]
fn a_long_log_whose_rows_are_known_only_when_it_was_read_is_refused_with_what_to_do() {
    let (_folder, rig) = long_study();
    let study = fs::read_to_string(rig.join("study.toml")).unwrap();
    fs::write(rig.join("packed.toml"), study.replace("run.npy", "run.gz")).unwrap();
    fs::write(
        rig.join("run.gz"),
        [&[0x1f, 0x8b][..], &[7; 1_000_000]].concat(),
    )
    .unwrap();
    let lab = Lab::start_with(&rig, &["packed.toml"], &LIMIT);
    let state = lab.rest();
    assert_eq!(state["opened"], "wrong");
    let sentence = state["sentence"].as_str().unwrap();
    for wanted in [
        "run.gz",
        "CSV",
        "Parquet",
        "NumPy",
        "JOINTWATCH_MAX_FILE_BYTES",
    ] {
        assert!(sentence.contains(wanted), "{sentence}");
    }
}
