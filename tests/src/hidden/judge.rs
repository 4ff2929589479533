//! Diagnosing a case as a user would, from its files alone, and holding the verdict against what
//! was hidden.

use super::cases::Case;
use super::catalogue::{Kind, Subject};
use super::study::{axis_name, write, write_truth};
use super::verdict::{Named, Verdict};
use crate::program::run;
use std::fs;
use std::path::Path;
use std::time::Instant;

/// The verdict that a case deserves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Expected {
    /// Nothing is missing, for nothing is hidden.
    Nothing,
    /// What is missing is outside the library.
    Unknown,
    /// An effect of the library is missing.
    Effect,
}

impl Expected {
    /// The word of the contract.
    pub fn word(self) -> &'static str {
        match self {
            Self::Nothing => "none",
            Self::Unknown => "unknown",
            Self::Effect => "effect",
        }
    }
}

/// What is hidden in a study, as a verdict is held against it.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// Every hidden effect with its axis.
    pub hidden: Vec<Named>,
    /// The verdict that it deserves.
    pub expected: Expected,
    /// The axis of the first of them.
    pub axis: Option<&'static str>,
    /// What the case is, in a line.
    pub case: String,
}

impl Truth {
    /// What is hidden in a joint of which these are the hidden subjects with their axes.
    pub fn new(hidden: &[(&Subject, usize)], case: String) -> Self {
        Self {
            expected: if hidden.is_empty() {
                Expected::Nothing
            } else if hidden.iter().any(|(s, _)| s.kind == Kind::Outside) {
                Expected::Unknown
            } else {
                Expected::Effect
            },
            axis: hidden.first().map(|(_, axis)| axis_name(*axis)),
            hidden: hidden
                .iter()
                .map(|(subject, axis)| Named::hidden(subject, *axis))
                .collect(),
            case,
        }
    }

    /// What is hidden in a case.
    pub fn of(case: &Case) -> Self {
        let hidden: Vec<(&Subject, usize)> =
            case.hidden.iter().map(|h| (h.subject, h.axis)).collect();
        Self::new(&hidden, describe(case))
    }

    /// Whether something that a verdict gives a probability is so. An equivalent effect has a
    /// probability of its own, and is not.
    fn holds(&self, said: &str) -> bool {
        match said {
            "none" => self.expected == Expected::Nothing,
            "unknown" => self.expected == Expected::Unknown,
            "data" => false,
            effect => {
                let (effect, axis) = effect.split_once('@').unwrap_or((effect, "both"));
                let said = Named {
                    effect: effect.into(),
                    axis: axis.into(),
                };
                self.hidden.contains(&said)
            }
        }
    }
}

/// How a verdict stands against the truth.
#[derive(Clone, Debug, Default)]
pub struct Judgement {
    /// What was hidden, for the table: a name, "none", or two names.
    pub subject: String,
    /// The verdict that the case deserves.
    pub expected: Option<Expected>,
    /// The whole verdict is right: nothing, unknown, or the right effect on the right axis first
    /// (with two: exactly both found).
    pub right: bool,
    /// As `right`, an equivalent effect counted as right.
    pub right_or_equivalent: bool,
    /// The right effect is among the first two candidates (or `right`).
    pub in_first_two: bool,
    /// As `in_first_two`, an equivalent effect counted as right.
    pub in_first_two_or_equivalent: bool,
    /// As `right_or_equivalent`, or the first candidate is on the right axis and the verdict says
    /// that these records cannot tell it from the right one.
    pub in_told_group: bool,
    /// Every probability that was stated, and whether what it was stated of is so.
    pub stated: Vec<(f64, bool)>,
    /// The same of the first candidate with those that it cannot be told from.
    pub of_group: Option<(f64, bool)>,
    /// The verdict was "unknown".
    pub unknown: bool,
    /// The verdict was "effect".
    pub effect: bool,
    /// Relative error after adding over the noise floor, on the axis where the effect was hidden.
    pub error_over_floor: Option<f64>,
    /// Relative error before adding over that after it, on the same axis.
    pub error_drop: Option<f64>,
    /// Wall-clock time of `identify` and `diagnose`, s.
    pub identify_s: f64,
    /// The second of them.
    pub diagnose_s: f64,
    /// What was said, for the list of failures: the first candidates, or the message with which a
    /// command failed.
    pub said: String,
    /// What the case was.
    pub case: String,
}

