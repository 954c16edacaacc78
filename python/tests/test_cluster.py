"""Work on many machines: what is done, done again, refused and merged."""

import csv
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from n3p.cluster import cli, engine, slurm, worker
from n3p.cluster.seeds import Trainings, parse_seeds, parse_sweep
from n3p.cluster.work import Collection, Volume
from n3p.errors import BadInput

FAKE = Path(__file__).with_name("fake_collect.py")
PARTS = [1, 2, 3, 4, 5]


@pytest.fixture
def bin_dir(tmp_path):
    """A folder with a fake n3p-collect."""
    folder = tmp_path / "bin"
    folder.mkdir()
    program(folder / "n3p-collect", f"#!{sys.executable}\n{FAKE.read_text()}")
    (folder / "version").write_text("n3p-collect 1.0 (abc)")
    return folder


def program(path, text):
    path.write_text(text)
    path.chmod(0o755)


@pytest.fixture
def collection(tmp_path, bin_dir):
    (tmp_path / "c.toml").write_text("seed = 1\n")
    return Collection(tmp_path / "c.toml", tmp_path / "out", str(bin_dir))


def run(work, task, bin_dir, shared=None):
    return worker.run(task.plain(), work.inputs, work.build, str(bin_dir), shared)


def runs(bin_dir):
    return [int(line) for line in (bin_dir / "runs").read_text().split()]


def finish(work, bin_dir):
    for task in work.tasks()[1]:
        work.place(task, run(work, task, bin_dir)["files"])


# Without Ray.


def test_importing_needs_no_ray():
    code = "import sys, n3p, n3p.cluster.cli; assert 'ray' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_without_ray_it_says_what_to_install(collection, monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(BadInput, match=r"pip install 'n3p\[cluster\]'"):
        engine.run(collection, engine.Options())


def test_tasks_are_what_is_not_finished(collection, bin_dir, capfd):
    total, tasks = collection.tasks()
    assert (total, len(tasks)) == (5, 5)
    assert tasks[2].arguments[-2:] == ["--shard", "3/5"] and tasks[2].expected == ["3.dat"]
    for task in (tasks[4], tasks[1]):
        brought = run(collection, task, bin_dir)
        names = [name for name, _, _ in brought["files"]]
        # What is common first, what says that it is finished last.
        assert names == ["metadata.json", *task.expected, task.expected[0].replace("dat", "json")]
        collection.place(task, brought["files"])
    assert [task.name for task in collection.tasks()[1]] == ["1.dat", "3.dat", "4.dat"]
    assert collection.merge() == 2
    assert "1.dat is missing" in capfd.readouterr().err
    finish(collection, bin_dir)
    assert sorted(runs(bin_dir)) == PARTS
    assert collection.merge() == 0 and (collection.out / "merged").exists()
    assert not list(Path(collection.out).glob("*.tmp"))


def test_damaged_shards_are_done_again_and_foreign_ones_refused(collection, bin_dir, capfd):
    finish(collection, bin_dir)
    (collection.out / "4.dat").write_text("cut")
    assert collection.merge() == 2
    assert "4.dat is damaged" in capfd.readouterr().err
    finish(collection, bin_dir)
    assert sorted(runs(bin_dir)) == [1, 2, 3, 4, 4, 5] and collection.merge() == 0
    (collection.out / "2.dat").write_bytes((collection.out / "1.dat").read_bytes())
    shutil.copy(collection.out / "1.json", collection.out / "2.json")
    with pytest.raises(BadInput, match="2.dat: it is another's; delete it"):
        collection.tasks()


def test_a_shared_folder_gets_the_files_from_where_they_are_made(collection, bin_dir):
    for task in collection.tasks()[1]:
        brought = run(collection, task, bin_dir, shared=str(collection.out))
        assert all(data is None for _, _, data in brought["files"])
        collection.place(task, brought["files"])
    assert collection.merge() == 0
    (collection.out / "3.dat").unlink()
    with pytest.raises(
        BadInput, match="3.dat: written elsewhere, but not there; leave out --shared"
    ):
        collection.place(task, [("3.dat", "", None)])


