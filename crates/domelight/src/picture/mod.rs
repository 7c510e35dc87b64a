//! Pictures on disk: readers, writers, tone curves, comparison.
