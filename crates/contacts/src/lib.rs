//! Foot contacts: found in a motion, and held where they are.
