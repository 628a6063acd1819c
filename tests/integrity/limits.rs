//! FIFOs, devices, sizes of configs, numbers of problems.
