//! Bayesian regularisation: how strongly large weights are held back follows from the data.
//!
//! Weights are normal with precision α, residuals with precision β; both are re-estimated as
//! training goes on (MacKay, Neural Computation 4 (1992) 415 and 448; Foresee and Hagan, Proc. ICNN
//! 1997, 1930). With P weights, N residuals, the Gauss–Newton matrix H = β·JᵀJ + α·I, E_D = ½·Σ r²
//! and E_W = ½·Σ w²:
//!
//! γ = P − α·tr H⁻¹, α = γ/(2·E_W), β = (N − γ)/(2·E_D).
//!
//! γ is the number of weights that the data determine.

use super::projection::Spread;

/// The precisions of weights and residuals; outputs are normalised to ±1, so neither has a unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Precisions {
    /// α, of the weights.
    pub(super) alpha: f64,
    /// β, of the residuals.
    pub(super) beta: f64,
}

/// The sizes that the estimates are made from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sizes {
    /// P: weights and biases of both layers.
    pub(super) parameters: f64,
    /// N: rows times outputs.
    pub(super) residuals: f64,
    /// Σ r² over all residuals.
    pub(super) squared_error: f64,
    /// Σ w² over all weights and biases.
    pub(super) squared_weights: f64,
}

/// Limits of ρ = α/β per residual: beyond them the matrices lose their digits, or nothing is
/// learnt.
const RIDGE_PER_RESIDUAL: [f64; 2] = [1e-13, 1.0];

impl Precisions {
    /// ρ = α/β: what Σ w² counts beside Σ r² in what is minimised.
    pub(super) fn ridge(self) -> f64 {
        self.alpha / self.beta
    }

    /// γ: the number of weights that the data determine, 0 to P.
    pub(super) fn effective_parameters(self, sizes: Sizes, spread: Spread) -> f64 {
        (sizes.parameters - self.ridge() * spread.trace).clamp(0.0, sizes.parameters)
    }

    /// Both precisions estimated anew from γ.
    pub(super) fn update(sizes: Sizes, effective: f64) -> Self {
        let effective = effective.max(1.0);
        let beta = (sizes.residuals - effective).max(1.0) / sizes.squared_error;
        let alpha = effective / sizes.squared_weights.max(f64::MIN_POSITIVE);
        let [low, high] = RIDGE_PER_RESIDUAL.map(|limit| limit * sizes.residuals * beta);
        Self {
            alpha: alpha.clamp(low, high),
            beta,
        }
    }

    /// The logarithm of the evidence for these precisions, up to what all networks of one study
    /// share: restarts are compared by it.
    pub(super) fn log_evidence(self, sizes: Sizes, spread: Spread) -> f64 {
        // det H = β^P·det(JᵀJ + ρ·I).
        let log_det = sizes.parameters * self.beta.ln() + spread.log_det;
        0.5 * (sizes.parameters * self.alpha.ln() + sizes.residuals * self.beta.ln()
            - log_det
            - self.beta * sizes.squared_error
            - self.alpha * sizes.squared_weights)
    }
}
