//! What is refused about a log, and what is forgiven.

use super::{HEADING, STUDY, log, read, refused, write};
use jointwatch::study::Study;
use std::fs;
use tempfile::TempDir;

/// The file's line in which row 0 stands.
const FIRST: usize = 2;

/// Refused after one cell of the log was changed (column by its place).
fn cell(row: usize, column: usize, value: &str, parts: &[&str]) {
    let mut lines = log();
    let mut cells: Vec<&str> = lines[row + 1].split(',').collect();
    cells[column] = value;
    lines[row + 1] = cells.join(",");
    let line = format!("row {} (line of the file)", row + FIRST);
    let mut all = vec!["one.csv", &line];
    all.extend(parts);
    refused(read(STUDY, &lines.join("\n")), &all);
}

#[test]
fn the_good_study_is_read_in_si_and_whatever_the_line_ends_delimiter_and_mark() {
    let study = read(STUDY, &log().join("\n")).unwrap();
    assert_eq!((study.records.len(), study.records[0].rows), (2, 700));
    assert_eq!(study.sample_rate_hz, 1000.0);
    let plain = study.records[0].axes.clone();
    let semicolons = log().join("\n").replace(',', ";");
    let tabs = format!(
        "\u{feff}# from the rig\r\n\r\n{}\r\n",
        log().join("\r\n").replace(',', "\t")
    );
    for text in [semicolons, tabs] {
        assert_eq!(read(STUDY, &text).unwrap().records[0].axes, plain);
    }
    let inches = STUDY.replace(
        "\"force_N\"",
        "{ column = \"force_N\", unit = \"lbf\", scale = 2.0, offset = 1.0 }",
    );
    let scaled = read(&inches, &log().join("\n")).unwrap();
    let (found, logged) = (scaled.records[0].axes[0].force[7], plain[0].force[7]);
    assert!((found - (2.0 * logged + 1.0) * 4.448_221_615_260_5).abs() < 1e-12);
}

#[test]
fn columns() {
    let missing = |name: &str, parts: &[&str]| {
        let study = STUDY.replace("\"force_N\"", &format!("{name:?}"));
        refused(read(&study, &log().join("\n")), parts);
    };
    missing(
        "forse_N",
        &["one.csv", "forse_N", "did you mean \"force_N\"?"],
    );
    missing(
        "temperature",
        &["one.csv", "temperature", "choose from t_s, x2_m"],
    );
    let twice = log().join("\n").replacen("x2_m", "x3_m", 1);
    refused(read(STUDY, &twice), &["one.csv", "x3_m", "twice"]);
    let bare = log()[1..].join("\n");
    refused(
        read(STUDY, &bare),
        &["one.csv", "row 1 ", "heading", "columns = "],
    );
}

#[test]
fn values_that_are_no_measurements() {
    cell(40, 4, "NaN", &["\"force_N\"", "NaN", "rows = "]);
    cell(41, 3, "inf", &["\"a2_m_s2\"", "inf"]);
    cell(42, 2, "-Infinity", &["\"x3_m\"", "-inf"]);
    cell(43, 1, "1e999", &["\"x2_m\"", "inf"]);
    cell(
        44,
        4,
        "3.1 N",
        &["\"force_N\"", "\"3.1 N\" is not a number"],
    );
    cell(45, 4, "", &["\"force_N\"", "empty"]);
    cell(46, 0, "NaN", &["\"t_s\""]);
}

#[test]
fn a_bad_value_outside_the_rows_taken_does_not_matter() {
    let mut lines = log();
    lines[3] = "broken".to_owned();
    let study = STUDY.replacen("role = \"train\"", "role = \"train\"\nrows = [10, 300]", 1);
    let read = read(&study, &lines.join("\n")).unwrap();
    assert_eq!((read.records[0].first_row, read.records[0].rows), (10, 290));
}

