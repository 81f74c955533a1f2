//! `busbar demo`: a whole site on this machine.

use std::io;

use busbar_emulator::{Config, Emulation, StartError};
use busbar_gateway::Site;
use busbar_link::Endpoint;
use serde::Serialize;

use super::{emulate, run};
use crate::{args, failure::Failure, logging, runtime, terminal};

const KEY: &str = "datakom-d";
const MODEL: &str = "D-500";
const UNIT: u8 = 1;

/// Easy to remember for a person's own Modbus tools; any free port when it is taken.
const USUAL_PORT: u16 = 1502;

/// Where to look, as `--json` prints it.
#[derive(Serialize)]
struct Shown<'a> {
    page: String,
    controllers: [Controller<'a>; 1],
}

#[derive(Serialize)]
struct Controller<'a> {
    id: &'a str,
    profile: &'a str,
    model: &'a str,
    endpoint: &'a Endpoint,
    unit: u8,
}

pub(crate) fn run(args: &args::Demo, json: bool) -> Result<(), Failure> {
    logging::start("warn")?;
    run::data(args.data.as_deref());
    runtime::service(async |mut stop| {
        let emulation = imitate().await.map_err(emulate::failure)?;
        let endpoint = emulation
            .urls()
            .first()
            .ok_or_else(|| Failure::Failed("the imitation has no port".to_owned()))?;
        let gateway = run::gateway(site(endpoint)?, args.listen).await?;
        let page = run::page(gateway.address());
        if json {
            let controller = Controller { id: "genset-1", profile: KEY, model: MODEL, endpoint, unit: UNIT };
            terminal::print_json(&Shown { page, controllers: [controller] })?;
        } else {
            let title = terminal::style().title("Busbar demonstration site");
            terminal::print(&format!(
                "{title}\n  page        {page}\n  controller  {endpoint}, unit {UNIT}, an imitated Datakom {MODEL}\n  \
                 by hand     busbar read {KEY} --from {endpoint}\n\nCtrl-C ends it.\n"
            ))?;
        }
        stop.wait().await;
        gateway.shutdown().await;
        emulation.stop().await;
        Ok(())
    })
}

async fn imitate() -> Result<Emulation, StartError> {
    let config = |port| Config {
        profile: KEY.to_owned(),
        unit: UNIT,
        model: Some(MODEL.to_owned()),
        listen: vec![Endpoint::Tcp { host: "127.0.0.1".to_owned(), port }],
        story: true,
        ..Config::default()
    };
    match busbar_emulator::start(config(USUAL_PORT)).await {
        Err(StartError::Listen {
            kind: io::ErrorKind::AddrInUse | io::ErrorKind::PermissionDenied, ..
        }) => busbar_emulator::start(config(0)).await,
        started => started,
    }
}

/// The site file that a person would write for this.
fn site(endpoint: &Endpoint) -> Result<Site, Failure> {
    let text = format!(
        r#"
[site]
name = "Demonstration site"
[server]
listen = "127.0.0.1:8080"
[[wires]]
id = "genset-1"
endpoint = "{endpoint}"
[[devices]]
id = "genset-1"
name = "Genset 1"
profile = "{KEY}"
wire = "genset-1"
unit = {UNIT}
"#
    );
    Site::parse("demonstration", &text).map_err(Failure::failed)
}
