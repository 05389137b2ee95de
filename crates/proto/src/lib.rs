//! Generated gRPC code and wire to model conversions.
