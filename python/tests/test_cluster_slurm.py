"""The scripts for Slurm, run by a few lines in its place."""

import os
import re
import subprocess

import pytest
from cluster_helpers import PARTS, program, runs

from n3p.cluster import cli, slurm
from n3p.errors import BadInput

# A Slurm of a few lines: tasks run one after the other, and again where they are requeued.
SBATCH = """\
#!/bin/bash
here=$(dirname "$0")
echo "$*" >>"$here/submitted"
for word; do
  case $word in
    --array=*) array=${word#--array=1-} ;;
    --*) ;;
    *) command+=("$word") ;;
  esac
done
for id in $(seq "${array:-1}"); do
  [ -z "$array" ] || export SLURM_ARRAY_TASK_ID=$id
  for restart in 0 1 2 3 4 5; do
    rm -f "$here/requeued"
    SLURM_JOB_ID=$id SLURM_RESTART_COUNT=$restart bash "${command[@]}" >>"$here/log" 2>&1
    code=$?
    [ -e "$here/requeued" ] || break
  done
  [ $code = 0 ] || echo "${command[1]} $id: $code" >>"$here/failed"
done
echo "4711;cluster"
"""
SCONTROL = '#!/bin/bash\n[ "$1" = requeue ] && touch "$(dirname "$0")/requeued" && kill -9 $PPID\n'


@pytest.fixture
def fake_slurm(tmp_path, monkeypatch):
    folder = tmp_path / "slurm"
    folder.mkdir()
    program(folder / "sbatch", SBATCH)
    program(folder / "srun", '#!/bin/bash\nwhile [[ $1 == --* ]]; do shift; done\nexec "$@"\n')
    program(folder / "scontrol", SCONTROL)
    monkeypatch.setenv("PATH", f"{folder}:{os.environ['PATH']}")
    return folder


def submit(script):
    subprocess.run(["bash", "-n", script], check=True)
    return subprocess.run(["bash", script], check=True, capture_output=True, text=True).stdout


def failed(fake_slurm):
    path = fake_slurm / "failed"
    return path.read_text() if path.exists() else ""


def test_slurm_runs_an_array_and_a_merge(collection, bin_dir, fake_slurm, tmp_path, capfd):
    script = tmp_path / "out.sbatch"
    arguments = [
        "slurm",
        "collect",
        str(collection.config),
        "--out",
        str(collection.out),
        "--bin-dir",
        str(bin_dir),
    ]
    assert cli.main([*arguments, "--tasks", "3", "--sbatch=--partition=short"]) == 0
    assert f"bash {script}" in capfd.readouterr().out
    text = script.read_text()
    assert "#SBATCH --partition=short\n" in text and not re.search("@[a-z]+@", text)
    (bin_dir / "fail-4").touch()
    assert submit(script).startswith("array 4711 of 3 tasks, merge 4711;")
    assert failed(fake_slurm) == "", (fake_slurm / "log").read_text()
    array, merge = (fake_slurm / "submitted").read_text().splitlines()
    assert "--array=1-3" in array and "--dependency=afterany:4711" in merge
    assert "once more: exit code 1" in (fake_slurm / "log").read_text()
    # Task 1 has the shards 1 and 4, of which the first was finished when the second failed.
    assert runs(bin_dir) == [1, 4, 4, 2, 5, 3]
    assert (collection.out / "merged").exists()
    # Once more: nothing is left to do.
    submit(script)
    assert len(runs(bin_dir)) == 6


def test_slurm_refuses_builds_and_gives_up(collection, bin_dir, fake_slurm, tmp_path):
    script = tmp_path / "c.sbatch"
    slurm.write(collection, slurm.Options(retries=1), [], script)
    (bin_dir / "refuse-1").touch()
    program(bin_dir / "always", "")
    text = (bin_dir / "n3p-collect").read_text().replace('ordered(f"fail-{part}")', "part == 5")
    program(bin_dir / "n3p-collect", text)
    submit(script)
    log = (fake_slurm / "log").read_text()
    assert failed(fake_slurm).splitlines() == ["task 1: 2", "task 5: 1", "merge 1: 2"], log
    assert "given up after 2 runs" in log and "cannot be merged: 1.dat is missing" in log
    (fake_slurm / "failed").unlink()
    (bin_dir / "version").write_text("n3p-collect 1.0 (def)")
    submit(script)
    assert failed(fake_slurm).splitlines() == [*(f"task {i}: 2" for i in PARTS), "merge 1: 2"]
    assert "install that build" in (fake_slurm / "log").read_text()
    with pytest.raises(BadInput, match="ends with .sbatch"):
        slurm.write(collection, slurm.Options(), [], tmp_path / "c.sh")


def test_slurm_trains(trainings, bin_dir, fake_slurm, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    command = [
        "--seeds",
        "1-2",
        "--sweep",
        "epochs=5",
        "--out",
        "models",
        "--bin-dir",
        str(bin_dir),
    ]
    training = ["--", "mlp", "--type", "reverse", "--data", "data"]
    trainings()
    assert cli.main(["slurm", "seeds", *command, "--mem", "1G", *training]) == 0
    submit(tmp_path / "models.sbatch")
    log = (fake_slurm / "log").read_text()
    assert failed(fake_slurm) == "", log
    assert "2 trainings" in log and (tmp_path / "models/runs.csv").exists()
    # What Slurm made is finished for Ray, too.
    assert cli.main(["seeds", *command, *training]) == 0
    before = (tmp_path / "models/seed-1_epochs-5/run.json").stat().st_mtime_ns
    submit(tmp_path / "models.sbatch")
    assert (tmp_path / "models/seed-1_epochs-5/run.json").stat().st_mtime_ns == before
