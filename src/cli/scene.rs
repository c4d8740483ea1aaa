//! `caribou scene`: procedural scenes.

use std::path::PathBuf;

use clap::Args;

use super::output;
use crate::atomic_file::check_writable;
use crate::scene::{glb, procedural};
use crate::{Error, Result};

/// Make a procedural scene: seeded, and the same on every machine
#[derive(Args)]
pub struct SceneCommand {
    /// room, forest, blob or needles
    name: String,
    /// Triangles, 1,000 to 10,000,000
    #[arg(long, value_name = "N", default_value_t = 100_000)]
    triangles: usize,
    /// Seed of its random numbers
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The .glb file to write
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Print nothing
    #[arg(short, long)]
    quiet: bool,
}

impl SceneCommand {
    /// Builds the scene and writes it.
    pub fn run(&self) -> Result<()> {
        if self.output.extension().is_none_or(|e| !e.eq_ignore_ascii_case("glb")) {
            return Err(Error::usage(format!("-o {}", self.output.display()), "name a file that ends in .glb"));
        }
        check_writable(&self.output)?;
        let scene = procedural::build(&self.name, self.triangles, self.seed)?;
        glb::write(&scene, &self.output, None)?;
        if self.quiet {
            return Ok(());
        }
        output::print(&format!("{}: {} triangles\n", self.output.display(), scene.positions.len()))
    }
}
