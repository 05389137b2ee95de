//! Error metrics and reports.
