"""Trainings that differ in seed or settings: ``n3p-train`` for each, and a table of them all."""

from __future__ import annotations

import csv
import io
import itertools
import json
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from n3p.cluster import worker
from n3p.cluster.work import Task, Work, read, settings
from n3p.errors import BadInput

__all__ = ["Trainings", "parse_seeds", "parse_sweep"]

RUN = "run.json"
"""What a training was asked for, beside its model."""

INPUTS = ("--config", "--data", "--model")
"""Arguments that name files or folders."""

OURS = ("--out", "--seed", "--resume")
"""Arguments that are given here."""


def parse_seeds(text: str) -> list[int]:
    """``1-4,9`` as numbers.

    Raises
    ------
    ValueError
        If it is something else, or names a seed twice.
    """
    seeds: list[int] = []
    for part in text.split(","):
        found = re.fullmatch(r"(\d+)(?:-(\d+))?", part.strip())
        if not found:
            raise ValueError(f'"{part}": expected seeds such as 1-4,9')
        first, last = int(found[1]), int(found[2] or found[1])
        if last < first or last - first >= 100_000:
            raise ValueError(f'"{part}": expected a range upwards, of 100000 seeds at most')
        seeds += range(first, last + 1)
    if len(set(seeds)) < len(seeds):
        raise ValueError(f'"{text}" names a seed twice')
    return seeds


def parse_sweep(text: str) -> tuple[str, list[str]]:
    """``epochs=5,10`` as a setting and its values.

    Raises
    ------
    ValueError
        If it is something else, or names a value twice.
    """
    key, equals, values = text.partition("=")
    found = [value.strip() for value in values.split(",")]
    if not (re.fullmatch(r"[\w.]+", key) and equals and all(found)):
        raise ValueError(f'"{text}": expected a setting and its values, such as epochs=5,10')
    if len(set(found)) < len(found):
        raise ValueError(f'"{text}" names a value twice')
    return key, found


