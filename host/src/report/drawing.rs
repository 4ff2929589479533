//! Drawings as files: each has a name and an SVG document.

use super::figure::Figure;
use crate::error::{Error, Result};
use crate::output;
use std::path::Path;

/// A figure as it is written.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    /// Its file's name.
    pub file: String,
    /// The SVG document.
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

/// Writes drawings into a folder, which is made where it is missing; files of the same names are replaced.
///
/// # Errors
/// [`crate::error::Kind::Failed`] when the folder cannot be made or a file cannot be written.
pub fn write(drawings: &[Drawing], folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|e| {
        Error::failed(format!(
            "{}: this folder for the pictures could not be made ({e}); name another one",
            folder.display()
        ))
    })?;
    for drawing in drawings {
        output::write_whole(&folder.join(&drawing.file), drawing.svg.as_bytes())?;
    }
    Ok(())
}
