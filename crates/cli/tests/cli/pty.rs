//! What people see on a real terminal: the table that is drawn anew in its place, and the question before a command.

use std::{
    fs::File,
    io::{Read, Write},
    os::fd::{AsFd, OwnedFd},
    process::{Child, Command, Stdio},
    sync::{
        Arc,
        atomic::{AtomicU16, Ordering},
    },
    time::Duration,
};

use rustix::{
    fs::{Mode, OFlags, open},
    pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt},
    termios::{Winsize, tcsetwinsize},
};

use crate::{
    peer::Peer,
    support::{Service, command, d500},
};

/// The binary on a terminal of its own.
struct Terminal {
    child: Child,
    master: File,
    /// Everything that came out of it.
    seen: String,
    size: (usize, usize),
}

impl Terminal {
    fn start(arguments: &str, size: (usize, usize)) -> Self {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
        grantpt(&master).unwrap();
        unlockpt(&master).unwrap();
        let path = ptsname(&master, Vec::new()).unwrap();
        let slave = open(path.as_c_str(), OFlags::RDWR | OFlags::NOCTTY, Mode::empty()).unwrap();
        let terminal = |slave: &OwnedFd| Stdio::from(slave.try_clone().unwrap());
        resize(&master, size);
        let child = command()
            .args(arguments.split_whitespace())
            .env("TERM", "xterm")
            .env("TZ", "UTC")
            .stdin(terminal(&slave))
            .stdout(terminal(&slave))
            .stderr(terminal(&slave))
            .spawn()
            .unwrap();
        Self { child, master: File::from(master), seen: String::new(), size }
    }

    fn resize(&mut self, size: (usize, usize)) {
        resize(&self.master, size);
        self.size = size;
    }

    /// Waits until `done` says so of everything that came.
    #[track_caller]
    fn wait(&mut self, done: impl Fn(&str) -> bool) {
        let mut buffer = [0; 4096];
        while !done(&self.seen) {
            assert!(self.seen.len() < 1_000_000, "it never comes:\n{}", self.screen().join("\n"));
            let count = self.master.read(&mut buffer).unwrap_or_default();
            assert!(count > 0, "it ended after:\n{}", self.seen);
            self.seen.push_str(&String::from_utf8_lossy(&buffer[..count]));
        }
    }

    fn type_line(&mut self, line: &str) {
        writeln!(self.master, "{line}").unwrap();
    }

    /// Ctrl-C, and the exit status; what comes until then is kept.
    fn interrupt(&mut self) -> Option<i32> {
        let id = self.child.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
        self.end()
    }

    fn end(&mut self) -> Option<i32> {
        let mut buffer = [0; 4096];
        // The last reader of a terminal whose other end is gone gets an error.
        while let Ok(count @ 1..) = self.master.read(&mut buffer) {
            self.seen.push_str(&String::from_utf8_lossy(&buffer[..count]));
        }
        self.child.wait().unwrap().code()
    }

