//! Calibration and noise control: sensitivity, spring constant, delay, thermal spectra.
