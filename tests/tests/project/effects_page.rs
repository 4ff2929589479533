//! What the program says of its effects, and the page of the docs that is made of it.

use jointwatch_shared::effect::EFFECTS;
use jointwatch_tests::program::{fail, json, run, succeed, workspace};
use std::fs;

#[test]
fn the_page_of_the_docs_is_what_the_program_writes() {
    let page = fs::read_to_string(workspace().join("docs/reference/effects.md")).unwrap();
    let written = succeed(workspace(), &["effects", "--markdown"]);
    assert!(
        page == written,
        "docs/reference/effects.md is stale: jointwatch effects --markdown > docs/reference/effects.md"
    );
}

#[test]
fn the_list_and_each_page_hold_what_the_table_says() {
    let list = succeed(workspace(), &["effects"]);
    let said = json(workspace(), "effects");
    let listed = said["effects"].as_array().unwrap();
    assert_eq!(listed.len(), EFFECTS.len());
    for (entry, listed) in EFFECTS.iter().zip(listed) {
        let about = &entry.about;
        let named = |line: &&str| line.split_whitespace().next() == Some(about.name);
        let line = list.lines().find(named).expect(about.name);
        assert!(line.contains(about.title), "{line}");
        let page = succeed(workspace(), &["effects", about.name]);
        for text in [
            about.equation,
            about.source,
            about.residual_signature,
            about.separated_by,
        ] {
            assert!(page.contains(text), "{page}");
        }
        assert!(about.parameters.iter().all(|p| page.contains(p.meaning)));
        assert_eq!(listed["equation"], about.equation);
        // A loop that is drawn has more than the dots of its cross.
        let bent = page
            .chars()
            .filter(|c| ('\u{2801}'..='\u{28ff}').contains(c));
        assert!(bent.count() > 50, "{page}");
    }
}

#[test]
fn a_name_that_is_not_known_gets_the_nearest_one() {
    let sentence = fail(workspace(), &["effects", "colomb"], 3);
    assert!(sentence.contains("\"coulomb\""), "{sentence}");
    let sentence = fail(workspace(), &["effects", "magnetism"], 3);
    assert!(sentence.contains("viscous"), "{sentence}");
    let both = run(workspace(), &["effects", "coulomb", "--markdown"]);
    assert_eq!(both.status.code(), Some(2));
}
