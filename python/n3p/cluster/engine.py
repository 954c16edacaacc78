"""Has Ray do it.

Hands tasks to the machines of a cluster, again where one is lost, and takes in what they bring.
"""

from __future__ import annotations

import collections
import dataclasses
import importlib
import sys
import time
from typing import Any

from n3p.cluster import worker
from n3p.cluster.work import Task, Work
from n3p.errors import BadInput

__all__ = ["Options", "run"]


@dataclasses.dataclass(frozen=True)
class Options:
    """How a cluster is used; none of it changes the results."""

    address: str = "auto"
    """Of Ray: ``auto`` for this machine's cluster, ``local`` for this machine alone, ``ray://…``."""
    cpus: int = 1
    """Processors for each task."""
    retries: int = 3
    """How often a task is tried again."""
    shared: bool = False
    """Whether every machine sees the folder of the results at the same path."""
    bin_dir: str | None = None
    """Folder of the programs on every machine; None for those on the PATH."""
    local_cpus: int | None = None
    """Processors of this machine with the address ``local``; None for all."""


class Progress:
    """Lines on stderr: how far it is, at most one every few seconds unless there is a terminal."""

    def __init__(self, what: str, total: int, done: int) -> None:
        self.what, self.total, self.before, self.done = what, total, done, done
        self.begin, self.said = time.monotonic(), 0.0
        self.terminal = sys.stderr.isatty()

    def say(self, text: str) -> None:
        """A line that stays."""
        print(("\r\x1b[K" if self.terminal else "") + text, file=sys.stderr, flush=True)

    def show(self, running: int, last: bool = False) -> None:
        """How far it is."""
        now = time.monotonic()
        if not last and now - self.said < (0.5 if self.terminal else 30.0):
            return
        self.said = now
        made, seconds = self.done - self.before, now - self.begin
        text = f"{self.what}: {self.done} of {self.total} finished"
        if made and self.done < self.total:
            left = seconds / made * (self.total - self.done)
            time_left = f"{left / 60:.0f} min" if left > 90 else f"{left:.0f} s"
            text += f", {running} handed out, about {time_left} left"
        if self.terminal and not last:
            print(f"\r\x1b[K{text}", end="", file=sys.stderr, flush=True)
        else:
            self.say(text)


def run(work: Work, options: Options) -> bool:
    """Runs the tasks of `work` that are not finished; whether all are now.

    Raises
    ------
    BadInput
        If Ray or the cluster is not there, a machine lacks the program or has another build of it,
        or the program refuses its input.
    KeyboardInterrupt
        On Ctrl-C, once Ray was told to stop. What is finished stays.
    """
    total, tasks = work.tasks()
    progress = Progress(work.program, total, total - len(tasks))
    if not tasks:
        progress.show(0, last=True)
        return True
    try:
        ray: Any = importlib.import_module("ray")
    except ImportError:
        raise BadInput(
            "Ray is not installed; install it with: pip install 'n3p[cluster]'"
        ) from None
    local = (
        {"num_cpus": options.local_cpus, "include_dashboard": False}
        if options.address == "local"
        else {}
    )
    try:
        ray.init(address=options.address, log_to_driver=False, logging_level="error", **local)
    except (ConnectionError, RuntimeError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise BadInput(f"--address {options.address}: no cluster there: {reason}") from None
    try:
        # The machines need not have this package.
        ray.cloudpickle.register_pickle_by_value(worker)
        return _Run(ray, work, options, progress).all(tasks)
    finally:
        ray.cloudpickle.unregister_pickle_by_value(worker)
        # Ends what still runs, too. Ray's `cancel` may abort this process where a task ends
        # meanwhile (ray-project/ray#54527).
        ray.shutdown()


class _Run:
    def __init__(self, ray: Any, work: Work, options: Options, progress: Progress) -> None:
        self.ray, self.work, self.options, self.progress = ray, work, options, progress
        remote = ray.remote(num_cpus=options.cpus, max_retries=0, scheduling_strategy="SPREAD")
        self.remote = remote(worker.run)
        self.inputs = ray.put(work.inputs)
        self.running: dict[Any, tuple[Task, int]] = {}
        self.lost: list[str] = []

    def all(self, tasks: list[Task]) -> bool:
        todo = collections.deque((task, 1) for task in tasks)
        largest = max(node["Resources"].get("CPU", 0) for node in self.ray.nodes() if node["Alive"])
        if largest < self.options.cpus:
            # One may yet join.
            self.progress.say(f"waiting for a machine with {self.options.cpus} processors")
        try:
            while todo or self.running:
                # Some more than can run at once, so that no machine waits; not all of many.
                most = max(2.0, 2 * self.ray.cluster_resources().get("CPU", 0) / self.options.cpus)
                while todo and len(self.running) < most:
                    self.start(*todo.popleft())
                ready, _ = self.ray.wait(list(self.running), num_returns=1, timeout=1.0)
                for reference in ready:
                    task, attempt = self.running.pop(reference)
                    reason = self.take(reference, task)
                    if reason is None:
                        self.progress.done += 1
                    elif attempt <= self.options.retries:
                        self.progress.say(f"{task.name}: try {attempt} failed, going on: {reason}")
                        todo.append((task, attempt + 1))
                    else:
                        self.progress.say(f"{task.name}: given up after {attempt} tries: {reason}")
                        self.lost.append(task.name)
                self.progress.show(len(self.running))
        finally:
            self.progress.show(0, last=True)
        return not self.lost

    def start(self, task: Task, attempt: int) -> None:
        options = self.options
        shared = str(self.work.out.resolve()) if options.shared else None
        reference = self.remote.remote(
            task.plain(), self.inputs, self.work.build, options.bin_dir, shared
        )
        self.running[reference] = (task, attempt)

    def take(self, reference: Any, task: Task) -> str | None:
        """Takes in what a task brings; why there is nothing, else."""
        try:
            brought: dict[str, Any] = self.ray.get(reference)
            if "reason" in brought:
                reason: str = brought["reason"]
                if brought["bad_input"]:
                    raise BadInput(reason)
                return reason
            self.work.place(task, brought["files"])
        except self.ray.exceptions.RayTaskError as error:
            return f"{type(error.cause).__name__}: {error.cause}"
        except self.ray.exceptions.RayError as error:
            text = " ".join(str(error).split()) or "no reason given"
            return f"the worker was lost: {type(error).__name__}: {text[:300]}"
        except ValueError as error:
            if isinstance(error, BadInput):
                raise
            return str(error)
        return None
