//! Work grows in proportion to the number of items.