    /// The lines on the screen after everything that came.
    fn screen(&self) -> Vec<String> {
        screen(&self.seen, self.size)
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn resize(master: impl AsFd, (columns, rows): (usize, usize)) {
    let size = Winsize { ws_col: columns as u16, ws_row: rows as u16, ws_xpixel: 0, ws_ypixel: 0 };
    tcsetwinsize(master, size).unwrap();
}

/// A terminal as far as `watch` uses one: lines, the cursor up, a line or the rest wiped away, colours.
fn screen(text: &str, (columns, rows): (usize, usize)) -> Vec<String> {
    let mut lines: Vec<String> = vec![String::new()];
    let (mut row, mut column) = (0, 0);
    let mut letters = text.chars();
    while let Some(letter) = letters.next() {
        match letter {
            '\r' => column = 0,
            '\n' => {
                row += 1;
                if row == lines.len() {
                    lines.push(String::new());
                }
            }
            '\x1b' => {
                assert_eq!(letters.next(), Some('['), "an escape that no test knows");
                let rest: String =
                    letters.clone().take_while(|letter| !letter.is_ascii_alphabetic()).collect();
                let number: usize = rest.parse().unwrap_or(0);
                match letters.nth(rest.len()).unwrap() {
                    'm' => {}
                    'F' => {
                        assert!(number < rows, "the cursor leaves the screen");
                        row = row.checked_sub(number).unwrap();
                        column = 0;
                    }
                    'K' => lines[row] = lines[row].chars().take(column).collect(),
                    'J' if number == 2 => lines.iter_mut().for_each(String::clear),
                    'J' => {
                        lines[row] = lines[row].chars().take(column).collect();
                        lines.truncate(row + 1);
                    }
                    'H' => (row, column) = (0, 0),
                    other => panic!("an escape that no test knows: {other}"),
                }
            }
            letter => {
                assert!(column < columns, "a line is longer than the window: {}", lines[row]);
                let mut line: Vec<char> = lines[row].chars().collect();
                line.resize(line.len().max(column + 1), ' ');
                line[column] = letter;
                lines[row] = line.into_iter().collect();
                column += 1;
            }
        }
    }
    lines
}

/// A device whose every register counts the reads.
fn counting() -> Peer {
    let count = Arc::new(AtomicU16::new(0));
    Peer::new(move |request| {
        let count = count.fetch_add(1, Ordering::SeqCst);
        request.registers(&vec![count; request.count.into()])
    })
}

/// How often the table was drawn.
fn draws(seen: &str) -> usize {
    seen.matches("Ctrl-C ends it").count()
}

#[test]
fn the_table_is_drawn_in_its_place_and_the_terminal_left_clean() {
    let peer = counting();
    let mut terminal = Terminal::start(
        &format!("watch datakom-d --from {} --every 20ms fuel_level battery_voltage", peer.url),
        (100, 24),
    );
    terminal.wait(|seen| draws(seen) >= 4);
    assert_eq!(terminal.interrupt(), Some(0));
    let screen = terminal.screen();
    let rows = |part: &str| screen.iter().filter(|line| line.contains(part)).count();
    assert_eq!(
        (rows("datakom-d, unit 1"), rows("fuel_level"), rows("battery_voltage")),
        (1, 1, 1),
        "{screen:#?}"
    );
    let row = screen.iter().find(|line| line.contains("fuel_level")).unwrap();
    assert!(row.contains("10363") && row.contains(" %") && row.contains("* changed"), "{row}");
    // Nothing is on the line that the shell writes on, and no mode of the terminal was touched.
    assert_eq!(screen.last().map(String::as_str), Some(""));
    assert!(!terminal.seen.contains("\x1b[?"));
}

#[test]
fn a_narrow_window_loses_columns_and_a_low_one_lines() {
    let peer = counting();
    let mut terminal =
        Terminal::start(&format!("watch datakom-d --from {} --every 20ms", peer.url), (36, 10));
    terminal.wait(|seen| draws(seen) >= 3);
    assert_eq!(terminal.interrupt(), Some(0));
    let screen = terminal.screen();
    assert_eq!(screen.len(), 10, "{screen:#?}");
    assert!(screen[8].ends_with("more lines: name fewer POINTs"), "{screen:#?}");
    assert!(screen[5].starts_with("  VALUE") && screen[5].contains("STATE"), "{screen:#?}");
    assert!(screen.iter().all(|line| !line.contains("POINT ") && !line.contains("ADDRESS")), "{screen:#?}");
}

#[test]
fn what_is_said_of_a_value_is_never_cut() {
    // The first round is answered, and then nobody is there any more.
    let count = Arc::new(AtomicU16::new(0));
    let peer = Peer::new(move |request| match count.fetch_add(1, Ordering::SeqCst) {
        0 | 1 => request.registers(&vec![0xFFFF; request.count.into()]),
        _ => Vec::new(),
    });
    for (columns, name) in [(80, "Shutdown alarms 2: engine, auxil…"), (30, "Shutdown alarms 2: engine, au…")]
    {
        let arguments = "smartgen-acc1700 --unit 1 --every 20ms --timeout 50ms --spacing 0";
        let points = "shutdown_alarms_2 common_status battery_voltage";
        let mut terminal =
            Terminal::start(&format!("watch {arguments} --from {} {points}", peer.url), (columns, 60));
        terminal.wait(|seen| seen.contains("stale") || seen.contains("bad"));
        assert_eq!(terminal.interrupt(), Some(0));
        let screen = terminal.screen();
        let states = screen.iter().filter(|line| line.contains("stale") || line.contains("bad")).count();
        assert_eq!(states, 3, "{screen:#?}");
        assert!(screen.iter().any(|line| line.starts_with(name)), "{screen:#?}");
    }
}

#[test]
fn a_window_that_changes_is_drawn_from_the_top() {
    let peer = counting();
    let mut terminal =
        Terminal::start(&format!("watch datakom-d --from {} --every 20ms fuel_level", peer.url), (100, 24));
    terminal.wait(|seen| draws(seen) >= 2);
    terminal.resize((50, 12));
    terminal.wait(|seen| seen.contains("\x1b[2J"));
    let drawn = draws(&terminal.seen);
    terminal.wait(|seen| draws(seen) >= drawn + 2);
    assert_eq!(terminal.interrupt(), Some(0));
    let from = terminal.seen.rfind("\x1b[H\x1b[2J").unwrap();
    let screen = screen(&terminal.seen[from..], terminal.size);
    assert_eq!(screen.iter().filter(|line| line.contains("Fuel level")).count(), 1, "{screen:#?}");
}

#[test]
fn who_falls_silent_is_said_in_words() {
    let count = Arc::new(AtomicU16::new(0));
    let peer = Peer::new(move |request| match count.fetch_add(1, Ordering::SeqCst) {
        0 => request.registers(&vec![125; request.count.into()]),
        _ => Vec::new(),
    });
    let mut terminal = Terminal::start(
        &format!("watch datakom-d --from {} --every 20ms --timeout 50ms fuel_level", peer.url),
        (100, 24),
    );
    terminal.wait(|seen| seen.contains("stale"));
    assert_eq!(terminal.interrupt(), Some(0));
    let screen = terminal.screen().join("\n");
    assert!(screen.contains("NO ANSWER: unit 1 did not answer"), "{screen}");
    assert!(screen.contains("12.5 %  stale"), "{screen}");
}

#[test]
fn a_command_is_sent_after_a_yes_and_not_after_a_no() {
    let (_device, url) = d500("");
    for (command, answer, status, said) in [
        ("stop", "n", 1, "nothing was sent, the answer was no"),
        ("stop", "", 1, "nothing was sent, the answer was no"),
        ("reset", "y", 1, "nothing was sent, the answer was no"),
        ("stop", "y", 0, "Stop: done"),
        ("reset", "datakom-d", 0, "Hard reset of the controller: done"),
    ] {
        let mut terminal =
            Terminal::start(&format!("command datakom-d {command} --to {url} --timeout 500ms"), (200, 24));
        let question = if command == "reset" { "Type datakom-d to send it: " } else { "Send it? [y/N] " };
        terminal.wait(|seen| seen.ends_with(question));
        let risk =
            if command == "reset" { "the controller restarts." } else { "the load may lose its supply." };
        assert!(terminal.seen.contains(risk), "{}", terminal.seen);
        terminal.type_line(answer);
        assert_eq!(terminal.end(), Some(status), "{command} {answer}: {}", terminal.seen);
        assert!(terminal.seen.contains(said), "{command} {answer}: {}", terminal.seen);
    }
}

#[test]
fn the_clock_is_set_to_the_time_of_the_yes() {
    let mut device = Service::start("emulate datakom-dkg705 --unit 1 --listen tcp://127.0.0.1:0".split(' '));
    let url = device.line();
    let mut terminal =
        Terminal::start(&format!("command datakom-dkg705 set_clock --unit 1 --to {url} --json"), (900, 24));
    terminal.wait(|seen| seen.ends_with("Send it? [y/N] "));
    // A person thinks it over: long enough to show.
    std::thread::sleep(Duration::from_secs(4));
    terminal.type_line("y");
    assert_eq!(terminal.end(), Some(0), "{}", terminal.seen);
    let report = terminal.seen.lines().find(|line| line.starts_with('{')).unwrap();
    let report: serde_json::Value = serde_json::from_str(report).unwrap();
    let evidence = report["evidence"].as_array().unwrap();
    let clock = evidence.iter().find(|seen| seen["id"] == "clock").unwrap();
    let text = |key: &str| clock[key].as_str().unwrap().to_owned();
    // Terminals of tests live in UTC.
    let set: jiff::civil::DateTime = text("after").parse().unwrap();
    let read: jiff::Timestamp = text("ts").parse().unwrap();
    let behind = read.duration_since(set.to_zoned(jiff::tz::TimeZone::UTC).unwrap().timestamp());
    assert!(behind.as_millis() < 3000, "{clock}");
}

#[test]
fn an_answer_that_ends_early_is_a_no() {
    let peer = Peer::new(|_| panic!("nothing is asked before the answer"));
    let mut terminal = Terminal::start(&format!("command datakom-d stop --to {}", peer.url), (200, 24));
    terminal.wait(|seen| seen.ends_with("Send it? [y/N] "));
    // Ctrl-D.
    terminal.master.write_all(b"\x04").unwrap();
    assert_eq!(terminal.end(), Some(1), "{}", terminal.seen);
    assert!(
        terminal.seen.contains("[y/N] \r\nbusbar: nothing was sent, the answer was no"),
        "{}",
        terminal.seen
    );
}

#[test]
fn ctrl_c_at_the_question_sends_nothing() {
    let peer = Peer::new(|_| panic!("nothing is asked before the answer"));
    let mut terminal = Terminal::start(&format!("command datakom-d stop --to {}", peer.url), (200, 24));
    terminal.wait(|seen| seen.ends_with("Send it? [y/N] "));
    assert_eq!(terminal.interrupt(), Some(0), "{}", terminal.seen);
    assert!(terminal.seen.contains("nothing was sent"), "{}", terminal.seen);
}
