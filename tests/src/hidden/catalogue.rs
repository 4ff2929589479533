//! What can be hidden: every effect of the library, and effects outside of it, with forms drawn to
//! suit a motion.

use super::form::Form;
use super::rig::Base;
use super::sensors::InstrumentFault;
use super::sizes::Scale;
use super::wild::{self, Wild};
use jointwatch_shared::effect::EFFECTS;
use rand::{Rng, RngExt};
use std::f64::consts::TAU;

/// What a subject is to the diagnosis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A term that a user may have left out of the base.
    BaseTerm,
    /// Another effect of the joint that the library knows.
    Joint,
    /// An effect of the instruments that the library knows.
    Instrument,
    /// Outside the library: the verdict should be "unknown".
    Outside,
}

/// Something that can be hidden.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Subject {
    /// The library's name, or a phrase for what is outside of it.
    pub name: &'static str,
    /// What it is to the diagnosis.
    pub kind: Kind,
    /// Whether it takes two axes.
    pub takes_two_axes: bool,
    /// Whether it acts on both axes at once.
    pub acts_on_both: bool,
}

const fn subject(name: &'static str, kind: Kind) -> Subject {
    Subject {
        name,
        kind,
        takes_two_axes: false,
        acts_on_both: false,
    }
}

const fn coupling(name: &'static str, kind: Kind, acts_on_both: bool) -> Subject {
    Subject {
        name,
        kind,
        takes_two_axes: true,
        acts_on_both,
    }
}

/// Everything that can be hidden.
pub const SUBJECTS: [Subject; 31] = [
    subject("stiffness", Kind::BaseTerm),
    subject("viscous", Kind::BaseTerm),
    subject("clearance", Kind::BaseTerm),
    coupling("clearance_coupling", Kind::BaseTerm, true),
    subject("coulomb", Kind::Joint),
    subject("stribeck", Kind::Joint),
    subject("quadratic_drag", Kind::Joint),
    subject("cubic_hardening", Kind::Joint),
    subject("bilinear", Kind::Joint),
    subject("end_stop", Kind::Joint),
    subject("bouc_wen", Kind::Joint),
    subject("jenkins", Kind::Joint),
    subject("dahl", Kind::Joint),
    subject("lugre", Kind::Joint),
    subject("maxwell", Kind::Joint),
    subject("cogging", Kind::Joint),
    subject("preload", Kind::Joint),
    coupling("cross_coupling", Kind::Joint, true),
    subject("stiffness_drift", Kind::Joint),
    subject("inertia_error", Kind::Instrument),
    subject("force_gain", Kind::Instrument),
    subject("time_delay", Kind::Instrument),
    coupling("crosstalk", Kind::Instrument, false),
    subject("mains_hum", Kind::Instrument),
    subject("friction that comes and goes", Kind::Outside),
    subject(wild::NAMES[0], Kind::Outside),
    subject("unmeasured force", Kind::Outside),
    subject("stiffness that swings in time", Kind::Outside),
    subject(wild::NAMES[1], Kind::Outside),
    subject("spring of a random smooth shape", Kind::Outside),
    subject("damping on one side of the middle", Kind::Outside),
];

/// What can be hidden by name as well, but is not drawn: a campaign's cases follow from its seed
/// and the list above.
pub const BY_NAME: [Subject; 42] = [
    subject("exponential_spring", Kind::Joint),
    subject("gas_spring", Kind::Joint),
    subject("offset_contact", Kind::Joint),
    subject("cogging_harmonics", Kind::Joint),
    subject("offset_stops", Kind::Joint),
    subject("blow_off_damping", Kind::Joint),
    subject("force_drift", Kind::Instrument),
    subject("coulomb_by_direction", Kind::Joint),
    subject("viscous_by_direction", Kind::Joint),
    subject("gap_jenkins", Kind::Joint),
    subject("gap_jenkins_by_direction", Kind::Joint),
    subject("bouc_wen_by_direction", Kind::Joint),
    subject("power_spring", Kind::Joint),
    subject("power_damper", Kind::Joint),
    subject("power_spring_by_direction", Kind::Joint),
    subject("power_damper_by_direction", Kind::Joint),
    subject("digressive_damping", Kind::Joint),
    subject("lagged_friction", Kind::Joint),
    coupling("stiffness_by_other_squared", Kind::Joint, false),
    coupling("stiffness_by_other", Kind::Joint, false),
    coupling("damping_by_other_squared", Kind::Joint, false),
    coupling("damping_by_other", Kind::Joint, false),
    subject("position_friction", Kind::Joint),
    subject("load_friction", Kind::Joint),
    subject("mullins", Kind::Joint),
    subject("bouc_wen_hardening", Kind::Joint),
    subject("bouc_wen_pinching", Kind::Joint),
    subject("bouc_wen_degrading", Kind::Joint),
    subject("bouc_wen_baber_noori", Kind::Joint),
    subject("iwan", Kind::Joint),
    subject("generalized_maxwell", Kind::Joint),
    subject("backlash", Kind::Joint),
    subject("bouc_wen_by_rate", Kind::Joint),
    subject("bouc_wen_by_place", Kind::Joint),
    subject("power_contact", Kind::Joint),
    subject("self_centring", Kind::Joint),
    subject("periodic_friction", Kind::Joint),
    subject("delayed_feedback", Kind::Joint),
    subject("position_damping", Kind::Joint),
    subject(wild::NAMES[2], Kind::Outside),
    subject(wild::NAMES[3], Kind::Outside),
    subject(wild::NAMES[4], Kind::Outside),
];

