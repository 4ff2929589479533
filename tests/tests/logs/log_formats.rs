//! One record in every log format, each written by the program that usually writes it
//! (`tests/data/make_logs.py`), gives the same study, bit for bit; and each format damaged is
//! refused in a sentence or repaired with a note, never in silence.

use jointwatch::study::{Channels, Study};
use jointwatch_tests::program::workspace;
use std::fs;
use std::path::PathBuf;
use tempfile::TempDir;

fn file(name: &str) -> PathBuf {
    workspace().join("tests/data/logs").join(name)
}

/// Names of time, displacement, acceleration and force in a file, and its other names where it has
/// none.
struct Case {
    file: &'static str,
    names: [&'static str; 4],
    columns: &'static str,
}

/// As `asammdf` names them.
const MEASURED: [&str; 4] = ["time", "x_m", "a_m_s2", "F_N"];
const PLAIN: [&str; 4] = ["t_s", "x_m", "a_m_s2", "F_N"];

const fn plain(file: &'static str) -> Case {
    Case {
        file,
        names: PLAIN,
        columns: "",
    }
}

const EXACT: [Case; 19] = [
    plain("record.csv"),
    plain("record.csv.gz"),
    plain("german.csv"),
    plain("savetxt.txt"),
    plain("record.npz"),
    plain("structured.npy"),
    Case {
        file: "matrix.npy",
        names: ["0", "1", "2", "3"],
        columns: "",
    },
    Case {
        file: "matrix.npy",
        names: PLAIN,
        columns: "columns = [\"t_s\", \"x_m\", \"a_m_s2\", \"F_N\"]",
    },
    plain("record.mat"),
    Case {
        file: "matrix.mat",
        names: ["t_s", "log[1]", "log[2]", "log[3]"],
        columns: "",
    },
    plain("record.tdms"),
    plain("v73.mat"),
    plain("record.parquet"),
    plain("packed.parquet"),
    plain("record.arrow"),
    plain("stream.arrows"),
    Case {
        file: "groups.h5",
        names: ["run/t_s", "run/log[1]", "run/log[2]", "run/log[3]"],
        columns: "",
    },
    Case {
        file: "record.mf4",
        names: MEASURED,
        columns: "",
    },
    Case {
        file: "transposed.mf4",
        names: MEASURED,
        columns: "",
    },
];

/// A study of one record from these bytes, read.
fn read(case: &Case, bytes: &[u8]) -> Result<Study, String> {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join(case.file), bytes).unwrap();
    let [time, x, a, force] = case.names;
    let text = format!(
        "time = {time:?}\n[[axis]]\nname = \"x\"\nkind = \"translation\"\ndisplacement = {x:?}\nacceleration = {a:?}\nforce = \
         {force:?}\n[[record]]\nfile = {:?}\nrole = \"train\"\n{}\n",
        case.file, case.columns
    );
    fs::write(folder.path().join("study.toml"), text).unwrap();
    Study::read(folder.path()).map_err(|e| {
        assert_eq!(e.exit_code(), 3, "{e}");
        e.sentence
    })
}

fn channels(case: &Case) -> (f64, Channels) {
    let mut study = read(case, &fs::read(file(case.file)).unwrap())
        .unwrap_or_else(|e| panic!("{}: {e}", case.file));
    (study.sample_rate_hz, study.records.remove(0).axes.remove(0))
}

#[test]
fn the_same_record_gives_the_same_bits_from_every_format() {
    let wanted = channels(&EXACT[0]);
    assert_eq!(wanted.1.force.len(), 500);
    for case in &EXACT[1..] {
        assert_eq!(channels(case), wanted, "{}", case.file);
    }
    for name in ["ascii.uff", "binary.uff", "record.xlsx"] {
        let case = Case {
            file: name,
            names: match name {
                "record.xlsx" => PLAIN,
                _ => ["time", "x_m", "a_m_s2", "F_N"],
            },
            columns: "",
        };
        let (rate, found) = channels(&case);
        assert_eq!(rate, wanted.0);
        // The ASCII form has twelve digits, and openpyxl writes sixteen.
        let share = match name {
            "binary.uff" => 0.0,
            "record.xlsx" => 1e-15,
            _ => 1e-11,
        };
        for (a, b) in found.force.iter().zip(&wanted.1.force) {
            assert!((a - b).abs() <= share * b.abs(), "{name}: {a} and {b}");
        }
    }
}

