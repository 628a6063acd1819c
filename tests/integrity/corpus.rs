//! The fuzz targets' corpus, replayed.
