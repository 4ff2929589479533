//! Channels that are numbered alike, as those of the joints of a robot or of the runs in matrices:
//! what belongs together, and what stands still.

use super::parts::factor;
use crate::study::channels::naming::{split_unit, without_index};
use crate::study::channels::units::Quantity;
use crate::study::survey::SurveyedColumn;

/// What takes a smaller part of the RMS of another channel of its kind, and is noise, stands still.
const STILL: f64 = 0.01;

/// The number of a channel among others of its kind: 3 of `force_N[3]`, 4 of `joint_torque_4`.
pub(super) fn number(name: &str) -> Option<usize> {
    let (stem, index) = without_index(name);
    index.or_else(|| {
        let mut numbers = split_unit(stem).0.rsplit(|c: char| !c.is_ascii_digit());
        numbers.find(|digits| !digits.is_empty())?.parse().ok()
    })
}

/// Leaves out what stands still beside others of the same quantity.
pub(super) fn leave_out_still(columns: &mut Vec<&SurveyedColumn>, quantity: Quantity) {
    let rms = |c: &SurveyedColumn| c.rms * factor(c, quantity).abs();
    let largest = columns.iter().map(|c| rms(c)).fold(0.0, f64::max);
    let is_noise = |c: &SurveyedColumn| {
        let steps = c.values.windows(2).map(|w| (w[1] - w[0]).powi(2));
        steps.sum::<f64>() > c.rms.powi(2) * c.values.len() as f64
    };
    columns.retain(|c| rms(c) > STILL * largest || !is_noise(c));
}

/// Puts channels of other numbers than those of the displacements behind the rest.
pub(super) fn own_first(columns: &mut [&SurveyedColumn], displacement: &[&SurveyedColumn]) {
    columns.sort_by_key(|c| number(&c.name).is_some_and(|own| !are_numbered(displacement, own)));
}

/// Whether one of some channels has a number.
pub(super) fn are_numbered(columns: &[&SurveyedColumn], own: usize) -> bool {
    columns.iter().any(|c| number(&c.name) == Some(own))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_channel_is_numbered_by_its_column_of_a_matrix_or_in_its_name() {
        for (name, own) in [
            ("force_N[3]", Some(3)),
            ("joint_torque_4", Some(4)),
            ("a2_m_s2", Some(2)),
            ("/joint_states/joint6_position", Some(6)),
            ("Kraft [N]", None),
        ] {
            assert_eq!(number(name), own, "{name}");
        }
    }
}
