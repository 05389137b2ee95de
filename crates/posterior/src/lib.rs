//! Energy terms and the solver for the most probable pose.
