//! An AFM in the time domain.
