//! Averages over aligned events, and what their spread says.
