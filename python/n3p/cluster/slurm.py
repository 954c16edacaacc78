"""Has Slurm do it: a script for ``sbatch``, an array of tasks and a merge after them.

Machines need the programs and a folder that all of them see; neither Python nor this package but
for the merge of trainings.
"""

from __future__ import annotations

import dataclasses
import shlex
import sys
from pathlib import Path

from n3p.cluster import worker
from n3p.cluster.seeds import RUN, Trainings
from n3p.cluster.work import Sharded, Work
from n3p.errors import BadInput

__all__ = ["Options", "script", "write"]

TEMPLATE = (Path(__file__).parent / "array.sbatch").read_text()


@dataclasses.dataclass(frozen=True)
class Options:
    """What the script asks Slurm for."""

    tasks: int = 100
    """Tasks of the array, at most."""
    cpus: int = 1
    """Processors of a task."""
    time: str = "12:00:00"
    """Time limit of a task, which goes on in a new run of it."""
    memory: str = "2G"
    """Memory of a task."""
    retries: int = 10
    """How often a task may run again."""
    more: tuple[str, ...] = ()
    """Further options of sbatch, such as ``--partition=short``."""


def write(work: Work, options: Options, merge: list[str], path: Path) -> None:
    """Writes the script.

    Parameters
    ----------
    merge
        The command that merges trainings.
    """
    if path.suffix != ".sbatch":
        raise BadInput(f"{path}: expected a name that ends with .sbatch")
    text = script(work, options, merge)
    path.parent.mkdir(parents=True, exist_ok=True)
    worker.write_whole(path, text.encode())


def script(work: Work, options: Options, merge: list[str]) -> str:
    """The script's text."""
    out = work.out.resolve()
    if isinstance(work, Sharded):
        parts = work.status()["parts"]
        count = max(1, min(options.tasks, parts))
        command = [work.path, *work.command(None), *work.threads, "--out", str(out)]
        resume = ["--resume"] if work.program == "n3p-collect" else []
        task = f'run {shlex.join([*command, *resume])} --shard "$SLURM_ARRAY_TASK_ID/{count}"'
        merging = shlex.join([*command, "--merge"])
    elif isinstance(work, Trainings):
        # Also refuses what another command left there.
        work.tasks()
        task, count = trainings(work, out)
        merging = shlex.join([sys.executable, "-m", "n3p.cluster", *merge])
    else:
        raise TypeError(f"no script for {type(work).__name__}")
    filled = {
        "name": work.program,
        "cpus": str(options.cpus),
        "time": options.time,
        "memory": options.memory,
        "more": "".join(f"#SBATCH {option}\n" for option in options.more),
        "count": str(count),
        "retries": str(options.retries),
        "here": shlex.quote(str(Path.cwd())),
        # Beside the results: a data set's folder holds nothing else.
        "logs": shlex.quote(f"{out}.logs"),
        "program": shlex.quote(work.path),
        "build": shlex.quote(work.build),
        "task": task,
        "merge": merging,
    }
    text = TEMPLATE
    for key, value in filled.items():
        text = text.replace(f"@{key}@", value)
    return text


def trainings(work: Trainings, out: Path) -> tuple[str, int]:
    """The lines that run one of many trainings, and how many there are."""
    cases = []
    runs = list(work.runs())
    resume = ["--resume"] if work.command[0] == "rl" else []
    for number, (name, seed, chosen) in enumerate(runs, 1):
        words = [work.path, *work.arguments(seed, chosen, str(out / name)), *resume]
        about = shlex.quote(work.about(seed, chosen).decode().rstrip("\n"))
        cases.append(
            f"  {number}) folder={shlex.quote(str(out / name))}\n"
            f"    about={about}\n"
            f"    set -- {shlex.join(words)} ;;"
        )
    lines = [
        'case "$SLURM_ARRAY_TASK_ID" in',
        *cases,
        "esac",
        'mkdir -p "$folder" && cd "$folder"',
        f"if sha256sum --check --strict --status {worker.SUMS} 2>/dev/null; then",
        '  echo "$folder: finished already"',
        "  exit 0",
        "fi",
        f"rm -f {worker.SUMS}",
        f"printf '%s\\n' \"$about\" >{RUN}",
        'run "$@"',
        # Whole or absent, as everything else.
        f"find . -maxdepth 1 -type f ! -name '{worker.SUMS}*' ! -name '*.tmp' -printf '%f\\n' |",
        "  LC_ALL=C sort | tr '\\n' '\\0' |",
        f"  xargs -0 sha256sum >{worker.SUMS}.tmp && mv {worker.SUMS}.tmp {worker.SUMS}",
    ]
    return "\n".join(lines), len(runs)
