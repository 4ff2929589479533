//! The mistakes of a first study.toml: a sign, a unit, a column of another kind. Each is told with
//! its probable cause and the line to change, before anything is fitted.
//!
//! The checks use identities that hold for every joint: a logged acceleration is the second
//! derivative of its body's position, a velocity the first of the displacement, a body's mass is
//! positive and its known value, and a passive joint takes energy out. What a joint does beyond
//! that (friction, clearance, hysteresis, a late channel) fires none of them.

mod force;
mod slips;

use super::check::kinematics::{Likeness, clear_lag, derivative_likeness, motion};
use super::description::{ChannelTable, Description, Source};
use super::series::{range, spread};
use super::{AxisKind, Channels, Convention, Record, Study};
use slips::{ANGULAR_SLIPS, Cure, LINEAR_SLIPS, SPEED_SLIPS, Slip, TURNING_SLIPS};

/// Limits of the checks, each set by the thirty simulated rigs and the measured studies of
/// `tests/tests/logs/first_day.rs`.
struct Limits {
    /// Correlation from which on one channel is believed to be the derivative of another.
    alike: f64,
    /// Gains between this and its reciprocal are calibration, not a mistake.
    gain: f64,
    /// Likewise for the mass that the force shows, which friction and clearance disturb.
    mass: f64,
    /// How near a gain must be to that of a known slip to be called one.
    near: f64,
    /// An axis moves in a record with at least this part of its liveliest.
    moves: f64,
    /// A share of the force that no lateness of a channel gives damping the wrong sign with.
    large: f64,
    /// m/s that no joint moves at.
    speed_m_s: f64,
    /// m that no joint travels.
    travel_m: f64,
    /// rad beyond which a number without a unit may well be one of degrees.
    turn_rad: f64,
}

const LIMITS: Limits = Limits {
    alike: 0.95,
    gain: 0.75,
    mass: 0.4,
    near: 0.12,
    moves: 0.1,
    large: 0.3,
    speed_m_s: 300.0,
    travel_m: 10.0,
    turn_rad: 2.0 * std::f64::consts::TAU,
};

/// Looks for the mistakes of a first day; one sentence each, without a full stop. A sound study
/// gives none.
pub fn check(study: &Study) -> Vec<String> {
    let text = std::fs::read_to_string(&study.path).unwrap_or_default();
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    let source = Source::file(&study.path, text);
    let said: Option<Description> = source.parse("reference/study.md").ok();
    let mut found = Vec::new();
    for index in 0..study.axes.len() {
        let axis = Axis {
            study,
            index,
            columns: Columns::of(said.as_ref(), index),
        };
        let acceleration = axis.acceleration();
        let wrong_acceleration = acceleration.is_some();
        found.extend(acceleration);
        let velocity = axis.velocity();
        // What is wrong between channels says which unit it is.
        let speed = if wrong_acceleration || velocity.is_some() {
            None
        } else {
            axis.speed()
        };
        found.extend(velocity.or(speed));
        found.extend(axis.turn());
        // A wrong acceleration makes every statement on force and mass wrong as well.
        if !wrong_acceleration {
            found.extend(axis.force());
        }
    }
    found
}

/// The columns of an axis, as study.toml names them.
#[derive(Default)]
struct Columns {
    displacement: String,
    /// Whether the study states the displacement's unit.
    has_unit: bool,
    position: String,
    velocity: String,
    acceleration: String,
    /// Whether the position is that acceleration, integrated.
    is_integrated: bool,
    force: String,
    /// The unit that the study states for the force.
    force_unit: Option<String>,
}

impl Columns {
    fn of(said: Option<&Description>, index: usize) -> Self {
        let Some(axis) = said.and_then(|s| s.axis.get(index)) else {
            return Self::default();
        };
        let list = |tables: &[ChannelTable]| {
            let names: Vec<&str> = tables.iter().map(|t| t.column.as_str()).collect();
            names.join("\", \"")
        };
        // Without a displacement the velocity is integrated.
        let position = axis.displacement.as_ref().or(axis.velocity.as_ref());
        let displacement = position.map_or(String::new(), |d| list(&d.get_ref().0));
        let has_unit = position.is_some_and(|d| d.get_ref().0.iter().any(|c| c.unit.is_some()));
        let one = |channel: &Option<toml::Spanned<super::description::Channel>>| {
            channel.as_ref().map(|c| c.get_ref().0.column.clone())
        };
        let acceleration = one(&axis.acceleration).unwrap_or_default();
        let mut sources = position.iter().flat_map(|d| &d.get_ref().0);
        Self {
            is_integrated: axis.body_position.is_none()
                && sources.any(|source| source.column == acceleration),
            position: one(&axis.body_position).unwrap_or_else(|| displacement.clone()),
            displacement,
            has_unit,
            velocity: axis
                .velocity
                .as_ref()
                .map_or(String::new(), |v| list(&v.get_ref().0)),
            acceleration,
            force: list(axis.force.get_ref().columns()),
            force_unit: match axis.force.get_ref().columns() {
                [only] => only.unit.clone(),
                _ => None,
            },
        }
    }
}

