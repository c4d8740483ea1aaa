//! Compiles `glsl/*.comp` to SPIR-V and turns the constants of `glsl/include/shared.glsl` into Rust.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

use rspirv::binary::Assemble;
use rspirv::dr::{Instruction, Module, Operand};
use rspirv::spirv::{Decoration, Op};

fn main() {
    println!("cargo::rerun-if-changed=glsl");
    println!("cargo::rerun-if-env-changed=GLSLANG_VALIDATOR");
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    shared_constants(Path::new("glsl/include/shared.glsl"), &out.join("shared.rs"));
    let mut kernels: Vec<PathBuf> = fs::read_dir("glsl")
        .expect("the folder glsl is part of the package")
        .map(|entry| entry.expect("glsl is readable").path())
        .filter(|path| path.extension().is_some_and(|e| e == "comp"))
        .collect();
    kernels.sort();
    for kernel in kernels {
        let spirv = out.join(kernel.file_name().expect("a .comp file has a name")).with_extension("spv");
        compile(&kernel, &spirv);
        fs::write(&spirv, exact(&fs::read(&spirv).expect("just written"))).expect("OUT_DIR is writable");
    }
}

/// Runs `glslangValidator`; its messages become the build's.
fn compile(kernel: &Path, spirv: &Path) {
    let compiler = env::var("GLSLANG_VALIDATOR").unwrap_or_else(|_| "glslangValidator".into());
    let result = Command::new(&compiler)
        .args(["--quiet", "-V", "--target-env", "vulkan1.2", "-Iglsl/include", "-o"])
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
        Ok(_) => {}
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

/// `const uint NAME = value;` and `const float NAME = value;` become `pub const NAME: u32|f32 = value;`,
/// the comment lines above each become its documentation.
fn shared_constants(source: &Path, target: &Path) {
    let text = fs::read_to_string(source).expect("glsl/include/shared.glsl is part of the package");
    let mut rust = String::new();
    let mut comment = String::new();
    for line in text.lines() {
        if let Some(words) = line.strip_prefix("//") {
            comment += &format!("/// {}\n", words.trim());
        } else if let Some(rest) = line.strip_prefix("const ") {
            let (declaration, _) = rest.split_once(';').expect("a constant ends with ;");
            let (kind, rest) = declaration.split_once(' ').expect("a constant has a type");
            let (name, value) = rest.split_once(" = ").expect("a constant has a value");
            let (kind, value) = match kind {
                "uint" => ("u32", value.trim_end_matches('u').to_string()),
                "float" => ("f32", value.to_string()),
                other => panic!("shared.glsl: constants of type {other} are not known to build.rs"),
            };
            if comment.is_empty() {
                comment = format!("/// See `{name}` in glsl/include/shared.glsl.\n");
            }
            rust += &format!("{comment}pub const {name}: {kind} = {value};\n");
            comment.clear();
        } else {
            comment.clear();
        }
    }
    fs::write(target, rust).expect("OUT_DIR is writable");
}
