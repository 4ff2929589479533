//! The page `docs/notebook/paper.md`: its text, with every number formatted from the results.

use super::measured::{MeasuredJoint, SOURCES, Source};
use super::polynomials::Denominator;
use super::ratios::{
    Band, PAPERS_ERROR_RATIO, PAPERS_TIME_RATIO, SeedRun, Share, error_ratio, rms_error_ratio,
    time_ratio,
};
use super::results::{PaperOptions, Results};
use super::simulated::BothOnlyRun;
use super::spread::Spread;
use crate::model::file::AxisError;
use crate::simulate::{ENCODER_STEP, SimulationOptions};
use crate::text::table::rounded;

/// The axes of the simulated rig, as the text writes them.
const AXES: [&str; 2] = ["x", "φ"];

/// The whole page as Markdown.
pub(super) fn page(results: &Results) -> String {
    let mut text = introduction(results);
    text += &figures_of_the_simulation(results);
    text += &ratios(results);
    text += &both_only(results);
    text += "\n## Measured joints, in place of Figs. 14 to 18\n\n\
             The records of the paper's test rig are not public. Those of the two joints below are. `jointwatch identify` and \
             `jointwatch compare` with the study named give the same numbers.\n";
    for (source, joint) in SOURCES.iter().zip(&results.measured) {
        text += &measured(source, joint);
    }
    text += DIFFERENCES;
    text
}

fn introduction(results: &Results) -> String {
    format!(
        "# The paper, reproduced\n\n\
         Tasbihgoo, Caffrey and Masri identified the restoring force of a two-axis joint with a polynomial and with a network \
         (Int. J. Non-Linear Mechanics 42 (2007) 99–117). They tested both on records that were not used in training. This page \
         repeats that work with Jointwatch. One command writes the page, its figures and all its numbers:\n\n\
         ```\n{}\n```\n\n\
         `--json FILE` writes the numbers alone. In the figures, grey is simulated or measured; dash-dot is the model. As in the \
         paper, *verification* means on the training records and *validation* means on other records.\n",
        command(results)
    )
}

