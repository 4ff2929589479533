//! The kernels once more, in 128-bit integers that cannot overflow, written from
//! docs/explanation/numerics.md.

use jointwatch_shared::base::network::NetworkModel;
use jointwatch_shared::base::polynomial::PolynomialModel;
use jointwatch_shared::base::tanh::tanh_scaled;
use jointwatch_shared::base::terms::Memory;
use jointwatch_shared::base::{Base, Model};

/// ⌊x/2ⁿ + ½⌋.
fn round(x: i128, n: u32) -> i128 {
    (2 * x + (1 << n)).div_euclid(1 << (n + 1))
}

/// 1 in a form that needs no product, x, x², x³ in Q31, with the square of −1 cut to 1 − 2⁻³¹.
fn powers(x: i32) -> [i128; 4] {
    let x = i128::from(x);
    let square = round(x * x, 31).min((1 << 31) - 1);
    [1 << 31, x, square, round(square * x, 31)]
}

/// Σ over powers of `first` (rows) and `second` (columns), one rounding per product.
fn block(words: &[i32; 16], first: &[i128; 4], second: &[i128; 4]) -> i128 {
    let nested = |values: &[i128], powers: &[i128; 4]| -> i128 {
        let products = values.iter().zip(powers).skip(1);
        values[0] + products.map(|(v, p)| round(v * p, 32)).sum::<i128>()
    };
    let rows: Vec<i128> = words
        .chunks(4)
        .map(|row| {
            let row: Vec<i128> = row.iter().map(|&w| i128::from(w)).collect();
            nested(&row, second)
        })
        .collect();
    nested(&rows, first)
}

/// A memory that was told the third number as the input, where there is one axis, as the chain
/// does.
pub(crate) fn told(model: &Model, u: &[i32; 4]) -> Memory {
    let mut memory = Memory::default();
    if model.axes() == 1 {
        memory.follow([u[2], 0]);
    }
    memory
}

/// The outputs, without any limit on their size but that of a sum with effects, which saturates.
///
/// `shifts` is by how many places the base's force is moved for the effects. Effects themselves are
/// not written a second time: every operation of their numbers saturates, which a test beside `Q`
/// holds against 128 bits.
pub(crate) fn evaluate(model: &Model, shifts: [u8; 2], u: &[i32; 4]) -> [i128; 2] {
    let base = match model.base() {
        Base::Polynomial(polynomial) => of_polynomial(polynomial, u),
        Base::Network(network) => of_network(network, u),
        Base::None { .. } => [0; 2],
        other => panic!("no wide kernel for {other:?}"),
    };
    if model.terms().list().is_empty() {
        return base;
    }
    let effects = model.terms().forces(&mut told(model, u), u);
    [0, 1].map(|axis| {
        let base = round(base[axis], u32::from(shifts[axis]));
        let sum = base + round(i128::from(effects[axis].raw()), 1);
        sum.clamp(i128::from(i32::MIN), i128::from(i32::MAX))
    })
}

/// Both layers as the high word of bias + Σ word·factor; an argument beyond 32 bits is an overflow
/// and ends the test.
fn of_network(model: &NetworkModel, u: &[i32; 4]) -> [i128; 2] {
    let sum = |bias: i64, words: &[i32], factors: &[i32]| -> i128 {
        let products = words.iter().zip(factors);
        let products = products.map(|(&w, &f)| i128::from(w) * i128::from(f));
        (i128::from(bias) + products.sum::<i128>()).div_euclid(1 << 32)
    };
    let value = |argument: i128, steps| tanh_scaled(i32::try_from(argument).unwrap(), steps);
    let neurons = model.neurons().iter();
    let values: Vec<i32> = neurons
        .map(|n| value(sum(n.bias, &n.weights, u), n.steps))
        .collect();
    [0, 1].map(|axis| {
        let words: Vec<i32> = model.neurons().iter().map(|n| n.outputs[axis]).collect();
        sum(model.output_bias()[axis], &words, &values)
    })
}

fn of_polynomial(model: &PolynomialModel, u: &[i32; 4]) -> [i128; 2] {
    let [a, b, c, d] = u.map(powers);
    if model.axes() == 1 && !model.follows() {
        return [block(&model.blocks()[0][0].words, &a, &b), 0];
    }
    // Of one axis with an input, that takes the place of x and the motion that of the second axis.
    let nothing = [1 << 31, 0, 0, 0];
    let [outer, inner] = match model.axes() {
        1 => [[c, nothing], [a, b]],
        _ => [[a, b], [c, d]],
    };
    [0, 1].map(|axis| {
        let sum: i128 = (0..16)
            .map(|number| {
                let stored = &model.blocks()[axis][number];
                let (x, v) = (outer[0][number / 4], outer[1][number % 4]);
                // Q30: 1 is exact, one power alone is halved, two are multiplied.
                let monomial = round(x * v, 32);
                let weight = round(monomial * i128::from(stored.gain), 32);
                block(&stored.words, &inner[0], &inner[1]) * weight
            })
            .sum();
        round(sum, 29 + u32::from(model.shifts()[axis]))
    })
}
