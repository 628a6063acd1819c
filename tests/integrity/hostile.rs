//! Files made to do harm: bounded time and memory.