fn command(results: &Results) -> String {
    let mut command = "jointwatch paper --out docs/notebook".to_owned();
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
        "\n## The simulated rig\n\n\
         The rig has the four bodies of the paper's Section 3. The paper gives no parameter values, so they are ours \
         ([the simulated rig](simulated-rig.md)). Both axes have clearance, a coupling connects them, and the \
         drives are random, {low} to {high} Hz. There are three training records of {duration} s at {rate} Hz, {rows} rows in \
         all: x driven alone, φ driven alone, both driven. The validation record has both axes driven at {level} of that level, \
         with another seed. The figures show seed 1 with noise-free sensors, as in the paper.\n\n\
         ![Restoring force over displacement and velocity in the three training records](paper/fig06-training.svg)\n\n\
         **Fig. 6, training.** Inside the clearance, in the middle of (a) and (b), only the weak spring and the dampers act. \
         Outside it, the contact acts too. With both axes driven (c), displacement and velocity of one axis do not determine its \
         force, because the coupling depends on the other axis. That is why the models have four inputs.\n\n\
         ## The polynomial: Figs. 7 and 8\n\n\
         256 terms per axis, plain least squares, as in the paper's Section 3.2.1. Verification NMSE: {pv}. Validation NMSE: \
         {pw}.\n\n\
         ![Polynomial against a training record](paper/fig07-polynomial-verification.svg)\n\n\
         **Fig. 7, polynomial, verification**, on the record with both axes driven.\n\n\
         ![Polynomial against the validation record](paper/fig08-polynomial-validation.svg)\n\n\
         **Fig. 8, polynomial, validation.** The excursions in (c) and (d) are extrapolation. The record visits states that \
         training visited rarely, and there the products of high powers are not constrained by data.\n\n\
         ## The network: Figs. 9 and 10\n\n\
         Forty tanh neurons as in the paper's Section 3.2.2, trained as in its Section 2.4.2: Levenberg–Marquardt with Bayesian \
         regularisation, in stages with more and more rows, {restarts}. Verification NMSE: {nv}. Validation NMSE: {nw}.\n\n\
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
        format!("{name} {} %", rounded(e.nmse_percent))
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
         The paper states two ratios. The network's percentage error on validation was about {PAPERS_ERROR_RATIO} times lower than \
         the polynomial's, and its training took about {PAPERS_TIME_RATIO} times longer. Neither is a constant: both depend on the \
         joint, on the length of the records and on how the polynomial is fitted. The tables therefore compare three fits:\n\n\
         - **plain least squares** on all terms, as in the paper,\n\
         - **ridge**, all terms with a penalty, the default of Jointwatch,\n\
         - **selected terms**, a few of them.\n\n\
         Errors are on the validation record. *Whole band* has no low-pass, as in the paper. *Common band* has both forces \
         low-passed alike, as in `jointwatch compare`. Figures are medians over the studies of {seeds}, with ranges in brackets. \
         Each ratio is taken within one study.\n\n\
         ### Validation error, polynomial over network\n\n\
         The paper does not define its percentage error. The first table is the ratio of NMSE, 100·Σ(r−r̂)²/(N·var r).\n\n\
         | denominator | noise-free, whole band: x | φ | noise-free, common band: x | φ | sensors of a rig, common band: x | φ |\n\
         |---|---|---|---|---|---|---|\n\
         | the paper, plain | about {PAPERS_ERROR_RATIO} | | | | | |\n"
    );
    text += &ratio_rows(results, error_ratio);
    text += &format!(
        "\nThe second table is the same for RMS errors, the square roots of the first.\n\n\
         | denominator | RMS, noise-free, whole band: x | φ | noise-free, common band: x | φ | sensors of a rig, common band: x | φ |\n\
         |---|---|---|---|---|---|---|\n\
         | the paper, plain | about {PAPERS_ERROR_RATIO} | | | | | |\n"
    );
    text += &ratio_rows(results, rms_error_ratio);
    text += &format!(
        "\nThe sensors of a rig have noise {} dB below the signals and encoders with counts of {} µm and {} µrad. To repeat one such \
         study, run `jointwatch simulate --out rig --seed 1` and `jointwatch identify rig --model polynomial` or `network`. The \
         polynomials then have the same errors. The network's errors are close but not equal: the logs have nine digits, and a \
         training that starts from differently rounded numbers ends in another minimum.\n\n\
         NMSE on the validation record in percent, noise-free, whole band:\n\n{}\n\
         With the sensors of a rig, common band:\n\n{}\n\
         ### Training time, network over polynomial\n\n\
         CPU seconds of one thread on both sides, on noise-free studies.\n\n\
         | denominator | one training | {} | one training, up to a {PAPERS_ERROR_RATIO}th of the plain polynomial's error on both axes |\n\
         |---|---|---|---|\n\
         | the paper, plain | about {PAPERS_TIME_RATIO} | | |\n",
        rounded(SimulationOptions::default().snr_db.unwrap_or(f64::INFINITY)),
        rounded(1e6 * ENCODER_STEP[0]),
        rounded(1e6 * ENCODER_STEP[1]),
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

/// What one fit's error is over the network's, from seed to seed.
type Ratio = fn(&[SeedRun], Denominator, usize, Band) -> Option<Spread>;

/// The rows of a table of error ratios.
fn ratio_rows(results: &Results, ratio: Ratio) -> String {
    let columns = [
        (&results.perfect, Band::Whole),
        (&results.perfect, Band::Common),
        (&results.rig, Band::Common),
    ];
    let row = |fit: Denominator| {
        let cells = columns
            .iter()
            .flat_map(|(runs, band)| [0, 1].map(|axis| cell(ratio(runs, fit, axis, *band))));
        let cells: Vec<String> = cells.collect();
        format!("| {} | {} |\n", fit.words(), cells.join(" | "))
    };
    Denominator::ALL.map(row).concat()
}

/// The claim of the paper's Section 6 on the third training record.
fn both_only(results: &Results) -> String {
    let runs = &results.both_only;
    let spread = |of: &dyn Fn(&BothOnlyRun) -> f64| cell(Spread::of(runs.iter().map(of)));
    let three = |of: &dyn Fn(&SeedRun) -> f64| cell(Spread::of(results.perfect.iter().map(of)));
    let mut text = String::from(
        "\n## One record with both axes driven\n\n\
         The paper's Section 6 says that models identified from the record with both axes driven alone (Fig. 6 (c)) would have failed in \
         the generalisation tests, for lack of information about the coupling. Here they do not. Validation NMSE in percent, \
         noise-free, whole band, median and range over the seeds:\n\n\
         | model | three records: x | φ | that record alone: x | φ |\n|---|---|---|---|---|\n",
    );
    for (index, fit) in Denominator::ALL.into_iter().enumerate() {
        let cells =
            [0, 1].map(|a| three(&|r| r.polynomials[index].validation_nmse_percent.whole[a]));
        let alone = [0, 1].map(|a| spread(&|r| r.polynomials[index].whole[a]));
        text += &format!(
            "| {} | {} | {} |\n",
            fit.words(),
            cells.join(" | "),
            alone.join(" | ")
        );
    }
    let cells = [0, 1].map(|a| three(&|r| r.network.validation_nmse_percent.whole[a]));
    let alone = [0, 1].map(|a| spread(&|r| r.network.whole[a]));
    text += &format!(
        "| network | {} | {} |\n",
        cells.join(" | "),
        alone.join(" | ")
    );
    text + BOTH_ONLY
}

/// How the table of [`both_only`] is to be read; it holds whatever the numbers are.
const BOTH_ONLY: &str = "\n\
The two drives are independent and broadband, so this one record visits the four-dimensional state space as the validation record does. \
It holds the coupling in full, because the coupling acts only when both axes move. In the other two records one axis rests, so their \
states lie in a plane. What is lost without them is rows: 10,000 are left of 30,000. Correlated drives, or a record too short to fill the \
state space, could make the claim true.\n";

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
            .flat_map(|errors| errors.within(band).iter().map(|nmse| rounded(*nmse)))
            .collect();
        text += &format!("| {} | {} |\n", run.seed, cells.join(" | "));
    }
    text
}

