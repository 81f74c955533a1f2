"""pymodbus as the server of `busbar read` and `busbar registers`: other people's answers, good and bad."""

import asyncio
import socket

import pytest
from pymodbus.constants import ExcCodes

from conftest import Peer, busbar

GENSET_L1 = 10246


def u32(value):
    """Low word first, as the D-series sends it."""
    return [value & 0xFFFF, value >> 16]


def read(peer, *points, options=()):
    return busbar("read", "datakom-d", "--from", peer.url, *points, *options, "--json")


def test_reads_values_with_their_scale():
    with Peer({GENSET_L1: u32(2302), 10339: [5000], 10361: [45], 10362: [0x10000 - 55], 10605: [4]}) as peer:
        outcome = read(peer, "genset_l1_voltage", "genset_frequency", "oil_pressure", "engine_temperature", "unit_mode")
    assert outcome.status == 0, outcome.err
    readings = {reading["address"]: reading for reading in outcome.json()}
    assert readings[GENSET_L1]["value"] == 230.2
    assert readings[GENSET_L1]["raw"] == [2302, 0]
    assert readings[GENSET_L1]["unit"] == "V"
    assert readings[10339]["value"] == 50
    assert readings[10361]["value"] == 4.5
    assert readings[10362]["value"] == -5.5
    assert readings[10605]["code"] == 4
    assert all(reading["quality"] == "good" and "error" not in reading for reading in readings.values())
    assert all(reading["ts"].endswith("Z") for reading in readings.values())


def test_word_order_can_be_set():
    with Peer({GENSET_L1: [1, 2302]}) as peer:
        low = read(peer, "genset_l1_voltage").json()
        high = read(peer, "genset_l1_voltage", options=["--word-order", "high-first"]).json()
    assert low[0]["value"] == (2302 << 16 | 1) / 10
    assert high[0]["value"] == (1 << 16 | 2302) / 10
    assert low[0]["raw"] == high[0]["raw"] == [1, 2302]


def test_exact_decimals():
    with Peer({GENSET_L1: u32(0x7FFFFFFF)}) as peer:
        outcome = read(peer, "genset_l1_voltage")
    assert '"value":214748364.7' in outcome.out


def test_never_asks_for_more_than_16_or_outside_the_map():
    shown = busbar("profile", "show", "datakom-d", "--json").json()["wire"]
    blocks = {start: [0] * (end - start + 1) for start, end in shown["readable"]}
    with Peer(blocks) as peer:
        outcome = busbar("read", "datakom-d", "--from", peer.url, "--json")
    assert outcome.status == 0, outcome.err
    assert peer.requests
    for function, address, count in peer.requests:
        assert function == 3 and 1 <= count <= shown["max_read"]
        assert any(start <= address and address + count - 1 <= end for start, end in shown["readable"])


def test_an_exception_is_never_a_value():
    async def refuse(address, _count):
        return ExcCodes.DEVICE_BUSY if address <= 10339 else None

    with Peer({10339: [5000], 10605: [4]}, on_read=refuse) as peer:
        outcome = read(peer, "genset_frequency", "unit_mode")
    assert outcome.status == 1
    frequency, mode = outcome.json()
    assert (frequency["value"], frequency["raw"], frequency["quality"]) == (None, None, "bad")
    assert "exception 6" in frequency["error"] and "busy" in frequency["error"]
    assert (mode["quality"], mode["code"]) == ("good", 4)


def test_an_exception_has_the_makers_name():
    async def refuse(_address, _count):
        return ExcCodes.GATEWAY_PATH_UNAVIABLE

    with Peer({10339: [5000]}, on_read=refuse) as peer:
        named = read(peer, "genset_frequency").json()[0]
        raw = busbar("registers", peer.url, 10339, 1)
    assert "write protection" in named["error"]
    assert raw.status == 1 and "exception 10" in raw.err and "gateway path unavailable" in raw.err


def test_one_unreadable_address_does_not_cost_its_neighbours():
    """A merged read that is refused with exception 2 is taken apart."""
    with Peer({10338: [5001], 10340: [1380]}) as peer:
        outcome = read(peer, "mains_frequency", "genset_frequency", "charge_input_voltage")
    assert outcome.status == 1
    values = [(reading["quality"], reading["value"]) for reading in outcome.json()]
    assert values == [("good", 50.01), ("bad", None), ("good", 13.8)]


def test_a_short_answer_is_asked_for_again_where_it_was_cut():
    def cut(pdu):
        pdu.registers = pdu.registers[:2]
        return pdu

    with Peer({10338: [5001, 5002, 1380]}, on_answer=cut) as peer:
        outcome = read(peer, "mains_frequency", "genset_frequency", "charge_input_voltage")
    assert outcome.status == 0, outcome.err
    assert [reading["value"] for reading in outcome.json()] == [50.01, 50.02, 13.8]
    assert peer.requests == [(3, 10338, 3), (3, 10340, 1)]


