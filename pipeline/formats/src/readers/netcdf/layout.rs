//! Where the elements of variables lie.

use super::header::{Header, Variable};

/// Size and distance of the elements along each dimension, the slowest first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Axis {
    pub(super) dimension: usize,
    pub(super) size: usize,
    pub(super) step_bytes: u64,
}

/// How records lie in a file.
#[derive(Debug, Clone, Copy)]
pub(super) struct Records {
    /// Number of whole records in the file.
    pub(super) count: u64,
    /// From one to the next.
    bytes: u64,
}

impl Variable {
    pub(super) fn is_of_records(&self, header: &Header) -> bool {
        let first = self.dimensions.first().and_then(|number| header.dimensions.get(*number));
        first.is_some_and(|dimension| dimension.length == 0)
    }

    /// Bytes of it, or of it in a record, without padding. None: more than any file has.
    fn slab_bytes(&self, header: &Header) -> Option<u64> {
        let lengths = self.dimensions.iter().filter_map(|number| header.dimensions.get(*number));
        let mut lengths = lengths.map(|dimension| dimension.length).filter(|length| *length > 0);
        lengths.try_fold(self.kind.bytes(), |bytes, length| bytes.checked_mul(length))
    }

    /// Errors: the size that is stated is not that of its dimensions. Sizes that 32 bits do not hold are stated as the
    /// largest number, as the specification has it, or as what is left of them.
    fn check_size(&self, header: &Header, wanted: u64) -> Result<(), String> {
        let (padded, limit) = (padded(wanted), u64::from(u32::MAX) - 3);
        let overflown = header.version != 5 && padded > limit;
        if overflown || self.stated_bytes == wanted || self.stated_bytes == padded {
            return Ok(());
        }
        Err(format!("{} bytes are stated, its dimensions and type have {wanted}", self.stated_bytes))
    }

    /// Its axes. Errors: why it cannot be read.
    pub(super) fn axes(&self, header: &Header, records: Option<Records>, file_bytes: u64) -> Result<Vec<Axis>, String> {
        let slab = self.slab_bytes(header).ok_or("its dimensions are more than any file has")?;
        self.check_size(header, slab)?;
        if self.begin < header.end {
            return Err(format!("it begins at byte {}, within the header of {} bytes", self.begin, header.end));
        }
        let mut axes = Vec::new();
        let mut step_bytes = self.kind.bytes();
        for &dimension in self.dimensions.iter().rev() {
            let length = header.dimensions.get(dimension).map_or(0, |dimension| dimension.length);
            let (size, step) = match (length, records) {
                (0, Some(records)) => (records.count, records.bytes),
                (0, None) => (0, 0),
                _ => (length, step_bytes),
            };
            let size = usize::try_from(size).map_err(|_| "its dimensions are more than any file has")?;
            axes.push(Axis { dimension, size, step_bytes: step });
            step_bytes = step_bytes.saturating_mul(length.max(1));
        }
        axes.reverse();
        self.check_end(&axes, file_bytes)?;
        Ok(axes)
    }

    /// Errors: its last element ends behind the file.
    fn check_end(&self, axes: &[Axis], file_bytes: u64) -> Result<(), String> {
        if axes.iter().any(|axis| axis.size == 0) {
            return Ok(());
        }
        let before = axes.iter().map(|axis| (axis.size as u64 - 1).saturating_mul(axis.step_bytes));
        let end = before.fold(self.begin.saturating_add(self.kind.bytes()), u64::saturating_add);
        if end > file_bytes {
            return Err(format!("it ends at byte {end}, the file at byte {file_bytes}: copy the file again"));
        }
        Ok(())
    }
}

fn padded(bytes: u64) -> u64 {
    bytes.saturating_add((4 - bytes % 4) % 4)
}

impl Records {
    /// The records of a file; none if it has no variable of records. Remarks: why there are none, or fewer than stated.
    pub(super) fn of(header: &Header, file_bytes: u64, remarks: &mut Vec<String>) -> Option<Self> {
        let of_records: Vec<&Variable> = header.variables.iter().filter(|v| v.is_of_records(header)).collect();
        let slabs = of_records.iter().map(|variable| variable.slab_bytes(header)).collect::<Option<Vec<u64>>>();
        let Some(slabs) = slabs else {
            remarks.push("the records are left out: one has more bytes than any file".to_owned());
            return None;
        };
        let bytes = match slabs.as_slice() {
            [] => return None,
            // a single variable of records is not padded
            [slab] => *slab,
            slabs => slabs.iter().map(|slab| padded(*slab)).fold(0, u64::saturating_add),
        };
        // a record is there if the elements of all variables are
        let there = of_records.iter().zip(&slabs).map(|(variable, slab)| {
            let room = file_bytes.saturating_sub(variable.begin).checked_sub(*slab);
            room.map_or(0, |room| (room / bytes.max(1)).saturating_add(1))
        });
        let there = there.min().unwrap_or(0);
        let count = match header.records {
            Some(stated) if stated > there => {
                remarks.push(format!("the file is cut off: its header says {stated} records, there are {there}"));
                there
            }
            Some(stated) => stated,
            None => {
                remarks.push(format!("the header does not say how many records there are: {there} are there"));
                there
            }
        };
        Some(Self { count, bytes })
    }
}
