//! Scenes: the built-in ones.

pub mod builtin;
