//! Tells the crate whether the processor has the instructions of the assembly loops: every Armv7E-M
//! does.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(dsp)");
    let target = std::env::var("TARGET").expect("cargo sets TARGET");
    if target.starts_with("thumbv7em") {
        println!("cargo::rustc-cfg=dsp");
    }
}
