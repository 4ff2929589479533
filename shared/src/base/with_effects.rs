//! Adding physical effects to a base, and bringing both to one force unit; what only the host does.

use super::terms::{EffectValues, Terms};
use super::terms_quantise::FULL_SCALE;
use super::{Base, Header, MAX_BASE_SHIFT, Model, Output};
use crate::fault::Error;
use heapless::Vec;

/// The effects alone may reach this part of the full scale: the measured force beside them has
/// noise and peaks.
const ROOM: f64 = 0.125;

impl Model {
    /// A model whose force is that of effects alone, on as many axes as the header has.
    ///
    /// `budgets` is the largest error bound allowed per axis, in N or N·m; `f64::INFINITY` allows
    /// any.
    ///
    /// # Errors
    /// As [`Terms::quantise`] and [`Header::check`]; [`Error::EffectBudget`] when a bound is above
    /// its budget.
    pub fn from_effects(
        header: Header,
        terms: &[EffectValues],
        budgets: &[f64],
    ) -> Result<Self, Error> {
        header.check()?;
        let mut outputs = Vec::new();
        for (_, largest) in header
            .axes
            .iter()
            .zip(Terms::largest_forces(&header, terms))
        {
            let largest = if largest > 0.0 { largest } else { 1.0 };
            // Two axes at most.
            let _ = outputs.push(Output {
                force_per_lsb: largest / (ROOM * FULL_SCALE),
                error_bound: 0.0,
            });
        }
        let axes = header.axes.len() as u8;
        Self::new(header, outputs, Base::None { axes })?.finish([0; 2], terms, budgets)
    }

    /// This model with effects added to its base.
    ///
    /// # Errors
    /// As [`Model::from_effects`]; [`Error::OutOfRange`] when the effects are more than 2¹⁴ times
    /// the base.
    pub fn adding_effects(
        mut self,
        terms: &[EffectValues],
        budgets: &[f64],
    ) -> Result<Self, Error> {
        if terms.is_empty() {
            return Ok(self);
        }
        let mut shifts = [0; 2];
        let largest = Terms::largest_forces(&self.header, terms);
        for ((output, shift), largest) in self.outputs.iter_mut().zip(&mut shifts).zip(largest) {
            let base = output.force_per_lsb * FULL_SCALE;
            while base + largest > base * f64::from(1_u32 << *shift) && *shift < MAX_BASE_SHIFT {
                *shift += 1;
            }
            output.force_per_lsb *= f64::from(1_u32 << *shift);
        }
        self.finish(shifts, terms, budgets)
    }

    fn finish(
        self,
        shifts: [u8; 2],
        terms: &[EffectValues],
        budgets: &[f64],
    ) -> Result<Self, Error> {
        let mut force_per_lsb = [1.0; 2];
        for (place, output) in force_per_lsb.iter_mut().zip(&self.outputs) {
            *place = output.force_per_lsb;
        }
        let (terms, errors) = Terms::quantise(&self.header, force_per_lsb, terms)?;
        let mut outputs = self.outputs;
        for (axis, (output, error)) in (0..).zip(outputs.iter_mut().zip(errors)) {
            let rounding = if shifts[usize::from(axis)] > 0 {
                0.5
            } else {
                0.0
            };
            output.error_bound += error + rounding * output.force_per_lsb;
            let budget = budgets.get(usize::from(axis)).copied();
            let budget = budget.unwrap_or(f64::INFINITY);
            if output.error_bound > budget {
                return Err(Error::EffectBudget {
                    axis,
                    bound: output.error_bound,
                    budget,
                });
            }
        }
        Self::with_effects(self.header, outputs, self.base, shifts, terms)
    }
}
