"""Work on many machines, without an engine: what is done, done again, refused and merged."""

import csv
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from cluster_helpers import PARTS, finish, program, run, runs

from n3p.cluster import cli, engine, worker
from n3p.cluster.seeds import parse_seeds, parse_sweep
from n3p.errors import BadInput


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
def test_bad_input_is_told_in_a_line(
    arguments, said, tmp_path, trainings, bin_dir, monkeypatch, capfd
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "c.toml").write_text("seed = 1\n")
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
