//! Sign and unit of the force, by the mass, damping and stiffness that it shows.

use super::slips::{FORCES, TORQUES};
use super::{Axis, LIMITS};
use crate::study::channels::units::Quantity;
use crate::study::check::kinematics::{alike, joint_motion};
use crate::study::check::linear::{Fitted, Linear};
use crate::study::series::dot;
use crate::study::{AxisKind, Channels, Convention};
use crate::text::table::short;

/// Blocks of rows of all records together, and of each alone.
const BLOCKS: usize = 24;

impl Axis<'_> {
    /// What the force of one file says against those of others, else that of all together. One file
    /// counts one way: where its parts differ, it is the joint that does.
    pub(super) fn force(&self) -> Option<String> {
        let moving = self.moving_records();
        let blocks = BLOCKS.div_ceil(moving.len().max(1));
        let (mut all, mut all_work) = (self.fit(), 0.0);
        let (mut right, mut turned): (Vec<&str>, Vec<&str>) = (Vec::new(), Vec::new());
        for record in moving {
            let mut alone = self.fit();
            let work = self.add(
                &record.axes[self.index],
                [(&mut all, blocks), (&mut alone, BLOCKS)],
            );
            all_work += work;
            match alone
                .solve()
                .and_then(|fitted| self.is_right(&fitted, work))
            {
                Some(true) => right.push(&record.file),
                Some(false) => turned.push(&record.file),
                None => {}
            }
        }
        turned.retain(|file| !right.contains(file));
        match turned.first().filter(|_| !right.is_empty()) {
            Some(file) => Some(self.turned_sentence(file)),
            None => self.force_sentence(&all.solve()?, all_work),
        }
    }

    fn has_no_inertia(&self) -> bool {
        self.axis().inertia == Some(0.0)
    }

    /// Force by velocity, displacement and acceleration, without the latter where the force is the
    /// joint's own.
    fn fit(&self) -> Linear {
        Linear::new(if self.has_no_inertia() { 2 } else { 3 })
    }

    /// Adds a record to fits, in so many blocks; gives the work that the joint takes in by the
    /// signs as they are, times the sample rate.
    fn add(&self, channels: &Channels, fits: [(&mut Linear, usize); 2]) -> f64 {
        let x = channels.relative_displacement();
        // What is derived is that of the body, against which a single column may count.
        let body = channels.body_position.as_ref().unwrap_or(&x);
        let logged = channels.acceleration.as_deref();
        let ([x, v, a], lag) = joint_motion(&x, body, logged, self.study.sample_rate_hz);
        let force = alike(&channels.force, lag);
        for (fit, blocks) in fits {
            match self.has_no_inertia() {
                true => fit.add(&[&v, &x], &force, blocks),
                false => fit.add(&[&v, &x, &a], &force, blocks),
            }
        }
        self.axis().restoring_force.sign() * dot(&force, &v)
    }

    /// Whether a force counts as the study says, by the body's mass or the energy that the joint
    /// takes in; nothing where neither tells, or where a force that stands still makes the work
    /// another one than that of what varies.
    fn is_right(&self, fitted: &Fitted, work: f64) -> Option<bool> {
        match fitted.coefficients.get(2) {
            Some(mass) if fitted.sure(2) => Some(*mass > 0.0),
            // No lateness of a channel turns so large a share.
            _ if fitted.sure(0) && fitted.shares[0] > LIMITS.large => {
                let damps = self.axis().restoring_force.sign() * fitted.coefficients[0] > 0.0;
                (damps == (work > 0.0)).then_some(damps)
            }
            _ => None,
        }
    }

    /// What is told of a record whose force counts the other way than that of another one.
    fn turned_sentence(&self, file: &str) -> String {
        format!(
            "axis {}: the force (column \"{}\") of {file} counts the other way than that of another file, as if a mass were negative or the \
             joint gave out energy there: turn its sign, or the displacement's (column \"{}\"), in that file",
            self.axis().name,
            self.columns.force,
            self.columns.displacement
        )
    }

    /// What is told of all records together.
    fn force_sentence(&self, fitted: &Fitted, work: f64) -> Option<String> {
        let axis = self.axis();
        let column = &self.columns.force;
        let sign = axis.restoring_force.sign();
        let [damping, stiffness] = [0, 1].map(|i| sign * fitted.coefficients[i]);
        let mass = (!self.has_no_inertia() && fitted.sure(2)).then(|| fitted.coefficients[2]);
        let gains_energy = fitted.sure(0) && damping < 0.0 && work < 0.0;
        let pushes_away = fitted.sure(1) && stiffness < 0.0;
        let other = match axis.restoring_force {
            Convention::ForceMinusInertia => "inertia_minus_force",
            Convention::InertiaMinusForce => "force_minus_inertia",
        };
        let name = &axis.name;
        if let Some(mass) = mass
            && mass < 0.0
        {
            return Some(format!(
                "axis {name}: the force (column \"{column}\") acts against the acceleration, as if the body's mass were {} {}: \
                 its sign is turned; write force = {{ column = \"{column}\", scale = -1.0 }}, keeping its unit",
                short(mass),
                axis.kind.inertia_unit()
            ));
        }
        let large = fitted.shares[0] > LIMITS.large;
        if gains_energy && (pushes_away || !fitted.sure(1) && large) {
            return Some(format!(
                "axis {name}: by these signs the joint gives out energy and pushes away from rest, which a passive joint does not: the \
                 force (column \"{column}\") or the displacement (column \"{}\") counts the other way; write restoring_force = \
                 \"{other}\", or turn one of them with scale = -1.0",
                self.columns.displacement
            ));
        }
        let (Some(mass), Some(stated)) = (mass, axis.inertia) else {
            return None;
        };
        let ratio = mass / stated;
        if (LIMITS.mass..1.0 / LIMITS.mass).contains(&ratio) {
            return None;
        }
        let kind = axis.kind;
        let in_si = |unit: &str| Quantity::Force(kind).factor(unit, true).unwrap_or(1.0);
        // Which unit the numbers are in, where the study takes them for another one.
        let of_study = self.columns.force_unit.as_deref().map_or(1.0, in_si);
        let off = |unit: &str| (ratio * in_si(unit) / of_study).ln().abs();
        let units = match kind {
            AxisKind::Translation => FORCES,
            AxisKind::Rotation => TORQUES,
        };
        let unit = units
            .iter()
            .copied()
            .filter(|unit| in_si(unit) != of_study)
            .min_by(|a, b| off(a).total_cmp(&off(b)))
            .filter(|unit| off(unit) < 2.0 * (1.0 / LIMITS.mass).ln().min(0.5));
        let cause = match unit {
            Some(unit) => format!(
                "probably the force is in {unit}; write force = {{ column = \"{column}\", unit = {unit:?} }}, or correct inertia"
            ),
            None => "correct the unit of force or inertia".to_owned(),
        };
        Some(format!(
            "axis {name}: the force (column \"{column}\") moves a mass of {mass:.3e} {unit} where study.toml states inertia = {stated}: \
             {cause}",
            unit = kind.inertia_unit()
        ))
    }
}
