//! Parameter-free estimates: windows, periodograms, ETFE, smoothing.
