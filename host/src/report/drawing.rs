//! Drawings as files: each has a name and an SVG document.

use super::figure::Figure;
use crate::text::error::{Error, Result};
use crate::text::output;
use std::path::Path;

/// A figure as it is written.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    /// Name of its file.
    pub file: String,
    /// The drawing as an SVG document.
    pub svg: String,
}

impl Drawing {
    /// A figure under a name without its ending.
    ///
    /// # Errors
    /// As [`Figure::svg`].
    pub fn new(name: &str, figure: &Figure) -> Result<Self> {
        Ok(Self::of_svg(name, figure.svg()?))
    }

    /// A document that is drawn already.
    pub(super) fn of_svg(name: &str, svg: String) -> Self {
        Self {
            file: format!("{name}.svg"),
            svg,
        }
    }
}

/// Makes the folder for drawings where it is missing.
///
/// # Errors
/// [`crate::text::error::Kind::Failed`] when it cannot be made.
pub fn make(folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|e| {
        Error::failed(format!(
            "{}: this folder for the pictures could not be made ({e}); name another one",
            folder.display()
        ))
    })
}

/// Writes drawings into a folder, which is made where it is missing; files of the same names are
/// replaced.
///
/// # Errors
/// As [`make`]; when a file cannot be written.
pub fn write(drawings: &[Drawing], folder: &Path) -> Result<()> {
    make(folder)?;
    for drawing in drawings {
        output::write_whole(&folder.join(&drawing.file), drawing.svg.as_bytes())?;
    }
    Ok(())
}
