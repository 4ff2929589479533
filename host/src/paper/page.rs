//! The page `docs/paper.md`: its text, with every number formatted from the results.

use super::measured::{MeasuredJoint, SOURCES, Source};
use super::polynomials::Denominator;
use super::ratios::{
    Band, PAPERS_ERROR_RATIO, PAPERS_TIME_RATIO, SeedRun, Share, error_ratio, time_ratio,
};
use super::spread::Spread;
use super::{PaperOptions, Results};
use crate::assess::where_it_fails::significant;
use crate::model::file::AxisError;
use crate::simulate::{ENCODER_STEP, SimulationOptions};

/// The axes of the simulated rig, as the text writes them.
const AXES: [&str; 2] = ["x", "φ"];

/// The whole page.
pub(super) fn page(results: &Results) -> String {
    let mut text = introduction(results);
    text += &figures_of_the_simulation(results);
    text += &ratios(results);
    text += "\n## Measured joints, in place of Figs. 14 to 18\n\n\
             The paper's test rig and its records are not public. These two joints are; `jointwatch identify` and \
             `jointwatch compare` on the named study give the same numbers.\n";
    for (source, joint) in SOURCES.iter().zip(&results.measured) {
        text += &measured(source, joint);
    }
    text += DIFFERENCES;
    text
}

fn introduction(results: &Results) -> String {
    format!(
        "# The paper, reproduced\n\n\
         Tasbihgoo, Caffrey and Masri learnt the restoring force of a joint with two axes by a polynomial and by a network, and held \
         both against records that they had not learnt from (Int. J. Non-Linear Mechanics 42 (2007) 99–117). This page does the same \
         with Jointwatch. The page, all figures and all numbers on it are written by\n\n\
         ```\n{}\n```\n\n\
         `--json FILE` gives the numbers alone. Grey is what was simulated or measured, dash-dot what the model says.\n",
        command(results)
    )
}

fn command(results: &Results) -> String {
    let mut command = "jointwatch paper --out docs".to_owned();
    let usual = PaperOptions::default();
    let seeds = results.perfect.len();
    if seeds as u64 != usual.seeds {
        command += &format!(" --seeds {seeds}");
    }
    if results.restarts != usual.restarts {
        command += &format!(" --restarts {}", results.restarts);
    }
    command
}

fn figures_of_the_simulation(results: &Results) -> String {
    let usual = SimulationOptions::default();
    let [low, high] = usual.band_hz;
    let [polynomial, network] = &results.drawn;
    format!(
        "\n## What was simulated\n\n\
         The four-body rig of the paper's Section 3 with our parameters, since the paper gives none \
         ([simulated-rig.md](simulated-rig.md)). Clearance on both axes, a coupling between them, random drives from {low} to {high} Hz. \
         Three records of {duration} s at {rate} Hz to learn from, {rows} rows in all: x driven alone, φ driven alone, both driven. A \
         fourth to validate on: both driven at {level} of that level, from another seed. For the figures the sensors are perfect, \
         as in the paper; seed 1.\n\n\
         ![Restoring force over displacement and velocity in the three training records](paper/fig06-training.svg)\n\n\
         **Fig. 6, training.** In the clearance, the middle of (a) and (b) over displacement, only the weak spring and the dampers act; \
         outside, the contact as well. With both axes driven (c) the displacement and velocity of one axis no longer settle its force: the \
         coupling adds what the other axis does, which is why the models have four inputs.\n\n\
         ## The polynomial: Figs. 7 and 8\n\n\
         256 terms per axis, plain least squares, as in the paper's Section 3.2.1. Verification (the training records): {pv}. \
         Validation (the fourth record): {pw}.\n\n\
         ![Polynomial against a training record](paper/fig07-polynomial-verification.svg)\n\n\
         **Fig. 7, polynomial, verification**, on the record with both axes driven.\n\n\
         ![Polynomial against the validation record](paper/fig08-polynomial-validation.svg)\n\n\
         **Fig. 8, polynomial, validation.** Where the record visits states that training visited rarely, products of high powers make \
         forces that nobody measured: the excursions in (c) and (d).\n\n\
         ## The network: Figs. 9 and 10\n\n\
         Forty tanh neurons as in the paper's Section 3.2.2, trained as in its Section 2.4.2: Levenberg–Marquardt with Bayesian \
         regularisation, in stages with ever more rows, {restarts}. Verification: {nv}. Validation: {nw}.\n\n\
         ![Network against a training record](paper/fig09-network-verification.svg)\n\n\
         **Fig. 9, network, verification**, on the record with both axes driven.\n\n\
         ![Network against the validation record](paper/fig10-network-validation.svg)\n\n\
         **Fig. 10, network, validation.**\n",
        duration = usual.duration_s,
        rate = usual.sample_rate_hz,
        rows = 3.0 * usual.duration_s * usual.sample_rate_hz,
        level = usual.validation_level,
        pv = errors(&polynomial.verification),
        pw = errors(&polynomial.validation),
        nv = errors(&network.verification),
        nw = errors(&network.validation),
        restarts = trainings(results.restarts),
    )
}

