//! Derivatives, filters and spectra of logged signals.
