//! `emulate`, `run` and `demo`: where they say they are, how they end, and what keeps them from starting.

use std::{
    io::{Read, Write},
    net::{TcpListener, TcpStream},
    process::Stdio,
    time::{Duration, Instant},
};

use serde_json::{Value, json};

use crate::support::{Service, busbar, call, command, d500, without_folder, write};

/// One HTTP request, answered in full.
pub(crate) fn get(page: &str, path: &str) -> String {
    let address = page.trim_start_matches("http://").trim_end_matches('/');
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    write!(stream, "GET {path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n").unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    answer
}

/// The JSON body of an answer, however it was cut into chunks.
pub(crate) fn body(answer: &str) -> Value {
    let (start, end) = (answer.find(['{', '[']).unwrap(), answer.rfind(['}', ']']).unwrap());
    serde_json::from_str(&answer[start..=end]).unwrap_or_else(|error| panic!("{error}: {answer}"))
}

fn free_port() -> (TcpListener, u16) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    (listener, port)
}

pub(crate) fn site(url: &str) -> String {
    format!(
        "[site]\nname = \"Test site\"\n\n[[wires]]\nid = \"w1\"\nendpoint = \"{url}\"\n\n\
         [[devices]]\nid = \"gen1\"\nprofile = \"datakom-d\"\nwire = \"w1\"\nunit = 1\n"
    )
}

#[test]
fn emulate_prints_every_bound_url_first() {
    let mut service = Service::start(
        "emulate datakom-d --listen tcp://127.0.0.1:0 tcp://127.0.0.1:0 --listen tcp://127.0.0.1:0"
            .split(' '),
    );
    let urls = [service.line(), service.line(), service.line()];
    for url in &urls {
        assert!(!url.ends_with(":0"));
        busbar(&format!("registers {url} 10609 1")).ok();
    }
    assert_eq!(service.signal("INT"), (Some(0), String::new()));
}

#[test]
fn emulate_has_one_json_document() {
    let mut service = Service::start("emulate datakom-d --listen tcp://127.0.0.1:0 --json".split(' '));
    let line: Value = serde_json::from_str(&service.line()).unwrap();
    let url = line["urls"][0].as_str().unwrap();
    busbar(&format!("registers {url} 10609 1")).ok();
}

/// Year, month and day of an imitated DKG-705.
fn date(options: &str) -> String {
    let call = format!("emulate datakom-dkg705 --listen tcp://127.0.0.1:0 {options}");
    let mut service = Service::start(call.split_whitespace());
    let read =
        format!("read datakom-dkg705 clock_year clock_month clock_day --from {} --unit 1", service.line());
    let readings = busbar(&format!("{read} --json")).ok().json();
    let part = |at: usize| readings[at]["value"].as_u64().unwrap();
    format!("20{:02}-{:02}-{:02}", part(0), part(1), part(2))
}

#[test]
fn emulate_starts_a_calendar_today_and_with_a_seed_at_a_fixed_day() {
    assert_eq!([date("--seed 1"), date("--seed 7")], ["2026-01-05", "2026-01-05"]);
    let today = || jiff::Zoned::now().date().to_string();
    // A day may end in between.
    let (before, shown, after) = (today(), date(""), today());
    assert!(shown == before || shown == after, "{shown}, not {before} or {after}");
}

#[cfg(target_os = "linux")]
#[test]
fn emulate_makes_a_pseudo_terminal_and_speaks_rtu_through_tcp() {
    let mut service = Service::start(
        "emulate datakom-d --listen rtu://pty?baud=19200 --listen rtu+tcp://127.0.0.1:0".split(' '),
    );
    let (line, converter) = (service.line(), service.line());
    assert!(
        line.starts_with("rtu:///dev/pts/") && line.ends_with("?baud=19200&parity=none&stop=1"),
        "{line}"
    );
    assert!(converter.starts_with("rtu+tcp://127.0.0.1:") && !converter.ends_with(":0"), "{converter}");
    assert_eq!(service.signal("INT"), (Some(0), String::new()));
}

