//! What a key knows: processor, build, the whole command of a plugin.
