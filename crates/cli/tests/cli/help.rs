//! Help texts are a contract; and every way to call the binary wrongly.

use crate::support::{busbar, call};

#[test]
fn help_texts() {
    for command in [
        "",
        "demo",
        "run",
        "emulate",
        "profile",
        "profile list",
        "profile show",
        "profile check",
        "decode",
        "frame",
        "plan",
        "read",
        "watch",
        "registers",
        "command",
    ] {
        let help = busbar(&format!("{command} --help")).ok().silently().out();
        insta::assert_snapshot!(format!("help_{}", command.replace(' ', "_")), help);
    }
}

#[test]
fn version() {
    busbar("--version").ok().silently().prints(&format!("busbar {}\n", env!("CARGO_PKG_VERSION")));
}

#[test]
fn nothing_asked_for_is_help_and_status_2() {
    busbar("").refuses().mentions("Usage: busbar");
    busbar("profile").refuses().mentions("Usage: busbar profile");
}

#[test]
fn wrong_calls_are_one_sentence_and_status_2() {
    for (arguments, part) in [
        ("frobnicate", "there is no command \"frobnicate\""),
        ("decode datakom-d", "<ADDRESS>, <REG>... is missing"),
        ("decode datakom-d 1024x 0000", "an address is 0 to 65535, decimal or hex behind 0x"),
        ("decode datakom-d 65536 0000", "an address is 0 to 65535"),
        ("decode datakom-d 10246 08FEG", "a register is one to four hex digits"),
        ("decode datakom-d 10246 12345", "a register is one to four hex digits"),
        ("decode datakom-d 65535 0000 0000", "pass 65535, the last address"),
        ("decode datakom-d 10246 0 --word-order middle-first", "a word order is low-first or high-first"),
        ("decode datakom-x 10246 0000", "there is no profile \"datakom-x\"; the built-in ones are datakom-d"),
        ("profile show nothing", "there is no profile \"nothing\""),
        ("frame", "<HEX>... is missing"),
        ("frame 01 0", "\"0\" has 1 hex digits; write two for each byte"),
        ("frame 01 xy", "\"x\" in \"xy\" is no hex digit"),
        ("frame 0103 --profile nothing", "there is no profile \"nothing\""),
        ("read datakom-d", "--from <URL> is missing"),
        ("read datakom-d --from 127.0.0.1:502", "no scheme; write tcp://127.0.0.1:502"),
        ("read datakom-d --from http://127.0.0.1:502", "unknown scheme \"http\""),
        ("read datakom-d --from tcp://127.0.0.1:70000", "port \"70000\""),
        ("read datakom-d --from tcp://127.0.0.1:1 --timeout never", "for example 500ms or 2s"),
        ("read datakom-d --from tcp://127.0.0.1:1 --unit 256", "a unit id is 0 to 255"),
        (
            "read datakom-d --from tcp://127.0.0.1:1 genset_voltage",
            "datakom-d has no point \"genset_voltage\"",
        ),
        ("read datakom-d --from tcp://127.0.0.1:1 l1_voltage", "did you mean"),
        ("read datakom-d --from tcp://127.0.0.1:1 push_buttons", "can be written and not read"),
        ("registers tcp://127.0.0.1:1 0", "<COUNT> is missing"),
        ("registers tcp://127.0.0.1:1 0 126", "one request reads 1 to 125 registers"),
        ("registers tcp://127.0.0.1:1 0 0", "one request reads 1 to 125 registers"),
        ("registers tcp://127.0.0.1:1 65530 10", "pass 65535, the last address"),
        (
            "registers tcp://127.0.0.1:1 0 1 --function 6",
            "function 3 reads holding registers and 4 input registers",
        ),
        (
            "read datakom-d --from tcp://127.0.0.1:1 --unit 241",
            "datakom-d cannot be set to unit 241; write --unit N, 1 to 240",
        ),
        ("read datakom-dkg705 --from tcp://127.0.0.1:1", "write --unit N, 1 to 250"),
        ("read smartgen-acc1700 --from tcp://127.0.0.1:1 --unit 0", "cannot be set to unit 0"),
        (
            "read datakom-dkg705 --unit 1 --from rtu:///dev/null?baud=19200",
            "datakom-dkg705 cannot be set to baud=19200; it has 9600,",
        ),
        (
            "watch datakom-d --from rtu:///dev/null?parity=even",
            "datakom-d cannot be set to parity=even; it has none,",
        ),
        (
            "command datakom-d auto --yes --to rtu:///dev/null?stop=2",
            "datakom-d cannot be set to stop=2; it has 1,",
        ),
        ("watch datakom-d", "--from <URL> is missing"),
        ("watch datakom-x --from tcp://127.0.0.1:1", "there is no profile \"datakom-x\""),
        ("watch datakom-d --from tcp://127.0.0.1:1 fuel", "did you mean fuel_level"),
        ("watch datakom-d --from tcp://127.0.0.1:1 --every 0", "write a time above zero"),
        ("command datakom-d auto", "--to <URL> is missing"),
        ("emulate datakom-d", "--listen <URL> is missing"),
        ("emulate datakom-x --listen tcp://127.0.0.1:0", "there is no profile \"datakom-x\""),
        ("emulate datakom-d --listen tcp://127.0.0.1:0 --unit 0", "0 is the broadcast address"),
        ("emulate datakom-d --listen tcp://127.0.0.1:0 --unit 241", "1 to 240"),
        ("emulate datakom-d --listen tcp://127.0.0.1:0 --model D-900", "D-300, D-500, D-545, D-700"),
        ("emulate datakom-d --listen tcp://127.0.0.1:0 --speed -1", "a speed is a number above 0"),
        ("emulate datakom-d --listen tcp://127.0.0.1:0 --speed 1e9", "speed"),
        ("emulate datakom-d --listen tcp://127.0.0.1:0 --set fuel_level", "write POINT=VALUE"),
        ("emulate datakom-d --listen tcp://127.0.0.1:0 --set nothing=1", "nothing"),
        ("emulate datakom-d --listen tcp://127.0.0.1:0 --set fuel_level=full", "fuel_level"),
        (
            "emulate datakom-d --listen tcp://127.0.0.1:0 --control 192.0.2.1:7000",
            "does not listen on 192.0.2.1:7000 without a token",
        ),
        ("emulate datakom-d --listen tcp://127.0.0.1:0 --control 7000", "write ADDRESS:PORT"),
        ("demo --listen 8080", "write ADDRESS:PORT"),
        ("run", "--config <FILE> is missing"),
        ("run --config site.toml --log xml", "a log is written as text or json"),
    ] {
        busbar(arguments).refuses().says_in_one_sentence(part);
    }
    call(["frame", ""]).fails().says_in_one_sentence("no frame: byte 0, there is nothing");
}

#[test]
fn colour_is_for_terminals_only() {
    for arguments in ["--help", "profile list", "frame 010300200010 45CC", "frobnicate"] {
        let call = busbar(arguments);
        assert!(!call.out().contains('\x1b') && !call.err().contains('\x1b'), "{arguments}");
    }
}
