//! An integrating mechanical axis under a feedback controller: is the drive fed back, what is the controller, does the
//! plant integrate, and what beside mass and viscous friction resists the motion.
//!
//! # Model
//! Drive `u_k = sum_i c_i r_(k-i) + sum_j d_j y_(k-j) + sum_l e_l u_(k-l) + f p_k + g`, within its limits where it has
//! any; p an extra channel that is added to the drive. Plant `M v' + Fv v + Fc sgn v + F0 + d abs(v) + c v abs(v) =
//! G u`, `y' = v`, the drive held between samples.
//! # Method
//! The controller is a linear regression (`controller`). The plant starts from a force balance of filtered signals
//! (`balance`): linear in all parameters. Its instruments are the same columns of the loop's own simulation from the
//! reference (`simulation`, `motion`), which the noise of the position does not enter (`estimate`). Causes are taken in
//! one at a time where held-out blocks of the balance and of the simulated loop both gain (`selection`). Dynamics of
//! higher order, a spring and what noise does not explain make the baseline inadequate (`adequacy`).
//! # Shapes
//! N samples each of reference, drive, position and, where there is one, the extra channel.
//! # Units
//! Those of [`ClosedLoopUnits`]; `drive_scale` is force per unit of the drive; time in seconds.
//! # Accuracy
//! Standard errors are a jackknife over blocks, with what another window makes of the same data: they hold for
//! residuals that are not white. Reversals are known to a sample, the speed is a mean over 11: that leaves up to two
//! thousandths of a parameter, which the standard errors do not hold.
//! # Errors
//! [`NotClosedLoop`]: the record is no loop that this model describes; another engine takes it.
//! # Source
//! A. Janot, P.-O. Vandanjon, M. Gautier, IEEE Trans. Control Syst. Technol. 22 (2014) 132 (instruments from the
//! simulated loop); M. Shinbrot, Trans. ASME 79 (1957) 547 (modulating functions); U. Forssell and L. Ljung, Automatica
//! 35 (1999) 1215 (identification in closed loop); R. G. Miller, Biometrika 61 (1974) 1 (jackknife).

mod adequacy;
mod answer;
mod balance;
#[cfg(test)]
mod bench;
mod blocks;
mod controller;
mod data;
mod diagnose;
mod estimate;
mod motion;
mod selection;
mod simulation;
#[cfg(test)]
mod tests;
mod wording;

pub use controller::{Coefficient, Controller};
pub use data::{ClosedLoop, ClosedLoopDiagnosis, ClosedLoopOptions, ClosedLoopUnits, JudgedPart, NotClosedLoop};
pub use diagnose::diagnose_closed_loop;
pub use motion::Plant;
pub use simulation::{Simulated, simulate_closed_loop};
