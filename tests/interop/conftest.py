"""The real binary and pymodbus, one against the other.

Everything runs on loopback at ports that the system chooses. The binary is `$BUSBAR`, or the debug build.
"""

import asyncio
import contextlib
import json
import os
import pathlib
import signal
import subprocess
import threading
from dataclasses import dataclass

import pytest
from pymodbus.client import ModbusTcpClient
from pymodbus.server import ModbusSerialServer, ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

ROOT = pathlib.Path(__file__).resolve().parents[2]
TARGET = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
BINARY = pathlib.Path(os.environ.get("BUSBAR", TARGET / "debug" / "busbar"))

# Far above what anything here takes: reaching it is a failure, never a way to wait.
PATIENCE = 60


@dataclass
class Outcome:
    """How a call of the binary ended."""

    status: int
    out: str
    err: str

    def json(self):
        """The one document on standard output."""
        return json.loads(self.out)


def busbar(*arguments):
    """Calls the binary and waits for its end."""
    done = subprocess.run(
        [BINARY, *map(str, arguments)], capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    assert done.returncode in (0, 1, 2), f"{arguments} ended with {done.returncode}: {done.stderr}"
    return Outcome(done.returncode, done.stdout, done.stderr)


def ended_by_ctrl_c(process):
    """Presses Ctrl-C and sees to it that the process ends with 0."""
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, err


@contextlib.contextmanager
def emulation(*arguments, key="datakom-d"):
    """An imitated controller; yields its host and port, and sees to it that Ctrl-C ends it with 0."""
    process = subprocess.Popen(
        [BINARY, "emulate", key, "--listen", "tcp://127.0.0.1:0", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        url = process.stdout.readline().strip()
        assert url.startswith("tcp://127.0.0.1:"), f"no URL but {url!r}: {process.stderr.read() if not url else ''}"
        host, _, port = url.removeprefix("tcp://").rpartition(":")
        yield host, int(port)
        ended_by_ctrl_c(process)
    finally:
        process.kill()
        process.communicate()


@pytest.fixture(scope="session")
def d500():
    """One imitated D-500 for the tests that leave it as it was; yields host and port."""
    with emulation("--model", "D-500") as address:
        yield address


@contextlib.contextmanager
def client(address, timeout=10):
    """pymodbus as a client, which asks each question once."""
    host, port = address
    peer = ModbusTcpClient(host, port=port, timeout=timeout, retries=0)
    assert peer.connect()
    try:
        yield peer
    finally:
        peer.close()


@pytest.fixture
def modbus(d500):
    """pymodbus connected to the imitated D-500."""
    with client(d500) as peer:
        yield peer


@dataclass
class Line:
    """A serial line as socat makes it: bytes that go in at one end come out at the other."""

    near: str
    far: str
    process: subprocess.Popen

    @property
    def url(self):
        return f"rtu://{self.near}?baud=9600&parity=none&stop=1"


@pytest.fixture
def line(tmp_path):
    """A serial line of two pseudo-terminals, both there when the test begins."""
    near, far = tmp_path / "near", tmp_path / "far"
    call = ["socat", "-d", "-d", f"pty,raw,echo=0,link={near}", f"pty,raw,echo=0,link={far}"]
    with subprocess.Popen(call, stderr=subprocess.PIPE, text=True) as process:
        try:
            for said in process.stderr:
                if "starting data transfer loop" in said:
                    break
            yield Line(str(near), str(far), process)
        finally:
            process.kill()


class Peer:
    """pymodbus as a server in a thread of its own.

    `registers` maps the first address of each block to its values; `line` is a `Line` to sit at the far end of, else
    it listens on TCP. `on_read` is awaited before each answer and may
    return an exception code; `on_answer` sees, and may replace, each PDU that leaves.
    """

    def __init__(self, registers, unit=1, on_read=None, on_answer=None, line=None):
        self.line = line
        self.requests = []
        self.stopped = None
        self.loop = asyncio.new_event_loop()
        self.thread = threading.Thread(target=self.loop.run_until_complete, args=(self._serve(registers, unit, on_read, on_answer),))
        self.ready = threading.Event()
        self.address = None

    def __enter__(self):
        self.thread.start()
        assert self.ready.wait(PATIENCE), "pymodbus did not start"
        return self

    def __exit__(self, *_):
        self.loop.call_soon_threadsafe(self.stopped.set)
        self.thread.join(PATIENCE)
        self.loop.close()

    @property
    def url(self):
        if self.line:
            return self.line.url
        host, port = self.address
        return f"tcp://{host}:{port}"

    async def _serve(self, registers, unit, on_read, on_answer):
        async def action(function, _start, address, count, _current, values):
            self.requests.append((function, address, count))
            if values is None and on_read:
                return await on_read(address, count)
            return None

        def trace(sending, pdu):
            return on_answer(pdu) if sending and on_answer else pdu

        blocks = [
            SimData(address, values=list(values), datatype=DataType.REGISTERS)
            for address, values in registers.items()
        ]
        self.stopped = asyncio.Event()
        device = SimDevice(unit, simdata=blocks, action=action)
        if self.line:
            server = ModbusSerialServer(device, port=self.line.far, baudrate=9600, trace_pdu=trace)
        else:
            server = ModbusTcpServer(device, address=("127.0.0.1", 0), trace_pdu=trace)
        await server.serve_forever(background=True)
        if not self.line:
            self.address = server.transport.sockets[0].getsockname()
        self.ready.set()
        await self.stopped.wait()
        await server.shutdown()
