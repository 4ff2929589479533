//! The C library: the bits of Rust from C and C++, on this computer and on emulated processors;
//! every bad input with its error; and what a sample costs through the C boundary.

#[path = "../../../tests/src/elf.rs"]
#[allow(
    dead_code,
    unreachable_pub,
    reason = "it is the library of the tests, which use more of it"
)]
mod elf;

use elf::{Image, panic_paths};
use jointwatch_shared::base::Model;
use jointwatch_shared::chain::{Chain, ChainState};
use jointwatch_shared::monitor::{Faults, Monitor, MonitorState};
use jointwatch_shared::selftest::chain::{
    SHORT_TAPS, Watched, chain_digest, reference_rig, usual_rig,
};
use jointwatch_shared::selftest::network::reference_network;
use jointwatch_shared::selftest::{Digest, reference_model};
use jointwatch_shared::wire::rig::Rig;
use jointwatch_shared::wire::{blob, rig_block};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

/// The seed of `firmware/c/tests/motion.h`.
const SEED: u64 = 20_070_099;
/// Samples of the digests on this computer, and of `firmware/c/tests/device.c`.
const SAMPLES: u32 = 20_000;
const CHAIN_SAMPLES: u32 = 2000;
const WATCHED_SAMPLES: u32 = 5000;
/// Under what a compiler of C has to stay silent.
const STRICT: [&str; 6] = [
    "-O2",
    "-Wall",
    "-Wextra",
    "-Wpedantic",
    "-Wconversion",
    "-Werror",
];
/// What a sample may take more through the C boundary than in Rust, in percent: 3.4 were measured,
/// for checks of pointers and for the output, which C and Rust lay out differently.
const MAX_PERCENT: u64 = 4;
/// What the C program may use of the stack, making its objects included.
const MAX_STACK: u64 = 40 * 1024;

/// Skips a test, past the capture of the harness: a skipped case must not read as a passed one.
fn skipped(why: &str) {
    let _ = writeln!(std::io::stderr(), "SKIPPED: {why}");
}

fn is_there(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok()
}

/// Runs a program and expects it to succeed.
fn succeed(command: &mut Command) -> String {
    let Output {
        status,
        stdout,
        stderr,
    } = command.output().expect("it starts");
    let (said, complaints) = (
        String::from_utf8_lossy(&stdout),
        String::from_utf8_lossy(&stderr),
    );
    assert!(
        status.success(),
        "{command:?}: {status}\n{said}{complaints}"
    );
    said.into_owned()
}

fn folder() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn workspace() -> PathBuf {
    folder().join("../..")
}

/// Builds something for the device, or for this computer without a target, and gives the folder
/// that it is in.
fn build(what: &[&str], target: Option<&str>) -> PathBuf {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
    command
        .current_dir(workspace())
        .args(["build", "--quiet", "--profile", "device"])
        .args(what)
        .env_remove("RUSTFLAGS")
        .env_remove("CARGO_ENCODED_RUSTFLAGS");
    let mut place = workspace().join("target");
    if let Some(target) = target {
        command.args(["--target", target]);
        place.push(target);
    }
    succeed(&mut command);
    place.join("device")
}

/// The static library for a target, for this computer without one.
fn library(target: Option<&str>) -> PathBuf {
    build(&["-p", "jointwatch-c"], target).join("libjointwatch_c.a")
}

/// The bytes that a rig block has beside a model.
fn block(mut rig: Rig, model: &[u8; blob::BLOB_LEN]) -> Vec<u8> {
    rig.model_checksum = blob::checksum(model);
    if let Some(limits) = &mut rig.limits {
        limits.model_checksum = rig.model_checksum;
    }
    rig_block::encode(&rig).expect("a sound rig").to_vec()
}

/// A model, a rig for the digest of its chain, and one with limits for its monitor.
fn blocks(model: &Model) -> [Vec<u8>; 3] {
    let bytes = blob::encode(model);
    let rig = reference_rig(SHORT_TAPS).expect("a sound rig");
    let watched = usual_rig(model, false).expect("a sound rig");
    [bytes.to_vec(), block(rig, &bytes), block(watched, &bytes)]
}

