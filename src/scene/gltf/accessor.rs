//! Typed reading of accessors (glTF 2.0, section 3.6.2): strided, zero-filled and sparse. Everything
//! that a read relies on is checked for all accessors beforehand, in 64 bits.

use gltf::json::accessor::{Accessor, ComponentType, Type};
use gltf::json::validation::Checked;
use gltf::json::{Index, Root, buffer};

use super::buffers::Buffers;
use super::source::Source;
use crate::Result;

/// An accessor without a bufferView costs no bytes in the file, so its size needs a bound of its own.
const MAX_ZERO_FILLED: u64 = 1 << 22;
/// Size of the largest element that is ever read, a VEC3 of FLOAT.
const LARGEST_READ: usize = 12;

/// Reads accessors; each lies inside its buffer views.
pub(super) struct Accessors<'a> {
    source: Source<'a>,
    root: &'a Root,
    buffers: &'a Buffers<'a>,
}

impl<'a> Accessors<'a> {
    /// Checks all accessors.
    pub fn new(source: Source<'a>, root: &'a Root, buffers: &'a Buffers<'a>) -> Result<Self> {
        let accessors = Accessors { source, root, buffers };
        for (i, accessor) in root.accessors.iter().enumerate() {
            check(root, accessor).map_err(|problem| {
                let remedy = "the accessor does not describe its data: export the scene again";
                source.fault(format!("accessor {i}"), problem, remedy)
            })?;
        }
        Ok(accessors)
    }

    /// Number of elements.
    pub fn count(&self, index: Index<Accessor>) -> u64 {
        self.root.accessors[index.value()].count.0
    }

    /// Positions or normals: VEC3 of FLOAT. `what` is the attribute's name for messages.
    pub fn vec3(&self, index: Index<Accessor>, what: &str) -> Result<Vec<[f32; 3]>> {
        self.expect(index, what, Type::Vec3, &[ComponentType::F32])?;
        self.read(index, 12, floats::<3>)
    }

    /// Texture coordinates: VEC2 of FLOAT, or of normalised UNSIGNED_BYTE or UNSIGNED_SHORT.
    pub fn vec2(&self, index: Index<Accessor>, what: &str) -> Result<Vec<[f32; 2]>> {
        use ComponentType::{F32, U8, U16};
        match self.expect(index, what, Type::Vec2, &[F32, U8, U16])? {
            U8 => self.read(index, 2, |b| [f32::from(b[0]) / 255.0, f32::from(b[1]) / 255.0]),
            U16 => self.read(index, 4, |b| {
                let normalised = |i: usize| f32::from(u16::from_le_bytes([b[i], b[i + 1]])) / 65535.0;
                [normalised(0), normalised(2)]
            }),
            _ => self.read(index, 8, floats::<2>),
        }
    }

