//! Known truth must come back: planted coefficients, springs, dampers, masses and terms.

use super::*;
use crate::simulate::{Joint, RigParameters, SimulationOptions, simulate};
use crate::study::{AxisKind, Controller, Convention, Role};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn axis(name: &str, inertia: Option<f64>) -> Axis {
    Axis {
        name: name.into(),
        kind: AxisKind::Translation,
        inertia,
        restoring_force: Convention::ForceMinusInertia,
        ground_stiffness: 0.0,
        ground_damping: 0.0,
        controller: Controller::default(),
        encoder_step: None,
        velocity_alone: false,
        integrated_above_hz: None,
    }
}

fn options(method: Method) -> PolynomialOptions {
    PolynomialOptions {
        method,
        ..PolynomialOptions::default()
    }
}

/// Rows at random over the whole range, with the force of a given polynomial (no inertia).
fn planted(polynomial: &Polynomial, rows: usize, noise: f64, seed: u64) -> Motion {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let states: Vec<Vec<f64>> = polynomial
        .inputs
        .iter()
        .map(|range| {
            (0..rows)
                .map(|row| {
                    let u = if row < 2 {
                        2.0 * row as f64 - 1.0
                    } else {
                        rng.random_range(-1.0..1.0)
                    };
                    range.center + range.half_range * u
                })
                .collect()
        })
        .collect();
    let slices: Vec<&[f64]> = states.iter().map(Vec::as_slice).collect();
    let mut force = polynomial.predict(&slices).unwrap();
    for value in force.iter_mut().flatten() {
        *value += noise * rng.random_range(-1.0..1.0);
    }
    Motion {
        still: Vec::new(),
        before: Vec::new(),
        inputs: Vec::new(),
        record: 0,
        first_row: 0,
        sample_rate_hz: 1000.0,
        ground: vec![None; force.len()],
        acceleration: vec![vec![0.0; rows]; force.len()],
        states,
        force,
    }
}

fn random_polynomial(seed: u64) -> Polynomial {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let range = |center, half_range| InputRange { center, half_range };
    Polynomial {
        orders: vec![3; 4],
        inputs: vec![
            range(0.001, 0.01),
            range(0.0, 0.4),
            range(-0.02, 0.3),
            range(1.0, 9.0),
        ],
        coefficients: (0..2)
            .map(|_| (0..256).map(|_| rng.random_range(-5.0..5.0)).collect())
            .collect(),
    }
}

#[test]
fn all_256_planted_coefficients_come_back() {
    let truth = random_polynomial(51);
    let motion = planted(&truth, 20_000, 0.0, 52);
    let axes = [axis("x", Some(0.0)), axis("phi", Some(0.0))];
    let fit = fit_polynomial(
        &axes,
        &[&motion],
        &[],
        &options(Method::LeastSquares),
        &|_| (),
    )
    .unwrap();
    assert_eq!(fit.rank, 256);
    for (a, b) in fit.polynomial.inputs.iter().zip(&truth.inputs) {
        assert!((a.half_range / b.half_range - 1.0).abs() < 1e-12);
    }
    for (found, planted) in fit.polynomial.coefficients.iter().zip(&truth.coefficients) {
        for (a, b) in found.iter().zip(planted) {
            assert!((a - b).abs() < 1e-8 * 5.0, "{a} for {b}");
        }
    }
}

#[test]
fn the_default_fit_of_a_planted_polynomial_has_no_error_that_matters() {
    let truth = random_polynomial(53);
    let motion = planted(&truth, 20_000, 0.0, 54);
    let axes = [axis("x", Some(0.0)), axis("phi", Some(0.0))];
    let fit = fit_polynomial(&axes, &[&motion], &[], &options(Method::Ridge), &|_| ()).unwrap();
    for about in &fit.axes {
        println!("{about:?}");
        assert!(about.cross_validation_nmse < 1e-12);
        assert!((about.effective_parameters - 256.0).abs() < 0.01);
    }
}

#[test]
fn selection_finds_exactly_the_planted_terms() {
    let mut truth = random_polynomial(55);
    let terms = exponents(&truth.orders);
    let planted_terms = [
        [1, 0, 0, 0],
        [0, 1, 0, 0],
        [3, 0, 0, 0],
        [0, 1, 1, 0],
        [1, 0, 0, 3],
    ];
    for coefficients in &mut truth.coefficients {
        for (term, c) in terms.iter().zip(coefficients) {
            *c = if planted_terms.contains(term) {
                2.0 + f64::from(term[0])
            } else {
                0.0
            };
        }
    }
    let motion = planted(&truth, 8_000, 0.2, 56);
    let axes = [axis("x", Some(0.0)), axis("phi", Some(0.0))];
    let fit = fit_polynomial(&axes, &[&motion], &[], &options(Method::Select), &|_| ()).unwrap();
    for (axis, coefficients) in fit.polynomial.coefficients.iter().enumerate() {
        let found: Vec<_> = terms
            .iter()
            .zip(coefficients)
            .filter(|(_, c)| **c != 0.0)
            .collect();
        println!("{found:?}");
        assert_eq!(found.len(), planted_terms.len());
        assert!(found.iter().all(|(term, _)| planted_terms.contains(term)));
        assert_eq!(fit.axes[axis].terms, planted_terms.len());
    }
}

