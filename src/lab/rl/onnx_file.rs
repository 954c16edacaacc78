//! ONNX files: reading them, and what can be wrong with them.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use rten::{LoadErrorKind, Model};

use crate::environment::{BEAMS, MASK, TARGET};
use crate::files::reason;

/// An ONNX file that cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("policy {}: {fault}", .path.display())]
pub struct OnnxError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong with it.
    pub fault: OnnxFault,
}

/// What is wrong with an ONNX file.
#[derive(Debug, thiserror::Error)]
pub enum OnnxFault {
    /// The operating system refused.
    #[error("cannot be read: {}; give the path of an ONNX file", reason(.0))]
    Unreadable(io::Error),
    /// A folder or a device.
    #[error("not a file; give the path of an ONNX file")]
    NotAFile,
    /// The name says that it is something else.
    #[error("the name does not end in .onnx; give the path of an ONNX file")]
    Name,
    /// Zero bytes.
    #[error("the file is empty; export it again, or copy it again")]
    Empty,
    /// The content is something else, or only half of it is there.
    #[error("not an ONNX file, or one that is cut off; export it again, or copy it again")]
    NotOnnx,
    /// Loading does not come to an end.
    #[error("the runtime cannot load it: it must be damaged; export it again, or copy it again")]
    Stuck,
    /// The graph has parts that cannot be run here.
    #[error(
        "cannot be run here ({0}); export it with common operators, and keep the files it refers \
         to beside it"
    )]
    Unsupported(String),
    /// An input that policies are not given.
    #[error(
        "unknown input {0:?}; a policy's inputs are lidar [1, {BEAMS}], target [1, {TARGET}] \
         and mask [1, {MASK}]"
    )]
    UnknownInput(String),
    /// No output of the right name.
    #[error("no output is called action, but [{0}]; give that name to the one of steer and speed")]
    NoAction(String),
    /// A tensor of another type or shape.
    #[error("{tensor} is {found}; it must be f32 [1, {size}] (a batch of one)")]
    Shape {
        /// Which tensor.
        tensor: String,
        /// Its type and shape.
        found: String,
        /// Numbers that a policy's tensor of this name holds.
        size: usize,
    },
    /// The graph fails on a plain observation.
    #[error("fails on a plain observation ({0}); its shapes must fit a batch of one")]
    Fails(String),
    /// NaN or infinity for a plain observation.
    #[error("answers a plain observation with {0:?}; steer and speed must be finite")]
    NotFinite([f32; 2]),
}

/// The graph in the file at `path`, unchecked.
pub fn read(path: &Path) -> Result<Model, OnnxFault> {
    let metadata = path.metadata().map_err(OnnxFault::Unreadable)?;
    if !metadata.is_file() {
        return Err(OnnxFault::NotAFile);
    }
    if !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("onnx")) {
        return Err(OnnxFault::Name);
    }
    if metadata.len() == 0 {
        return Err(OnnxFault::Empty);
    }
    if !is_whole(&fs::read(path).map_err(OnnxFault::Unreadable)?) {
        return Err(OnnxFault::NotOnnx);
    }
    Model::load_file(path).map_err(|error| match error.kind() {
        LoadErrorKind::IoError => OnnxFault::Unreadable(io::Error::other(in_one_line(&error))),
        LoadErrorKind::ParseError => OnnxFault::NotOnnx,
        _ => OnnxFault::Unsupported(in_one_line(&error)),
    })
}

/// Whether the outermost fields fill the file, and the operators' version, which writers put last,
/// is one of them: the runtime takes a file that is cut off for one that says less.
fn is_whole(mut file: &[u8]) -> bool {
    const OPERATORS_VERSION: u64 = 8;
    let mut has_version = false;
    while !file.is_empty() {
        let Some(rest) = varint(&mut file).and_then(|tag| {
            has_version |= tag >> 3 == OPERATORS_VERSION;
            let length = match tag & 7 {
                0 => varint(&mut file).map(|_| 0),
                1 => Some(8),
                2 => varint(&mut file),
                5 => Some(4),
                _ => None,
            }?;
            file.get(usize::try_from(length).ok()?..)
        }) else {
            return false;
        };
        file = rest;
    }
    has_version
}

/// Takes a Protocol Buffers number off the front: seven bits per byte, the last below 128.
fn varint(file: &mut &[u8]) -> Option<u64> {
    let length = file.iter().take(10).position(|byte| *byte < 128)? + 1;
    let (number, rest) = file.split_at(length);
    *file = rest;
    Some(number.iter().rev().fold(0, |sum, byte| sum << 7 | u64::from(byte & 127)))
}

/// The runtime's words, which may hold line breaks of the file.
pub fn in_one_line(error: &dyn std::error::Error) -> String {
    error.to_string().split_whitespace().collect::<Vec<_>>().join(" ")
}
