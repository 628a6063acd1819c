//! Input files that change while a run reads them, and what is remembered of them between runs.
