"""On a Ray of two workers: lost ones, Ctrl-C, failures; and the programs themselves."""

import csv
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from cluster_helpers import PARTS, program, runs

from n3p.cluster.work import Collection, Volume


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


def collect(address, collection, bin_dir, *more):
    """The arguments that collect on this Ray."""
    places = {"--out": collection.out, "--bin-dir": bin_dir, "--address": address}
    return ["collect", collection.config, *sum(places.items(), ()), *more]


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
    process = start(*collect(address, collection, bin_dir))
    kill_worker(bin_dir / "hung")
    said = end(process, 0)
    assert "3.dat: try 1 failed, going on: the worker was lost" in said
    assert "2.dat: try 1 failed" in said and "error: the disk is full" in said
    assert sorted(runs(bin_dir)) == [1, 2, 2, 3, 3, 4, 5] and (collection.out / "merged").exists()


def test_ctrl_c_leaves_what_is_finished(address, collection, bin_dir):
    arguments = collect(address, collection, bin_dir, "--shared")
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
    arguments = collect(address, collection, bin_dir)
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
