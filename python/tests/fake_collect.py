"""Stands in for ``n3p-collect``: five shards, a file and a record each, and misbehaviour to order.

Beside the program lie ``version`` and, where asked for, ``hang-3``, ``fail-3`` or ``refuse-3``:
once so with shard 3. ``runs`` gets a line for each shard begun.
"""

import argparse
import hashlib
import json
import os
import sys
import time
from pathlib import Path

COUNT = 5
HERE = Path(sys.argv[0]).parent


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--version", action="store_true")
    for flag in ("--status", "--merge", "--resume"):
        parser.add_argument(flag, action="store_true")
    for value in ("--config", "--out", "--shard", "--threads", "--set"):
        parser.add_argument(value)
    args = parser.parse_args()
    if args.version:
        print((HERE / "version").read_text())
        return 0
    if not Path(args.config).read_text().startswith("seed"):
        print(f"error: {args.config}: no settings", file=sys.stderr)
        return 2
    out = Path(args.out)
    states = [state(out, part) for part in range(1, COUNT + 1)]
    if args.status:
        print(json.dumps({"parts": COUNT, "shards": states}))
        return 0
    if args.merge:
        for shard in states:
            if shard["state"] != "finished":
                print(
                    f"error: {out}: cannot be merged: {shard['file']} is {shard['state']}",
                    file=sys.stderr,
                )
                return 2
        (out / "merged").write_text("".join((out / shard["file"]).read_text() for shard in states))
        return 0
    out.mkdir(exist_ok=True)
    (out / "metadata.json").write_text(Path(args.config).read_text())
    number, of = map(int, args.shard.split("/"))
    for part in range(number, COUNT + 1, of):
        if states[part - 1]["state"] != "finished":
            code = collect(out, part)
            if code:
                return code
    return 0


def state(out: Path, part: int) -> dict:
    path = out / f"{part}.dat"
    shard = {"part": part, "file": path.name}
    try:
        record = json.loads(path.with_suffix(".json").read_text())
        data = path.read_bytes()
    except OSError:
        return {**shard, "state": "missing"}
    if hashlib.sha256(data).hexdigest() != record:
        return {**shard, "state": "damaged", "why": "its checksum"}
    if data != content(part).encode():
        return {**shard, "state": "foreign", "why": "it is another's"}
    return {**shard, "state": "finished"}


def content(part: int) -> str:
    return f"part {part}\n" * 1000


def ordered(what: str) -> bool:
    """Whether this misbehaviour was ordered; it is done once."""
    try:
        (HERE / what).unlink()
    except FileNotFoundError:
        return False
    return True


def collect(out: Path, part: int) -> int:
    with open(HERE / "runs", "a") as runs:
        runs.write(f"{part}\n")
    if ordered(f"hang-{part}"):
        (HERE / "hung.tmp").write_text(f"{os.getpid()} {os.getppid()}")
        (HERE / "hung.tmp").rename(HERE / "hung")
        time.sleep(600)
    if ordered(f"fail-{part}"):
        print("error: the disk is full", file=sys.stderr)
        return 1
    if ordered(f"refuse-{part}"):
        print("error: seed: expected another", file=sys.stderr)
        return 2
    data = content(part)
    (out / f"{part}.dat").write_text(data)
    (out / f"{part}.json").write_text(json.dumps(hashlib.sha256(data.encode()).hexdigest()))
    return 0


sys.exit(main())
