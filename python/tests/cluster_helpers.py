"""What the tests of work on many machines do again and again."""

from n3p.cluster import worker

PARTS = [1, 2, 3, 4, 5]
"""Of the fake n3p-collect."""


def program(path, text):
    """Writes a program."""
    path.write_text(text)
    path.chmod(0o755)


def run(work, task, bin_dir, shared=None):
    """Runs a task as a worker does."""
    return worker.run(task.plain(), work.inputs, work.build, str(bin_dir), shared)


def runs(bin_dir):
    """The shards that the fake n3p-collect began, in order."""
    return [int(line) for line in (bin_dir / "runs").read_text().split()]


def finish(work, bin_dir):
    """Does all that is not finished."""
    for task in work.tasks()[1]:
        work.place(task, run(work, task, bin_dir)["files"])
