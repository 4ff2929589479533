//! A part: the sums of some records, with the plan that they were made by and the records' hashes.
//! Its file, and merging.

use super::exact::Exact;
use super::plan::{Plan, refused};
use super::products::{FLUSHED, with_products};
use super::{physical, polynomial};
use crate::fit::effects::EffectsFit;
use crate::fit::inertia::Inertia;
use crate::fit::polynomial::{PolynomialFit, PolynomialOptions, fit_folds, range};
use crate::model::InputRange;
use crate::signal::motion::{self, Motion};
use crate::study::{Role, Source, Study, own_name};
use crate::text::error::{Error, Result};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// What every file of a part begins with.
const MAGIC: &[u8; 8] = b"JWSUMS1\n";
/// Bytes of its checksum, which ends it.
const CHECKSUM: usize = 32;
/// Rows per parameter below which a fit is worth a warning: rows of a record are far from
/// independent.
const ROWS_PER_PARAMETER: u64 = 20;

/// The sums of some records.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    head: Head,
    /// Per axis Σ force², Σ force·acceleration, Σ acceleration².
    forces: Exact,
    /// Per block of the cross-validation and part of it.
    folds: Vec<Exact>,
    physical: Exact,
}

/// What a part says of itself, as JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Head {
    plan: Plan,
    /// Sorted by hash and rows.
    records: Vec<Source>,
    /// Lowest and highest value of each state, SI.
    ranges: Vec<[f64; 2]>,
    /// Rows behind the differentiators.
    rows: u64,
    /// Rows behind the low-pass, as far as they are taken for physical models.
    thinned: u64,
    /// Rows per part of a block.
    rows_of_folds: Vec<u64>,
}

impl Part {
    /// Sums of a plan to which no record has been added yet.
    fn empty(plan: &Plan) -> Self {
        let axes = plan.axes.len();
        let folds = if plan.has_polynomial() {
            polynomial::PARTS
        } else {
            0
        };
        Self {
            forces: Exact::zeros(3 * axes),
            folds: vec![Exact::zeros(polynomial::count(axes)); folds],
            physical: Exact::zeros(physical::count(plan)),
            head: Head {
                ranges: vec![[f64::INFINITY, f64::NEG_INFINITY]; 2 * axes],
                records: Vec::new(),
                rows: 0,
                thinned: 0,
                rows_of_folds: vec![0; folds],
                plan: plan.clone(),
            },
        }
    }

    /// The sums of the training records of a study.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`]: other axes or another rate than the plan's, a record
    /// that is shorter than the filters, or one that has no room in the sums.
    pub fn of(plan: &Plan, study: &Study) -> Result<Self> {
        let axes = plan.axes.iter().map(|a| (a.name.as_str(), a.kind));
        study.check_fits("the plan of the sums", axes, plan.filters.sample_rate_hz)?;
        let terms = plan.bound()?;
        let mut part = Self::empty(plan);
        for (index, record) in study.records.iter().enumerate() {
            if record.role != Role::Train {
                continue;
            }
            let motion = motion::motion(study, index, record, &plan.filters)?;
            part.add(&terms, &motion).map_err(|e| Error {
                sentence: format!("{}: {e}", record.file),
                ..e
            })?;
        }
        let sources = study.sources.iter().filter(|s| s.role == Role::Train);
        part.head.records = sources.map(by_name).collect();
        part.sort_records("the study")?;
        Ok(part)
    }

    fn add(&mut self, terms: &[crate::model::effects::AxisEffect], motion: &Motion) -> Result<()> {
        let plan = &self.head.plan;
        for ([low, high], series) in self.head.ranges.iter_mut().zip(&motion.states) {
            for value in series {
                *low = least(*low, *value);
                *high = most(*high, *value);
            }
        }
        for (axis, scales) in plan.scales.iter().enumerate() {
            let forces = motion.force[axis].chunks(FLUSHED);
            for (f, a) in forces.zip(motion.acceleration[axis].chunks(FLUSHED)) {
                let exponents = [2 * scales[1], scales[1] + scales[2], 2 * scales[2]];
                let sums = with_products([0.0; 3], [(f, f), (f, a), (a, a)]);
                for (place, (sum, by)) in sums.into_iter().zip(exponents).enumerate() {
                    self.forces.add(3 * axis + place, sum * 2f64.powi(-by))?;
                }
            }
        }
        if !self.folds.is_empty() {
            polynomial::add(plan, motion, &mut self.folds, &mut self.head.rows_of_folds)?;
        }
        self.head.thinned += physical::add(plan, terms, motion, &mut self.physical)?;
        self.head.rows += motion.rows() as u64;
        Ok(())
    }

