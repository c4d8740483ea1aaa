//! How rays are traced: the strategy and its settings.

use crate::bvh::partition::MAX_SMS;
use crate::bvh::{Owners, Policy};
use crate::layout::{Node, QuantisedNode};
use crate::shared::WARP;
use crate::vulkan::DeviceInfo;
use crate::{Error, Result};

/// Most warps of an SM: 2048 invocations, beyond those of any chip's workgroups.
const MAX_WARPS_PER_SM: u32 = 64;

/// What is asked of each ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Query {
    /// The nearest hit.
    Closest,
    /// Whether there is any.
    Any,
}

/// Who traces which ray when. Hits are the same with all.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Strategy {
    /// One invocation a ray.
    #[default]
    Direct,
    /// A fixed number of invocations take rays from a common counter.
    Persistent,
    /// Rays travel to the SM that owns the subtree they must visit.
    Migrate,
}

impl Strategy {
    /// All, in the order of tables.
    pub const ALL: [Strategy; 3] = [Strategy::Direct, Strategy::Persistent, Strategy::Migrate];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Strategy::Direct => "direct",
            Strategy::Persistent => "persistent",
            Strategy::Migrate => "migrate",
        }
    }
}

/// The machine that the strategies are laid out for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MachineOptions {
    /// Where the tree is cut.
    pub partition: Policy,
    /// How subtrees are given to SMs.
    pub owners: Owners,
    /// Streaming multiprocessors; 15 as in the GeForce GTX 480 and in Zhu and Deng 2013, section I.
    pub sms: u32,
    /// Warps of an SM.
    pub warps_per_sm: u32,
    /// The number of the SM is the hardware's, not the workgroup's. Hits are the same; who takes which entry,
    /// and with it rounds and counters of SMs, then depends on the device's timing.
    pub hardware_sms: bool,
}

impl Default for MachineOptions {
    fn default() -> MachineOptions {
        // 8 warps are 256 invocations, which every device takes as a workgroup.
        MachineOptions {
            partition: Policy::default(),
            owners: Owners::default(),
            sms: 15,
            warps_per_sm: 8,
            hardware_sms: false,
        }
    }
}

impl MachineOptions {
    /// Invocations of all SMs.
    pub fn invocations(&self) -> u32 {
        self.sms * self.warps_per_sm * WARP
    }

    /// Refuses numbers that no machine has.
    ///
    /// # Errors
    /// [`Error::Usage`] that names the range.
    pub fn check(&self) -> Result<()> {
        in_range("--sms", self.sms, MAX_SMS)?;
        in_range("--warps-per-sm", self.warps_per_sm, MAX_WARPS_PER_SM)
    }

    /// Refuses what a device does not have.
    ///
    /// # Errors
    /// [`Error::Usage`] that names the range.
    pub fn check_device(&self, device: &DeviceInfo) -> Result<()> {
        self.check()?;
        in_range("--warps-per-sm on this device", self.warps_per_sm, device.limits.group_invocations / WARP)?;
        match device.sms {
            None if self.hardware_sms => Err(Error::usage(
                format!("--hardware-sms: {} has no VK_NV_shader_sm_builtins", device.name),
                "leave it out: workgroup s then stands for SM s",
            )),
            _ => Ok(()),
        }
    }
}

fn in_range(option: &str, value: u32, most: u32) -> Result<()> {
    if (1..=most).contains(&value) {
        return Ok(());
    }
    Err(Error::usage(format!("{option} is {value}"), format!("give a number from 1 to {most}")))
}

/// How nodes are stored. Hits are the same with all.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum NodeFormat {
    /// Boxes as floats, 64 bytes a node.
    #[default]
    Full,
    /// Boxes in 8 bits a plane, 32 bytes a node; for strategy direct.
    Quantised,
}

impl NodeFormat {
    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            NodeFormat::Full => "full",
            NodeFormat::Quantised => "quantised",
        }
    }

    /// Bytes of a node.
    pub fn node_bytes(self) -> usize {
        match self {
            NodeFormat::Full => size_of::<Node>(),
            NodeFormat::Quantised => size_of::<QuantisedNode>(),
        }
    }
}

/// How to trace.
#[derive(Clone, Copy, Debug, Default)]
pub struct TracerOptions {
    /// Who traces which ray when.
    pub strategy: Strategy,
    /// What the strategies other than `direct` are laid out for.
    pub machine: MachineOptions,
    /// How nodes are stored.
    pub nodes: NodeFormat,
    /// Take the driver's reciprocal as it is, exact or not: what bit identity costs, for benchmarks.
    pub driver_arithmetic: bool,
    /// Stop each invocation after so many steps and go on in another dispatch. Set by itself where the driver
    /// needs it, and by strategy `migrate`.
    pub step_limit: Option<u32>,
    /// Use the kernels for GPUs on software drivers too: lets tests run both there.
    pub gpu_kernels: bool,
}

impl TracerOptions {
    /// Each strategy with each format of nodes that it reads, all else by default.
    pub fn all() -> impl Iterator<Item = TracerOptions> {
        let with = |strategy, nodes| TracerOptions { strategy, nodes, ..TracerOptions::default() };
        let formats = [NodeFormat::Full, NodeFormat::Quantised];
        let every = formats.into_iter().flat_map(move |nodes| Strategy::ALL.map(|strategy| with(strategy, nodes)));
        every.filter(|options| options.check().is_ok())
    }

    /// The strategy, and the format of nodes if it is not the usual.
    pub fn name(&self) -> String {
        match self.nodes {
            NodeFormat::Full => self.strategy.name().to_owned(),
            NodeFormat::Quantised => format!("{} {}", self.strategy.name(), self.nodes.name()),
        }
    }

    /// Refuses numbers that no machine has, and nodes that the strategy cannot read.
    ///
    /// # Errors
    /// [`Error::Usage`] that names what is possible.
    pub fn check(&self) -> Result<()> {
        self.machine.check()?;
        if self.nodes == NodeFormat::Quantised && self.strategy != Strategy::Direct {
            let what = format!("strategy {} does not read quantised nodes", self.strategy.name());
            return Err(Error::usage(what, "use --strategy direct or --nodes full"));
        }
        Ok(())
    }
}
