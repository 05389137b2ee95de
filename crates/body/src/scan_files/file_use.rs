//! What a file is used for, by its name.

/// Whether a [`ScanSet`](super::ScanSet) uses a file of that name; archives, and what systems hide in them, it does not.
pub fn is_part_of_scan_set(name: &str) -> bool {
    FileUse::from_name(name) != FileUse::None
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FileUse {
    Mesh,
    TemplateMesh,
    Vertices,
    Faces,
    Rig,
    SkinJoints,
    SkinWeights,
    Scans,
    Subjects,
    None,
}

impl FileUse {
    pub fn from_name(name: &str) -> Self {
        let lower = name.to_ascii_lowercase();
        let (folder, file) = lower.rsplit_once('/').unwrap_or(("", &lower));
        if file.starts_with('.') || folder.split('/').any(|f| f.starts_with('.') || f == "__macosx") {
            return Self::None;
        }
        match file {
            "template.obj" | "template.ply" | "topology.obj" | "topology.ply" => Self::TemplateMesh,
            "vertices.npy" => Self::Vertices,
            "faces.npy" => Self::Faces,
            "rig.json" => Self::Rig,
            "skin_joints.npy" => Self::SkinJoints,
            "skin_weights.npy" => Self::SkinWeights,
            "scans.csv" => Self::Scans,
            "subjects.csv" => Self::Subjects,
            _ if file.ends_with(".obj") || file.ends_with(".ply") => Self::Mesh,
            _ => Self::None,
        }
    }
}
