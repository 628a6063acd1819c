//! The force of a contact by its indentation.

use faer::c64;

/// A linear contact to second order in frequency: `kappa(s) = k_c + eta s + mu s^2`, tip force over indentation.
///
/// # Model
/// A spring and a damper, and what comes next: `mu > 0` is a mass that moves with the tip; `mu < 0` a contact that
/// stiffens with frequency, as one that relaxes in a time `tau` (`mu = -eta tau`), or whose force comes late.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactLaw {
    /// `k_c`, N/m.
    pub stiffness_n_per_m: f64,
    /// `eta`, N s/m.
    pub damping_n_s_per_m: f64,
    /// `mu`, kg.
    pub inertia_kg: f64,
}

impl ContactLaw {
    /// `kappa(s)`, N/m.
    pub fn at(&self, s: c64) -> c64 {
        s * (s * self.inertia_kg + self.damping_n_s_per_m) + self.stiffness_n_per_m
    }

    /// `d kappa / ds`, N s/m.
    pub fn slope(&self, s: c64) -> c64 {
        s * (2.0 * self.inertia_kg) + self.damping_n_s_per_m
    }
}

/// Stiffness (N/m) and damping (N s/m) alone.
impl From<[f64; 2]> for ContactLaw {
    fn from([stiffness_n_per_m, damping_n_s_per_m]: [f64; 2]) -> Self {
        Self { stiffness_n_per_m, damping_n_s_per_m, inertia_kg: 0.0 }
    }
}
