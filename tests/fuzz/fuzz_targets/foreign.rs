//! One of the readers of foreign bytes under libFuzzer: the environment variable `TARGET` names
//! which (`jointwatch_tests::foreign::TARGETS`). With `WRITE_SEEDS` it writes the seeds of all of
//! them into folders of that folder instead, and prints a line per reader: its name, where it runs,
//! and the longest input worth a try.
#![no_main]

use jointwatch_tests::foreign::{TARGETS, Target, target};
use libfuzzer_sys::fuzz_target;
use std::path::Path;
use std::sync::OnceLock;

static CHOSEN: OnceLock<&Target> = OnceLock::new();

fn write_seeds(folder: &Path) {
    for target in &TARGETS {
        let folder = folder.join(target.name);
        std::fs::create_dir_all(&folder).expect("a folder");
        for (number, seed) in (target.seeds)().iter().enumerate() {
            std::fs::write(folder.join(format!("seed-{number}")), seed).expect("a file");
        }
        let part = format!("{:?}", target.part).to_lowercase();
        println!("{} {part} {}", target.name, target.longest());
    }
}

fuzz_target!(
    init: {
        if let Some(folder) = std::env::var_os("WRITE_SEEDS") {
            write_seeds(Path::new(&folder));
            std::process::exit(0);
        }
        let name = std::env::var("TARGET").expect("TARGET names the reader");
        let chosen = target(&name).expect("one of the readers");
        CHOSEN.set(chosen).expect("the first to choose");
    },
    |bytes: &[u8]| (CHOSEN.get().expect("chosen").read)(bytes)
);
