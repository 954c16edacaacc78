//! Files that are whole or absent, and what every reader and writer says when they fail.

use std::fs::{self, File, TryLockError};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

/// Ends the names of unfinished files; a killed run may leave some.
pub const TEMPORARY: &str = ".tmp";

/// Puts `bytes` at `path` so that a reader, also after a crash, finds all of them or the file
/// that was there before. A link stays a link, and a device is written to.
pub fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let path = &fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    if is_special(path) {
        return File::options().write(true).open(path)?.write_all(bytes);
    }
    let temporary = temporary(path)?;
    let attempt = || {
        let mut file = File::create(&temporary)?;
        file.write_all(bytes)?;
        file.sync_all()?;
        drop(file);
        fs::rename(&temporary, path)
    };
    let result = match attempt() {
        // A process that runs beside this one took the file for a killed one's.
        Err(e) if e.kind() == ErrorKind::NotFound => attempt(),
        result => result,
    };
    if let Err(e) = result {
        // The first error is the one to report; a leftover is no worse than that.
        let _ = fs::remove_file(&temporary);
        return Err(e);
    }
    sync_folder(folder_of(path))
}

/// Where the bytes of `path` wait until they are whole.
fn temporary(path: &Path) -> io::Result<PathBuf> {
    let name = path.file_name().ok_or(ErrorKind::InvalidInput)?.to_string_lossy();
    Ok(path.with_file_name(format!("{name}.{}{TEMPORARY}", std::process::id())))
}

/// Checks that a file could be written at `path`, making its folder.
pub fn check_writable(path: &Path) -> io::Result<()> {
    if path.is_dir() {
        return Err(ErrorKind::IsADirectory.into());
    }
    if is_special(path) {
        return Ok(());
    }
    fs::create_dir_all(folder_of(path))?;
    let temporary = temporary(path)?;
    File::create(&temporary).map_err(|e| io::Error::from(e.kind()))?;
    remove_if_present(&temporary)
}

/// A folder that is this process's until this is dropped or the process ends, however it does.
#[derive(Debug)]
#[must_use]
pub struct Keeper(#[expect(dead_code, reason = "it is held, not read")] Option<File>);

/// Keeps `folder` for this process; [`ErrorKind::ResourceBusy`] where another process has it. Nothing is written,
/// and where folders cannot be locked everybody may have it.
pub fn keep(folder: &Path) -> io::Result<Keeper> {
    let Ok(file) = File::open(folder) else {
        // Not every system opens folders; who cannot write here is told so when it is tried.
        return Ok(Keeper(None));
    };
    match file.try_lock() {
        Ok(()) => Ok(Keeper(Some(file))),
        Err(TryLockError::WouldBlock) => Err(ErrorKind::ResourceBusy.into()),
        Err(TryLockError::Error(e)) if e.kind() == ErrorKind::Unsupported => Ok(Keeper(None)),
        Err(TryLockError::Error(e)) => Err(e),
    }
}

/// Removes the unfinished files that killed runs left in `folder`.
pub fn remove_leftovers(folder: &Path) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let process = name.strip_suffix(TEMPORARY).and_then(|rest| rest.rsplit_once('.'));
        if process.is_some_and(|(_, id)| id.parse::<u32>().is_ok()) {
            remove_if_present(&path)?;
        }
    }
    Ok(())
}

/// Removes a file that may be gone already.
pub fn remove_if_present(path: &Path) -> io::Result<()> {
    match fs::remove_file(path) {
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(()),
        result => result,
    }
}

/// The folder of `path`, `.` for a bare name.
pub fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Whether something stands at `path` that is neither file nor folder: a device, a pipe.
fn is_special(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|m| !m.is_file() && !m.is_dir())
}

/// Makes renames in `folder` survive a power cut.
#[cfg(unix)]
fn sync_folder(folder: &Path) -> io::Result<()> {
    File::open(folder)?.sync_all()
}

