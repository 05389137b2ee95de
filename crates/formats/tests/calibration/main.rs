//! Calibration files: those of the shared captures, the dialects they don't show, and what must be refused.

mod dialects;
mod hostile;
mod qualisys;
mod refusals;
mod ring;