/// One line on what a case is.
pub fn describe(case: &Case) -> String {
    let hidden: Vec<String> = (0..case.hidden.len())
        .map(|i| {
            let shares = &case.hidden[i].shares;
            format!(
                "{} {:.1} % ({:.2} % beyond the base)",
                Named::hidden(case.hidden[i].subject, case.hidden[i].axis),
                100.0 * shares.whole,
                100.0 * shares.visible
            )
        })
        .collect();
    let snr = case.snr_db.map_or("no noise".into(), |d| format!("{d} dB"));
    let hidden = if hidden.is_empty() {
        "nothing".into()
    } else {
        hidden.join(" and ")
    };
    format!(
        "{hidden}, {snr}, {} axes, {} s",
        case.axes, case.shaking.duration_s
    )
}

/// Holds a verdict against the truth.
pub fn judge(truth: &Truth, verdict: &Verdict) -> Judgement {
    let truths = &truth.hidden;
    let effect = verdict.word == "effect";
    let rated = |same: &dyn Fn(&Named, &Named) -> bool, places: usize| match truth.expected {
        Expected::Nothing | Expected::Unknown => verdict.word == truth.expected.word(),
        Expected::Effect if truths.len() == 1 => {
            let mut first = verdict.ranked.iter().take(places);
            effect && first.any(|said| same(&truths[0], said))
        }
        Expected::Effect => {
            let of = |truth: &Named| verdict.found.iter().any(|said| same(truth, said));
            let stray = |said: &Named| !truths.iter().any(|truth| same(truth, said));
            effect && truths.iter().all(of) && !verdict.found.iter().any(stray)
        }
    };
    let strict = |truth: &Named, said: &Named| truth.is(said);
    let loose = |truth: &Named, said: &Named| truth.is_or_equals(said);
    let told = |truth: &Named, said: &Named| {
        loose(truth, said) || (verdict.alike.contains(&truth.effect) && truth.on_axis_of(said))
    };
    let mut errors = verdict.errors.iter();
    let errors = errors.find(|(name, _)| Some(name.as_str()) == truth.axis);
    let ratio = |above: usize, below: usize| {
        let (_, errors) = errors?;
        Some(errors[above]? / errors[below]?)
    };
    let ranked = verdict.ranked.iter().take(3);
    let ranked: Vec<String> = ranked.map(Named::to_string).collect();
    let found: Vec<String> = verdict.found.iter().map(Named::to_string).collect();
    Judgement {
        right: rated(&strict, 1),
        right_or_equivalent: rated(&loose, 1),
        in_first_two: rated(&strict, 2),
        in_first_two_or_equivalent: rated(&loose, 2),
        in_told_group: rated(&told, 1),
        stated: verdict
            .probabilities
            .iter()
            .map(|(said, chance)| (*chance, truth.holds(said)))
            .collect(),
        of_group: verdict.of_group.map(|chance| {
            let first = verdict.ranked.first();
            let is = |t: &Named| first.is_some_and(|said| told(t, said));
            (chance, truths.iter().any(is))
        }),
        unknown: verdict.word == "unknown",
        effect,
        error_over_floor: ratio(1, 2),
        error_drop: ratio(0, 1),
        said: format!(
            "{}; found [{}]; ranked [{}]",
            verdict.word,
            found.join(", "),
            ranked.join(", ")
        ),
        ..unjudged(truth)
    }
}

/// What holds before anything was said.
fn unjudged(truth: &Truth) -> Judgement {
    let names: Vec<&str> = truth.hidden.iter().map(|h| h.effect.as_str()).collect();
    Judgement {
        subject: match names.as_slice() {
            [] => "none".into(),
            names => names.join(" + "),
        },
        expected: Some(truth.expected),
        case: truth.case.clone(),
        ..Default::default()
    }
}

/// Writes the case's study below `folder`, runs `identify` and `diagnose` on it on one thread, and
/// judges what they say. A command that fails is a wrong verdict, and its message is kept.
///
/// # Errors
/// When the study cannot be written.
pub fn diagnose(case: &Case, folder: &Path, keep_truth: bool) -> std::io::Result<Judgement> {
    fs::create_dir_all(folder)?;
    write(case, folder)?;
    if keep_truth {
        write_truth(case, folder)?;
    }
    Ok(diagnose_folder(&Truth::of(case), folder))
}