fn seconds(runs: &[SeedRun]) -> String {
    let polynomial = |index: usize| {
        let costs = runs.iter().filter_map(|r| r.polynomials.get(index));
        Spread::of(costs.map(|p| 1e3 * p.cpu_s)).map_or(String::new(), |s| rounded(s.median))
    };
    let network = Spread::of(runs.iter().map(|r| r.network.cpu_s));
    let reached = runs
        .iter()
        .filter(|r| r.network.cpu_s_to_sixteenth.is_some());
    format!(
        "\nThe last column counts the {} of {} studies that reached that error. The time of plain least squares is that from rows to \
         coefficients. Ridge and selected terms include the cross-validation that chooses their weight or number. The medians on \
         the machine that wrote this page were {} ms, {} ms and {} ms, against {} s for one training. Ratios carry over to other \
         machines approximately; seconds do not.\n\n\
         Plain least squares here uses sums over products of powers. It is tens of times faster than a general least-squares solver \
         ([fits](../explanation/fits.md)), and the ratio is larger by that factor.\n",
        reached.count(),
        runs.len(),
        polynomial(0),
        polynomial(1),
        polynomial(2),
        network.map_or(String::new(), |s| rounded(s.median)),
    )
}

fn measured(source: &Source, joint: &MeasuredJoint) -> String {
    let mut text = format!("\n### {}\n\n{}\n\n", source.name, source.what);
    if let Some(reason) = &joint.left_out {
        text += &format!("**Left out**: {reason}.\n");
        return text;
    }
    let mut study = format!(
        "The study is [{3}]({0}); its logs are {1} and {2}.",
        source.study_page,
        source.logs[0],
        source.logs[1],
        source.study_page.trim_start_matches("../")
    );
    if let Some(inertia) = joint.inertia {
        study += &format!(" Identified mass: {inertia:.2} kg.");
    }
    text += &format!(
        "{study} Of the validation rows, {} % lie outside the training range.\n\n\
         | fit | verification, NMSE | validation, NMSE |\n|---|---|---|\n",
        rounded(100.0 * joint.outside_range)
    );
    for fit in &joint.fits {
        let percent = |of: &[AxisError]| {
            let first = of.first().map(|e| rounded(e.nmse_percent));
            first.map_or(String::new(), |nmse| format!("{nmse} %"))
        };
        let (verification, validation) = (percent(&fit.verification), percent(&fit.validation));
        text += &format!("| {} | {verification} | {validation} |\n", fit.fit);
    }
    text += &trainings_of(joint);
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

/// The validation errors of all trainings of a measured joint's network, of which one was kept.
fn trainings_of(joint: &MeasuredJoint) -> String {
    if joint.trainings.len() < 2 {
        return String::new();
    }
    let each = joint.trainings.iter().map(|nmse| rounded(*nmse));
    format!(
        "\nValidation NMSE of the {} trainings of the network: {} %. Training {} was kept, for its evidence on the training record.\n",
        joint.trainings.len(),
        each.collect::<Vec<_>>().join(", "),
        joint.kept + 1
    )
}

/// What is not as in the paper; it holds whatever the numbers are.
const DIFFERENCES: &str = "\n## Differences from the paper\n\n\
- **Axes and orders.** At most two axes, and exponents up to 3 of each state. The paper's formulation has no such limits.\n\
- **Parameters of the rig.** The paper refers to another source for them. Ours are chosen, with the contact stiffness and the coupling \
among them. The error ratio depends on both.\n\
- **Eq. (16).** The printed equation has lost the dots over its velocities. We read the coupling as a friction force that depends on \
velocity and position and acts when both axes move ([the simulated rig](simulated-rig.md)).\n\
- **Least squares.** The paper calls its solver non-linear. The polynomial is linear in its coefficients, so one linear solution is the \
minimum.\n\
- **Unknown mass.** The paper adds the acceleration to the inputs of a network. Here the inertia is identified first, by a linear fit \
beside a polynomial, and the network learns what is left of the applied force.\n\
- **Training.** Levenberg–Marquardt moves the hidden layer only. The output layer is solved exactly at each step, and the precisions of \
weights and noise follow from the evidence.\n\
- **Tolerance of a stage.** The paper halves a target for the error from stage to stage. Here a stage's tolerance is the relative gain per \
step below which the stage ends, also halved from stage to stage.\n\
- **Restarts.** The paper compares the weights of about five trainings. Neurons can be permuted without changing a network, so \
`jointwatch identify --model network` compares predictions instead. The training with the highest evidence is kept; validation records \
decide nothing.\n\
- **States and band.** Velocities are derived from displacements, as on a rig. Measured and predicted force are low-passed alike before \
they are compared.\n\
- **Normalisation.** Inputs are scaled to ±1 about the middle of their range instead of their mean.\n\
- **Figures.** Figs. 7 and 9 of the paper are phase plots only; here they have time histories too. Time histories show about twenty \
cycles from the middle of the record. Figs. 6 and 14 also show the force over velocity.\n\
- **Measured joints.** Ours have one axis each. Their figures show phase plots over displacement and over velocity instead of those of two \
axes.\n";
