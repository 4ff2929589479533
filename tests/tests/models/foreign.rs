//! Damaged bytes of every kind that is read: refused or read, never a panic. `tests/fuzz/run` looks
//! for worse ones, guided by coverage.

use jointwatch_tests::foreign::mutation::Mutation;
use jointwatch_tests::foreign::{TARGETS, Target};
use jointwatch_tests::program::workspace;
use rayon::prelude::*;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Damaged inputs per target.
const INPUTS: u64 = 3000;

/// The inputs at which a target panicked, which are left in `target/foreign`.
fn panics(target: &Target) -> Vec<String> {
    let seeds = (target.seeds)();
    assert!(!seeds.is_empty(), "{}", target.name);
    let whole = seeds.iter().map(|seed| (0, seed.clone()));
    let damaged = (1..=INPUTS).map(|number| {
        let seed = &seeds[number as usize % seeds.len()];
        (number, Mutation::new(number).damaged(seed))
    });
    let inputs: Vec<_> = whole.chain(damaged).collect();
    let fallen = inputs.par_iter().filter_map(|(number, bytes)| {
        catch_unwind(AssertUnwindSafe(|| (target.read)(bytes))).err()?;
        let folder = workspace().join("target/foreign");
        fs::create_dir_all(&folder).expect("a folder");
        let path = folder.join(format!("{}-{number}", target.name));
        fs::write(&path, bytes).expect("a file");
        Some(path.display().to_string())
    });
    fallen.collect()
}

#[test]
fn damaged_bytes_of_every_kind_are_read_or_refused_and_never_a_panic() {
    let mut all = Vec::new();
    for target in &TARGETS {
        let fallen = panics(target);
        println!(
            "{}: {} of {INPUTS} damaged inputs panicked",
            target.name,
            fallen.len()
        );
        all.extend(fallen);
    }
    assert!(all.is_empty(), "{all:#?}");
}
