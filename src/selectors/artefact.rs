//! What every model file needs: finding, errors, checks, writing.
//!
//! No file is used before magic, version, checksum, shapes and vehicle are checked; every
//! [`ArtefactError`] names the file, what is wrong with it and what would mend it. Files are written
//! aside, synced and renamed, so that a reader never sees half a model. Where there is no file of a
//! bare name, one that is compiled in serves ([`shipped`]).

use std::borrow::Cow;
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};

use super::shipped;
use crate::files::{self, reason, write_whole};
use crate::vehicle::Vehicle;
use crate::world::ParkingType;

/// A model file that cannot be used, or not written.
#[derive(Debug, thiserror::Error)]
#[error("model {}: {fault}", .path.display())]
pub struct ArtefactError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong with it.
    pub fault: Fault,
}

/// What is wrong with a model file.
#[derive(Debug, thiserror::Error)]
pub enum Fault {
    /// There is no such file.
    #[error("no such file; train one with n3p-train, or give the path of an existing one")]
    Missing,
    /// The operating system refused.
    #[error("cannot be read: {}; give the path of a model file", reason(.0))]
    Unreadable(std::io::Error),
    /// Zero bytes.
    #[error("the file is empty; train it again with n3p-train, or copy it again")]
    Empty,
    /// Shorter or longer than its header says.
    #[error("the file is cut off or padded: expected {expected} bytes, got {got}; copy it again")]
    Length {
        /// Bytes that the file's own header asks for.
        expected: u64,
        /// Bytes found.
        got: u64,
    },
    /// Neither kind of model.
    #[error("not a model: the content is neither a knn.bin nor a safetensors file of n3p-train")]
    NotAModel,
    /// A policy, where a selector of preparatory poses is wanted.
    #[error("it holds a driving policy, no selector; give it with --policy")]
    Policy,
    /// A policy, in a build of the planner alone.
    #[error(
        "it holds a driving policy, and this program was built without them; build it with --features lab"
    )]
    NoPolicies,
    /// Foresight, where a selector of preparatory poses is wanted.
    #[error("it holds foresight, no selector; give it with --model beside a selector")]
    Foresight,
    /// A policy, where a network of dense layers is wanted.
    #[error("it holds no network that is written as ONNX; give an mlp, fleet or foresight model")]
    NoNetwork,
    /// A selector of preparatory poses, where a policy is wanted.
    #[error("it holds a selector of preparatory poses, no policy; give it with --model")]
    Selector,
    /// Written by another version of this program.
    #[error(
        "format version {found}, but this program reads version {supported}; \
         train it again with n3p-train"
    )]
    Version {
        /// The file's version.
        found: u32,
        /// The version read by this program.
        supported: u32,
    },
    /// The content is not what was written.
    #[error("damaged: the checksum does not match the content; copy it again or train it again")]
    Checksum,
    /// The header contradicts itself or the content.
    #[error("damaged header: {0}; copy it again or train it again")]
    Header(String),
    /// A tensor of the wrong shape.
    #[error("tensor {tensor}: expected {expected}, got {got}; train it again with n3p-train")]
    Shape {
        /// Name of the tensor.
        tensor: String,
        /// Type and shape that it should have.
        expected: String,
        /// What the file holds.
        got: String,
    },
    /// A weight that is no number.
    #[error("tensor {tensor} holds {value}; train it again with n3p-train")]
    NotFinite {
        /// Name of the tensor.
        tensor: String,
        /// The value.
        value: f32,
    },
    /// Trained for another car.
    #[error(
        "trained for another vehicle: its {field} is {model}, wanted {wanted}; \
         train for this vehicle: {command}"
    )]
    OtherVehicle {
        /// Name of the vehicle's field.
        field: &'static str,
        /// Its value in the model.
        model: f64,
        /// Its value in the vehicle at hand.
        wanted: f64,
        /// Commands that train a model for the vehicle at hand.
        command: String,
    },
    /// Networks that do not go together.
    #[error("cannot be combined with the models before it: {0}")]
    Mismatch(String),
    /// The file cannot be written.
    #[error("cannot be written: {}; choose another --out", reason(.0))]
    Unwritable(std::io::Error),
}

impl Fault {
    /// This fault of the file at `path`.
    pub(crate) fn of(self, path: &Path) -> ArtefactError {
        ArtefactError { path: path.to_owned(), fault: self }
    }
}

/// Compares what decides where a car can drive: dimensions and steering limit. Speeds only enter
/// times, so a selector serves every speed.
///
/// `training`: commands that train for the vehicle in FILE.
pub fn check_vehicle(
    path: &Path,
    training: &str,
    model: &Vehicle,
    wanted: &Vehicle,
) -> Result<(), ArtefactError> {
    match model.differing_field(wanted) {
        None => Ok(()),
        Some((field, model, wanted)) => {
            let command = format!("{training}, with [vehicle] {field} = {wanted} in FILE");
            Err(Fault::OtherVehicle { field, model, wanted, command }.of(path))
        }
    }
}

