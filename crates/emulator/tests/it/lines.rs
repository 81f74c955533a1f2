//! Serial lines and converters: real pseudo-terminals and sockets, several controllers on one wire.

use std::fs::File;
use std::io::{Read, Write};
use std::os::unix::fs::symlink;
use std::path::Path;
use std::time::{Duration, Instant};

use busbar_emulator::{Config, Emulation, StartError, start, start_together};
use busbar_link::{Endpoint, SerialError, SerialPort};
use busbar_modbus::rtu::crc16;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::timeout;

/// More than any answer takes; only a failed test waits for it.
const PATIENCE: Duration = Duration::from_secs(20);
/// One character at 9600 baud, 8N1.
const CHARACTER: Duration = Duration::from_nanos(1_041_666);

fn unit(unit: u8) -> Config {
    Config { unit, ..Config::default() }
}

async fn on(endpoints: &[&str], configs: &[Config]) -> Emulation {
    try_on(endpoints, configs).await.unwrap()
}

async fn try_on(endpoints: &[&str], configs: &[Config]) -> Result<Emulation, StartError> {
    let listen = endpoints.iter().map(|endpoint| endpoint.parse().unwrap()).collect();
    start_together(configs.to_vec(), listen).await
}

fn open(endpoint: &Endpoint) -> SerialPort {
    let Endpoint::Rtu { path, serial } = endpoint else { panic!("{endpoint}") };
    SerialPort::open(path, serial).unwrap()
}

async fn connect(endpoint: &Endpoint) -> TcpStream {
    let (Endpoint::Tcp { host, port } | Endpoint::RtuTcp { host, port }) = endpoint else {
        panic!("{endpoint}")
    };
    TcpStream::connect((host.as_str(), *port)).await.unwrap()
}

fn family(profile: &str, unit: u8) -> Config {
    Config { profile: profile.into(), unit, ..Config::default() }
}

fn sealed(body: &[u8]) -> Vec<u8> {
    [body, &crc16(body).to_le_bytes()].concat()
}

fn read_frame(unit: u8, address: u16, count: u8) -> Vec<u8> {
    let [high, low] = address.to_be_bytes();
    sealed(&[unit, 3, high, low, 0, count])
}

/// The identity register, which says which controller it is.
fn who(unit: u8) -> Vec<u8> {
    read_frame(unit, 10609, 1)
}

fn d500(unit: u8) -> Vec<u8> {
    sealed(&[unit, 3, 2, 0xD5, 0])
}

async fn ask(wire: &mut (impl AsyncRead + AsyncWrite + Unpin), request: &[u8], length: usize) -> Vec<u8> {
    wire.write_all(request).await.unwrap();
    hear(wire, length).await
}

async fn hear(wire: &mut (impl AsyncRead + Unpin), length: usize) -> Vec<u8> {
    let mut bytes = vec![0; length];
    timeout(PATIENCE, wire.read_exact(&mut bytes)).await.expect("an answer").unwrap();
    bytes
}

#[tokio::test]
async fn a_pty_is_a_line_that_clients_open_and_leave() {
    let emulation = start(Config { listen: vec!["rtu://pty".parse().unwrap()], ..unit(7) }).await.unwrap();
    let url = emulation.urls()[0].clone();
    let text = url.to_string();
    assert!(text.starts_with("rtu:///dev/pts/") && text.ends_with("?baud=9600&parity=none&stop=1"), "{text}");
    for _ in 0..3 {
        let mut port = open(&url);
        assert_eq!(ask(&mut port, &who(7), 7).await, d500(7));
        assert_eq!(ask(&mut port, &who(7), 7).await, d500(7));
    }
    // A program that sets nothing finds a raw line all the same.
    let Endpoint::Rtu { path, .. } = &url else { panic!() };
    let mut file = File::options().read(true).write(true).open(path).unwrap();
    file.write_all(&who(7)).unwrap();
    let answer = tokio::task::spawn_blocking(move || {
        let mut answer = [0; 7];
        file.read_exact(&mut answer).unwrap();
        answer
    });
    assert_eq!(timeout(PATIENCE, answer).await.unwrap().unwrap().to_vec(), d500(7));
}

