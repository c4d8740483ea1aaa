//! Pieces with the same box, many times over, are one to the builder: PLOC pairs nearest neighbours, and
//! where all are equally near it makes a chain in quadratic time.

use glam::Vec3;
use obvhs::aabb::Aabb;
use rayon::prelude::*;
use xxhash_rust::xxh3::xxh3_64;

use super::pieces::Pieces;
use crate::shared::MAX_LEAF_TRIANGLES;

/// What the builder builds over: single pieces, or groups of them.
pub struct BuildPrimitives {
    /// What they are made of.
    pub pieces: Pieces,
    /// Pieces of each group; `None` if each piece is a build primitive of its own.
    groups: Option<Vec<Vec<u32>>>,
}

impl BuildPrimitives {
    /// Groups pieces whose box more than a leaf of them share.
    pub fn new(pieces: Pieces) -> BuildPrimitives {
        let key = |aabb: &Aabb| xxh3_64(bytemuck::bytes_of(&[Vec3::from(aabb.min), Vec3::from(aabb.max)]));
        let keys = pieces.boxes.par_iter().enumerate().map(|(piece, aabb)| (key(aabb), piece as u32));
        let mut keyed: Vec<(u64, u32)> = keys.collect();
        keyed.par_sort_unstable();
        let runs = || keyed.chunk_by(|a, b| a.0 == b.0);
        let is_group = |run: &&[(u64, u32)]| run.len() > MAX_LEAF_TRIANGLES as usize;
        if !runs().any(|run| is_group(&run)) {
            return BuildPrimitives { pieces, groups: None };
        }
        let ids = |run: &[(u64, u32)]| run.iter().map(|&(_, piece)| piece).collect::<Vec<u32>>();
        let mut groups: Vec<Vec<u32>> = runs().filter(is_group).map(ids).collect();
        groups.extend(runs().filter(|run| !is_group(run)).flatten().map(|&(_, piece)| vec![piece]));
        BuildPrimitives { pieces, groups: Some(groups) }
    }

    /// Whether a build primitive can be many pieces.
    pub fn has_groups(&self) -> bool {
        self.groups.is_some()
    }

    /// The box of each build primitive.
    pub fn boxes(&self) -> Vec<Aabb> {
        // The union, in case two boxes have the same hash.
        let union = |group: &Vec<u32>| self.pieces.union(group);
        self.groups.as_ref().map_or_else(|| self.pieces.boxes.clone(), |groups| groups.par_iter().map(union).collect())
    }

    /// Pieces of build primitive `index`.
    pub fn pieces_of(&self, index: u32) -> impl Iterator<Item = u32> {
        let single = self.groups.is_none().then_some(index);
        let group = self.groups.as_ref().map_or(&[][..], |groups| &groups[index as usize]);
        single.into_iter().chain(group.iter().copied())
    }
}
