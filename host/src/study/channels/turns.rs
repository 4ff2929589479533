//! Angles that begin anew after a whole turn, as an encoder within one turn gives them.

use std::f64::consts::{PI, TAU};

/// How far a step may be from a whole turn, rad: what the body moves from row to row.
const FROM_A_TURN: f64 = 0.25 * PI;

/// Lets an angle, rad, go on where it steps by about a whole turn from one row to the next, and
/// goes on more evenly without; gives how often.
pub(crate) fn unwrap(angle: &mut [f64]) -> usize {
    let (mut turns, mut places) = (0.0, 0);
    let mut before = angle.first().copied().unwrap_or(0.0);
    let mut moved = 0.0;
    for value in angle.iter_mut().skip(1) {
        let step = *value - before;
        before = *value;
        let without = step - TAU.copysign(step);
        let is_wrapped =
            without.abs() < FROM_A_TURN && (without - moved).abs() < (step - moved).abs();
        moved = if is_wrapped { without } else { step };
        if is_wrapped {
            turns -= TAU.copysign(step);
            places += 1;
        }
        *value += turns;
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_angle_goes_on_where_it_wraps_and_a_lost_count_stays() {
        let true_angle = |row: usize| 9.0 * (0.02 * row as f64).sin();
        for wrapped in [
            |a: f64| a.rem_euclid(TAU),
            |a: f64| (a + PI).rem_euclid(TAU) - PI,
        ] {
            let mut angle: Vec<f64> = (0..600).map(|row| wrapped(true_angle(row))).collect();
            assert!(unwrap(&mut angle) > 4);
            let off = angle[0] - true_angle(0);
            let rows = angle.iter().enumerate();
            let most = rows.map(|(row, a)| (a - off - true_angle(row)).abs());
            assert!(most.fold(0.0, f64::max) < 1e-9);
        }
        // A shaft that turns by more than once a row.
        let mut fast: Vec<f64> = (0..600)
            .map(|row| 500.0 * (0.02 * f64::from(row)).sin())
            .collect();
        let logged = fast.clone();
        assert_eq!((unwrap(&mut fast), fast), (0, logged));
        let mut lost: Vec<f64> = (0..20)
            .map(|row| if row < 10 { 0.1 } else { 3.0 })
            .collect();
        let logged = lost.clone();
        assert_eq!((unwrap(&mut lost), lost), (0, logged));
    }
}
