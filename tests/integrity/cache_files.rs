//! Files of the cache that hold something else than their names say: damaged, exchanged, mutated.
