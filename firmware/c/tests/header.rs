//! The committed header is the one that cbindgen makes of the source.

use std::fs;
use std::path::Path;

/// Set it to write the header.
const WRITE: &str = "JOINTWATCH_WRITE_HEADER";

#[test]
fn the_header_is_what_cbindgen_makes_of_the_source() {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(package.join("cbindgen.toml")).expect("a good file");
    let mut builder = cbindgen::Builder::new().with_config(config);
    for file in ["error.rs", "types.rs", "objects.rs", "boundary.rs"] {
        builder = builder.with_src(package.join("src").join(file));
    }
    let mut made = Vec::new();
    builder.generate().expect("a header").write(&mut made);
    let made = String::from_utf8(made).expect("text");
    let committed = package.join("include/jointwatch.h");
    if std::env::var_os(WRITE).is_some() {
        fs::write(&committed, &made).expect("it can be written");
    }
    let committed = fs::read_to_string(committed).unwrap_or_default();
    assert!(
        committed == made,
        "include/jointwatch.h is stale: {WRITE}=1 cargo test -p jointwatch-c --test header"
    );
}
