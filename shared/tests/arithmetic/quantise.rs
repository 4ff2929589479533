//! Bringing a polynomial to integers: what cannot be held is named, and what can comes out at the
//! best scale.

use jointwatch_shared::base::axis::{Axis, AxisKind, Convention, InputRange, Name};
use jointwatch_shared::base::polynomial::PolynomialModel;
use jointwatch_shared::base::{Base, Header, Model};
use jointwatch_shared::fault::Error;
use jointwatch_shared::scalar::fixed::q31_from_f64;

fn header(axes: usize) -> Header {
    let range = InputRange {
        center: 0.0,
        half_range: 1e-3,
    };
    let axis = |number: u8| Axis {
        name: Name::new(number, ["x", "phi"][usize::from(number)]).unwrap(),
        kind: AxisKind::Translation,
        convention: Convention::ForceMinusInertia,
        inertia: 1.0,
        displacement: range,
        velocity: range,
        input: None,
        validation: None,
    };
    Header {
        sample_rate_hz: 1000.0,
        band_hz: 100.0,
        state_band_hz: 400.0,
        axes: (0..axes as u8).map(axis).collect(),
    }
}

/// 256 zeros but for the term with these exponents.
fn single(exponents: [usize; 4], value: f64) -> Vec<f64> {
    let mut coefficients = vec![0.0; 256];
    coefficients[exponents.iter().fold(0, |n, e| 4 * n + e)] = value;
    coefficients
}

#[test]
fn every_term_multiplies_its_own_powers() {
    let u = [0.9, -0.8, 0.7, -0.6];
    for n in 0..256 {
        let exponents = [n / 64, n / 16 % 4, n / 4 % 4, n % 4];
        let (first, second) = (single(exponents, 12.5), single(exponents, -3.0));
        let (model, outputs) = PolynomialModel::quantise(&[3; 4], &[&first, &second]).unwrap();
        let forces = model.evaluate(&u.map(q31_from_f64));
        let product: f64 = (0..4)
            .map(|i| f64::powi(u[i], exponents[i] as i32))
            .product();
        for ((force, output), value) in forces.into_iter().zip(&outputs).zip([12.5, -3.0]) {
            let error = f64::from(force) * output.force_per_lsb - value * product;
            assert!(
                error.abs() <= output.error_bound,
                "{exponents:?}: {error:e}"
            );
            assert!(output.error_bound < 1e-8 * value.abs());
        }
    }
}

#[test]
fn lower_orders_take_their_places() {
    // 2 + 3·φ̇ + 5·x·φ on the first axis, nothing on the second.
    let orders = [1, 0, 1, 1];
    let first = [2.0, 3.0, 0.0, 0.0, 0.0, 0.0, 5.0, 0.0];
    let (model, outputs) = PolynomialModel::quantise(&orders, &[&first, &[0.0; 8]]).unwrap();
    let [force, none] = model.evaluate(&[0.5, 0.9, -0.5, 0.25].map(q31_from_f64));
    assert!((f64::from(force) * outputs[0].force_per_lsb - 1.5).abs() < 1e-7);
    assert_eq!((none, outputs[1].error_bound < 1.0), (0, true));
}

#[test]
fn what_cannot_be_held_is_named() {
    for bad in [f64::NAN, f64::INFINITY, -1e61, 1e-51] {
        let exponents = [1, 0, 3, 2];
        let second = single(exponents, bad);
        let refusal = PolynomialModel::quantise(&[3; 4], &[&[1.0; 256], &second]).unwrap_err();
        match refusal {
            Error::Coefficient {
                axis: 1,
                exponents: [1, 0, 3, 2],
                seen,
            } => assert!(seen.to_bits() == bad.to_bits()),
            other => panic!("{bad}: {other}"),
        }
    }
    assert_eq!(
        PolynomialModel::quantise(&[3; 4], &[&[1.0; 256], &[1.0; 255]]).unwrap_err(),
        Error::CoefficientCount {
            axis: 1,
            seen: 255,
            wanted: 256
        }
    );
    assert!(PolynomialModel::quantise(&[3, 4], &[&[1.0; 20]]).is_err());
    assert!(PolynomialModel::quantise(&[3; 2], &[&[1.0; 16], &[1.0; 16]]).is_err());
    assert!(PolynomialModel::quantise(&[], &[]).is_err());
}

