//! Records of more rows than a study holds: stretches of them are read, whatever the format, and
//! give the parameters that are true.

use jointwatch::assess::compare;
use jointwatch::fit::errors::RecordFigures;
use jointwatch::fit::identify;
use jointwatch::study::Study;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::fs;

const ROWS: usize = 300_000;
const STIFFNESS: f64 = 2e4;
const DAMPING: f64 = 30.0;

/// Rows of time, displacement and force of a spring with a damper under a random motion.
fn rows() -> Vec<[f64; 3]> {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let tones: [(f64, f64); 12] = std::array::from_fn(|_| {
        (
            random.random_range(3.0..40.0),
            random.random_range(0.0..6.3),
        )
    });
    let row = |at: usize| {
        let t = at as f64 / 1000.0;
        let (mut x, mut v) = (0.0, 0.0);
        for (hertz, phase) in tones {
            let rate = std::f64::consts::TAU * hertz;
            x += 1e-4 * (rate * t + phase).sin();
            v += 1e-4 * rate * (rate * t + phase).cos();
        }
        [t, x, STIFFNESS * x + DAMPING * v]
    };
    (0..ROWS).map(row).collect()
}

#[test]
fn stretches_of_long_records_are_learnt_from_and_it_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let rows = rows();
    let mut text = "t,x,F\n".to_owned();
    for row in &rows {
        text += &format!("{},{},{}\n", row[0], row[1], row[2]);
    }
    fs::write(here.join("run.csv"), text).unwrap();
    let head = format!(
        "{{'descr': [('t', '<f8'), ('x', '<f8'), ('F', '<f8')], 'fortran_order': False, 'shape': ({ROWS},), }}\n"
    );
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((head.len() as u16).to_le_bytes());
    bytes.extend(head.as_bytes());
    bytes.extend(rows.iter().flatten().flat_map(|v| v.to_le_bytes()));
    fs::write(here.join("run.npy"), bytes).unwrap();
    let models = ["run.csv", "run.npy"].map(|file| {
        let study = format!(
            "time = \"t\"\naxis = [{{ name = \"x\", kind = \"translation\", displacement = \"x\", force = \"F\", inertia = 0.0 }}]\n\
             base = {{ terms = [\"stiffness@x\", \"viscous@x\"] }}\nrecord = [\n\
             {{ file = \"{file}\", role = \"train\", rows = [0, 280000] }},\n\
             {{ file = \"{file}\", role = \"validate\", rows = [280000, 300000] }}]\n"
        );
        let path = here.join("study.toml");
        fs::write(&path, study).unwrap();
        let study = Study::read(&path).unwrap();
        let held: usize = study.records.iter().map(|record| record.rows).sum();
        assert!((200_000..=1 << 18).contains(&held), "{held} rows");
        let note = study.notes.iter().find(|note| note.contains("are looked at"));
        assert!(note.is_some_and(|n| n.starts_with("of 300000 rows")), "{:?}", study.notes);
        // The short record is whole; the long one is seen from end to end.
        let last = study.records.last().unwrap();
        assert_eq!((last.first_row, last.rows), (280_000, 20_000));
        let training = &study.records[study.records.len() - 2];
        assert_eq!(training.first_row + training.rows, 280_000);
        let whole = Study::read_whole(&path).unwrap();
        assert_eq!(whole.records.len(), 2);
        let model = identify::physical(&study).unwrap().model;
        let values = model.effects.iter().map(|effect| effect.parameters[0].value);
        for (found, truth) in values.zip([STIFFNESS, DAMPING]) {
            assert!((found / truth - 1.0).abs() < 1e-3, "{found} for {truth}");
        }
        // Stretches of a file are told apart by their first rows.
        let compared = compare::compare(&study, &model).unwrap().records;
        let all: Vec<&RecordFigures> = compared.iter().collect();
        let name = all.last().unwrap().name(&all);
        assert_eq!(name, format!("{file} from row 280000"));
        serde_json::to_string(&model.effects).unwrap()
    });
    assert_eq!(models[0], models[1]);
}
