//! Rays, their hits, and what they did in the tree.

shared! {
    /// A ray, 32 bytes. `t` is measured in units of `direction`'s length; hits with
    /// `t_min <= t <= t_max` count. A *dead* ray has `t_max < t_min` and hits nothing.
    struct Ray {
        /// Origin in world space.
        origin: [f32; 3],
        /// Smallest accepted t, at least 0.
        t_min: f32,
        /// Direction, unit length from all of this project's generators.
        direction: [f32; 3],
        /// Largest accepted t.
        t_max: f32,
    }

    /// The nearest hit, 16 bytes; `prim` is [`crate::shared::NO_HIT`] for a miss.
    struct Hit {
        /// Distance in units of the direction's length; the ray's `t_max` for a miss.
        t: f32,
        /// Primitive id.
        prim: u32,
        /// Barycentric weight of the second corner.
        u: f32,
        /// Barycentric weight of the third corner.
        v: f32,
    }

    /// What one ray did in the tree. The first four are the same in all strategies; strategies without
    /// subtrees leave the others at 0.
    struct RayCounters {
        /// Nodes fetched and their two boxes tested, those of the top tree among them.
        node_visits: u32,
        /// Triangles tested.
        triangle_tests: u32,
        /// Leaves entered.
        leaf_visits: u32,
        /// Links put off and taken up again, those of the top tree among them.
        stack_operations: u32,
        /// Of the node visits, those in the top tree.
        top_visits: u32,
        /// Of the stack operations, those in the top tree.
        top_stack_operations: u32,
        /// Steps from a node to its parent, to take up a link of the top tree.
        climbs: u32,
        /// Subtrees entered.
        subtrees: u32,
        /// Times that the next subtree had another owner.
        migrations: u32,
        /// Times that it had the same owner, and no queue was needed.
        bypasses: u32,
        /// Times that the ray was left where it stood because the invocation had taken its quota of steps.
        suspensions: u32,
        /// Zero.
        pad: u32,
    }

    /// Push constants of the trace kernels.
    struct TracePush {
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
        /// 1 to go on with rays that ran into the step limit.
        resume: u32,
        /// Rays of a workgroup, with the kernels for software drivers.
        strip: u32,
    }
}

impl Ray {
    /// A ray that hits nothing and costs nothing.
    pub const DEAD: Ray = Ray { origin: [0.0; 3], t_min: 0.0, direction: [0.0, 0.0, 1.0], t_max: -1.0 };

    /// Whether the ray is to be traced.
    pub fn is_live(&self) -> bool {
        self.t_max >= self.t_min
    }
}

impl Hit {
    /// Whether there is a hit.
    pub fn is_hit(&self) -> bool {
        self.prim != crate::shared::NO_HIT
    }
}

impl std::ops::AddAssign for RayCounters {
    fn add_assign(&mut self, more: RayCounters) {
        let sums: &mut [u32] = bytemuck::cast_slice_mut(std::slice::from_mut(self));
        let more: &[u32] = bytemuck::cast_slice(std::slice::from_ref(&more));
        sums.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
    }
}
