"""A server of S3's protocol on this computer."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import fsspec
import pytest


@contextmanager
def object_store() -> Iterator[list[str]]:
    """The server's requests so far; ``s3://`` leads to it meanwhile."""
    pytest.importorskip("s3fs", reason="s3fs is not installed")
    moto = pytest.importorskip("moto.server", reason="moto is not installed")
    from werkzeug.serving import WSGIRequestHandler

    requests: list[str] = []

    def met(self: Any, *_: object) -> None:
        requests.append(f"{self.command} {self.path} {self.headers.get('Range', '')}".strip())

    patch = pytest.MonkeyPatch()
    patch.setattr(WSGIRequestHandler, "log_request", met)
    running = moto.ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    running.start()
    host, port = running.get_host_and_port()
    for name, value in {
        "AWS_ENDPOINT_URL": f"http://{host}:{port}",
        "AWS_ACCESS_KEY_ID": "made-up",
        "AWS_SECRET_ACCESS_KEY": "made-up",
        "AWS_DEFAULT_REGION": "us-east-1",
        "AWS_EC2_METADATA_DISABLED": "true",
    }.items():
        patch.setenv(name, value)
    yield requests
    fsspec.get_filesystem_class("s3").clear_instance_cache()
    running.stop()
    patch.undo()


@contextmanager
def stored_logs(bucket: str, folder: str, logs: Path) -> Iterator[None]:
    """A server with the files below `logs` in a folder of a bucket."""
    with object_store():
        system = fsspec.filesystem("s3")
        system.mkdir(bucket)
        for path in logs.rglob("*.mcap"):
            system.pipe_file(f"s3://{bucket}/{folder}/{path.relative_to(logs).as_posix()}", path.read_bytes())
        yield
