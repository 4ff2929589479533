//! Columns of the logs that the study does not name: those that what a model leaves follows become
//! inputs.
//!
//! A column is asked before any law is: the learner without physics is taught what the base leaves,
//! once from the motion alone and once from the motion and the column. A column that lets it
//! predict unseen blocks better is an input, whatever the law.

use super::base::base_of;
use super::decide::gains::is_gained;
use super::errors::shapes_of;
use super::learner::{Inputs, Knows, Taken};
use super::search::bench::Bench;
use super::search::hypothesis::{Column, Hypothesis};
use super::search::of_axis;
use crate::fit::effects::columns::Records;
use crate::fit::effects::solve;
use crate::fit::identify::Prepared;
use crate::model::effects::AxisEffect;
use crate::model::file::ModelFile;
use crate::signal::motion::Motion;
use crate::study::Study;
use crate::study::series::{at_right_angles, dot, take_out};
use crate::text::error::Result;
use jointwatch_shared::effect::Entry;

/// A column of whose power the study's channels explain more than this part, by linear regression,
/// is one of them again: another sensor of the same motion or force, or what a controller makes of
/// them. In public logs voltages and positions of actuators have up to 0.36, load cells beside the
/// one that counts 0.5 to 0.97.
const ONE_OF_THE_CHANNELS: f64 = 0.5;
/// A column of which the time leaves no more than this part is the time again. A temperature rises
/// with time as well, and joints follow it.
const A_CLOCK: f64 = 1e-3;
/// Rows that the regression looks at: every so manieth of more.
const MAX_ROWS: usize = 20_000;

/// Of what a column lets the learner take away, the part that it may explain as a force by itself;
/// with more it is a force, of which no law of the joint is a cause: one that the study leaves out,
/// or the same one again.
const BY_ITSELF: f64 = 0.5;

/// What the columns that a study does not name say of what a model leaves.
pub struct Columns {
    /// The study with those columns as further inputs that it follows.
    pub study: Study,
    /// What was found, one sentence for each column.
    pub notes: Vec<String>,
}

/// Holds every column of the logs that the study does not name against what a model leaves; nothing
/// where there are none.
///
/// # Errors
/// As [`super::diagnose_with`].
pub fn with_columns(study: Study, model: &ModelFile) -> Result<Columns> {
    let mut notes = Vec::new();
    let Some(wider) = study.with_spare_columns()? else {
        return Ok(Columns { study, notes });
    };
    let prepared = Prepared::with_filters(&wider, model.filters.clone())?;
    let training = prepared.training(&wider);
    let unnamed = wider.inputs.iter().filter(|input| !input.named);
    let news = unnamed.filter(|input| is_news(&training, &input.name));
    let words = news.map(|input| AxisEffect::kept_input(&input.name));
    let (offered, standing): (Vec<&str>, Vec<&str>) =
        words.partition(|word| training.iter().any(|motion| changes(motion, word)));
    if offered.is_empty() && standing.is_empty() {
        return Ok(Columns { study, notes });
    }
    let (base, values) = base_of(&wider, model, &mut Vec::new())?;
    let records = Records::new(&wider.axes, &training, &model.filters.band);
    let from = values.map(|values| shapes_of(&records, &base, &values));
    let solution = solve(&records, &wider.axes, &base, from)?;
    let mut followed: Vec<&str> = Vec::new();
    let standing = study.columns_of(&standing);
    let column_of = |word: &'static str| study.columns_of(&[word]).first().copied().unwrap_or(word);
    for axis in 0..wider.axes.len() {
        let own = of_axis(axis, &base, &solution.solved.values);
        let known = study.inputs.iter();
        let asked = Axis {
            bench: Bench::new(&records, axis, &own, None),
            base: own,
            axes: wider.axes.len(),
            known: known.map(|i| AxisEffect::kept_input(&i.name)).collect(),
        };
        if !standing.is_empty() && asked.differs_by_record() {
            let (name, columns) = (&wider.axes[axis].name, standing.join("\", \""));
            notes.push(format!(
                "what the model leaves on axis {name} differs from record to record, as do columns that study.toml does not name: \"{columns}\"; \
                 if the joint may follow one, name it there with [[input]] and its unit"
            ));
        }
        for (word, by_itself) in asked.follows(&offered) {
            let (name, column) = (&wider.axes[axis].name, column_of(word));
            if by_itself {
                notes.push(format!(
                    "the column {column:?} reads like a force of axis {name}: if it drives the joint, as a pressure or a coil's current does, \
                     name it with [[input]] and its unit; if it is the same force once more, it says nothing new"
                ));
            } else {
                followed.push(column);
                notes.push(format!(
                    "what the model leaves on axis {name} follows the column {column:?}, which study.toml does not name: it is taken as an \
                     input; name it there with [[input]] and its unit"
                ));
            }
        }
    }
    let study = if followed.is_empty() {
        study
    } else {
        Study::read_with(&study.path, &followed)?
    };
    Ok(Columns { study, notes })
}

/// An axis of which columns are asked.
struct Axis<'a> {
    bench: Bench<'a>,
    base: Hypothesis,
    axes: usize,
    /// Inputs that the study names.
    known: Vec<&'static str>,
}

