//! The force laws that can be hidden in the joint, written from the literature in other parameters
//! than the library's.
//!
//! Every law gives a force of `strength` times a shape, and moves its memory by differential
//! equations that are integrated together with the bodies. Positive force pulls body 2 towards body
//! 3 as a spring does when x > 0.

use crate::hidden::form::Form;
use crate::hidden::rig::JointState;
use crate::hidden::sizes::{MEMORIES, Memory};
use std::f64::consts::{FRAC_PI_2, TAU};

/// What a law sees besides the joint's state.
#[derive(Clone, Copy, Debug, Default)]
pub struct Surroundings {
    /// Time since the record began, s.
    pub time_s: f64,
    /// Displacement of the law's own axis a fixed while ago.
    pub delayed: f64,
    /// Largest |displacement| of the law's own axis in this record so far.
    pub largest: f64,
    /// A force that nobody logs, of RMS 1.
    pub unlogged: f64,
}

/// A law at work on an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Law {
    /// The law's form, of which the force is `strength` times as much.
    pub form: Form,
    /// 0 for the translation, 1 for the rotation.
    pub axis: usize,
    /// Scale of its force.
    pub strength: f64,
}

/// Sign of a velocity with an edge: v/√(v² + e²).
fn direction(v: f64, edge: f64) -> f64 {
    v / v.hypot(edge)
}

/// A force forwards as it is, backwards times `back`.
fn sided(force: f64, back: f64) -> f64 {
    if force < 0.0 { back * force } else { force }
}

/// Static over kinetic friction at a speed, by the Gaussian of Armstrong-Hélouvry.
fn excess(v: f64, ratio: f64, speed: f64) -> f64 {
    1.0 + (ratio - 1.0) * (-(v / speed).powi(2)).exp()
}

/// What is left of a displacement beyond a gap on either side.
pub(in crate::hidden) fn dead_zone(x: f64, gap: f64) -> f64 {
    (x.abs() - gap).max(0.0).copysign(x)
}

/// Between what the slide of a flag-shaped loop is held, beyond the gap where it slides and where
/// it opens again.
fn flag_bounds(x: f64, gap: f64, opening: f64) -> [f64; 2] {
    let [inner, outer] = [gap, opening].map(|at| dead_zone(x, at));
    [inner.min(outer), inner.max(outer)]
}

/// What gas in a cylinder of this length is pressed up by, at x = 0 nothing; it is not pressed
/// beyond a quarter.
fn pressed(x: f64, length: f64, index: f64) -> f64 {
    (1.0 - x / length).max(0.25).powf(-index) - 1.0
}

