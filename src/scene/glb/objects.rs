//! Materials, cameras and lights as glTF objects.

use crate::scene::{Camera, Light, LightKind, Material, Projection, Wrap};
use glam::{Mat4, Vec3};
use serde_json::{Map, Value, json};

/// A JSON object with this name, if there is one.
pub fn named(name: Option<&str>) -> Map<String, Value> {
    name.map(|name| ("name".to_owned(), Value::from(name))).into_iter().collect()
}

/// The shortest decimal that reads back as the same f32, as JSON.
fn number(value: f32) -> Value {
    // cannot fail: Rust prints floats in a form that it reads; `value` alone would be widened in binary
    value.to_string().parse::<f64>().map_or(Value::Null, Value::from)
}

pub fn numbers<const N: usize>(values: [f32; N]) -> Value {
    values.into_iter().map(number).collect()
}

/// All materials are double sided because Caribou culls nothing.
pub fn material(material: &Material) -> Value {
    let [r, g, b] = material.base_color;
    let mut pbr = json!({
        "baseColorFactor": numbers([r, g, b, 1.0]),
        "metallicFactor": number(material.metallic),
        "roughnessFactor": number(material.roughness),
    });
    if let Some(texture) = material.base_color_texture {
        pbr["baseColorTexture"] = json!({ "index": texture });
    }
    let mut value = named(material.name.as_deref());
    value.insert("pbrMetallicRoughness".into(), pbr);
    value.insert("doubleSided".into(), true.into());

    let mut extensions = Map::new();
    let [r, g, b] = material.emissive;
    let brightest = r.max(g).max(b);
    if brightest > 0.0 {
        // emissiveFactor is limited to 1; what goes beyond is KHR_materials_emissive_strength.
        let strength = brightest.max(1.0);
        value.insert("emissiveFactor".into(), numbers([r, g, b].map(|c| c / strength)));
        if strength > 1.0 {
            extensions
                .insert("KHR_materials_emissive_strength".into(), json!({ "emissiveStrength": number(strength) }));
        }
    }
    if material.transmission > 0.0 {
        extensions.insert(
            "KHR_materials_transmission".into(),
            json!({ "transmissionFactor": number(material.transmission) }),
        );
    }
    if material.solid {
        extensions.insert("KHR_materials_volume".into(), json!({ "thicknessFactor": 1.0 }));
    }
    if material.ior != Material::default().ior {
        extensions.insert("KHR_materials_ior".into(), json!({ "ior": number(material.ior) }));
    }
    if material.unlit {
        extensions.insert("KHR_materials_unlit".into(), json!({}));
    }
    if !extensions.is_empty() {
        value.insert("extensions".into(), extensions.into());
    }
    value.into()
}

/// Near plane in metres; glTF demands one, Caribou has none.
const ZNEAR: f32 = 0.01;
/// Far plane of orthographic cameras in metres, likewise.
const ZFAR: f32 = 10_000.0;

pub fn camera(camera: &Camera) -> Value {
    let mut value = named(camera.name.as_deref());
    let (kind, lens) = match camera.projection {
        Projection::Perspective { yfov } => ("perspective", json!({ "yfov": number(yfov), "znear": number(ZNEAR) })),
        Projection::Orthographic { xmag, ymag } => (
            "orthographic",
            json!({ "xmag": number(xmag), "ymag": number(ymag), "zfar": number(ZFAR), "znear": number(ZNEAR) }),
        ),
    };
    value.insert("type".into(), kind.into());
    value.insert(kind.into(), lens);
    value.into()
}

pub fn light(light: &Light) -> Value {
    let mut value = named(light.name.as_deref());
    let [r, g, b] = light.intensity;
    let brightest = r.max(g).max(b);
    let color = if brightest > 0.0 { [r, g, b].map(|c| c / brightest) } else { [1.0; 3] };
    value.insert("color".into(), numbers(color));
    value.insert("intensity".into(), number(brightest));
    let (kind, range) = match light.kind {
        LightKind::Directional { .. } => ("directional", f32::INFINITY),
        LightKind::Point { range, .. } => ("point", range),
        LightKind::Spot { range, cos_inner, cos_outer, .. } => {
            let angle = |cos: f32| number(f64::from(cos).acos() as f32);
            value.insert(
                "spot".into(),
                json!({ "innerConeAngle": angle(cos_inner), "outerConeAngle": angle(cos_outer) }),
            );
            ("spot", range)
        }
    };
    value.insert("type".into(), kind.into());
    if range.is_finite() {
        value.insert("range".into(), number(range));
    }
    value.into()
}

/// The node of a light: it shines along its -z axis.
pub fn light_frame(kind: &LightKind) -> Mat4 {
    let (position, direction) = match *kind {
        LightKind::Directional { direction } => (Vec3::ZERO, direction),
        LightKind::Point { position, .. } => (position, Vec3::NEG_Z),
        LightKind::Spot { position, direction, .. } => (position, direction),
    };
    let z = -direction;
    let helper = if z.y.abs() < 0.9 { Vec3::Y } else { Vec3::X };
    let x = helper.cross(z).normalize();
    Mat4::from_cols(x.extend(0.0), z.cross(x).extend(0.0), z.extend(0.0), position.extend(1.0))
}

pub fn wrap_mode(wrap: Wrap) -> u32 {
    match wrap {
        Wrap::Repeat => 10497,
        Wrap::Mirror => 33648,
        Wrap::Clamp => 33071,
    }
}
