//! How rays were traced, as reports say it.

use serde::Serialize;

use crate::bvh::Owners;
use crate::trace::{NodeFormat, Strategy, TracerOptions};

/// The strategy and, where it has one, the machine that it was laid out for.
#[derive(Clone, Debug, Serialize)]
pub struct Tracing {
    /// The strategy.
    pub strategy: Strategy,
    /// How nodes are stored.
    pub nodes: NodeFormat,
    /// Bytes of a node.
    pub node_bytes: usize,
    /// Where the tree is cut.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub partition: Option<String>,
    /// How subtrees are given to SMs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub owners: Option<Owners>,
    /// SMs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sms: Option<u32>,
    /// Warps of an SM.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub warps_per_sm: Option<u32>,
    /// Whether SM numbers are the hardware's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hardware_sms: Option<bool>,
}

impl Tracing {
    /// What `options` come to.
    pub fn of(options: &TracerOptions) -> Tracing {
        let machine = &options.machine;
        let laid_out = options.strategy != Strategy::Direct;
        let cut = options.strategy == Strategy::Migrate;
        Tracing {
            strategy: options.strategy,
            nodes: options.nodes,
            node_bytes: options.nodes.node_bytes(),
            partition: cut.then(|| machine.partition.to_string()),
            owners: cut.then_some(machine.owners),
            sms: laid_out.then_some(machine.sms),
            warps_per_sm: laid_out.then_some(machine.warps_per_sm),
            hardware_sms: cut.then_some(machine.hardware_sms),
        }
    }
}
