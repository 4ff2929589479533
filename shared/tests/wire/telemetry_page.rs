//! The bytes that docs/reference/telemetry.md lists are the bytes on the line.

use super::telemetry_frames::{self, frame, reports, requests};
use jointwatch_shared::monitor::{Cause, State};
use jointwatch_shared::wire::telemetry::{MAX_FRAME, MAX_PAYLOAD, Message};

const PAGE: &str = include_str!("../../../docs/reference/telemetry.md");

/// An example of the page: its tag, the bytes of its table, and its frame.
struct Example {
    tag: u8,
    fields: Vec<u8>,
    frame: Vec<u8>,
}

fn bytes(hex: &str) -> Vec<u8> {
    let words = hex.split_whitespace();
    words
        .map(|word| u8::from_str_radix(word, 16).expect(word))
        .collect()
}

/// The examples between two headings of the page.
fn examples(from: &str, to: &str) -> Vec<Example> {
    let (_, rest) = PAGE.split_once(from).expect(from);
    let (text, _) = rest.split_once(to).expect(to);
    let sections = text.split("\n### `").skip(1);
    sections
        .map(|section| {
            let (tag, rest) = section.split_once('`').unwrap();
            let (table, rest) = rest.split_once("```\n").unwrap();
            let (frame, _) = rest.split_once("```").unwrap();
            let rows = table.lines().filter_map(|line| line.strip_prefix("| `"));
            Example {
                tag: bytes(tag)[0],
                fields: rows
                    .flat_map(|row| bytes(row.split_once('`').unwrap().0))
                    .collect(),
                frame: bytes(frame),
            }
        })
        .collect()
}

fn compare<M: Message>(examples: &[Example], messages: &[M]) {
    assert_eq!(examples.len(), messages.len());
    for (number, (example, message)) in examples.iter().zip(messages).enumerate() {
        assert_eq!(example.tag, message.tag());
        let mut place = [0; MAX_PAYLOAD];
        let fields = message.write(&mut place).unwrap();
        assert_eq!(example.fields, fields, "fields of {:02x}", example.tag);
        let written = frame(message, number as u16);
        let hex: Vec<String> = written.iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!(
            example.frame,
            written,
            "frame of {:02x}: {}",
            example.tag,
            hex.join(" ")
        );
    }
}

#[test]
fn the_documented_bytes_are_the_written_bytes() {
    let from_device = examples("## From the device", "### States and causes");
    compare(&from_device, &reports());
    let to_device = examples("## To the device", "## Reading it");
    compare(&to_device, &requests());
}

#[test]
fn the_documented_codes_and_sizes_are_those_of_the_program() {
    for state in State::ALL {
        let row = format!("| {} | {} |", state.tag(), state.words());
        assert!(
            PAGE.contains(&row),
            "docs/reference/telemetry.md lacks {row}"
        );
    }
    for cause in Cause::ALL {
        let row = format!("| {} | {} |", cause.tag(), cause.words());
        assert!(
            PAGE.contains(&row),
            "docs/reference/telemetry.md lacks {row}"
        );
    }
    assert!(PAGE.contains(&format!("The longest frame has {MAX_FRAME} bytes")));
    assert!(PAGE.contains(&format!("| 7 to {MAX_PAYLOAD} | the payload")));
    let longest = telemetry_frames::longest_reports()
        .iter()
        .map(|report| frame(report, u16::MAX).len())
        .max();
    assert!(PAGE.contains(&format!("largest values, has {}.", longest.unwrap())));
}