/// Effects of the library that the campaign has no independent law for, and so never hides.
pub fn without_law() -> Vec<&'static str> {
    let names = EFFECTS.iter().map(|entry| entry.about.name);
    names
        .filter(|name| Subject::named(name).is_none())
        .collect()
}

/// A subject made ready for a rig.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Planted {
    /// A law in the joint.
    Law(Form),
    /// A fault of an instrument.
    InstrumentFault(InstrumentFault),
}

impl Subject {
    /// The subject of this name.
    pub fn named(name: &str) -> Option<&'static Self> {
        SUBJECTS.iter().chain(&BY_NAME).find(|s| s.name == name)
    }

    /// The sign of its strength: negative only where that means something.
    pub fn sign(&self, rng: &mut impl Rng) -> f64 {
        let either = [
            "preload",
            "cross_coupling",
            "stiffness_drift",
            "inertia_error",
            "force_gain",
            "crosstalk",
            "delayed_feedback",
        ];
        if either.contains(&self.name) && rng.random() {
            -1.0
        } else {
            1.0
        }
    }

    /// Draws its form to suit a motion of the given size; `base` is the whole joint before anything
    /// was taken from it.
    pub fn plant(
        &self,
        axis: usize,
        base: &Base,
        scale: &Scale,
        longest_s: f64,
        rng: &mut impl Rng,
    ) -> Planted {
        if let Some(wild) = Wild::draw(self.name, scale, longest_s, rng) {
            return Planted::Law(Form::Wild(wild));
        }
        let (x, v) = (scale.displacement, scale.velocity);
        // Friction turns within a speed that no differentiated encoder resolves.
        let edge = 0.004 * v;
        let phase = rng.random_range(0.0..TAU);
        let mut within = |low: f64, high: f64| low * (high / low).powf(rng.random::<f64>());
        let form = match self.name {
            "stiffness" => Form::Spring,
            "viscous" => Form::Damper,
            "clearance" => Form::Play {
                gap: base.gap[axis],
            },
            "clearance_coupling" => Form::ContactCoupling {
                gaps: base.gap,
                ratio: base.coupling[1] / base.coupling[0],
                lever: base.lever,
            },
            "coulomb" => Form::Dry { edge },
            "stribeck" => Form::Stribeck {
                ratio: within(1.4, 2.4),
                speed: v * within(0.1, 0.4),
                edge,
            },
            "quadratic_drag" => Form::Drag,
            "cubic_hardening" => Form::Duffing,
            "bilinear" => Form::OneSided,
            "end_stop" => Form::Stop {
                at: (scale.reach * within(0.5, 0.75)).max(1.4 * base.gap[axis]),
            },
            "bouc_wen" => Form::Wen {
                saturation: x * within(0.2, 0.8),
                roundness: within(0.5, 0.9),
                exponent: within(1.0, 2.0),
            },
            "jenkins" => Form::SpringSlider {
                slip: x * within(0.2, 0.8),
            },
            "dahl" => Form::Dahl {
                saturation: x * within(0.1, 0.5),
            },
            "lugre" => {
                let deflection = x * within(0.03, 0.15);
                Form::Bristles {
                    deflection,
                    ratio: within(1.2, 1.8),
                    speed: v * within(0.1, 0.4),
                    damping_s: deflection / v * within(0.2, 1.0),
                }
            }
            "maxwell" => Form::SpringDamper {
                relaxation_s: within(0.003, 0.025),
            },
            "cogging" => Form::Teeth {
                pitch: x * within(0.7, 2.5),
                phase,
            },
            "preload" => Form::Constant,
            "force_drift" => return Planted::InstrumentFault(InstrumentFault::Drift),
            name if BY_NAME.iter().any(|s| s.name == name) => {
                return Planted::Law(by_name(name, scale, &mut within));
            }
            "cross_coupling" => Form::CrossSpring,
            "stiffness_drift" => Form::GrowingSpring {
                duration_s: longest_s,
            },
            "inertia_error" => return Planted::InstrumentFault(InstrumentFault::WrongInertia),
            "force_gain" => return Planted::InstrumentFault(InstrumentFault::WrongGain),
            "time_delay" => return Planted::InstrumentFault(InstrumentFault::Late),
            "crosstalk" => return Planted::InstrumentFault(InstrumentFault::Crosstalk),
            "mains_hum" => {
                let nominal = if within(1.0, 4.0) < 2.0 { 60.0 } else { 50.0 };
                return Planted::InstrumentFault(InstrumentFault::Hum {
                    frequency_hz: nominal * within(0.999, 1.001),
                    phase,
                });
            }
            "friction that comes and goes" => Form::FrictionInBouts {
                edge,
                period_s: within(0.8, 4.0),
                phase,
            },
            "unmeasured force" => Form::Unlogged,
            "stiffness that swings in time" => Form::SwingingSpring {
                frequency_hz: within(3.0, 40.0),
                phase,
            },
            "spring of a random smooth shape" => Form::SmoothSpring {
                length: x * within(0.5, 1.5),
                phases: [phase, TAU * within(0.1, 1.0), TAU * within(0.1, 1.0)],
            },
            "damping on one side of the middle" => Form::HalfDamper { edge: 0.05 * x },
            name => unreachable!("{name} is in the list of subjects but has no form"),
        };
        Planted::Law(form)
    }
}