#[tokio::test]
async fn bytes_take_the_time_of_the_line() {
    let emulation = on(&["rtu://pty?baud=9600"], &[unit(1)]).await;
    let mut port = open(&emulation.urls()[0]);
    // 8 characters there, 3.5 of silence, 37 back.
    let least = CHARACTER * 8 + CHARACTER * 7 / 2 + CHARACTER * 37;
    for _ in 0..3 {
        let asked = Instant::now();
        ask(&mut port, &read_frame(1, 10240, 16), 37).await;
        assert!(asked.elapsed() >= least, "{:?} of {least:?}", asked.elapsed());
    }
    // The first bytes are there before the last have left.
    let asked = Instant::now();
    port.write_all(&read_frame(1, 10240, 16)).await.unwrap();
    hear(&mut port, 4).await;
    assert!(asked.elapsed() >= CHARACTER * 15);
    hear(&mut port, 33).await;
    assert!(asked.elapsed() >= least);
}

#[tokio::test]
async fn two_units_on_one_line_answer_for_themselves_only() {
    let emulation = on(&["rtu://pty?baud=115200"], &[unit(2), unit(5)]).await;
    let mut port = open(&emulation.urls()[0]);
    // Nobody answers 1, 0 or 255.
    for silent in [1, 0, 255] {
        port.write_all(&who(silent)).await.unwrap();
    }
    assert_eq!(ask(&mut port, &who(5), 7).await, d500(5));
    assert_eq!(ask(&mut port, &who(2), 7).await, d500(2));

    // A broadcast changes nothing, a write to one leaves the other as it was.
    port.write_all(&sealed(&[0, 6, 0x20, 0x02, 0, 9])).await.unwrap();
    let select = sealed(&[5, 6, 0x20, 0x02, 0, 4]);
    assert_eq!(ask(&mut port, &select, 8).await, select);
    assert_eq!(ask(&mut port, &read_frame(2, 10403, 1), 7).await, sealed(&[2, 3, 2, 0, 0]));
    assert_eq!(ask(&mut port, &read_frame(5, 10403, 1), 7).await, sealed(&[5, 3, 2, 0, 4]));
    let statistics = emulation.statistics();
    assert_eq!((statistics.requests, statistics.answers, statistics.collisions), (9, 5, 0));
}

#[tokio::test]
async fn who_does_not_wait_loses_the_second_request() {
    let emulation = on(&["rtu://pty?baud=19200"], &[unit(1)]).await;
    let mut port = open(&emulation.urls()[0]);
    let glued = [who(1), read_frame(1, 10240, 16)].concat();
    assert_eq!(ask(&mut port, &glued, 7).await, d500(1));
    // What comes next is the answer to what is asked next.
    assert_eq!(ask(&mut port, &read_frame(1, 10403, 1), 7).await, sealed(&[1, 3, 2, 0, 0]));
    let statistics = emulation.statistics();
    assert_eq!((statistics.requests, statistics.answers, statistics.collisions), (2, 2, 1));
}

#[tokio::test]
async fn rtu_through_tcp_answers_glued_frames_in_turn() {
    let emulation = on(&["rtu+tcp://127.0.0.1:0"], &[unit(1), unit(2)]).await;
    assert!(emulation.urls()[0].to_string().starts_with("rtu+tcp://127.0.0.1:"));
    let mut stream = connect(&emulation.urls()[0]).await;
    let glued = [who(2), who(9), who(1), who(2)].concat();
    let expected = [d500(2), d500(1), d500(2)].concat();
    assert_eq!(ask(&mut stream, &glued, expected.len()).await, expected);
}

/// On both kinds of RTU wire: what is not to be answered, then what is, so that the first answer must be the second's.
#[tokio::test]
async fn what_is_no_request_is_met_by_silence_on_rtu() {
    let emulation = on(&["rtu+tcp://127.0.0.1:0", "rtu://pty?baud=115200"], &[unit(1)]).await;
    let stream = connect(&emulation.urls()[0]).await;
    let port = open(&emulation.urls()[1]);
    silence(stream).await;
    silence(port).await;
    for (endpoint, statistics) in emulation.statistics_by_endpoint() {
        assert_eq!(statistics.answers, 10, "{endpoint}");
        assert!(statistics.garbage >= 20, "{endpoint}: {statistics:?}");
    }
}

