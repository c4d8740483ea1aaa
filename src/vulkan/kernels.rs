//! The one table of kernels. To add one, put `NAME.comp` in `glsl/` and a line here; a test compares
//! the line with the SPIR-V.

use std::path::{Path, PathBuf};

/// What a kernel takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Interface {
    /// Buffers: bindings 0, 1, ... of set 0.
    pub bindings: u32,
    /// Those that are read as texels of four 32-bit integers; the others are storage buffers.
    pub texels: &'static [u32],
    /// Bytes of push constants.
    pub push_bytes: u32,
    /// Invocations a workgroup (in x).
    pub local_size: u32,
}

macro_rules! kernels {
    ($(
        $variant:ident: $file:literal, $bindings:literal, $texels:expr, $push_bytes:literal, $local_size:literal;
    )*) => {
        /// A compute kernel of this program.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum Kernel {
            $(#[doc = concat!("`glsl/", $file, ".comp`")] $variant,)*
        }

        impl Kernel {
            /// All kernels, in the table's order.
            pub const ALL: &[Kernel] = &[$(Kernel::$variant),*];

            /// Name of the kernel's file, without extension.
            pub const fn name(self) -> &'static str {
                match self { $(Kernel::$variant => $file,)* }
            }

            /// Where a file that stands in for the built-in kernel would be.
            pub fn file_in(self, folder: &Path) -> PathBuf {
                folder.join(self.name()).with_extension("spv")
            }

            /// What the kernel takes.
            pub const fn interface(self) -> Interface {
                match self {
                    $(Kernel::$variant => Interface {
                        bindings: $bindings, texels: &$texels, push_bytes: $push_bytes, local_size: $local_size,
                    },)*
                }
            }

            /// The kernel as it is handed to the driver, so that tests can read it.
            pub const fn spirv(self) -> &'static [u8] {
                match self {
                    $(Kernel::$variant => include_bytes!(concat!(env!("OUT_DIR"), "/", $file, ".spv")),)*
                }
            }
        }
    };
}

#[rustfmt::skip]
kernels! {
    // variant           file                    bindings  texels      push bytes  workgroup
    ProbeArithmetic:    "probe_arithmetic",     2,        [],         0,          64;
    ProbeLoop:          "probe_loop",           2,        [],         0,          32;
    VerifyExact:        "verify_exact",         2,        [],         8,          256;
    Direct:             "direct",               7,        [],         56,         32;
    DirectCpu:          "direct_cpu",           8,        [0, 7],     56,         32;
    DirectQuantised:    "direct_quantised",     7,        [],         56,         32;
    DirectQuantisedCpu: "direct_quantised_cpu", 8,        [0, 7],     56,         32;
    Persistent:         "persistent",           7,        [],         56,         32;
    PersistentCpu:      "persistent_cpu",       8,        [0, 7],     56,         32;
    Schedule:           "schedule",             8,        [],         112,        32;
    ScheduleCpu:        "schedule_cpu",         9,        [0, 8],     112,        32;
    Migrate:            "migrate",              8,        [],         112,        1; // a specialization constant
    MigrateCpu:         "migrate_cpu",          11,       [0, 8, 9, 10], 112,        1;
    MigrateSm:          "migrate_sm",           8,        [],         112,        1;
    QueueCount:         "queue_count",          3,        [],         20,         32;
    QueuePrefix:        "queue_prefix",         3,        [],         20,         256;
    QueueScatter:       "queue_scatter",        4,        [],         20,         32;
    QueueShares:        "queue_shares",         4,        [],         20,         32;
    VirtualL1:          "virtual_l1",           7,        [],         88,         32;
    Generate:           "generate",             4,        [],         16,         32;
    Light:              "light",                10,       [],         16,         32;
    Gather:             "gather",               5,        [],         16,         32;
    Shade:              "shade",                7,        [],         16,         32;
    Resolve:            "resolve",              4,        [],         16,         32;
    Aov:                "aov",                  7,        [],         16,         32;
    Secondary:          "secondary",            6,        [],         16,         32;
}

/// Most bindings of any kernel.
pub(super) const MAX_BINDINGS: u32 = {
    let (mut most, mut i) = (0, 0);
    while i < Kernel::ALL.len() {
        let bindings = Kernel::ALL[i].interface().bindings;
        most = if bindings > most { bindings } else { most };
        i += 1;
    }
    most
};

