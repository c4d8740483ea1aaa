//! The kernels, as handed to the driver, use no arithmetic whose rounding Vulkan leaves to the driver, and
//! forbid it to fuse or reorder the rest (Vulkan specification, Precision of Individual Operations).
#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

use std::collections::{BTreeSet, HashSet};

use caribou::vulkan::Kernel;
use rspirv::dr::{Function, Instruction, Module, Operand};
use rspirv::spirv::{Decoration, GlslStd450Op as GLOp, Op};

/// What `exact.glsl` corrects or uses where it was found to be exact: function, operation, numerators.
const CORRECTED: [(&str, Arithmetic); 5] = [
    ("exact_rcp", Arithmetic::Divide(1.0)),
    ("exact_rcp", Arithmetic::Extended(GLOp::Fma)),
    ("exact_sqrt", Arithmetic::Extended(GLOp::Sqrt)),
    ("exact_sqrt", Arithmetic::Extended(GLOp::Fma)),
    ("product_error", Arithmetic::Extended(GLOp::Fma)),
];

/// Exempt besides: the divisor of a Newton step, whose error the step itself forgives.
const FORGIVEN: (&str, Arithmetic) = ("exact_sqrt", Arithmetic::Divide(0.5));

/// An operation on floating-point numbers that is not correctly rounded everywhere.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Arithmetic {
    /// Division of a constant; NaN for any other numerator.
    Divide(f32),
    /// From GLSL.std.450.
    Extended(GLOp),
    /// Any other instruction.
    Core(Op),
}

#[test]
fn kernels_use_no_arithmetic_that_drivers_round_as_they_like() {
    for &kernel in kernels_with_results() {
        let module = load(kernel);
        for instruction in &module.types_global_values {
            let folded =
                instruction.class.opcode == Op::SpecConstantOp && is_float(&module, instruction.result_type.unwrap());
            assert!(!folded, "{}: {instruction:?} is folded by the driver", kernel.name());
        }
        for function in &module.functions {
            let name = function_name(&module, function);
            for found in function.all_inst_iter().filter_map(|i| inexact(&module, i)) {
                let allowed = CORRECTED.contains(&(&name, found)) || FORGIVEN == (&name, found);
                assert!(allowed, "{}: {found:?} in {name}", kernel.name());
            }
        }
    }
}

#[test]
fn every_exemption_is_needed() {
    let mut found = Vec::new();
    for &kernel in kernels_with_results() {
        let module = load(kernel);
        for function in &module.functions {
            let name = function_name(&module, function);
            found.extend(function.all_inst_iter().filter_map(|i| Some((name.clone(), inexact(&module, i)?))));
        }
    }
    for (name, exempt) in CORRECTED.into_iter().chain([FORGIVEN]) {
        assert!(found.iter().any(|(f, a)| f == name && *a == exempt), "{exempt:?} in {name} is in no kernel");
    }
}

#[test]
fn drivers_may_fuse_or_reorder_no_arithmetic() {
    use Op::*;
    for &kernel in Kernel::ALL {
        let module = load(kernel);
        let no_contraction: HashSet<u32> = module
            .annotations
            .iter()
            .filter(|i| i.operands.get(1) == Some(&Operand::Decoration(Decoration::NoContraction)))
            .map(|i| i.operands[0].unwrap_id_ref())
            .collect();
        let is_arithmetic =
            |i: &&Instruction| matches!(i.class.opcode, FAdd | FSub | FMul | FDiv | FNegate | VectorTimesScalar);
        let mut operations = BTreeSet::new();
        for operation in module.all_inst_iter().filter(is_arithmetic) {
            let id = operation.result_id.unwrap();
            assert!(no_contraction.contains(&id), "{}: {:?} %{id}", kernel.name(), operation.class.opcode);
            operations.insert(operation.class.opcode as u32);
        }
        if kernel.name().starts_with("trace_") {
            assert!(operations.len() >= 4, "{}: the test sees the arithmetic", kernel.name());
        }
    }
}

/// Those whose results must be the same everywhere: all but the ones that ask what a driver does.
fn kernels_with_results() -> impl Iterator<Item = &'static Kernel> {
    Kernel::ALL.iter().filter(|kernel| !kernel.name().starts_with("probe_"))
}

fn load(kernel: Kernel) -> Module {
    rspirv::dr::load_bytes(kernel.spirv()).unwrap()
}

/// A function's name without the mangled parameters.
fn function_name(module: &Module, function: &Function) -> String {
    let id = function.def.as_ref().unwrap().result_id.unwrap();
    let name = module.debug_names.iter().find(|i| i.operands[0] == Operand::IdRef(id)).unwrap();
    let name = name.operands[1].unwrap_literal_string();
    name.split('(').next().unwrap().to_owned()
}

/// What `instruction` computes, if it computes a floating-point number and is not on the list of
/// operations that Vulkan demands to be exact or correctly rounded.
fn inexact(module: &Module, instruction: &Instruction) -> Option<Arithmetic> {
    use Op::*;
    if !instruction.result_type.is_some_and(|id| is_float(module, id)) {
        return None;
    }
    match instruction.class.opcode {
        FAdd | FSub | FMul | FNegate | VectorTimesScalar => None,
        ConvertUToF | ConvertSToF | Bitcast => None,
        Load | Select | Phi | CompositeExtract | CompositeConstruct | CompositeInsert | VectorShuffle => None,
        VectorExtractDynamic | FunctionCall | FunctionParameter | Function | Undef | CopyObject => None,
        FDiv => Some(Arithmetic::Divide(constant(module, instruction.operands[0].unwrap_id_ref()))),
        ExtInst => {
            let operation = GLOp::from_u32(instruction.operands[1].unwrap_literal_ext_inst_integer()).unwrap();
            let exact = matches!(
                operation,
                GLOp::FAbs | GLOp::FMin | GLOp::FMax | GLOp::FClamp | GLOp::Floor | GLOp::Ceil | GLOp::Trunc
            );
            (!exact).then_some(Arithmetic::Extended(operation))
        }
        other => Some(Arithmetic::Core(other)),
    }
}

fn defined(module: &Module, id: u32) -> Option<&Instruction> {
    module.types_global_values.iter().find(|i| i.result_id == Some(id))
}

fn is_float(module: &Module, id: u32) -> bool {
    let this = defined(module, id).unwrap();
    match this.class.opcode {
        Op::TypeFloat => true,
        Op::TypeVector | Op::TypeMatrix => is_float(module, this.operands[0].unwrap_id_ref()),
        _ => false,
    }
}

/// Value of a floating-point constant, NaN for anything else.
fn constant(module: &Module, id: u32) -> f32 {
    match defined(module, id) {
        Some(i) if i.class.opcode == Op::Constant => f32::from_bits(i.operands[0].unwrap_literal_bit32()),
        _ => f32::NAN,
    }
}
