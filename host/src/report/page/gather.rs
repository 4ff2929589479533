//! Everything on the page, from the study, the models and what was said of them.

use super::asked::Asked;
use super::contents::{
    AxisContents, Contents, RecordContents, Region, ResidualContents, SampleAxis, SampleVersion,
    Stair, TimedResidual, Units,
};
use super::version::{Version, align};
use super::{candidates, correlation, handling, plane, response, samples, words};
use crate::assess::compare::AxisFigures;
use crate::assess::where_it_fails::{Extent, FailingRegion};
use crate::diagnose::PerAxis;
use crate::diagnose::add;
use crate::report::axis_history::AxisHistory;
use crate::report::staircase::Step;
use crate::study::{Record, Study};
use crate::text::date;
use crate::text::error::Result;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Characters that all samples together may take.
const SAMPLE_CHARACTERS: f64 = 1.5e6;
/// The part of the times since a reversal that is drawn: the longest are pauses.
const DRAWN_TIMES: f64 = 0.98;

/// Gathers what the page shows of a model and, where there is one, of the model before it.
pub(super) fn contents(asked: &Asked<'_>) -> Result<Contents> {
    let study = asked.study;
    let mut versions = Vec::new();
    if let Some(before) = asked.before {
        versions.push(Version::new("before", study, before)?);
    }
    let label = if asked.before.is_some() {
        "after"
    } else {
        "model"
    };
    versions.push(Version::new(label, study, asked.model)?);
    align(&mut versions);
    let steps = steps(asked, &versions);
    let floors = match &asked.floors {
        Some(floors) => floors.clone(),
        None => add::noise_floors(study, asked.model)?,
    };
    let candidates = candidates::gather(asked, &versions[0])?;
    let axes = (0..study.axes.len())
        .into_par_iter()
        .map(|axis| axis_contents(study, &versions, axis, &steps, &floors))
        .collect();
    Ok(Contents {
        title: study.name.clone(),
        asked: asked.command.clone(),
        made: date::today()?,
        version: env!("CARGO_PKG_VERSION"),
        answer: words::answer(asked, &versions, &steps, &floors),
        judged_on: asked.judged_on.clone(),
        timed: !study.quasi_static,
        versions: versions.iter().map(|v| v.label.clone()).collect(),
        axes,
        records: records(study, &versions, &candidates),
        regions: regions(study, &versions),
        candidates: candidates.listed,
        responses: asked
            .response
            .map(|r| response::gather(r, study))
            .unwrap_or_default(),
        handling: handling::gather(asked),
    })
}

/// The steps that were taken, or the errors of the versions as such.
fn steps(asked: &Asked<'_>, versions: &[Version<'_>]) -> Vec<Step> {
    if !asked.steps.is_empty() {
        return asked.steps.clone();
    }
    let step = |version: &Version<'_>| Step {
        label: version.label.clone(),
        errors: version.errors(),
    };
    versions.iter().map(step).collect()
}

