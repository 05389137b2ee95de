use crate::{Case, Row};

/// What may differ between cases.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    Points,
    Window,
    Variant,
    Database,
    Noise,
    Gap,
}

impl Axis {
    const ALL: [Self; 6] =
        [Self::Points, Self::Window, Self::Variant, Self::Database, Self::Noise, Self::Gap];

    /// Head of its column.
    pub fn name(self) -> &'static str {
        match self {
            Self::Points => "points",
            Self::Window => "window",
            Self::Variant => "variant",
            Self::Database => "poses",
            Self::Noise => "noise",
            Self::Gap => "hidden",
        }
    }

    /// A case's place on the axis, in words.
    pub fn value(self, case: &Case) -> String {
        match self {
            Self::Points => case.points.to_string(),
            Self::Window => case.window.to_string(),
            Self::Variant if case.variant.is_empty() => "as given".to_owned(),
            Self::Variant => case.variant.clone(),
            Self::Database => case.database_poses.to_string(),
            Self::Noise => format!("{} mm", case.noise_mm),
            Self::Gap => case.occlusion.map_or("none".to_owned(), |occlusion| occlusion.to_string()),
        }
    }

    fn is_equal(self, a: &Case, b: &Case) -> bool {
        match self {
            Self::Points => a.points == b.points,
            Self::Window => a.window == b.window,
            Self::Variant => a.variant == b.variant,
            Self::Database => a.database_poses == b.database_poses,
            Self::Noise => a.noise_mm == b.noise_mm,
            Self::Gap => a.occlusion == b.occlusion,
        }
    }
}

/// Which things were varied, and the case that others are set beside.
#[derive(Debug)]
pub struct Axes {
    pub reference: Case,
    varied: Vec<Axis>,
}

impl Axes {
    /// Of all rows. The reference has most control points, the first variant, windows of two frames if there are any, the
    /// largest database, least noise, and nothing hidden.
    pub fn from_rows(rows: &[Row]) -> Option<Self> {
        let first = &rows.first()?.case;
        let cases = || rows.iter().map(|r| &r.case);
        let varied = Axis::ALL.into_iter().filter(|axis| cases().any(|case| !axis.is_equal(case, first)));
        let mut reference = first.clone();
        if cases().any(|case| case.window == 2) {
            reference.window = 2;
        }
        reference.points = cases().map(|case| case.points).max()?;
        reference.database_poses = cases().map(|case| case.database_poses).max()?;
        reference.noise_mm = cases().map(|case| case.noise_mm).min_by(f64::total_cmp)?;
        Some(Self { varied: varied.collect(), reference })
    }

    /// Whether cases differ in it.
    pub fn varies(&self, axis: Axis) -> bool {
        self.varied.contains(&axis)
    }

    /// Whether a case differs from the reference at most in `free` and the method.
    pub fn is_beside(&self, case: &Case, free: &[Axis]) -> bool {
        Axis::ALL.into_iter().all(|axis| free.contains(&axis) || axis.is_equal(case, &self.reference))
    }

    /// What the reference has where things were varied and are not `free`: `; noise 0 mm, window 2`.
    pub fn held(&self, free: &[Axis]) -> String {
        let held = self.varied.iter().filter(|axis| !free.contains(axis));
        let held: Vec<String> =
            held.map(|axis| format!("{} {}", axis.name(), axis.value(&self.reference))).collect();
        if held.is_empty() { String::new() } else { format!(" Here: {}.", held.join(", ")) }
    }
}