class Trainings(Work):
    """One training for each seed and each combination of settings.

    Every one has a folder of its own in `out`: model, card, logs, `RUN`, and `worker.SUMS`, which
    says that it is whole.

    Parameters
    ----------
    command
        Of ``n3p-train``, without seed and output, such as
        ``["mlp", "--type", "reverse", "--data", "datasets/paper"]``.
    in_place
        Whether the machines see input files where they are here; else they are sent.
    """

    program = "n3p-train"

    def __init__(
        self,
        command: list[str],
        seeds: list[int],
        out: Path,
        bin_dir: str | None = None,
        sweep: Iterable[tuple[str, list[str]]] = (),
        in_place: bool = False,
    ) -> None:
        super().__init__(out, bin_dir)
        if not command:
            raise BadInput(
                "no training; give one after --, such as -- mlp --type reverse --data DIR"
            )
        for word in command:
            if word.split("=")[0] in OURS:
                raise BadInput(f"{word} after --: each training gets its own; leave it out")
        self.seeds, self.sweep = seeds, list(sweep)
        self.model = model_name(command)
        self.command = [part for word in command for part in split(word)]
        """As a task has it."""
        self.plain = list(self.command)
        """The same wherever the inputs are."""
        self.sums: dict[str, str] = {}
        """Checksums of the inputs."""
        for at, (flag, value) in enumerate(zip(self.command, self.command[1:]), 1):
            if flag in INPUTS and Path(value).exists():
                self._take(at, Path(value), in_place)

    def _take(self, at: int, path: Path, in_place: bool) -> None:
        """Makes the input that is word `at` of the command one of the tasks."""
        name = f"in/{len(self.sums)}/{path.name}"
        below = [p for p in sorted(path.rglob("*")) if p.is_file()] if path.is_dir() else [path]
        files = {str(Path(name) / p.relative_to(path)): read(p) for p in below}
        sums = {file: worker.sha256(data) for file, data in files.items()}
        self.sums[name] = worker.sha256(json.dumps(sums, sort_keys=True).encode())
        self.plain[at] = name
        self.command[at] = str(path.resolve()) if in_place else name
        if not in_place:
            self.inputs.update(files)

    def runs(self) -> Iterator[tuple[str, int, dict[str, str]]]:
        """Name, seed and settings of each."""
        keys = [key for key, _ in self.sweep]
        for values in itertools.product(*(values for _, values in self.sweep)):
            for seed in self.seeds:
                chosen = dict(zip(keys, values))
                parts = [f"seed-{seed}", *(f"{key}-{value}" for key, value in chosen.items())]
                yield "_".join(re.sub(r"[^\w.+-]", "-", part) for part in parts), seed, chosen

    def about(self, seed: int, chosen: dict[str, str]) -> bytes:
        """The file `RUN`: what decides the result, and nothing of where it is made."""
        told = {
            "build": self.build,
            "command": self.plain,
            "seed": seed,
            "set": chosen,
            "inputs": self.sums,
        }
        return (json.dumps(told, indent=2) + "\n").encode()

    def arguments(self, seed: int, chosen: dict[str, str], out: str) -> list[str]:
        """What ``n3p-train`` gets."""
        sets = settings(f"{key}={value}" for key, value in chosen.items())
        return [*self.command, *sets, "--seed", str(seed), "--out", f"{out}/{self.model}"]

    def state(self, name: str, seed: int, chosen: dict[str, str]) -> tuple[str, str]:
        """``finished``, ``missing``, ``damaged`` or ``foreign``, and why."""
        folder = self.out / name
        try:
            lines = (folder / worker.SUMS).read_text().splitlines()
        except FileNotFoundError:
            return "missing", ""
        except (OSError, UnicodeError) as error:
            return "damaged", f"{worker.SUMS}: {error}"
        sums = {file: sha256 for sha256, _, file in (line.partition("  ") for line in lines)}
        for file in (RUN, self.model):
            if file not in sums:
                return "damaged", f"{worker.SUMS} lacks {file}"
        for file, sha256 in sums.items():
            path = folder / file
            if not path.is_file() or worker.sha256(path.read_bytes()) != sha256:
                return "damaged", f"{file} has not the checksum in {worker.SUMS}"
        if (folder / RUN).read_bytes() != self.about(seed, chosen):
            return "foreign", f"{RUN} tells of other settings, inputs or programs"
        return "finished", ""

    def tasks(self) -> tuple[int, list[Task]]:
        runs = list(self.runs())
        tasks = []
        for name, seed, chosen in runs:
            state, why = self.state(name, seed, chosen)
            if state == "foreign":
                raise BadInput(f"{self.out / name}: {why}; delete it, or choose another --out")
            if state != "finished":
                tasks.append(
                    Task(
                        name=name,
                        program=self.program,
                        arguments=self.arguments(seed, chosen, "out"),
                        expected=[self.model],
                        files={f"out/{RUN}": self.about(seed, chosen)},
                        folder=name,
                        sealed=True,
                    )
                )
        return len(runs), tasks

    def merge(self) -> int:
        """Writes ``runs.csv``: a line for each training, with every number of its log."""
        rows: list[dict[str, Any]] = []
        for name, seed, chosen in self.runs():
            state, why = self.state(name, seed, chosen)
            if state != "finished":
                what = f"is {state}" + (f": {why}" if why else "")
                raise BadInput(f"{self.out}: cannot be merged: {name} {what}")
            folder = self.out / name
            row: dict[str, Any] = {"name": name, "seed": seed, **chosen}
            for log in sorted(folder.glob("*.training.json")):
                row.update(numbers(json.loads(log.read_bytes())))
            rows.append({**row, "model_sha256": worker.sha256((folder / self.model).read_bytes())})
        columns = list(dict.fromkeys(column for row in rows for column in row))
        text = io.StringIO()
        table = csv.DictWriter(text, columns, restval="", lineterminator="\n")
        table.writeheader()
        table.writerows(rows)
        worker.write_whole(self.out / "runs.csv", text.getvalue().encode())
        print(f"{self.out / 'runs.csv'}: {len(rows)} trainings")
        return 0


def split(word: str) -> list[str]:
    """``--data=D`` as two words."""
    flag, equals, value = word.partition("=")
    return [flag, value] if equals and flag in INPUTS else [word]


def model_name(command: list[str]) -> str:
    """The file of the model, as ``n3p-train`` names it."""
    after = {flag: value for flag, value in zip(command, command[1:])}
    kind = after.get("--type") or after.get("--env")
    stem = f"{command[0]}-{kind}" if kind else command[0]
    return f"{stem}.bin" if command[0] == "knn" else f"{stem}.safetensors"


def numbers(log: Any, of: str = "") -> Iterator[tuple[str, float]]:
    """Every number of a log that is not in a list, by its dotted name."""
    if isinstance(log, dict):
        for key, value in log.items():
            yield from numbers(value, f"{of}.{key}" if of else key)
    elif isinstance(log, (int, float)) and not isinstance(log, bool):
        yield of, log
