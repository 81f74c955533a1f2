//! A small language for calls of the binary: `busbar("decode datakom-d 10246 08FE 0000").ok().prints("...")`.

use std::{
    ffi::OsStr,
    io::{BufRead, BufReader, Read},
    path::Path,
    process::{Child, Command, Output, Stdio},
};

use serde_json::Value;

/// The binary under test, without what the surroundings would add.
pub(crate) fn command() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_busbar"));
    for name in ["NO_COLOR", "BUSBAR_LOG", "BUSBAR_CONTROL_TOKEN"] {
        command.env_remove(name);
    }
    command.stdin(Stdio::null());
    command
}

/// Calls the binary with arguments that have no blanks in them, and waits for its end.
#[track_caller]
pub(crate) fn busbar(arguments: &str) -> Call {
    call(arguments.split_whitespace())
}

/// Calls the binary with any arguments.
#[track_caller]
pub(crate) fn call<S: AsRef<OsStr>>(arguments: impl IntoIterator<Item = S>) -> Call {
    Call(command().args(arguments).output().unwrap())
}

/// A call that has ended.
#[derive(Debug)]
pub(crate) struct Call(Output);

impl Call {
    /// Exit status 0.
    #[track_caller]
    pub(crate) fn ok(self) -> Self {
        self.status(0)
    }

    /// Exit status 1: what was asked for failed.
    #[track_caller]
    pub(crate) fn fails(self) -> Self {
        self.status(1)
    }

    /// Exit status 2: the call is wrong; nothing is on standard output.
    #[track_caller]
    pub(crate) fn refuses(self) -> Self {
        self.status(2).prints("")
    }

    #[track_caller]
    fn status(self, expected: i32) -> Self {
        assert_eq!(self.0.status.code(), Some(expected), "{}{}", self.out(), self.err());
        self
    }

    /// Standard output is exactly this.
    #[track_caller]
    pub(crate) fn prints(self, expected: &str) -> Self {
        assert_eq!(self.out(), expected, "standard error: {}", self.err());
        self
    }

    /// Standard error is exactly this sentence.
    #[track_caller]
    pub(crate) fn says(self, expected: &str) -> Self {
        assert_eq!(self.err(), format!("busbar: {expected}\n"));
        self
    }

    /// Standard error is one sentence that contains this.
    #[track_caller]
    pub(crate) fn says_in_one_sentence(self, part: &str) -> Self {
        let err = self.err();
        assert!(err.starts_with("busbar: ") && err.lines().count() == 1, "more than one sentence:\n{err}");
        self.mentions(part)
    }

    /// Standard error contains this.
    #[track_caller]
    pub(crate) fn mentions(self, part: &str) -> Self {
        assert!(self.err().contains(part), "no \"{part}\" in:\n{}", self.err());
        self
    }

    /// Standard error is empty.
    #[track_caller]
    pub(crate) fn silently(self) -> Self {
        assert_eq!(self.err(), "");
        self
    }

    /// The one JSON document on standard output.
    #[track_caller]
    pub(crate) fn json(&self) -> Value {
        serde_json::from_str(&self.out()).unwrap_or_else(|error| panic!("{error}: {}", self.out()))
    }

    pub(crate) fn out(&self) -> String {
        String::from_utf8_lossy(&self.0.stdout).into_owned()
    }

    pub(crate) fn err(&self) -> String {
        String::from_utf8_lossy(&self.0.stderr).into_owned()
    }
}

/// A service that runs until the test ends.
pub(crate) struct Service {
    child: Child,
    out: BufReader<std::process::ChildStdout>,
}

impl Service {
    #[track_caller]
    pub(crate) fn start<S: AsRef<OsStr>>(arguments: impl IntoIterator<Item = S>) -> Self {
        Self::spawn(command().args(arguments).stderr(Stdio::piped()))
    }

    /// Starts what is set up already.
    #[track_caller]
    pub(crate) fn spawn(command: &mut Command) -> Self {
        let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
        let out = BufReader::new(child.stdout.take().unwrap());
        Self { child, out }
    }

    /// The next line of standard output.
    #[track_caller]
    pub(crate) fn line(&mut self) -> String {
        let mut line = String::new();
        self.out.read_line(&mut line).unwrap();
        if line.is_empty() {
            panic!("the service ended: {}", self.rest_of_err());
        }
        line.trim_end().to_owned()
    }

    /// Lines of standard output up to the first that contains `part`, that one included.
    #[track_caller]
    pub(crate) fn lines_to(&mut self, part: &str) -> String {
        let mut lines = String::new();
        while !lines.contains(part) {
            lines.push_str(&self.line());
            lines.push('\n');
        }
        lines
    }

    /// Presses Ctrl-C, or sends another signal, and waits for the exit status.
    #[track_caller]
    pub(crate) fn signal(self, name: &str) -> (Option<i32>, String) {
        let (status, _, err) = self.end(name);
        (status, err)
    }

    /// The same, with the rest of standard output.
    #[track_caller]
    pub(crate) fn end(mut self, name: &str) -> (Option<i32>, String, String) {
        self.send(name);
        let status = self.child.wait().unwrap();
        let mut out = String::new();
        self.out.read_to_string(&mut out).unwrap();
        (status.code(), out, self.rest_of_err())
    }

    /// Sends a signal.
    #[track_caller]
    pub(crate) fn send(&self, name: &str) {
        let id = self.child.id().to_string();
        assert!(Command::new("kill").args([&format!("-{name}"), &id]).status().unwrap().success());
    }

    fn rest_of_err(&mut self) -> String {
        let mut err = String::new();
        if let Some(mut stderr) = self.child.stderr.take() {
            stderr.read_to_string(&mut err).unwrap();
        }
        err
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        // Fails where the service has ended already, which is what is wanted.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// An imitated D-500 at a port of its own, and its URL.
#[track_caller]
pub(crate) fn d500(options: &str) -> (Service, String) {
    let arguments = format!("emulate datakom-d --model D-500 --listen tcp://127.0.0.1:0 {options}");
    let mut service = Service::start(arguments.split_whitespace());
    let url = service.line();
    assert!(url.starts_with("tcp://127.0.0.1:"), "{url}");
    (service, url)
}

/// Writes a file with that text.
pub(crate) fn write(folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

/// The text with the folder's name taken out, for snapshots.
pub(crate) fn without_folder(text: &str, folder: &Path) -> String {
    text.replace(&format!("{}/", folder.display()), "")
}
