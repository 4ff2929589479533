//! The table of docs/notebook/joints.md is the one that the program gives.

use jointwatch_tests::program::workspace;
use jointwatch_tests::public::joints::{outcomes, table};

#[test]
#[ignore = "takes minutes: `cargo test --release -p jointwatch-tests --test joints -- --ignored`"]
fn real_joints_are_diagnosed_as_the_page_says() {
    let page = std::fs::read_to_string(workspace().join("docs/notebook/joints.md")).unwrap();
    for outcome in outcomes(&|_| ()).unwrap() {
        let row = table(&[outcome]).lines().last().unwrap().to_owned();
        assert!(page.contains(&row), "the page does not say {row}");
    }
}
