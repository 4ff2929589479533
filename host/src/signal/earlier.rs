//! What a joint remembers of the motion before a stretch: its last rows, and of those before them
//! the turns that nothing has gone beyond.
//!
//! A hysteresis forgets a loop once the motion has gone beyond its ends (the wiping-out property of
//! Preisach models), and what relaxes forgets in time. So few rows stand for any number of them.

/// Rows that are kept as they are.
const WHOLE: usize = 2048;
/// Rows of the travel from one turn to the next.
const LEG: usize = 16;

/// A motion, [x, ẋ] or [x, ẋ, φ, φ̇], as far as it is remembered after its last row: series of one
/// length again. Between turns stand even travels at the mean velocity of the motion there.
pub(super) fn remembered(states: &[Vec<f64>], sample_rate_hz: f64) -> Vec<Vec<f64>> {
    let rows = states.first().map_or(0, Vec::len);
    let old = rows.saturating_sub(WHOLE);
    let displacements = states.iter().step_by(2);
    let mut turns: Vec<usize> = displacements.flat_map(|x| turns(&x[..old])).collect();
    turns.push(old);
    turns.sort_unstable();
    turns.dedup();
    let leg = |x: &[f64], ends: &[usize]| {
        let [from, to] = [x[ends[0]], x[ends[1]]];
        let rows = (ends[1] - ends[0]) as f64;
        (from, to - from, (to - from) / rows * sample_rate_hz)
    };
    let axis = |own: &[Vec<f64>]| {
        let legs = || turns.windows(2).map(|ends| leg(&own[0], ends));
        let x = legs()
            .flat_map(|(from, way, _)| (0..LEG).map(move |k| from + way * k as f64 / LEG as f64));
        let v = legs().flat_map(|(_, _, velocity)| [velocity; LEG]);
        [
            x.chain(own[0][old..].iter().copied()).collect(),
            v.chain(own[1][old..].iter().copied()).collect(),
        ]
    };
    states.chunks_exact(2).flat_map(axis).collect()
}

/// The first row, and those rows at which a displacement turned and beyond which it did not go
/// again, the last first.
fn turns(x: &[f64]) -> Vec<usize> {
    let mut kept: Vec<(bool, usize)> = Vec::new();
    let [mut low, mut high] = [f64::INFINITY, f64::NEG_INFINITY];
    for (row, &x) in x.iter().enumerate().rev() {
        for (is_high, beyond) in [(true, x > high), (false, x < low)] {
            match kept.last_mut() {
                _ if !beyond => {}
                Some((known, at)) if *known == is_high => *at = row,
                _ => kept.push((is_high, row)),
            }
        }
        (low, high) = (low.min(x), high.max(x));
    }
    let rows = kept.into_iter().map(|(_, row)| row);
    rows.chain((!x.is_empty()).then_some(0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_is_kept_until_the_motion_goes_beyond_it() {
        let x = [0.0, 1.0, -3.0, 5.0, -2.0, 2.0, 4.0, -1.0, 0.5, 0.0];
        let mut rows = turns(&x);
        rows.sort_unstable();
        rows.dedup();
        // 1 was gone beyond by 5, and 2 lies on the way to 4.
        assert_eq!(rows, [0, 2, 3, 4, 6, 7, 8, 9]);
    }

    #[test]
    fn a_slider_is_where_the_whole_motion_would_have_brought_it() {
        let wave = |row: usize, tune: f64| {
            let t = row as f64;
            (0.011 * t).sin() * (1.0 + 0.5 * (0.0007 * t * tune).sin()) + 0.4 * (0.047 * t).cos()
        };
        let stretch = |path: &[f64], slip: f64| {
            let moved = path.windows(2).map(|ends| ends[1] - ends[0]);
            moved.fold(0.0, |z: f64, step| (z + step).clamp(-slip, slip))
        };
        for rows in [0, 1, 1000, 2048, 2049, 2500, 30_000] {
            let axes = [1.0, 1.9].map(|tune| (0..rows).map(|row| wave(row, tune)).collect());
            let [x, phi] = axes;
            let states = [x, vec![1.0; rows], phi, vec![1.0; rows]];
            let short = remembered(&states, 1.0);
            assert!(short[0].len() <= WHOLE + 64 * LEG, "{}", short[0].len());
            assert!(short.iter().all(|series| series.len() == short[0].len()));
            for axis in [0, 2] {
                let [short, whole] = [&short[axis], &states[axis]];
                let largest = |x: &[f64]| x.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
                assert_eq!(largest(short), largest(whole));
                for slip in [0.1, 0.5, 1.0, 1.4] {
                    let [seen, wanted] = [short, whole].map(|path| stretch(path, slip));
                    assert!(
                        (seen - wanted).abs() < 1e-9,
                        "{rows} rows, slip {slip}: {seen}, {wanted}"
                    );
                }
            }
        }
    }
}
