//! Kernels as the machine sees them: registers, block size, and a listing of each basic block.

use std::collections::HashMap;

use serde::Deserialize;

use super::blocks::RECORD_PART;
pub use super::blocks::{Block, Loops};
use super::occupancy::Demand;
use super::settings::{Source, Text};
use crate::{Error, Result, layout};

/// Embedded descriptions, by name.
const KERNELS: &[(&str, &str)] = &[
    ("while-while", include_str!("kernels/while-while.toml")),
    ("speculative-while-while", include_str!("kernels/speculative-while-while.toml")),
    ("migrate-schedule", include_str!("kernels/migrate-schedule.toml")),
    ("migrate-subtree", include_str!("kernels/migrate-subtree.toml")),
    ("migrate-queue", include_str!("kernels/migrate-queue.toml")),
];

/// Most registers a listing may name: far above what a thread has, low enough for a byte.
const MAX_NAMES: usize = 200;

/// Most repeats of one line of a listing: far above what a compiler unrolls.
const MAX_REPEATS: usize = 256;

/// A traversal kernel.
#[derive(Clone, Debug)]
pub struct Kernel {
    /// Name of the description.
    pub name: String,
    /// Registers a thread.
    pub registers: u32,
    /// Threads a block.
    pub threads: u32,
    /// Bytes of shared memory a block.
    pub shared: u32,
    /// How its loops are nested.
    pub loops: Loops,
    /// Bytes of the record of a ray that goes from queue to queue.
    pub record: u32,
    /// Registers named in the listings.
    pub names: usize,
    blocks: HashMap<Block, Vec<Instruction>>,
}

/// What an instruction does, as far as time is concerned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Operation {
    /// Move, compare, select, logic, shift, conversion, negation.
    Simple,
    /// Branch: as `Simple`, without a result.
    Branch,
    /// Addition and subtraction, integer or floating-point.
    Add,
    /// Fused multiply-add.
    Fma,
    /// Minimum and maximum.
    Minmax,
    /// Minimum or maximum of two registers, then that of the result and a third (`vmin`, `vmax`).
    Video,
    /// Floating-point product.
    Mul,
    /// Integer product.
    Imul,
    /// Integer multiply-add.
    Imad,
    /// Reciprocal.
    Rcp,
    /// Reads or writes shared memory.
    Shared,
    /// Reads memory.
    Load,
    /// Reads memory by the texture units.
    Texture,
    /// Writes memory.
    Store,
}

/// One instruction; registers are numbered from 1, 0 is none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Instruction {
    /// What it does.
    pub operation: Operation,
    /// Register it writes.
    pub destination: u8,
    /// Registers it reads.
    pub sources: [u8; 5],
}