async fn silence(mut wire: impl AsyncRead + AsyncWrite + Unpin) {
    let mut damaged = who(1);
    damaged[4] ^= 1;
    let too_long = [&[1, 16, 0x20, 0x01, 0, 124, 248][..], &[0; 248]].concat();
    for (name, bytes) in [
        ("a wrong check sum", damaged),
        ("noise", vec![0x55, 0xFF, 0x00, 0xFE]),
        ("function 0", sealed(&[1, 0, 0x28, 0, 0, 1])),
        ("a function above 127", sealed(&[1, 0x83, 2])),
        ("another one", sealed(&[1, 0xFF, 0, 0, 0, 1])),
        ("a frame that is too long", sealed(&too_long)),
        ("a byte count that does not fit", sealed(&[1, 16, 0x20, 0x02, 0, 2, 2, 0, 0])),
        ("another unit", who(3)),
        ("everybody", who(0)),
    ] {
        wire.write_all(&bytes).await.unwrap();
        assert_eq!(ask(&mut wire, &who(1), 7).await, d500(1), "{name}");
    }
    // Functions that the controller does not have; the length of the second is known by silence only.
    assert_eq!(ask(&mut wire, &sealed(&[1, 4, 0x28, 0, 0, 1]), 5).await, sealed(&[1, 0x84, 1]));
}

#[tokio::test]
async fn a_function_that_ends_by_silence_is_refused_like_any_other() {
    let emulation = on(&["rtu+tcp://127.0.0.1:0", "rtu://pty?baud=115200"], &[unit(1)]).await;
    let mut stream = connect(&emulation.urls()[0]).await;
    let mut port = open(&emulation.urls()[1]);
    for function in [7, 0x2B, 0x7F] {
        let request = sealed(&[1, function, 0x0E, 1, 0]);
        let refused = sealed(&[1, function | 0x80, 1]);
        assert_eq!(ask(&mut stream, &request, 5).await, refused);
        assert_eq!(ask(&mut port, &request, 5).await, refused);
    }
}

#[tokio::test]
async fn one_plant_stands_behind_every_kind_of_wire() {
    let emulation = on(&["tcp://127.0.0.1:0", "rtu+tcp://127.0.0.1:0", "rtu://pty"], &[unit(1)]).await;
    let mut port = open(&emulation.urls()[2]);
    let select = sealed(&[1, 6, 0x20, 0x02, 0, 11]);
    assert_eq!(ask(&mut port, &select, 8).await, select);
    let mut converter = connect(&emulation.urls()[1]).await;
    assert_eq!(ask(&mut converter, &read_frame(1, 10403, 1), 7).await, sealed(&[1, 3, 2, 0, 11]));
    let mut ethernet = connect(&emulation.urls()[0]).await;
    let read = [0, 1, 0, 0, 0, 6, 1, 3, 0x28, 0xA3, 0, 1];
    assert_eq!(ask(&mut ethernet, &read, 11).await[9..], [0, 11]);

    // Only what comes over its own Ethernet port is an Ethernet packet.
    let packets = ask(&mut ethernet, &[0, 2, 0, 0, 0, 6, 1, 3, 0x2D, 0xA3, 0, 1], 11).await;
    assert_eq!(packets[9..], [0, 2]);
    let answers: Vec<u64> =
        emulation.statistics_by_endpoint().map(|(_, statistics)| statistics.answers).collect();
    assert_eq!(answers, [2, 1, 1]);
}

