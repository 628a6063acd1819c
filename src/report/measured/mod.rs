//! The page of anything but a lever's events: free decays, measured inputs and outputs, frequency responses, noise,
//! steady oscillations. It shows what the run holds, under the names that the files give their channels.

mod decays;
mod input_output;
mod oscillation;
mod resonance;
mod responses;
mod sections;
mod shapes;
mod stabilisation;
#[cfg(test)]
mod tests;
mod transfer;

pub(crate) use sections::sections;

use super::figure::Axis;
use super::origin::Origin;

/// Characters of a name beside a panel: what is longer keeps its end, which tells files of one folder apart.
const LONGEST_NAME: usize = 26;

/// The axis of a channel, under its own name.
fn channel_axis(name: &str, unit: &str) -> Axis {
    let dropped = name.chars().count().saturating_sub(LONGEST_NAME);
    let end: String = name.chars().skip(dropped).collect();
    match (name.is_empty(), dropped) {
        (true, _) => Axis::new(Origin::Measurement.words().signal, unit),
        (false, 0) => Axis::new(name, unit),
        (false, _) => Axis::new(&format!("…{end}"), unit),
    }
}
