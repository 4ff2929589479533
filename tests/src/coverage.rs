//! Fits of a physical model to simulated rigs whose parameters are known: how far off, and how
//! often inside the interval.

use jointwatch::fit::identify;
use jointwatch::simulate::{RigParameters, SimulationOptions, simulate};
use rayon::prelude::*;
use std::fmt::Write;
use std::ops::Range;

/// One parameter over all rigs.
#[derive(Clone, Debug, Default)]
pub struct ParameterCoverage {
    /// The parameter as `effect@axis parameter`.
    pub name: String,
    /// Rigs in which the interval held the true value.
    pub covered: usize,
    /// Rigs that were simulated and fitted.
    pub fits: usize,
    /// Largest |value/truth − 1|.
    pub worst: f64,
    /// Mean of value/truth − 1.
    pub bias: f64,
    /// Mean half width of the interval beside the truth.
    pub half_width: f64,
}

/// What a campaign found.
#[derive(Clone, Debug, Default)]
pub struct Coverage {
    /// In the order of the study's base terms, parameters that are tied to another one left out.
    pub parameters: Vec<ParameterCoverage>,
    /// Seeds whose rig is unstable and cannot be simulated.
    pub unstable: usize,
}

/// The joint's true values in the order of the study's base terms.
fn truth(rig: &RigParameters) -> Vec<f64> {
    let joint = &rig.joint;
    let [k0x, k0phi] = joint.coupling;
    let arm = joint.lever_arm_m;
    let axis = |i: usize| {
        [
            joint.stiffness[i],
            joint.damping[i],
            joint.contact_stiffness[i],
            joint.clearance[i],
        ]
    };
    let coupling = [k0x, k0phi, arm * k0x, arm * k0phi];
    [axis(0), axis(1), coupling].concat()
}

impl Coverage {
    /// Simulates the rigs of these seeds (all parameters drawn anew; seed 0 is the default rig),
    /// learns a physical model from each with the right base terms, and holds it against the
    /// truth.
    ///
    /// # Errors
    /// The sentence of a fit that failed, or a parameter without interval.
    pub fn of(seeds: Range<u64>, snr_db: Option<f64>) -> Result<Self, String> {
        let fitted: Result<Vec<_>, String> = seeds
            .into_par_iter()
            .map(|seed| fit(seed, snr_db))
            .collect();
        let mut coverage = Self::default();
        for fit in fitted? {
            let Some(fit) = fit else {
                coverage.unstable += 1;
                continue;
            };
            coverage
                .parameters
                .resize(fit.len(), ParameterCoverage::default());
            for (sum, (name, truth, value, [low, high])) in coverage.parameters.iter_mut().zip(fit)
            {
                sum.name = name;
                sum.fits += 1;
                sum.covered += usize::from(low <= truth && truth <= high);
                let off = value / truth - 1.0;
                sum.worst = sum.worst.max(off.abs());
                sum.bias += off;
                sum.half_width += 0.5 * (high - low) / truth;
            }
        }
        for sum in &mut coverage.parameters {
            sum.bias /= sum.fits as f64;
            sum.half_width /= sum.fits as f64;
        }
        Ok(coverage)
    }

    /// The part of all intervals that held the truth.
    pub fn share(&self) -> f64 {
        let covered: usize = self.parameters.iter().map(|p| p.covered).sum();
        let fits: usize = self.parameters.iter().map(|p| p.fits).sum();
        covered as f64 / fits.max(1) as f64
    }
}

type Found = (String, f64, f64, [f64; 2]);

/// Nothing when the rig of this seed is unstable.
fn fit(seed: u64, snr_db: Option<f64>) -> Result<Option<Vec<Found>>, String> {
    let rig = if seed == 0 {
        RigParameters::default()
    } else {
        RigParameters::draw(seed)
    };
    let options = SimulationOptions {
        rig,
        snr_db,
        seed,
        ..SimulationOptions::default()
    };
    let Ok(simulation) = simulate(&options) else {
        return Ok(None);
    };
    let model = identify::physical(&simulation.study)
        .map_err(|e| format!("seed {seed}: {e}"))?
        .model;
    let mut found = Vec::new();
    let parameters = model
        .effects
        .iter()
        .flat_map(|effect| effect.parameters.iter().map(move |p| (effect.name(), p)));
    for ((effect, parameter), truth) in parameters.zip(truth(&rig)) {
        let name = format!("{effect} {}", parameter.name);
        let interval = parameter
            .interval
            .ok_or(format!("seed {seed}: {name} has no interval"))?;
        found.push((name, truth, parameter.value, interval));
    }
    Ok(Some(found))
}

/// The campaign as a table.
pub fn report(coverage: &Coverage) -> String {
    let mut text = String::new();
    let _ = writeln!(
        text,
        "{:40} {:>9} {:>12} {:>10} {:>14}",
        "parameter", "covered", "worst error", "mean error", "half interval"
    );
    for p in &coverage.parameters {
        let _ = writeln!(
            text,
            "{:40} {:>4}/{:<4} {:>10.3} % {:>8.4} % {:>12.4} %",
            p.name,
            p.covered,
            p.fits,
            100.0 * p.worst,
            100.0 * p.bias,
            100.0 * p.half_width
        );
    }
    let _ = write!(
        text,
        "all: {:.1} % of the 95 % intervals hold the truth; {} rigs are unstable and left out",
        100.0 * coverage.share(),
        coverage.unstable
    );
    text
}