/// What `watched_digest` of `firmware/c/tests/motion.h` computes.
fn watched_digest(model: &Model, samples: u32) -> u64 {
    let mut rig = usual_rig(model, false).expect("a sound rig");
    let chain = Chain::new(model, &rig).expect("they fit");
    let limits = rig.limits.take().expect("it has limits");
    let monitor = Monitor::new(limits, &chain).expect("they fit");
    let (mut state, mut watch) = (ChainState::NEW, MonitorState::default());
    let mut motion = Watched::new(model, SEED, false).expect("they fit");
    let mut digest = Digest::new();
    for number in 0..samples {
        let raw = motion.counts();
        let mut faults = Faults::default();
        if number % 1000 == 999 {
            faults.checksum = Faults::bit(0, 4);
            state.hold_notches(chain.invalidated_by_fault());
        }
        let output = chain.step(&mut state, model, &raw);
        let said = monitor.update(&mut watch, &raw, output.as_ref(), &faults);
        output
            .iter()
            .flat_map(|o| o.words())
            .for_each(|word| digest.add(word));
        digest.add(said.state as i32);
        digest.add(said.cause as i32);
        digest.add(said.axis.into());
        digest.add(said.channel.into());
        digest.add(said.permille.into());
    }
    digest.value()
}

/// The words that the programs' arguments are: files of both models and their rigs, and the number
/// of samples.
fn arguments(place: &Path) -> Vec<String> {
    let other = blob::encode(reference_network()).to_vec();
    let files = blocks(reference_model()).into_iter().chain([other]);
    let mut words = Vec::new();
    for (name, bytes) in ["model", "rig", "watched", "other"].iter().zip(files) {
        let file = place.join(name);
        std::fs::write(&file, bytes).expect("it can be written");
        words.push(file.display().to_string());
    }
    words.push(SAMPLES.to_string());
    words
}

/// Compiles a program of `firmware/c/tests` with the library for this computer.
fn compile(compiler: &str, source: &str, standard: &str, place: &Path) -> PathBuf {
    let program = place.join(source.replace('.', "_"));
    let include = folder().join("include");
    succeed(
        Command::new(compiler)
            .args(STRICT)
            .arg(standard)
            .arg("-I")
            .arg(include)
            .arg(folder().join("tests").join(source))
            .arg(library(None))
            .args(["-lpthread", "-ldl", "-lm", "-o"])
            .arg(&program),
    );
    program
}

/// The figures of a program's lines, `what value`, in hexadecimal.
fn figures(text: &str) -> BTreeMap<String, u64> {
    let figure = |line: &str| {
        let (what, value) = line.split_once(' ')?;
        Some((what.to_owned(), u64::from_str_radix(value, 16).ok()?))
    };
    text.lines().filter_map(figure).collect()
}

#[test]
fn c_gives_the_bits_of_rust_and_an_error_for_every_bad_input() {
    let place = TempDir::new().expect("a folder");
    let program = compile("cc", "host.c", "-std=c11", place.path());
    let text = succeed(Command::new(program).args(arguments(place.path())));
    let model = reference_model();
    let wanted = [
        ("chain".to_owned(), chain_digest(model, SEED, SAMPLES)),
        ("failures".to_owned(), 0),
        ("watched".to_owned(), watched_digest(model, SAMPLES)),
    ];
    assert_eq!(figures(&text), BTreeMap::from(wanted), "{text}");
}

#[test]
fn the_header_needs_no_other_and_suits_older_standards() {
    let place = TempDir::new().expect("a folder");
    let source = place.path().join("alone.c");
    std::fs::write(
        &source,
        "#include \"jointwatch.h\"\nint alone(void);\nint alone(void) { return JW_OK; }\n",
    )
    .expect("it can be written");
    for standard in ["-std=c99", "-std=c11"] {
        succeed(
            Command::new("cc")
                .args(STRICT)
                .args([standard, "-c", "-I"])
                .arg(folder().join("include"))
                .arg(&source)
                .arg("-o")
                .arg(place.path().join("alone.o")),
        );
    }
}

