//! One simulated run along a record: where it starts anew, when it has diverged, and how fine its
//! steps must be.

use crate::model::InputRange;
use crate::model::file::{Base, ModelFile};
use crate::model::scalar::HostScalar;
use crate::simulate::JointLaw;
use serde::Serialize;

/// A simulation has diverged when a state lies this many half-ranges from the middle of its
/// training range.
pub(in crate::simulate) const DIVERGED: f64 = 10.0;
/// Steps are fine enough when twice as many change the displacements by at most this part of their
/// RMS.
pub(in crate::simulate) const SETTLED: f64 = 1e-4;
/// Most steps per row; a motion that still changes then is told as such.
const MAX_STEPS: usize = 64;

/// The motion that a simulation is held against, and from which it starts.
pub(in crate::simulate) struct MeasuredMotion {
    /// [x, ẋ] or [x, ẋ, φ, φ̇], SI.
    pub(in crate::simulate) states: Vec<Vec<f64>>,
    pub(in crate::simulate) sample_rate_hz: f64,
    /// Seconds from the beginning of the file to row 0.
    pub(in crate::simulate) start_s: f64,
    /// What the model follows beside the motion, in the order of [`ModelFile::input_names`].
    pub(in crate::simulate) inputs: Vec<Vec<f64>>,
}

impl MeasuredMotion {
    pub(in crate::simulate) fn rows(&self) -> usize {
        self.states[0].len()
    }

    /// The inputs at a place between two rows, on a straight line.
    pub(in crate::simulate) fn inputs_at(&self, row: f64) -> Vec<f64> {
        let (before, part) = (row.floor() as usize, row.fract());
        let value = |series: &Vec<f64>| {
            let at = |row: usize| series[row.min(series.len() - 1)];
            at(before) + part * (at(before + 1) - at(before))
        };
        self.inputs.iter().map(value).collect()
    }

    /// The joint's state at a row, 0 on an axis that is not there.
    pub(in crate::simulate) fn state(&self, row: usize) -> [f64; 4] {
        let mut state = [0.0; 4];
        for (value, series) in state.iter_mut().zip(&self.states) {
            *value = series[row];
        }
        state
    }
}

/// What is integrated along a record.
pub(in crate::simulate) trait Mechanism {
    /// Puts it into its measured (or true) state at a row.
    fn place(&mut self, row: usize);
    /// Moves it on from a row to the next.
    fn next_row(&mut self, row: usize);
    /// The joint's state; `row` is the row at which it is now.
    fn joint_state(&self, row: usize) -> [f64; 4];
}

/// A law whose internal states have followed the measured motion, for every start from it.
pub(in crate::simulate) struct Follower<L> {
    law: L,
    row: usize,
}

impl<L: Clone> Follower<L> {
    pub(in crate::simulate) fn new(law: L) -> Self {
        Self { law, row: 0 }
    }

    /// The law as it is at a row, which lies no earlier than the last one asked for.
    pub(in crate::simulate) fn at<S: HostScalar>(
        &mut self,
        row: usize,
        motion: &MeasuredMotion,
    ) -> L
    where
        L: JointLaw<S>,
    {
        while self.row < row {
            self.row += 1;
            let state = motion.state(self.row).map(S::constant);
            self.law.follow(&motion.inputs_at(self.row as f64));
            self.law.advance(state, 1.0 / motion.sample_rate_hz);
        }
        self.law.follow(&motion.inputs_at(row as f64));
        self.law.clone()
    }
}

/// A simulation that left everything its model knows.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Divergence {
    /// Seconds from the beginning of the file.
    pub time_s: f64,
    /// Seconds since the simulation was started from the measured motion.
    pub after_s: f64,
    /// The axis whose state went.
    pub axis: String,
    /// Which state diverged: `displacement` or `velocity`.
    pub state: &'static str,
    /// Its value, SI; `null` in JSON when it was not finite.
    pub value: f64,
    /// Distance from the middle of the training range in half-ranges; `null` when it was not
    /// finite.
    pub half_ranges: f64,
}

