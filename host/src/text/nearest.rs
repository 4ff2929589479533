//! Suggesting what was probably meant when a name is not known.

/// Names longer than this are nobody's slip, and comparing them takes time that grows with the
/// product of the lengths.
const LONGEST: usize = 100;
/// So many names are compared and listed at most.
const MOST: usize = 1000;

/// The known name nearest to `name`, when it is near enough to be a misspelling of it.
pub(crate) fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    if name.len() > LONGEST {
        return None;
    }
    let lower = name.to_lowercase();
    let known = known.into_iter().take(MOST);
    known
        .filter(|k| k.len() <= LONGEST)
        .map(|k| {
            (
                strsim::normalized_damerau_levenshtein(&lower, &k.to_lowercase()),
                k,
            )
        })
        .filter(|(likeness, _)| *likeness >= 0.5)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, k)| k)
}

/// “did you mean …?” when a known name is near, else the list of all, as the end of a sentence.
pub(crate) fn suggestion(name: &str, known: &[&str]) -> String {
    match nearest(name, known.iter().copied()) {
        Some(k) => format!("did you mean {k:?}?"),
        None if known.is_empty() => "there is none to choose from".to_owned(),
        None => {
            let clipped = |k: &&str| k.chars().take(LONGEST).collect::<String>();
            let names: Vec<String> = known.iter().take(MOST).map(clipped).collect();
            format!("choose from {}", names.join(", "))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_is_recognised_and_a_stranger_is_not() {
        let known = ["force_N", "x2_m", "x3_m"];
        assert_eq!(nearest("forse_N", known), Some("force_N"));
        assert_eq!(nearest("FORCE_N", known), Some("force_N"));
        assert_eq!(nearest("temperature", known), None);
        assert_eq!(
            suggestion("temperature", &known),
            "choose from force_N, x2_m, x3_m"
        );
    }

    #[test]
    fn names_without_end_are_neither_compared_nor_listed() {
        let (long, begun) = ("0".repeat(1 << 24), std::time::Instant::now());
        let many = vec![long.as_str(); 10];
        assert_eq!(nearest(&long, many.iter().copied()), None);
        let said = suggestion("force", &many);
        assert!(said.len() < 2 * 10 * LONGEST, "{}", said.len());
        assert!(begun.elapsed().as_secs() < 5);
    }
}
