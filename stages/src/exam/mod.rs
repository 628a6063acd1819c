//! The exam of a diagnosis: causes are hidden in simulated recordings, the verdict is judged by its JSON alone.
//!
//! [`draw`] makes an archive's recipe from a seed, [`limit`] the smallest strength worth hiding; [`judge`] compares a verdict with what was hidden and
//! knows nothing else of the draw; [`Score`] adds up.

mod draw;
mod judge;
mod levers;
mod limits;
mod score;
mod statistics;

pub use draw::{Draw, Kind, Planted, draw};
pub use judge::{Judged, Said, judge};
pub use limits::{LIMIT_GAIN, Limits, limit};
pub use score::Score;
pub use statistics::uniformity;
