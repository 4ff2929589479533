//! Laws drawn at random: kinds that no library of named effects holds, which a diagnosis should
//! call unknown, and Iwan's and Wiechert's with any elements.

use super::sizes::{MEMORIES, Memory, Scale};
use rand::{Rng, RngExt};
use std::f64::consts::TAU;

/// Waves of a smooth shape, each half as long and half as strong as the one before.
const WAVES: [f64; 3] = [1.0, 2.0, 4.0];
/// Part of the reach over which a relay turns.
const TURN: f64 = 0.02;

/// A law drawn at random; lengths and speeds are in the units of its axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wild {
    /// Waves along the displacement, the velocity or both.
    Waves {
        /// Of displacement and velocity, how much the longest wave turns in a unit, rad.
        turns: [f64; 2],
        /// Phases of the waves at x = v = 0, rad, the longest wave first.
        phases: [f64; 3],
    },
    /// Iwan, or Prandtl and Ishlinskii: springs in series with sliders beside each other, of any
    /// sizes.
    Sliders {
        /// Extension at which each slips.
        slips: Memory,
        /// Force of each when it slips, at strength 1.
        forces: Memory,
    },
    /// Wiechert: springs in series with dampers beside each other, with times over two decades or
    /// three.
    Relaxing {
        /// Damper over spring of each, s.
        times_s: Memory,
        /// Stiffness of each, at strength 1.
        springs: Memory,
    },
    /// Preisach: catches beside each other, each of which pushes back until it snaps through, at
    /// one displacement on the way up and at another on the way down: so each takes energy.
    Relays {
        /// The displacements on the way up.
        up: Memory,
        /// Those on the way down.
        down: Memory,
        /// Force of each, at strength 1.
        forces: Memory,
        /// Way in which a relay turns.
        turn: f64,
    },
    /// A spring that is there or not, as chance has it, for one period after another.
    Switching {
        /// How long the spring is there or not before chance decides anew, s.
        period_s: f64,
        /// What the chances follow from.
        seed: f64,
    },
}

/// The names of those that the library does not hold.
pub const NAMES: [&str; 5] = [
    "damper of a random smooth shape",
    "random smooth surface of displacement and velocity",
    "random hysteresis of relays",
    "spring that switches at random",
    "random smooth shape along displacement plus velocity",
];

impl Wild {
    /// Draws one of a name, to suit a motion.
    pub fn draw(name: &str, scale: &Scale, longest_s: f64, rng: &mut impl Rng) -> Option<Self> {
        let (x, v) = (scale.displacement, scale.velocity);
        let mut within = |low: f64, high: f64| low * (high / low).powf(rng.random::<f64>());
        let phases =
            |within: &mut dyn FnMut(f64, f64) -> f64| WAVES.map(|_| TAU * within(0.1, 1.0));
        let each = |draw: &mut dyn FnMut() -> f64| std::array::from_fn(|_| draw());
        Some(match name {
            "damper of a random smooth shape" => Self::Waves {
                turns: [0.0, 1.0 / (v * within(0.5, 1.5))],
                phases: phases(&mut within),
            },
            "random smooth surface of displacement and velocity" => Self::Waves {
                turns: [1.0 / (x * within(0.5, 1.5)), 1.0 / (v * within(0.5, 1.5))],
                phases: phases(&mut within),
            },
            "random smooth shape along displacement plus velocity" => Self::Waves {
                turns: [1.0 / (x * within(1.0, 4.0)), -1.0 / (v * within(0.5, 1.5))],
                phases: phases(&mut within),
            },
            "iwan" => Self::Sliders {
                slips: each(&mut || x * within(0.05, 2.0)),
                forces: each(&mut || within(0.05, 1.0)),
            },
            "generalized_maxwell" => {
                let (shortest, step, order) =
                    (within(0.002, 0.01), within(2.6, 3.6), within(0.2, 0.6));
                let times_s = std::array::from_fn(|i| shortest * step.powf(i as f64));
                Self::Relaxing {
                    times_s,
                    springs: times_s.map(|time| (time / shortest).powf(-order)),
                }
            }
            "random hysteresis of relays" => {
                let up: Memory = each(&mut || scale.reach * (within(1.0, 3.0) - 2.0) * 0.8);
                let widths: Memory = each(&mut || scale.reach * within(0.05, 1.0));
                Self::Relays {
                    up,
                    down: std::array::from_fn(|i| up[i] - widths[i]),
                    forces: each(&mut || within(0.1, 1.0)),
                    turn: TURN * scale.reach,
                }
            }
            "spring that switches at random" => Self::Switching {
                period_s: longest_s / within(15.0, 60.0),
                seed: within(1.0, 100.0),
            },
            _ => return None,
        })
    }

