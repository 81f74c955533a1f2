//! `busbar run` as a service: what it tells its manager, its signals, its log, and the frames of a wire.

use std::{
    fs::{self, File},
    io::Write,
    net::TcpStream,
    os::unix::net::UnixDatagram,
    path::Path,
    process::Command,
    time::{Duration, Instant},
};

use serde_json::{Value, json};

use crate::{
    services::{body, get, site},
    support::{Service, call, command, d500, write},
};

const PATIENCE: Duration = Duration::from_secs(30);

/// Waits until it is there.
#[track_caller]
fn wait<T>(what: &str, mut found: impl FnMut() -> Option<T>) -> T {
    let deadline = Instant::now() + PATIENCE;
    loop {
        if let Some(found) = found() {
            return found;
        }
        assert!(Instant::now() < deadline, "never: {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// A gateway whose log goes to a file.
struct Running {
    service: Service,
    page: String,
    log: std::path::PathBuf,
}

impl Running {
    fn start(folder: &Path, config: &str, more: &[&str], set_up: impl FnOnce(&mut Command)) -> Self {
        let log = folder.join("log");
        let mut command = command();
        command
            .args(["run", "--config", config, "--listen", "127.0.0.1:0", "--json"])
            .args(more)
            .stderr(File::create(&log).unwrap());
        set_up(&mut command);
        let mut service = Service::spawn(&mut command);
        let shown: Value = serde_json::from_str(&service.line()).unwrap();
        Self { service, page: shown["page"].as_str().unwrap().to_owned(), log }
    }

    fn log(&self) -> String {
        fs::read_to_string(&self.log).unwrap()
    }

    fn wait_for_log(&self, part: &str, times: usize) {
        wait(part, || (self.log().matches(part).count() >= times).then_some(()));
    }

    fn api(&self, path: &str) -> Value {
        body(&get(&self.page, &format!("/api/v1/{path}")))
    }

    fn wait_online(&self, device: usize) {
        wait("online", || (self.api("devices")[device]["online"] == json!(true)).then_some(()));
    }

    /// What a wire has sent so far, and how often it was connected anew.
    fn requests(&self) -> (u64, u64) {
        let statistics = self.api("wires")[0]["statistics"].clone();
        (statistics["requests"].as_u64().unwrap(), statistics["reconnects"].as_u64().unwrap())
    }

    fn wait_for_requests(&self, more: u64) {
        let (before, _) = self.requests();
        wait("requests", || (self.requests().0 >= before + more).then_some(()));
    }
}

/// What a service manager hears.
struct Heard(UnixDatagram);

impl Heard {
    fn next(&self) -> String {
        let mut message = [0; 4096];
        let count = self.0.recv(&mut message).unwrap();
        String::from_utf8(message[..count].to_vec()).unwrap()
    }

    /// The first that begins so, and what was heard before it.
    fn until(&self, start: &str) -> (String, Vec<String>) {
        let mut before = Vec::new();
        loop {
            let message = self.next();
            if message.starts_with(start) {
                return (message, before);
            }
            before.push(message);
        }
    }
}

#[test]
fn a_service_manager_hears_what_it_waits_for() {
    let (_device, url) = d500("");
    let folder = tempfile::tempdir().unwrap();
    let config = write(folder.path(), "site.toml", &site(&url));
    let socket = folder.path().join("notify");
    let heard = Heard(UnixDatagram::bind(&socket).unwrap());
    heard.0.set_read_timeout(Some(PATIENCE)).unwrap();
    let running = Running::start(folder.path(), &config, &[], |command| {
        command.env("NOTIFY_SOCKET", &socket).env("WATCHDOG_USEC", "200000").env_remove("WATCHDOG_PID");
    });

    let (ready, before) = heard.until("READY=1");
    assert_eq!((ready.as_str(), before), ("READY=1\n", vec![]), "nothing is said before it listens");
    assert!(get(&running.page, "/api/v1/devices").starts_with("HTTP/1.1 200"));
    assert_eq!(heard.until("STATUS=1 of 1").0, "STATUS=1 of 1 devices answer, no fault\n");
    for _ in 0..3 {
        heard.until("WATCHDOG=1\n");
    }

    running.service.send("HUP");
    let (reloading, _) = heard.until("RELOADING=1");
    let at = reloading.strip_prefix("RELOADING=1\nMONOTONIC_USEC=").unwrap();
    assert!(at.trim_end().parse::<u64>().unwrap() > 0);
    let (_, between) = heard.until("READY=1\n");
    assert!(between.is_empty(), "{between:?}");

    let log = running.log.clone();
    assert_eq!(running.service.signal("TERM").0, Some(0));
    heard.until("STOPPING=1\n");
    assert!(fs::read_to_string(log).unwrap().contains("stopped"));
}

#[test]
fn nobody_to_tell_is_no_error() {
    let folder = tempfile::tempdir().unwrap();
    let config = write(folder.path(), "site.toml", &site("tcp://127.0.0.1:1"));
    let running = Running::start(folder.path(), &config, &[], |command| {
        command.env("NOTIFY_SOCKET", folder.path().join("nobody")).env("WATCHDOG_USEC", "garbage");
    });
    running.wait_for_log("gateway started", 1);
    assert_eq!(running.service.signal("INT").0, Some(0));
}

#[test]
fn a_faulty_site_file_keeps_the_running_one_and_a_right_one_keeps_its_wires() {
    let (_device, url) = d500("");
    let (_other, other) = d500("");
    let folder = tempfile::tempdir().unwrap();
    let right = site(&url);
    let config = write(folder.path(), "site.toml", &right);
    let running = Running::start(folder.path(), &config, &[], |_| {});
    running.wait_online(0);

    write(folder.path(), "site.toml", &right.replace("unit = 1", "unit = 999\ncolour = 3"));
    running.service.send("HUP");
    running.wait_for_log("the site file was refused; the one before it goes on", 1);
    let log = running.log();
    assert!(log.contains("site.toml:12:8: ") && log.contains("`colour`"), "every finding is told:\n{log}");
    let config_now = running.api("site")["config"].clone();
    let reason = config_now["refused"]["reason"].as_str().unwrap();
    assert!(reason.contains("site.toml:") && reason.contains("and 1 more, which the log has"), "{reason}");
    running.wait_for_requests(5);

    let both = format!(
        "{}{}",
        right.replace("Test site", "Two gensets"),
        format_args!(
            "\n[[wires]]\nid = \"w2\"\nendpoint = \"{other}\"\n\n\
             [[devices]]\nid = \"gen2\"\nprofile = \"datakom-d\"\nwire = \"w2\"\nunit = 1\n"
        )
    );
    write(folder.path(), "site.toml", &both);
    let (before, _) = running.requests();
    running.service.send("HUP");
    running.wait_online(1);
    let site = running.api("site");
    assert_eq!((&site["name"], &site["config"]["refused"]), (&json!("Two gensets"), &Value::Null));
    let (after, reconnects) = running.requests();
    assert!(after >= before && reconnects == 0, "the wire that did not change was not opened anew");

    fs::remove_file(&config).unwrap();
    running.service.send("HUP");
    running.wait_for_log("the site file was refused", 2);
    assert_eq!(running.api("devices").as_array().unwrap().len(), 2);
    assert_eq!(running.service.signal("TERM").0, Some(0));
}

/// The frames in a log of JSON lines, all of which are JSON.
fn frames(log: &str) -> Vec<Value> {
    let whole = &log[..log.rfind('\n').map_or(0, |end| end + 1)];
    let lines = whole
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).unwrap_or_else(|error| panic!("{error}: {line}")));
    lines.filter(|line| line["target"] == "busbar::frames").collect()
}

#[test]
fn the_frames_of_a_wire_are_logged_while_the_site_file_asks_for_them() {
    let (_device, url) = d500("");
    let folder = tempfile::tempdir().unwrap();
    let hidden = site(&url);
    let shown = hidden.replace("[[wires]]\n", "[[wires]]\ntrace = true\n");
    let config = write(folder.path(), "site.toml", &hidden);
    let running = Running::start(folder.path(), &config, &["--log", "json"], |_| {});
    running.wait_online(0);
    assert_eq!(frames(&running.log()), [] as [Value; 0]);

    write(folder.path(), "site.toml", &shown);
    running.service.send("HUP");
    let seen = wait("frames", || Some(frames(&running.log())).filter(|frames| frames.len() >= 20));
    let asked = seen.iter().position(|frame| frame["direction"] == "sent").unwrap();
    let [sent, received] = &seen[asked..asked + 2] else { panic!("{seen:?}") };
    assert_eq!((&sent["wire"], &received["wire"]), (&json!("w1"), &json!("w1")));
    assert_eq!(received["direction"], "received");
    assert!(sent["message"].as_str().unwrap().contains("unit 1: read "), "{sent}");
    assert!(received["message"].as_str().unwrap().ends_with(" registers"), "{received}");
    // The transaction's number, which the answer repeats.
    let number = |frame: &Value| frame["hex"].as_str().unwrap()[..5].to_owned();
    assert_eq!(number(sent), number(received));
    let at = |frame: &Value| frame["at"].as_str().unwrap().parse::<jiff::Timestamp>().unwrap();
    assert!(at(sent) <= at(received));

    write(folder.path(), "site.toml", &hidden);
    running.service.send("HUP");
    running.wait_for_log("the site file was read again", 2);
    // One that was on its way to the log may still come.
    running.wait_for_requests(2);
    let before = frames(&running.log()).len();
    running.wait_for_requests(20);
    assert_eq!(frames(&running.log()).len(), before, "none any more");
    assert_eq!(running.requests().1, 0, "and the wire was never dropped");
    assert_eq!(running.service.signal("TERM").0, Some(0));
}

#[test]
fn the_command_line_asks_for_frames_too_and_they_outlive_a_reload() {
    let (_device, url) = d500("");
    let folder = tempfile::tempdir().unwrap();
    let config = write(folder.path(), "site.toml", &site(&url));
    // Whoever wants less of the log wants his frames all the same.
    let running = Running::start(folder.path(), &config, &["--trace", "w1", "--log", "json"], |command| {
        command.env("BUSBAR_LOG", "warn");
    });
    let first = wait("frames", || frames(&running.log()).first().cloned());
    assert_eq!(first["direction"], "sent", "from the first on");
    running.service.send("HUP");
    let before = frames(&running.log()).len();
    wait("more", || (frames(&running.log()).len() > before + 40).then_some(()));

    write(folder.path(), "site.toml", &site(&url).replace("w1", "w2"));
    running.service.send("HUP");
    running.wait_for_log("the site has no such wire any more", 1);
    assert_eq!(running.service.signal("TERM").0, Some(0));

    call(["run", "--config", &config, "--trace", "w9"])
        .refuses()
        .says_in_one_sentence("there is no wire \"w9\" to trace; the site has w2");
}

#[test]
fn a_second_signal_ends_it_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let config = write(folder.path(), "site.toml", &site("tcp://127.0.0.1:1"));
    let running = Running::start(folder.path(), &config, &[], |_| {});
    // A client that does not finish its question is waited for.
    let address = running.page.trim_start_matches("http://").trim_end_matches('/').to_owned();
    let mut client = TcpStream::connect(address).unwrap();
    client.write_all(b"GET / HTTP/1.1\r\nHost: ").unwrap();
    get(&running.page, "/api/v1/devices");
    running.service.send("TERM");
    running.wait_for_log("stopping", 1);
    let log = running.log.clone();
    assert_eq!(running.service.signal("TERM").0, Some(0));
    let log = fs::read_to_string(log).unwrap();
    assert!(log.contains("ended at once") && !log.contains("stopped"), "{log}");
}

