//! How large a kernel is once its specialization constants have values: what a driver has left to compile.
//!
//! Constants are folded and blocks that no branch leads to any more are left out, as any driver does first (SPIR-V
//! specification, 2.12: specialization). It is a lower bound of what drivers leave out.

use std::collections::{HashMap, HashSet};

use super::Kernel;

/// Instructions of a kernel's functions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Size {
    /// The kernel.
    pub kernel: &'static str,
    /// Instructions that can be reached with the constants given.
    pub instructions: usize,
    /// All of them.
    pub of: usize,
}

/// Sizes of the kernels that know one of the specialization constants `constants`, pairs of number and value.
pub fn sizes(constants: &[(u32, u32)]) -> Vec<Size> {
    let size = |&kernel: &Kernel| {
        let module = Module::new(kernel.spirv());
        let knows = module.specialized.iter().any(|(_, number)| constants.iter().any(|(known, _)| known == number));
        let size = |constants| module.reachable(constants);
        knows.then(|| Size { kernel: kernel.name(), instructions: size(Some(constants)), of: size(None) })
    };
    Kernel::ALL.iter().filter_map(size).collect()
}

/// Opcodes of SPIR-V 1.6, section 3.49.
mod op {
    pub const ENTRY_POINT: u32 = 15;
    pub const CONSTANT_TRUE: u32 = 41;
    pub const CONSTANT_FALSE: u32 = 42;
    pub const CONSTANT: u32 = 43;
    pub const SPEC_CONSTANT_TRUE: u32 = 48;
    pub const SPEC_CONSTANT_FALSE: u32 = 49;
    pub const SPEC_CONSTANT: u32 = 50;
    pub const SPEC_CONSTANT_OP: u32 = 52;
    pub const FUNCTION: u32 = 54;
    pub const FUNCTION_CALL: u32 = 57;
    pub const DECORATE: u32 = 71;
    pub const LOGICAL_OR: u32 = 166;
    pub const LOGICAL_AND: u32 = 167;
    pub const LOGICAL_NOT: u32 = 168;
    pub const I_EQUAL: u32 = 170;
    pub const I_NOT_EQUAL: u32 = 171;
    pub const LABEL: u32 = 248;
    pub const BRANCH: u32 = 249;
    pub const BRANCH_CONDITIONAL: u32 = 250;
    pub const SWITCH: u32 = 251;
    pub const UNREACHABLE: u32 = 255;
}

/// Decoration of section 3.20.
const SPEC_ID: u32 = 1;

/// Words before the first instruction.
const HEADER: usize = 5;

struct Instruction {
    opcode: u32,
    operands: Vec<u32>,
}

/// A module, its instructions in order.
struct Module {
    instructions: Vec<Instruction>,
    /// Number of each specialization constant, by its id.
    specialized: Vec<(u32, u32)>,
    /// Where functions and blocks begin, by id.
    places: HashMap<u32, usize>,
}

impl Module {
    fn new(spirv: &[u8]) -> Module {
        let words: Vec<u32> =
            spirv.chunks_exact(4).map(|bytes| u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])).collect();
        let mut instructions = Vec::new();
        let mut at = HEADER;
        while at < words.len() {
            let (opcode, length) = (words[at] & 0xffff, (words[at] >> 16).max(1) as usize);
            instructions.push(Instruction { opcode, operands: words[at + 1..at + length].to_vec() });
            at += length;
        }
        let (mut specialized, mut places) = (Vec::new(), HashMap::new());
        for (at, Instruction { opcode, operands }) in instructions.iter().enumerate() {
            match (*opcode, &operands[..]) {
                (op::DECORATE, &[id, SPEC_ID, number]) => specialized.push((id, number)),
                (op::FUNCTION, &[_, id, ..]) | (op::LABEL, &[id]) => drop(places.insert(id, at)),
                _ => {}
            }
        }
        Module { instructions, specialized, places }
    }

    /// Instructions in blocks that can be reached; without `constants`, by any values of them.
    fn reachable(&self, constants: Option<&[(u32, u32)]>) -> usize {
        let mut values = self.values(constants);
        let mut count = 0;
        let mut seen: HashSet<u32> = HashSet::new();
        let mut next: Vec<u32> = Vec::new();
        for Instruction { opcode, operands } in &self.instructions {
            if *opcode == op::ENTRY_POINT {
                next.push(operands[1]);
            }
        }
        while let Some(id) = next.pop() {
            let Some(&place) = self.places.get(&id).filter(|_| seen.insert(id)) else { continue };
            // A function's first block begins after its parameters.
            let is_function = self.instructions[place].opcode == op::FUNCTION;
            let label = self.instructions[place..].iter().position(|i| i.opcode == op::LABEL).unwrap_or(0);
            if is_function {
                next.push(self.instructions[place + label].operands[0]);
                continue;
            }
            for Instruction { opcode, operands } in &self.instructions[place + 1..] {
                count += 1;
                match (*opcode, &operands[..]) {
                    (op::FUNCTION_CALL, &[_, _, function, ..]) => next.push(function),
                    (op::BRANCH, &[target]) => next.push(target),
                    (op::BRANCH_CONDITIONAL, &[condition, yes, no, ..]) => match values.get(&condition) {
                        Some(&value) => next.push(if value != 0 { yes } else { no }),
                        None => next.extend([yes, no]),
                    },
                    (op::SWITCH, [_, default, cases @ ..]) => {
                        next.push(*default);
                        next.extend(cases.chunks_exact(2).map(|case| case[1]));
                    }
                    (opcode, &[_, id, ref operands @ ..]) => {
                        if let Some(value) = folded(opcode, operands, &values) {
                            values.insert(id, value);
                        }
                    }
                    _ => {}
                }
                // From branches to returns, all end a block.
                if (op::BRANCH..=op::UNREACHABLE).contains(opcode) {
                    break;
                }
            }
        }
        count
    }

    /// Values of constants, by id.
    fn values(&self, constants: Option<&[(u32, u32)]>) -> HashMap<u32, u32> {
        let numbers: HashMap<u32, u32> = self.specialized.iter().copied().collect();
        let mut values = HashMap::new();
        for Instruction { opcode, operands } in &self.instructions {
            let &[_, id, ref rest @ ..] = &operands[..] else { continue };
            let given = |default: u32| {
                let given = constants?.iter().find(|(number, _)| Some(number) == numbers.get(&id));
                Some(given.map_or(default, |&(_, value)| value))
            };
            let value = match (*opcode, rest) {
                (op::CONSTANT_TRUE, _) => Some(1),
                (op::CONSTANT_FALSE, _) => Some(0),
                (op::CONSTANT, &[value]) => Some(value),
                (op::SPEC_CONSTANT_TRUE, _) => given(1),
                (op::SPEC_CONSTANT_FALSE, _) => given(0),
                (op::SPEC_CONSTANT, &[value]) => given(value),
                (op::SPEC_CONSTANT_OP, [opcode, operands @ ..]) => folded(*opcode, operands, &values),
                _ => None,
            };
            values.extend(value.map(|value| (id, value)));
        }
        values
    }
}

