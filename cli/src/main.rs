//! The `truedepth` command.
fn main() {}