#[tokio::test]
async fn a_restart_drops_the_units_own_connections_and_is_silence_elsewhere() {
    // 4 simulated seconds of silence are 40 ms.
    let own = Config { listen: vec!["tcp://127.0.0.1:0".parse().unwrap()], speed: 100.0, ..unit(1) };
    let emulation = on(&["rtu://pty?baud=115200", "tcp://127.0.0.1:0"], &[own, unit(2)]).await;
    let [line, converter, ethernet] = emulation.urls() else { panic!("{:?}", emulation.urls()) };
    let mut port = open(line);
    let mut converter = connect(converter).await;
    let mut ethernet = connect(ethernet).await;
    ask(&mut ethernet, &[0, 1, 0, 0, 0, 6, 1, 3, 0x29, 0x71, 0, 1], 11).await;

    let reset = sealed(&[1, 6, 0x20, 0x12, 0x38, 0xC8]);
    assert_eq!(ask(&mut port, &reset, 8).await, reset);
    let end = timeout(PATIENCE, ethernet.read(&mut [0; 16])).await.expect("its own connection ends");
    assert!(matches!(end, Ok(0) | Err(_)), "{end:?}");
    // The converter and the other unit live on; the unit itself comes back.
    let other = [0, 3, 0, 0, 0, 6, 2, 3, 0x29, 0x71, 0, 1];
    assert_eq!(ask(&mut converter, &other, 11).await[6..9], [2, 3, 2]);
    assert_eq!(ask(&mut port, &who(2), 7).await, d500(2));
    let back = async {
        let mut heard = Vec::new();
        while heard != d500(1) {
            port.write_all(&who(1)).await.unwrap();
            while let Ok(Ok(_)) = timeout(Duration::from_millis(200), port.read_buf(&mut heard)).await {
                if heard.len() == 7 {
                    break;
                }
            }
        }
    };
    timeout(PATIENCE, back).await.expect("it comes back");
}

#[tokio::test]
async fn what_cannot_stand_on_one_wire_is_refused() {
    let twice = try_on(&["rtu://pty"], &[unit(3), unit(4), unit(3)]).await.unwrap_err();
    assert_eq!(
        twice.to_string(),
        "unit 3 is there twice on rtu://pty?baud=9600&parity=none&stop=1; \
         give each controller of a wire a unit id of its own"
    );
    let apart = |id| Config { listen: vec!["rtu://pty".parse().unwrap()], ..unit(id) };
    start_together(vec![apart(3), apart(3)], Vec::new()).await.expect("one unit id on two wires");

    for endpoint in ["rtu://pty?baud=14400", "rtu://pty?parity=even", "rtu:///dev/ttyS0?stop=2"] {
        let error = try_on(&[endpoint], &[unit(1)]).await.unwrap_err();
        let endpoint: Endpoint = endpoint.parse().unwrap();
        assert_eq!(
            error.to_string(),
            format!(
                "cannot listen on {endpoint}: datakom-d has no such line; choose \
                 baud 2400, 4800, 9600, 19200, 38400, 57600 or 115200, parity none, stop 1"
            )
        );
    }
}

#[tokio::test]
async fn a_device_that_cannot_be_used_has_its_sentence_and_nothing_stays_bound() {
    let missing = try_on(&["tcp://127.0.0.1:0", "rtu:///dev/busbar-has-no-such-device"], &[unit(1)]).await;
    let endpoint: Endpoint = "rtu:///dev/busbar-has-no-such-device".parse().unwrap();
    assert_eq!(missing.unwrap_err(), StartError::SerialDevice { endpoint, problem: SerialError::Missing });
    let not_serial = try_on(&["rtu:///dev/null"], &[unit(1)]).await.unwrap_err();
    assert!(not_serial.to_string().contains("this is not a serial device"), "{not_serial}");

    // The line of one imitation is no place for another.
    let first = on(&["rtu://pty"], &[unit(1)]).await;
    let line = first.urls()[0].to_string();
    let _second = on(&[line.as_str()], &[unit(2)]).await;
    let third = try_on(&[line.as_str()], &[unit(3)]).await.unwrap_err();
    assert!(matches!(third, StartError::SerialDevice { problem: SerialError::Busy, .. }), "{third}");
}

#[tokio::test]
async fn controllers_of_several_makers_share_a_line() {
    let units = [family("smartgen-hat821si", 2), family("smartgen-acc1700", 3), unit(4)];
    let emulation = on(&["rtu://pty?baud=9600"], &units).await;
    let mut port = open(&emulation.urls()[0]);
    for (request, answer) in [
        // Function 5 to a key with a value that is none, a read that is too long, function 6 to one that lacks it.
        (&[2, 5, 0x3A, 0x9C, 0x12, 0x34][..], &[2, 0x85, 3][..]),
        (&[3, 3, 0, 0, 0, 121], &[3, 0x83, 3]),
        (&[3, 6, 0, 0, 0, 0], &[3, 0x86, 1]),
        (&[4, 5, 0, 0, 0xFF, 0], &[4, 0x85, 1]),
        // The transfer switch asked for AUTO, and the compressor for its down key.
        (&[2, 5, 0x3A, 0x9C, 0xFF, 0], &[2, 5, 0x3A, 0x9C, 0xFF, 0]),
        (&[3, 5, 0, 8, 0xFF, 0], &[3, 5, 0, 8, 0xFF, 0]),
    ] {
        let answer = sealed(answer);
        assert_eq!(ask(&mut port, &sealed(request), answer.len()).await, answer, "{request:02X?}");
    }
    assert_eq!(ask(&mut port, &who(4), 7).await, d500(4));
    assert_eq!(ask(&mut port, &sealed(&[3, 3, 0, 0, 0, 120]), 245).await[..3], [3, 3, 240]);
}