#[test]
fn the_wrapper_for_cpp_gives_the_same_bits() {
    if !is_there("c++") {
        return skipped("there is no c++, so the C++ wrapper was not compiled; install g++");
    }
    let place = TempDir::new().expect("a folder");
    let program = compile("c++", "host.cpp", "-std=c++11", place.path());
    let text = succeed(Command::new(program).args(arguments(place.path())));
    let wanted = chain_digest(reference_model(), SEED, SAMPLES);
    assert_eq!(figures(&text)["chain"], wanted, "{text}");
}

#[test]
fn cmake_installs_what_pkg_config_finds() {
    if !is_there("cmake") || !is_there("pkg-config") {
        return skipped("there is no cmake or no pkg-config, so their files were not tried");
    }
    let place = TempDir::new().expect("a folder");
    let (built, installed) = (place.path().join("built"), place.path().join("installed"));
    succeed(
        Command::new("cmake")
            .arg("-S")
            .arg(folder())
            .arg("-B")
            .arg(&built)
            .arg(format!("-DJOINTWATCH_LIBRARY={}", library(None).display()))
            .arg(format!("-DCMAKE_INSTALL_PREFIX={}", installed.display())),
    );
    succeed(Command::new("cmake").arg("--install").arg(&built));
    let flags = succeed(
        Command::new("pkg-config")
            .env("PKG_CONFIG_PATH", installed.join("lib/pkgconfig"))
            .args(["--cflags", "--libs", "jointwatch"]),
    );
    let program = place.path().join("program");
    succeed(
        Command::new("cc")
            .arg("-std=c11")
            .arg(folder().join("tests/host.c"))
            .args(flags.split_whitespace())
            .arg("-o")
            .arg(&program),
    );
    succeed(Command::new(program).args(arguments(place.path())));
}

/// The C program for a microcontroller, linked with the library for `target`.
fn device_program(target: &str, processor: &[&str], place: &Path) -> PathBuf {
    let tests = folder().join("tests");
    let program = place.join(target);
    succeed(
        Command::new("arm-none-eabi-gcc")
            .args(STRICT)
            .args(processor)
            .args(["-mthumb", "-std=c11", "-ffreestanding", "-nostdlib", "-I"])
            .arg(folder().join("include"))
            .arg("-T")
            .arg(tests.join("device.ld"))
            .arg(tests.join("device.c"))
            .arg(library(Some(target)))
            .args(["-Wl,--gc-sections", "-o"])
            .arg(&program),
    );
    program
}

/// What a program says under QEMU, instructions counted, with the blocks where `device.c` expects
/// them.
fn emulated(program: &Path, place: &Path, arguments: &str) -> String {
    let flash = place.join("flash");
    std::fs::write(&flash, blocks(reference_model()).concat()).expect("it can be written");
    let loaded = format!(
        "loader,file={},addr=0x080c0000,force-raw=on",
        flash.display()
    );
    succeed(
        Command::new("qemu-system-arm")
            .args([
                "-M",
                "netduinoplus2",
                "-display",
                "none",
                "-serial",
                "none",
                "-monitor",
                "none",
            ])
            .arg("-semihosting-config")
            .arg(format!("enable=on,target=native{arguments}"))
            .args(["-icount", "shift=0"])
            .args(["-global", "stm32f2xx-timer.clock-frequency=1000000000"])
            .arg("-device")
            .arg(loaded)
            .arg("-kernel")
            .arg(program),
    )
}

