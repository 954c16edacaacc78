"""What runs on a machine of the cluster: one task, by one program, in a folder of its own.

This module is sent to the machines as it is, so it uses Python's own library alone: they need Ray
and the programs, not this package.
"""

from __future__ import annotations

import contextlib
import ctypes
import fcntl
import hashlib
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

SUMS = "SHA256SUMS"
"""Checksums of a folder's other files, as of ``sha256sum``; with it, all are there."""


class Unusable(Exception):
    """A program that is not there, or another one than the rest of the cluster has."""


def sha256(data: bytes) -> str:
    """SHA-256, lower-case hexadecimal."""
    return hashlib.sha256(data).hexdigest()


def write_whole(path: Path, data: bytes) -> None:
    """Puts `data` at `path`; a reader, also after a crash, finds all of it or what was there."""
    # As the programs name theirs, which they clear away.
    temporary = path.with_name(f"{path.name}.{os.getpid()}.tmp")
    try:
        with open(temporary, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except OSError:
        with contextlib.suppress(OSError):
            temporary.unlink()
        raise


def find_program(name: str, bin_dir: str | None) -> str:
    """The path of a program: in `bin_dir`, or on the PATH where that is None."""
    found = shutil.which(name, path=bin_dir)
    if found is None:
        where = "on the PATH (or give --bin-dir)" if bin_dir is None else f"in {bin_dir}"
        raise Unusable(f"{socket.gethostname()}: no program {name} {where}")
    return os.path.abspath(found)


def version(program: str) -> str:
    """What tells one build from another: name, release and revision.

    Where the revision is not that of a commit, the program's checksum, too.
    """
    try:
        said = subprocess.run([program, "--version"], capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError) as error:
        raise Unusable(f"{socket.gethostname()}: {program} --version fails: {error}") from None
    line = said.stdout.strip()
    if "(" not in line or line.endswith(("+dirty)", "(unknown)")):
        line += f" sha256:{sha256(Path(program).read_bytes())[:16]}"
    return line


def check_version(program: str, expected: str) -> None:
    """Raises `Unusable` unless the program is of the build that is expected."""
    found = version(program)
    if found != expected:
        raise Unusable(
            f"{socket.gethostname()}: {program} is {found}, but the rest of the cluster has "
            f"{expected}; install one build everywhere"
        )


def run(
    task: dict[str, Any],
    inputs: dict[str, bytes],
    build: str,
    bin_dir: str | None,
    shared: str | None,
) -> dict[str, Any]:
    """Runs a task (`work.Task` as a dict) and brings back its files.

    Parameters
    ----------
    inputs
        Files by their path in the task's folder.
    build
        The `version` that the program must have.
    shared
        The folder of the results where every machine sees it; None to bring their bytes back.

    Returns
    -------
    dict
        ``node``, and ``files``, a list of ``(name, sha256, bytes or None)`` in the order in which
        they may appear; or ``reason``, and ``bad_input``, whether another try is useless.
    """
    node = socket.gethostname()
    try:
        program = find_program(task["program"], bin_dir)
        check_version(program, build)
    except Unusable as error:
        return {"node": node, "reason": str(error), "bad_input": True}
    with scratch() as folder:
        for name, data in {**inputs, **task["files"]}.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
        out = folder / "out"
        out.mkdir(exist_ok=True)
        ended = subprocess.run(
            [program, *task["arguments"]],
            cwd=folder,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            preexec_fn=end_with_parent(),
        )
        missing = [name for name in task["expected"] if not (out / name).exists()]
        if missing or ended.returncode not in task["codes"]:
            said = " ".join((ended.stderr.strip() or ended.stdout.strip())[-2000:].split())
            reason = f"{node}: {task['program']} ended with {ended.returncode}: {said or 'no word'}"
            return {"node": node, "reason": reason, "bad_input": ended.returncode == 2}
        if task["sealed"]:
            seal(out)
        files = []
        for name in sorted(results(out, task), key=lambda name: rank(name, task)):
            data = (out / name).read_bytes()
            if shared is not None:
                try:
                    place(Path(shared) / task["folder"] / name, data, name in task["first"])
                except Differs as error:
                    return {"node": node, "reason": str(error), "bad_input": True}
            files.append((name, sha256(data), data if shared is None else None))
        return {"node": node, "files": files}


def results(out: Path, task: dict[str, Any]) -> list[str]:
    """Names of the files to bring back."""
    names = (str(path.relative_to(out)) for path in out.rglob("*") if path.is_file())
    return [name for name in names if name not in task["left"] and not name.endswith(".tmp")]


def rank(name: str, task: dict[str, Any]) -> tuple[int, str]:
    """In which order files appear: what a folder is first, what is finished last."""
    if name in task["first"]:
        return 0, name
    return (2 if name.endswith(".json") and not task["sealed"] else 3 if name == SUMS else 1), name


class Differs(Exception):
    """A file that all tasks share is another one here."""


def place(path: Path, data: bytes, is_common: bool) -> None:
    """Puts a result where it belongs; one common to all tasks must be the one that is there."""
    if is_common and path.exists():
        if path.read_bytes() != data:
            raise Differs(
                f"{path}: of other settings or another build than what {socket.gethostname()} makes"
            )
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, data)


def seal(folder: Path) -> None:
    """Writes the checksums of all files in `folder`, as ``sha256sum -c`` reads them."""
    names = sorted(p.name for p in folder.iterdir() if p.is_file() and p.name != SUMS)
    lines = [f"{sha256((folder / name).read_bytes())}  {name}\n" for name in names]
    write_whole(folder / SUMS, "".join(lines).encode())


def end_with_parent() -> Callable[[], None] | None:
    """What a new process does so that it ends with the one that started it, however that ends."""
    if sys.platform != "linux":
        return None
    # Loaded before the fork, after which little is safe.
    prctl, pr_set_pdeathsig, kill = ctypes.CDLL(None).prctl, 1, int(signal.SIGKILL)

    def ask_kernel() -> None:
        prctl(pr_set_pdeathsig, kill)

    return ask_kernel


@contextlib.contextmanager
def scratch() -> Iterator[Path]:
    """A folder of one's own while this runs; what killed workers left on this machine goes."""
    root, prefix = Path(tempfile.gettempdir()), f"n3p-cluster-{os.getuid()}-"
    for old in root.glob(prefix + "*"):
        with contextlib.suppress(OSError), open(old / "lock", "rb") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            shutil.rmtree(old, ignore_errors=True)
    # It gets the name by which others would remove it when it is locked.
    hidden = Path(tempfile.mkdtemp(prefix="." + prefix))
    with open(hidden / "lock", "wb") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        folder = hidden.with_name(f"{prefix}{hidden.name[-8:]}-{time.time_ns()}")
        hidden.rename(folder)
        try:
            yield folder
        finally:
            shutil.rmtree(folder, ignore_errors=True)
