//! The programs that are measured, each in a process of its own and on one thread, as the bare C program is.
//!
//! They speak one language with the bench: a server prints its port; a client prints `go` when it has warmed up and
//! `end EXCHANGES` after the time it was given.

use std::error::Error;
use std::future::{Future, Ready, ready};
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use busbar_emulator::Config;
use busbar_link::{Endpoint, Link, Options, Serial, SerialPort};
use busbar_modbus::{Framing, Registers, Request, Response, Server};
use busbar_profile::Image;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::time::{Instant, sleep, sleep_until};
use tokio_modbus::client::{Reader, tcp};
use tokio_modbus::prelude as theirs;
use tokio_modbus::server::tcp::accept_tcp_connection;

const UNIT: u8 = 1;
const ADDRESS: u16 = 10240;
const COUNT: u16 = 16;

pub(crate) fn run(role: &[&str]) -> Result<(), Box<dyn Error>> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    match *role {
        ["busbar", "server"] => runtime.block_on(serve()),
        ["emulator", "server"] => runtime.block_on(emulate()),
        ["tokio-modbus", "server"] => runtime.block_on(serve_theirs()),
        ["busbar", "serial", path, count] => runtime.block_on(read_line(path, count.parse()?)),
        ["tokio-modbus", "serial", path, count] => runtime.block_on(read_line_theirs(path, count.parse()?)),
        [name, "fleet", port, devices, settle, run] => {
            let fleet = Fleet {
                address: SocketAddr::from(([127, 0, 0, 1], port.parse()?)),
                devices: devices.parse()?,
                settle: Duration::from_millis(settle.parse()?),
                run: Duration::from_millis(run.parse()?),
            };
            match name {
                "busbar" => runtime.block_on(fleet.poll(follow)),
                "tokio-modbus" => runtime.block_on(fleet.poll(follow_theirs)),
                _ => Err("no such peer".into()),
            }
        }
        [name, "client", port, connections, warm, run] => {
            let client = Asking {
                address: SocketAddr::from(([127, 0, 0, 1], port.parse()?)),
                connections: connections.parse()?,
                warm: Duration::from_millis(warm.parse()?),
                run: Duration::from_millis(run.parse()?),
            };
            match name {
                "busbar" => runtime.block_on(client.ask(ask)),
                "tokio-modbus" => runtime.block_on(client.ask(ask_theirs)),
                _ => Err("no such peer".into()),
            }
        }
        _ => Err("no such role".into()),
    }
}

/// What a client has to do.
struct Asking {
    address: SocketAddr,
    connections: usize,
    warm: Duration,
    run: Duration,
}

impl Asking {
    async fn ask<F>(self, connection: impl Fn(SocketAddr, Arc<AtomicU64>) -> F) -> Result<(), Box<dyn Error>>
    where
        F: Future<Output = ()> + Send + 'static,
    {
        let exchanges = Arc::new(AtomicU64::new(0));
        for _ in 0..self.connections {
            tokio::spawn(connection(self.address, Arc::clone(&exchanges)));
        }
        sleep(self.warm).await;
        let before = exchanges.load(Ordering::Relaxed);
        println!("go");
        sleep(self.run).await;
        println!("end {}", exchanges.load(Ordering::Relaxed) - before);
        Ok(())
    }
}

async fn ask(address: SocketAddr, exchanges: Arc<AtomicU64>) {
    let Ok(link) = Link::open(Endpoint::from(address), Options::default()) else { return };
    let mut registers = Vec::new();
    while link.read_registers_into(UNIT, 3, ADDRESS, COUNT, &mut registers).await.is_ok() {
        exchanges.fetch_add(1, Ordering::Relaxed);
    }
}

async fn ask_theirs(address: SocketAddr, exchanges: Arc<AtomicU64>) {
    let Ok(stream) = TcpStream::connect(address).await else { return };
    if stream.set_nodelay(true).is_err() {
        return;
    }
    let mut context = tcp::attach_slave(stream, theirs::Slave(UNIT));
    while let Ok(Ok(_)) = context.read_holding_registers(ADDRESS, COUNT).await {
        exchanges.fetch_add(1, Ordering::Relaxed);
    }
}

/// Devices that are polled each second.
struct Fleet {
    address: SocketAddr,
    devices: usize,
    settle: Duration,
    run: Duration,
}

/// What a fleet has counted.
#[derive(Default)]
struct Counted {
    reads: AtomicU64,
    late: AtomicU64,
    changes: AtomicU64,
}

impl Fleet {
    async fn poll<F>(self, device: impl Fn(SocketAddr, Beat, Arc<Counted>) -> F) -> Result<(), Box<dyn Error>>
    where
        F: Future<Output = ()> + Send + 'static,
    {
        let counted = Arc::new(Counted::default());
        // They connect within half of the time to settle, and each keeps its place in the second.
        let apart = self.settle / 2 / u32::try_from(self.devices)?;
        for _ in 0..self.devices {
            tokio::spawn(device(self.address, Beat::new(), Arc::clone(&counted)));
            sleep(apart).await;
        }
        sleep(self.settle / 2).await;
        let before = counted.reads.load(Ordering::Relaxed);
        println!("go");
        sleep(self.run).await;
        let reads = counted.reads.load(Ordering::Relaxed) - before;
        println!("end {reads} {}", counted.late.load(Ordering::Relaxed));
        Ok(())
    }
}

/// Once a second.
struct Beat(Instant);

impl Beat {
    const EVERY: Duration = Duration::from_secs(1);

    fn new() -> Self {
        Self(Instant::now())
    }

    /// Waits for the next beat, and counts one that comes too late.
    async fn next(&mut self, counted: &Counted) {
        self.0 += Self::EVERY;
        sleep_until(self.0).await;
        counted.late.fetch_add(u64::from(self.0.elapsed() > Self::EVERY), Ordering::Relaxed);
    }
}

