"""The command line of ``python -m n3p.cluster``.

Exit codes are those of the programs: 2 for bad input; 130 after Ctrl-C.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from n3p.cluster import engine, slurm
from n3p.cluster.seeds import Trainings, parse_seeds, parse_sweep
from n3p.cluster.work import Collection, Volume, Work
from n3p.errors import BadInput

T = TypeVar("T")


def main(arguments: list[str] | None = None) -> int:
    """Runs a command line; its exit code."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    # What comes after -- is the training's.
    training: list[str] = []
    if "--" in words:
        at = words.index("--")
        words, training = words[:at], words[at + 1 :]
    args = _parser().parse_args(words)
    args.training = training
    try:
        if training and args.work != "seeds":
            raise BadInput(f"{training[0]}: only seeds takes something after --")
        if args.engine == "slurm":
            return _slurm(args, [*words[1:], "--merge", *(["--", *training] if training else [])])
        work = _work(args, in_place=args.shared)
        if not args.merge and not engine.run(work, _engine_options(args)):
            return 1
        return work.merge()
    except BadInput as error:
        return _fail(error, 2)
    except OSError as error:
        return _fail(error, 1)
    except KeyboardInterrupt:
        print("stopped; the same command goes on with what is not finished", file=sys.stderr)
        return 130


def _fail(error: Exception, code: int) -> int:
    print(f"error: {error}", file=sys.stderr)
    return code


def _engine_options(args: argparse.Namespace) -> engine.Options:
    return engine.Options(
        address=args.address,
        cpus=args.cpus,
        retries=args.retries,
        shared=args.shared,
        bin_dir=args.bin_dir,
        local_cpus=args.local_cpus,
    )


def _slurm(args: argparse.Namespace, merge: list[str]) -> int:
    options = slurm.Options(
        tasks=args.tasks,
        cpus=args.cpus,
        time=args.time,
        memory=args.mem,
        retries=args.retries,
        more=tuple(args.sbatch),
    )
    work = _work(args, in_place=True)
    path = args.script or Path(f"{work.out}.sbatch")
    slurm.write(work, options, _merge_command(merge), path)
    print(f"{path}: submit it with: bash {path}")
    return 0


#: Options of ``slurm`` that the merge does not take, all with a value.
_ONLY_SLURM = ("--tasks", "--cpus", "--time", "--mem", "--retries", "--sbatch", "--script")


def _merge_command(words: list[str]) -> list[str]:
    """The command line without what only ``slurm`` takes."""
    kept, skip = [], False
    for word in words:
        if skip:
            skip = False
        elif word.split("=")[0] in _ONLY_SLURM:
            skip = "=" not in word
        else:
            kept.append(word)
    at = kept.index("--") if "--" in kept else len(kept)
    return [*kept[:at], "--shared", *kept[at:]]


def _work(args: argparse.Namespace, in_place: bool) -> Work:
    bin_dir = args.bin_dir
    if args.work == "collect":
        return Collection(
            args.config, args.out, bin_dir, args.type, args.vehicle, args.set, args.cpus
        )
    if args.work == "volume":
        return Volume(args.config, args.out, bin_dir, args.set, args.cpus)
    return Trainings(args.training, args.seeds, args.out, bin_dir, args.sweep, in_place)