impl Axis<'_> {
    /// What the base explains.
    fn design(&self) -> Vec<Column> {
        let parts = self.bench.parts(&self.base, &[]);
        self.bench.design(&self.base, &parts)
    }

    /// Whether the learner takes more away when it knows which record it is.
    fn differs_by_record(&self) -> bool {
        let inputs = Inputs::new(&self.bench, self.axes, &self.known);
        let left = inputs.left(&self.bench, &self.design(), false);
        let without = inputs.taken(&self.bench, &left, Knows::Inputs);
        let with = inputs.taken_by(&self.bench, &left, |step| step != Knows::Time);
        takes_more(&without, &with)
    }

    /// The columns that what the base leaves follows, the most telling first, each with whether it
    /// is a force by itself.
    fn follows(&self, offered: &[&'static str]) -> Vec<(&'static str, bool)> {
        if offered.is_empty() {
            return Vec::new();
        }
        let base = self.design();
        let mut known = self.known.clone();
        let mut before = self.taken(&base, &known);
        let mut follows = Vec::new();
        let all = [known.as_slice(), offered].concat();
        if !takes_more(&before, &self.taken(&base, &all)) {
            return follows;
        }
        while let Some((name, after)) = offered
            .iter()
            .filter(|name| !follows.iter().any(|(known, _)| known == *name))
            .map(|&name| {
                (
                    name,
                    self.taken(&base, &[known.as_slice(), &[name]].concat()),
                )
            })
            .filter(|(_, after)| takes_more(&before, after))
            .min_by(|a, b| a.1.power[1].total_cmp(&b.1.power[1]))
        {
            let more = [base.as_slice(), &self.as_a_force(name)].concat();
            let as_a_force = self.taken(&more, &known);
            let fell = |taken: &Taken| before.power[1] - taken.power[1];
            let by_itself = fell(&as_a_force) > BY_ITSELF * fell(&after);
            if !by_itself {
                known.push(name);
                before = after;
            }
            follows.push((name, by_itself));
        }
        follows
    }

    /// What the learner takes away of what a design leaves, when it knows the motion, the record
    /// and these inputs: a column that only tells the records apart says no more than that the
    /// joint differs from one to the next.
    fn taken(&self, design: &[Column], inputs: &[&'static str]) -> Taken {
        let inputs = Inputs::new(&self.bench, self.axes, inputs);
        let left = inputs.left(&self.bench, design, false);
        inputs.taken_by(&self.bench, &left, |step| step != Knows::Time)
    }

    /// The force that is proportional to a column.
    fn as_a_force(&self, name: &'static str) -> Vec<Column> {
        let bound = Entry::named("preload").map(|entry| AxisEffect {
            entry,
            axis: self.bench.axis,
            input: Some(name),
        });
        let parts = bound
            .iter()
            .map(|bound| self.bench.part(bound, &self.bench.middle(bound)));
        parts.flat_map(|part| part.columns).collect()
    }
}

/// Whether a learner that knows more takes away more, by more than chance, and more than every
/// model of a real joint is wrong by.
fn takes_more(before: &Taken, after: &Taken) -> bool {
    let power = before.power[1] - after.power[1];
    is_gained(&after.gains_beside(before)) && power > before.least_share.powi(2)
}

/// Whether a column changes within a record.
fn changes(motion: &Motion, name: &str) -> bool {
    let column = motion.input(name).unwrap_or_default();
    column.iter().any(|value| *value != column[0])
}

/// Whether a column is more than the study's channels say already.
fn is_news(motions: &[&Motion], name: &str) -> bool {
    let rows: usize = motions.iter().map(|m| m.rows()).sum();
    let step = rows.div_ceil(MAX_ROWS).max(1);
    let gathered = |of: &dyn Fn(&Motion) -> Vec<f64>| -> Vec<f64> {
        let each = motions.iter().flat_map(|m| of(m));
        each.step_by(step).collect()
    };
    let column = gathered(&|m| m.input(name).unwrap_or_default().to_vec());
    let one = gathered(&|m| vec![1.0; m.rows()]);
    let time = gathered(&|m| (0..m.rows()).map(|row| row as f64).collect());
    let clock = [one.clone(), time];
    let mut channels = vec![one];
    let first = motions.first();
    for place in 0..first.map_or(0, |m| m.states.len()) {
        channels.push(gathered(&|m| m.states[place].clone()));
    }
    for axis in 0..first.map_or(0, |m| m.force.len()) {
        channels.push(gathered(&|m| m.acceleration[axis].clone()));
        channels.push(gathered(&|m| m.applied_force(axis).into_owned()));
    }
    left_by(&clock, column.clone()) > A_CLOCK
        && left_by(&channels, column) > 1.0 - ONE_OF_THE_CHANNELS
}

/// The part of a column's power about its mean that linear regression on others leaves; the first
/// of them is the constant.
fn left_by(others: &[Vec<f64>], mut column: Vec<f64>) -> f64 {
    let mut about_mean = f64::NAN;
    let basis = at_right_angles(others, 1e-9);
    for (place, direction) in basis.iter().enumerate() {
        take_out(&mut column, direction);
        if place == 0 {
            about_mean = dot(&column, &column);
        }
    }
    dot(&column, &column) / about_mean.max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::left_by;

    #[test]
    fn what_the_channels_make_is_no_news() {
        let wave =
            |rate: f64| -> Vec<f64> { (0..500).map(|k| (rate * f64::from(k)).sin()).collect() };
        let (one, x, v) = (vec![1.0; 500], wave(0.1), wave(0.237));
        let channels = [one, x.clone(), v.clone()];
        let mixed: Vec<f64> = x
            .iter()
            .zip(&v)
            .map(|(x, v)| 3.0 - 2.0 * x + 0.5 * v)
            .collect();
        assert!(left_by(&channels, mixed) < 1e-12);
        let own = wave(0.0171);
        let half: Vec<f64> = own.iter().zip(&x).map(|(o, x)| o + x).collect();
        assert!(left_by(&channels, own) > 0.9);
        let left = left_by(&channels, half);
        assert!(left > 0.3 && left < 0.7, "{left}");
    }
}
