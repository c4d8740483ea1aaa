//! Strategy `migrate`: the records that travel, queues and rounds.

use super::RayCounters;

shared! {
    /// Where a ray stands in the tree, 16 bytes. With the ray (32) and its hit so far (16) it makes the record
    /// of 64 bytes that travels; the ray itself never changes, so a move writes 32.
    struct Travel {
        /// Levels at which the other child is pending; see `glsl/include/trail.glsl`.
        trail: [u32; 2],
        /// The link to follow next in the whole tree; [`crate::shared::LINK_DONE`] when there is none.
        link: u32,
        /// The subtree that the ray is in or queued for; [`crate::shared::LINK_DONE`] after its end.
        subtree: u32,
    }

    /// A ray in a queue, 8 bytes.
    struct QueueEntry {
        /// Index of the ray.
        ray: u32,
        /// The subtree whose queue it is; [`crate::shared::LINK_DONE`] when the ray has ended.
        subtree: u32,
    }

    /// What became of a queue entry in a round; written on request.
    struct Visit {
        /// Index of the ray.
        ray: u32,
        /// The subtree whose queue it was in.
        subtree: u32,
        /// The subtree that it goes on to through a queue; [`crate::shared::LINK_DONE`] when it ended.
        next: u32,
        /// 1 if the entry's turn came before the quota of steps was spent.
        taken: u32,
        /// What the ray did in this round.
        counted: RayCounters,
    }

    /// Entries that the queue kernels go through, and how many workgroups that takes: arguments of indirect
    /// dispatches.
    struct Batch {
        /// Entries, among them those of rays that ended.
        count: u32,
        /// Entries that an invocation of the queue kernels goes through.
        strip: u32,
        /// Workgroups of the queue kernels.
        tiles: u32,
        /// 1.
        tiles_y: u32,
        /// 1.
        tiles_z: u32,
        /// Workgroups of the migration kernel: one an SM, or none if no ray is active.
        sms: u32,
        /// 1.
        sms_y: u32,
        /// 1.
        sms_z: u32,
    }

    /// Sums over a round, for the conservation checks.
    struct Round {
        /// Entries in queues when it began.
        queued: u32,
        /// Entries taken from queues.
        taken: u32,
        /// Entries put in queues for the next round, those not taken not among them.
        pushed: u32,
        /// Rays that ended.
        ended: u32,
        /// Records that were not where they should be: ended before, or in another queue.
        faults: u32,
        /// Zero.
        pad0: u32,
        /// Zero.
        pad1: u32,
        /// Zero.
        pad2: u32,
    }

    /// Push constants of the kernels of strategy `migrate`.
    struct MigratePush {
        /// Address of the nodes.
        nodes: [u32; 2],
        /// Address of the triangles.
        triangles: [u32; 2],
        /// Low corner of the scene.
        scene_low: [f32; 3],
        /// Index of the first ray.
        first: u32,
        /// High corner of the scene.
        scene_high: [f32; 3],
        /// Rays to trace.
        count: u32,
        /// Address of the top tree's nodes' indices in the whole tree.
        places: [u32; 2],
        /// Address of the subtrees.
        subtrees: [u32; 2],
        /// Address of where each SM's entries begin in the queue.
        shares: [u32; 2],
        /// Address of what becomes of each queue entry.
        visits: [u32; 2],
        /// Address of the entries taken so far from each SM's queues, where SM numbers are the hardware's.
        taken_of_sm: [u32; 2],
        /// Index of the first node of the top tree.
        first_top: u32,
        /// Where a walk of the top tree begins.
        root: u32,
        /// Index of the round in the round sums.
        round: u32,
        /// Which of the two batches is the queue's.
        parity: u32,
        /// SMs.
        sms: u32,
        /// Invocations of an SM.
        lanes: u32,
    }

    /// Push constants of the queue kernels.
    struct QueuePush {
        /// Which of the two batches is sorted.
        parity: u32,
        /// Bits of the subtree's index below the digit.
        shift: u32,
        /// Index of the round in the round sums.
        round: u32,
        /// SMs.
        sms: u32,
        /// Values of the digit.
        digits: u32,
    }
}

impl Visit {
    /// Of an entry whose turn did not come.
    pub fn waiting(entry: QueueEntry) -> Visit {
        Visit { ray: entry.ray, subtree: entry.subtree, next: entry.subtree, ..Visit::default() }
    }
}