    /// Its force at strength 1.
    pub fn force(&self, [x, v]: [f64; 2], memory: &Memory, time_s: f64) -> f64 {
        let sum = |forces: &Memory, part: &dyn Fn(usize) -> f64| {
            (0..MEMORIES).map(|i| forces[i] * part(i)).sum()
        };
        match self {
            Self::Waves { turns, phases } => WAVES
                .iter()
                .zip(phases)
                .map(|(k, phase)| (k * (turns[0] * x + turns[1] * v) + phase).sin() / k)
                .sum(),
            Self::Sliders { slips, forces } => {
                sum(forces, &|i| (memory[i] / slips[i]).clamp(-1.0, 1.0))
            }
            Self::Relaxing { springs, .. } => sum(springs, &|i| memory[i]),
            Self::Relays { forces, .. } => sum(forces, &|i| -memory[i]),
            Self::Switching { period_s, seed } => {
                let number = (time_s / period_s).floor();
                let chance = ((number * 12.9898 + seed).sin() * 43_758.545_3).rem_euclid(1.0);
                if chance < 0.5 { 0.0 } else { x }
            }
        }
    }

    /// How fast its memory changes, per second.
    pub fn rates(&self, [x, v]: [f64; 2], memory: &Memory) -> Memory {
        match self {
            Self::Sliders { slips, .. } => std::array::from_fn(|i| {
                let slides = memory[i].abs() >= slips[i] && memory[i] * v > 0.0;
                if slides { 0.0 } else { v }
            }),
            Self::Relaxing { times_s, .. } => std::array::from_fn(|i| v - memory[i] / times_s[i]),
            Self::Relays { up, down, turn, .. } => std::array::from_fn(|i| {
                let speed = v.abs() / turn;
                if v > 0.0 && x > up[i] {
                    speed * (1.0 - memory[i])
                } else if v < 0.0 && x < down[i] {
                    speed * (-1.0 - memory[i])
                } else {
                    0.0
                }
            }),
            _ => [0.0; MEMORIES],
        }
    }

    /// The fastest rate that it brings into the equations of motion at a strength, 1/s.
    pub fn fastest_rate(&self, strength: f64, moving_inertia: f64, top_speed: f64) -> f64 {
        let spring = |stiffness: f64| (stiffness / moving_inertia).sqrt();
        match self {
            Self::Waves { turns, .. } => {
                let each = WAVES.len() as f64 * strength;
                spring(each * turns[0].abs()).max(each * turns[1].abs() / moving_inertia)
            }
            Self::Sliders { slips, forces } => {
                let stiffness = forces.iter().zip(slips).map(|(f, s)| f / s);
                spring(strength * stiffness.sum::<f64>())
            }
            Self::Relaxing { times_s, springs } => {
                spring(strength * springs.iter().sum::<f64>()) + 1.0 / times_s[0]
            }
            Self::Relays { forces, turn, .. } => {
                spring(strength * forces.iter().sum::<f64>() / turn).max(top_speed / turn)
            }
            Self::Switching { .. } => spring(strength),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Energy that a cycle of unit amplitude takes once the memory has settled.
    fn loop_area(wild: Wild) -> f64 {
        const STEPS: usize = 20_000;
        let h = TAU / STEPS as f64;
        let (mut memory, mut area) = ([0.0; MEMORIES], 0.0);
        for step in 0..3 * STEPS {
            let t = step as f64 * h;
            let joint = [t.sin(), t.cos()];
            if step >= 2 * STEPS {
                area += h * joint[1] * wild.force(joint, &memory, t);
            }
            let rates = wild.rates(joint, &memory);
            memory = std::array::from_fn(|i| memory[i] + h * rates[i]);
        }
        area
    }

    #[test]
    fn loops_take_the_energy_of_their_parts() {
        // Sliders: 4·F·(X − s) each. Dampers behind springs: π·k·τ/(1 + τ²) each. Relays: twice the
        // force times the way between turns.
        let sliders = Wild::Sliders {
            slips: [0.1, 0.2, 0.3, 0.4, 0.5, 2.0],
            forces: [1.0, 1.0, 2.0, 1.0, 1.0, 1.0],
        };
        let expected = 4.0 * (0.9 + 0.8 + 2.0 * 0.7 + 0.6 + 0.5);
        assert!((loop_area(sliders) / expected - 1.0).abs() < 2e-3);
        let relaxing = Wild::Relaxing {
            times_s: [0.05, 0.1, 0.2, 0.3, 0.4, 0.5],
            springs: [1.0, 2.0, 1.0, 1.0, 0.0, 1.0],
        };
        let expected: f64 = [(0.05, 1.0), (0.1, 2.0), (0.2, 1.0), (0.3, 1.0), (0.5, 1.0)]
            .iter()
            .map(|(time, spring)| 0.5 * TAU * spring * time / (1.0 + time * time))
            .sum();
        assert!((loop_area(relaxing) / expected - 1.0).abs() < 2e-3);
        let relays = Wild::Relays {
            up: [0.1, 0.2, 0.3, 0.4, 0.5, 3.0],
            down: [-0.1, -0.2, 0.0, 0.1, 0.2, -3.0],
            forces: [1.0; MEMORIES],
            turn: 1e-3,
        };
        let expected = 2.0 * (0.2 + 0.4 + 0.3 + 0.3 + 0.3);
        let area = loop_area(relays);
        assert!(
            (area / expected - 1.0).abs() < 2e-2,
            "{area} for {expected}"
        );
        let spring = Wild::Waves {
            turns: [1.0, 0.0],
            phases: [0.3, 1.0, 2.0],
        };
        assert!(loop_area(spring).abs() < 1e-6);
    }
}