impl Law {
    /// The force on the law's own axis and on the other one, N or N·m.
    pub fn force(&self, joint: &JointState, memory: &Memory, around: &Surroundings) -> [f64; 2] {
        let ([x, v], [other, _]) = (joint[self.axis], joint[1 - self.axis]);
        let z = memory[0];
        let own = match self.form {
            Form::Spring => x,
            Form::Damper => v,
            Form::Play { gap } => dead_zone(x, gap),
            Form::Stop { at } => dead_zone(x, at),
            Form::ContactCoupling { gaps, ratio, lever } => {
                let [[x, v], [turn, spin]] = *joint;
                let touches = |u: f64, gap: f64| f64::from(u8::from(u.abs() >= gap));
                let g = -(v * turn * touches(x, gaps[0])
                    + ratio * spin * x * touches(turn, gaps[1]))
                    / 3.0
                    * self.strength;
                return if self.axis == 0 {
                    [g, lever * g]
                } else {
                    [lever * g, g]
                };
            }
            Form::Dry { edge } => direction(v, edge),
            Form::Stribeck { ratio, speed, edge } => excess(v, ratio, speed) * direction(v, edge),
            Form::Drag => v * v.abs(),
            Form::Duffing => x.powi(3),
            Form::OneSided => x.max(0.0),
            Form::Wen { saturation, .. }
            | Form::Dahl { saturation }
            | Form::PinchedWen { saturation, .. }
            | Form::TiredWen { saturation, .. } => z / saturation,
            Form::SpringSlider { slip } => (z / slip).clamp(-1.0, 1.0),
            Form::Bristles {
                deflection,
                damping_s,
                ..
            } => z / deflection + damping_s / deflection * self.rates(joint, memory)[0],
            Form::SpringDamper { .. } | Form::HardeningWen { .. } => z,
            Form::Teeth { pitch, phase } => (TAU * x / pitch + phase).sin(),
            Form::UnroundDry { pitch, phase, edge } => {
                let triangle = (TAU * x / pitch + phase).sin().asin() / FRAC_PI_2;
                triangle * direction(v, edge)
            }
            Form::Constant => 1.0,
            Form::CrossSpring => return [self.strength * other, self.strength * x],
            Form::GrowingSpring { duration_s } => x * around.time_s / duration_s,
            Form::SidedDry { edge, back } => sided(direction(v, edge), back),
            Form::SidedDamper { back } => sided(v, back),
            Form::GapSlider { gap, slip, back } => {
                sided((dead_zone(z, gap) / slip).clamp(-1.0, 1.0), back)
            }
            Form::SidedWen {
                saturation, back, ..
            } => sided(z / saturation, back),
            Form::ThickeningWen {
                saturation,
                gain,
                speed,
                ..
            } => z / saturation * (1.0 - gain * (-v.abs() / speed).exp_m1()),
            Form::PlacedWen {
                saturation,
                length,
                along,
                across,
                ..
            } => {
                let u = x / length;
                z / saturation * (1.0 + along * u + across * u * u)
            }
            Form::BufferedContact {
                gap,
                exponent,
                length,
                back,
            } => {
                let depth = dead_zone(x, gap);
                sided((depth.abs() / length).powf(exponent).copysign(depth), back)
            }
            Form::Flag { gap, opening } => {
                let [low, high] = flag_bounds(x, gap, opening);
                x - z.clamp(low, high)
            }
            Form::PowerSpring {
                exponent,
                length,
                back,
            } => sided((x / length).abs().powf(exponent).copysign(x), back),
            Form::PowerDamper {
                exponent,
                speed,
                back,
            } => {
                let u = v / speed;
                sided(u * u.hypot(2e-3).powf(exponent - 1.0), back)
            }
            Form::ReliefValve {
                opens: [ahead, returning],
                back,
            } => sided(v.clamp(-returning, ahead), back),
            Form::Piston {
                length,
                index,
                back,
            } => pressed(x, length, index) - back * pressed(-x, length, index),
            Form::Foam { length, back } => (x / length).exp_m1() - back * (-x / length).exp_m1(),
            Form::PlacedContact {
                at: [upper, lower],
                exponent,
                length,
                back,
            } => {
                let depth = |beyond: f64| (beyond.max(0.0) / length).powf(exponent);
                depth(x - upper) - back * depth(lower - x)
            }
            Form::UnevenTeeth {
                pitch,
                phases: [first, other],
                second,
            } => (TAU * x / pitch + first).sin() + second * (2.0 * TAU * x / pitch + other).sin(),
            Form::Valve { knee } => v / (1.0 + v.abs() / knee),
            Form::LateFriction { .. } | Form::LostMotion { .. } => z,
            Form::SpringTimesOther { power } => x * other.powi(power),
            Form::DamperTimesOther { power } => v * other.powi(power),
            Form::TighterAlong { edge, length } => direction(v, edge) * x / length,
            Form::RingSpring { edge } => direction(v, edge) * x.abs(),
            Form::Softening { excursion } => -x * around.largest / excursion,
            Form::FrictionInBouts {
                edge,
                period_s,
                phase,
            } => {
                let course = (TAU * around.time_s / period_s + phase).sin();
                direction(v, edge) * 0.5 * (1.0 + (8.0 * course).tanh())
            }
            Form::LateSpring { .. } => around.delayed,
            Form::Unlogged => around.unlogged,
            Form::SwingingSpring {
                frequency_hz,
                phase,
            } => x * (TAU * frequency_hz * around.time_s + phase).sin(),
            Form::SqueezeFilm { centre } => (x - centre).powi(2) * v,
            Form::SmoothSpring { length, phases } => [1.0, 2.0, 4.0]
                .iter()
                .zip(phases)
                .map(|(k, phase)| (k * x / length + phase).sin() / k)
                .sum(),
            Form::HalfDamper { edge } => v * 0.5 * (1.0 + (x / edge).tanh()),
            Form::Wild(wild) => wild.force([x, v], memory, around.time_s),
        };
        [self.strength * own, 0.0]
    }

