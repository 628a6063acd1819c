//! SIGINT and SIGTERM tidy up.