def test_another_build_is_refused(collection, bin_dir):
    task = collection.tasks()[1][0]
    (bin_dir / "version").write_text("n3p-collect 1.0 (def)")
    brought = run(collection, task, bin_dir)
    assert (
        brought["bad_input"]
        and "(def), but the rest of the cluster has n3p-collect 1.0 (abc)" in brought["reason"]
    )
    assert run(collection, task, bin_dir / "none")["reason"].endswith(
        f"no program n3p-collect in {bin_dir / 'none'}"
    )
    # Builds without a revision are told apart by their bytes.
    (bin_dir / "version").write_text("n3p-collect 1.0 (abc+dirty)")
    builds = []
    for text in ("", "# another\n"):
        program(bin_dir / "n3p-collect", (bin_dir / "n3p-collect").read_text() + text)
        builds.append(worker.version(str(bin_dir / "n3p-collect")))
    assert builds[0] != builds[1] and "sha256:" in builds[0]


def test_results_of_other_settings_and_damaged_ones_are_refused(collection, bin_dir):
    task = collection.tasks()[1][0]
    files = run(collection, task, bin_dir)["files"]
    collection.place(task, files)
    name, sha256, data = files[1]
    with pytest.raises(ValueError, match="1.dat was damaged on its way"):
        collection.place(task, [(name, sha256, data + b"x")])
    (collection.out / "metadata.json").write_text("seed = 2\n")
    with pytest.raises(BadInput, match="metadata.json: of other settings or another build"):
        collection.place(task, files)
    # The same where the machine writes them itself.
    assert run(collection, task, bin_dir, shared=str(collection.out))["bad_input"]


def test_what_killed_workers_left_is_removed(tmp_path, monkeypatch):
    monkeypatch.setattr(worker.tempfile, "tempdir", str(tmp_path))
    with worker.scratch() as mine:
        dead = mine.with_name(mine.name + "-dead")
        dead.mkdir()
        (dead / "lock").touch()
        with worker.scratch():
            assert mine.exists() and not dead.exists()
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["collect", "none.toml", "--out", "o"], "none.toml"),
        (
            ["collect", "c.toml", "--out", "o", "--bin-dir", "nowhere"],
            "no program n3p-collect in nowhere",
        ),
        (
            ["collect", "c.toml", "--out", "o", "--cpus", "0"],
            '--cpus: "0": expected a whole number',
        ),
        (["collect", "c.toml", "--out", "o", "--", "mlp"], "mlp: only seeds"),
        (["seeds", "--seeds", "3-1", "--out", "o"], "expected a range upwards"),
        (["seeds", "--sweep", "epochs", "--out", "o"], "such as epochs=5,10"),
        (["seeds", "--out", "o", "--bin-dir", "TRAIN"], "no training; give one after --"),
        (
            ["seeds", "--out", "o", "--bin-dir", "TRAIN", "--", "mlp", "--seed", "1"],
            "--seed after --",
        ),
    ],
)
def test_bad_input_is_told_in_a_line(arguments, said, tmp_path, bin_dir, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "c.toml").write_text("seed = 1\n")
    fake_train(bin_dir)
    monkeypatch.setenv("PATH", str(bin_dir))
    try:
        code = cli.main([str(bin_dir) if word == "TRAIN" else word for word in arguments])
    except SystemExit as exit:
        code = exit.code
    told = capfd.readouterr().err
    assert code == 2 and said in told and told.startswith("error: "), told


def test_seeds_and_sweeps_are_read():
    assert parse_seeds("1-3,9") == [1, 2, 3, 9]
    assert parse_sweep("a.b=0.1, 2") == ("a.b", ["0.1", "2"])
    for bad in ("", "x", "1-", "2-1", "1,1", "-1", "0-999999"):
        with pytest.raises(ValueError, match="seed"):
            parse_seeds(bad)
    for bad in ("", "a", "=1", "a=", "a=1,1", "a b=1"):
        with pytest.raises(ValueError, match='"'):
            parse_sweep(bad)


TRAIN = """\
import json, sys
from pathlib import Path
words = sys.argv[1:]
if words == ["--version"]:
    print("n3p-train 1.0 (abc)")
    sys.exit()
after = dict(zip(words, words[1:]))
assert Path(after["--data"], "rows").read_text() == "rows"
out = Path(after["--out"])
out.write_text(after["--seed"])
log = {"losses": [1, 2], "seconds": True, "quality": {"error": int(after["--seed"]) / 2}}
out.with_suffix(".training.json").write_text(json.dumps(log))
"""