struct Axis<'a> {
    study: &'a Study,
    index: usize,
    columns: Columns,
}

impl Axis<'_> {
    fn axis(&self) -> &super::Axis {
        &self.study.axes[self.index]
    }

    /// The records in which the axis moves, the liveliest first.
    fn moving_records(&self) -> Vec<&Record> {
        let mut all: Vec<(f64, &Record)> = self
            .study
            .records
            .iter()
            .map(|record| {
                let channels = &record.axes[self.index];
                (spread(&channels.relative_displacement()), record)
            })
            .collect();
        all.sort_by(|a, b| b.0.total_cmp(&a.0));
        let most = all.first().map_or(0.0, |a| a.0);
        let moving = all
            .into_iter()
            .filter(|(size, _)| *size > 0.0 && *size >= LIMITS.moves * most);
        moving.map(|(_, record)| record).collect()
    }

    /// The axis's channels in them.
    fn moving(&self) -> Vec<&Channels> {
        let records = self.moving_records().into_iter();
        records.map(|record| &record.axes[self.index]).collect()
    }

    fn acceleration(&self) -> Option<String> {
        let channels = *self.moving().first()?;
        let logged = channels.acceleration.as_ref()?;
        // Against itself a column says nothing.
        if self.columns.is_integrated {
            return None;
        }
        let rate = self.study.sample_rate_hz;
        let against = |position: &[f64]| derivative_likeness(logged, position, 2, rate);
        // Without the body's own position, either side may be the body; with one column the
        // convention says which way it counts.
        let tried: Vec<Likeness> = match (&channels.body_position, &channels.displacement_second) {
            (Some(body), _) => vec![against(body)],
            (None, Some(second)) => vec![
                against(second),
                against(&channels.displacement_first),
                against(&channels.relative_displacement()),
            ],
            (None, None) => {
                let found = against(&channels.displacement_first);
                let sign = self.axis().restoring_force.sign();
                vec![Likeness {
                    correlation: found.correlation * sign,
                    gain: found.gain * sign,
                }]
            }
        };
        let single = channels.body_position.is_none() && channels.displacement_second.is_none();
        let sound = |l: &Likeness| (LIMITS.gain..1.0 / LIMITS.gain).contains(&l.gain);
        let sure = |l: &&Likeness| l.correlation.abs() > LIMITS.alike;
        if tried.iter().any(|l| sure(&l) && sound(l)) {
            return None;
        }
        let best = tried
            .iter()
            .filter(sure)
            .max_by(|a, b| a.correlation.abs().total_cmp(&b.correlation.abs()))?;
        let gain = best.gain;
        let turned = if gain < 0.0 { -1.0 } else { 1.0 };
        let column = &self.columns.acceleration;
        let what = format!(
            "axis {}: the acceleration (column {column:?}) is {} times the second derivative of the position (column \"{}\")",
            self.axis().name,
            in_words(gain),
            self.columns.position
        );
        if (LIMITS.gain..1.0 / LIMITS.gain).contains(&gain.abs()) {
            let more = if single {
                let other = match self.axis().restoring_force {
                    Convention::ForceMinusInertia => "inertia_minus_force",
                    Convention::InertiaMinusForce => "force_minus_inertia",
                };
                format!(
                    ", or if the displacement counts against the body's motion, restoring_force = \"{other}\""
                )
            } else {
                String::new()
            };
            return Some(format!(
                "{what}: its sign is turned, probably because the accelerometer is mounted the other way round; write acceleration \
                 = {{ column = {column:?}, scale = -1.0 }}{more}, keeping its unit"
            ));
        }
        let slips = match self.axis().kind {
            AxisKind::Translation => LINEAR_SLIPS,
            AxisKind::Rotation => ANGULAR_SLIPS,
        };
        Some(self.slip(&what, slips, gain, turned, "acceleration", column))
    }

    fn velocity(&self) -> Option<String> {
        // Without time there is a direction and no velocity.
        if self.study.quasi_static {
            return None;
        }
        let channels = *self.moving().first()?;
        let logged = channels.velocity.as_ref()?;
        let found = derivative_likeness(
            logged,
            &channels.relative_displacement(),
            1,
            self.study.sample_rate_hz,
        );
        if found.correlation.abs() < LIMITS.alike
            || (LIMITS.gain..1.0 / LIMITS.gain).contains(&found.gain)
        {
            return None;
        }
        let column = &self.columns.velocity;
        let what = format!(
            "axis {}: the velocity (column \"{column}\") is {} times the derivative of the displacement (column \"{}\")",
            self.axis().name,
            in_words(found.gain),
            self.columns.displacement
        );
        if (LIMITS.gain..1.0 / LIMITS.gain).contains(&-found.gain) {
            return Some(format!(
                "{what}: its sign is turned; write velocity = {{ column = \"{column}\", scale = -1.0 }}, keeping its unit, or leave \
                 velocity out so that it is derived"
            ));
        }
        let slips = match self.axis().kind {
            AxisKind::Translation => SPEED_SLIPS,
            AxisKind::Rotation => TURNING_SLIPS,
        };
        let turned = found.gain.signum();
        Some(self.slip(&what, slips, found.gain, turned, "velocity", column))
    }

    /// The sentence on a gain that is none: the slip that is nearest, or the factor alone.
    fn slip(
        &self,
        what: &str,
        slips: &[Slip],
        gain: f64,
        turned: f64,
        key: &str,
        column: &str,
    ) -> String {
        let off = |slip: &Slip| (gain.abs() / slip.gain).ln().abs();
        let nearest = slips.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
        let sign = if turned < 0.0 { ", scale = -1.0" } else { "" };
        let also = if turned < 0.0 {
            ", and its sign is turned"
        } else {
            ""
        };
        match nearest.filter(|slip| off(slip) < LIMITS.near) {
            Some(slip) => match slip.cure {
                Cure::Derivative(unit) => format!(
                    "{what}: probably {}{also}; write {key} = {{ column = \"{column}\", unit = {unit:?}{sign} }}",
                    slip.cause
                ),
                Cure::Position(unit) => {
                    let position = if key == "velocity" {
                        &self.columns.displacement
                    } else {
                        &self.columns.position
                    };
                    format!(
                        "{what}: probably {}{also}; write unit = {unit:?} for column \"{position}\" and every other displacement in \
                         that unit, {{ column = …, unit = {unit:?} }}",
                        slip.cause
                    )
                }
            },
            None => format!(
                "{what}{also}: a unit or a scale is wrong, or the column is another one; correct {key}, or leave it out so that it \
                 is derived"
            ),
        }
    }

    fn speed(&self) -> Option<String> {
        if self.axis().kind == AxisKind::Rotation {
            return None;
        }
        let channels = *self.moving().first()?;
        // A velocity that was logged alone comes to be a long way.
        if self.columns.displacement == self.columns.velocity {
            return None;
        }
        let x = channels.relative_displacement();
        let [_, v, _] = motion(&x, clear_lag(&x), self.study.sample_rate_hz);
        let fastest = v.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let does = match range(&x) {
            travel if travel > LIMITS.travel_m => format!("travels {travel:.0} m"),
            _ if fastest > LIMITS.speed_m_s => format!("moves at up to {fastest:.0} m/s"),
            _ => return None,
        };
        Some(format!(
            "axis {}: the displacement (column \"{}\") {does}, which no joint does: {}",
            self.axis().name,
            self.columns.displacement,
            match (range(&x) * 1e-3 > LIMITS.travel_m, self.columns.has_unit) {
                (true, _) =>
                    "if it counts an encoder, write how many m one count is as its scale, or kind = \"rotation\" and how many rad",
                (false, true) =>
                    "probably it is in mm; write displacement = { column = …, unit = \"mm\" }",
                (false, false) =>
                    "if it is in mm, write displacement = { column = …, unit = \"mm\" }; if it is an angle, kind = \"rotation\" for the axis \
                     and unit = \"deg\" or \"rad\"",
            }
        ))
    }

    /// An angle without a unit that goes round more than twice.
    fn turn(&self) -> Option<String> {
        if self.axis().kind == AxisKind::Translation || self.columns.has_unit {
            return None;
        }
        let angle = range(&self.moving().first()?.relative_displacement());
        let column = &self.columns.displacement;
        (angle > LIMITS.turn_rad).then(|| {
            format!(
                "axis {}: in rad, as no unit is stated, the displacement (column \"{column}\") turns by {angle:.0} rad, {:.0} times round; write \
                 displacement = {{ column = \"{column}\", unit = \"deg\" }} if these are degrees, or unit = \"rad\" if they are not",
                self.axis().name,
                angle / std::f64::consts::TAU
            )
        })
    }
}

/// A factor as a person says it.
fn in_words(gain: f64) -> String {
    if (0.01..10_000.0).contains(&gain.abs()) {
        format!("{gain:.3}")
    } else {
        format!("{gain:.2e}")
    }
}
