//! Chooses the memory map of the board and tells the linker about it; does nothing when built for a computer.

use std::path::{Path, PathBuf};
use std::{env, fs};

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=../memory.x");
    println!("cargo::rerun-if-changed=microbit.x");

    // Cargo sets these for every build script.
    let target = env::var("TARGET").expect("cargo sets TARGET");
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    let package = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets this"));
    if !target.starts_with("thumb") {
        return;
    }

    let microbit = env::var_os("CARGO_FEATURE_MICROBIT").is_some();
    let map: &Path = if microbit {
        Path::new("microbit.x")
    } else {
        Path::new("../memory.x")
    };
    let chosen = out.join("memory.x");
    fs::copy(package.join(map), &chosen)
        .unwrap_or_else(|why| panic!("the memory map {} is not readable: {why}", map.display()));

    println!("cargo::rustc-link-search={}", out.display());
    // The linker looks for memory.x in its working folder first, which is the workspace and holds the STM32F405's.
    println!(
        "cargo::rustc-link-arg-bins=--remap-inputs=memory.x={}",
        chosen.display()
    );
    // The page alignment of a desktop would put file headers into flash.
    println!("cargo::rustc-link-arg-bins=--nmagic");
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
    // The self-test prints text and has no defmt symbols to place.
    println!("cargo::rustc-link-arg-bin=jointwatch=-Tdefmt.x");
}
