//! Somebody else's server judges our client: every request it sends, and exceptions.
#![cfg(test)]

use std::future::{Ready, ready};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use busbar_link::{Endpoint, Link, LinkError, Options, Write};
use busbar_modbus::ExceptionCode;
use tokio::net::TcpListener;
use tokio_modbus::prelude::{ExceptionCode as TheirCode, Request, Response, SlaveRequest};
use tokio_modbus::server::Service;
use tokio_modbus::server::tcp::{Server, accept_tcp_connection};

/// 256 registers and 64 coils; input registers hold the complement; unit 9 is busy with everything.
struct Device {
    registers: Vec<u16>,
    coils: Vec<bool>,
    writes: usize,
}

#[derive(Clone)]
struct Shared(Arc<Mutex<Device>>);

impl Service for Shared {
    type Request = SlaveRequest<'static>;
    type Response = Response;
    type Exception = TheirCode;
    type Future = Ready<Result<Response, TheirCode>>;

    fn call(&self, asked: Self::Request) -> Self::Future {
        let mut device = self.0.lock().unwrap();
        ready(match asked.slave {
            9 => Err(TheirCode::ServerDeviceBusy),
            _ => device.answer(asked.request),
        })
    }
}

impl Device {
    fn answer(&mut self, request: Request<'static>) -> Result<Response, TheirCode> {
        let window = |registers: &[u16], address: u16, count: u16| {
            let start = usize::from(address);
            let window = registers.get(start..start + usize::from(count));
            window.map(<[u16]>::to_vec).ok_or(TheirCode::IllegalDataAddress)
        };
        match request {
            Request::ReadHoldingRegisters(address, count) => {
                window(&self.registers, address, count).map(Response::ReadHoldingRegisters)
            }
            Request::ReadInputRegisters(address, count) => {
                let inputs: Vec<u16> = self.registers.iter().map(|register| !register).collect();
                window(&inputs, address, count).map(Response::ReadInputRegisters)
            }
            Request::WriteSingleRegister(address, value) => {
                self.write(address, &[value])?;
                Ok(Response::WriteSingleRegister(address, value))
            }
            Request::WriteMultipleRegisters(address, values) => {
                self.write(address, &values)?;
                let count = u16::try_from(values.len()).map_err(|_| TheirCode::IllegalDataValue)?;
                Ok(Response::WriteMultipleRegisters(address, count))
            }
            Request::WriteSingleCoil(address, on) => {
                let coil = self.coils.get_mut(usize::from(address));
                *coil.ok_or(TheirCode::IllegalDataAddress)? = on;
                self.writes += 1;
                Ok(Response::WriteSingleCoil(address, on))
            }
            _ => Err(TheirCode::IllegalFunction),
        }
    }

    fn write(&mut self, address: u16, values: &[u16]) -> Result<(), TheirCode> {
        let start = usize::from(address);
        let window = self.registers.get_mut(start..start + values.len());
        window.ok_or(TheirCode::IllegalDataAddress)?.copy_from_slice(values);
        self.writes += 1;
        Ok(())
    }
}

async fn serve() -> (Link, Shared) {
    let shared = Shared(Arc::new(Mutex::new(Device {
        registers: (0..256).collect(),
        coils: vec![false; 64],
        writes: 0,
    })));
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let endpoint = Endpoint::from(listener.local_addr().unwrap());
    let service = shared.clone();
    tokio::spawn(async move {
        let on_connected = |stream, address| {
            let service = service.clone();
            async move { accept_tcp_connection(stream, address, |_| Ok(Some(service.clone()))) }
        };
        let server = Server::new(listener);
        server.serve(&on_connected, |error| panic!("{error}")).await.unwrap();
    });
    let options = Options { timeout: Duration::from_secs(60), ..Options::default() };
    (Link::open(endpoint, options).unwrap(), shared)
}

fn refused(unit: u8, function: u8, code: ExceptionCode) -> LinkError {
    LinkError::Exception { unit, function, code }
}

#[tokio::test]
async fn reads_their_registers() {
    let (link, _) = serve().await;
    for count in [1, 2, 16, 124, 125] {
        let expected: Vec<u16> = (100..100 + count).collect();
        assert_eq!(link.read_registers(1, 3, 100, count).await, Ok(expected));
        let expected: Vec<u16> = (100..100 + count).map(|register| !register).collect();
        assert_eq!(link.read_registers(247, 4, 100, count).await, Ok(expected));
    }
}

#[tokio::test]
async fn writes_their_registers_and_coils_once() {
    let (link, shared) = serve().await;
    let one = Write::Register { address: 7, value: 0xBEEF };
    link.write(1, one).await.unwrap();
    for count in [1, 2, 123] {
        let many =
            Write::Registers { address: 100, values: (0..count).map(|register| register * 3).collect() };
        link.write(1, many).await.unwrap();
    }
    for on in [true, false, true] {
        link.write(1, Write::Coil { address: 63, on }).await.unwrap();
        assert_eq!(shared.0.lock().unwrap().coils[63], on);
    }

    assert_eq!(link.read_registers(1, 3, 7, 1).await, Ok(vec![0xBEEF]));
    assert_eq!(link.read_registers(1, 3, 221, 2).await, Ok(vec![363, 366]));
    assert_eq!(shared.0.lock().unwrap().writes, 7);
}

#[tokio::test]
async fn understands_their_exceptions() {
    let (link, shared) = serve().await;
    let address = ExceptionCode::ILLEGAL_DATA_ADDRESS;
    assert_eq!(link.read_registers(1, 3, 255, 2).await, Err(refused(1, 3, address)));
    assert_eq!(link.read_registers(1, 4, 300, 1).await, Err(refused(1, 4, address)));
    for (function, write) in [
        (6, Write::Register { address: 256, value: 0 }),
        (16, Write::Registers { address: 250, values: vec![0; 7] }),
        (5, Write::Coil { address: 64, on: true }),
    ] {
        assert_eq!(link.write(1, write).await, Err(refused(1, function, address)));
    }
    let busy = ExceptionCode::SERVER_DEVICE_BUSY;
    assert_eq!(link.read_registers(9, 3, 0, 1).await, Err(refused(9, 3, busy)));

    let seen = link.statistics();
    assert_eq!((seen.exceptions[&2], seen.exceptions[&6]), (5, 1));
    assert_eq!((seen.requests, seen.answers, seen.retries), (6, 6, 0));
    assert_eq!(shared.0.lock().unwrap().writes, 0);
}

#[tokio::test]
async fn shares_one_connection_among_many() {
    let (link, _) = serve().await;
    let callers: Vec<_> = (0..32_u16)
        .map(|caller| {
            let link = link.clone();
            tokio::spawn(async move {
                for _ in 0..20 {
                    assert_eq!(link.read_registers(1, 3, caller, 1).await, Ok(vec![caller]));
                }
            })
        })
        .collect();
    for caller in callers {
        caller.await.unwrap();
    }
    let seen = link.statistics();
    assert_eq!((seen.answers, seen.reconnects, seen.late), (640, 0, 0));
}
