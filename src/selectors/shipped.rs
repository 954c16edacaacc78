//! Models compiled in (feature `models`), so that a program plans wherever it is copied to. Files of
//! their names come before them.

use std::path::Path;

/// Name and content of each.
#[cfg(feature = "models")]
pub static FILES: &[(&str, &[u8])] = &[
    ("knn.bin", include_bytes!("../../models/knn.bin")),
    ("knn-angled.bin", include_bytes!("../../models/knn-angled.bin")),
    ("knn-tpcap.bin", include_bytes!("../../models/knn-tpcap.bin")),
    ("mlp-forward.safetensors", include_bytes!("../../models/mlp-forward.safetensors")),
    ("mlp-parallel.safetensors", include_bytes!("../../models/mlp-parallel.safetensors")),
    ("mlp-reverse.safetensors", include_bytes!("../../models/mlp-reverse.safetensors")),
    ("fleet.safetensors", include_bytes!("../../models/fleet.safetensors")),
    ("foresight.safetensors", include_bytes!("../../models/foresight.safetensors")),
];

/// Nothing is compiled in.
#[cfg(not(feature = "models"))]
pub static FILES: &[(&str, &[u8])] = &[];

/// The model of a bare name.
pub fn find(name: &Path) -> Option<&'static [u8]> {
    FILES.iter().find(|(known, _)| name.as_os_str() == *known).map(|(_, bytes)| *bytes)
}

#[cfg(all(test, feature = "models"))]
mod tests {
    use std::borrow::Cow;

    use super::*;
    use crate::selectors::foresight::Foresight;
    use crate::selectors::model::Model;

    /// As files they pass every check, the checksum too.
    #[test]
    fn what_is_compiled_in_is_whole() {
        for (name, bytes) in FILES {
            if *name == "foresight.safetensors" {
                assert!(Foresight::from_bytes(Path::new(name), bytes).is_ok());
            } else {
                let model = Model::from_bytes(Path::new(name), Cow::Owned(bytes.to_vec())).unwrap();
                assert!(!model.kinds().is_empty(), "{name}");
            }
            assert_eq!(find(Path::new(name)), Some(*bytes));
        }
        assert_eq!(find(Path::new("./knn.bin")), None, "a path is that of a file");
    }
}
