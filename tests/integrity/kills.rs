//! Kills at random moments leave whole files or none.
