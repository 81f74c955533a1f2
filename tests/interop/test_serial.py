"""pymodbus as the server of our client on a serial line, and the manuals' worked frames on the imitations' lines."""

import contextlib
import os
import select
import subprocess
import tty

import pytest
from pymodbus.constants import ExcCodes

from conftest import BINARY, PATIENCE, Peer, busbar, ended_by_ctrl_c

FUEL = 86


def test_reads_a_stranger_over_a_serial_line(line):
    with Peer({FUEL: [0xE240, 0x0001]}, unit=9, line=line) as peer:
        outcome = busbar("registers", peer.url, FUEL, 2, "--unit", 9, "--json")
        assert outcome.status == 0, outcome.err
        assert outcome.json()["registers"] == [0xE240, 1]
        outcome = busbar("read", "smartgen-acc1700", "--from", peer.url, "--unit", 9, "total_fuel", "--json")
    assert outcome.status == 0, outcome.err
    assert [reading["raw"] for reading in outcome.json()] == [[0xE240, 1]]


def test_a_whole_controller_over_a_serial_line(line):
    shown = busbar("profile", "show", "smartgen-acc1700", "--json").json()["wire"]
    blocks = {start: [1] * (end - start + 1) for start, end in shown["readable"]}
    with Peer(blocks, line=line) as peer:
        outcome = busbar("read", "smartgen-acc1700", "--from", peer.url, "--spacing", "0", "--json")
    assert outcome.status == 0, outcome.err
    readings = outcome.json()
    assert len(readings) == 99 and all(reading["quality"] == "good" for reading in readings)


def test_a_stranger_s_exception_is_told(line):
    async def refuse(_address, _count):
        return ExcCodes.ILLEGAL_ADDRESS

    with Peer({FUEL: [0, 0]}, line=line, on_read=refuse) as peer:
        outcome = busbar("registers", peer.url, FUEL, 2)
    assert outcome.status == 1
    assert "exception 2" in outcome.err


def test_nobody_there_is_told(line):
    outcome = busbar("registers", line.url, 0, 1, "--timeout", "200ms")
    assert outcome.status == 1
    assert "did not answer" in outcome.err


# From the manuals' examples of a read or a remote command: the controller, the request and how many bytes answer it.
WORKED = [
    ("datakom-d", "01 03 00 20 00 10 45 CC", 5),
    ("datakom-dkg705", "01 03 00 20 00 10 45 CC", 37),
    ("datakom-dkg705", "01 06 00 40 00 10 89 D2", 8),
    ("smartgen-hat821si", "01 03 01 FA 00 02 E5 C6", 9),
    ("smartgen-hat821si", "01 03 04 6D 00 02 54 E6", 9),
    ("smartgen-hat821si", "01 05 3A 9C FF 00 40 CC", 8),
    ("smartgen-acc1700", "01 03 00 01 00 02 95 CB", 9),
    ("smartgen-acc1700", "01 03 00 56 00 02 24 1B", 9),
    ("smartgen-acc1700", "01 05 00 03 FF 00 7C 3A", 8),
]


@contextlib.contextmanager
def raw_line(key):
    """An imitation on a pseudo-terminal, opened as bytes."""
    call = [BINARY, "emulate", key, "--unit", "1", "--listen", "rtu://pty?baud=9600"]
    with subprocess.Popen(call, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            device = process.stdout.readline().strip().removeprefix("rtu://").partition("?")[0]
            wire = os.open(device, os.O_RDWR | os.O_NOCTTY)
            try:
                tty.setraw(wire)
                yield wire
            finally:
                os.close(wire)
            ended_by_ctrl_c(process)
        finally:
            process.kill()


@pytest.mark.parametrize("key, request_frame, length", WORKED)
def test_worked_frames_are_answered(key, request_frame, length):
    with raw_line(key) as wire:
        os.write(wire, bytes.fromhex(request_frame))
        answer = b""
        while len(answer) < length:
            assert select.select([wire], [], [], PATIENCE)[0], f"only {answer.hex(' ')}"
            answer += os.read(wire, 300)
    assert len(answer) == length, answer.hex(" ")
    frame = busbar("frame", answer.hex(), "--json").json()
    assert (frame["unit"], frame["crc_ok"]) == (1, True)
    assert frame["kind"] == ("exception" if length == 5 else "response" if answer[1] == 3 else "request_or_response")
    if answer[1] != 3 and length == 8:
        assert answer == bytes.fromhex(request_frame), "an echo"


@pytest.mark.parametrize("key", ["datakom-d", "datakom-dkg705", "smartgen-hat821si", "smartgen-acc1700"])
def test_silence_for_what_is_no_request(key):
    """A wrong check sum, another unit, a broadcast: no byte, and the next good request is answered."""
    with raw_line(key) as wire:
        for frame in ("01 03 00 20 00 10 45 CD", "02 03 00 20 00 10 45 FF", "00 03 00 20 00 10 44 1D"):
            os.write(wire, bytes.fromhex(frame))
            assert not select.select([wire], [], [], 0.3)[0], frame
        os.write(wire, bytes.fromhex("01 03 00 20 00 10 45 CC"))
        assert select.select([wire], [], [], PATIENCE)[0]