    /// Vertex indices: SCALAR of an unsigned type.
    pub fn indices(&self, index: Index<Accessor>) -> Result<Vec<u32>> {
        use ComponentType::{U8, U16, U32};
        match self.expect(index, "indices", Type::Scalar, &[U8, U16, U32])? {
            U8 => self.read(index, 1, |b| u32::from(b[0])),
            U16 => self.read(index, 2, |b| u32::from(u16::from_le_bytes([b[0], b[1]]))),
            _ => self.read(index, 4, |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        }
    }

    /// The accessor's component type, if it and the element type are right for `what`.
    fn expect(
        &self,
        index: Index<Accessor>,
        what: &str,
        wanted: Type,
        components: &[ComponentType],
    ) -> Result<ComponentType> {
        match kind(&self.root.accessors[index.value()]) {
            Ok((kind, component)) if kind == wanted && components.contains(&component) => Ok(component),
            _ => Err(self.source.fault(
                format!("accessor {}", index.value()),
                format!("is used for {what}, which must be {wanted:?} of {components:?}"),
                "export the scene again",
            )),
        }
    }

    /// Decodes every element; `decode` gets exactly an element's `size` bytes.
    fn read<T: Copy>(&self, index: Index<Accessor>, size: usize, decode: impl Fn(&[u8]) -> T) -> Result<Vec<T>> {
        let accessor = &self.root.accessors[index.value()];
        let count = accessor.count.0 as usize;
        let mut elements = match accessor.buffer_view {
            None => vec![decode(&[0; LARGEST_READ][..size]); count],
            Some(view) => {
                let stride = self.root.buffer_views[view.value()].byte_stride.map_or(size, |s| s.0);
                let start = accessor.byte_offset.map_or(0, |o| o.0) as usize;
                let bytes = &self.buffers.view(view)[start..start + stride * (count - 1) + size];
                bytes.chunks(stride).map(|element| decode(&element[..size])).collect()
            }
        };

        let Some(sparse) = &accessor.sparse else { return Ok(elements) };
        let Checked::Valid(index_type) = sparse.indices.component_type else {
            return Ok(elements); // cannot happen: `check` has refused it
        };
        let index_bytes = component_bytes(index_type.0) as usize;
        let positions = &self.buffers.view(sparse.indices.buffer_view)[sparse.indices.byte_offset.0 as usize..];
        let values = &self.buffers.view(sparse.values.buffer_view)[sparse.values.byte_offset.0 as usize..];
        let replaced = positions.chunks(index_bytes).zip(values.chunks(size)).take(sparse.count.0 as usize);
        for (position, value) in replaced {
            let mut word = [0; 4];
            word[..index_bytes].copy_from_slice(position);
            let position = u32::from_le_bytes(word);
            let Some(element) = elements.get_mut(position as usize) else {
                return Err(self.source.fault(
                    format!("accessor {}", index.value()),
                    format!("its sparse part replaces element {position} of {count}"),
                    "export the scene again",
                ));
            };
            *element = decode(value);
        }
        Ok(elements)
    }
}

fn floats<const N: usize>(bytes: &[u8]) -> [f32; N] {
    std::array::from_fn(|i| f32::from_le_bytes([bytes[4 * i], bytes[4 * i + 1], bytes[4 * i + 2], bytes[4 * i + 3]]))
}

/// Types are known, counts are not zero, and all parts lie inside their buffer views.
fn check(root: &Root, accessor: &Accessor) -> Result<(), String> {
    let (kind, component) = kind(accessor)?;
    let size = element_bytes(kind, component);
    let count = accessor.count.0;
    if count == 0 {
        return Err("count is 0".into());
    }
    match accessor.buffer_view {
        Some(view) => {
            let offset = accessor.byte_offset.map_or(0, |o| o.0);
            check_span(root, view, offset, count, size)?;
        }
        None if count > MAX_ZERO_FILLED => {
            return Err(format!("count is {count} without a bufferView, more than {MAX_ZERO_FILLED}"));
        }
        None => {}
    }
    let Some(sparse) = &accessor.sparse else { return Ok(()) };
    let Checked::Valid(index_type) = sparse.indices.component_type else {
        return Err("the componentType of its sparse indices is not an unsigned integer".into());
    };
    if sparse.count.0 == 0 || sparse.count.0 > count {
        return Err(format!("its sparse count is {} of {count} elements", sparse.count.0));
    }
    let index_bytes = component_bytes(index_type.0);
    check_packed(root, sparse.indices.buffer_view, sparse.indices.byte_offset.0, sparse.count.0, index_bytes)?;
    check_packed(root, sparse.values.buffer_view, sparse.values.byte_offset.0, sparse.count.0, size)
}

/// As [`check_span`], for the parts of sparse accessors, whose buffer views have no stride.
fn check_packed(root: &Root, view: Index<buffer::View>, offset: u64, count: u64, size: u64) -> Result<(), String> {
    match root.buffer_views.get(view.value()) {
        Some(v) if v.byte_stride.is_some() => {
            Err(format!("its sparse part uses bufferView {} with a byteStride", view.value()))
        }
        _ => check_span(root, view, offset, count, size),
    }
}

/// `count` elements of `size` bytes from `offset` fit the buffer view at its stride.
fn check_span(root: &Root, view: Index<buffer::View>, offset: u64, count: u64, size: u64) -> Result<(), String> {
    let index = view.value();
    let Some(view) = root.buffer_views.get(index) else {
        return Err(format!("refers to bufferView {index}, but the file has {} of them", root.buffer_views.len()));
    };
    let stride = view.byte_stride.map_or(size, |s| s.0 as u64);
    if stride < size {
        return Err(format!("its elements of {size} bytes overlap at the byteStride {stride} of bufferView {index}"));
    }
    let end = stride.checked_mul(count - 1).and_then(|n| n.checked_add(size)).and_then(|n| n.checked_add(offset));
    match end {
        Some(end) if end <= view.byte_length.0 => Ok(()),
        _ => Err(format!(
            "{count} elements of {size} bytes from byteOffset {offset} at stride {stride} are beyond bufferView \
             {index} of {} bytes",
            view.byte_length.0
        )),
    }
}

/// Element and component type, if both are known.
fn kind(accessor: &Accessor) -> Result<(Type, ComponentType), String> {
    match (&accessor.type_, &accessor.component_type) {
        (Checked::Valid(kind), Checked::Valid(component)) => Ok((*kind, component.0)),
        (Checked::Invalid, _) => Err("type is unknown; SCALAR, VEC2 to VEC4 and MAT2 to MAT4 are".into()),
        (_, Checked::Invalid) => Err("componentType is unknown; 5120 to 5123, 5125 and 5126 are".into()),
    }
}

/// Size of an element; the columns of matrices start at multiples of 4 bytes (section 3.6.2.4).
fn element_bytes(kind: Type, component: ComponentType) -> u64 {
    let (columns, rows) = match kind {
        Type::Scalar => (1, 1),
        Type::Vec2 => (1, 2),
        Type::Vec3 => (1, 3),
        Type::Vec4 => (1, 4),
        Type::Mat2 => (2, 2),
        Type::Mat3 => (3, 3),
        Type::Mat4 => (4, 4),
    };
    let column: u64 = rows * component_bytes(component);
    if columns == 1 { column } else { columns * column.next_multiple_of(4) }
}

fn component_bytes(component: ComponentType) -> u64 {
    match component {
        ComponentType::I8 | ComponentType::U8 => 1,
        ComponentType::I16 | ComponentType::U16 => 2,
        ComponentType::U32 | ComponentType::F32 => 4,
    }
}
