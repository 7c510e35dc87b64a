//! The examples run.

#[path = "../examples/your_own_strategy.rs"]
mod your_own_strategy;

#[test]
fn your_own_strategy() {
    your_own_strategy::main().unwrap();
}