/// The form of a subject of [`BY_NAME`]; `within` draws evenly in the logarithm.
fn by_name(name: &str, scale: &Scale, within: &mut impl FnMut(f64, f64) -> f64) -> Form {
    let (x, v) = (scale.displacement, scale.velocity);
    let edge = 0.004 * v;
    // Which way is the stronger one, and by how much.
    let back = if name.ends_with("_by_direction") {
        within(0.3, 3.0)
    } else {
        1.0
    };
    match name {
        "mullins" => Form::Softening {
            excursion: scale.reach,
        },
        "coulomb_by_direction" => Form::SidedDry { edge, back },
        "viscous_by_direction" => Form::SidedDamper { back },
        "gap_jenkins" | "gap_jenkins_by_direction" => Form::GapSlider {
            gap: x * within(0.1, 0.5),
            slip: x * within(0.1, 0.5),
            back,
        },
        "bouc_wen_by_direction" => Form::SidedWen {
            saturation: x * within(0.2, 0.8),
            roundness: within(0.5, 0.9),
            exponent: within(1.0, 2.0),
            back,
        },
        "bouc_wen_pinching" => {
            let saturation = x * within(0.2, 0.8);
            Form::PinchedWen {
                saturation,
                exponent: within(1.0, 2.0),
                lost: within(0.7, 0.95),
                level: saturation * within(0.05, 0.3),
                width: saturation * within(0.15, 0.4),
            }
        }
        "bouc_wen_degrading" => Form::TiredWen {
            saturation: x * within(0.1, 0.4),
            exponent: within(1.0, 2.0),
            excursion: scale.reach * within(0.15, 0.6),
            slip: None,
        },
        "bouc_wen_baber_noori" => {
            let saturation = x * within(0.1, 0.4);
            Form::TiredWen {
                saturation,
                exponent: within(1.0, 2.0),
                excursion: scale.reach * within(0.15, 0.6),
                slip: Some(saturation * within(0.15, 0.5)),
            }
        }
        "bouc_wen_hardening" => {
            let both_ways = 1.0 / (scale.reach * within(0.7, 2.0));
            Form::HardeningWen {
                both_ways,
                unloading: both_ways * within(0.4, 0.9),
            }
        }
        "backlash" => Form::LostMotion {
            half: x * within(0.1, 0.6),
        },
        "bouc_wen_by_rate" => Form::ThickeningWen {
            saturation: x * within(0.1, 0.5),
            roundness: within(0.5, 0.9),
            exponent: within(1.0, 2.0),
            gain: within(0.5, 3.0),
            speed: v * within(0.2, 0.8),
        },
        "bouc_wen_by_place" => Form::PlacedWen {
            saturation: x * within(0.1, 0.5),
            roundness: within(0.5, 0.9),
            exponent: within(1.0, 2.0),
            length: scale.reach,
            along: within(0.1, 0.6) - 0.3,
            across: within(0.4, 2.0),
        },
        "power_contact" => Form::BufferedContact {
            gap: scale.reach * within(0.1, 0.5),
            exponent: within(1.4, 2.2),
            length: scale.reach,
            back: within(0.4, 2.5),
        },
        "self_centring" => {
            let gap = scale.reach * within(0.15, 0.5);
            Form::Flag {
                gap,
                opening: gap * within(0.2, 0.7),
            }
        }
        "power_spring" | "power_spring_by_direction" => Form::PowerSpring {
            exponent: within(1.4, 2.6),
            length: scale.reach,
            back,
        },
        "power_damper" | "power_damper_by_direction" => Form::PowerDamper {
            exponent: within(0.3, 0.7),
            speed: v,
            back,
        },
        "blow_off_damping" => Form::ReliefValve {
            opens: [v * within(0.2, 0.6), v * within(0.2, 0.6)],
            back: within(0.4, 2.5),
        },
        "offset_stops" => Form::PlacedContact {
            exponent: 1.0,
            length: 1.0,
            at: [
                scale.reach * within(-0.4, 0.7),
                -scale.reach * within(0.2, 0.8),
            ],
            back: within(0.3, 2.0),
        },
        "gas_spring" => Form::Piston {
            length: scale.reach * within(1.5, 3.0),
            index: within(1.0, 1.6),
            back: within(0.1, 1.0),
        },
        "exponential_spring" => Form::Foam {
            length: scale.reach * within(0.15, 0.4),
            back: within(0.1, 1.0),
        },
        "offset_contact" => Form::PlacedContact {
            at: [
                scale.reach * within(0.1, 0.7) * if within(1.0, 4.0) < 2.0 { -1.0 } else { 1.0 },
                -10.0 * scale.reach,
            ],
            exponent: within(1.4, 2.2),
            length: scale.reach,
            back: 1.0,
        },
        "cogging_harmonics" => Form::UnevenTeeth {
            pitch: x * within(0.4, 0.9),
            phases: [TAU * within(0.1, 1.0), TAU * within(0.1, 1.0)],
            second: within(0.3, 1.0),
        },
        "digressive_damping" => Form::Valve {
            knee: v * within(0.1, 0.5),
        },
        "lagged_friction" => Form::LateFriction {
            edge: 10.0 * edge,
            lag_s: within(0.005, 0.03),
        },
        "stiffness_by_other" => Form::SpringTimesOther { power: 1 },
        "stiffness_by_other_squared" => Form::SpringTimesOther { power: 2 },
        "damping_by_other" => Form::DamperTimesOther { power: 1 },
        "damping_by_other_squared" => Form::DamperTimesOther { power: 2 },
        "position_friction" => Form::TighterAlong {
            edge,
            length: scale.reach,
        },
        "position_damping" => Form::SqueezeFilm {
            centre: x * (within(0.5, 2.0) - 1.0),
        },
        "load_friction" => Form::RingSpring { edge },
        "periodic_friction" => Form::UnroundDry {
            pitch: x * within(0.7, 2.5),
            phase: TAU * within(0.1, 1.0),
            edge,
        },
        "delayed_feedback" => Form::LateSpring {
            delay_s: within(0.008, 0.025),
        },
        name => unreachable!("{name} is in the list of subjects but has no form"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use jointwatch_shared::effect::Entry;

    #[test]
    fn a_subject_is_of_the_library_or_outside_of_it() {
        println!("never hidden: {}", without_law().join(", "));
        for subject in SUBJECTS.iter().chain(&BY_NAME) {
            assert_eq!(Subject::named(subject.name), Some(subject));
            let known = Entry::named(subject.name).is_some();
            assert_eq!(known, subject.kind != Kind::Outside, "{}", subject.name);
        }
    }
}