    /// Adds another part, which `from` names in messages.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`]: another plan, a record that is counted already, sums
    /// without room.
    pub fn merge(&mut self, other: &Self, from: &str) -> Result<()> {
        if let Some(how) = self.head.plan.difference(&other.head.plan) {
            return Err(Error::data(format!(
                "{from} is {how} than the parts before it, so their sums do not add up; accumulate all records with one study"
            )));
        }
        self.head.records.extend_from_slice(&other.head.records);
        self.sort_records(from)?;
        for ([low, high], [l, h]) in self.head.ranges.iter_mut().zip(&other.head.ranges) {
            *low = least(*low, *l);
            *high = most(*high, *h);
        }
        self.head.rows += other.head.rows;
        self.head.thinned += other.head.thinned;
        for (rows, more) in self
            .head
            .rows_of_folds
            .iter_mut()
            .zip(&other.head.rows_of_folds)
        {
            *rows += more;
        }
        self.forces.add_all(&other.forces)?;
        self.physical.add_all(&other.physical)?;
        let mut folds = self.folds.iter_mut().zip(&other.folds);
        folds.try_for_each(|(sums, more)| sums.add_all(more))
    }

    /// Sorts the records, and refuses one whose rows are there twice.
    fn sort_records(&mut self, from: &str) -> Result<()> {
        let key = |s: &Source| (s.sha256.clone(), s.rows, s.file.clone());
        self.head.records.sort_by_cached_key(key);
        let twice = self
            .head
            .records
            .windows(2)
            .find(|pair| pair[0].sha256 == pair[1].sha256 && pair[1].rows[0] < pair[0].rows[1]);
        match twice {
            None => Ok(()),
            Some(pair) => Err(Error::data(format!(
                "{from} holds record {} (SHA-256 {}…), which is counted already; give each record, and each part, once",
                pair[1].file,
                pair[1].sha256.get(..12).unwrap_or_default()
            ))),
        }
    }