#[test]
fn a_tdms_file_that_was_cut_off_is_read_as_far_as_it_goes_and_says_so() {
    let case = plain("record.tdms");
    let whole = channels(&case).1;
    let bytes = fs::read(file(case.file)).unwrap();
    let study = read(&case, &bytes[..bytes.len() - 100]).unwrap();
    let kept = &study.records[0].axes[0].force;
    assert_eq!(kept[..], whole.force[..kept.len()]);
    assert!(kept.len() >= 200 && kept.len() < 500, "{}", kept.len());
    assert!(
        study
            .notes
            .iter()
            .any(|n| n.contains("record.tdms ends in the middle")),
        "{:?}",
        study.notes
    );
}

#[test]
fn an_arrow_file_that_was_cut_off_is_read_up_to_its_last_whole_batch_and_says_so() {
    // Of 500 rows in batches of 200, three quarters of the bytes hold one whole batch.
    for (file_name, rows) in [("record.arrow", 200), ("stream.arrows", 200)] {
        let case = plain(file_name);
        let bytes = fs::read(file(case.file)).unwrap();
        let whole = channels(&case).1;
        let study = read(&case, &bytes[..bytes.len() * 3 / 4]).unwrap();
        let kept = &study.records[0].axes[0].force;
        assert_eq!(kept[..], whole.force[..rows], "{file_name}");
        let note = format!("{file_name} ends in the middle of a batch");
        assert!(
            study.notes.iter().any(|n| n.contains(&note)),
            "{:?}",
            study.notes
        );
    }
}

#[test]
fn columns_that_hold_no_plain_numbers_are_refused_by_name_and_times_count_from_the_first() {
    for file_name in ["types.parquet", "types.arrow"] {
        let bytes = fs::read(file(file_name)).unwrap();
        let case = |time: &'static str, force: &'static str| Case {
            file: file_name,
            names: [time, "x_m", "a_m_s2", force],
            columns: "",
        };
        let study = read(&case("t", "F_N"), &bytes).unwrap();
        assert_eq!(study.sample_rate_hz, 1000.0);
        let wanted = channels(&EXACT[0]).1.force;
        assert_eq!(study.records[0].axes[0].force[..], wanted[..120]);
        read(&case("t", "count"), &bytes).unwrap();
        for (force, why) in [
            ("text", "not numbers; write it as float64"),
            ("nothing", "not numbers"),
            ("decimal", "not numbers"),
            (
                "gap",
                "row 71 (counted from 1), column \"gap\": NaN is not a measurement",
            ),
            ("missing", "has no column \"missing\""),
        ] {
            let sentence = read(&case("t", force), &bytes).map(|_| ()).unwrap_err();
            assert!(
                sentence.contains(file_name) && sentence.contains(why),
                "{force}: {sentence}"
            );
        }
    }
}

/// A page, or a batch, that says it unpacks to a gigabyte and more is refused before anything is
/// made room for.
#[test]
fn sizes_that_lie_are_refused_before_memory_is_taken() {
    // Each column of `packed.parquet` is one page: its header begins with `15 00 15`, then its
    // unpacked size.
    let bytes = fs::read(file("packed.parquet")).unwrap();
    let case = plain("packed.parquet");
    let pages: Vec<usize> = (0..bytes.len() - 6)
        .filter(|at| bytes[*at..].starts_with(&[0x15, 0x00, 0x15]))
        .filter(|at| bytes[at + 3] & 0x80 != 0)
        .collect();
    assert!(pages.len() >= 4, "{pages:?}");
    for page in &pages[..4] {
        let mut bytes = bytes.clone();
        // 4004 bytes (c8 3e) becomes a number of the same two digits and three more, over what
        // follows.
        bytes[page + 3..page + 8].copy_from_slice(&[0xfe, 0xff, 0xff, 0xff, 0x0f]);
        let sentence = read(&case, &bytes).map(|_| ()).unwrap_err();
        assert!(
            sentence.contains("unpacks to more than"),
            "{page}: {sentence}"
        );
    }
    let bytes = fs::read(file("record.arrow")).unwrap();
    let case = plain("record.arrow");
    // 200 rows of 8 bytes, as each packed column says of itself.
    let size = 1600_i64.to_le_bytes();
    let at = (0..bytes.len() - 8).find(|at| bytes[*at..].starts_with(&size));
    let mut lying = bytes.clone();
    lying[at.unwrap()..][..8].copy_from_slice(&(1_i64 << 40).to_le_bytes());
    let sentence = read(&case, &lying).map(|_| ()).unwrap_err();
    assert!(sentence.contains("unpacks to more than"), "{sentence}");
}

