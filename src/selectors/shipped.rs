//! Models compiled in (feature `models`), so that a program plans wherever it is copied to. Files of
//! their names come before them.

use std::path::Path;

/// Name and content of each.
#[cfg(feature = "models")]
pub static FILES: &[(&str, &[u8])] = &[
    ("knn.bin", include_bytes!("../../models/knn.bin")),
    ("knn-tpcap.bin", include_bytes!("../../models/knn-tpcap.bin")),
    ("mlp-forward.safetensors", include_bytes!("../../models/mlp-forward.safetensors")),
    ("mlp-parallel.safetensors", include_bytes!("../../models/mlp-parallel.safetensors")),
    ("mlp-reverse.safetensors", include_bytes!("../../models/mlp-reverse.safetensors")),
    ("fleet.safetensors", include_bytes!("../../models/fleet.safetensors")),
    #[cfg(feature = "lab")]
    ("rl-eval.safetensors", include_bytes!("../../models/rl-eval.safetensors")),
    #[cfg(feature = "lab")]
    ("rl-simple.safetensors", include_bytes!("../../models/rl-simple.safetensors")),
];

/// Nothing is compiled in.
#[cfg(not(feature = "models"))]
pub static FILES: &[(&str, &[u8])] = &[];

/// The model of a bare name.
pub fn find(name: &Path) -> Option<&'static [u8]> {
    FILES.iter().find(|(known, _)| name.as_os_str() == *known).map(|(_, bytes)| *bytes)
}