/// The result of an operation of constants, among those that conditions are made of.
fn folded(opcode: u32, operands: &[u32], values: &HashMap<u32, u32>) -> Option<u32> {
    let value = |k: usize| operands.get(k).and_then(|id| values.get(id)).copied();
    let truth = match opcode {
        op::LOGICAL_NOT => value(0)? == 0,
        // One operand can be enough.
        op::LOGICAL_AND if value(0) == Some(0) || value(1) == Some(0) => false,
        op::LOGICAL_OR if value(0) == Some(1) || value(1) == Some(1) => true,
        op::LOGICAL_AND | op::LOGICAL_OR => value(0)? & value(1)? != 0,
        op::I_EQUAL => value(0)? == value(1)?,
        op::I_NOT_EQUAL => value(0)? != value(1)?,
        _ => return None,
    };
    Some(truth.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::features::{Features, Indirect};

    const ALL: Features = Features {
        normals: true,
        textures: true,
        mirrors: true,
        glass: true,
        emission: true,
        unlit: true,
        indirect: Indirect::Diffuse,
    };

    fn of_shade(features: Features) -> Size {
        sizes(&features.specialization()).into_iter().find(|size| size.kernel == "shade").unwrap()
    }

    #[test]
    fn each_feature_that_a_scene_does_not_need_makes_a_kernel_smaller() {
        let without = [
            Features { normals: false, ..ALL },
            Features { textures: false, ..ALL },
            Features { mirrors: false, ..ALL },
            Features { glass: false, ..ALL },
            Features { emission: false, ..ALL },
            Features { unlit: false, ..ALL },
            Features { indirect: Indirect::None, ..ALL },
        ];
        let all: usize = sizes(&ALL.specialization()).iter().map(|size| size.instructions).sum();
        for features in without {
            let rest: usize = sizes(&features.specialization()).iter().map(|size| size.instructions).sum();
            assert!(rest < all, "{features:?}: {rest} of {all}");
        }
        let (full, glassless) = (of_shade(ALL), of_shade(Features { glass: false, ..ALL }));
        assert!(glassless.instructions < full.instructions && full.instructions <= full.of && full.of == glassless.of);
    }

    #[test]
    fn kernels_that_know_no_feature_are_not_listed() {
        let names: Vec<&str> = sizes(&ALL.specialization()).iter().map(|size| size.kernel).collect();
        assert!(names.contains(&"shade") && !names.contains(&"probe_loop"), "{names:?}");
        assert!(sizes(&[]).is_empty());
    }

    #[test]
    fn conditions_of_constants_are_folded() {
        let values = HashMap::from([(1, 0), (2, 1), (3, 7)]);
        assert_eq!(folded(op::LOGICAL_AND, &[1, 99], &values), Some(0));
        assert_eq!(folded(op::LOGICAL_AND, &[2, 99], &values), None);
        assert_eq!(folded(op::LOGICAL_OR, &[99, 2], &values), Some(1));
        assert_eq!(folded(op::LOGICAL_NOT, &[1], &values), Some(1));
        assert_eq!(folded(op::I_NOT_EQUAL, &[2, 3], &values), Some(1));
        assert_eq!(folded(op::I_EQUAL, &[3, 3], &values), Some(1));
    }
}
