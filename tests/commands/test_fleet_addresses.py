# SPDX-License-Identifier: BSD-3-Clause
"""Logs behind an address: s3:// on a server of this machine, and other systems of fsspec."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

import allanite as al
from allanite.commands.fleet.addresses import logs_of
from fleet_logs import column, rows_without_times, write_fleet, write_log

pytest.importorskip("fsspec")


@pytest.fixture
def bucket(monkeypatch) -> Iterator[object]:
    """An S3 bucket named logs on the loopback interface."""
    server_module = pytest.importorskip("moto.server")
    pytest.importorskip("s3fs")
    import boto3

    server = server_module.ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    server.start()
    url = f"http://127.0.0.1:{server.get_host_and_port()[1]}"
    for name, value in {
        "AWS_ACCESS_KEY_ID": "test", "AWS_SECRET_ACCESS_KEY": "test", "AWS_DEFAULT_REGION": "us-east-1",
        "AWS_ENDPOINT_URL": url, "AWS_CONFIG_FILE": "/dev/null", "AWS_SHARED_CREDENTIALS_FILE": "/dev/null",
    }.items():  # fmt: skip
        monkeypatch.setenv(name, value)
    client = boto3.client("s3", endpoint_url=url)
    client.create_bucket(Bucket="logs")
    yield client
    server.stop()


@pytest.mark.long
def test_logs_in_s3_give_the_table_of_the_same_files(tmp_path, monkeypatch, bucket):
    monkeypatch.chdir(tmp_path)
    files = write_fleet(tmp_path / "logs", 2)
    for file in files:
        bucket.upload_file(str(file), "logs", str(file.relative_to(tmp_path / "logs")))
    there = al.fleet(
        "s3://logs/**/*.csv", pattern="{lot}/{unit}_{date}_{temperature}C.csv", out="there", max_workers=1
    )
    here = al.fleet(
        "logs/**/*.csv", pattern="{lot}/{unit}_{date}_{temperature}C.csv", out="here", max_workers=1
    )
    assert there.failed == ()
    names = [{**row, "log": row["log"].removeprefix("s3://")} for row in rows_without_times(there.path)]
    assert names == rows_without_times(here.path)
    write_log(files[0], seed=99)
    bucket.upload_file(str(files[0]), "logs", str(files[0].relative_to(tmp_path / "logs")))
    again = al.fleet("s3://logs/**/*.csv", out="there", max_workers=1)
    assert (again.done, again.kept) == (1, 1)
    bucket.delete_object(Bucket="logs", Key=str(files[1].relative_to(tmp_path / "logs")))
    assert again.study(f"s3://logs/{files[0].relative_to(tmp_path / 'logs')}").names == ("gyro_x", "gyro_y")


def test_addresses_and_globs_name_each_log_once(tmp_path):
    folder = tmp_path / "logs"
    write_log(folder / "deep" / "er" / "a.csv", seed=1, samples=8)
    write_log(folder / "b c.csv", seed=1, samples=8)
    (folder / "empty").mkdir()
    names = [log.name for log in logs_of(["logs/**/*.csv", "logs/b c.csv", "logs/*"], tmp_path)]
    assert names == ["logs/b c.csv", "logs/deep/er/a.csv"]
    absolute = logs_of([f"{folder}/*.csv"], Path("/"))
    assert [log.name for log in absolute] == [str(folder / "b c.csv")]
    remote = logs_of([f"file://{folder}/**/*.csv"], Path("/"))
    assert [log.place for log in remote] == [f"file://{folder}/b c.csv", f"file://{folder}/deep/er/a.csv"]
    assert all(log.stamp.split()[0].isdigit() for log in (*absolute, *remote))


def test_an_address_that_is_not_reached_is_refused(tmp_path):
    with pytest.raises(al.InputError, match="nowhere://logs/x cannot be listed"):
        logs_of(["nowhere://logs/x"], tmp_path)
    with pytest.raises(al.InputError, match="no such log"):
        logs_of([f"file://{tmp_path}/*.csv"], tmp_path)


def test_a_run_that_was_recorded_is_a_log(tmp_path, monkeypatch):
    from allanite.files.store.run import Run

    assert Run  # the folder is told from others by its manifest
    run = tmp_path / "runs" / "monday"
    run.mkdir(parents=True)
    (run / "manifest.jsonl").write_text("")
    (tmp_path / "runs" / "notes").mkdir()
    assert [log.name for log in logs_of(["runs/*"], tmp_path)] == ["runs/monday"]
    assert column is not None
