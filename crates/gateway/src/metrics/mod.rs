//! `/metrics`: the site as OpenMetrics, for whoever keeps and watches numbers.
//!
//! Only values that are good now are among them: what a device refused, left out or does not have has no sample. How
//! many series there are follows from the site file and the profiles; nothing that a device or a client sends makes
//! another one.

mod devices;
mod signals;
mod wires;

use std::fmt;

use prometheus_client::collector::Collector;
use prometheus_client::encoding::{
    DescriptorEncoder, EncodeGaugeValue, EncodeLabelSet, MetricEncoder, NoLabelSet, text,
};
use prometheus_client::metrics::MetricType;
use prometheus_client::registry::{Registry, Unit};

use self::devices::DeviceSample;
use self::signals::SignalSamples;
use self::wires::WireSample;
use crate::api::types::SiteInfo;
use crate::hub::Hub;

/// What every name begins with.
const PREFIX: &str = "busbar";

/// The media type of the text.
pub(crate) const CONTENT_TYPE: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// The whole site as it stands. No device is locked for longer than its own values are copied.
///
/// # Errors
///
/// None that can happen while text is written into memory.
pub(crate) fn text(hub: &Hub) -> Result<String, fmt::Error> {
    let mut registry = Registry::with_prefix(PREFIX);
    registry.register_collector(Box::new(Scrape::of(hub)));
    let mut text = String::new();
    text::encode(&mut text, &registry)?;
    Ok(text)
}

/// Everything that is told in one go.
#[derive(Debug)]
struct Scrape {
    site: SiteInfo,
    devices: Vec<DeviceSample>,
    signals: SignalSamples,
    wires: Vec<WireSample>,
}

impl Scrape {
    fn of(hub: &Hub) -> Self {
        let (site, table) = (hub.info(), hub.table());
        let mut signals = SignalSamples::default();
        let mut devices = Vec::with_capacity(table.devices.len());
        for (index, slot) in table.devices.iter().enumerate() {
            let live = slot.lock();
            let sample = DeviceSample::of(&live.device);
            signals.take(index, &live.device, &sample.view);
            devices.push(sample);
        }
        let wires = table.wires.iter().map(|(id, link)| WireSample::of(id, link)).collect();
        Self { site, devices, signals, wires }
    }
}

impl Collector for Scrape {
    fn encode(&self, encoder: DescriptorEncoder<'_>) -> fmt::Result {
        let mut out = Out(encoder);
        let version = [("version", self.site.version.as_str())];
        out.info("build", "The gateway that tells this", [version])?;
        let refused = u64::from(self.site.config.refused.is_some());
        out.gauge("site_revision", "Site files taken since the start", self.site.revision)?;
        out.gauge("site_file_refused", "Whether a newer site file was refused", refused)?;
        devices::encode(&self.devices, &mut out)?;
        self.signals.encode(&self.devices, &mut out)?;
        wires::encode(&self.wires, &mut out)
    }
}

/// Writes families.
struct Out<'a>(DescriptorEncoder<'a>);

impl Out<'_> {
    /// A number of the whole gateway.
    fn gauge(&mut self, name: &str, help: &str, value: u64) -> fmt::Result {
        self.0.encode_descriptor(name, help, None, MetricType::Gauge)?.encode_gauge(&value)
    }

    /// A family whose samples go up and down; none when it has no samples.
    fn gauges<L: EncodeLabelSet, V: EncodeGaugeValue>(
        &mut self,
        name: &str,
        help: &str,
        unit: Option<&str>,
        samples: impl IntoIterator<Item = (L, V)>,
    ) -> fmt::Result {
        self.family(name, help, unit, MetricType::Gauge, samples, |sample, value| sample.encode_gauge(&value))
    }

    /// A family whose samples only go up.
    fn counters<L: EncodeLabelSet>(
        &mut self,
        name: &str,
        help: &str,
        samples: impl IntoIterator<Item = (L, u64)>,
    ) -> fmt::Result {
        self.family(name, help, None, MetricType::Counter, samples, |sample, value| {
            sample.encode_counter::<NoLabelSet, _, f64>(&value, None)
        })
    }

    /// A family of facts.
    fn info<L: EncodeLabelSet>(
        &mut self,
        name: &str,
        help: &str,
        facts: impl IntoIterator<Item = L>,
    ) -> fmt::Result {
        let mut family = self.0.encode_descriptor(name, help, None, MetricType::Info)?;
        facts.into_iter().try_for_each(|labels| family.encode_info(&labels))
    }

    fn family<L: EncodeLabelSet, V>(
        &mut self,
        name: &str,
        help: &str,
        unit: Option<&str>,
        kind: MetricType,
        samples: impl IntoIterator<Item = (L, V)>,
        write: impl Fn(&mut MetricEncoder<'_>, V) -> fmt::Result,
    ) -> fmt::Result {
        let mut samples = samples.into_iter().peekable();
        if samples.peek().is_none() {
            return Ok(());
        }
        let unit = unit.map(|unit| Unit::Other(unit.to_owned()));
        let mut family = self.0.encode_descriptor(name, help, unit.as_ref(), kind)?;
        for (labels, value) in samples {
            write(&mut family.encode_family(&labels)?, value)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