/// A run at one step.
#[derive(Clone)]
pub(in crate::simulate) struct Simulated {
    /// As [`MeasuredMotion::states`]; NaN from a divergence to the next start.
    pub(in crate::simulate) states: Vec<Vec<f64>>,
    /// Row, row of its start, input and value of every divergence.
    diverged: Vec<(usize, usize, usize, f64)>,
    pub(in crate::simulate) steps_per_row: usize,
    pub(in crate::simulate) step_error: f64,
    /// Whether it was started from the measured motion more than once.
    pub(in crate::simulate) restarted: bool,
    inputs: Vec<InputRange>,
}

impl Simulated {
    /// Part of the rows that were simulated.
    pub(in crate::simulate) fn share(&self) -> f64 {
        let rows = self.states[0].iter();
        rows.filter(|x| x.is_finite()).count() as f64 / self.states[0].len() as f64
    }

    pub(in crate::simulate) fn divergences(
        &self,
        motion: &MeasuredMotion,
        model: &ModelFile,
    ) -> Vec<Divergence> {
        let told = |&(row, start, input, value): &(usize, usize, usize, f64)| Divergence {
            time_s: motion.start_s + row as f64 / motion.sample_rate_hz,
            after_s: (row - start) as f64 / motion.sample_rate_hz,
            axis: model.axes[input / 2].name.clone(),
            state: ["displacement", "velocity"][input % 2],
            value,
            half_ranges: self.inputs[input].normalise(value).abs(),
        };
        self.diverged.iter().map(told).collect()
    }

    /// RMS difference of the displacements of two runs where both went, as a part of the second's
    /// RMS; the largest over the axes.
    fn change(&self, finer: &Self) -> f64 {
        let axis = |(a, b): (&Vec<f64>, &Vec<f64>)| {
            let (mut difference, mut size) = (0.0, 0.0);
            for (a, b) in a.iter().zip(b) {
                if a.is_finite() && b.is_finite() {
                    difference += (a - b) * (a - b);
                    size += b * b;
                }
            }
            if difference == 0.0 {
                0.0
            } else {
                (difference / size).sqrt().min(f64::MAX)
            }
        };
        let displacements = self.states.iter().zip(&finer.states).step_by(2);
        displacements.map(axis).fold(0.0, f64::max)
    }
}

/// One run that starts anew every `restart_rows`; behind a divergence its states are NaN until the
/// next start.
fn run<M: Mechanism>(
    mut mechanism: M,
    motion: &MeasuredMotion,
    restart_rows: Option<usize>,
    inputs: &[InputRange],
    steps_per_row: usize,
) -> Simulated {
    let rows = motion.rows();
    let mut simulated = Simulated {
        states: vec![vec![f64::NAN; rows]; motion.states.len()],
        diverged: Vec::new(),
        steps_per_row,
        step_error: 0.0,
        restarted: restart_rows.is_some_and(|every| every < rows),
        inputs: inputs.to_vec(),
    };
    let every = restart_rows.unwrap_or(rows);
    for start in (0..rows).step_by(every) {
        mechanism.place(start);
        for row in start..rows.min(start + every) {
            let state = mechanism.joint_state(row);
            // Written so that a value that is no number counts as gone.
            let gone = inputs.iter().zip(state).position(|(range, value)| {
                let reach = range.normalise(value).abs();
                reach.is_nan() || reach > DIVERGED
            });
            if let Some(input) = gone {
                simulated.diverged.push((row, start, input, state[input]));
                break;
            }
            for (series, value) in simulated.states.iter_mut().zip(state) {
                series[row] = value;
            }
            if row + 1 < rows {
                mechanism.next_row(row);
            }
        }
    }
    simulated
}

