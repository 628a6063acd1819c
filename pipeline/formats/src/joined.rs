//! Stretches of samples that lie apart in a file and are one channel.

use crate::grid::Grid;
use crate::pinned::stretch_end;
use crate::{FormatError, Raw, Source};

/// Grids of one type of number, one behind the other.
#[derive(Debug)]
pub(crate) struct Joined {
    parts: Vec<Grid>,
    /// Sample behind the last of each part.
    ends: Vec<usize>,
}

impl Joined {
    /// Joins parts of one type of number. None if they are too many samples to count.
    pub(crate) fn of(parts: Vec<Grid>) -> Option<Self> {
        let mut end = 0_usize;
        let mut ends = Vec::new();
        for part in &parts {
            end = end.checked_add(part.samples)?;
            ends.push(end);
        }
        Some(Self { parts, ends })
    }

    /// Number of samples.
    pub(crate) fn samples(&self) -> usize {
        self.ends.last().copied().unwrap_or(0)
    }

    /// First samples of all parts but the first: where the recording was interrupted.
    pub(crate) fn starts(&self) -> Vec<usize> {
        let samples = self.samples();
        let mut starts: Vec<usize> = self.ends.iter().copied().filter(|end| (1..samples).contains(end)).collect();
        starts.dedup();
        starts
    }
}

impl Source for Joined {
    fn read(&self, start: usize, count: usize) -> Result<Raw, FormatError> {
        let end = stretch_end(start, count, self.samples())?;
        let mut read: Option<Raw> = None;
        for (part, &behind) in self.parts.iter().zip(&self.ends) {
            let first = behind - part.samples;
            let (from, to) = (start.max(first), end.min(behind));
            if from < to {
                let piece = part.read(from - first, to - from)?;
                read = Some(match read {
                    None => piece,
                    Some(before) => before.followed_by(piece),
                });
            }
        }
        match (read, self.parts.first()) {
            (Some(read), _) => Ok(read),
            (None, Some(part)) => part.read(0, 0),
            (None, None) => Ok(Raw::Float64(Vec::new())),
        }
    }
}