/// [`check_vehicle`] for policies, whose steps are as long as the speeds say.
pub fn check_driving(
    path: &Path,
    training: &str,
    model: &Vehicle,
    wanted: &Vehicle,
) -> Result<(), ArtefactError> {
    check_vehicle(path, training, model, wanted)?;
    match model.differing_speed(wanted) {
        None => Ok(()),
        Some((field, model, wanted)) => {
            let command = format!("{training}, with [vehicle] {field} = {wanted} in FILE");
            Err(Fault::OtherVehicle { field, model, wanted, command }.of(path))
        }
    }
}

/// How to train a selector of these types.
pub fn selector_training(trainer: &str, kinds: &[ParkingType]) -> String {
    let kind = match kinds {
        [kind] => format!(" --type {kind}"),
        _ => String::new(),
    };
    format!(
        "n3p-collect{kind} --config FILE --out datasets/NAME, then n3p-train {trainer}{kind} \
         --data datasets/NAME"
    )
}

/// How to train a policy of a course.
pub fn policy_training(course: &str) -> String {
    format!("n3p-train rl --env {course} --config FILE --out models/NAME.safetensors")
}

/// Where the model called `name` lies: a path is taken as it is; a bare name is looked
/// for in the working folder, then in `models/`; where it is in neither, the name remains, and may be
/// that of a model compiled in.
pub fn find_model(name: impl AsRef<Path>) -> PathBuf {
    let name = name.as_ref();
    let in_models = Path::new("models").join(name);
    let bare = name.components().count() == 1;
    if bare && !name.exists() && in_models.exists() { in_models } else { name.to_owned() }
}

/// Checks that a model could be written at `path`, making its folder, and removes what killed
/// trainings left there.
pub fn check_writable(path: &Path) -> Result<(), ArtefactError> {
    files::check_writable(path)
        .and_then(|()| files::remove_leftovers(files::folder_of(path)))
        .map_err(|e| Fault::Unwritable(e).of(path))
}

/// Writes a model, making its folder; it appears whole or not at all.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), ArtefactError> {
    std::fs::create_dir_all(files::folder_of(path))
        .and_then(|()| write_whole(path, bytes))
        .map_err(|e| Fault::Unwritable(e).of(path))
}

/// Whether there is such a model, as a file or compiled in.
pub fn exists(path: &Path) -> bool {
    path.exists() || shipped::find(path).is_some()
}

/// The bytes of a model, from its file or as it is compiled in.
pub(crate) fn read(path: &Path) -> Result<Cow<'static, [u8]>, ArtefactError> {
    match (read_file(path), shipped::find(path)) {
        (Err(ArtefactError { fault: Fault::Missing, .. }), Some(bytes)) => Ok(Cow::Borrowed(bytes)),
        (bytes, _) => bytes.map(Cow::Owned),
    }
}

/// The bytes of a file of weights.
pub(crate) fn read_file(path: &Path) -> Result<Vec<u8>, ArtefactError> {
    let mut file = open(path)?;
    // Of the right size at once, where it is known.
    let size = file.metadata().map_or(0, |m| m.len());
    let mut bytes = Vec::with_capacity(usize::try_from(size).unwrap_or(0));
    file.read_to_end(&mut bytes).map_err(|e| Fault::Unreadable(e).of(path))?;
    Ok(bytes)
}

/// Opens a model file, refusing missing ones.
pub(crate) fn open(path: &Path) -> Result<File, ArtefactError> {
    File::open(path).map_err(|e| match e.kind() {
        // A browser has no files at all.
        ErrorKind::NotFound | ErrorKind::Unsupported => Fault::Missing.of(path),
        _ => Fault::Unreadable(e).of(path),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_vehicle_names_field_values_and_command() {
        let model = Vehicle::default();
        let wanted = Vehicle { wheelbase: 2.7, ..model };
        let training = selector_training("mlp", &[ParkingType::Parallel]);
        let error = check_vehicle(Path::new("m"), &training, &model, &wanted).unwrap_err();
        let text = error.to_string();
        for part in ["wheelbase is 2.83", "wanted 2.7", "n3p-train mlp --type parallel"] {
            assert!(text.contains(part), "{text}");
        }
        let faster = Vehicle { forward_speed: 3.0, ..model };
        assert!(check_vehicle(Path::new("m"), &training, &model, &faster).is_ok());
    }

    #[test]
    fn writes_into_new_folders_and_refuses_files_as_folders() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a/b.bin");
        write(&path, b"x").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"x");
        let error = check_writable(&path.join("c.bin")).unwrap_err().to_string();
        assert!(error.contains("b.bin/c.bin: cannot be written: "), "{error}");
    }
}
