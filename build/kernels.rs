//! From a kernel's GLSL to its SPIR-V. Also a module of tests that plant faults in kernels.

use std::path::Path;
use std::process::Command;
use std::{env, fs};

use rspirv::binary::Assemble;
use rspirv::dr::{Instruction, Module, Operand};
use rspirv::spirv::{Decoration, Op};

/// Runs `glslangValidator`, whose messages become the build's, and makes the result's arithmetic exact.
pub fn compile(kernel: &Path, includes: &Path, spirv: &Path) {
    let compiler = env::var("GLSLANG_VALIDATOR").unwrap_or_else(|_| "glslangValidator".into());
    let result = Command::new(&compiler)
        .args(["--quiet", "-V", "--target-env", "vulkan1.2"])
        .arg(format!("-I{}", includes.display()))
        .arg("-o")
        .arg(spirv)
        .arg(kernel)
        .output();
    match result {
        Err(error) => panic!(
            "cannot run {compiler} ({error}): install it (Debian, Ubuntu: apt-get install glslang-tools; \
             Fedora: glslang; macOS: brew install glslang) or set GLSLANG_VALIDATOR to its path"
        ),
        Ok(output) if !output.status.success() => {
            panic!("{}:\n{}", kernel.display(), String::from_utf8_lossy(&output.stdout))
        }
        Ok(_) => fs::write(spirv, exact(&fs::read(spirv).expect("just written"))).expect("its folder is writable"),
    }
}

/// Decorates the result of every floating-point operation with `NoContraction`, so that no driver may
/// fuse or reorder it: what `precise` does for one variable, for all, with nothing to forget.
fn exact(spirv: &[u8]) -> Vec<u8> {
    let mut module: Module = rspirv::dr::load_bytes(spirv).expect("glslangValidator writes valid SPIR-V");
    let results: Vec<u32> =
        module.all_inst_iter().filter(|i| is_float_arithmetic(i.class.opcode)).filter_map(|i| i.result_id).collect();
    let decorated: std::collections::HashSet<u32> = module
        .annotations
        .iter()
        .filter(|a| a.operands.contains(&Operand::Decoration(Decoration::NoContraction)))
        .filter_map(|a| a.operands.first()?.id_ref_any())
        .collect();
    module.annotations.extend(results.into_iter().filter(|id| !decorated.contains(id)).map(|id| {
        let operands = vec![Operand::IdRef(id), Operand::Decoration(Decoration::NoContraction)];
        Instruction::new(Op::Decorate, None, None, operands)
    }));
    module.assemble().into_iter().flat_map(u32::to_le_bytes).collect()
}

fn is_float_arithmetic(op: Op) -> bool {
    use Op::*;
    matches!(op, FAdd | FSub | FMul | FDiv | FNegate | FRem | FMod | VectorTimesScalar)
}
