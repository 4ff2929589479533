//! What an effect says of itself to people and to fits; of all this the device keeps the number of
//! parameters.

use crate::units::Dimension;

/// An effect in words.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct About {
    /// Its name on the command line and in files.
    pub name: &'static str,
    /// What it is, in a few words.
    pub title: &'static str,
    /// The force, in symbols that the parameters explain.
    pub equation: &'static str,
    /// Where the law comes from.
    pub source: &'static str,
    /// What a model that lacks it leaves in its residual.
    pub residual_signature: &'static str,
    /// Which experiment tells it from the effects that look like it.
    pub separated_by: &'static str,
    /// Its parameters, in the order in which the law takes them.
    pub parameters: &'static [Parameter],
}

/// One parameter of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// The parameter's name on the command line and in files.
    pub name: &'static str,
    /// The symbol in the equation.
    pub symbol: &'static str,
    /// What the parameter is, in a few words.
    pub meaning: &'static str,
    /// Its dimension, from which its unit and its scale on the device follow.
    pub dimension: Dimension,
    /// How it is found.
    pub role: Role,
}

/// How a parameter enters its law, which decides how a fit finds it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Role {
    /// The force is proportional to it: found exactly by least squares.
    Linear {
        /// Whether only positive values are physical.
        positive: bool,
    },
    /// The force is proportional to it, and it is another one in every record: least squares finds
    /// it in every record anew, and the value that is reported is the root mean square of the
    /// records' sizes.
    SizePerRecord {
        /// Whether every record also begins at a phase of its own, found with the size.
        with_phase: bool,
    },
    /// It shapes the law: searched for, from several starts.
    Shape(Shape),
}

/// The search for a parameter that shapes its law. Values are positive and relative to the
/// reference of the parameter's dimension: half the training range of displacement or velocity, a
/// second for time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape {
    /// Where the search starts, smallest first.
    pub starts: &'static [f64],
    /// The smallest value allowed.
    pub least: f64,
    /// The largest value allowed.
    pub most: f64,
    /// Whether the law takes 1/value, as it has no division.
    pub reciprocal: bool,
    /// The same quantity in another effect: when a model has both, they are one unknown.
    pub tie: Option<Tie>,
}

/// A parameter that belongs to another effect as well.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tie {
    /// The other effect's name.
    pub effect: &'static str,
    /// Name of the parameter of the other effect.
    pub parameter: &'static str,
    /// Whether it is the effect on the other axis.
    pub other_axis: bool,
}

impl Shape {
    /// A quantity that is not searched for: it has the one value in the list, and the law takes one
    /// over it.
    pub const fn given(value: &'static [f64; 1]) -> Self {
        Self {
            starts: value,
            least: value[0],
            most: value[0],
            reciprocal: true,
            tie: None,
        }
    }

    /// Whether it has one value and is not searched for.
    pub fn is_given(&self) -> bool {
        self.least >= self.most
    }
}

impl Parameter {
    /// A parameter that the force is proportional to.
    pub const fn linear(
        name: &'static str,
        symbol: &'static str,
        meaning: &'static str,
        dimension: Dimension,
        positive: bool,
    ) -> Self {
        Self {
            name,
            symbol,
            meaning,
            dimension,
            role: Role::Linear { positive },
        }
    }

    /// Whether the force is proportional to it.
    pub fn is_linear(&self) -> bool {
        matches!(self.role, Role::Linear { .. } | Role::SizePerRecord { .. })
    }

    /// Whether it has one value and is not searched for.
    pub fn is_given(&self) -> bool {
        matches!(self.role, Role::Shape(shape) if shape.is_given())
    }

    /// Whether its size is another one in every record.
    pub fn is_per_record(&self) -> bool {
        self.phases() > 0
    }

    /// Phases at which the law is evaluated in each record to find its size there: two, a quarter
    /// of a turn apart, when the phase is the record's own as well; none when the size is not.
    pub fn phases(&self) -> usize {
        match self.role {
            Role::SizePerRecord { with_phase } => 1 + usize::from(with_phase),
            Role::Linear { .. } | Role::Shape(_) => 0,
        }
    }

    /// The value as its law takes it: itself, or one over it.
    pub fn as_law_takes_it(&self, value: f64) -> f64 {
        match self.role {
            Role::Shape(Shape {
                reciprocal: true, ..
            }) => 1.0 / value,
            _ => value,
        }
    }

    /// The dimension of what the law takes.
    pub fn dimension_in_law(&self) -> Dimension {
        match self.role {
            Role::Shape(Shape {
                reciprocal: true, ..
            }) => self.dimension.inverse(),
            _ => self.dimension,
        }
    }
}
