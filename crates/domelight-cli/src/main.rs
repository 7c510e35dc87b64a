//! The program `domelight`.
fn main() {}