fn axis_contents(
    study: &Study,
    versions: &[Version<'_>],
    axis: usize,
    steps: &[Step],
    floors: &PerAxis,
) -> AxisContents {
    let described = &study.axes[axis];
    let stair = |step: &Step| {
        Some(Stair {
            label: step.label.clone(),
            error: *step.errors.get(&described.name)?,
        })
    };
    AxisContents {
        name: described.name.clone(),
        units: Units {
            displacement: described.kind.displacement_unit(),
            velocity: described.kind.velocity_unit(),
            force: described.kind.force_unit(),
        },
        steps: steps.iter().filter_map(stair).collect(),
        floor: floors.get(&described.name).copied(),
        models: versions
            .iter()
            .map(|v| words::model(v.model, axis))
            .collect(),
        residual: residuals(study, versions, axis),
    }
}

/// The residual of every version, over the same cells and bins.
fn residuals(study: &Study, versions: &[Version<'_>], axis: usize) -> Vec<ResidualContents> {
    let histories: Vec<Vec<AxisHistory>> = versions
        .iter()
        .map(|v| v.judged_courses(study, axis))
        .collect();
    let all = |series: fn(&AxisHistory) -> &Vec<f64>| {
        plane::range(histories.iter().flatten().flat_map(series))
    };
    let displacement = all(|c| &c.displacement);
    let velocity = all(|c| &c.velocity);
    let rate = study.sample_rate_hz;
    let one = |(version, histories): (&Version<'_>, &Vec<AxisHistory>)| {
        let residual: Vec<f64> = histories.iter().flat_map(AxisHistory::residual).collect();
        let curve = |series: &[f64], range| plane::curve(series, &residual, range);
        let together = |series: fn(&AxisHistory) -> &Vec<f64>| -> Vec<f64> {
            histories.iter().flat_map(series).copied().collect()
        };
        let x = curve(&together(|c| &c.displacement), displacement);
        let mut over = BTreeMap::from([("displacement", x)]);
        let timed = (!study.quasi_static).then(|| {
            let v = curve(&together(|c| &c.velocity), velocity);
            let (since, drawn) = since_reversal(histories, rate);
            over.insert("velocity", v);
            over.insert("since_reversal", curve(&since, drawn));
            let band_hz = version.model.filters.band_hz;
            TimedResidual {
                plane: plane::plane(histories, displacement, velocity),
                spectrum: correlation::spectrum(histories, rate, band_hz),
                correlation: correlation::correlations(histories, rate, band_hz),
            }
        });
        ResidualContents { over, timed }
    };
    versions.iter().zip(&histories).map(one).collect()
}

/// The time since the last reversal of every row, s, and the range of it that is drawn.
fn since_reversal(histories: &[AxisHistory], rate_hz: f64) -> (Vec<f64>, [f64; 2]) {
    let of_one = |c: &AxisHistory| plane::since_reversal(&c.velocity, rate_hz);
    let since: Vec<f64> = histories.iter().flat_map(of_one).collect();
    let mut times: Vec<f64> = since.iter().copied().filter(|t| t.is_finite()).collect();
    times.sort_by(f64::total_cmp);
    let last = times.get((DRAWN_TIMES * times.len() as f64) as usize);
    let longest = last.copied().unwrap_or(1.0).max(1.0 / rate_hz);
    (since, [0.0, longest])
}

/// Every record's samples, as many as the page has room for.
fn records(
    study: &Study,
    versions: &[Version<'_>],
    candidates: &candidates::Candidates,
) -> Vec<RecordContents> {
    let axes = study.axes.len();
    let series = 1 + axes * (2 + 2 * versions.len());
    let rows: usize = versions[0].histories.iter().map(|c| c[0].at.len()).sum();
    let room = SAMPLE_CHARACTERS / (samples::CHARACTERS_PER_ROW * series as f64);
    let share = (room / rows.max(1) as f64).min(1.0);
    let one = |index: usize| {
        let record = &study.records[index];
        let residuals: Vec<Vec<Vec<f64>>> = versions
            .iter()
            .map(|v| {
                v.histories[index]
                    .iter()
                    .map(AxisHistory::residual)
                    .collect()
            })
            .collect();
        let first = &versions[0].histories[index];
        let measured = first.iter().map(|c| c.measured.as_slice());
        let extremes: Vec<&[f64]> = measured
            .chain(residuals.iter().flatten().map(Vec::as_slice))
            .collect();
        let all = first[0].at.len();
        let kept = samples::kept_rows(all, &extremes, (share * all as f64).ceil() as usize);
        let sample_axis = |axis: usize| {
            let name = &study.axes[axis].name;
            let history = &first[axis];
            let version = |(at, version): (usize, &Version<'_>)| {
                let figures = version.comparison.records[index].axes.get(name);
                sample_version(
                    &version.histories[index][axis],
                    &residuals[at][axis],
                    figures,
                    &kept,
                )
            };
            let figures = versions[0].comparison.records[index].axes.get(name);
            SampleAxis {
                at_rest: figures.is_some_and(|f| f.at_rest),
                displacement: samples::packed(&history.displacement, &kept),
                velocity: samples::packed(&history.velocity, &kept),
                versions: versions.iter().enumerate().map(version).collect(),
                candidates: candidates.packed(index, axis, &kept),
            }
        };
        RecordContents {
            file: record.file.clone(),
            role: record.role.name(),
            rows: all,
            kept: kept.len(),
            time: samples::packed(&first[0].at, &kept),
            axes: (0..axes).map(sample_axis).collect(),
        }
    };
    (0..study.records.len()).into_par_iter().map(one).collect()
}

fn sample_version(
    history: &AxisHistory,
    residual: &[f64],
    figures: Option<&AxisFigures>,
    kept: &[usize],
) -> SampleVersion {
    let figure = |of: fn(&AxisFigures) -> f64| figures.map_or(0.0, of);
    let nmse_percent = figure(|f| f.nmse_percent);
    SampleVersion {
        measured: samples::packed(&history.measured, kept),
        residual: samples::packed(residual, kept),
        nmse_percent,
        fit_percent: 100.0 * (1.0 - (0.01 * nmse_percent).sqrt()),
        relative_error: figure(|f| f.relative_error),
        peak_error: figure(|f| f.peak_error),
        outside_range: figure(|f| f.outside_range),
    }
}

/// The places of every version, those left out that are everywhere.
fn regions(study: &Study, versions: &[Version<'_>]) -> Vec<Region> {
    let region = |version: usize, place: &FailingRegion| {
        let axis = study.axes.iter().position(|a| a.name == place.axis)?;
        let mut region = Region {
            axis,
            version,
            kind: place.kind,
            words: place.region.clone(),
            share_of_error: place.share_of_error,
            share_of_rows: place.share_of_rows,
            conditions: Vec::new(),
            stretch: None,
            band_hz: None,
        };
        match &place.extent {
            Extent::Everywhere => return None,
            Extent::States(conditions) => {
                region.conditions.clone_from(conditions);
            }
            Extent::Time { file, from_s, to_s } => {
                // A log that was split at gaps is several records of one name.
                let begins = |r: &Record| r.first_row as f64 / study.sample_rate_hz;
                let mut records = study.records.iter();
                let record = records.rposition(|r| &r.file == file && begins(r) <= *from_s)?;
                let begins_s = begins(&study.records[record]);
                region.stretch = Some((record, from_s - begins_s, to_s - begins_s));
            }
            Extent::Frequency(band) => region.band_hz = Some(*band),
        }
        Some(region)
    };
    let all = versions.iter().enumerate();
    all.flat_map(|(index, version)| {
        let places = version.comparison.places.iter();
        places.filter_map(move |place| region(index, place))
    })
    .collect()
}
