//! Suggesting what was probably meant when a name is not known.

/// The known name nearest to `name`, when it is near enough to be a misspelling of it.
pub(crate) fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let lower = name.to_lowercase();
    known
        .into_iter()
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
        None => format!("choose from {}", known.join(", ")),
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
}