/// One device through the whole way of a reading: registers, image, what changed, values with their quality.
async fn follow(address: SocketAddr, mut beat: Beat, counted: Arc<Counted>) {
    let Some(profile) = busbar_profile::builtin("datakom-d") else { return };
    let Ok(link) = Link::open(Endpoint::from(address), Options::default()) else { return };
    let mut image = Image::new(profile);
    let (mut registers, mut changed) = (Vec::new(), Vec::new());
    loop {
        if link.read_registers_into(UNIT, 3, ADDRESS, COUNT, &mut registers).await.is_ok() {
            counted.reads.fetch_add(1, Ordering::Relaxed);
            changed.clear();
            image.store(ADDRESS, &registers, &mut changed);
            for &point in &changed {
                let Some(raw) = image.registers(point) else { continue };
                let decoded = profile.points[point].decode(raw, profile.wire.word_order);
                counted.changes.fetch_add(u64::from(decoded.value.is_some()), Ordering::Relaxed);
            }
        }
        beat.next(&counted).await;
    }
}

async fn follow_theirs(address: SocketAddr, mut beat: Beat, counted: Arc<Counted>) {
    let Ok(stream) = TcpStream::connect(address).await else { return };
    if stream.set_nodelay(true).is_err() {
        return;
    }
    let mut context = tcp::attach_slave(stream, theirs::Slave(UNIT));
    loop {
        if let Ok(Ok(registers)) = context.read_holding_registers(ADDRESS, COUNT).await {
            counted.reads.fetch_add(u64::from(!registers.is_empty()), Ordering::Relaxed);
        }
        beat.next(&counted).await;
    }
}

async fn read_line(path: &str, count: usize) -> Result<(), Box<dyn Error>> {
    let link = Link::open(format!("rtu://{path}?baud=9600").parse()?, Options::default())?;
    let mut registers = Vec::new();
    for _ in 0..count {
        link.read_registers_into(UNIT, 3, ADDRESS, COUNT, &mut registers).await?;
    }
    Ok(())
}

/// On our port: theirs is the protocol.
async fn read_line_theirs(path: &str, count: usize) -> Result<(), Box<dyn Error>> {
    let port = SerialPort::open(path, &Serial::default())?;
    let mut context = tokio_modbus::client::rtu::attach_slave(port, theirs::Slave(UNIT));
    for _ in 0..count {
        context.read_holding_registers(ADDRESS, COUNT).await??;
    }
    Ok(())
}

/// The smallest server on `busbar_modbus::Server`: registers that hold their address.
async fn serve() -> Result<(), Box<dyn Error>> {
    let listener = TcpListener::bind("127.0.0.1:0").await?;
    println!("{}", listener.local_addr()?.port());
    loop {
        let (stream, _) = listener.accept().await?;
        tokio::spawn(answer(stream));
    }
}

async fn answer(mut stream: TcpStream) -> std::io::Result<()> {
    stream.set_nodelay(true)?;
    let mut server = Server::new(Framing::Tcp);
    let mut bytes = [0; 512];
    let mut out = Vec::new();
    loop {
        let count = stream.read(&mut bytes).await?;
        if count == 0 {
            return Ok(());
        }
        server.receive(Duration::ZERO, &bytes[..count]);
        out.clear();
        while let Some(incoming) = server.next_request() {
            let Request::ReadHoldingRegisters { address, count } = incoming.request else { continue };
            let mut registers = [0; 125];
            let registers = &mut registers[..usize::from(count.min(125))];
            (address..).zip(registers.iter_mut()).for_each(|(value, register)| *register = value);
            // Only a count that no answer can hold is refused, and such a request is left unanswered.
            let _ = incoming.respond(&Response::ReadHoldingRegisters(Registers::from(&*registers)), &mut out);
        }
        stream.write_all(&out).await?;
    }
}

/// The imitated D-500 as `busbar emulate` runs it, plant and all.
async fn emulate() -> Result<(), Box<dyn Error>> {
    let listen = vec![Endpoint::Tcp { host: "127.0.0.1".into(), port: 0 }];
    let emulation = busbar_emulator::start(Config { listen, ..Config::default() }).await?;
    for url in emulation.urls() {
        if let Endpoint::Tcp { port, .. } = url {
            println!("{port}");
        }
    }
    std::future::pending().await
}

async fn serve_theirs() -> Result<(), Box<dyn Error>> {
    let listener = TcpListener::bind("127.0.0.1:0").await?;
    println!("{}", listener.local_addr()?.port());
    let server = theirs_server(listener);
    let on_connected = |stream: TcpStream, address| async move {
        stream.set_nodelay(true)?;
        accept_tcp_connection(stream, address, |_| Ok(Some(Theirs)))
    };
    server.serve(&on_connected, drop).await?;
    Ok(())
}

fn theirs_server(listener: TcpListener) -> tokio_modbus::server::tcp::Server {
    tokio_modbus::server::tcp::Server::new(listener)
}

/// The same registers behind tokio-modbus.
struct Theirs;

impl tokio_modbus::server::Service for Theirs {
    type Request = theirs::SlaveRequest<'static>;
    type Response = theirs::Response;
    type Exception = theirs::ExceptionCode;
    type Future = Ready<Result<Self::Response, Self::Exception>>;

    fn call(&self, asked: Self::Request) -> Self::Future {
        ready(match asked.request {
            theirs::Request::ReadHoldingRegisters(address, count) => {
                Ok(theirs::Response::ReadHoldingRegisters((address..address + count).collect()))
            }
            _ => Err(theirs::ExceptionCode::IllegalFunction),
        })
    }
}
