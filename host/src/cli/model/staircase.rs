//! The staircase of errors in text: per axis a bar for every step, down to the noise.

use crate::diagnose::apply::{Staircase, WITHOUT};

/// Characters of the longest bar.
const LONGEST: f64 = 40.0;

/// A block of bars per axis, and why it ended.
pub(super) fn in_words(staircase: &Staircase) -> String {
    let mut text = format!(
        "Staircase of errors, RMS error over RMS force on the {}:\n",
        staircase.judged_on.words()
    );
    for (axis, floor) in &staircase.noise_floor {
        let steps = staircase.steps.iter().filter_map(|step| {
            let error = step.relative_error.get(axis)?;
            let name = match step.label() {
                None => "as brought".into(),
                Some(label) if label.starts_with(WITHOUT) => label,
                Some(label) => format!("+ {label}"),
            };
            Some((name, *error))
        });
        let mut lines: Vec<(String, f64)> = steps.collect();
        lines.push(("noise floor".into(), *floor));
        let widest = lines.iter().map(|(name, _)| name.chars().count()).max();
        let widest = widest.unwrap_or(0);
        let largest = lines
            .iter()
            .map(|(_, e)| *e)
            .fold(f64::MIN_POSITIVE, f64::max);
        for (at, (name, error)) in lines.iter().enumerate() {
            let label = if at == 0 { axis.as_str() } else { "" };
            let length = (LONGEST * error / largest).round() as usize;
            text.push_str(&format!(
                "  {label:<6} {name:<widest$}  {error:.4}  {}\n",
                "█".repeat(length.max(1))
            ));
        }
    }
    // A name that it begins with stays as it is written.
    text.push_str(&format!("Ended: {}.", staircase.ended));
    text
}

#[cfg(test)]
mod tests {
    use super::in_words;
    use crate::diagnose::apply::{Staircase, Step};
    use crate::model::file::JudgedOn;

    #[test]
    fn bars_are_as_long_as_the_errors() {
        let step = |added: &[&str], error: f64| Step {
            added: added.iter().map(|a| a.to_string()).collect(),
            instead_of: None,
            relative_error: [("x".to_string(), error)].into(),
        };
        let text = in_words(&Staircase {
            judged_on: JudgedOn::Validation,
            steps: vec![step(&[], 0.4), step(&["coulomb@x"], 0.1)],
            noise_floor: [("x".to_string(), 0.05)].into(),
            ended: "nothing more is missing".into(),
        });
        println!("{text}");
        let bars: Vec<usize> = text.lines().map(|l| l.matches('█').count()).collect();
        assert_eq!(bars, [0, 40, 10, 5, 0]);
        assert!(
            text.contains("+ coulomb@x  0.1000")
                && text.ends_with("Ended: nothing more is missing.")
        );
    }
}