#[test]
fn readers_of_the_event_stream_are_told_of_the_end() {
    let (_device, url) = d500("");
    let folder = tempfile::tempdir().unwrap();
    let config = write(folder.path(), "site.toml", &site(&url));
    let running = Running::start(folder.path(), &config, &[], |_| {});
    running.wait_online(0);
    let page = running.page.clone();
    // It reads until the stream ends, in good order: with the last chunk.
    let reader = std::thread::spawn(move || get(&page, "/api/v1/events"));
    wait("a reader", || (running.log().contains("gateway started") && !reader.is_finished()).then_some(()));
    running.wait_for_requests(20);
    assert_eq!(running.service.signal("TERM").0, Some(0));
    let told = reader.join().unwrap();
    assert!(told.contains("event: values") && told.ends_with("0\r\n\r\n"), "{}", &told[told.len() - 80..]);
}

#[test]
fn the_example_unit_is_one_that_systemd_takes() {
    let unit = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/busbar.service");
    let text = fs::read_to_string(unit).unwrap();
    assert!(text.contains("ExecStart=/usr/bin/busbar run "), "{text}");
    let folder = tempfile::tempdir().unwrap();
    // It is not installed here.
    let here = text.replace("/usr/bin/busbar", env!("CARGO_BIN_EXE_busbar"));
    let file = write(folder.path(), "busbar.service", &here);
    // Where there is no systemd there is nobody to ask.
    let Ok(verdict) = Command::new("systemd-analyze").args(["verify", "--man=no", &file]).output() else {
        return;
    };
    let said = String::from_utf8_lossy(&verdict.stderr);
    // systemd before 253 does not know that type.
    let ours = |line: &&str| line.contains("busbar.service") && !line.contains("notify-reload");
    assert!(verdict.status.success() && said.lines().find(ours).is_none(), "{said}");
}
