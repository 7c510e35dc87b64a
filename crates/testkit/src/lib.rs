//! Statistical test harnesses for Monte Carlo code: "this samples that density" ([`chi2`]) and
//! "this estimates that integral" ([`z_test`]), with the quadrature that gives their references.
//!
//! Development only. Directions are `[f32; 3]`, so any renderer can use it; nothing here knows one.
//!
//! Rejected: fixed tolerances on random numbers. A [`Suite`] states one probability of a false
//! alarm for all its tests together, and each test gets its Šidák share of that.

pub mod chi2;
pub mod quadrature;
mod rng;
mod suite;
mod table;
pub mod z_test;

pub use chi2::{Chi2, Chi2Report};
pub use rng::Pcg;
pub use suite::{Failure, Suite};
pub use z_test::{Welford, ZTest, batches};
