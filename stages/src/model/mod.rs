//! Parametric estimates: prediction error method, modes, zeros.