fn simulated(
    rig: RigParameters,
    seed: u64,
    inertia_stated: bool,
) -> (Vec<Axis>, Vec<Motion>, Vec<Role>) {
    let simulation = simulate(&SimulationOptions {
        rig,
        seed,
        snr_db: None,
        quantised: false,
        duration_s: 5.0,
        ..Default::default()
    })
    .unwrap();
    let rate = simulation.study.sample_rate_hz;
    let motions = simulation
        .truth
        .iter()
        .enumerate()
        .map(|(i, t)| t.motion(i, rate))
        .collect();
    let mut axes = simulation.study.axes;
    if !inertia_stated {
        axes.iter_mut().for_each(|axis| axis.inertia = None);
    }
    (
        axes,
        motions,
        simulation.study.records.iter().map(|r| r.role).collect(),
    )
}

fn linear_rig() -> RigParameters {
    let rig = RigParameters::default();
    let joint = Joint {
        contact_stiffness: [0.0; 2],
        coupling: [0.0; 2],
        ..rig.joint
    };
    RigParameters { joint, ..rig }
}

#[test]
fn a_linear_joint_gives_its_spring_and_damper_and_nothing_else() {
    let rig = linear_rig();
    let (axes, motions, _) = simulated(rig, 1, true);
    let training: Vec<&Motion> = motions[..3].iter().collect();
    for method in [Method::Select, Method::Ridge] {
        let fit = fit_polynomial(&axes, &training, &[], &options(method), &|_| ()).unwrap();
        let terms = exponents(&fit.polynomial.orders);
        for axis in 0..2 {
            let slope = |input: usize| {
                let mut term = [0; 4];
                term[input] = 1;
                let at = terms.iter().position(|t| *t == term).unwrap();
                fit.polynomial.coefficients[axis][at] / fit.polynomial.inputs[input].half_range
            };
            assert!((slope(2 * axis) / rig.joint.stiffness[axis] - 1.0).abs() < 1e-6);
            assert!((slope(2 * axis + 1) / rig.joint.damping[axis] - 1.0).abs() < 1e-6);
            let largest = fit.polynomial.coefficients[axis]
                .iter()
                .fold(0.0, |m: f64, c| m.max(c.abs()));
            for (term, c) in terms.iter().zip(&fit.polynomial.coefficients[axis]) {
                let own = term.iter().sum::<u8>() == 0
                    || (term[2 * axis] + term[2 * axis + 1] == 1 && term.iter().sum::<u8>() == 1);
                assert!(own || c.abs() < 1e-5 * largest, "{method:?} {term:?} {c}");
            }
        }
    }
}

#[test]
fn inertia_is_found_where_it_is_not_stated() {
    for (rig, tolerance) in [(linear_rig(), 1e-6), (RigParameters::default(), 0.01)] {
        let (axes, motions, _) = simulated(rig, 1, false);
        let training: Vec<&Motion> = motions[..3].iter().collect();
        let fit = fit_polynomial(
            &axes,
            &training,
            &[0.25, 0.5, 0.25],
            &options(Method::Ridge),
            &|_| (),
        )
        .unwrap();
        for (found, truth) in fit.inertia.iter().zip([&rig.translation, &rig.rotation]) {
            println!("{found:?} for {}", truth.inertia[1]);
            assert!(found.identified);
            assert!((found.value / truth.inertia[1] - 1.0).abs() < tolerance);
            assert!(found.standard_error.unwrap() < tolerance.max(1e-3) * found.value);
        }
    }
}

#[test]
fn a_force_of_the_wrong_sign_is_refused_when_the_inertia_is_sought() {
    let (axes, mut motions, _) = simulated(linear_rig(), 1, false);
    motions[0].force.iter_mut().flatten().for_each(|f| *f = -*f);
    motions[1].force.iter_mut().flatten().for_each(|f| *f = -*f);
    motions[2].force.iter_mut().flatten().for_each(|f| *f = -*f);
    let training: Vec<&Motion> = motions[..3].iter().collect();
    let error =
        fit_polynomial(&axes, &training, &[], &options(Method::Ridge), &|_| ()).unwrap_err();
    assert_eq!(error.exit_code(), 3);
    assert!(error.sentence.contains("axis x"), "{error}");
}

