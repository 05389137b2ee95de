//! The marey command line.
fn main() {}