#[test]
fn a_line_that_cannot_be_is_one_sentence() {
    busbar("emulate datakom-d --listen rtu:///dev/busbar-has-no-such-device")
        .fails()
        .prints("")
        .says_in_one_sentence("there is no such device");
    busbar("emulate datakom-d --listen rtu://pty?baud=14400").refuses().says_in_one_sentence(
        "choose baud 2400, 4800, 9600, 19200, 38400, 57600 or 115200, parity none, stop 1",
    );
}

#[test]
fn emulate_takes_model_and_unit() {
    let mut service =
        Service::start("emulate datakom-d --listen tcp://127.0.0.1:0 --unit 9 --model D-700".split(' '));
    let url = service.line();
    let registers = busbar(&format!("registers {url} 10609 1 --unit 9 --json")).ok().json();
    assert_eq!(registers["registers"], json!([0xD700]));
}

#[test]
fn a_taken_port_is_one_sentence_and_status_1() {
    let (_taken, port) = free_port();
    let folder = tempfile::tempdir().unwrap();
    let config = write(folder.path(), "site.toml", &site("tcp://127.0.0.1:1"));
    busbar(&format!("emulate datakom-d --listen tcp://127.0.0.1:{port}"))
        .fails()
        .prints("")
        .says_in_one_sentence(&format!("127.0.0.1:{port}"));
    busbar(&format!("demo --listen 127.0.0.1:{port}"))
        .fails()
        .prints("")
        .says_in_one_sentence(&format!("127.0.0.1:{port}"));
    call(["run", "--config", &config, "--listen", &format!("127.0.0.1:{port}")])
        .fails()
        .prints("")
        .says_in_one_sentence(&format!("127.0.0.1:{port}"));
}

#[test]
fn demo_shows_a_site_that_lives() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("data");
    let mut service =
        Service::start(["demo", "--listen", "127.0.0.1:0", "--json", "--data", &data.display().to_string()]);
    let shown: Value = serde_json::from_str(&service.line()).unwrap();
    let controller = &shown["controllers"][0];
    assert_eq!(
        (&controller["profile"], &controller["model"], &controller["unit"]),
        (&json!("datakom-d"), &json!("D-500"), &json!(1))
    );

    // By hand, on the wire.
    busbar(&format!("read datakom-d --from {} fuel_level", controller["endpoint"].as_str().unwrap())).ok();

    // And through the gateway, as soon as its first poll is done.
    let page = shown["page"].as_str().unwrap();
    let deadline = Instant::now() + Duration::from_secs(30);
    loop {
        let device = body(&get(page, "/api/v1/devices"))[0].clone();
        if device["online"] == json!(true) {
            break;
        }
        assert!(Instant::now() < deadline, "never online: {device}");
    }
    assert!(get(page, "/").starts_with("HTTP/1.1 200"));
    let (status, err) = service.signal("INT");
    assert_eq!(status, Some(0), "{err}");
    assert!(!data.exists(), "nothing is kept yet, so nothing is created");
}

#[test]
fn demo_tells_people_where_to_look() {
    let mut service = Service::start("demo --listen 127.0.0.1:0".split(' '));
    let text = service.lines_to("Ctrl-C");
    assert!(text.contains("page      http://127.0.0.1:"), "{text}");
    let ends: Vec<&str> = text.lines().filter_map(|line| line.trim().strip_prefix("imitated  ")).collect();
    let [genset, line @ ..] = ends.as_slice() else { panic!("{text}") };
    assert!(genset.starts_with("Datakom D-500        tcp://127.0.0.1:"), "{text}");
    let serial: Vec<_> = line.iter().map(|end| end.split_once("rtu:///dev/pts/").unwrap()).collect();
    for ((name, url), (expected, unit)) in
        serial.iter().zip([("Datakom DKG-705", 1), ("SmartGen HAT821SI", 2), ("SmartGen ACC1700CAN", 3)])
    {
        assert_eq!(name.trim(), expected, "{text}");
        assert!(url.ends_with(&format!("?baud=9600&parity=none&stop=1, unit {unit}")), "{text}");
    }
    assert_eq!(serial.len(), 3, "{text}");
    assert!(text.contains("by hand   busbar watch datakom-d --from tcp://127.0.0.1:"), "{text}");
    let (status, err) = service.signal("TERM");
    assert_eq!((status, err.as_str()), (Some(0), ""));
}

