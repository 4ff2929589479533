//! Every law against what a textbook says of it.

use super::*;
use std::f64::consts::PI;

/// Force at every step of the last of ten cycles of x = sin t, memory integrated by the midpoint
/// rule.
fn last_cycle(form: Form) -> Vec<([f64; 2], f64)> {
    const STEPS: usize = 20_000;
    let law = Law {
        form,
        axis: 0,
        strength: 3.0,
    };
    let h = TAU / STEPS as f64;
    let joint = |t: f64| [[t.sin(), t.cos()], [0.0; 2]];
    let mut memory = [0.0; MEMORIES];
    let mut cycle = Vec::new();
    for step in 0..10 * STEPS {
        let t = step as f64 * h;
        if step >= 9 * STEPS {
            let force = law.force(&joint(t), &memory, &Surroundings::default())[0];
            cycle.push((joint(t)[0], force));
        }
        let slope = law.rates(&joint(t), &memory);
        let half = std::array::from_fn(|i| memory[i] + 0.5 * h * slope[i]);
        let slope = law.rates(&joint(t + 0.5 * h), &half);
        memory = std::array::from_fn(|i| memory[i] + h * slope[i]);
    }
    cycle
}

/// Energy that a cycle of unit amplitude takes.
fn loop_area(cycle: &[([f64; 2], f64)]) -> f64 {
    let sum: f64 = cycle.iter().map(|([_, v], f)| f * v).sum();
    sum * TAU / cycle.len() as f64
}

fn near(value: f64, expected: f64, tolerance: f64) {
    assert!(
        (value - expected).abs() < tolerance * expected.abs(),
        "{value} instead of {expected}"
    );
}

#[test]
fn a_cycle_takes_the_energy_that_the_textbook_says() {
    let area = |form| loop_area(&last_cycle(form));
    // Dry friction: 4·F·X. Damper: π·c·X²·ω. Drag: 8/3·d·X³·ω². Spring and slider: 4·F·(X − F/k).
    near(area(Form::Dry { edge: 1e-3 }), 12.0, 2e-3);
    near(area(Form::Damper), 3.0 * PI, 1e-6);
    near(area(Form::Drag), 8.0, 1e-6);
    near(area(Form::SpringSlider { slip: 0.2 }), 12.0 * 0.8, 1e-3);
    // Spring and damper in series: π·k·ωτ/(1 + (ωτ)²).
    let relaxation_s = 0.7;
    let lossy = 3.0 * PI * relaxation_s / (1.0 + relaxation_s * relaxation_s);
    near(area(Form::SpringDamper { relaxation_s }), lossy, 1e-3);
    near(area(Form::SqueezeFilm { centre: 0.0 }), 0.75 * PI, 1e-6);
    // One way as above, the other way twice. A gap shortens the slider's way as its spring does:
    // 4·F·(X − gap − slip).
    near(
        area(Form::SidedDry {
            edge: 1e-3,
            back: 2.0,
        }),
        18.0,
        2e-3,
    );
    near(area(Form::SidedDamper { back: 2.0 }), 4.5 * PI, 1e-6);
    let gap = Form::GapSlider {
        gap: 0.1,
        slip: 0.2,
        back: 1.0,
    };
    near(area(gap), 12.0 * 0.7, 1e-3);
    // With the power 1 a damper, with 2 drag.
    let power = |exponent| Form::PowerDamper {
        exponent,
        speed: 1.0,
        back: 1.0,
    };
    near(area(power(1.0)), 3.0 * PI, 1e-4);
    near(area(power(2.0)), 8.0, 1e-4);
    // Two triangles either side of zero: 2·F·X².
    near(area(Form::RingSpring { edge: 1e-3 }), 6.0, 2e-3);
    // A spring behind a lost motion turns the other way: −4·k·d·(X − d). A flag on either side:
    // k·(gap − opening)·(X − gap).
    near(
        area(Form::LostMotion { half: 0.2 }),
        -12.0 * 0.2 * 0.8,
        1e-3,
    );
    let (gap, opening) = (0.4, 0.1);
    near(area(Form::Flag { gap, opening }), 6.0 * 0.3 * 0.6, 1e-3);
    for form in [
        Form::Spring,
        Form::Duffing,
        Form::OneSided,
        Form::Stop { at: 0.4 },
    ] {
        assert!(area(form).abs() < 1e-9);
    }
}

