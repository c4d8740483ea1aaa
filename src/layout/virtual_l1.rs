//! The virtual L1 of `virtual_l1.comp`.

shared! {
    /// A warp that a virtual SM holds, or the next it will, 8 bytes.
    struct WarpSlot {
        /// Number of the warp; the slot is empty if the launch has no such.
        warp: u32,
        /// Where it stands in its code; 0 before it begins.
        phase: u32,
    }

    /// What memory instructions of one kind did to a virtual SM's L1.
    struct AccessCounts {
        /// Instructions run by warps.
        instructions: u32,
        /// Lanes that ran them.
        lanes: u32,
        /// Accesses: one for each distinct line of an instruction.
        accesses: u32,
        /// Accesses of lines that were not there, and all stores to global memory.
        misses: u32,
        /// Lines that were newer than below when they were replaced.
        write_backs: u32,
        /// Zero.
        pad0: u32,
        /// Zero.
        pad1: u32,
        /// Zero.
        pad2: u32,
    }

    /// Push constants of the virtual L1. Lines are numbered by 128 bytes.
    struct VirtualPush {
        /// Address of the nodes.
        nodes: [u32; 2],
        /// Address of the triangles.
        triangles: [u32; 2],
        /// Low corner of the scene.
        scene_low: [f32; 3],
        /// Turns that each SM has taken.
        turn: u32,
        /// High corner of the scene.
        scene_high: [f32; 3],
        /// Rays.
        count: u32,
        /// First line of the nodes.
        node_line: u32,
        /// First line of the triangles.
        triangle_line: u32,
        /// First line of the rays.
        ray_line: u32,
        /// First line of the hits.
        hit_line: u32,
        /// First line of the stacks.
        stack_line: u32,
        /// SMs.
        sms: u32,
        /// Warps that an SM holds.
        warps: u32,
        /// Sets of its L1, a power of two.
        sets: u32,
        /// Lines of a set.
        ways: u32,
        /// 1 if a line's set is a hash of its number.
        hashed: u32,
    }
}
