//! Everything that reads bytes that somebody else wrote, by one function each: for the test with
//! damaged bytes and for the fuzzer.
//!
//! A target panics where its reader does, and where a refusal is not one sentence of the kind that
//! stands for bad data.

mod bytes;
mod device;
mod files;
pub mod mutation;

#[path = "../../../firmware/tests/firmware/bench.rs"]
#[allow(dead_code, reason = "the firmware's own tests use the rest")]
mod bench;
#[path = "../../../firmware/tests/firmware/flash.rs"]
#[allow(dead_code, reason = "the firmware's own tests use the rest")]
mod flash;
#[path = "../../../firmware/tests/firmware/signing.rs"]
#[allow(dead_code, reason = "the firmware's own tests use the rest")]
mod signing;

/// One reader of bytes that somebody else wrote.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// Its name, that of its fuzz target as well.
    pub name: &'static str,
    /// Whose code the fuzzer follows.
    pub part: Part,
    /// Reads these bytes, whatever they are; what it asserts has to hold for all.
    pub read: fn(&[u8]),
    /// Whole inputs to begin with.
    pub seeds: fn() -> Vec<Vec<u8>>,
}

/// Where what reads runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// On the host: files of any length, and what a device sends.
    Host,
    /// On the device: short inputs, read quickly.
    Device,
}

impl Target {
    /// The longest inputs worth a try, in bytes: twice what it reads as a rule, since short inputs
    /// are tried more often.
    pub fn longest(&self) -> usize {
        let longest = (self.seeds)().iter().map(Vec::len).max();
        (2 * longest.unwrap_or_default()).clamp(256, 65_536)
    }
}

/// All readers: logs in every format, the study, the model, what the device holds, and both
/// directions of its line.
pub const TARGETS: [Target; 21] = [
    log("log_csv", || {
        files::logs(&["record.csv", "german.csv", "savetxt.txt", "record.csv.gz"])
    }),
    log("log_xlsx", || files::logs(&["record.xlsx"])),
    log("log_parquet", || {
        files::logs(&["record.parquet", "packed.parquet", "types.parquet"])
    }),
    log("log_arrow", || {
        files::logs(&["record.arrow", "stream.arrows", "types.arrow"])
    }),
    log("log_matlab5", || files::logs(&["record.mat", "matrix.mat"])),
    log("log_hdf5", || files::logs(&["v73.mat", "groups.h5"])),
    log("log_numpy", || {
        files::logs(&["matrix.npy", "structured.npy", "record.npz"])
    }),
    log("log_tdms", || files::logs(&["record.tdms"])),
    log("log_mdf4", || {
        files::logs(&["record.mf4", "transposed.mf4"])
    }),
    log("log_uff", || files::logs(&["ascii.uff", "binary.uff"])),
    log("log_json", files::json_logs),
    Target {
        name: "study_toml",
        part: Part::Host,
        read: files::study,
        seeds: files::studies,
    },
    Target {
        name: "rig_toml",
        part: Part::Host,
        read: files::rig,
        seeds: files::rigs,
    },
    Target {
        name: "model_json",
        part: Part::Host,
        read: files::model,
        seeds: files::models,
    },
    Target {
        name: "blob",
        part: Part::Device,
        read: device::blob,
        seeds: device::blobs,
    },
    Target {
        name: "rig_block",
        part: Part::Device,
        read: device::rig_block,
        seeds: device::rig_blocks,
    },
    Target {
        name: "limits",
        part: Part::Device,
        read: device::limits,
        seeds: device::rig_blocks,
    },
    Target {
        name: "signed_model",
        part: Part::Host,
        read: files::signed_model,
        seeds: device::slots,
    },
    Target {
        name: "capture",
        part: Part::Device,
        read: device::capture,
        seeds: device::chunks,
    },
    Target {
        name: "telemetry",
        part: Part::Host,
        read: device::telemetry,
        seeds: device::reports,
    },
    Target {
        name: "requests",
        part: Part::Device,
        read: device::requests,
        seeds: device::asked,
    },
];

const fn log(name: &'static str, seeds: fn() -> Vec<Vec<u8>>) -> Target {
    Target {
        name,
        part: Part::Host,
        read: files::log,
        seeds,
    }
}

/// The target of this name.
pub fn target(name: &str) -> Option<&'static Target> {
    TARGETS.iter().find(|target| target.name == name)
}