def fake_train(bin_dir):
    program(bin_dir / "n3p-train", f"#!{sys.executable}\n{TRAIN}")


@pytest.fixture
def trainings(tmp_path, bin_dir):
    fake_train(bin_dir)
    data = tmp_path / "data"
    data.mkdir()
    (data / "rows").write_text("rows")

    def make(in_place=False, epochs=("5", "6")):
        command = ["mlp", "--type", "reverse", f"--data={data}"]
        sweep = [("epochs", list(epochs))]
        return Trainings(command, [1, 2], tmp_path / "models", str(bin_dir), sweep, in_place)

    return make


def test_trainings_differ_in_seed_and_settings(trainings, bin_dir, tmp_path):
    work = trainings()
    total, tasks = work.tasks()
    names = ["seed-1_epochs-5", "seed-2_epochs-5", "seed-1_epochs-6", "seed-2_epochs-6"]
    assert total == 4 and [task.name for task in tasks] == names
    assert tasks[1].arguments[-6:] == [
        "--set",
        "epochs=5",
        "--seed",
        "2",
        "--out",
        "out/mlp-reverse.safetensors",
    ]
    with pytest.raises(BadInput, match="seed-1_epochs-5 is missing"):
        work.merge()
    finish(work, bin_dir)
    assert work.tasks() == (4, []) and trainings(in_place=True).tasks() == (4, [])
    assert work.merge() == 0
    rows = list(csv.DictReader((tmp_path / "models/runs.csv").read_text().splitlines()))
    assert [(r["name"], r["quality.error"]) for r in rows] == list(zip(names, ["0.5", "1.0"] * 2))
    assert list(rows[0]) == ["name", "seed", "epochs", "quality.error", "model_sha256"]
    # As others check it.
    folder = tmp_path / "models" / names[0]
    subprocess.run(
        ["sha256sum", "--check", "--strict", "--quiet", worker.SUMS], cwd=folder, check=True
    )

    (folder / "mlp-reverse.safetensors").write_text("other")
    with pytest.raises(
        BadInput, match="seed-1_epochs-5 is damaged: mlp-reverse.safetensors has not"
    ):
        work.merge()
    assert [task.name for task in work.tasks()[1]] == names[:1]
    finish(work, bin_dir)
    (tmp_path / "data/rows").write_text("more rows")
    with pytest.raises(
        BadInput, match="run.json tells of other settings, inputs or programs; delete it"
    ):
        trainings().tasks()


def test_a_training_that_fails_is_not_finished(trainings, bin_dir):
    work = trainings()
    task = work.tasks()[1][0]
    train = bin_dir / "n3p-train"
    program(train, train.read_text() + 'print("error: disk full", file=sys.stderr)\nsys.exit(1)\n')
    work.build = worker.version(str(train))
    # Its model is there, but may be that of an early epoch.
    brought = run(work, task, bin_dir)
    assert "ended with 1: error: disk full" in brought["reason"] and not brought["bad_input"]


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


# With Ray.


@pytest.fixture(scope="session")
def address():
    """A Ray of two workers."""
    ray = pytest.importorskip("ray", reason="Ray is not installed")
    context = ray.init(
        num_cpus=2, include_dashboard=False, log_to_driver=False, logging_level="error"
    )
    yield context.address_info["gcs_address"]
    ray.shutdown()


