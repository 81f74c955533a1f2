//! What joins the plants of several controllers: they move together, step by step.

use std::ops::DerefMut;
use std::time::Duration;

use crate::device::Device;
use crate::plant::Offer;

/// One thing that joins plants; controllers are named by their index.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Joint {
    /// A section of a transfer switch is the mains of a genset.
    Supply {
        /// The transfer switch.
        from: usize,
        /// Its bus section, from 0.
        section: usize,
        /// The genset's controller.
        to: usize,
    },
    /// Gensets share the load of one bus bar.
    BusBar {
        /// Their controllers.
        gensets: Vec<usize>,
    },
}

impl Joint {
    /// The controllers that it joins.
    pub(crate) fn members(&self) -> Vec<usize> {
        match self {
            Self::Supply { from, to, .. } => vec![*from, *to],
            Self::BusBar { gensets } => gensets.clone(),
        }
    }

    /// The same joint among these controllers alone, which it names by their place there; none where it joins others.
    pub(crate) fn within(&self, controllers: &[usize]) -> Option<Self> {
        let place = |index: &usize| controllers.iter().position(|controller| controller == index);
        Some(match self {
            Self::Supply { from, section, to } => {
                Self::Supply { from: place(from)?, section: *section, to: place(to)? }
            }
            Self::BusBar { gensets } => {
                Self::BusBar { gensets: gensets.iter().map(place).collect::<Option<_>>()? }
            }
        })
    }

    /// Hands on what the plants are to each other now. Where a controller has nothing of the kind, nothing is.
    fn join(&self, devices: &mut [impl DerefMut<Target = Device>]) {
        match self {
            Self::Supply { from, section, to } => {
                let supply = devices.get(*from).and_then(|switch| switch.section(*section));
                let genset = devices.get_mut(*to).and_then(|device| device.genset());
                if let (Some(supply), Some(genset)) = (supply, genset) {
                    genset.supply(supply);
                }
            }
            Self::BusBar { gensets } => share(gensets, devices),
        }
    }
}

/// Tells each genset what all others on its bus bar are.
fn share(gensets: &[usize], devices: &mut [impl DerefMut<Target = Device>]) {
    let mut offers = Vec::with_capacity(gensets.len());
    for index in gensets {
        let plant = devices.get_mut(*index).and_then(|device| device.genset());
        offers.push(plant.map(|plant| plant.offer()).unwrap_or_default());
    }
    for (place, index) in gensets.iter().enumerate() {
        let others = offers.iter().enumerate().filter(|(other, _)| *other != place);
        let others = others.fold(Offer::default(), |sum, (_, offer)| sum.and(*offer));
        if let Some(plant) = devices.get_mut(*index).and_then(|device| device.genset()) {
            plant.join(others);
        }
    }
}

/// Tells all of them what they are joined to, as it is before any time has passed.
pub(crate) fn join(devices: &mut [impl DerefMut<Target = Device>], joints: &[Joint]) {
    joints.iter().for_each(|joint| joint.join(devices));
}

/// Lets all of them live until `now`, simulated time since power-on, and refreshes their registers. After each step of
/// all of them the joints hand on what the plants are to each other.
pub(crate) fn advance(devices: &mut [impl DerefMut<Target = Device>], joints: &[Joint], now: Duration) {
    let mut moved = false;
    while devices.iter().any(|device| device.is_due(now)) {
        for device in devices.iter_mut().filter(|device| device.is_due(now)) {
            device.step();
        }
        join(devices, joints);
        moved = true;
    }
    if moved {
        devices.iter_mut().for_each(|device| device.settle());
    }
}