def _parser() -> argparse.ArgumentParser:
    root = _Parser(
        prog="python -m n3p.cluster",
        description="N3P's long work on many machines; the guide is docs/cluster.md.",
    )
    kinds = root.add_subparsers(dest="work", required=True, metavar="WORK")
    for name, about, add in _WORK:
        parser = kinds.add_parser(name, help=about, description=about)
        parser.set_defaults(engine="ray")
        add(parser)
        _common(parser, retries=3)
        parser.add_argument(
            "--address",
            default="auto",
            help="of Ray: auto, local, or ray://HOST:PORT [default: auto]",
        )
        parser.add_argument(
            "--local-cpus",
            type=_count,
            metavar="N",
            help="processors that --address local uses [default: all]",
        )
        parser.add_argument(
            "--shared",
            action="store_true",
            help="every machine sees the folders at the same path; else files travel through Ray",
        )
        parser.add_argument(
            "--merge", action="store_true", help="only check and merge what is there"
        )
    script = kinds.add_parser(
        "slurm",
        help="write a script for sbatch instead: slurm collect …, slurm volume …, slurm seeds …",
    )
    kinds = script.add_subparsers(dest="work", required=True, metavar="WORK")
    for name, about, add in _WORK:
        parser = kinds.add_parser(name, help=about, description=f"{about}: a script for sbatch.")
        parser.set_defaults(engine="slurm")
        add(parser)
        _common(parser, retries=10)
        parser.add_argument(
            "--tasks",
            type=_count,
            default=100,
            metavar="N",
            help="tasks of the array, at most [default: 100]",
        )
        parser.add_argument(
            "--time",
            default="12:00:00",
            help="limit of a task; it goes on in another run [default: 12:00:00]",
        )
        parser.add_argument("--mem", default="2G", help="memory of a task [default: 2G]")
        parser.add_argument(
            "--sbatch",
            action="append",
            default=[],
            metavar="OPTION",
            help="a further option of sbatch, such as --sbatch=--partition=short",
        )
        parser.add_argument(
            "--script",
            type=Path,
            metavar="FILE",
            help="the script [default: DIR.sbatch beside the results]",
        )
    return root


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one line, as the programs do."""

    def error(self, message: str) -> Any:
        self.exit(2, f"error: {message}\nFor more information, try '--help'.\n")


def _common(parser: argparse.ArgumentParser, retries: int) -> None:
    parser.add_argument(
        "--out", type=Path, required=True, metavar="DIR", help="folder of the results"
    )
    parser.add_argument(
        "--bin-dir",
        metavar="DIR",
        help="folder of the programs, on every machine [default: the PATH]",
    )
    parser.add_argument(
        "--cpus",
        type=_count,
        default=1,
        metavar="N",
        help="processors, and threads, of a task [default: 1]",
    )
    parser.add_argument(
        "--retries",
        type=_count0,
        default=retries,
        metavar="N",
        help=f"how often a task is tried again [default: {retries}]",
    )


def _sets(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("config", type=Path, metavar="CONFIG", help="settings, a TOML file")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="a setting instead of the file's",
    )


def _collect(parser: argparse.ArgumentParser) -> None:
    _sets(parser)
    parser.add_argument(
        "--type", metavar="TYPE", help="parking type [default: forward, reverse and parallel]"
    )
    parser.add_argument("--vehicle", type=Path, metavar="FILE", help="the vehicle, a TOML file")


def _seeds(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--seeds",
        type=_checked(parse_seeds),
        default=[1],
        metavar="LIST",
        help="such as 1-8,20 [default: 1]",
    )
    parser.add_argument(
        "--sweep",
        type=_checked(parse_sweep),
        action="append",
        default=[],
        metavar="KEY=A,B",
        help="a setting and its values; several times: all combinations",
    )
    parser.usage = (
        f"{parser.prog} [OPTIONS] -- TRAINING, such as -- mlp --type reverse --data datasets/paper"
    )


_WORK: list[tuple[str, str, Callable[[argparse.ArgumentParser], None]]] = [
    ("collect", "Collects a data set by n3p-collect", _collect),
    ("volume", "Plans and checks very many scenes by n3p-experiment volume", _sets),
    ("seeds", "Trains by n3p-train, once for each seed and each setting of a sweep", _seeds),
]


def _checked(parse: Callable[[str], T]) -> Callable[[str], T]:
    def checked(text: str) -> T:
        try:
            return parse(text)
        except ValueError as error:
            raise argparse.ArgumentTypeError(str(error)) from None

    return checked


def _number(text: str, least: int) -> int:
    if not text.isdecimal() or not least <= int(text) <= 1_000_000:
        raise ValueError(f'"{text}": expected a whole number from {least} to 1000000')
    return int(text)


def _count(text: str) -> int:
    return _checked(lambda t: _number(t, 1))(text)


def _count0(text: str) -> int:
    return _checked(lambda t: _number(t, 0))(text)
