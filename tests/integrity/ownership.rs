//! No command replaces or removes a file that afmid did not write.
