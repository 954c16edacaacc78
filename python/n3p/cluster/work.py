"""What there is to do: the tasks of a collection or a volume run, and their merge.

The programs say themselves what a folder holds (``--status``) and put it together (``--merge``);
nothing here knows what is in their files.
"""

from __future__ import annotations

import abc
import dataclasses
import json
import subprocess
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from n3p.cluster import worker
from n3p.errors import BadInput

__all__ = ["Collection", "Task", "Volume", "Work"]


@dataclasses.dataclass(frozen=True)
class Task:
    """What one machine does at a time.

    Paths are relative to the folder that it has for it; results lie in ``out``.
    """

    name: str
    """For people."""
    program: str
    """Such as ``n3p-collect``."""
    arguments: list[str]
    """Of the program."""
    expected: list[str]
    """Files that must be there at the end."""
    codes: tuple[int, ...] = (0,)
    """Exit codes with which they are what they should be."""
    files: dict[str, bytes] = dataclasses.field(default_factory=dict)
    """Small files that it needs."""
    folder: str = "."
    """Where its results go, in the folder of the whole."""
    first: list[str] = dataclasses.field(default_factory=list)
    """Results that are common to all tasks."""
    left: list[str] = dataclasses.field(default_factory=list)
    """Results that only the merge makes right."""
    sealed: bool = False
    """Whether checksums of its results are written with them."""

    def plain(self) -> dict[str, Any]:
        """The same as `worker.run` takes it."""
        return dataclasses.asdict(self)


class Work(abc.ABC):
    """Something that is done in tasks.

    Parameters
    ----------
    out
        Folder of the results.
    bin_dir
        Folder of the programs; None for those on the PATH.
    """

    program: str
    """The program that does it."""

    def __init__(self, out: Path, bin_dir: str | None) -> None:
        self.out = out
        try:
            self.path = worker.find_program(self.program, bin_dir)
            self.build = worker.version(self.path)
        except worker.Unusable as error:
            raise BadInput(str(error)) from None
        self.inputs: dict[str, bytes] = {}
        """Files that every task needs, by their path in its folder."""

    @abc.abstractmethod
    def tasks(self) -> tuple[int, list[Task]]:
        """How many tasks there are in all, and those that are not finished.

        Raises
        ------
        BadInput
            If settings or folder cannot be used, or something foreign lies there.
        """

    @abc.abstractmethod
    def merge(self) -> int:
        """Checks and puts together what the tasks left; the exit code.

        It is 2 where something lacks, is damaged or foreign.
        """

    def place(self, task: Task, files: Iterable[tuple[str, str, bytes | None]]) -> None:
        """Puts the results of a task, as `worker.run` gives them, where they belong.

        Raises
        ------
        BadInput
            If they are of other settings or another build than what is there, or not there.
        ValueError
            If they were damaged on the way.
        """
        for name, sha256, data in files:
            path = self.out / task.folder / name
            if data is None:
                if not path.exists():
                    raise BadInput(f"{path}: written elsewhere, but not there; leave out --shared")
                continue
            if worker.sha256(data) != sha256:
                raise ValueError(f"{name} was damaged on its way")
            try:
                worker.place(path, data, name in task.first)
            except worker.Differs as error:
                raise BadInput(str(error)) from None


