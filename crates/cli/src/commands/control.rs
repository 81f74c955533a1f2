//! `--control`: the imitation's own API and page, beside what it imitates.

use std::{env, net::SocketAddr};

use busbar_emulator::{
    Emulation, Fleet,
    control::{self, Control, Imitated, ServeError, Server, Token},
};

use crate::failure::Failure;

/// Where the token comes from. What stands on a command line every user of the machine can read.
pub(super) const TOKEN: &str = "BUSBAR_CONTROL_TOKEN";

/// The token of the environment, if there is one.
pub(super) fn token() -> Result<Option<Token>, Failure> {
    let Some(text) = env::var_os(TOKEN).filter(|text| !text.is_empty()) else { return Ok(None) };
    match text.to_str().map(Token::new) {
        Some(Ok(token)) => Ok(Some(token)),
        Some(Err(error)) => Err(Failure::Call(format!("{TOKEN} holds no token: {error}"))),
        None => Err(Failure::Call(format!("{TOKEN} holds no text"))),
    }
}

/// Whether a control may be served there, which is asked before anything starts.
pub(super) fn allow(address: SocketAddr, token: Option<&Token>) -> Result<(), Failure> {
    control::may_listen(address, token).map_err(failure)
}

/// The controllers of a fleet that runs.
pub(super) fn imitated(fleet: &Fleet, emulation: &Emulation) -> Vec<Imitated> {
    let members = fleet.members.iter().zip(emulation.controllers());
    let imitated = members.map(|(member, controller)| Imitated {
        id: member.id.clone(),
        name: member.name.clone(),
        controller: controller.clone(),
    });
    imitated.collect()
}

/// Controllers that nobody has named.
pub(super) fn alone(emulation: &Emulation) -> Vec<Imitated> {
    let imitated = emulation.controllers().iter().map(|controller| {
        let (id, name) = controller.with(|device| {
            let profile = device.profile();
            (profile.key.clone(), format!("{} {}", profile.vendor, device.model()))
        });
        Imitated { id, name, controller: controller.clone() }
    });
    imitated.collect()
}

/// The control of what `busbar emulate` imitates.
pub(super) async fn serve(
    address: SocketAddr,
    imitated: Vec<Imitated>,
    token: Option<Token>,
) -> Result<Server, Failure> {
    let control = Control { imitated, token, site: None };
    control::serve(address, control).await.map_err(failure)
}

fn failure(error: ServeError) -> Failure {
    match error {
        ServeError::NoToken { .. } => Failure::Call(format!("{error} in {TOKEN}")),
        _ => Failure::Failed(format!("{error} (--control ADDR:PORT)")),
    }
}