def start(*arguments):
    command = [sys.executable, "-m", "n3p.cluster", *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def end(process, code):
    out, err = process.communicate(timeout=100)
    assert process.returncode == code, out + err
    return out + err


def wait_for(path, seconds=60):
    until = time.monotonic() + seconds
    while not path.exists():
        assert time.monotonic() < until, f"{path} did not appear"
        time.sleep(0.05)


def is_running(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


def kill_worker(hung):
    """Kills the worker whose program hangs; the program ends with it."""
    wait_for(hung)
    program, parent = map(int, hung.read_text().split())
    os.kill(parent, signal.SIGKILL)
    until = time.monotonic() + 20
    while is_running(program):
        assert time.monotonic() < until, "the program outlived its worker"
        time.sleep(0.05)


def test_a_lost_worker_is_made_up_for(address, collection, bin_dir):
    for what in ("hang-3", "fail-2"):
        (bin_dir / what).touch()
    process = start(
        "collect",
        collection.config,
        "--out",
        collection.out,
        "--bin-dir",
        bin_dir,
        "--address",
        address,
    )
    kill_worker(bin_dir / "hung")
    said = end(process, 0)
    assert "3.dat: try 1 failed, going on: the worker was lost" in said
    assert "2.dat: try 1 failed" in said and "error: the disk is full" in said
    assert sorted(runs(bin_dir)) == [1, 2, 2, 3, 3, 4, 5] and (collection.out / "merged").exists()


def test_ctrl_c_leaves_what_is_finished(address, collection, bin_dir):
    arguments = [
        "collect",
        collection.config,
        "--out",
        collection.out,
        "--bin-dir",
        bin_dir,
        "--address",
        address,
        "--shared",
    ]
    (bin_dir / "hang-4").touch()
    process = start(*arguments)
    for part in (1, 2, 3):
        wait_for(collection.out / f"{part}.json")
    wait_for(bin_dir / "hung")
    process.send_signal(signal.SIGINT)
    assert "the same command goes on" in end(process, 130)
    program = int((bin_dir / "hung").read_text().split()[0])
    until = time.monotonic() + 20
    while is_running(program):
        assert time.monotonic() < until, "the program goes on"
        time.sleep(0.05)
    done = [part for part in PARTS if (collection.out / f"{part}.json").exists()]
    before = len(runs(bin_dir))
    end(start(*arguments), 0)
    assert sorted(runs(bin_dir)[before:]) == [part for part in PARTS if part not in done]


def test_bad_input_and_what_fails_again_and_again_end_a_run(address, collection, bin_dir):
    arguments = [
        "collect",
        collection.config,
        "--out",
        collection.out,
        "--bin-dir",
        bin_dir,
        "--address",
        address,
    ]
    (bin_dir / "refuse-2").touch()
    assert "n3p-collect ended with 2: error: seed: expected another" in end(start(*arguments), 2)
    (bin_dir / "fail-5").touch()
    said = end(start(*arguments, "--retries", "0"), 1)
    assert "5.dat: given up after 1 tries" in said and not (collection.out / "merged").exists()
    end(start(*arguments), 0)


# With the programs of this revision, in the folder that the variable `N3P_BIN` names.


@pytest.fixture(scope="session")
def programs():
    if "N3P_BIN" not in os.environ:
        pytest.skip("N3P_BIN does not name the folder of n3p-collect, n3p-experiment and n3p-train")
    return Path(os.environ["N3P_BIN"]).resolve()


TINY = """\
samples_per_cell = 10
cells_per_shard = 1
max_expansions = 300

[grid]
lane_width = { min = 4.0, max = 5.0, step = 1.0 }
bay_spot_width = { min = 2.3, max = 3.3, step = 0.5 }
dead_end = { min = 4.0, max = 12.0, step = 8.0 }
"""


def files(folder):
    return {p.name: p.read_bytes() for p in folder.iterdir()}


def test_a_collection_has_the_bytes_of_one_process(address, programs, tmp_path):
    config = tmp_path / "tiny.toml"
    config.write_text(TINY)
    whole, shared, folder = (tmp_path / name for name in ("whole", "out", "bin"))
    collect = [programs / "n3p-collect", "--config", config, "--type", "reverse", "--out"]
    subprocess.run([*collect, whole], check=True, capture_output=True)
    folder.mkdir()
    program(
        folder / "n3p-collect",
        f'#!/bin/sh\ncase "$*" in *"--shard 5/"*) if mkdir "{folder}/once" 2>/dev/null; then\n'
        f'echo "$$ $PPID" >"{folder}/t"; mv "{folder}/t" "{folder}/hung"\n'
        f'exec sleep 600; fi ;; esac\nexec "{programs}/n3p-collect" "$@"\n',
    )
    arguments = [
        "collect",
        config,
        "--type",
        "reverse",
        "--out",
        shared,
        "--bin-dir",
        folder,
        "--address",
        address,
    ]
    process = start(*arguments)
    kill_worker(folder / "hung")
    assert "reverse-0004.parquet: try 1 failed" in end(process, 0)
    assert files(shared) == files(whole)

    work = Collection(config, shared, str(folder), "reverse")
    assert work.tasks() == (12, [])
    data = (shared / "reverse-0003.parquet").read_bytes()
    (shared / "reverse-0003.parquet").write_bytes(data[:-1])
    assert "reverse-0003.parquet is damaged" in end(start(*arguments, "--merge"), 2)
    assert [task.name for task in work.tasks()[1]] == ["reverse-0003.parquet"]
    # The row of a folder with another seed, with its own record.
    other = tmp_path / "other"
    subprocess.run(
        [*collect, other, "--set", "seed=5", "--shard", "4/12"], check=True, capture_output=True
    )
    (shared / "reverse.manifest.json").unlink()
    for name in ("reverse-0003.parquet", "reverse-0003.json"):
        shutil.copy(other / name, shared / name)
    assert "reverse-0003.parquet is foreign: its metadata differs" in end(
        start(*arguments, "--merge"), 2
    )
    assert "another configuration: seed was" in end(start(*arguments, "--set", "seed=5"), 2)


def test_a_volume_run_says_the_same(address, programs, tmp_path):
    config = tmp_path / "v.toml"
    config.write_text(
        "version = 1\nseed = 9\ncount = 12\nscenes_per_shard = 4\nmap_coordinates = 1e5\n"
    )
    whole = tmp_path / "whole"
    volume = [programs / "n3p-experiment", "volume", config, "--out", whole]
    subprocess.run(volume, check=True, capture_output=True)
    arguments = [
        "volume",
        config,
        "--out",
        tmp_path / "out",
        "--bin-dir",
        programs,
        "--address",
        address,
    ]
    end(start(*arguments), 0)
    results = [
        json.loads((folder / "volume.json").read_text())["results"]
        for folder in (whole, tmp_path / "out")
    ]
    assert results[0] == results[1]
    assert (tmp_path / "out/config.toml").read_bytes() == (whole / "config.toml").read_bytes()
    record = tmp_path / "out/shard-000001.json"
    kept = record.read_text()
    record.write_text(kept.replace('"scenes": 1', '"scenes": 2', 1))
    assert "shard-000001.json is damaged: it has not the checksum" in end(
        start(*arguments, "--merge"), 2
    )
    record.unlink()
    assert "shard-000001.json is missing" in end(start(*arguments, "--merge"), 2)
    shutil.copy(tmp_path / "out/shard-000000.json", record)
    assert "shard-000001.json: it is the record of shard 0; delete it" in end(start(*arguments), 2)
    record.unlink()
    assert len(Volume(config, tmp_path / "out", str(programs)).tasks()[1]) == 1


def test_trainings_by_the_program(address, programs, tmp_path):
    config, data = tmp_path / "tiny.toml", tmp_path / "data"
    config.write_text(TINY)
    collect = [programs / "n3p-collect", "--config", config, "--type", "reverse", "--out", data]
    subprocess.run([*collect, "--set", "samples_per_cell=30"], check=True, capture_output=True)
    out = tmp_path / "out"
    arguments = ["--seeds", "1,2", "--sweep", "batch=16,32", "--out", out, "--bin-dir", programs]
    training = ["--", "mlp", "--type", "reverse", "--data", data, "--set", "epochs=1"]
    end(start("seeds", *arguments, "--address", address, *training), 0)
    rows = list(csv.DictReader((out / "runs.csv").read_text().splitlines()))
    assert len({row["model_sha256"] for row in rows}) == 4
    assert all(float(row["validation.position_median_m"]) > 0 for row in rows)
    # A setting that the program does not know ends the run.
    said = end(start("seeds", *arguments, "--address", address, *training, "--set", "epoch=1"), 2)
    assert "run.json tells of other settings" in said
    new = ["seeds", "--out", tmp_path / "new", "--bin-dir", programs, "--address", address]
    assert "unknown field `epoch`" in end(start(*new, *training, "--set", "epoch=1"), 2)