    /// Its file.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Failed`] when its head cannot be expressed, which does not
    /// happen.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let head = serde_json::to_vec(&self.head)
            .map_err(|e| Error::failed(format!("the sums could not be written ({e})")))?;
        let mut bytes = MAGIC.to_vec();
        bytes.extend((head.len() as u64).to_le_bytes());
        bytes.extend(head);
        for sums in self.all() {
            bytes.extend(sums.bytes().flatten());
        }
        bytes.extend(Sha256::digest(&bytes));
        Ok(bytes)
    }

    fn all(&self) -> impl Iterator<Item = &Exact> {
        [&self.forces, &self.physical]
            .into_iter()
            .chain(&self.folds)
    }

    /// The part that a file holds; `called` names it in messages.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`]: no part, one of another version, a damaged one.
    pub fn of_bytes(called: &str, bytes: &[u8]) -> Result<Self> {
        let wrong = |what: &str| {
            Error::data(format!(
                "{called}: {what}; give a file that `jointwatch accumulate` or `jointwatch merge` wrote"
            ))
        };
        let no_part = || wrong("these are no sums of records");
        let rest = bytes.strip_prefix(MAGIC).ok_or_else(no_part)?;
        let damaged = || wrong("the file is cut off or damaged, its checksum does not fit");
        let whole = bytes.len().checked_sub(CHECKSUM).ok_or_else(damaged)?;
        if Sha256::digest(&bytes[..whole]).as_slice() != &bytes[whole..] {
            return Err(damaged());
        }
        let rest = rest.get(..whole - MAGIC.len()).ok_or_else(damaged)?;
        let (length, rest) = rest.split_first_chunk::<8>().ok_or_else(damaged)?;
        let length = usize::try_from(u64::from_le_bytes(*length)).map_err(|_| damaged())?;
        let (head, sums) = rest.split_at_checked(length).ok_or_else(damaged)?;
        let head: Head = serde_json::from_slice(head)
            .map_err(|e| wrong(&format!("its head cannot be read ({e})")))?;
        head.plan.check().map_err(|what| wrong(&what))?;
        let mut part = Self::empty(&head.plan);
        let fits = head.ranges.len() == part.head.ranges.len()
            && head.rows_of_folds.len() == part.head.rows_of_folds.len()
            && sums.len() == 16 * part.all().map(Exact::len).sum::<usize>();
        if !fits {
            return Err(wrong("its sums are not those of its plan"));
        }
        part.head = head;
        let mut rest = sums;
        let mut take = |sums: &mut Exact| {
            let (mine, others) = rest.split_at(16 * sums.len());
            *sums = Exact::of_bytes(mine);
            rest = others;
        };
        take(&mut part.forces);
        take(&mut part.physical);
        part.folds.iter_mut().for_each(take);
        Ok(part)
    }

    /// How its records were summed.
    pub fn plan(&self) -> &Plan {
        &self.head.plan
    }

    /// The records, sorted by their hashes.
    pub fn records(&self) -> &[Source] {
        &self.head.records
    }

    /// Rows that were summed.
    pub fn rows(&self) -> u64 {
        self.head.rows
    }

    /// The range of each state over all records.
    pub(in crate::fit) fn ranges(&self) -> Vec<InputRange> {
        self.head.ranges.iter().copied().map(range).collect()
    }

    /// How far the records went beyond the plan's range, as a factor; 1 when they stayed inside.
    pub fn beyond(&self) -> f64 {
        let reached = self.head.plan.inputs.iter().zip(&self.head.ranges);
        let reached = reached.flat_map(|(plan, ends)| ends.map(|end| plan.normalise(end).abs()));
        reached.fold(1.0, f64::max)
    }

    /// RMS of the restoring force of an axis over all rows, N or N·m, for its inertia.
    pub(in crate::fit) fn force_rms(&self, axis: usize, inertia: f64) -> f64 {
        let scales = self.head.plan.scales[axis];
        let [ff, fa, aa] = [
            (0, 2 * scales[1]),
            (1, scales[1] + scales[2]),
            (2, 2 * scales[2]),
        ]
        .map(|(place, by)| 2f64.powi(by) * self.forces.value(3 * axis + place));
        let square = ff - 2.0 * inertia * fa + inertia * inertia * aa;
        (square.max(0.0) / self.head.rows.max(1) as f64).sqrt()
    }

    /// The polynomial that the sums give.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`]: an inertia that the study does not state, sums that
    /// determine nothing.
    pub(in crate::fit) fn polynomial(&self, options: &PolynomialOptions) -> Result<PolynomialFit> {
        let plan = &self.head.plan;
        let mut inertia = Vec::new();
        for axis in &plan.axes {
            let Some(value) = axis.inertia else {
                let why = format!(
                    "a polynomial needs the inertia of axis {} beforehand, state it in study.toml",
                    axis.name
                );
                return Err(refused(&plan.study, &why));
            };
            inertia.push(Inertia {
                value,
                identified: false,
                standard_error: None,
            });
        }
        let ranges = self.ranges();
        let folds = polynomial::folds(plan, &self.folds, &self.head.rows_of_folds, &ranges);
        fit_folds(&plan.axes, &folds, options, (ranges, inertia), &|terms| {
            self.few(terms)
        })
    }

    fn few(&self, parameters: usize) -> Vec<String> {
        let rows = self.head.rows;
        let few = rows < ROWS_PER_PARAMETER * parameters as u64;
        let warning = few.then(|| format!("{rows} training rows are few for {parameters} parameters per axis: sum more records"));
        warning.into_iter().collect()
    }

    /// The strengths of the study's effects that the sums give.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`]: effects whose shapes have to be searched for, too few
    /// rows.
    pub(in crate::fit) fn physical(&self) -> Result<EffectsFit> {
        let plan = &self.head.plan;
        match &plan.not_linear {
            Some(why) => Err(refused(
                &plan.study,
                &format!(
                    "{why}, and a search for it needs records; make a smaller study with `jointwatch select`"
                ),
            )),
            None => physical::solve(plan, &self.physical, self.head.thinned),
        }
    }
}

/// A source under its file's own name: the same record is the same wherever it lies.
fn by_name(source: &Source) -> Source {
    Source {
        file: own_name(&source.file),
        ..source.clone()
    }
}

/// The lesser of two numbers in the order that tells −0 from 0: the same whichever comes first.
fn least(a: f64, b: f64) -> f64 {
    if b.total_cmp(&a).is_lt() { b } else { a }
}

/// The greater of two numbers in the same order.
fn most(a: f64, b: f64) -> f64 {
    if b.total_cmp(&a).is_gt() { b } else { a }
}