class Sharded(Work):
    """A program that knows ``--shard``, ``--status`` and ``--merge``."""

    first: list[str]
    left: list[str]
    codes: tuple[int, ...] = (0,)

    def __init__(self, out: Path, bin_dir: str | None, threads: int) -> None:
        super().__init__(out, bin_dir)
        self.threads = ["--threads", str(threads)]
        """Of a task; what is done here alone has those that the program takes by itself."""

    @abc.abstractmethod
    def command(self, of: Path | None) -> list[str]:
        """The arguments, with files as they are called here (None), or in a task's folder."""

    @property
    @abc.abstractmethod
    def files(self) -> dict[str, bytes]:
        """The files of `command`, by their path in a task's folder."""

    def status(self) -> dict[str, Any]:
        """What the folder holds, as the program says it."""
        ended = subprocess.run(
            [self.path, *self.command(None), "--out", str(self.out), "--status"],
            capture_output=True,
            text=True,
        )
        if ended.returncode != 0:
            raise BadInput(ended.stderr.strip().removeprefix("error: "))
        found: dict[str, Any] = json.loads(ended.stdout)
        return found

    def tasks(self) -> tuple[int, list[Task]]:
        status = self.status()
        foreign = [shard for shard in status["shards"] if shard["state"] == "foreign"]
        if foreign:
            first, more = foreign[0], len(foreign) - 1
            also = f" (and {more} more)" if more else ""
            raise BadInput(
                f"{self.out / first['file']}: {first['why']}{also}; "
                "delete it, or choose another --out"
            )
        parts = status["parts"]
        todo: dict[int, list[str]] = {}
        for shard in status["shards"]:
            if shard["state"] != "finished":
                todo.setdefault(shard["part"], []).append(shard["file"])
        return parts, [
            Task(
                name=", ".join(files),
                program=self.program,
                arguments=[
                    *self.command(Path("in")),
                    *self.threads,
                    "--out",
                    "out",
                    "--shard",
                    f"{part}/{parts}",
                ],
                expected=files,
                codes=self.codes,
                files=self.files,
                first=self.first,
                left=self.left,
            )
            for part, files in sorted(todo.items())
        ]

    def merge(self) -> int:
        return subprocess.run(
            [self.path, *self.command(None), "--out", str(self.out), "--merge"]
        ).returncode


def read(path: Path) -> bytes:
    """A file's bytes."""
    try:
        return path.read_bytes()
    except OSError as error:
        raise BadInput(f"{path}: cannot be read: {error.strerror}") from None


def settings(of: Iterable[str]) -> list[str]:
    """``--set`` for each of them."""
    return [word for one in of for word in ("--set", one)]


class Collection(Sharded):
    """A data set: ``n3p-collect``."""

    program = "n3p-collect"
    first = ["metadata.json"]
    left = ["card.md"]

    def __init__(
        self,
        config: Path,
        out: Path,
        bin_dir: str | None = None,
        kind: str | None = None,
        vehicle: Path | None = None,
        set: Iterable[str] = (),
        threads: int = 1,
    ) -> None:
        super().__init__(out, bin_dir, threads)
        self.config, self.vehicle = config, vehicle
        self.more = [*(["--type", kind] if kind else []), *settings(set)]

    def command(self, of: Path | None) -> list[str]:
        words = ["--config", str(self.config if of is None else of / self.config.name)]
        if self.vehicle:
            words += [
                "--vehicle",
                str(self.vehicle if of is None else of / "vehicle" / self.vehicle.name),
            ]
        return [*words, *self.more]

    @property
    def files(self) -> dict[str, bytes]:
        files = {f"in/{self.config.name}": read(self.config)}
        if self.vehicle:
            files[f"in/vehicle/{self.vehicle.name}"] = read(self.vehicle)
        return files


class Volume(Sharded):
    """Very many scenes, each planned once and checked: ``n3p-experiment volume``."""

    program = "n3p-experiment"
    first = ["config.toml"]
    left = ["volume.json", "volume.md"]
    codes = (0, 1)
    """It ends with 1 where a path is refused, which is a result."""

    def __init__(
        self,
        config: Path,
        out: Path,
        bin_dir: str | None = None,
        set: Iterable[str] = (),
        threads: int = 1,
    ) -> None:
        super().__init__(out, bin_dir, threads)
        self.config, self.more = config, settings(set)

    def command(self, of: Path | None) -> list[str]:
        config = self.config if of is None else of / self.config.name
        return ["volume", str(config), *self.more]

    @property
    def files(self) -> dict[str, bytes]:
        return {f"in/{self.config.name}": read(self.config)}