#[test]
fn two_demonstrations_do_not_collide() {
    let mut one = Service::start("demo --listen 127.0.0.1:0 --json".split(' '));
    let mut two = Service::start("demo --listen 127.0.0.1:0 --json".split(' '));
    let endpoint =
        |line: &str| serde_json::from_str::<Value>(line).unwrap()["controllers"][0]["endpoint"].clone();
    assert_ne!(endpoint(&one.line()), endpoint(&two.line()));
}

#[test]
fn run_serves_a_site_and_shows_a_dead_wire_as_a_fault() {
    let (_device, url) = d500("");
    let folder = tempfile::tempdir().unwrap();
    let dead = format!(
        "{}\n[[wires]]\nid = \"w2\"\nendpoint = \"tcp://127.0.0.1:1\"\n\n\
         [[devices]]\nid = \"gen2\"\nprofile = \"datakom-d\"\nwire = \"w2\"\nunit = 1\n",
        site(&url)
    );
    let config = write(folder.path(), "site.toml", &dead);
    let mut service = Service::start(["run", "--config", &config, "--listen", "127.0.0.1:0", "--json"]);
    let shown: Value = serde_json::from_str(&service.line()).unwrap();
    assert_eq!((&shown["site"], &shown["devices"]), (&json!("Test site"), &json!(2)));
    let page = shown["page"].as_str().unwrap();
    let deadline = Instant::now() + Duration::from_secs(30);
    loop {
        let devices = body(&get(page, "/api/v1/devices"));
        if devices[0]["online"] == json!(true) && devices[1]["fault"].is_string() {
            assert_eq!(devices[1]["online"], json!(false));
            break;
        }
        assert!(Instant::now() < deadline, "{devices}");
    }
    assert_eq!(service.signal("INT").0, Some(0));
}

#[test]
fn mistakes_in_a_site_file_start_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let right = site("tcp://127.0.0.1:1");
    for (name, from, to) in [
        ("unknown_key", "unit = 1", "unit_id = 1"),
        ("wrong_type", "unit = 1", "unit = \"1\""),
        ("unit_out_of_range", "unit = 1", "unit = 241"),
        ("unknown_profile", "profile = \"datakom-d\"", "profile = \"datakom-x\""),
        ("unknown_wire", "wire = \"w1\"", "wire = \"w2\""),
        ("bad_endpoint", "tcp://127.0.0.1:1", "127.0.0.1:1"),
        ("no_toml", "[site]", "[site"),
    ] {
        assert!(right.contains(from));
        let config = write(folder.path(), "site.toml", &right.replace(from, to));
        let call = call(["run", "--config", &config, "--listen", "127.0.0.1:0"])
            .fails()
            .prints("")
            .mentions("site.toml:");
        insta::assert_snapshot!(format!("site_{name}"), without_folder(&call.err(), folder.path()));
    }
}

/// What `busbar run` says of a site file that cannot even be read.
fn refusal(file: &std::path::Path) -> String {
    let call =
        call(["run", "--config", file.to_str().unwrap(), "--listen", "127.0.0.1:0"]).fails().prints("");
    call.err()
}

#[test]
fn a_site_file_that_cannot_be_read_is_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let cannot = |path: &std::path::Path, why: &str| {
        format!("busbar: site file {} cannot be read: {why}\n", path.display())
    };
    let missing = file("missing.toml");
    assert_eq!(refusal(&missing), cannot(&missing, "there is no such file; check the path"));
    assert_eq!(refusal(folder.path()), cannot(folder.path(), "it is a folder; name the file in it"));

    // Sparse: it takes no room on the disk.
    let large = file("large.toml");
    std::fs::File::create(&large).unwrap().set_len(100 << 20).unwrap();
    let expected = format!(
        "busbar: site file {} is larger than 16 MiB, which none needs; check that it is the right file\n",
        large.display()
    );
    assert_eq!(refusal(&large), expected);
    #[cfg(unix)]
    assert!(refusal(std::path::Path::new("/dev/zero")).contains("is larger than 16 MiB"));
}

