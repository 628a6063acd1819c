//! The channels of a record.

use afmid_pipeline::{Channel, Record, StageError};

/// Role of the deflection signal.
pub(crate) const DEFLECTION: &str = "deflection";
/// Role of each further sensor.
pub(crate) const SENSOR: &str = "sensor";
/// Role of the piezo's position.
pub(crate) const PIEZO: &str = "piezo";
/// The measured force of hits.
pub(crate) const FORCE: &str = "force";

/// The deflection. Errors: the record has none.
pub(crate) fn deflection(record: &Record) -> Result<&Channel, StageError> {
    record.channel(DEFLECTION)
}

/// The piezo's position, where it was recorded.
pub(crate) fn piezo(record: &Record) -> Option<&Channel> {
    record.channels.iter().find(|channel| channel.role == PIEZO)
}
