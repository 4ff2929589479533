//! Thinning a curve out: the points that can go without the eye seeing it.

/// A curve through fewer points that nowhere strays from the given one by more than `tolerance`
/// (Ramer, Douglas, Peucker); first and last point stay.
///
/// Points and tolerance in the same unit, that of the drawing.
pub(super) fn simplify(points: &[(f64, f64)], tolerance: f64) -> Vec<(f64, f64)> {
    if points.len() < 3 {
        return points.to_vec();
    }
    let mut keep = vec![false; points.len()];
    keep[0] = true;
    keep[points.len() - 1] = true;
    let mut open = vec![(0, points.len() - 1)];
    while let Some((first, last)) = open.pop() {
        let mut farthest = (tolerance, None);
        for at in first + 1..last {
            let distance = distance_to_segment(points[at], points[first], points[last]);
            if distance > farthest.0 {
                farthest = (distance, Some(at));
            }
        }
        if let (_, Some(at)) = farthest {
            keep[at] = true;
            open.push((first, at));
            open.push((at, last));
        }
    }
    let kept = points.iter().zip(keep).filter(|(_, keep)| *keep);
    kept.map(|(point, _)| *point).collect()
}

/// The same with the smallest tolerance, from `tolerance` on in steps of half as much again, that
/// leaves at most `most` points.
pub(super) fn simplify_to(
    points: &[(f64, f64)],
    mut tolerance: f64,
    most: usize,
) -> Vec<(f64, f64)> {
    let most = most.max(2);
    let mut thin = simplify(points, tolerance);
    while thin.len() > most {
        tolerance *= 1.5;
        // What one tolerance dropped a larger one drops as well, nearly: starting over costs little
        // and adds no error.
        thin = simplify(points, tolerance);
    }
    thin
}

/// What is left of a history when every pixel column keeps its first, least, largest and last
/// point, in their order.
///
/// Points in units of the drawing, a pixel each, from left to right; no peak is lost, however long
/// the history.
pub(super) fn extremes(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut thin = Vec::new();
    for column in points.chunk_by(|a, b| a.0.floor() == b.0.floor()) {
        let place = |at: Option<(usize, &(f64, f64))>| at.map_or(0, |(index, _)| index);
        let by_height =
            |a: &(usize, &(f64, f64)), b: &(usize, &(f64, f64))| a.1.1.total_cmp(&b.1.1);
        let least = place(column.iter().enumerate().min_by(by_height));
        let largest = place(column.iter().enumerate().max_by(by_height));
        let mut kept = [0, least, largest, column.len() - 1];
        kept.sort_unstable();
        let mut before = None;
        for index in kept {
            if before != Some(index) {
                thin.push(column[index]);
            }
            before = Some(index);
        }
    }
    thin
}

fn distance_to_segment(point: (f64, f64), from: (f64, f64), to: (f64, f64)) -> f64 {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let length = dx * dx + dy * dy;
    let (px, py) = (point.0 - from.0, point.1 - from.1);
    let along = if length > 0.0 {
        ((px * dx + py * dy) / length).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (px - along * dx).hypot(py - along * dy)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spiral() -> Vec<(f64, f64)> {
        let points = (0..5000).map(|i| 0.01 * f64::from(i));
        points
            .map(|t| (10.0 * t * t.cos(), 10.0 * t * t.sin()))
            .collect()
    }

    #[test]
    fn the_thinned_curve_stays_within_its_tolerance() {
        let points = spiral();
        let thin = simplify(&points, 0.7);
        assert!(thin.len() < points.len() / 5, "{} points", thin.len());
        for point in &points {
            let nearest = thin
                .windows(2)
                .map(|pair| distance_to_segment(*point, pair[0], pair[1]))
                .fold(f64::INFINITY, f64::min);
            assert!(nearest <= 0.7, "{point:?} is {nearest} away");
        }
    }

    #[test]
    fn a_single_spike_survives_and_a_straight_line_becomes_two_points() {
        let mut points: Vec<(f64, f64)> = (0..1000).map(|i| (f64::from(i), 0.0)).collect();
        assert_eq!(simplify(&points, 0.5).len(), 2);
        points[437].1 = 3.0;
        assert!(simplify(&points, 0.5).contains(&(437.0, 3.0)));
    }

    #[test]
    fn a_history_keeps_every_peak_and_few_points() {
        let height = |i: u32| {
            if i == 61_234 {
                9.0
            } else {
                (f64::from(i) * 0.7).sin()
            }
        };
        let points: Vec<(f64, f64)> = (0..200_000)
            .map(|i| (f64::from(i) * 1400.0 / 200_000.0, height(i)))
            .collect();
        let thin = extremes(&points);
        assert!(thin.len() <= 4 * 1400, "{} points", thin.len());
        assert!(thin.contains(&points[61_234]));
        assert!(thin.is_sorted_by(|a, b| a.0 < b.0));
        assert_eq!(
            (thin[0], thin[thin.len() - 1]),
            (points[0], points[199_999])
        );
        for column in 0..1400 {
            let range = |points: &[(f64, f64)]| {
                let mine = points.iter().filter(|p| p.0.floor() == f64::from(column));
                mine.fold((f64::MAX, f64::MIN), |(low, high), p| {
                    (low.min(p.1), high.max(p.1))
                })
            };
            assert_eq!(range(&thin), range(&points), "column {column}");
        }
    }

    #[test]
    fn a_budget_is_kept() {
        assert!(simplify_to(&spiral(), 0.1, 60).len() <= 60);
        assert_eq!(simplify_to(&[(0.0, 0.0), (1.0, 1.0)], 0.5, 0).len(), 2);
    }
}
