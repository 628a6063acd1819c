//! Results of earlier formats stay readable.