fn trainings(restarts: usize) -> String {
    match restarts {
        1 => "one training".into(),
        count => format!("the best of {count} trainings by the evidence of the training records"),
    }
}

/// `x 1.52 %, φ 1.15 %`
fn errors(of: &[AxisError]) -> String {
    let axis = |e: &AxisError| {
        let name = if e.axis == "phi" { "φ" } else { &e.axis };
        format!("{name} {} %", significant(e.nmse_percent))
    };
    of.iter().map(axis).collect::<Vec<_>>().join(", ")
}

fn ratios(results: &Results) -> String {
    let runs = &results.perfect;
    let count = runs.len();
    let seeds = if count == 1 {
        "seed 1".into()
    } else {
        format!("seeds 1 to {count}")
    };
    let mut text = format!(
        "\n## The two ratios\n\n\
         The paper says that the network's percentage error on validation was about {PAPERS_ERROR_RATIO} times lower than the \
         polynomial's, and that its training took about {PAPERS_TIME_RATIO} times longer. Neither is a constant of nature: both \
         depend on the joint, on how much was recorded, and on which fit of the polynomial they are taken against. Hence three \
         fits: **plain least squares** on all terms (the paper's), **ridge** (all terms, penalised; Jointwatch's default), and \
         **selected terms** (a few of them). The error is 100·Σ(r−r̂)²/(N·var r) on the validation record: over the whole band, which for noise-free data \
         is the paper's way, and in the common band, with both forces low-passed alike, as `jointwatch compare` has it. The paper does not say \
         which percentage error it means; of RMS errors the ratio would be the square root of that of NMSE. Figures are \
         medians over the studies of {seeds}, ranges in brackets; each ratio is taken within one study.\n\n\
         ### Validation error, polynomial over network\n\n\
         | denominator | noise-free, whole band: x | φ | noise-free, common band: x | φ | sensors of a rig, common band: x | φ |\n\
         |---|---|---|---|---|---|---|\n\
         | the paper, plain | about {PAPERS_ERROR_RATIO} | | | | | |\n"
    );
    for fit in Denominator::ALL {
        let columns = [
            (runs, Band::Whole),
            (runs, Band::Common),
            (&results.rig, Band::Common),
        ];
        let cells = columns
            .into_iter()
            .flat_map(|(runs, band)| [0, 1].map(|axis| cell(error_ratio(runs, fit, axis, band))));
        let cells: Vec<String> = cells.collect();
        text += &format!("| {} | {} |\n", fit.words(), cells.join(" | "));
    }
    text += &format!(
        "\nThe sensors of a rig are noise {} dB below the signals and encoders in counts of {} µm and {} µrad. One such study by itself: \
         `jointwatch simulate --out rig --seed 1`, then `jointwatch identify rig --model polynomial` or `network`. The polynomials' figures \
         come out the same; the network's by and large, because the logs have nine digits and a training that starts from numbers rounded \
         differently ends in another minimum, as another restart does.\n\n\
         NMSE on the validation record in percent, noise-free, whole band:\n\n{}\n\
         With the sensors of a rig, common band:\n\n{}\n\
         ### Training time, network over polynomial\n\n\
         CPU seconds on both sides, one thread, so that neither the number of cores nor what else the machine does counts; noise-free \
         studies.\n\n\
         | denominator | one training | {} | one training, up to a {PAPERS_ERROR_RATIO}th of the plain polynomial's error on both axes |\n\
         |---|---|---|---|\n\
         | the paper, plain | about {PAPERS_TIME_RATIO} | | |\n",
        significant(SimulationOptions::default().snr_db.unwrap_or(f64::INFINITY)),
        significant(1e6 * ENCODER_STEP[0]),
        significant(1e6 * ENCODER_STEP[1]),
        per_seed(runs, Band::Whole),
        per_seed(&results.rig, Band::Common),
        match results.restarts {
            1 => "all trainings (one)".into(),
            n => format!("all {n} trainings"),
        },
    );
    for fit in Denominator::ALL {
        let cells = [Share::One, Share::All, Share::ToSixteenth]
            .map(|share| cell(time_ratio(runs, fit, share)));
        text += &format!("| {} | {} |\n", fit.words(), cells.join(" | "));
    }
    text += &seconds(runs);
    text
}

fn cell(spread: Option<Spread>) -> String {
    spread.map_or("never".into(), |s| s.to_string())
}

fn per_seed(runs: &[SeedRun], band: Band) -> String {
    let mut text = String::from("| seed |");
    let columns = Denominator::ALL.map(Denominator::words);
    for column in columns.into_iter().chain(["network"]) {
        text += &format!(" {column}: {} | {} |", AXES[0], AXES[1]);
    }
    text += &format!("\n|{}\n", "---|".repeat(9));
    for run in runs {
        let polynomials = run.polynomials.iter().map(|p| &p.validation_nmse_percent);
        let all = polynomials.chain([&run.network.validation_nmse_percent]);
        let cells: Vec<String> = all
            .flat_map(|errors| errors.within(band).iter().map(|nmse| significant(*nmse)))
            .collect();
        text += &format!("| {} | {} |\n", run.seed, cells.join(" | "));
    }
    text
}

