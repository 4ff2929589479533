//! The committed header is the one that cbindgen makes of the source, and its enums are those of the telemetry.

use jointwatch_c::types::{jw_cause, jw_state};
use jointwatch_shared::monitor::{Cause, State};
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

#[test]
fn states_and_causes_have_the_numbers_of_the_telemetry() {
    use jw_cause::*;
    use jw_state::*;
    let states = [JW_UNJUDGED, JW_HEALTHY, JW_SUSPECT, JW_ALARM];
    assert_eq!(states.map(|state| state as u8), State::ALL.map(State::tag));
    let causes = [
        JW_STARTING,
        JW_AS_EXPECTED,
        JW_NO_MODEL,
        JW_NO_RIG,
        JW_WITHOUT_LIMITS,
        JW_LIMITS_OF_OTHER_MODEL,
        JW_TOO_GENTLE,
        JW_SENSOR_FAULT,
        JW_SAMPLES_LOST,
        JW_OUTSIDE_RANGE,
        JW_ERROR_GREW,
        JW_STIFFER,
        JW_SOFTER,
        JW_MORE_FRICTION,
        JW_LESS_FRICTION,
        JW_FORCE_GONE,
        JW_FORCE_UNEXPECTED,
        JW_STUCK,
        JW_SATURATED,
        JW_OUT_OF_RANGE,
        JW_WRONG_CHECKSUM,
        JW_TIME_OUT,
        JW_MISSING,
        JW_REFERENCE_LOST,
    ];
    assert_eq!(causes.map(|cause| cause as u8), Cause::ALL.map(Cause::tag));
}
