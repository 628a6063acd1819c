//! Event extraction: snap-off and snap-to-contact.
