//! What kinds of data have of what causes need.

use super::Need;

/// Whether archives of releases have it. What belongs to one run is looked for in whole records there, each by itself.
pub fn releases_have(need: Need) -> bool {
    !matches!(need, Need::Run | Need::Input)
}

/// Whether runs of a system may have it: the diagnosis asks the data at hand again.
pub fn runs_have(need: Need) -> bool {
    need != Need::Release
}
