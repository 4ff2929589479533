//! Physical effects: force laws with named parameters, each in a file of its own, and the one table
//! that lists them.
//!
//! A new effect is a new file here and one line in [`EFFECTS`]. Everything else (the command line,
//! fits, diagnosis, the device, the docs and the tests) walks the table.

pub mod about;
mod backlash;
mod bilinear;
mod blow_off_damping;
mod bouc_wen;
mod bouc_wen_baber_noori;
mod bouc_wen_by_direction;
mod bouc_wen_by_place;
mod bouc_wen_by_rate;
mod bouc_wen_degrading;
mod bouc_wen_hardening;
mod bouc_wen_pinching;
mod by_direction;
mod clearance;
mod clearance_coupling;
mod cogging;
mod cogging_harmonics;
mod coulomb;
mod coulomb_by_direction;
mod cross_coupling;
mod crosstalk;
mod cubic_hardening;
mod dahl;
mod damping_by_other;
mod damping_by_other_squared;
mod delayed_feedback;
mod digressive_damping;
mod end_stop;
mod exponential_spring;
mod force_drift;
mod force_gain;
mod force_zero;
mod gap_jenkins;
mod gap_jenkins_by_direction;
mod gas_spring;
mod generalized_maxwell;
mod gravity;
mod inertia_error;
mod iwan;
mod jenkins;
mod lagged_friction;
mod law;
mod load_friction;
mod lugre;
mod mains_hum;
mod maxwell;
mod mullins;
mod offset_contact;
mod offset_stops;
mod periodic_friction;
mod position_damping;
mod position_friction;
mod power_contact;
mod power_damper;
mod power_damper_by_direction;
mod power_law;
mod power_spring;
mod power_spring_by_direction;
mod preload;
mod quadratic_drag;
mod self_centring;
mod stiffness;
mod stiffness_by_other;
mod stiffness_by_other_squared;
mod stiffness_drift;
mod stribeck;
mod time_delay;
mod viscous;
mod viscous_by_direction;

#[cfg(feature = "fit")]
pub use law::SLOPES;
pub use law::{
    Acts, Effect, Entry, ErrorPropagation, Instrument, Kinematics, Law, MAX_PARAMETERS, MAX_STATES,
    Parameters, StateBound, States, Subsystem,
};

impl Entry {
    /// The effect with this tag.
    pub fn with_tag(tag: u8) -> Option<&'static Self> {
        EFFECTS.iter().find(|entry| entry.tag == tag)
    }

    /// The effect of this name.
    #[cfg(feature = "fit")]
    pub fn named(name: &str) -> Option<&'static Self> {
        EFFECTS.iter().find(|entry| entry.about.name == name)
    }
}

/// Every effect that Jointwatch knows.
pub static EFFECTS: &[Entry] = &[
    Entry::of::<stiffness::Stiffness>(),
    Entry::of::<viscous::Viscous>(),
    Entry::of::<clearance::Clearance>(),
    Entry::of::<clearance_coupling::ClearanceCoupling>(),
    Entry::of::<coulomb::Coulomb>(),
    Entry::of::<cubic_hardening::CubicHardening>(),
    Entry::of::<preload::Preload>(),
    Entry::of::<stribeck::Stribeck>(),
    Entry::of::<quadratic_drag::QuadraticDrag>(),
    Entry::of::<bilinear::Bilinear>(),
    Entry::of::<end_stop::EndStop>(),
    Entry::of::<bouc_wen::BoucWen>(),
    Entry::of::<jenkins::Jenkins>(),
    Entry::of::<dahl::Dahl>(),
    Entry::of::<lugre::LuGre>(),
    Entry::of::<maxwell::Maxwell>(),
    Entry::of::<cogging::Cogging>(),
    Entry::of::<cross_coupling::CrossCoupling>(),
    Entry::of::<stiffness_drift::StiffnessDrift>(),
    Entry::of::<inertia_error::InertiaError>(),
    Entry::of::<force_gain::ForceGain>(),
    Entry::of::<time_delay::TimeDelay>(),
    Entry::of::<crosstalk::Crosstalk>(),
    Entry::of::<mains_hum::MainsHum>(),
    Entry::of::<coulomb_by_direction::CoulombByDirection>(),
    Entry::of::<viscous_by_direction::ViscousByDirection>(),
    Entry::of::<gap_jenkins::GapJenkins>(),
    Entry::of::<gap_jenkins_by_direction::GapJenkinsByDirection>(),
    Entry::of::<bouc_wen_by_direction::BoucWenByDirection>(),
    Entry::of::<power_spring::PowerSpring>(),
    Entry::of::<power_damper::PowerDamper>(),
    Entry::of::<power_spring_by_direction::PowerSpringByDirection>(),
    Entry::of::<power_damper_by_direction::PowerDamperByDirection>(),
    Entry::of::<digressive_damping::DigressiveDamping>(),
    Entry::of::<lagged_friction::LaggedFriction>(),
    Entry::of::<stiffness_by_other::StiffnessByOther>(),
    Entry::of::<stiffness_by_other_squared::StiffnessByOtherSquared>(),
    Entry::of::<damping_by_other::DampingByOther>(),
    Entry::of::<damping_by_other_squared::DampingByOtherSquared>(),
    Entry::of::<gravity::Gravity>(),
    Entry::of::<position_friction::PositionFriction>(),
    Entry::of::<load_friction::LoadFriction>(),
    Entry::of::<iwan::Iwan>(),
    Entry::of::<mullins::Mullins>(),
    Entry::of::<bouc_wen_by_rate::BoucWenByRate>(),
    Entry::of::<bouc_wen_by_place::BoucWenByPlace>(),
    Entry::of::<periodic_friction::PeriodicFriction>(),
    Entry::of::<power_contact::PowerContact>(),
    Entry::of::<backlash::Backlash>(),
    Entry::of::<force_zero::ForceZero>(),
    Entry::of::<bouc_wen_hardening::BoucWenHardening>(),
    Entry::of::<bouc_wen_pinching::BoucWenPinching>(),
    Entry::of::<force_drift::ForceDrift>(),
    Entry::of::<generalized_maxwell::GeneralizedMaxwell>(),
    Entry::of::<self_centring::SelfCentring>(),
    Entry::of::<blow_off_damping::BlowOffDamping>(),
    Entry::of::<offset_stops::OffsetStops>(),
    Entry::of::<gas_spring::GasSpring>(),
    Entry::of::<offset_contact::OffsetContact>(),
    Entry::of::<cogging_harmonics::CoggingHarmonics>(),
    Entry::of::<exponential_spring::ExponentialSpring>(),
    Entry::of::<bouc_wen_degrading::BoucWenDegrading>(),
    Entry::of::<bouc_wen_baber_noori::BoucWenBaberNoori>(),
    Entry::of::<delayed_feedback::DelayedFeedback>(),
    Entry::of::<position_damping::PositionDamping>(),
];
