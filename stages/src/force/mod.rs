//! The force that acted: the input of the identification.
