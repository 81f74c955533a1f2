"""The control of an imitation, judged by schemathesis, and what it does as pymodbus sees it."""

import contextlib
import json
import pathlib
import re
import subprocess
import sys
import time
import urllib.error
import urllib.request

import pytest

from conftest import BINARY, PATIENCE, client, ended_by_ctrl_c


@contextlib.contextmanager
def printed(*arguments):
    """A program of ours that runs; yields the document that it prints, and sees to it that Ctrl-C ends it with 0."""
    call = [BINARY, *arguments, "--json"]
    process = subprocess.Popen(call, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        yield json.loads(process.stdout.readline())
        ended_by_ctrl_c(process)
    finally:
        process.kill()
        process.communicate()


def send(url, method, body=None):
    data = None if body is None else json.dumps(body).encode()
    request = urllib.request.Request(url, data, {"Content-Type": "application/json"}, method=method)
    with urllib.request.urlopen(request, timeout=PATIENCE) as answer:
        return json.load(answer)


def address_of(bound):
    host, _, port = bound["urls"][0].removeprefix("tcp://").rpartition(":")
    return host, int(port)


def test_does_what_its_document_says(tmp_path):
    """No 5xx, and no status, content type or body that the document does not name; valid, invalid and chained calls.

    As the demonstration mounts it, below a path: the judge takes relative addresses of servers for absolute ones, and is
    told.
    """
    judge = pathlib.Path(sys.executable).with_name("st")
    config = pathlib.Path(__file__).with_name("schemathesis-control.toml")
    with printed("demo", "--listen", "127.0.0.1:0") as shown:
        call = [judge, "--config-file", config, "run", f"{shown['imitation']}openapi.json"]
        call += ["--url", shown["imitation"], "--checks", "all", "--no-color"]
        done = subprocess.run(call, cwd=tmp_path, capture_output=True, text=True, timeout=PATIENCE * 3, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    tried = int(re.search(r"(\d+) generated", done.stdout).group(1))
    assert tried > 300, done.stdout


def test_a_stranger_sees_what_was_done():
    """The mains fail at a word of ours, and pymodbus reads it from the registers of the manual."""
    call = ["emulate", "datakom-d", "--listen", "tcp://127.0.0.1:0", "--control", "127.0.0.1:0"]
    with printed(*call) as bound, client(address_of(bound)) as modbus:
        one = f"{bound['control']}api/v1/controllers/datakom-d"

        def volts():
            """The three phases in tenths."""
            return modbus.read_holding_registers(10240, count=6, device_id=1).registers[::2]

        deadline = time.monotonic() + PATIENCE
        while min(volts()) < 2000:
            assert time.monotonic() < deadline
        send(f"{one}/clock", "PUT", {"paused": True})
        lever = send(f"{one}/levers/mains", "PUT", {"position": "failed"})
        assert lever["position"] == "failed"
        assert min(volts()) > 2000, "nothing happens while the clock stands still"
        send(f"{one}/steps", "POST", {"seconds": 2})
        assert volts() == [0, 0, 0]
        send(f"{one}/pins/mains_l1_voltage", "PUT", {"value": "229.5"})
        assert volts() == [2295, 0, 0]
        with pytest.raises(urllib.error.HTTPError) as refused:
            send(f"{one}/levers/mains", "PUT", {"position": "gone"})
        assert refused.value.code == 422
        assert "`mains` cannot be `gone`; choose normal, failed" in json.load(refused.value)["detail"]
