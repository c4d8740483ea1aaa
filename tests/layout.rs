//! The structs of `caribou::layout` have the names, offsets and sizes of the compiled kernels' structs.
#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

use std::collections::{BTreeSet, HashMap};

use caribou::layout::{SharedStruct, shared_structs};
use caribou::vulkan::Kernel;
use rspirv::dr::{Module, Operand};
use rspirv::spirv::{Decoration, Op};

/// A struct in memory, as a kernel has it.
#[derive(Debug)]
struct Reflected {
    name: String,
    /// A buffer's or push constants' own struct.
    is_block: bool,
    /// Name, offset and bytes.
    members: Vec<(String, usize, usize)>,
    /// Bytes from one to the next in arrays.
    strides: BTreeSet<usize>,
}

#[test]
fn shared_structs_have_the_layout_of_the_kernels() {
    let mut seen = BTreeSet::new();
    for &kernel in Kernel::ALL {
        for found in structs(&rspirv::dr::load_bytes(kernel.spirv()).unwrap()) {
            if !found.is_block
                && let Some(name) = found.name.strip_suffix("Words")
            {
                assert_same_memory(kernel, &found, name);
                continue;
            }
            let Some(&SharedStruct { name, bytes, fields }) = shared_structs().find(|shared| shared.name == found.name)
            else {
                // The probes' cases are shared with the probe alone.
                let own = found.is_block || kernel.name().starts_with("probe_");
                assert!(own, "{}: struct {} is not in caribou::layout", kernel.name(), found.name);
                continue;
            };
            let context = format!("{}: {name}", kernel.name());
            let members: Vec<(&str, usize)> = found.members.iter().map(|m| (m.0.as_str(), m.1)).collect();
            assert_eq!(members, fields, "{context}: names and offsets");
            let end = found.members.iter().map(|m| m.1 + m.2).max();
            assert_eq!(end, Some(bytes), "{context}: end of the last member");
            assert!(found.strides.iter().all(|&stride| stride == bytes), "{context}: {bytes} bytes, {found:?}");
            seen.insert(name);
        }
    }
    let all: BTreeSet<&str> = shared_structs().map(|shared| shared.name).collect();
    assert_eq!(seen, all, "every shared struct is in a kernel");
}

/// A `NAMEWords` has the fields of `NAME`, several of them loaded as one.
fn assert_same_memory(kernel: Kernel, found: &Reflected, name: &str) {
    let context = format!("{}: {found:?}", kernel.name());
    let &SharedStruct { bytes, fields, .. } = shared_structs().find(|shared| shared.name == name).expect(&context);
    assert!(found.members.iter().all(|m| fields.contains(&(m.0.as_str(), m.1))), "{context}: names and offsets");
    let end = found.members.iter().map(|m| m.1 + m.2).max();
    assert!(end == Some(bytes) && found.strides.iter().eq([&bytes]), "{context}: {bytes} bytes");
}

/// Structs with a memory layout: glslang keeps another copy, without offsets, for those in registers.
fn structs(module: &Module) -> Vec<Reflected> {
    let names = names(module);
    let mut strides: HashMap<u32, BTreeSet<usize>> = HashMap::new();
    for array in &module.types_global_values {
        if matches!(array.class.opcode, Op::TypeArray | Op::TypeRuntimeArray) {
            let stride = decoration(module, array.result_id.unwrap(), Decoration::ArrayStride);
            let element = array.operands[0].unwrap_id_ref();
            strides.entry(element).or_default().extend(stride);
        }
    }
    let is_struct = |i: &&rspirv::dr::Instruction| i.class.opcode == Op::TypeStruct;
    module
        .types_global_values
        .iter()
        .filter(is_struct)
        .filter_map(|found| {
            let id = found.result_id.unwrap();
            let member = |(k, operand): (u32, &Operand)| {
                let offset = member_offset(module, id, k)?;
                Some((names[&(id, Some(k))].clone(), offset, bytes(module, operand.unwrap_id_ref())))
            };
            Some(Reflected {
                name: names[&(id, None)].clone(),
                is_block: module
                    .annotations
                    .iter()
                    .any(|i| i.operands == [Operand::IdRef(id), Operand::Decoration(Decoration::Block)]),
                members: (0..).zip(&found.operands).map(member).collect::<Option<_>>()?,
                strides: strides.remove(&id).unwrap_or_default(),
            })
        })
        .collect()
}

/// Names of ids, and of the members of struct ids.
fn names(module: &Module) -> HashMap<(u32, Option<u32>), String> {
    let name = |i: &rspirv::dr::Instruction| match &i.operands[..] {
        [Operand::IdRef(id), Operand::LiteralString(name)] => Some(((*id, None), name.clone())),
        [Operand::IdRef(id), Operand::LiteralBit32(member), Operand::LiteralString(name)] => {
            Some(((*id, Some(*member)), name.clone()))
        }
        _ => None,
    };
    module.debug_names.iter().filter_map(name).collect()
}

fn decoration(module: &Module, id: u32, wanted: Decoration) -> Option<usize> {
    module.annotations.iter().find_map(|i| match i.operands[..] {
        [Operand::IdRef(of), Operand::Decoration(found), Operand::LiteralBit32(value)]
            if of == id && found == wanted =>
        {
            Some(value as usize)
        }
        _ => None,
    })
}

fn member_offset(module: &Module, id: u32, member: u32) -> Option<usize> {
    let place = [Operand::IdRef(id), Operand::LiteralBit32(member), Operand::Decoration(Decoration::Offset)];
    module.annotations.iter().find_map(|i| match &i.operands[..] {
        [start @ .., Operand::LiteralBit32(offset)] if start == place => Some(*offset as usize),
        _ => None,
    })
}

/// Size of a scalar, a vector, or a struct of them; what else there is in a shared struct would be a surprise.
fn bytes(module: &Module, id: u32) -> usize {
    let this = module.types_global_values.iter().find(|i| i.result_id == Some(id)).unwrap();
    match this.class.opcode {
        Op::TypeInt | Op::TypeFloat => this.operands[0].unwrap_literal_bit32() as usize / 8,
        Op::TypeVector => {
            bytes(module, this.operands[0].unwrap_id_ref()) * this.operands[1].unwrap_literal_bit32() as usize
        }
        Op::TypeStruct => (0..)
            .zip(&this.operands)
            .filter_map(|(k, member)| Some(member_offset(module, id, k)? + bytes(module, member.unwrap_id_ref())))
            .max()
            .unwrap_or(0),
        _ => 0,
    }
}
