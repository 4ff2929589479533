//! Chooses the memory map of the board and tells the linker about it; does nothing when built for a
//! computer.

use std::path::{Path, PathBuf};
use std::{env, fs};

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=../memory.x");
    println!("cargo::rerun-if-changed=microbit.x");
    println!("cargo::rerun-if-changed=an500.x");
    println!("cargo::rerun-if-changed=nrf52840.x");
    println!("cargo::rerun-if-changed=rp2350.x");

    // Cargo sets these for every build script.
    let target = env::var("TARGET").expect("cargo sets TARGET");
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    let package = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets this"));
    write_key(&package, &out, target.starts_with("thumb"));
    if !target.starts_with("thumb") {
        return;
    }

    let is_for = |feature: &str| env::var_os(feature).is_some();
    let map: &Path = if is_for("CARGO_FEATURE_MICROBIT") {
        Path::new("microbit.x")
    } else if is_for("CARGO_FEATURE_AN500") {
        Path::new("an500.x")
    } else if is_for("CARGO_FEATURE_NRF52840") {
        Path::new("nrf52840.x")
    } else if is_for("CARGO_FEATURE_RP2350") {
        Path::new("rp2350.x")
    } else {
        Path::new("../memory.x")
    };
    let chosen = out.join("memory.x");
    fs::copy(package.join(map), &chosen)
        .unwrap_or_else(|why| panic!("the memory map {} is not readable: {why}", map.display()));

    println!("cargo::rustc-link-search={}", out.display());
    // The linker looks for memory.x in its working folder first, which is the workspace and holds
    // the STM32F405's.
    println!(
        "cargo::rustc-link-arg-bins=--remap-inputs=memory.x={}",
        chosen.display()
    );
    // The page alignment of a desktop would put file headers into flash.
    println!("cargo::rustc-link-arg-bins=--nmagic");
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
    // The self-test prints text and has no defmt symbols to place.
    println!("cargo::rustc-link-arg-bin=jointwatch=-Tdefmt.x");
    println!("cargo::rustc-link-arg-bin=jointwatch-link=-Tdefmt.x");
}

/// Writes the public key that the image is to trust as a piece of program, see `src/key.rs`.
fn write_key(package: &Path, out: &Path, for_a_device: bool) {
    println!("cargo::rerun-if-changed=keys/development.pub");
    println!("cargo::rerun-if-env-changed=JOINTWATCH_PUBLIC_KEY");
    println!("cargo::rerun-if-env-changed=JOINTWATCH_SECOND_PUBLIC_KEY");
    println!("cargo::rerun-if-env-changed=JOINTWATCH_DEVICE_CLASS");
    let own = env::var_os("JOINTWATCH_PUBLIC_KEY").filter(|name| !name.is_empty());
    let file = match &own {
        Some(name) => PathBuf::from(name),
        None => package.join("keys/development.pub"),
    };
    println!("cargo::rerun-if-changed={}", file.display());
    if own.is_none() && for_a_device {
        println!(
            "cargo::warning=this image trusts the development key, so anybody can put a model onto the device: make a key \
             with `jointwatch keygen` and name its .pub file in JOINTWATCH_PUBLIC_KEY"
        );
    }
    let key = key_of(&file);
    let development = own.is_none();
    let second = env::var_os("JOINTWATCH_SECOND_PUBLIC_KEY")
        .filter(|name| !name.is_empty())
        .map(PathBuf::from);
    if let Some(second) = &second {
        println!("cargo::rerun-if-changed={}", second.display());
    }
    let second = second.map(|second| key_of(&second));
    let class = env::var("JOINTWATCH_DEVICE_CLASS").unwrap_or_default();
    assert!(
        class.len() <= 16 && class.bytes().all(|byte| byte.is_ascii_graphic()),
        "JOINTWATCH_DEVICE_CLASS has to have at most 16 letters, digits and signs, without spaces"
    );
    let mut class = class.into_bytes();
    class.resize(16, 0);
    let program = format!(
        "/// The public key.\npub const PUBLIC_KEY: [u8; 32] = {key:?};\n\
         /// Whether it is the development key.\npub const IS_DEVELOPMENT_KEY: bool = {development};\n\
         /// The second public key, if there is one.\npub const SECOND_PUBLIC_KEY: Option<[u8; 32]> = {second:?};\n\
         /// The class of devices.\npub const DEVICE_CLASS: [u8; 16] = {class:?};\n"
    );
    fs::write(out.join("key.rs"), program).expect("cargo's own folder is writable");
}

/// The public key in a file.
fn key_of(file: &Path) -> Vec<u8> {
    let text = fs::read_to_string(file)
        .unwrap_or_else(|why| panic!("the public key {} is not readable: {why}", file.display()));
    read_key(&text)
        .unwrap_or_else(|| panic!("{} is no public key of `jointwatch keygen`", file.display()))
}

/// The 32 bytes of a public key file.
fn read_key(text: &str) -> Option<Vec<u8>> {
    let digits = text
        .trim_end()
        .strip_prefix("jointwatch public key ed25519 ")?;
    let digits = Some(digits).filter(|digits| digits.len() == 64 && digits.is_ascii())?;
    let byte = |at| u8::from_str_radix(digits.get(at..at + 2)?, 16).ok();
    (0..64).step_by(2).map(byte).collect()
}