#[test]
fn a_model_beyond_its_budget_names_its_largest_coefficient() {
    let mut second = vec![1.0; 256];
    second[4 * 4 * 4 + 2] = -1e6;
    let make = |budget: f64| {
        let values: [&[f64]; 2] = [&[1.0; 256], &second];
        Model::from_polynomial(header(2), &[3; 4], &values, &[1.0, budget])
    };
    let model = make(f64::INFINITY).unwrap();
    let bound = model.outputs()[1].error_bound;
    assert!(make(bound).is_ok());
    assert_eq!(
        make(0.99 * bound).unwrap_err(),
        Error::Budget {
            axis: 1,
            exponents: [1, 0, 0, 2],
            coefficient: -1e6,
            bound,
            budget: 0.99 * bound
        }
    );
}

#[test]
fn the_scale_is_used_to_the_full() {
    // All force at one corner: the output there is within a factor 2 of the rail whatever the size
    // of the numbers.
    for factor in [1e-40, 0.37, 1.0, 1.9, 1e40] {
        let values: Vec<f64> = (1..=256).map(|n| f64::from(n) * factor).collect();
        let (model, _) = PolynomialModel::quantise(&[3; 4], &[&values, &values]).unwrap();
        let [force, _] = model.evaluate(&[i32::MAX; 4]);
        assert!(force > 1 << 30, "{force}");
    }
}

#[test]
fn a_model_of_zeros_is_zero() {
    let model = Model::from_polynomial(header(1), &[3; 2], &[&[0.0; 16]], &[0.0]).unwrap();
    assert_eq!(model.evaluate(&[i32::MIN; 4]), [0, 0]);
    assert_eq!(model.outputs()[0].force_per_lsb, 1.0);
}

/// What spoils a header.
type Change = fn(&mut Header);

#[test]
fn a_header_that_makes_no_sense_is_refused() {
    let (polynomial, outputs) = PolynomialModel::quantise(&[0; 2], &[&[1.0]]).unwrap();
    let refuse = |change: Change| {
        let mut header = header(1);
        change(&mut header);
        let base = Base::Polynomial(polynomial.clone());
        Model::new(header, outputs.clone(), base)
            .unwrap_err()
            .to_string()
    };
    let cases: [(Change, &str); 6] = [
        (|h| h.band_hz = 500.1, "band in Hz is 500.1"),
        (
            |h| h.sample_rate_hz = f64::INFINITY,
            "sample rate in Hz is inf",
        ),
        (
            |h| h.axes[0].velocity.half_range = 0.0,
            "half width of an input range is 0",
        ),
        (
            |h| h.axes[0].displacement.center = f64::NAN,
            "center of an input range is NaN",
        ),
        (|h| h.axes[0].inertia = -1.0, "inertia is -1"),
        (|h| h.axes.clear(), "number of axes is 0"),
    ];
    for (change, wanted) in cases {
        let sentence = refuse(change);
        assert!(sentence.starts_with(wanted), "{sentence}");
    }
    let mut twice = header(2);
    twice.axes[1].name = twice.axes[0].name;
    assert!(matches!(twice.check(), Err(Error::Name { axis: 1, .. })));
    for name in ["", "seventeen letters", "a\nb", "a\0b"] {
        assert!(Name::new(0, name).is_err(), "{name:?}");
    }
    assert_eq!(
        Name::new(0, "sixteen letters!").unwrap().as_str(),
        "sixteen letters!"
    );
}