const CORTEX_M4F: (&str, &[&str]) = (
    "thumbv7em-none-eabihf",
    &["-mcpu=cortex-m4", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"],
);
const CORTEX_M0: (&str, &[&str]) = (
    "thumbv6m-none-eabi",
    &["-mcpu=cortex-m0", "-mfloat-abi=soft"],
);

#[test]
fn c_on_a_cortex_m4f_gives_the_bits_of_rust_in_few_more_instructions() {
    let place = TempDir::new().expect("a folder");
    if let Some(seen) = of_an_emulated_processor(CORTEX_M4F, place.path()) {
        in_few_more_instructions(&seen, place.path());
    }
}

#[test]
fn c_on_a_cortex_m0_gives_the_bits_of_rust() {
    let place = TempDir::new().expect("a folder");
    of_an_emulated_processor(CORTEX_M0, place.path());
}

/// The figures of the C program on an emulated processor, whose digests are those of Rust; nothing
/// without a compiler.
fn of_an_emulated_processor(
    (target, processor): (&str, &[&str]),
    place: &Path,
) -> Option<BTreeMap<String, u64>> {
    if !is_there("arm-none-eabi-gcc") {
        skipped(
            "there is no arm-none-eabi-gcc, so the C library was not run on emulated processors; install gcc-arm-none-eabi",
        );
        return None;
    }
    let model = reference_model();
    let program = device_program(target, processor, place);
    let seen = figures(&emulated(&program, place, ""));
    println!("{target}: {seen:?}");
    assert_eq!(
        seen["chain"],
        chain_digest(model, SEED, CHAIN_SAMPLES),
        "{target}"
    );
    assert_eq!(
        seen["watched"],
        watched_digest(model, WATCHED_SAMPLES),
        "{target}"
    );
    assert!((1000..MAX_STACK).contains(&seen["stack"]), "{seen:?}");
    Some(seen)
}

/// Compares the instructions of a sample with those that the self-test, which is in Rust, counts in
/// the same way.
fn in_few_more_instructions(seen: &BTreeMap<String, u64>, place: &Path) {
    let what = [
        "-p",
        "jointwatch-firmware",
        "--features",
        "stm32f405",
        "--bin",
        "selftest",
    ];
    let image = build(&what, Some(CORTEX_M4F.0)).join("selftest");
    let text = emulated(&image, place, ",arg=selftest,arg=points=0,arg=count=1");
    let line = text
        .lines()
        .find(|line| line.starts_with("sample reference "));
    let line = line.unwrap_or_else(|| panic!("no count in {text}"));
    let words: Vec<&str> = line.split(' ').collect();
    let after = |name: &str| -> u64 {
        let at = words.iter().position(|word| *word == name);
        words[at.expect("it is there") + 1]
            .parse()
            .expect("a number")
    };
    let rust = [
        ("least", after("min")),
        ("most", after("max").max(after("ending"))),
    ];
    println!("in Rust {rust:?}");
    for (what, rust) in rust {
        let c = seen[what];
        assert!(
            100 * c <= (100 + MAX_PERCENT) * rust && c > rust / 2,
            "{what}: {c} instructions in C, {rust} in Rust"
        );
    }
}

#[test]
fn nothing_that_c_calls_leads_to_a_panic() {
    if !is_there("arm-none-eabi-gcc") {
        return skipped(
            "there is no arm-none-eabi-gcc, so panic paths of the C library were not looked for",
        );
    }
    let place = TempDir::new().expect("a folder");
    let (target, processor) = CORTEX_M4F;
    let image = Image::read(&device_program(target, processor, place.path()));
    let calls = image.calls();
    let panics = panic_paths(calls.keys());
    for entry in [
        "jw_model_load",
        "jw_chain_new",
        "jw_chain_step",
        "jw_monitor_new",
        "jw_monitor_step",
    ] {
        let mut to_see = vec![entry];
        let mut seen = std::collections::BTreeSet::new();
        while let Some(name) = to_see.pop() {
            // Where a rig block is decoded, postcard copies 8 bytes that it has just counted into
            // 8, which the compiler does not see.
            let counted = entry == "jw_chain_new" && name.contains("copy_from_slice_impl");
            assert!(counted || !panics.contains(&name), "{entry} reaches {name}");
            if counted {
                continue;
            }
            let is_step = entry.ends_with("step");
            assert!(
                !(is_step && name.contains("__aeabi_d")),
                "{entry} reaches {name}"
            );
            if seen.insert(name) {
                to_see.extend(calls.get(name).into_iter().flatten().map(String::as_str));
            }
        }
        assert!(seen.len() > 1, "{entry} calls nothing: {seen:?}");
    }
}

#[test]
fn the_library_is_built_for_riscv_as_well() {
    assert!(library(Some("riscv32imac-unknown-none-elf")).is_file());
}
