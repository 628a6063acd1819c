//! Free decays whose frequency and damping move with the amplitude, each fitted as one mode with two laws.
//!
//! [`follow_moving`] is the front door. In reading order: terms (of the laws), path (amplitude and phase along time),
//! blocks and layout (records compressed to slow envelopes), model (parameters and normal equations), search (least
//! squares), start (values to start from), select (which terms), exponentials and alternatives (what else a line may be),
//! signal (multiples), lack (of fit), average (over models), report and result.
//!
//! # Model
//! In each channel of each hit `sum_j Re(shape_j A(t) exp(i phi(t))) + offset + slope t` in white noise, with
//! `d log A/dt = -g(A) / (1 + w'/2w)` and `d phi/dt = w(A) - (g^2 - g g' + c^2) / 2w`, a prime for `d/d log A`. g and w
//! are sums of terms out of 1, a, a^2, a^4, log a and 1/a, a the amplitude over a unit; a mode of two constants is
//! linear. The first denominator: a spring that stiffens does work on the amplitude, damping takes from the action
//! `w A^2 / 2`. The second order of the damping in the phase: w is `abs(s)` of a linear mode; dry friction (c, the part
//! 1/a of g) acts back through its third harmonic. Multiples of the phase (twice, three times) are tested and fitted along.
//! # Method
//! Records are projected block by block onto slow envelopes (cubics) on each line's carrier: some hundred numbers, white
//! as the samples. Levenberg-Marquardt with variational equations; terms by score tests forward, exchange, and backward;
//! sums of exponentials in place of a law by the Bayesian information criterion; estimates averaged over the models with a
//! term more, less or exchanged.
//! # Shapes
//! Hits x channels x samples, of unlike length; one mode or several per line.
//! # Units
//! The channels' own; s, rad/s, Hz.
//! # Accuracy
//! docs/results/decay.md, "Modes that move". 20,000 samples of one mode take 10 to 60 ms.
//! # Errors
//! Unlike numbers of channels, samples or noise levels, too few samples, parameters out of range, records that determine
//! nothing. No number of a result is NaN.
//! # Source
//! N. N. Bogoliubov, Y. A. Mitropolsky, Asymptotic Methods in the Theory of Non-Linear Oscillations (1961), chapter 1; G.
//! Schwarz, Ann. Stat. 6 (1978) 461.

mod alternatives;
mod average;
mod blocks;
mod dense;
mod exponentials;
mod follow;
mod group;
mod input;
mod lack;
mod layout;
mod model;
mod path;
mod report;
mod result;
mod search;
mod select;
mod signal;
mod start;
mod terms;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod wild_tests;

pub use follow::{Exponential, Line, Options, follow_moving};
pub use lack::Lack;
pub(crate) use model::MOST_DAMPING;
pub use result::{CoursePoint, FollowedLine, FollowedMode, Follows, Moving};
pub use terms::Term;