fn seconds(runs: &[SeedRun]) -> String {
    let polynomial = |index: usize| {
        let costs = runs.iter().filter_map(|r| r.polynomials.get(index));
        Spread::of(costs.map(|p| 1e3 * p.cpu_s)).map_or(String::new(), |s| significant(s.median))
    };
    let network = Spread::of(runs.iter().map(|r| r.network.cpu_s));
    let reached = runs
        .iter()
        .filter(|r| r.network.cpu_s_to_sixteenth.is_some());
    format!(
        "\nThe last column counts the {} of {} studies in which the error came down that far. Plain least squares is timed from rows to \
         coefficients and nothing else; ridge and selected terms with the cross-validation that chooses their weight or number. On the \
         machine that wrote this page, in the median, {} ms, {} ms and {} ms stood against {} s for one training: the ratios \
         travel to other machines, more or less, the seconds do not.\n\n\
         Plain least squares here comes from sums over products of powers, tens of times faster than a general least-squares solver \
         ([fits.md](fits.md)); that makes the ratio larger than it would be against such a solver.\n",
        reached.count(),
        runs.len(),
        polynomial(0),
        polynomial(1),
        polynomial(2),
        network.map_or(String::new(), |s| significant(s.median)),
    )
}

fn measured(source: &Source, joint: &MeasuredJoint) -> String {
    let mut text = format!("\n### {}\n\n{}\n\n", source.name, source.what);
    if let Some(reason) = &joint.left_out {
        text += &format!("**Left out**: {reason}.\n");
        return text;
    }
    let mut study = format!(
        "The study is [{0}]({0}), beside {1} and {2}.",
        source.study_page, source.logs[0], source.logs[1]
    );
    if let Some(inertia) = joint.inertia {
        study += &format!(" Identified mass: {inertia:.2} kg.");
    }
    text += &format!(
        "{study} Of the validation rows, {} % lie outside the training range.\n\n\
         | fit | verification, NMSE | validation, NMSE |\n|---|---|---|\n",
        significant(100.0 * joint.outside_range)
    );
    for fit in &joint.fits {
        let percent = |of: &[AxisError]| {
            let first = of.first().map(|e| significant(e.nmse_percent));
            first.map_or(String::new(), |nmse| format!("{nmse} %"))
        };
        let (verification, validation) = (percent(&fit.verification), percent(&fit.validation));
        text += &format!("| {} | {verification} | {validation} |\n", fit.fit);
    }
    let figure = |number: u8, file: &str, caption: &str| {
        format!(
            "\n![{caption}](paper/fig{number}-{}-{file}.svg)\n\n**In place of Fig. {number}**: {caption}.\n",
            source.folder
        )
    };
    text += &figure(14, "training", "the training record");
    text += &figure(
        15,
        "polynomial-verification",
        "polynomial (plain least squares), verification",
    );
    text += &figure(
        16,
        "polynomial-validation",
        "polynomial (plain least squares), validation",
    );
    text += &figure(17, "network-verification", "network, verification");
    text += &figure(18, "network-validation", "network, validation");
    text += &format!("\n{}\n", source.reading);
    text
}

/// What is not as in the paper; it holds whatever the numbers are.
const DIFFERENCES: &str = "\n## Where this differs from the paper, and why\n\n\
- **Parameters of the rig.** The paper refers to another source for them. Ours are chosen, and with them how hard the contact is and how \
strong the coupling; the error ratio depends on that.\n\
- **Eq. (16).** The print has lost the dots over its velocities. We read the coupling as a friction that depends on velocity and \
position and acts when both axes move; [simulated-rig.md](simulated-rig.md) says why.\n\
- **Least squares.** The paper calls its solver non-linear; the polynomial is linear in its coefficients, and one linear solution is \
the minimum.\n\
- **Training.** Levenberg–Marquardt moves the hidden layer only, the output layer is solved for exactly at each step; the precisions of \
weights and noise follow from the evidence.\n\
- **Restarts.** The paper looks whether the weights of about five trainings agree. Neurons can be permuted without changing the network, so \
`jointwatch identify --model network` compares the predictions instead, and the training with the highest evidence is kept; validation \
records decide nothing.\n\
- **States and band.** Velocities are derived from displacements, as a rig has to, and measured and predicted force are low-passed alike \
before they are compared. The polynomial's and the network's errors are figures of the same band.\n\
- **Normalisation.** Inputs are brought to ±1 about the middle of their range instead of their mean.\n\
- **Figures.** Figs. 7 and 9 show phase plots only in the paper; here they have time histories too, as its Figs. 15 and 16. Time \
histories show about twenty swings from the middle of the record. In Fig. 6 and Fig. 14 the force stands over velocity as well.\n\
- **Measured joints.** Ours have one axis each, so their figures show phase plots over displacement and over velocity instead of those \
of two axes.\n";
