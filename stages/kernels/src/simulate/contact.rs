//! The tip-sample contact with adhesion: the nonlinear output feedback.

use super::error::{SimulateError, require};

/// A contact that holds in tension.
///
/// # Model
/// Gap `g = z_base - z_surface + x_tip` (positive: apart). Apart: no force. When an armed tip comes within
/// `snap_in_gap_m` it is caught: from then on `F = -stiffness g - damping g'`, in compression and in tension, until the
/// tension `-F` reaches the event's own pull-off force; then it is let go at once. After a release the tip
/// can be caught again only once its gap has exceeded `snap_in_gap_m` (a torn tether does not heal by itself).
/// The damper brings its own thermal force, white with two-sided density `2 k_B T damping`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Contact stiffness, N/m.
    pub stiffness_n_per_m: f64,
    /// Viscous contact damping, N s/m.
    pub damping_n_s_per_m: f64,
    /// The gap at which the tip is caught, m.
    pub snap_in_gap_m: f64,
    /// Mean pull-off force, N.
    pub adhesion_n: f64,
    /// Scatter of the pull-off force from event to event, relative (normal, cut at three standard deviations).
    pub adhesion_scatter: f64,
}

/// Deviates of the pull-off force are drawn within this many standard deviations.
pub const ADHESION_CUT: f64 = 3.0;

impl Contact {
    /// Every parameter's range; the weakest pull-off force must survive the catch itself.
    pub fn check(&self) -> Result<(), SimulateError> {
        require("contact_stiffness_n_per_m", self.stiffness_n_per_m, self.stiffness_n_per_m > 0.0, "wanted above 0")?;
        require(
            "contact_damping_n_s_per_m",
            self.damping_n_s_per_m,
            self.damping_n_s_per_m >= 0.0,
            "wanted 0 or more",
        )?;
        require("snap_in_gap_m", self.snap_in_gap_m, self.snap_in_gap_m > 0.0, "wanted above 0")?;
        require("adhesion_n", self.adhesion_n, self.adhesion_n > 0.0, "wanted above 0")?;
        let scatter_ok = (0.0..0.3).contains(&self.adhesion_scatter);
        require("adhesion_scatter", self.adhesion_scatter, scatter_ok, "wanted 0 or more and below 0.3")?;
        let weakest = self.adhesion_n * (1.0 - ADHESION_CUT * self.adhesion_scatter);
        let caught = self.stiffness_n_per_m * self.snap_in_gap_m;
        require(
            "adhesion_n",
            self.adhesion_n,
            weakest > caught,
            "at three standard deviations below its mean it must exceed contact_stiffness_n_per_m * snap_in_gap_m, \
             or the catch itself tears the contact",
        )
    }

    /// The base height above the surface at which a quasi-static retract tears off, m: lever plus contact stretched.
    pub fn pull_off_height_m(&self, lever_stiffness_n_per_m: f64, pull_off_n: f64) -> f64 {
        pull_off_n / lever_stiffness_n_per_m + pull_off_n / self.stiffness_n_per_m
    }
}
