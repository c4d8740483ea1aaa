//! Triangles with the same box, many times over, are one to the builder: PLOC pairs nearest neighbours, and
//! where all are equally near it makes a chain in quadratic time.

use glam::Vec3;
use obvhs::aabb::Aabb;
use rayon::prelude::*;
use xxhash_rust::xxh3::xxh3_64;

use crate::shared::MAX_LEAF_TRIANGLES;

/// What the builder builds over.
pub struct BuildPrimitives {
    /// Their boxes.
    pub boxes: Vec<Aabb>,
    /// Primitive ids of each; `None` if they are the scene's triangles.
    groups: Option<Vec<Vec<u32>>>,
}

impl BuildPrimitives {
    /// Groups triangles whose box more than a leaf of them share.
    pub fn new(positions: &[[Vec3; 3]]) -> BuildPrimitives {
        let boxes: Vec<Aabb> = positions.par_iter().map(bounds).collect();
        let mut keyed: Vec<(u64, u32)> = boxes
            .par_iter()
            .enumerate()
            .map(|(prim, aabb)| {
                (xxh3_64(bytemuck::bytes_of(&[Vec3::from(aabb.min), Vec3::from(aabb.max)])), prim as u32)
            })
            .collect();
        keyed.par_sort_unstable();
        let runs = || keyed.chunk_by(|a, b| a.0 == b.0);
        let is_group = |run: &&[(u64, u32)]| run.len() > MAX_LEAF_TRIANGLES as usize;
        if !runs().any(|run| is_group(&run)) {
            return BuildPrimitives { boxes, groups: None };
        }
        let ids = |run: &[(u64, u32)]| run.iter().map(|&(_, prim)| prim).collect::<Vec<u32>>();
        let mut groups: Vec<Vec<u32>> = runs().filter(is_group).map(ids).collect();
        groups.extend(runs().filter(|run| !is_group(run)).flatten().map(|&(_, prim)| vec![prim]));
        // The union, in case two boxes have the same hash.
        let union = |group: &Vec<u32>| group.iter().fold(Aabb::empty(), |all, &prim| all.union(&boxes[prim as usize]));
        BuildPrimitives { boxes: groups.par_iter().map(union).collect(), groups: Some(groups) }
    }

    /// Whether a build primitive can be many triangles.
    pub fn has_groups(&self) -> bool {
        self.groups.is_some()
    }

    /// Primitive ids of build primitive `index`.
    pub fn triangles(&self, index: u32) -> impl Iterator<Item = u32> {
        let single = self.groups.is_none().then_some(index);
        let group = self.groups.as_ref().map_or(&[][..], |groups| &groups[index as usize]);
        single.into_iter().chain(group.iter().copied())
    }
}

/// Box of a triangle.
pub fn bounds(&[a, b, c]: &[Vec3; 3]) -> Aabb {
    Aabb::new(a.min(b).min(c).into(), a.max(b).max(c).into())
}