/// Runs with ever finer steps, from `least_steps` per row on, until halving them changes nothing
/// that matters; the coarser of the last two is returned, or, when nothing settles, the finest.
pub(in crate::simulate) fn settled<M: Mechanism>(
    motion: &MeasuredMotion,
    restart_rows: Option<usize>,
    base: &Base,
    least_steps: usize,
    make: impl Fn(usize) -> M,
) -> Simulated {
    let at = |steps| {
        run(
            make(steps),
            motion,
            restart_rows,
            base.motion_ranges(),
            steps,
        )
    };
    let mut steps = least_steps;
    let mut coarse = at(steps);
    loop {
        let mut fine = at(2 * steps);
        let change = coarse.change(&fine);
        if change <= SETTLED {
            coarse.step_error = change;
            return coarse;
        }
        steps *= 2;
        if steps >= MAX_STEPS {
            fine.step_error = change;
            return fine;
        }
        coarse = fine;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::{Bodies, BodyState, Contact, Excitation, RigParameters};

    /// A joint that exerts nothing and remembers how long it has been moving and where it was last.
    #[derive(Clone)]
    struct Clock {
        time_s: f64,
        last: f64,
    }

    impl JointLaw for Clock {
        fn force(&self, _state: [f64; 4], _contacts: [Contact; 2]) -> [f64; 2] {
            [0.0; 2]
        }

        fn advance(&mut self, state: [f64; 4], step_s: f64) {
            self.time_s += step_s;
            self.last = state[0];
        }
    }

    #[test]
    fn what_a_law_remembers_has_seen_the_motion_before_each_start_and_every_step_after_it() {
        let motion = MeasuredMotion {
            states: vec![(0..100).map(f64::from).collect(), vec![0.0; 100]],
            sample_rate_hz: 200.0,
            start_s: 0.0,
            inputs: Vec::new(),
        };
        let mut follower = Follower::new(Clock {
            time_s: 0.0,
            last: 0.0,
        });
        for row in [0, 40, 80] {
            let law = follower.at(row, &motion);
            assert!((law.time_s - row as f64 / 200.0).abs() < 1e-12);
            assert_eq!(law.last, row as f64);
        }
        let parameters = RigParameters::default();
        let mut bodies = Bodies {
            parameters: &parameters,
            joint: follower.at(80, &motion),
        };
        let still = [0, 1].map(|_| Excitation::logged(vec![0.0; 100], 200.0));
        let mut y = BodyState::zeros();
        y[1] = -0.25;
        bodies.next_row(&mut y, &still, 80, 200.0, 4);
        assert!((bodies.joint.time_s - 81.0 / 200.0).abs() < 1e-12);
        assert_eq!(bodies.joint.last, y[2] - y[1]);
    }

    /// A state that doubles with every row.
    struct Doubling {
        value: f64,
    }

    impl Mechanism for Doubling {
        fn place(&mut self, _row: usize) {
            self.value = 1.0;
        }

        fn next_row(&mut self, _row: usize) {
            self.value *= 2.0;
        }

        fn joint_state(&self, _row: usize) -> [f64; 4] {
            [self.value, 0.0, 0.0, 0.0]
        }
    }

    #[test]
    fn a_run_stops_where_it_leaves_ten_half_ranges_and_goes_on_at_the_next_start() {
        let motion = MeasuredMotion {
            states: vec![vec![1.0; 12]; 2],
            sample_rate_hz: 10.0,
            start_s: 3.0,
            inputs: Vec::new(),
        };
        // 1, 2, 4, 8, 16: ten half-ranges of 1.5 around 0.5 end at 15.5.
        let inputs = [
            InputRange {
                center: 0.5,
                half_range: 1.5,
            },
            InputRange {
                center: 0.0,
                half_range: 1.0,
            },
        ];
        let once = run(Doubling { value: 0.0 }, &motion, None, &inputs, 4);
        assert_eq!(once.states[0][..4], [1.0, 2.0, 4.0, 8.0]);
        assert!(once.states[0][4..].iter().all(|x| x.is_nan()));
        assert_eq!(once.diverged, [(4, 0, 0, 16.0)]);
        assert!((once.share() - 4.0 / 12.0).abs() < 1e-12);
        let again = run(Doubling { value: 0.0 }, &motion, Some(6), &inputs, 4);
        assert_eq!(again.states[0][6..10], [1.0, 2.0, 4.0, 8.0]);
        assert_eq!(again.diverged, [(4, 0, 0, 16.0), (10, 6, 0, 16.0)]);
        assert!(!once.restarted && again.restarted);
    }
}
