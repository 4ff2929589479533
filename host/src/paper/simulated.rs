//! The paper's Section 3 on the simulated rig: its studies, the models learnt from them, and Figs.
//! 6 to 10.

use super::figures::{training, verification_and_validation};
use super::network;
use super::polynomials::Denominator;
use super::ratios::{Errors, PolynomialRun, SeedRun};
use crate::fit::identify::Prepared;
use crate::model::file::{AxisError, ModelFile};
use crate::report::Drawing;
use crate::simulate::{SimulationOptions, simulate};
use crate::study::Study;
use crate::text::error::Result;
use serde::Serialize;

/// Through which sensors the simulated joint is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Sensors {
    /// Without noise and without counts: the paper's synthetic data.
    Perfect,
    /// As `jointwatch simulate` logs them: noise 60 dB below the signals, encoders in whole counts.
    Rig,
}

impl Sensors {
    fn study(self, seed: u64) -> Result<Study> {
        let logged = SimulationOptions {
            seed,
            ..SimulationOptions::default()
        };
        let options = match self {
            Self::Rig => logged,
            Self::Perfect => SimulationOptions {
                snr_db: None,
                quantised: false,
                ..logged
            },
        };
        Ok(simulate(&options)?.study)
    }
}

/// The models that are drawn, and the study they were learnt from.
pub(super) struct FittedModels {
    study: Study,
    plain: ModelFile,
    network: ModelFile,
}

/// Learns every model from one seed's study.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when a model cannot be learnt.
pub(super) fn learn(
    sensors: Sensors,
    seed: u64,
    restarts: usize,
) -> Result<(SeedRun, FittedModels)> {
    let study = sensors.study(seed)?;
    let prepared = Prepared::new(&study)?;
    let mut models = Vec::new();
    let mut polynomials = Vec::new();
    for fit in Denominator::ALL {
        let model = fit.identify(&study)?;
        polynomials.push(PolynomialRun {
            fit,
            validation_nmse_percent: Errors::of(&model, &study)?,
            cpu_s: fit.cpu_seconds(&study, &prepared)?,
        });
        models.push(model);
    }
    let trained = network::train(&study, restarts)?;
    let run = SeedRun {
        seed,
        network: trained.run(&study, &polynomials[0].validation_nmse_percent.common)?,
        polynomials,
    };
    let learnt = FittedModels {
        study,
        plain: models.swap_remove(0),
        network: trained.model,
    };
    Ok((run, learnt))
}

/// What the record with both axes driven gives by itself, without the two records in which one axis
/// is driven alone.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BothOnlyRun {
    /// Seed of the drives.
    pub seed: u64,
    /// On the validation record, in the order of [`Denominator::ALL`].
    pub polynomials: Vec<Errors>,
    /// On the validation record, of the training that was kept.
    pub network: Errors,
}

/// Learns every model from the third training record alone, seen through perfect sensors: the claim
/// of the paper's Section 6 is that such a model fails on other records.
///
/// # Errors
/// [`crate::text::error::Kind::Data`] when a model cannot be learnt.
pub(super) fn learn_from_both_only(seed: u64, restarts: usize) -> Result<BothOnlyRun> {
    let mut study = Sensors::Perfect.study(seed)?;
    study.records.drain(..2);
    let polynomials = Denominator::ALL
        .iter()
        .map(|fit| Errors::of(&fit.identify(&study)?, &study))
        .collect::<Result<Vec<Errors>>>()?;
    Ok(BothOnlyRun {
        seed,
        polynomials,
        network: Errors::of(&network::train(&study, restarts)?.model, &study)?,
    })
}

/// Errors of a model that is drawn.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Drawn {
    /// Which model: `polynomial` or `network`.
    pub model: &'static str,
    /// On the three training records together.
    pub verification: Vec<AxisError>,
    /// On the validation record.
    pub validation: Vec<AxisError>,
}

impl FittedModels {
    /// Figs. 6 to 10.
    ///
    /// # Errors
    /// [`crate::text::error::Kind::Data`] when a model gives numbers that are not finite.
    pub(super) fn drawings(&self) -> Result<Vec<Drawing>> {
        let mut drawings = vec![training(&self.study, &self.plain, "fig06-training")?];
        for (model, names, learner) in [
            (
                &self.plain,
                [
                    "fig07-polynomial-verification",
                    "fig08-polynomial-validation",
                ],
                "polynomial",
            ),
            (
                &self.network,
                ["fig09-network-verification", "fig10-network-validation"],
                "network",
            ),
        ] {
            drawings.extend(verification_and_validation(
                &self.study,
                model,
                names,
                ["simulated", learner],
            )?);
        }
        Ok(drawings)
    }

    /// The errors that belong to the figures.
    pub(super) fn errors(&self) -> [Drawn; 2] {
        [("polynomial", &self.plain), ("network", &self.network)].map(|(model, of)| Drawn {
            model,
            verification: of.verification.clone(),
            validation: of.validation.clone(),
        })
    }
}