#[cfg(test)]
mod tests {
    use rspirv::dr::{Instruction, Module, Operand};
    use rspirv::spirv::{Decoration, ExecutionMode, Op, StorageClass};

    use super::{Interface, Kernel};

    #[test]
    fn the_table_says_what_the_spirv_says() {
        for &kernel in Kernel::ALL {
            let module = rspirv::dr::load_bytes(kernel.spirv()).unwrap();
            assert_eq!(kernel.interface(), reflect(&module), "{}", kernel.name());
        }
    }

    fn reflect(module: &Module) -> Interface {
        let mode = |i: &&Instruction| i.operands[1] == Operand::ExecutionMode(ExecutionMode::LocalSize);
        let size = &module.execution_modes.iter().find(mode).expect("a fixed workgroup size").operands[2..];
        assert_eq!(&size[1..], [Operand::LiteralBit32(1), Operand::LiteralBit32(1)], "workgroups are lines");
        let mut bindings: Vec<u32> = decorated(module, Decoration::Binding).map(|(_, value)| value).collect();
        bindings.sort_unstable();
        assert_eq!(bindings, Vec::from_iter(0..bindings.len() as u32), "bindings are 0, 1, ...");
        assert!(decorated(module, Decoration::DescriptorSet).all(|(_, set)| set == 0), "there is one set");
        let of_class = |class: StorageClass| -> Vec<u32> {
            let is_of_class = |id: u32| {
                let of_class = |i: &Instruction| i.operands[0] == Operand::StorageClass(class);
                module.types_global_values.iter().any(|i| i.result_id == Some(id) && of_class(i))
            };
            decorated(module, Decoration::Binding).filter(|&(id, _)| is_of_class(id)).map(|(_, at)| at).collect()
        };
        let (storage, mut texels) = (of_class(StorageClass::StorageBuffer), of_class(StorageClass::UniformConstant));
        texels.sort_unstable();
        assert_eq!(storage.len() + texels.len(), bindings.len(), "every binding is a storage or a texel buffer");
        Interface {
            bindings: bindings.len() as u32,
            texels: texels.leak(),
            push_bytes: push_bytes(module),
            local_size: size[0].unwrap_literal_bit32(),
        }
    }

    /// Ids with a decoration that has one number, and the number.
    fn decorated(module: &Module, wanted: Decoration) -> impl Iterator<Item = (u32, u32)> {
        module.annotations.iter().filter_map(move |i| match i.operands[..] {
            [Operand::IdRef(id), Operand::Decoration(found), Operand::LiteralBit32(value)] if found == wanted => {
                Some((id, value))
            }
            _ => None,
        })
    }

    /// The end of the last member of the push-constant block, rounded up to 4 bytes.
    fn push_bytes(module: &Module) -> u32 {
        let defined = |id: u32| module.types_global_values.iter().find(|i| i.result_id == Some(id)).unwrap();
        let Some(pointer) = module.types_global_values.iter().find(|i| {
            i.class.opcode == Op::TypePointer
                && i.operands[0] == Operand::StorageClass(StorageClass::PushConstant)
                && defined(i.operands[1].unwrap_id_ref()).class.opcode == Op::TypeStruct
        }) else {
            return 0;
        };
        let block = pointer.operands[1].unwrap_id_ref();
        let offset = |member: u32| {
            let is_offset = |i: &&rspirv::dr::Instruction| {
                i.class.opcode == Op::MemberDecorate
                    && i.operands[..3]
                        == [
                            Operand::IdRef(block),
                            Operand::LiteralBit32(member),
                            Operand::Decoration(Decoration::Offset),
                        ]
            };
            module.annotations.iter().find(is_offset).unwrap().operands[3].unwrap_literal_bit32()
        };
        let size = |id: u32| -> u32 {
            let scalar = |i: &rspirv::dr::Instruction| match i.class.opcode {
                Op::TypeInt | Op::TypeFloat => i.operands[0].unwrap_literal_bit32() / 8,
                Op::TypePointer => 8,
                other => panic!("a push constant of type {other:?}: teach it to this test"),
            };
            let this = defined(id);
            match this.class.opcode {
                Op::TypeVector => {
                    scalar(defined(this.operands[0].unwrap_id_ref())) * this.operands[1].unwrap_literal_bit32()
                }
                _ => scalar(this),
            }
        };
        (0..)
            .zip(&defined(block).operands)
            .map(|(i, member)| offset(i) + size(member.unwrap_id_ref()))
            .max()
            .unwrap_or(0)
    }
}