    /// How fast its memory changes, per second.
    pub fn rates(&self, joint: &JointState, memory: &Memory) -> Memory {
        let [x, v] = joint[self.axis];
        let z = memory[0];
        let rate = match self.form {
            Form::Wild(wild) => return wild.rates(joint[self.axis], memory),
            Form::TiredWen {
                saturation,
                exponent,
                excursion,
                slip,
            } => {
                let full = (z / saturation).abs().powf(exponent);
                let yields = if v * z > 0.0 { full } else { 0.0 };
                let grows = x.abs() >= memory[1] && x * v > 0.0;
                let mut rates = [0.0; MEMORIES];
                let whole = excursion / (excursion + memory[1]);
                let slips = slip.map_or(0.0, |width| (-(z / width).powi(2)).exp());
                rates[0] = v * (1.0 - yields) * whole * (1.0 - (1.0 - whole) * slips);
                rates[1] = if grows { v.abs() } else { 0.0 };
                return rates;
            }
            Form::Wen {
                saturation,
                roundness,
                exponent,
            }
            | Form::SidedWen {
                saturation,
                roundness,
                exponent,
                ..
            }
            | Form::ThickeningWen {
                saturation,
                roundness,
                exponent,
                ..
            }
            | Form::PlacedWen {
                saturation,
                roundness,
                exponent,
                ..
            } => {
                let full = (z / saturation).abs().powf(exponent);
                let closing = if v * z >= 0.0 { 1.0 } else { -1.0 };
                v * (1.0 - full * (roundness * closing + 1.0 - roundness))
            }
            Form::PinchedWen {
                saturation,
                exponent,
                lost,
                level,
                width,
            } => {
                let full = (z / saturation).abs().powf(exponent);
                let towards = if v < 0.0 { -z } else { z };
                let slips = lost * (-((towards - level) / width).powi(2)).exp();
                let yields = if towards > 0.0 { full } else { 0.0 };
                v * (1.0 - slips) * (1.0 - yields)
            }
            Form::HardeningWen {
                both_ways,
                unloading,
            } => v + both_ways * v * z.abs() - unloading * v.abs() * z,
            Form::Dahl { saturation } => v - v.abs() * z / saturation,
            Form::GapSlider { gap, slip, .. } => {
                if z.abs() >= gap + slip && z * v > 0.0 {
                    0.0
                } else {
                    v
                }
            }
            // What follows is pushed by either end of the lost motion.
            Form::LostMotion { half } => {
                let pushed = (x - z).abs() >= half && (x - z) * v > 0.0;
                if pushed { v } else { 0.0 }
            }
            // The slide is taken along by the bound that reaches it.
            Form::Flag { gap, opening } => {
                let [low, high] = flag_bounds(x, gap, opening);
                let moves = |at: f64| if x.abs() > at { v } else { 0.0 };
                let [inner, outer] = [moves(gap), moves(opening)];
                let [slow, fast] = if x < 0.0 {
                    [outer, inner]
                } else {
                    [inner, outer]
                };
                if z <= low {
                    slow.max(0.0)
                } else if z >= high {
                    fast.min(0.0)
                } else {
                    0.0
                }
            }
            Form::LateFriction { edge, lag_s } => (direction(v, edge) - z) / lag_s,
            Form::SpringSlider { slip } => {
                if z.abs() >= slip && z * v > 0.0 {
                    0.0
                } else {
                    v
                }
            }
            Form::Bristles {
                deflection,
                ratio,
                speed,
                ..
            } => v - v.abs() * z / (deflection * excess(v, ratio, speed)),
            Form::SpringDamper { relaxation_s } => v - z / relaxation_s,
            _ => 0.0,
        };
        let mut rates = [0.0; MEMORIES];
        rates[0] = rate;
        rates
    }

