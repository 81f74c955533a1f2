"""pymodbus, libmodbus and mbpoll as clients of all four imitations, over TCP and over a serial line of 9600 8N1."""

import contextlib
import subprocess
import time
from dataclasses import dataclass, field

import pytest

from conftest import BINARY, PATIENCE, busbar, ended_by_ctrl_c
from strangers import SHORT, STRANGERS, Mbpoll, Pymodbus, Refused, Silent, Wire


@dataclass
class Controller:
    """What a stranger may expect of one controller, from its manual."""

    key: str
    # Some block that is readable as a whole, as long as the device answers at most.
    block: tuple
    # Registers that stand still, all 16 bits of them.
    still: list
    # Addresses that the manual does not print.
    holes: list
    # A write by function 6, the register that shows it and what it shows then: (address, value, shown at, mask, shown).
    write: tuple | None = None
    # The same by function 5.
    press: tuple | None = None
    # A register that can only be read.
    protected: int | None = None
    limit: int = 16
    # What a read of too many gets: as many as the limit, or this exception.
    too_many: int | None = None
    functions: list = field(default_factory=list)


CONTROLLERS = [
    Controller(
        "datakom-d", block=(10240, 16), still=[10609], holes=[10552, 8193, 0],
        write=(8193, 8, 10605, 0xFFFF, 8), protected=10605, functions=[3, 6, 16],
    ),
    Controller(
        "datakom-dkg705", block=(0x0000, 16), still=[0x1001, 0x102D], holes=[0x0038, 0x0044, 0x1003, 0x1029],
        write=(0x0040, 0x40, 0x003D, 0x40, 0x40), protected=0x003F, functions=[3, 6],
    ),
    Controller(
        "smartgen-hat821si", block=(500, 44), still=[], holes=[0, 499, 15000],
        press=(15004, False, 500, 1 << 8, 0), limit=120, too_many=3, functions=[3, 5],
    ),
    Controller(
        "smartgen-acc1700", block=(0, 120), still=[], holes=[200, 5000],
        press=(19, True, 0, 1 << 15, 1 << 15), limit=120, too_many=3, functions=[3, 5],
    ),
]
LISTENERS = ["tcp://127.0.0.1:0", "rtu://pty?baud=9600"]
UNIT = 7


@contextlib.contextmanager
def imitation(controller, listen):
    """An imitated controller on one wire; yields the wire. Ctrl-C ends it with 0."""
    call = [BINARY, "emulate", controller.key, "--unit", str(UNIT), "--listen", listen]
    with subprocess.Popen(call, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            url = process.stdout.readline().strip()
            assert url, process.stderr.read()
            yield Wire.of(url)
            ended_by_ctrl_c(process)
        finally:
            process.kill()


@pytest.fixture(scope="module", params=CONTROLLERS, ids=lambda controller: controller.key)
def controller(request):
    return request.param


@pytest.fixture(scope="module", params=LISTENERS, ids=["tcp", "serial"])
def wire(request, controller):
    """One imitation for the tests of one controller on one kind of wire."""
    with imitation(controller, request.param) as wire:
        yield wire


@pytest.fixture(params=STRANGERS, ids=lambda stranger: stranger.__name__.lower())
def stranger(request):
    return request.param


def windows(controller):
    """Every readable range of the profile, in reads as long as the device allows."""
    shown = busbar("profile", "show", controller.key, "--json").json()["wire"]
    for start, end in shown["readable"]:
        for address in range(start, end + 1, controller.limit):
            yield address, min(controller.limit, end + 1 - address)


def refusal(call, *arguments):
    """The exception code that a call gets."""
    with pytest.raises(Refused) as refused:
        call(*arguments)
    return refused.value.code


def test_reads_the_whole_map(controller, wire, stranger):
    reads = list(windows(controller))
    if stranger is Mbpoll:
        # A process a read: the longest of each range will do.
        reads = sorted(reads, key=lambda read: -read[1])[:4]
    with stranger(wire, UNIT) as peer:
        for address, count in reads:
            assert len(peer.read(address, count)) == count, address


def test_all_see_the_same(controller, wire):
    for address in controller.still:
        seen = set()
        for stranger in STRANGERS:
            with stranger(wire, UNIT) as peer:
                seen.update(peer.read(address))
        assert len(seen) == 1, f"{address}: {seen}"


def test_refuses_what_the_manual_does_not_have(controller, wire, stranger):
    with stranger(wire, UNIT) as peer:
        for hole in controller.holes:
            assert refusal(peer.read, hole) == 2, hole
        if 5 not in controller.functions:
            assert refusal(peer.press, 0) == 1
        else:
            assert refusal(peer.press, 9999) == 2
        if 6 not in controller.functions:
            assert refusal(peer.write, controller.block[0], 1) == 1
        if 16 not in controller.functions:
            assert refusal(peer.write_several, controller.block[0], [1, 2]) == 1
        if controller.protected:
            assert refusal(peer.write, controller.protected, 1) == 10


def test_keeps_its_limit(controller, wire):
    """pymodbus alone: the other two take a short answer for a fault of the wire."""
    address, _ = controller.block
    with Pymodbus(wire, UNIT) as peer:
        for count in (controller.limit + 1, 125):
            if controller.too_many:
                assert refusal(peer.read, address, count) == controller.too_many
            else:
                assert len(peer.read(address, count)) == controller.limit


def test_another_unit_is_silence(wire, stranger):
    with stranger(wire, UNIT + 1, timeout=SHORT) as peer, pytest.raises(Silent):
        peer.read(0)


def test_a_write_takes_effect(controller, stranger):
    for listen in LISTENERS:
        with imitation(controller, listen) as wire, stranger(wire, UNIT) as peer:
            if controller.write:
                address, value, shown_at, mask, shown = controller.write
                peer.write(address, value)
            else:
                address, value, shown_at, mask, shown = controller.press
                peer.press(address, value)
            deadline = time.monotonic() + PATIENCE
            while (seen := peer.read(shown_at)[0]) & mask != shown:
                assert time.monotonic() < deadline, f"{shown_at} reads {seen:04X}"