#[test]
fn decimal_commas_are_read_and_a_stray_one_is_refused() {
    let plain = read(STUDY, &log().join("\n")).unwrap();
    let commas = log().join("\n").replace(',', ";").replace('.', ",");
    assert_eq!(
        read(STUDY, &commas).unwrap().records[0].axes,
        plain.records[0].axes
    );
    let mut stray: Vec<String> = log().iter().map(|l| l.replace(',', ";")).collect();
    stray[30] = stray[30].replacen('.', ",", 1);
    refused(
        read(STUDY, &stray.join("\n")),
        &["one.csv", "row 31 ", "\"t_s\"", "decimal comma"],
    );
}

#[test]
fn whatever_surrounds_and_encodes_the_rows() {
    let plain = read(STUDY, &log().join("\n")).unwrap().records[0]
        .axes
        .clone();
    let lines = log();
    let with_units = format!(
        "Rig 4;run 7;;;\nOperator;\u{fc};;;\n\n{}\ns;m;m;m/s^2;N\n{}\n",
        lines[0].replace(',', ";"),
        lines[1..].join("\n").replace(',', ";").replace('.', ",")
    );
    let quoted: Vec<String> = lines
        .iter()
        .map(|l| {
            l.split(',')
                .map(|c| format!("\"{c}\""))
                .collect::<Vec<_>>()
                .join(",")
        })
        .collect();
    let trailing = format!("{},\n{},\n", lines[0], lines[1..].join(",\n"));
    let rows_only = format!("{}\n{},\n", lines[0], lines[1..].join(",\n"));
    let folder = TempDir::new().unwrap();
    write(&folder, STUDY, "");
    let read_bytes = |bytes: &[u8]| {
        fs::write(folder.path().join("one.csv"), bytes).unwrap();
        Study::read(folder.path()).unwrap().records[0].axes.clone()
    };
    for text in [
        with_units.clone(),
        quoted.join("\n"),
        trailing,
        rows_only,
        lines.join("\r"),
        lines.join("\n").replace(',', "   "),
        lines.join("\n").replace(',', "\t"),
        format!(
            "# {}\n{}",
            lines[0].replace(',', " "),
            lines[1..].join("\n").replace(',', " ")
        ),
    ] {
        assert_eq!(read_bytes(text.as_bytes()), plain, "{}", &text[..60]);
    }
    let latin: Vec<u8> = with_units.chars().map(|c| c as u32 as u8).collect();
    assert_eq!(read_bytes(&latin), plain);
    for mark in [true, false] {
        let start = if mark { "\u{feff}" } else { "" };
        let text = format!("{start}{}", lines.join("\r\n"));
        let little: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
        let big: Vec<u8> = text.encode_utf16().flat_map(u16::to_be_bytes).collect();
        assert_eq!(read_bytes(&little), plain, "mark {mark}");
        assert_eq!(read_bytes(&big), plain, "mark {mark}");
    }
}

#[test]
fn units_of_the_file_are_used_and_held_against_the_study() {
    let with = |unit: &str| {
        let mut lines = log();
        lines.insert(1, format!("s,m,m,m/s^2,{unit}"));
        lines.join("\n")
    };
    let plain = read(STUDY, &log().join("\n")).unwrap();
    let kilo = read(STUDY, &with("kN")).unwrap();
    let (found, logged) = (
        kilo.records[0].axes[0].force[7],
        plain.records[0].axes[0].force[7],
    );
    assert_eq!(found, logged * 1e3);
    refused(
        read(STUDY, &with("mm")),
        &["one.csv", "\"force_N\"", "not one of force", "unit = "],
    );
    let stated = STUDY.replace("\"force_N\"", "{ column = \"force_N\", unit = \"N\" }");
    let both = read(&stated, &with("kN")).unwrap();
    assert_eq!(both.records[0].axes[0].force[7], logged);
    assert!(
        both.notes
            .iter()
            .any(|n| n.contains("kN") && n.contains("study.toml")),
        "{:?}",
        both.notes
    );
}