impl Instruction {
    /// Registers that the operand collector reads for it; the predicate of a branch is none.
    pub fn operands(&self) -> u64 {
        match self.operation {
            Operation::Branch => 0,
            _ => self.sources.iter().filter(|&&register| register != 0).count() as u64,
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Description {
    name: String,
    registers: u32,
    threads: u32,
    shared: u32,
    loops: Loops,
    #[serde(default = "whole_record")]
    record: u32,
    /// Kernels whose blocks these are where it has none of its own; the first that has one counts.
    #[serde(default)]
    like: Vec<String>,
    #[serde(default)]
    blocks: HashMap<Block, String>,
}

/// Bytes of the project's own record: ray, hit and place in the tree (`glsl/include/migration.glsl`).
fn whole_record() -> u32 {
    (size_of::<layout::Ray>() + size_of::<layout::Hit>() + size_of::<layout::Travel>()) as u32
}

impl Kernel {
    /// The embedded kernel `name`, with `overrides` as `key=value`.
    ///
    /// # Errors
    /// [`Error::Usage`] for an unknown name, [`Error::Input`] for unknown keys and impossible values.
    pub fn named(name: &str, overrides: &[String]) -> Result<Kernel> {
        let source = Source::embedded("kernel", KERNELS, name)?;
        Kernel::parse(source, overrides)
    }

    /// Names of the embedded kernels.
    pub fn known() -> impl Iterator<Item = &'static str> {
        KERNELS.iter().map(|&(name, _)| name)
    }

    /// Reads a description.
    ///
    /// # Errors
    /// [`Error::Input`] naming key and file.
    pub fn parse(source: Source, overrides: &[String]) -> Result<Kernel> {
        let description: Description = Text::new(&source, overrides)?.read()?;
        let bad = |key: &str, problem: String| Error::input(source.file, key, problem, "correct the description");
        for (key, value, allowed) in
            [("registers", description.registers, 1..=63), ("threads", description.threads, 1..=1024)]
        {
            if !allowed.contains(&value) {
                return Err(bad(key, format!("{value} is not in {} to {}", allowed.start(), allowed.end())));
            }
        }
        if !(RECORD_PART as u32..=whole_record()).contains(&description.record)
            || !description.record.is_multiple_of(RECORD_PART as u32)
        {
            let problem = format!("{} is no multiple of {RECORD_PART} up to {}", description.record, whole_record());
            return Err(bad("record", problem));
        }
        let mut listings = description.blocks;
        for other in &description.like {
            let source = Source::embedded("kernel", KERNELS, other)?;
            for (block, text) in Text::new(&source, &[])?.read::<Description>()?.blocks {
                listings.entry(block).or_insert(text);
            }
        }
        let mut names = HashMap::new();
        let mut blocks = HashMap::new();
        for (block, loads, stores) in description.loops.blocks(description.record) {
            let key = format!("blocks.{block:?}").to_lowercase();
            let Some(text) = listings.get(&block) else {
                return Err(bad(&key, "there is no such block".to_owned()));
            };
            let mut listing = listing(text, &mut names).map_err(|problem| bad(&key, problem))?;
            // A smaller record leaves out the last of the instructions that move it.
            if description.record < whole_record() && matches!(block, Block::Take | Block::Store) {
                leave_out(&mut listing, Operation::Load, loads);
                leave_out(&mut listing, Operation::Store, stores);
            }
            let count = |operation| listing.iter().filter(|one: &&Instruction| one.operation == operation).count();
            if (count(Operation::Load) + count(Operation::Texture), count(Operation::Store)) != (loads, stores) {
                return Err(bad(
                    &key,
                    format!("it does not have the {loads} loads and {stores} stores of these loops"),
                ));
            }
            blocks.insert(block, listing);
        }
        if names.len() > MAX_NAMES {
            return Err(bad("blocks", format!("{} registers, more than {MAX_NAMES}", names.len())));
        }
        let Description { name, registers, threads, shared, loops, record, .. } = description;
        Ok(Kernel { name, registers, threads, shared, loops, record, names: names.len(), blocks })
    }

    /// What a block asks of a multiprocessor.
    pub fn demand(&self) -> Demand {
        Demand { registers: self.registers, threads: self.threads, shared: self.shared }
    }

    /// Whether the texture units read the triangles.
    pub fn textured(&self) -> bool {
        self.block(Block::Triangle).iter().any(|instruction| instruction.operation == Operation::Texture)
    }

    /// Instructions of a block.
    pub fn block(&self, block: Block) -> &[Instruction] {
        self.blocks.get(&block).map_or(&[], Vec::as_slice)
    }

    /// Instructions of all blocks, in the order of the code, and where each block starts.
    pub fn code(&self) -> (Vec<Instruction>, [u32; Block::ALL.len() + 1]) {
        let mut code = Vec::new();
        let mut starts = [0; Block::ALL.len() + 1];
        for (i, block) in Block::ALL.into_iter().enumerate() {
            code.extend(self.block(block));
            starts[i + 1] = code.len() as u32;
        }
        (code, starts)
    }
}

/// Keeps the first `kept` instructions of `operation`.
fn leave_out(listing: &mut Vec<Instruction>, operation: Operation, kept: usize) {
    let mut seen = 0;
    listing.retain(|instruction| {
        seen += usize::from(instruction.operation == operation);
        instruction.operation != operation || seen <= kept
    });
}

/// Parses a listing: one instruction a line, `result = operation source source`, the result left out where
/// there is none; `#` starts a comment, `N x` at the start of a line repeats it.
fn listing(text: &str, names: &mut HashMap<String, u8>) -> Result<Vec<Instruction>, String> {
    let mut all = Vec::new();
    for line in text.lines() {
        let line = line.split('#').next().unwrap_or_default().trim();
        if line.is_empty() {
            continue;
        }
        let repeated = line.split_once(" x ").and_then(|(count, rest)| Some((count.parse::<usize>().ok()?, rest)));
        let (count, line) = repeated.unwrap_or((1, line));
        if count > MAX_REPEATS {
            return Err(format!("'{line}' is repeated more than {MAX_REPEATS} times"));
        }
        let (result, rest) = match line.split_once('=') {
            Some((result, rest)) => (Some(result.trim()), rest),
            None => (None, line),
        };
        let mut words = rest.split_whitespace();
        let word = words.next().ok_or_else(|| format!("'{line}' has no operation"))?;
        let operation = operation(word).ok_or_else(|| format!("'{line}': unknown operation '{word}'"))?;
        let mut register = |name: &str| -> Result<u8, String> {
            let next = names.len() + 1;
            let number = *names.entry(name.to_owned()).or_insert(next.min(255) as u8);
            Ok(number)
        };
        let mut sources = [0; 5];
        for (i, name) in words.enumerate() {
            *sources.get_mut(i).ok_or_else(|| format!("'{line}' has more than five sources"))? = register(name)?;
        }
        let destination = result.map_or(Ok(0), &mut register)?;
        all.extend(std::iter::repeat_n(Instruction { operation, destination, sources }, count));
    }
    Ok(all)
}

fn operation(word: &str) -> Option<Operation> {
    Some(match word {
        "mov" | "setp" | "selp" | "and" | "or" | "not" | "shl" | "shr" | "neg" | "abs" | "cvt" => Operation::Simple,
        "bra" | "ret" => Operation::Branch,
        "add" | "sub" => Operation::Add,
        "fma" => Operation::Fma,
        "min" | "max" => Operation::Minmax,
        "vmin" | "vmax" => Operation::Video,
        "mul" => Operation::Mul,
        "imul" => Operation::Imul,
        "imad" => Operation::Imad,
        "rcp" => Operation::Rcp,
        "lds" | "sts" => Operation::Shared,
        "ld" => Operation::Load,
        "tex" => Operation::Texture,
        "st" => Operation::Store,
        _ => return None,
    })
}
