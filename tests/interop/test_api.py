"""The HTTP side of the real gateway, judged by schemathesis, by the parser of Prometheus, and through a proxy."""

import contextlib
import http.client
import http.server
import json
import pathlib
import re
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.parse
import urllib.request

import pytest
from prometheus_client.openmetrics.parser import text_string_to_metric_families

from conftest import BINARY, PATIENCE, ended_by_ctrl_c

OPENMETRICS = "application/openmetrics-text; version=1.0.0; charset=utf-8"


@pytest.fixture(scope="module")
def gateway():
    """The address of `busbar demo`, once it is ready."""
    process = subprocess.Popen(
        [BINARY, "demo", "--listen", "127.0.0.1:0", "--json"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        page = json.loads(process.stdout.readline())["page"]
        wait_until_ready(page)
        yield page
        ended_by_ctrl_c(process)
    finally:
        process.kill()
        process.communicate()


def wait_until_ready(page):
    deadline = time.monotonic() + PATIENCE
    while True:
        try:
            assert fetch(f"{page}readyz").read() == b"ready\n"
            return
        except urllib.error.HTTPError as error:
            assert error.code == 503 and error.headers["Content-Type"] == "application/problem+json"
            assert time.monotonic() < deadline, error.read()
            time.sleep(0.05)


def fetch(url, **headers):
    return urllib.request.urlopen(urllib.request.Request(url, headers=headers), timeout=PATIENCE)


def events(response):
    """The events of a stream: name and data."""
    name = None
    for line in response:
        field, _, value = line.decode().rstrip("\n").partition(": ")
        if field == "event":
            name = value
        elif field == "data":
            yield name, json.loads(value)


def test_does_what_its_document_says(gateway, tmp_path):
    """No 5xx, and no status, content type or body that the document does not name; valid, invalid and chained calls."""
    judge = pathlib.Path(sys.executable).with_name("st")
    config = pathlib.Path(__file__).with_name("schemathesis.toml")
    call = [judge, "--config-file", config, "run", f"{gateway}api/v1/openapi.json", "--checks", "all", "--no-color"]
    done = subprocess.run(call, cwd=tmp_path, capture_output=True, text=True, timeout=PATIENCE * 3, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    tried = int(re.search(r"(\d+) generated", done.stdout).group(1))
    assert tried > 200, done.stdout


def test_event_stream(gateway):
    with fetch(f"{gateway}api/v1/events") as response:
        assert response.headers["Content-Type"] == "text/event-stream"
        stream = events(response)
        name, snapshot = next(stream)
        assert (name, len(snapshot["devices"])) == ("snapshot", 4)
        assert "values" in (name for name, _ in stream)
    for query, status in [("device=nobody", 404), ("devices=genset-1", 400), ("%FF=1", 400)]:
        with pytest.raises(urllib.error.HTTPError) as refused:
            fetch(f"{gateway}api/v1/events?{query}")
        assert refused.value.code == status
        assert refused.value.headers["Content-Type"] == "application/problem+json"
        refused.value.close()


def metrics(gateway):
    with fetch(f"{gateway}metrics") as response:
        assert response.headers["Content-Type"] == OPENMETRICS
        text = response.read().decode()
    assert text.endswith("# EOF\n")
    return {family.name: family for family in text_string_to_metric_families(text)}


def of(family, **labels):
    found = [sample.value for sample in family.samples if labels.items() <= sample.labels.items()]
    assert len(found) == 1, f"{family.name} {labels}: {found}"
    return found[0]


def test_metrics_are_openmetrics(gateway):
    families = metrics(gateway)
    devices = json.load(fetch(f"{gateway}api/v1/devices"))
    for device in devices:
        assert of(families["busbar_device_online"], device=device["id"]) == 1
        assert of(families["busbar_device"], device=device["id"], profile=device["profile"]) == 1
        assert 0 <= of(families["busbar_device_age_seconds"], device=device["id"]) < PATIENCE
    for wire in json.load(fetch(f"{gateway}api/v1/wires")):
        assert of(families["busbar_wire_connected"], wire=wire["id"]) == 1
        assert of(families["busbar_wire_requests"], wire=wire["id"]) > 0
        latency = families["busbar_wire_latency_seconds"]
        assert latency.type == "histogram"
    assert families["busbar_genset_power_active_kw"].unit == "kw"
    assert of(families["busbar_genset_frequency_hz"], device="genset-1") < 100
    states = [s for s in families["busbar_state_engine"].samples if s.labels["device"] == "genset-1"]
    assert sum(state.value for state in states) == 1 and len(states) > 5


def test_series_stay_the_same(gateway):
    """The number of series follows from the site, not from what happens on it."""
    words = ("busbar_state_", "busbar_mode", "busbar_device_identity", "busbar_wire_", "busbar_device_alarms")
    def series():
        return {
            (sample.name, *sorted(sample.labels.items()))
            for name, family in metrics(gateway).items()
            if name.startswith(words) and "exceptions" not in name
            for sample in family.samples
        }
    before = series()
    for guess in range(50):
        with contextlib.suppress(urllib.error.HTTPError):
            fetch(f"{gateway}api/v1/devices/guess-{guess}", **{"User-Agent": f"guess {guess}"})
    assert series() == before


class Prefix(http.server.BaseHTTPRequestHandler):
    """A reverse proxy as a person sets one up: everything under /busbar/ goes to the gateway, without the prefix."""

    protocol_version = "HTTP/1.1"
    gateway = None

    def do_GET(self):  # noqa: N802
        self.close_connection = True
        if not self.path.startswith("/busbar/"):
            self.send_error(404)
            return
        upstream = http.client.HTTPConnection(self.gateway, timeout=PATIENCE)
        try:
            upstream.request("GET", self.path.removeprefix("/busbar"), headers=dict(self.headers))
            answer = upstream.getresponse()
            self.send_response(answer.status)
            for name, value in answer.getheaders():
                if name.lower() not in ("transfer-encoding", "connection"):
                    self.send_header(name, value)
            self.send_header("Connection", "close")
            self.end_headers()
            while part := answer.read1(65536):
                self.wfile.write(part)
                self.wfile.flush()
        except OSError:
            pass  # The client went away, as a reader of a stream does.
        finally:
            upstream.close()

    def log_message(self, *_):
        pass


@pytest.fixture
def proxied(gateway):
    """The address of the gateway behind a proxy that serves it under a prefix."""
    handler = type("Handler", (Prefix,), {"gateway": urllib.parse.urlsplit(gateway).netloc})
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield f"http://localhost:{server.server_port}/busbar/"
        finally:
            server.shutdown()
            thread.join(PATIENCE)


def test_behind_a_prefix(proxied):
    page = fetch(proxied).read().decode()
    # What the page loads, and what that loads by itself: everything relative, or the prefix would be lost.
    links = re.findall(r'(?:src|href)="([^"#]+)"', page)
    assert any(link.endswith(".js") for link in links), page
    for link in links:
        assert not link.startswith("/"), f"{link} leaves the prefix"
        with fetch(urllib.parse.urljoin(proxied, link)) as asset:
            assert asset.status == 200
            script = asset.read().decode() if link.endswith(".js") else ""
        assert not re.search(r'["\'`]/(?:api|assets)/', script), f"{link} asks for an address outside the prefix"
    devices = json.load(fetch(f"{proxied}api/v1/devices"))
    assert len(devices) == 4
    with fetch(f"{proxied}api/v1/events") as response:
        stream = events(response)
        assert next(stream)[0] == "snapshot"
        assert "values" in (name for name, _ in stream), "changes come through as they happen"
    assert fetch(f"{proxied}metrics").headers["Content-Type"] == OPENMETRICS
