//! The pictures of `--plots`: sound SVG with titles and units, curves that show something, and the
//! failing region where a simulated clearance fails.

use jointwatch_tests::program::{fail, says, succeed};
use jointwatch_tests::story::story;
use std::fs;
use std::path::Path;

/// A picture's words, its curves' numbers of points, and the corners of its framed regions.
struct Seen {
    words: Vec<String>,
    curves: Vec<usize>,
    frames: usize,
}

fn seen(path: &Path) -> Seen {
    let text = fs::read_to_string(path).unwrap();
    assert!(
        text.len() < 400_000,
        "{}: {} bytes",
        path.display(),
        text.len()
    );
    assert!(
        !text.contains("NaN") && !text.contains("inf"),
        "{}",
        path.display()
    );
    let document = roxmltree::Document::parse(&text).unwrap();
    let nodes = || document.descendants();
    let points = |node: &roxmltree::Node<'_, '_>| {
        let points = node.attribute("points").unwrap_or_default();
        points.split_whitespace().count()
    };
    let curves = || nodes().filter(|n| n.has_tag_name("polyline"));
    Seen {
        words: nodes()
            .filter(|n| n.has_tag_name("text"))
            .map(|n| n.text().unwrap_or_default().trim().to_string())
            .collect(),
        frames: curves()
            .filter(|n| n.attribute("stroke") == Some("#D55E00") && points(n) == 5)
            .count(),
        curves: curves().map(|n| points(&n)).collect(),
    }
}

fn has(seen: &Seen, words: &str) -> bool {
    seen.words.iter().any(|w| w.contains(words))
}

#[test]
fn compare_draws_every_axis_that_moves_and_frames_where_the_clearance_fails() {
    let folder = tempfile::tempdir().unwrap();
    let into = folder.path().join("pictures");
    let into_text = into.to_str().unwrap();
    let said = succeed(
        story(),
        &["compare", "rig", "model.json", "--plots", into_text],
    );
    let index: Vec<&str> = said
        .lines()
        .filter(|l| l.starts_with("Pictures in"))
        .collect();
    assert_eq!(index.len(), 1, "{said}");
    let files: Vec<String> = fs::read_dir(&into)
        .unwrap()
        .map(|f| f.unwrap().file_name().into_string().unwrap())
        .collect();
    // Three training records (an axis rests in two of them) and the validation record, two pictures
    // each; a map per axis.
    assert_eq!(files.len(), 2 * (1 + 1 + 2 + 2) + 2, "{files:?}");
    for file in &files {
        assert!(
            index[0].contains(file.as_str()),
            "{file} is not in: {}",
            index[0]
        );
    }
    assert!(!files.contains(&"train_x-phi-force.svg".to_string()));

    let force = seen(&into.join("valid-phi-force.svg"));
    for words in [
        "valid.csv, phi",
        "residual of phi (",
        "N·m)",
        "time (s)",
        "measured",
        "model",
    ] {
        assert!(
            has(&force, words),
            "{words} is missing in {:?}",
            force.words
        );
    }
    let long = force.curves.iter().filter(|c| **c > 200).count();
    assert_eq!(long, 5, "{:?}", force.curves);
    let phase = seen(&into.join("valid-x-phase.svg"));
    for words in [
        "displacement of x (mm)",
        "velocity of x (m/s)",
        "force of x (N)",
    ] {
        assert!(
            has(&phase, words),
            "{words} is missing in {:?}",
            phase.words
        );
    }
    // The free play is 1.5 mm either side: a polynomial cannot follow the corners, and both are
    // framed.
    let map = seen(&into.join("where-x.svg"));
    assert_eq!(map.frames, 2, "{:?}", map.words);
    for words in ["displacement of x (mm)", "RMS residual of x (N)", "A: "] {
        assert!(has(&map, words), "{words} is missing in {:?}", map.words);
    }
    let region = map.words.iter().find(|w| w.starts_with("A: ")).unwrap();
    assert!(region.contains("|x| from"), "{region}");
}

#[test]
fn diagnose_and_add_draw_the_staircase_down_to_the_floor() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let run = |words: &str| succeed(here, words);
    let said = run("simulate --out rig --hidden coulomb@x --share 0.15 --duration 4");
    assert!(said.contains("coulomb@x"), "{said}");
    run("identify rig --model physical -o base.json");
    let said = run("diagnose rig base.json --plots found");
    assert!(said.contains("Missing: coulomb@x"), "{said}");
    run("add rig base.json coulomb@x -o model.json --plots added");
    for pictures in ["found", "added"] {
        let stairs = seen(&here.join(pictures).join("staircase.svg"));
        for words in [
            "before",
            "+ coulomb",
            "on x",
            "noise floor",
            "relative error of x (%)",
        ] {
            assert!(
                has(&stairs, words),
                "{words} is missing in {:?}",
                stairs.words
            );
        }
        assert!(here.join(pictures).join("where-x.svg").is_file());
    }
}

#[test]
fn a_folder_that_cannot_be_made_is_told_in_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("taken");
    fs::write(&file, "x").unwrap();
    let file = file.to_str().unwrap();
    let sentence = fail(
        story(),
        &["compare", "rig", "model.json", "--plots", file],
        1,
    );
    says(&sentence, &["taken", "name another"]);
}