/// A folder cannot be opened as a file here; the rename itself is journalled.
#[cfg(not(unix))]
fn sync_folder(_folder: &Path) -> io::Result<()> {
    Ok(())
}

/// The operating system's reason in plain words, without its error number.
pub fn reason(error: &io::Error) -> String {
    match error.kind() {
        ErrorKind::NotFound => "no such file or folder".to_owned(),
        ErrorKind::PermissionDenied => "permission denied".to_owned(),
        ErrorKind::IsADirectory => "it is a folder, not a file".to_owned(),
        ErrorKind::NotADirectory => "it is a file, not a folder".to_owned(),
        ErrorKind::AlreadyExists => "a file of this name is in the way".to_owned(),
        ErrorKind::ResourceBusy => "another process is at work there".to_owned(),
        ErrorKind::StorageFull => "the disk is full".to_owned(),
        ErrorKind::InvalidData => "it is not text (UTF-8)".to_owned(),
        _ => error.to_string(),
    }
}

/// SHA-256 over the concatenation of `parts`.
pub fn sha256(parts: &[&[u8]]) -> [u8; 32] {
    let mut hasher = Sha256::new();
    for part in parts {
        hasher.update(part);
    }
    hasher.finalize().into()
}

/// SHA-256 in lower-case hexadecimal.
pub fn sha256_hex(parts: &[&[u8]]) -> String {
    sha256(parts).iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replaces_files_and_leaves_nothing_behind() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.bin");
        for bytes in [b"first", b"other"] {
            write_whole(&path, bytes).unwrap();
            assert_eq!(fs::read(&path).unwrap(), bytes);
        }
        let below_a_file = path.join("b.bin");
        assert!(write_whole(&below_a_file, b"x").is_err());
        assert!(check_writable(&below_a_file).is_err());
        assert!(write_whole(dir.path(), b"x").is_err());
        assert!(check_writable(dir.path()).is_err());
        check_writable(&dir.path().join("new/c.bin")).unwrap();
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 2);
    }

    /// A rename used to put a file in the place of the link or, for root, of /dev/null.
    #[cfg(unix)]
    #[test]
    fn links_stay_links_and_special_files_what_they_are() {
        use std::os::unix::{fs::FileTypeExt, fs::symlink, net::UnixListener};
        let dir = tempfile::tempdir().unwrap();
        let [target, link, socket] = ["target", "link", "socket"].map(|n| dir.path().join(n));
        fs::write(&target, "old").unwrap();
        symlink(&target, &link).unwrap();
        write_whole(&link, b"new").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&target).unwrap(), b"new");
        let _listener = UnixListener::bind(&socket).unwrap();
        assert!(write_whole(&socket, b"x").is_err(), "a socket cannot be opened");
        assert!(fs::metadata(&socket).unwrap().file_type().is_socket());
    }

    #[cfg(unix)]
    #[test]
    fn a_folder_is_one_keepers_at_a_time() {
        let dir = tempfile::tempdir().unwrap();
        let kept = keep(dir.path()).unwrap();
        assert_eq!(keep(dir.path()).unwrap_err().kind(), ErrorKind::ResourceBusy);
        drop(kept);
        drop(keep(dir.path()).unwrap());
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
    }

    #[test]
    fn leftovers_go_and_other_files_stay() {
        let dir = tempfile::tempdir().unwrap();
        for name in ["knn.bin", "knn.bin.4711.tmp", "mine.tmp", "4711"] {
            fs::write(dir.path().join(name), "").unwrap();
        }
        remove_leftovers(dir.path()).unwrap();
        let left = fs::read_dir(dir.path()).unwrap().map(|e| e.unwrap().file_name());
        let mut left: Vec<_> = left.collect();
        left.sort_unstable();
        assert_eq!(left, ["4711", "knn.bin", "mine.tmp"]);
    }

    #[test]
    fn checksums_are_the_published_ones() {
        let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(sha256_hex(&[b"a", b"bc"]), expected);
    }
}
