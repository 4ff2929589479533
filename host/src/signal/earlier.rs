//! What a joint remembers of the records that one continues: their last rows, and of those before the turns that nothing has gone beyond.
//!
//! A hysteresis forgets a loop once the motion has gone beyond its ends (the wiping-out property of Preisach models), and what relaxes
//! forgets in time. So few rows stand for any number of them.

/// Rows that are kept as they are.
const WHOLE: usize = 2048;
/// Rows of the travel from one turn to the next.
const LEG: usize = 16;

/// The displacements of each axis, all equally long, as far as they are remembered.
pub(super) fn remembered(axes: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let rows = axes.first().map_or(0, Vec::len);
    let old = rows.saturating_sub(WHOLE);
    let mut turns: Vec<usize> = axes.iter().flat_map(|x| turns(&x[..old])).collect();
    turns.push(old);
    turns.sort_unstable();
    turns.dedup();
    let path = |x: &Vec<f64>| {
        let travels = turns.windows(2).flat_map(|ends| {
            let [from, to] = [x[ends[0]], x[ends[1]]];
            (0..LEG).map(move |k| from + (to - from) * k as f64 / LEG as f64)
        });
        travels.chain(x[old..].iter().copied()).collect()
    };
    axes.iter().map(path).collect()
}

/// The first row, and those rows at which a displacement turned and beyond which it did not go again, the last first.
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
            let short = remembered(&axes);
            assert!(short[0].len() <= WHOLE + 64 * LEG, "{}", short[0].len());
            assert_eq!(short[0].len(), short[1].len());
            for (short, whole) in short.iter().zip(&axes) {
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
