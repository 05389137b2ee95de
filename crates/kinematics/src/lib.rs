//! Forward kinematics and its analytic Jacobian.