/// A page of values by number whose dictionary is gone: the library panics there, and nothing of
/// that is seen.
#[test]
fn a_page_that_the_library_gives_up_at_is_told_in_a_sentence() {
    let case = plain("record.parquet");
    let mut bytes = fs::read(file("record.parquet")).unwrap();
    // A dictionary's page (`15 04`) becomes one of another kind (`15 02`), which is passed over.
    let is_dictionary = |at: &usize| bytes[*at..].starts_with(&[0x15, 0x04, 0x15]);
    let at = (0..bytes.len() - 3).find(is_dictionary).unwrap();
    bytes[at + 1] = 0x02;
    let sentence = read(&case, &bytes).map(|_| ()).unwrap_err();
    assert!(sentence.contains("a page is damaged"), "{sentence}");
}

#[test]
fn an_mdf_file_of_another_version_is_told_on_one_line() {
    let case = plain("record.mf4");
    for (begins, told) in [
        (b"MDF     3.30", "it is of version 3"),
        (b"MDF     \n\n\n\n", "its version is no number"),
    ] {
        let sentence = read(&case, begins).map(|_| ()).unwrap_err();
        assert!(sentence.contains(told), "{sentence}");
        assert_eq!(sentence.lines().count(), 1, "{sentence}");
    }
}

/// Whatever is done to a file, it is read in full, refused in one sentence that names it, or read
/// with a note.
#[test]
fn damaged_files_are_refused_or_repaired_and_never_a_panic() {
    let mut state = 20_260_314_u64;
    let mut draw = |below: usize| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    let universal = ["ascii.uff", "binary.uff"].map(|file| Case {
        file,
        names: ["time", "x_m", "a_m_s2", "F_N"],
        columns: "",
    });
    for case in EXACT.iter().chain(&universal) {
        let bytes = fs::read(file(case.file)).unwrap();
        let mut refused = 0;
        for turn in 0..40 {
            let mut bytes = bytes.clone();
            if turn % 2 == 0 {
                bytes.truncate(draw(bytes.len()));
            } else {
                for _ in 0..1 + draw(8) {
                    let at = draw(if turn % 4 == 1 { 600 } else { bytes.len() }.min(bytes.len()));
                    bytes[at] ^= 1 << draw(8);
                }
            }
            match read(case, &bytes) {
                Ok(_) => {}
                Err(sentence) => {
                    refused += 1;
                    assert!(
                        sentence.contains(case.file) && !sentence.contains('\n'),
                        "{sentence}"
                    );
                }
            }
        }
        println!("{}: {refused} of 40 refused", case.file);
        assert!(
            refused >= 5,
            "{}: only {refused} of 40 damaged files were refused",
            case.file
        );
    }
}

#[test]
fn a_bomb_is_refused_before_it_fills_the_memory() {
    use std::io::Write;
    let case = plain("record.csv.gz");
    // Two gigabytes of zeros in two megabytes: deflate stores a run of 258 in a few bits.
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    let block = vec![b'0'; 1 << 20];
    for _ in 0..1100 {
        packed.write_all(&block).unwrap();
    }
    let bytes = packed.finish().unwrap();
    assert!(bytes.len() < 20 << 20);
    let sentence = read(&case, &bytes).unwrap_err();
    assert!(
        sentence.contains("unpacks to more than")
            && sentence.contains("JOINTWATCH_MAX_UNPACKED_BYTES"),
        "{sentence}"
    );
}
