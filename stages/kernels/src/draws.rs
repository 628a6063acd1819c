//! How much the Monte Carlo tests draw.

/// What a Monte Carlo test draws: `few` in every run of the tests, `all` where the variable `AFMID_ACCURACY` is set
/// (`make accuracy`, before a release).
pub(crate) fn few_or_all<T>(few: T, all: T) -> T {
    if std::env::var_os("AFMID_ACCURACY").is_some() { all } else { few }
}
