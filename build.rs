//! Compiles `glsl/*.comp` to SPIR-V and turns the constants of `glsl/include/shared.glsl` into Rust.

use std::path::{Path, PathBuf};
use std::{env, fs};

#[path = "build/kernels.rs"]
mod kernels;

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
        kernels::compile(&kernel, Path::new("glsl/include"), &spirv);
    }
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
