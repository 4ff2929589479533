//! The page of the rig block lists its fields in the order in which they are written, and what is
//! written does not change unnoticed.

use super::sample_rigs::block;
use jointwatch_shared::wire::rig_block::{CHECKSUM_OFFSET, encode};

/// The fields in the order in which they are written, each name where it comes first.
fn written() -> Vec<String> {
    let text = serde_json::to_string(&block(2, true)).unwrap();
    let mut names: Vec<String> = Vec::new();
    for part in text.split("\":").filter(|part| part.contains('"')) {
        let name = part.rsplit('"').next().unwrap().to_owned();
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

/// The first cells of the table of fields in docs/reference/rig-block.md.
fn documented() -> Vec<String> {
    let page = include_str!("../../../docs/reference/rig-block.md");
    let (_, rest) = page.split_once("| field | type | content |\n").unwrap();
    let rows = rest.lines().skip(1).map_while(|line| {
        let cell = line.strip_prefix('|')?.split('|').next()?;
        Some(cell.trim().trim_matches('`').to_owned())
    });
    rows.collect()
}

#[test]
fn the_page_lists_the_fields_in_the_order_in_which_they_are_written() {
    assert!(written().len() > 40, "{:?}", written());
    assert_eq!(documented(), written());
}

#[test]
fn the_bytes_of_a_rig_do_not_change_unnoticed() {
    let bytes = encode(&block(2, true)).unwrap();
    let used = bytes[..CHECKSUM_OFFSET].iter().rposition(|b| *b != 0);
    let checksum = u32::from_le_bytes(bytes[CHECKSUM_OFFSET..].try_into().unwrap());
    // Another value is another version of the format.
    assert_eq!((used, checksum), (Some(1940), 0x793C_EA39));
}
