/// Density with which mass follows from volume, kilograms a cubic metre.
pub const DENSITY_KG_M3: f64 = 985.0;
