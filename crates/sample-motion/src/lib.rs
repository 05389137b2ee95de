//! A small statistical model of human motion, and motion drawn from it.