def test_half_a_value_is_no_value():
    def cut(pdu):
        pdu.registers = pdu.registers[:1]
        return pdu

    with Peer({GENSET_L1: u32(2302)}, on_answer=cut) as peer:
        outcome = read(peer, "genset_l1_voltage")
    assert outcome.status == 1
    (reading,) = outcome.json()
    assert (reading["value"], reading["raw"], reading["quality"]) == (None, None, "bad")
    assert "1 of 2 registers" in reading["error"]


def test_registers_prints_what_came():
    with Peer({100: range(20)}) as peer:
        outcome = busbar("registers", peer.url, 100, 20, "--json")
        hexadecimal = busbar("registers", peer.url, "0x64", 20, "--json")
    assert outcome.status == 0, outcome.err
    assert outcome.json() == hexadecimal.json()
    assert outcome.json()["registers"] == list(range(20))
    assert peer.requests == [(3, 100, 20)] * 2


def test_registers_can_read_input_registers():
    with Peer({100: [7, 8]}) as peer:
        outcome = busbar("registers", peer.url, 100, 2, "--function", 4, "--json")
    assert outcome.json()["registers"] == [7, 8]
    assert peer.requests == [(4, 100, 2)]


def test_registers_takes_a_short_answer():
    def cut(pdu):
        pdu.registers = pdu.registers[:16]
        return pdu

    with Peer({100: range(20)}, on_answer=cut) as peer:
        outcome = busbar("registers", peer.url, 100, 20, "--json")
    assert outcome.status == 0
    assert outcome.json()["registers"] == list(range(16))
    assert "16 of 20" in outcome.err


def test_a_slow_answer_is_waited_for():
    async def slow(_address, _count):
        await asyncio.sleep(0.4)

    with Peer({10339: [5000]}, on_read=slow) as peer:
        patient = read(peer, "genset_frequency", options=["--timeout", "10s"])
        impatient = read(peer, "genset_frequency", options=["--timeout", "50ms"])
    assert patient.status == 0 and patient.json()[0]["value"] == 50
    assert impatient.status == 1
    assert impatient.json()[0]["quality"] == "bad" and "did not answer" in impatient.json()[0]["error"]


@pytest.mark.parametrize(
    "spoil",
    [
        pytest.param(lambda pdu: setattr(pdu, "dev_id", 2), id="another unit"),
        pytest.param(lambda pdu: setattr(pdu, "transaction_id", pdu.transaction_id ^ 0x5555), id="another transaction"),
        pytest.param(lambda pdu: setattr(pdu, "function_code", 4), id="another function"),
        pytest.param(lambda pdu: setattr(pdu, "registers", pdu.registers * 3), id="more than asked"),
        pytest.param(lambda pdu: setattr(pdu, "registers", []), id="nothing"),
    ],
)
def test_an_answer_to_something_else_is_never_a_value(spoil):
    def wrong(pdu):
        spoil(pdu)
        return pdu

    with Peer({10339: [5000]}, on_answer=wrong) as peer:
        outcome = read(peer, "genset_frequency", options=["--timeout", "200ms"])
        raw = busbar("registers", peer.url, 10339, 1, "--timeout", "200ms", "--json")
    assert outcome.status == 1 and raw.status == 1
    assert [(r["value"], r["raw"], r["quality"]) for r in outcome.json()] == [(None, None, "bad")]
    assert raw.out == ""


def test_the_unit_is_the_one_asked_for():
    with Peer({10339: [5000]}, unit=9) as peer:
        right = read(peer, "genset_frequency", options=["--unit", "9"])
        wrong = read(peer, "genset_frequency", options=["--unit", "8"])
    assert right.status == 0 and right.json()[0]["value"] == 50
    assert wrong.status == 1 and wrong.json()[0]["value"] is None


def test_trace_shows_every_frame_both_ways():
    with Peer({10339: [5000]}) as peer:
        outcome = read(peer, "genset_frequency", options=["--trace"])
    frames = [line for line in outcome.err.splitlines() if " > " in line or " < " in line]
    assert len(frames) == 2, outcome.err
    sent, received = frames
    assert sent.endswith("00 00 00 06 01 03 28 63 00 01") and " > " in sent
    assert received.endswith("00 00 00 05 01 03 02 13 88") and " < " in received


def test_nobody_there_is_one_sentence():
    # Bound and not listening: the port is refused, and nobody else gets it meanwhile.
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        port = unused.getsockname()[1]
        outcome = busbar("registers", f"tcp://127.0.0.1:{port}", 0, 1)
    assert outcome.status == 1 and outcome.out == ""
    assert outcome.err.count("\n") == 1 and "refused" in outcome.err and str(port) in outcome.err