#[test]
fn rows_that_are_short_or_long_and_comments_that_move_the_lines() {
    let mut lines = log();
    lines[20] = "0.019,1e-4".to_owned();
    refused(
        read(STUDY, &lines.join("\n")),
        &["one.csv", "row 21 (line of the file)", "short"],
    );
    let commented = format!("# rig 4\n#\n\n{}", lines.join("\n"));
    refused(
        read(STUDY, &commented),
        &["row 24 (line of the file)", "2 cells", "5 columns"],
    );
    lines[20] = "0.019,1e-4,2,3,4,5".to_owned();
    refused(
        read(STUDY, &lines.join("\r\n")),
        &["row 21 (line of the file)", "long"],
    );
}

#[test]
fn files_that_hold_nothing_or_something_else() {
    refused(read(STUDY, ""), &["one.csv", "empty"]);
    refused(read(STUDY, "\n \n"), &["one.csv", "empty"]);
    refused(read(STUDY, HEADING), &["one.csv", "no row"]);
    refused(read(STUDY, "# nothing\n"), &["one.csv", "comments"]);
    refused(
        read(STUDY, &log()[..60].join("\n")),
        &["one.csv", "59 rows", "100"],
    );
    let folder = TempDir::new().unwrap();
    write(&folder, STUDY, "");
    let mut latin = log().join("\n").into_bytes();
    latin.extend(b"\n0.3,1,2,\xb5,4");
    fs::write(folder.path().join("one.csv"), latin).unwrap();
    refused(
        Study::read(folder.path()),
        &["one.csv", "row 702 ", "is not a number"],
    );
    for (bytes, seems) in [
        (&b"%PDF-1.7 and so on"[..], "a PDF document"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", ".xls"),
        (b"\x00\x01\x02\x03\x04\x05\x06\x07", "neither text nor"),
        (b"\x1f\x8b\x08\x00\x00\x00\x00\x00\x00\x03cut", "unpacked"),
        (
            b"Dear reader,\nthis is a letter.\n",
            "without a table of numbers",
        ),
    ] {
        fs::write(folder.path().join("one.csv"), bytes).unwrap();
        refused(Study::read(folder.path()), &["one.csv", seems]);
    }
    fs::remove_file(folder.path().join("one.csv")).unwrap();
    refused(
        Study::read(folder.path()),
        &["one.csv", "cannot be read", "path"],
    );
    fs::create_dir(folder.path().join("one.csv")).unwrap();
    refused(Study::read(folder.path()), &["one.csv", "folder"]);
}

#[test]
fn other_formats() {
    let folder = TempDir::new().unwrap();
    for (name, bytes, parts) in [
        ("one.mat", "not MATLAB at all", ["one.mat", "-v7"]),
        (
            "one.json",
            "{\"data\": [[0, 1], [NaN, 2]]}",
            ["one.json", "row 1"],
        ),
        ("one.json", "{\"data\": []}", ["one.json", "empty"]),
        (
            "one.json",
            "{\"data\": [[0, 1]]}",
            ["one.json", "no column"],
        ),
    ] {
        write(&folder, &STUDY.replace("one.csv", name), "");
        fs::write(folder.path().join(name), bytes).unwrap();
        refused(Study::read(folder.path()), &parts);
    }
    let rows: Vec<String> = log()[1..].iter().map(|l| format!("[{l}]")).collect();
    let named = STUDY.replace(
        "one.csv\"",
        "one.json\"\ncolumns = [\"t_s\", \"x2_m\", \"x3_m\", \"a2_m_s2\", \"force_N\"]",
    );
    let json = |rows: &[String]| format!("{{\"data\": [{}]}}", rows.join(", "));
    write(&folder, &named, "");
    fs::write(folder.path().join("one.json"), json(&rows)).unwrap();
    let study = Study::read(folder.path()).unwrap();
    assert_eq!(study.records[0].axes, study.records[1].axes);
    let mut broken = rows.clone();
    broken[8] = "[0.008, 1, null, 2, 3]".to_owned();
    fs::write(folder.path().join("one.json"), json(&broken)).unwrap();
    refused(
        Study::read(folder.path()),
        &["one.json", "row 9 ", "\"x3_m\"", "null"],
    );
    broken[8] = "[0.008, 1]".to_owned();
    fs::write(folder.path().join("one.json"), json(&broken)).unwrap();
    refused(
        Study::read(folder.path()),
        &["one.json", "row 9 ", "2 numbers"],
    );
}

#[test]
fn time() {
    cell(50, 0, "0.049", &["\"t_s\"", "twice", "sample_rate_hz"]);
    cell(50, 0, "0.0485", &["\"t_s\"", "after a later one"]);
    cell(50, 0, "0.0492", &["\"t_s\"", "sampled evenly"]);
    let study = STUDY.replace("sample_rate_hz = 1000.0", "sample_rate_hz = 2000.0");
    refused(
        read(&study, &log().join("\n")),
        &["one.csv", "\"t_s\"", "1000", "2000"],
    );
    let free = STUDY.replace("sample_rate_hz = 1000.0\n", "");
    assert_eq!(
        read(&free, &log().join("\n")).unwrap().sample_rate_hz,
        1000.0
    );
    refused(
        read(&free.replace("time = \"t_s\"\n", ""), &log().join("\n")),
        &["study.toml", "time", "sample_rate_hz"],
    );
}

#[test]
fn stamps_that_are_rounded_or_jitter_by_less_than_half_a_period_are_even() {
    let plain = read(STUDY, &log().join("\n")).unwrap();
    let restamped = |stamp: &dyn Fn(usize) -> String| {
        let mut lines = log();
        for (row, line) in lines.iter_mut().skip(1).enumerate() {
            let rest = line.split_once(',').unwrap().1.to_owned();
            *line = format!("{},{rest}", stamp(row));
        }
        read(STUDY, &lines.join("\n"))
    };
    // Written to whole 4 ms, so that each stamp stands there four times.
    let rounded = restamped(&|row| format!("{:.3}", (row as f64 / 4.0).round() * 4e-3)).unwrap();
    assert_eq!(rounded.records[0].axes, plain.records[0].axes);
    assert!(
        rounded
            .notes
            .iter()
            .any(|n| n.contains("rounded to 4.00e-3 s")),
        "{:?}",
        rounded.notes
    );
    let jitter = |row: usize| 0.4e-3 * ((row * 7919 % 101) as f64 / 50.0 - 1.0);
    let uneven = restamped(&|row| format!("{:.6}", row as f64 * 1e-3 + jitter(row))).unwrap();
    assert_eq!(uneven.records[0].axes, plain.records[0].axes);
    assert!(
        uneven.notes.iter().any(|n| n.contains("off an even grid")),
        "{:?}",
        uneven.notes
    );
    let wild = restamped(&|row| format!("{:.6}", row as f64 * 1e-3 + 2.0 * jitter(row)));
    refused(wild, &["one.csv", "\"t_s\""]);
}

#[test]
fn dates_and_times_are_seconds() {
    let plain = read(STUDY, &log().join("\n")).unwrap();
    for (start, zone) in [
        ("2026-03-14T23:59:59.", ""),
        ("2026-03-14 23:59:59.", "Z"),
        ("14.03.2026 23:59:59.", ""),
        ("23:59:59.", ""),
    ] {
        let mut lines = log();
        for (row, line) in lines.iter_mut().skip(1).enumerate() {
            let rest = line.split_once(',').unwrap().1.to_owned();
            // 700 rows of 1 ms, begun so that midnight is passed on the way.
            let stamp = match 600 + row {
                ms if ms < 1000 => format!("{start}{ms:03}{zone}"),
                ms => format!(
                    "{}{:03}{zone}",
                    start.replace("14", "15").replace("23:59:59", "00:00:00"),
                    ms - 1000
                ),
            };
            *line = format!("{stamp},{rest}");
        }
        let study = read(STUDY, &lines.join("\n")).unwrap();
        assert_eq!(study.records[0].axes, plain.records[0].axes, "{start}");
        assert_eq!(study.notes, plain.notes, "{start}");
    }
}

#[test]
fn dropped_samples_are_bridged_when_few_and_split_the_log_when_many() {
    let mut few = log();
    few.drain(101..104);
    let study = read(STUDY, &few.join("\n")).unwrap();
    assert_eq!(study.records[0].rows, 700);
    let note = study.notes.iter().find(|n| n.contains("bridged")).unwrap();
    assert!(
        note.contains("one.csv")
            && note.contains("3 samples were dropped in 1 place")
            && note.contains("row 101 "),
        "{note}"
    );
    let whole = read(STUDY, &log().join("\n")).unwrap();
    for row in 100..103 {
        let (a, b) = (
            study.records[0].axes[0].force[row],
            whole.records[0].axes[0].force[row],
        );
        assert!((a - b).abs() < 2e-3, "row {row}: {a} and {b}");
    }
    let mut long = log();
    long.drain(50..59);
    let split = read(STUDY, &long.join("\n")).unwrap();
    assert_eq!(
        (split.records[0].first_row, split.records[0].rows),
        (58, 642)
    );
    let note = split.notes.iter().find(|n| n.contains("split")).unwrap();
    assert!(
        note.contains("one.csv") && note.contains("row 51 ") && note.contains("is left out"),
        "{note}"
    );
    long.drain(301..310);
    refused(
        read(STUDY, &long.join("\n")),
        &["one.csv", "\"t_s\"", "missing in 2 places", "resample_hz"],
    );
    let mut often = log();
    for row in [250, 200, 150] {
        often.drain(row..row + 2);
    }
    refused(
        read(STUDY, &often.join("\n")),
        &["6 samples were dropped in 3 places", "first after row 150 "],
    );
}

#[test]
fn channels_that_stand_still() {
    for (column, name) in [(2, "\"x3_m\""), (3, "\"a2_m_s2\""), (4, "\"force_N\"")] {
        let still: Vec<String> = log()
            .iter()
            .enumerate()
            .map(|(i, line)| {
                let mut cells: Vec<&str> = line.split(',').collect();
                if i > 0 {
                    cells[column] = "0.5";
                }
                cells.join(",")
            })
            .collect();
        refused(
            read(STUDY, &still.join("\n")),
            &["one.csv", name, "same in all rows"],
        );
    }
}

#[test]
fn an_axis_may_rest_beside_one_that_moves_but_not_in_every_record() {
    let two = STUDY.replacen(
        "[[record]]",
        "[[axis]]\nname = \"y\"\nkind = \"translation\"\ndisplacement = \"y_m\"\nforce = \"fy_N\"\ninertia = 2.0\n\n[[record]]",
        1,
    );
    let with = |y: fn(usize) -> f64| {
        log()
            .iter()
            .enumerate()
            .map(|(i, l)| {
                if i == 0 {
                    format!("{l},y_m,fy_N")
                } else {
                    format!("{l},{},{}", y(i), 0.1 * y(i))
                }
            })
            .collect::<Vec<_>>()
            .join("\n")
    };
    let folder = TempDir::new().unwrap();
    write(&folder, &two, &with(|_| 0.25));
    fs::write(
        folder.path().join("two.csv"),
        with(|i| (i as f64 * 0.3).sin()),
    )
    .unwrap();
    assert!(Study::read(folder.path()).is_ok());
    fs::write(folder.path().join("two.csv"), with(|_| 0.25)).unwrap();
    refused(
        Study::read(folder.path()),
        &["one.csv", "\"y_m\"", "in every record"],
    );
}
