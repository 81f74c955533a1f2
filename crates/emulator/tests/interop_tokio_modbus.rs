//! A stranger's client, tokio-modbus, reads and writes the imitated D-500.

use busbar_emulator::{Config, start};
use busbar_link::Endpoint;
use tokio_modbus::client::tcp::connect_slave;
use tokio_modbus::prelude::*;

#[tokio::test]
async fn tokio_modbus_reads_every_readable_register_and_is_refused_the_rest() {
    let listen = vec![Endpoint::Tcp { host: "127.0.0.1".into(), port: 0 }];
    let emulation = start(Config { listen, unit: 17, ..Config::default() }).await.unwrap();
    let Endpoint::Tcp { host, port } = &emulation.urls()[0] else { panic!("not TCP") };
    let address = format!("{host}:{port}").parse().unwrap();
    let mut client = connect_slave(address, Slave(17)).await.unwrap();

    let profile = busbar_profile::builtin("datakom-d").unwrap();
    let mut registers = 0;
    for &(first, last) in &profile.wire.readable {
        for start in (first..=last).step_by(16) {
            let count = (last - start + 1).min(16);
            let words = client.read_holding_registers(start, count).await.unwrap().unwrap();
            assert_eq!(words.len(), usize::from(count));
            registers += words.len();
        }
    }
    let all: u16 = profile.wire.readable.iter().map(|(first, last)| last - first + 1).sum();
    assert_eq!(registers, usize::from(all));

    let identity = client.read_holding_registers(10609, 1).await.unwrap().unwrap();
    assert_eq!(identity, [0xD500]);
    // Low word first: 230 V in tenths fits the first register.
    let voltage = client.read_holding_registers(10240, 2).await.unwrap().unwrap();
    assert!((2200..2420).contains(&voltage[0]) && voltage[1] == 0, "{voltage:?}");

    client.write_single_register(8194, 3).await.unwrap().unwrap();
    assert_eq!(client.read_holding_registers(10403, 1).await.unwrap().unwrap(), [3]);
    client.write_multiple_registers(8194, &[4]).await.unwrap().unwrap();
    assert_eq!(client.read_holding_registers(10403, 1).await.unwrap().unwrap(), [4]);

    let code = |exception: ExceptionCode| u8::from(exception);
    assert_eq!(code(client.read_holding_registers(10552, 1).await.unwrap().unwrap_err()), 2);
    assert_eq!(code(client.read_holding_registers(8193, 1).await.unwrap().unwrap_err()), 2);
    assert_eq!(code(client.write_single_register(10240, 1).await.unwrap().unwrap_err()), 10);
    assert_eq!(code(client.write_multiple_registers(10240, &[1, 2]).await.unwrap().unwrap_err()), 10);
    assert_eq!(code(client.write_single_register(1, 1).await.unwrap().unwrap_err()), 2);
    assert_eq!(code(client.read_input_registers(10240, 1).await.unwrap().unwrap_err()), 1);
    assert_eq!(code(client.read_coils(10240, 1).await.unwrap().unwrap_err()), 1);
    emulation.stop().await;
}