#[cfg(unix)]
#[test]
fn a_site_file_of_somebody_else_is_one_sentence() {
    use std::os::unix::fs::PermissionsExt;

    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("site.toml");
    std::fs::write(&file, site("tcp://127.0.0.1:1")).unwrap();
    std::fs::set_permissions(&file, PermissionsExt::from_mode(0o000)).unwrap();
    // Root reads everything.
    if std::fs::read(&file).is_err() {
        assert_eq!(
            refusal(&file),
            format!(
                "busbar: site file {} cannot be read: this user may not read it; give the right, or start as another \
                 user\n",
                file.display()
            )
        );
    }
}

#[test]
fn an_empty_site_file_is_told_what_to_begin_with() {
    let folder = tempfile::tempdir().unwrap();
    let file = write(folder.path(), "site.toml", "");
    let err = call(["run", "--config", &file]).fails().prints("").err();
    assert!(err.contains("site.toml:1:1: there is nothing in this file"), "{err}");
    assert!(err.contains("write [site] and name"), "{err}");
}

#[test]
fn a_site_file_from_another_system_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let text = format!("\u{FEFF}{}", site("tcp://127.0.0.1:1").replace('\n', "\r\n"));
    let config = write(folder.path(), "site.toml", &text);
    let mut service = Service::start(["run", "--config", &config, "--listen", "127.0.0.1:0", "--json"]);
    let shown: Value = serde_json::from_str(&service.line()).unwrap();
    assert_eq!((&shown["site"], &shown["devices"]), (&json!("Test site"), &json!(1)));
    assert_eq!(service.signal("INT").0, Some(0));
}

#[test]
fn a_site_file_of_other_bytes_is_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("site.toml");
    std::fs::write(&file, b"[site]\nname = \"T\xFF\"\n").unwrap();
    call(["run", "--config", file.to_str().unwrap()])
        .fails()
        .prints("")
        .says_in_one_sentence("site.toml is not UTF-8 text: line 2 has other bytes; save it as UTF-8");
}

#[test]
fn the_sample_site_file_is_right() {
    let sample = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/site.toml");
    let (_taken, port) = free_port();
    // The port is taken, so the file is checked and nothing is asked of the addresses in it.
    call(["run", "--config", sample, "--listen", &format!("127.0.0.1:{port}")])
        .fails()
        .says_in_one_sentence(&format!("127.0.0.1:{port}"));
}

#[test]
fn ctrl_c_ends_a_waiting_read_with_0() {
    // A peer that takes the connection and says nothing: the read waits for an hour.
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("tcp://{}", listener.local_addr().unwrap());
    let service = Service::start(["registers", &url, "0", "1", "--timeout", "3600s"]);
    let (mut stream, _) = listener.accept().unwrap();
    // The request is there, so the signal is caught by now.
    stream.read_exact(&mut [0; 12]).unwrap();
    let (status, err) = service.signal("INT");
    assert_eq!((status, err.as_str()), (Some(0), ""));
}

#[test]
fn a_closed_pipe_is_no_error() {
    // More than a pipe holds, so that the writer is still at it when the reader goes.
    for arguments in ["profile show datakom-d --json", "profile show datakom-d"] {
        let mut child = command()
            .args(arguments.split(' '))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let done = child.wait_with_output().unwrap();
        assert_eq!(
            (done.status.code(), String::from_utf8_lossy(&done.stderr).as_ref()),
            (Some(0), ""),
            "{arguments}"
        );
    }
    assert!(busbar("profile show datakom-d --json").ok().out().len() > 65_536);
}

#[test]
fn a_full_disk_is_one_sentence() {
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let done = command().args(["profile", "list"]).stdout(full).output().unwrap();
    assert_eq!(done.status.code(), Some(1));
    let err = String::from_utf8_lossy(&done.stderr);
    assert!(err.contains("standard output cannot be written") && err.lines().count() == 1, "{err}");
}