/// Runs `identify` and `diagnose` on the study in a folder, on one thread, and judges what they
/// say.
pub fn diagnose_folder(truth: &Truth, folder: &Path) -> Judgement {
    let mut seconds = [0.0; 2];
    let commands = [
        "identify study.toml --model physical -o model.json --threads 1",
        "diagnose study.toml model.json --json verdict.json --threads 1",
    ];
    for (command, seconds) in commands.iter().zip(&mut seconds) {
        let words: Vec<&str> = command.split(' ').collect();
        let begin = Instant::now();
        let output = run(folder, &words);
        *seconds = begin.elapsed().as_secs_f64();
        if !output.status.success() {
            let message = String::from_utf8_lossy(&output.stderr);
            let message = message.lines().next().unwrap_or("no message").to_owned();
            return Judgement {
                said: format!("{} failed: {message}", words[0]),
                identify_s: *seconds,
                ..unjudged(truth)
            };
        }
    }
    let text = fs::read_to_string(folder.join("verdict.json"));
    let verdict = text
        .map_err(|e| e.to_string())
        .and_then(|text| Verdict::read(&text));
    let judgement = match verdict {
        Ok(verdict) => judge(truth, &verdict),
        Err(message) => Judgement {
            said: format!("verdict.json breaks the contract: {message}"),
            ..unjudged(truth)
        },
    };
    Judgement {
        identify_s: seconds[0],
        diagnose_s: seconds[1],
        ..judgement
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hidden::cases::Options;
    use serde_json::Value;

    fn case(only: &str) -> Case {
        let options = Options {
            seed: 3,
            only: Some(only.into()),
            ..Default::default()
        };
        Case::draw(&options, 0).unwrap()
    }

    fn verdict(word: &str, ranked: &[(&str, &str)]) -> Verdict {
        let entries: Vec<Value> = ranked
            .iter()
            .map(|(effect, axis)| serde_json::json!({"effect": effect, "axis": axis, "score": 3.0}))
            .collect();
        let text = serde_json::json!({
            "verdict": word,
            "relative_error_before": {"x": 0.12, "phi": 0.3},
            "relative_error_after": {"x": 0.03, "phi": 0.02},
            "noise_floor": {"x": 0.02, "phi": null},
            "found": entries.first().map_or(vec![], |e| vec![e.clone()]),
            "ranked": entries,
            "where": [], "data_problems": [],
        });
        Verdict::read(&text.to_string()).unwrap()
    }

    #[test]
    fn only_the_right_effect_on_the_right_axis_is_right() {
        let mut case = case("jenkins");
        case.hidden[0].axis = 0;
        let judged = |word: &str, ranked: &[(&str, &str)]| {
            let j = judge(&Truth::of(&case), &verdict(word, ranked));
            [j.right, j.right_or_equivalent, j.in_first_two, j.unknown]
        };
        assert_eq!(
            judged("effect", &[("jenkins", "x")]),
            [true, true, true, false]
        );
        assert_eq!(judged("effect", &[("jenkins", "phi")]), [false; 4]);
        assert_eq!(
            judged("effect", &[("bouc_wen", "x")]),
            [false, true, false, false]
        );
        assert_eq!(
            judged("effect", &[("coulomb", "x"), ("jenkins", "x")]),
            [false, false, true, false]
        );
        assert_eq!(
            judged("unknown", &[("jenkins", "x")]),
            [false, false, false, true]
        );
        assert_eq!(judged("none", &[]), [false; 4]);
        let j = judge(&Truth::of(&case), &verdict("effect", &[("jenkins", "x")]));
        assert!((j.error_over_floor.unwrap() - 1.5).abs() < 1e-12);
        assert!((j.error_drop.unwrap() - 4.0).abs() < 1e-12);
    }

    #[test]
    fn healthy_joints_and_outsiders_have_verdicts_of_their_own() {
        let healthy = case("none");
        assert!(judge(&Truth::of(&healthy), &verdict("none", &[])).right);
        assert!(
            !judge(
                &Truth::of(&healthy),
                &verdict("effect", &[("coulomb", "x")])
            )
            .right
        );
        assert!(!judge(&Truth::of(&healthy), &verdict("data", &[])).right);
        let outside = case("unmeasured force");
        assert!(judge(&Truth::of(&outside), &verdict("unknown", &[])).right);
        assert!(
            !judge(
                &Truth::of(&outside),
                &verdict("effect", &[("mains_hum", "x")])
            )
            .right
        );
        assert!(!judge(&Truth::of(&outside), &verdict("none", &[])).right);
    }

    #[test]
    fn a_broken_contract_is_said_and_not_judged() {
        assert!(Verdict::read("{}").is_err());
        let maybe =
            r#"{"verdict": "maybe", "relative_error_before": {}, "found": [], "ranked": []}"#;
        assert!(Verdict::read(maybe).unwrap_err().contains("four words"));
        let nameless =
            r#"{"verdict": "effect", "relative_error_before": {}, "found": [{}], "ranked": []}"#;
        assert!(Verdict::read(nameless).unwrap_err().contains("found"));
    }
}
