//! Statistical test harnesses.
