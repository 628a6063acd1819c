//! Nothing that a file says reaches a terminal or a table raw.
