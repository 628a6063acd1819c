//! Opening never executes; executing asks.
