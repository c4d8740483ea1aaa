//! Structs shared with the kernels, one for one with `glsl/include/types.glsl`. `tests/layout.rs` compares
//! names and offsets with the compiled SPIR-V.

use bytemuck::{Pod, Zeroable};

/// A struct with the kernels' layout.
pub trait Shared: Pod {
    /// Its name in GLSL.
    const NAME: &'static str;
    /// Name and byte offset of each field.
    const FIELDS: &'static [(&'static str, usize)];
}

macro_rules! shared {
    ($($(#[$about:meta])* struct $name:ident { $($(#[$field_about:meta])* $field:ident: $kind:ty,)* })*) => {
        $(
            $(#[$about])*
            #[repr(C)]
            #[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
            pub struct $name { $($(#[$field_about])* pub $field: $kind,)* }

            impl Shared for $name {
                const NAME: &'static str = stringify!($name);
                const FIELDS: &'static [(&'static str, usize)] =
                    &[$((stringify!($field), std::mem::offset_of!($name, $field)),)*];
            }
        )*

        /// Name, size and fields of every shared struct.
        pub const SHARED_STRUCTS: &[(&str, usize, &[(&str, usize)])] =
            &[$(($name::NAME, size_of::<$name>(), $name::FIELDS),)*];
    };
}

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

    /// Two-child node, 64 bytes: the boxes of both children and where they are. Each axis holds
    /// `[child 0 low, child 0 high, child 1 low, child 1 high]`, so a node is four 16-byte loads and both
    /// boxes are tested by the same four-lane arithmetic.
    struct Node {
        /// x planes.
        x: [f32; 4],
        /// y planes.
        y: [f32; 4],
        /// z planes.
        z: [f32; 4],
        /// Links of both children; see [`crate::shared::LEAF_BIT`] for the encoding.
        child: [u32; 2],
        /// Index of the parent; the root's own.
        parent: u32,
        /// Inner nodes above this one.
        level: u32,
    }

    /// Node of 32 bytes whose planes are bytes; `glsl/include/quantised.glsl` says how it is read.
    struct QuantisedNode {
        /// Where the node's grid begins.
        origin: [f32; 3],
        /// Biased exponents of the grid's steps in x, y and z, a byte each; then 4 bits a child: its triangle count, or
        /// [`crate::shared::QUANTISED_INNER`].
        exponents: u32,
        /// x planes in steps from the origin, a byte each, in the order of [`Node`].
        x: u32,
        /// y planes.
        y: u32,
        /// z planes.
        z: u32,
        /// From which the links of both children follow.
        base: u32,
    }

    /// Triangle, 48 bytes, in traversal order: a leaf's triangles are adjacent.
    struct Triangle {
        /// First corner.
        v0: [f32; 3],
        /// Primitive id: index into the scene's triangles.
        prim: u32,
        /// Second corner.
        v1: [f32; 3],
        /// Zero.
        pad1: u32,
        /// Third corner.
        v2: [f32; 3],
        /// Zero.
        pad2: u32,
    }

    /// A part of the tree that one SM owns, 16 bytes.
    struct Subtree {
        /// Link of its root in the whole tree: a node or a leaf.
        root: u32,
        /// Index in the top tree of the node above it.
        parent: u32,
        /// Inner nodes above its root.
        level: u32,
        /// The SM that traverses it.
        owner: u32,
    }

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

    /// A path in flight: one sample of one pixel.
    struct Path {
        /// Share of the light at the path's end that reaches the camera.
        throughput: [f32; 3],
        /// Raster index of the pixel.
        pixel: u32,
        /// Light gathered so far.
        radiance: [f32; 3],
        /// Bounces and flags, `PATH_*` in [`crate::shared`].
        state: u32,
    }

    /// What a shadow ray brings if it arrives.
    struct Contribution {
        /// Light for the path's radiance.
        radiance: [f32; 3],
        /// Zero.
        pad: u32,
    }

    /// Material as the kernels read it.
    struct Material {
        /// Linear base colour.
        base_color: [f32; 3],
        /// 0 dielectric .. 1 metal.
        metallic: f32,
        /// Emitted radiance.
        emissive: [f32; 3],
        /// Perceptual roughness.
        roughness: f32,
        /// Transmission factor.
        transmission: f32,
        /// Index of refraction.
        ior: f32,
        /// Index of the base-colour texture or [`crate::shared::NO_TEXTURE`].
        texture: u32,
        /// `MATERIAL_*` in [`crate::shared`].
        flags: u32,
    }

    /// Where a texture's texels are.
    struct Texture {
        /// Index of the first texel.
        first: u32,
        /// Texels across.
        width: u32,
        /// Texels down.
        height: u32,
        /// `WRAP_*` of u in bits 0-1, of v in bits 2-3.
        wrap: u32,
    }

    /// Punctual light as the kernels read it.
    struct Light {
        /// World position (point, spot).
        position: [f32; 3],
        /// `LIGHT_*` in [`crate::shared`].
        kind: u32,
        /// Unit direction in which it shines (directional, spot).
        direction: [f32; 3],
        /// 1 / range, 0 if unlimited.
        inverse_range: f32,
        /// Linear intensity.
        intensity: [f32; 3],
        /// Spot cone: fades as `clamp(cos * angle_scale + angle_offset, 0, 1)` squared.
        angle_scale: f32,
        /// See `angle_scale`.
        angle_offset: f32,
        /// Zero.
        pad0: u32,
        /// Zero.
        pad1: u32,
        /// Zero.
        pad2: u32,
    }

    /// Everything that stays the same over a picture. Addresses are zero on the CPU.
    struct Frame {
        /// Eye, or middle of the picture plane of an orthographic camera.
        camera_origin: [f32; 3],
        /// Pixels across.
        width: u32,
        /// From the middle of the picture to its right edge, at distance 1.
        camera_right: [f32; 3],
        /// Pixels down.
        height: u32,
        /// From the middle of the picture to its top edge, at distance 1.
        camera_up: [f32; 3],
        /// 1 for an orthographic camera.
        orthographic: u32,
        /// Unit view direction.
        camera_forward: [f32; 3],
        /// Seed of all random numbers.
        seed: u32,
        /// Radiance of the sky straight up.
        sky_zenith: [f32; 3],
        /// Length of ambient occlusion rays.
        ao_radius: f32,
        /// Radiance of the sky at the horizon and below.
        sky_horizon: [f32; 3],
        /// Most bounces of a path.
        max_depth: u32,
        /// Radiance that an unoccluded ambient ray brings.
        ambient: [f32; 3],
        /// 1 if the sky does not show and alpha is coverage.
        transparent: u32,
        /// 1 if the scene has punctual lights.
        lit: u32,
        /// Zero.
        pad0: u32,
        /// Address of the triangles.
        triangles: [u32; 2],
        /// Address of the place of each primitive in the triangles.
        slots: [u32; 2],
        /// Address of the material of each primitive.
        material_ids: [u32; 2],
        /// Address of the packed corner normals.
        normals: [u32; 2],
        /// Address of the corner texture coordinates.
        uvs: [u32; 2],
        /// Address of the texels.
        texels: [u32; 2],
        /// Address of the 256 linear values of 8-bit sRGB.
        srgb: [u32; 2],
    }

    /// First hit of a pixel's first sample.
    struct AovPixel {
        /// Unit shading normal on the camera's side; zero for a miss.
        normal: [f32; 3],
        /// Distance along the view direction; [`crate::shared::Z_NOTHING`] for a miss.
        z: f32,
        /// Base colour, texture included.
        albedo: [f32; 3],
        /// Primitive id or [`crate::shared::NO_HIT`].
        prim: u32,
        /// World position.
        position: [f32; 3],
        /// Nodes visited by the camera ray.
        steps: f32,
        /// Times that it went to another SM.
        migrations: f32,
        /// Subtrees that it entered.
        subtrees: f32,
        /// Zero.
        pad0: u32,
        /// Zero.
        pad1: u32,
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
        /// Address of the top tree's nodes.
        top: [u32; 2],
        /// Address of their indices in the whole tree.
        places: [u32; 2],
        /// Address of the subtrees.
        subtrees: [u32; 2],
        /// Address of where each SM's entries begin in the queue.
        shares: [u32; 2],
        /// Address of what becomes of each queue entry.
        visits: [u32; 2],
        /// Address of the entries taken so far from each SM's queues, where SM numbers are the hardware's.
        taken_of_sm: [u32; 2],
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
    }

    /// Push constants of the kernels of a picture's stages.
    struct StagePush {
        /// Index of the batch's first path among those of the chosen tiles.
        first: u32,
        /// Paths in the batch.
        count: u32,
        /// Sample number.
        sample_index: u32,
        /// The stage's own: light, ray kind, or samples of this pass so far.
        argument: u32,
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

impl std::ops::AddAssign for RayCounters {
    fn add_assign(&mut self, more: RayCounters) {
        let sums: &mut [u32] = bytemuck::cast_slice_mut(std::slice::from_mut(self));
        let more: &[u32] = bytemuck::cast_slice(std::slice::from_ref(&more));
        sums.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
    }
}

impl Visit {
    /// Of an entry whose turn did not come.
    pub fn waiting(entry: QueueEntry) -> Visit {
        Visit { ray: entry.ray, subtree: entry.subtree, next: entry.subtree, ..Visit::default() }
    }
}

impl Hit {
    /// Whether there is a hit.
    pub fn is_hit(&self) -> bool {
        self.prim != crate::shared::NO_HIT
    }
}
