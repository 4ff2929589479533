//! The list of faults that tests have to notice fits the program as it is.

use jointwatch_tests::faults::list;
use jointwatch_tests::program::workspace;

#[test]
fn every_fault_has_its_place_once() {
    let faults = list().unwrap();
    assert!(faults.len() > 30);
    assert!(faults.iter().filter(|fault| fault.quick).count() >= 5);
    let stale: Vec<String> = faults
        .iter()
        .filter_map(|fault| {
            let text = std::fs::read_to_string(workspace().join(&fault.file)).unwrap();
            let times = text.matches(&fault.find).count();
            (times != 1).then(|| format!("{times} times in {}: {}", fault.file, fault.name))
        })
        .collect();
    assert!(stale.is_empty(), "{stale:#?}");
}
