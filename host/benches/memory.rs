//! How much memory a fit of ten million rows takes: they are generated and summed some thousand at
//! a time.
//!
//! `cargo bench -p jointwatch --bench memory` prints the rows per second and, on Linux, the peak
//! resident memory.

use jointwatch::fit::least_squares::normal_equations;
use jointwatch::fit::moments::{Moments, Summation};
use jointwatch::model::{InputRange, exponents};
use std::time::Instant;

const ROWS: usize = 10_000_000;
const CHUNK: usize = 4096;

fn main() {
    let range = InputRange {
        center: 0.0,
        half_range: 1.0,
    };
    let mut summation = Summation::new(&[range; 4], 2);
    let mut moments = Moments::new(4, 2);
    let mut chunk = vec![vec![0.0; CHUNK]; 6];
    let mut state = 1u64;
    let mut summing_s = 0.0;
    let mut left = ROWS;
    while left > 0 {
        let rows = CHUNK.min(left);
        for value in chunk.iter_mut().flat_map(|series| &mut series[..rows]) {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            *value = (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0;
        }
        let series: Vec<&[f64]> = chunk.iter().map(|series| &series[..rows]).collect();
        let start = Instant::now();
        summation.add(&mut moments, &series[..4], &series[4..]);
        summing_s += start.elapsed().as_secs_f64();
        left -= rows;
    }
    let terms = exponents(&[3; 4]);
    let solution = normal_equations::solve(&moments.gram(&terms), &moments.cross(&terms))
        .expect("random rows determine every term");
    println!(
        "{} rows summed at {:.1} M rows/s in one thread; rank {}, condition {:.0}",
        moments.rows(),
        1e-6 * ROWS as f64 / summing_s,
        solution.rank,
        solution.condition
    );
    match std::fs::read_to_string("/proc/self/status") {
        Ok(status) => match status.lines().find(|line| line.starts_with("VmHWM")) {
            Some(line) => println!("peak resident memory: {}", line[6..].trim()),
            None => println!("this system does not tell the peak resident memory"),
        },
        Err(_) => println!("this system does not tell the peak resident memory"),
    }
}
