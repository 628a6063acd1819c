//! The engine of afmid.