#[test]
fn hysteresis_saturates_and_wens_law_with_exponent_one_is_dahls() {
    let wen = |exponent, roundness| {
        last_cycle(Form::Wen {
            saturation: 0.05,
            roundness,
            exponent,
        })
    };
    let dahl = last_cycle(Form::Dahl { saturation: 0.05 });
    let smooth = wen(1.0, 1.0);
    for ((_, a), (_, b)) in smooth.iter().zip(&dahl) {
        assert!((a - b).abs() < 1e-9);
    }
    for cycle in [smooth, dahl, wen(2.0, 0.6)] {
        let peak = cycle.iter().fold(0.0f64, |most, (_, f)| most.max(f.abs()));
        near(peak, 3.0, 1e-2);
    }
    // Without what they add, the laws by speed and by place are Wen's, and a buffer of power 1 is a
    // play.
    let (saturation, roundness, exponent) = (0.05, 0.6, 2.0);
    let same = |one: Form, other: Form| {
        for ((_, a), (_, b)) in last_cycle(one).iter().zip(last_cycle(other)) {
            assert!((a - b).abs() < 1e-9, "{one:?}");
        }
    };
    let plain = Form::Wen {
        saturation,
        roundness,
        exponent,
    };
    let by_speed = |gain| Form::ThickeningWen {
        saturation,
        roundness,
        exponent,
        gain,
        speed: 0.01,
    };
    let by_place = |along, across| Form::PlacedWen {
        saturation,
        roundness,
        exponent,
        length: 1.0,
        along,
        across,
    };
    same(by_speed(0.0), plain);
    same(by_place(0.0, 0.0), plain);
    let peak = |form| {
        last_cycle(form)
            .iter()
            .fold(0.0f64, |most, (_, f)| most.max(f.abs()))
    };
    near(peak(by_speed(1.0)), 6.0, 1e-2);
    near(peak(by_place(0.5, 1.0)), 7.5, 1e-2);
    let buffered = Form::BufferedContact {
        gap: 0.3,
        exponent: 1.0,
        length: 1.0,
        back: 1.0,
    };
    same(buffered, Form::Play { gap: 0.3 });
    // Twice round on either side: as much friction as there is the other way.
    let unround = |phase| Form::UnroundDry {
        pitch: 0.5,
        phase,
        edge: 1e-3,
    };
    assert!(loop_area(&last_cycle(unround(0.4))).abs() < 0.05);
    near(peak(unround(0.4)), 3.0, 1e-2);
    // While it slides steadily, LuGre's friction is Stribeck's curve.
    let form = Form::Bristles {
        deflection: 1e-3,
        ratio: 1.7,
        speed: 0.3,
        damping_s: 1e-4,
    };
    for ([_, v], force) in last_cycle(form) {
        if v.abs() > 0.2 {
            near(force, 3.0 * excess(v, 1.7, 0.3) * v.signum(), 2e-2);
        }
    }
}

#[test]
fn the_cross_spring_keeps_energy_and_eq_16_needs_both_motions() {
    let law = |form| Law {
        form,
        axis: 0,
        strength: 2.0,
    };
    let around = Surroundings::default();
    let joint = [[0.3, 0.1], [-0.5, 0.7]];
    assert_eq!(
        law(Form::CrossSpring).force(&joint, &[0.0; MEMORIES], &around),
        [-1.0, 0.6]
    );
    let coupling = law(Form::ContactCoupling {
        gaps: [0.2, 0.6],
        ratio: 3.0,
        lever: 0.5,
    });
    // Only the translation touches: −⅓·2·ẋ·φ.
    let [own, other] = coupling.force(&joint, &[0.0; MEMORIES], &around);
    near(own, 2.0 * 0.1 * 0.5 / 3.0, 1e-12);
    near(other, 0.5 * own, 1e-12);
    let resting = [[0.3, 0.1], [0.0; 2]];
    assert_eq!(
        coupling.force(&resting, &[0.0; MEMORIES], &around)[0].abs(),
        0.0
    );
}