#[tokio::test]
async fn every_controller_of_a_line_must_have_its_settings() {
    for (endpoint, alone, has) in [
        (
            "rtu://pty?baud=115200",
            "smartgen-hat821si",
            "baud 2400, 4800, 9600 or 19200, parity none, odd or even, stop 1 or 2",
        ),
        (
            "rtu:///dev/ttyS0?baud=2400",
            "smartgen-acc1700",
            "baud 9600, 19200 or 38400, parity none, odd or even, stop 1 or 2",
        ),
    ] {
        let error = try_on(&[endpoint], &[unit(1), family(alone, 2)]).await.unwrap_err().to_string();
        assert!(error.ends_with(&format!(": {alone} has no such line; choose {has}")), "{error}");
    }
}

/// The far end of a serial device that the imitation opens by path.
fn plug_in(path: &Path) -> File {
    use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};

    let far = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    grantpt(&far).unwrap();
    unlockpt(&far).unwrap();
    let near = ptsname(&far, Vec::new()).unwrap().into_string().unwrap();
    let fresh = path.with_extension("new");
    symlink(near, &fresh).unwrap();
    std::fs::rename(fresh, path).unwrap();
    far.into()
}

fn answered(mut far: File) -> impl Future<Output = (File, Vec<u8>)> {
    let answer = tokio::task::spawn_blocking(move || {
        let mut answer = vec![0; 7];
        far.read_exact(&mut answer).unwrap();
        (far, answer)
    });
    async move { timeout(PATIENCE, answer).await.expect("an answer").unwrap() }
}

#[tokio::test]
async fn a_pseudo_terminal_of_somebody_else_keeps_line_time_too() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("line");
    let mut far = plug_in(&path);
    let emulation = on(&[&format!("rtu://{}?baud=2400", path.display())], &[unit(1)]).await;
    // Who asks at once when the answer is through is answered: no time is counted twice.
    for _ in 0..5 {
        far.write_all(&who(1)).unwrap();
        let answer;
        (far, answer) = answered(far).await;
        assert_eq!(answer, d500(1));
    }
    let statistics = emulation.statistics();
    assert_eq!((statistics.requests, statistics.answers, statistics.collisions), (5, 5, 0));
}

#[tokio::test]
async fn a_serial_device_is_served_and_served_again_when_it_is_back() {
    let path = std::env::temp_dir().join(format!("busbar-line-{}", std::process::id()));
    let mut far = plug_in(&path);
    let emulation = on(&[&format!("rtu://{}?baud=115200", path.display())], &[unit(1)]).await;
    far.write_all(&who(1)).unwrap();
    let (far, answer) = answered(far).await;
    assert_eq!(answer, d500(1));

    drop(far);
    let far = plug_in(&path);
    // Until it is opened again, the new device echoes what it gets, for it is not raw yet.
    let mut asking = far.try_clone().unwrap();
    let raw = async {
        use rustix::termios::{LocalModes, tcgetattr};
        while tcgetattr(&far).unwrap().local_modes.contains(LocalModes::ECHO) {
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
    };
    timeout(PATIENCE, raw).await.expect("the device is opened again");
    // What came before the port was ready is thrown away with it: asked until it answers.
    let asker = tokio::spawn(async move {
        loop {
            asking.write_all(&who(1)).unwrap();
            tokio::time::sleep(Duration::from_millis(200)).await;
        }
    });
    let (_far, answer) = answered(far).await;
    asker.abort();
    assert_eq!(answer, d500(1));
    std::fs::remove_file(&path).unwrap();
    drop(emulation);
}