    /// The fastest rate that the law brings into the equations of motion, 1/s: explicit steps must
    /// be shorter than its inverse.
    pub fn fastest_rate(&self, moving_inertia: f64, top_speed: f64) -> f64 {
        let s = self.strength.abs();
        let spring = |stiffness: f64| (stiffness / moving_inertia).sqrt();
        match self.form {
            Form::Dry { edge }
            | Form::FrictionInBouts { edge, .. }
            | Form::UnroundDry { edge, .. } => s / (edge * moving_inertia),
            Form::SidedDry { edge, back } => s * back.max(1.0) / (edge * moving_inertia),
            Form::TighterAlong { edge, .. } => 2.0 * s / (edge * moving_inertia),
            Form::GapSlider { slip, back, .. } => spring(s * back.max(1.0) / slip),
            Form::ThickeningWen {
                saturation, gain, ..
            } => spring(s * (1.0 + gain) / saturation).max(2.0 * top_speed / saturation),
            Form::PlacedWen {
                saturation,
                along,
                across,
                ..
            } => {
                let most = 1.0 + along.abs() + across.abs();
                spring(s * most / saturation).max(2.0 * top_speed / saturation)
            }
            Form::LostMotion { .. } | Form::Flag { .. } => spring(s),
            Form::BufferedContact {
                exponent,
                length,
                back,
                ..
            } => spring(s * back.max(1.0) * exponent * 2_f64.powf(exponent - 1.0) / length),
            Form::SidedWen {
                saturation, back, ..
            } => spring(s * back.max(1.0) / saturation).max(2.0 * top_speed / saturation),
            Form::PowerSpring { length, back, .. } => spring(8.0 * s * back.max(1.0) / length),
            Form::PowerDamper { speed, back, .. } => {
                8.0 * s * back.max(1.0) / (speed * moving_inertia)
            }
            Form::LateFriction { lag_s, .. } => 1.0 / lag_s,
            Form::Stribeck { ratio, edge, .. } => ratio * s / (edge * moving_inertia),
            Form::Spring | Form::Play { .. } | Form::Stop { .. } | Form::OneSided => spring(s),
            Form::SpringSlider { slip } => spring(s / slip),
            Form::Wen { saturation, .. }
            | Form::Dahl { saturation }
            | Form::PinchedWen { saturation, .. }
            | Form::TiredWen { saturation, .. } => {
                spring(s / saturation).max(2.0 * top_speed / saturation)
            }
            Form::Bristles {
                deflection,
                damping_s,
                ..
            } => spring(s / deflection)
                .max(top_speed / deflection)
                .max(s * damping_s / (deflection * moving_inertia)),
            Form::SpringDamper { relaxation_s } => spring(s) + 1.0 / relaxation_s,
            Form::Piston {
                length,
                index,
                back,
            } => spring(s * back.max(1.0) * index / length * 0.25_f64.powf(-index - 1.0)),
            Form::PlacedContact {
                exponent,
                length,
                back,
                ..
            } => spring(s * back.max(1.0) * exponent * 2_f64.powf(exponent - 1.0) / length),
            Form::Foam { length, back } => spring(20.0 * s * back.max(1.0) / length),
            Form::UnevenTeeth { pitch, second, .. } => {
                spring(s * TAU * (1.0 + 2.0 * second) / pitch)
            }
            // It unloads several times as steeply as it is unloaded.
            Form::HardeningWen {
                both_ways,
                unloading,
            } => spring(16.0 * s).max(2.0 * top_speed * (both_ways + unloading)),
            Form::Wild(wild) => wild.fastest_rate(s, moving_inertia, top_speed),
            Form::Teeth { pitch, .. } => spring(s * TAU / pitch),
            _ => 0.0,
        }
    }
}

#[cfg(test)]
mod tests;