#[test]
fn records_that_cannot_support_the_model_are_named_and_still_fitted() {
    let (axes, motions, _) = simulated(RigParameters::default(), 1, true);
    for method in [Method::Ridge, Method::LeastSquares, Method::Select] {
        let fit = fit_polynomial(&axes, &[&motions[0]], &[], &options(method), &|_| ()).unwrap();
        println!("{:#?}", fit.warnings);
        assert!(fit.rank <= 16);
        assert!(
            fit.warnings
                .iter()
                .any(|w| w.contains("rests in every training record"))
        );
        assert!(fit.warnings.iter().any(|w| w.contains("determine only")));
        let states: Vec<&[f64]> = motions[0].states.iter().map(Vec::as_slice).collect();
        let predicted = fit.polynomial.predict(&states).unwrap();
        let force =
            motions[0].restoring_force(0, axes[0].inertia.unwrap(), axes[0].restoring_force);
        let error: f64 = predicted[0]
            .iter()
            .zip(&force)
            .map(|(a, b)| (a - b).powi(2))
            .sum();
        let size: f64 = force.iter().map(|f| f * f).sum();
        assert!(error < 0.05 * size, "{method:?}: {}", error / size);
    }
}

#[test]
fn the_default_generalises_better_than_plain_least_squares() {
    let mut gains = [Vec::new(), Vec::new()];
    for rig in 0..10 {
        let parameters = if rig == 0 {
            RigParameters::default()
        } else {
            RigParameters::draw(rig)
        };
        let (axes, motions, roles) = simulated(parameters, 100 + rig, true);
        assert_eq!(roles[3], Role::Validate);
        let training: Vec<&Motion> = motions[..3].iter().collect();
        let states: Vec<&[f64]> = motions[3].states.iter().map(Vec::as_slice).collect();
        let validation = |method| -> Vec<f64> {
            let fit = fit_polynomial(&axes, &training, &[], &options(method), &|_| ()).unwrap();
            let predicted = fit.polynomial.predict(&states).unwrap();
            (0..2)
                .map(|i| {
                    let (inertia, convention) = (axes[i].inertia.unwrap(), axes[i].restoring_force);
                    let r = motions[3].restoring_force(i, inertia, convention);
                    r.iter()
                        .zip(&predicted[i])
                        .map(|(a, b)| (a - b).powi(2))
                        .sum()
                })
                .collect()
        };
        let (plain, default) = (validation(Method::LeastSquares), validation(Method::Ridge));
        for (axis, gains) in gains.iter_mut().enumerate() {
            println!(
                "rig {rig}, axis {axis}: {:.2} times lower",
                plain[axis] / default[axis]
            );
            gains.push(plain[axis] / default[axis]);
        }
    }
    for mut gains in gains {
        gains.sort_by(f64::total_cmp);
        let median = 0.5 * (gains[4] + gains[5]);
        assert!(gains[0] > 1.0 / 1.2 && median > 1.5, "{gains:?}");
    }
}

#[test]
fn bad_input_gets_a_sentence() {
    let truth = random_polynomial(57);
    let good = planted(&truth, 500, 0.0, 58);
    let axes = [axis("x", Some(0.0)), axis("phi", Some(0.0))];
    let fit = |motions: &[&Motion], orders: Option<Vec<u8>>| {
        let options = PolynomialOptions {
            orders,
            method: Method::Ridge,
            ..PolynomialOptions::default()
        };
        fit_polynomial(&axes, motions, &[], &options, &|_| ()).map_err(|e| e.exit_code())
    };
    assert!(fit(&[&good], None).is_ok());
    assert_eq!(fit(&[&good], Some(vec![3, 3])), Err(2));
    assert_eq!(fit(&[&good], Some(vec![3, 3, 3, 4])), Err(2));
    assert_eq!(fit(&[], None), Err(3));
    let mut bad = good.clone();
    bad.force[1][17] = f64::NAN;
    assert_eq!(fit(&[&bad], None), Err(3));
    let mut bad = good.clone();
    bad.states[2].pop();
    assert_eq!(fit(&[&bad], None), Err(3));
    assert_eq!(fit(&[&planted(&truth, 10, 0.0, 59)], None), Err(3));
}

#[test]
fn lower_orders_and_one_axis_fit_alike() {
    let mut truth = random_polynomial(60);
    truth.orders = vec![2, 1];
    truth.inputs.truncate(2);
    truth.coefficients = vec![vec![1.0, 2.0, 3.0, -4.0, 5.0, -6.0]];
    let motion = planted(&truth, 2000, 0.0, 61);
    let options = PolynomialOptions {
        orders: Some(vec![2, 1]),
        method: Method::LeastSquares,
        ..PolynomialOptions::default()
    };
    let fit = fit_polynomial(&[axis("x", Some(0.0))], &[&motion], &[], &options, &|_| ()).unwrap();
    for (a, b) in fit.polynomial.coefficients[0]
        .iter()
        .zip(&truth.coefficients[0])
    {
        assert!((a - b).abs() < 1e-9);
    }
}
