//! Procedural scenes: seeded, reproducible bit for bit on every machine, from a thousand to ten million
//! triangles. They stand in for scenes that cannot be had and drive scaling curves.

mod blob;
mod forest;
pub(crate) mod mesh;
mod needles;
mod noise;
pub(crate) mod random;
mod room;
pub(crate) mod sphere;
pub(crate) mod surface;
pub(crate) mod trig;

use super::Scene;
use crate::{Error, Result};

/// A procedural scene that [`build`] knows.
#[derive(Clone, Copy, Debug)]
pub struct Recipe {
    /// What the user calls it.
    pub name: &'static str,
    /// One line for a list of scenes.
    pub description: &'static str,
    build: fn(usize, u64) -> Scene,
}

/// All procedural scenes.
pub const RECIPES: &[Recipe] = &[
    Recipe {
        name: "room",
        description: "an indoor room with furniture: huge walls beside finely tessellated objects",
        build: room::build,
    },
    Recipe { name: "forest", description: "an open forest of thin overlapping leaves", build: forest::build },
    Recipe { name: "blob", description: "a dense smooth closed object on a ground plane", build: blob::build },
    Recipe {
        name: "needles",
        description: "the worst case: long thin diagonal triangles that fill a cube",
        build: needles::build,
    },
];

/// Triangle counts that [`build`] accepts.
pub const TRIANGLES: std::ops::RangeInclusive<usize> = 1_000..=10_000_000;

/// Builds the procedural scene `name` with exactly `triangles` triangles. The same arguments give the
/// same bits everywhere. Fails with [`Error::Usage`] for an unknown name or a count outside [`TRIANGLES`].
pub fn build(name: &str, triangles: usize, seed: u64) -> Result<Scene> {
    let Some(recipe) = RECIPES.iter().find(|recipe| recipe.name == name) else {
        let known: Vec<&str> = RECIPES.iter().map(|recipe| recipe.name).collect();
        return Err(Error::usage(
            format!("unknown procedural scene \"{name}\""),
            format!("known scenes: {}", known.join(", ")),
        ));
    };
    if !TRIANGLES.contains(&triangles) {
        return Err(Error::usage(
            format!("{triangles} triangles are out of range"),
            format!("ask for {} to {}", TRIANGLES.start(), TRIANGLES.end()),
        ));
    }
    Ok((recipe.build)(triangles, seed))
}

#[cfg(test)]
mod tests;
