//! The layers of the code: imports run downwards only, and no two files import each other.

use jointwatch_tests::imports::Imports;
use std::path::{Path, PathBuf};

/// The folders of `host/src` from the bottom up: a file imports from its own folder and from those
/// before it.
const LAYERS: [&str; 14] = [
    "text", "study", "signal", "model", "fit", "assess", "diagnose", "simulate", "device",
    "emulate", "report", "paper", "lab", "cli",
];

/// Circles that are still there. The list only gets shorter: a circle that is not in it fails the
/// test, and so does one that is listed and gone.
const STILL_THERE: &[(&str, &[&str])] = &[];

fn source(package: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("..")
        .join(package)
        .join("src")
}

/// The layer of a file; nothing for the crate's root, which hands on names of all layers.
fn layer(file: &Path) -> Option<usize> {
    let folder = file.iter().next().expect("a file has a name");
    let found = LAYERS.iter().position(|l| folder == *l);
    assert!(
        found.is_some() || file.ends_with("lib.rs") || file.ends_with("main.rs"),
        "{} is in none of the folders {LAYERS:?}",
        file.display()
    );
    found
}

#[test]
fn a_file_of_the_host_imports_only_from_its_own_layer_and_those_below() {
    let imports = Imports::read(&source("host"));
    assert!(imports.edges.len() > 100, "the files were not found");
    let upwards: Vec<String> = imports
        .edges
        .iter()
        .filter_map(|(from, targets)| Some((from, layer(from)?, targets)))
        .flat_map(|(from, level, targets)| {
            targets
                .iter()
                .filter(move |to| layer(to).is_some_and(|l| l > level))
                .map(move |to| format!("{} imports {}", from.display(), to.display()))
        })
        .collect();
    assert!(upwards.is_empty(), "{}", upwards.join("\n"));
}

#[test]
fn no_more_files_import_each_other_in_a_circle() {
    let found: Vec<(&str, Vec<String>)> = ["shared", "host", "firmware"]
        .into_iter()
        .flat_map(|package| {
            let cycles = Imports::read(&source(package)).cycles();
            cycles.into_iter().map(move |files| {
                let names = files.iter().map(|f| f.display().to_string());
                (package, names.collect())
            })
        })
        .collect();
    let listed: Vec<(&str, Vec<String>)> = STILL_THERE
        .iter()
        .map(|(package, files)| (*package, files.iter().map(|f| f.to_string()).collect()))
        .collect();
    for circle in &found {
        assert!(listed.contains(circle), "a new circle: {circle:?}");
    }
    for circle in &listed {
        assert!(
            found.contains(circle),
            "no circle any more, take it off the list: {circle:?}"
        );
    }
}

#[test]
fn a_module_is_a_file_or_a_folder_and_not_both() {
    for package in ["shared", "host", "firmware", "tests"] {
        let imports = Imports::read(&source(package));
        for file in imports.edges.keys() {
            let folder = source(package).join(file.with_extension(""));
            assert!(
                !folder.is_dir(),
                "{package}: {} stands beside a folder of its name",
                file.display()
            );
        }
    }
}
