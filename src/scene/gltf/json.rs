//! JSON text to `gltf::json::Root`, after checks that make parsing safe and its errors name an object.

use gltf::json::Root;
use serde::de::DeserializeSeed;

use super::extensions;
use super::source::Source;
use super::wide_index::WideIndexCheck;
use crate::Result;

/// glTF itself nests about 10 levels deep; the rest is room for `extras`. Below serde_json's own 128.
const MAX_DEPTH: usize = 100;
/// Bounds of what a file may make the parser allocate: an object becomes some hundred bytes.
const MAX_OBJECTS: usize = 1 << 20;
/// As [`MAX_OBJECTS`], for the elements of arrays and objects, some ten bytes each.
const MAX_ELEMENTS: usize = 1 << 24;

/// Parses the JSON of a file; its version and required extensions are supported.
pub(super) fn parse(source: &Source, text: &[u8]) -> Result<Root> {
    check_size(source, text)?;
    // Before all else, as other versions have another schema.
    let header: Header = parse_tracked(source, text, std::marker::PhantomData)?;
    check_version(source, &header)?;
    extensions::check_required(source, &header.extensions_required)?;
    parse_tracked(source, text, WideIndexCheck::new())?;
    if header.scenes.iter().any(|scene| scene.nodes.is_none())
        && let Some(text) = with_scene_nodes(text)
    {
        return parse_tracked(source, &text, std::marker::PhantomData);
    }
    parse_tracked(source, text, std::marker::PhantomData)
}

/// A scene may leave out its list of nodes (glTF 2.0, section 5.26); `gltf::json` wants an empty one.
fn with_scene_nodes(text: &[u8]) -> Option<Vec<u8>> {
    let mut root: serde_json::Value = serde_json::from_slice(text).ok()?;
    for scene in root.get_mut("scenes")?.as_array_mut()? {
        scene.as_object_mut()?.entry("nodes").or_insert_with(|| serde_json::json!([]));
    }
    serde_json::to_vec(&root).ok()
}

/// What must be known before the rest can be read.
#[derive(serde::Deserialize)]
#[serde(rename_all = "camelCase")]
struct Header {
    #[serde(default)]
    asset: Asset,
    #[serde(default)]
    extensions_required: Vec<String>,
    #[serde(default)]
    scenes: Vec<SceneHeader>,
}

#[derive(serde::Deserialize)]
struct SceneHeader {
    nodes: Option<serde::de::IgnoredAny>,
}

#[derive(Default, serde::Deserialize)]
#[serde(rename_all = "camelCase")]
struct Asset {
    version: Option<String>,
    min_version: Option<String>,
}

fn check_version(source: &Source, header: &Header) -> Result<()> {
    let remedy = "export the scene as glTF 2.0";
    let Some(version) = &header.asset.version else {
        return Err(source.fault("asset", "version is missing", remedy));
    };
    if version.split('.').next() != Some("2") {
        return Err(source.fault("asset", format!("version is {version:?}, supported is 2.0"), remedy));
    }
    match header.asset.min_version.as_deref() {
        None | Some("2.0") => Ok(()),
        Some(needed) => Err(source.fault("asset", format!("minVersion is {needed:?}, supported is 2.0"), remedy)),
    }
}

/// Runs one typed parse; an error names the object (`node 7: mesh`) and the place in the text.
fn parse_tracked<'de, S: DeserializeSeed<'de>>(source: &Source, text: &'de [u8], seed: S) -> Result<S::Value> {
    let mut json = serde_json::Deserializer::from_slice(text);
    let mut track = serde_path_to_error::Track::new();
    let value = seed
        .deserialize(serde_path_to_error::Deserializer::new(&mut json, &mut track))
        .and_then(|value| json.end().map(|()| value));
    value.map_err(|error| {
        let object = object_name(&track.path().to_string().escape_debug().to_string());
        source.fault(object, error.to_string(), "correct the JSON or export the scene again")
    })
}

/// `accessors[3].count` becomes `accessor 3: count`, as everywhere in this program's messages.
fn object_name(path: &str) -> String {
    let Some((list, (index, field))) =
        path.split_once('[').and_then(|(list, rest)| Some((list, rest.split_once(']')?)))
    else {
        return if path == "." { "JSON".into() } else { format!("JSON: {path}") };
    };
    let object = if list == "meshes" { "mesh" } else { list.strip_suffix('s').unwrap_or(list) };
    match field.trim_start_matches('.') {
        "" => format!("{object} {index}"),
        field => format!("{object} {index}: {field}"),
    }
}

/// Bounds nesting and size in one pass over the text, without recursion.
fn check_size(source: &Source, text: &[u8]) -> Result<()> {
    let (mut depth, mut objects, mut elements) = (0usize, 0, 0);
    let (mut in_string, mut escaped) = (false, false);
    for &byte in text {
        if in_string {
            in_string = escaped || byte != b'"';
            escaped = !escaped && byte == b'\\';
            continue;
        }
        match byte {
            b'"' => in_string = true,
            b'{' | b'[' => depth += 1,
            b'}' | b']' => depth = depth.saturating_sub(1),
            b',' => elements += 1,
            _ => {}
        }
        objects += usize::from(byte == b'{');
        if depth > MAX_DEPTH {
            let problem = format!("nests deeper than {MAX_DEPTH} levels");
            return Err(source.fault("JSON", problem, "no glTF needs that: export the scene again"));
        }
    }
    if objects > MAX_OBJECTS || elements > MAX_ELEMENTS {
        let problem = format!("has {objects} objects and {elements} list elements");
        let remedy = format!("join small meshes and nodes: at most {MAX_OBJECTS} and {MAX_ELEMENTS} are supported");
        return Err(source.fault("JSON", problem, remedy));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn error(text: &str) -> String {
        let source = Source { file: Path::new("a.gltf"), folder: None };
        parse(&source, text.as_bytes()).expect_err("must be refused").to_string()
    }

    #[test]
    fn messages_name_the_object() {
        assert_eq!(object_name("accessors[3].count"), "accessor 3: count");
        assert_eq!(object_name("meshes[0].primitives[1].mode"), "mesh 0: primitives[1].mode");
        assert_eq!(object_name("nodes[2]"), "node 2");
        assert_eq!(object_name("."), "JSON");
    }

    #[test]
    fn brackets_in_strings_do_not_nest() {
        let text = format!(r#"{{"asset":{{"version":"2.0","copyright":"\"{}"}}}}"#, "[".repeat(1000));
        let source = Source { file: Path::new("a.gltf"), folder: None };
        parse(&source, text.as_bytes()).expect("legal");
    }

    #[test]
    fn deep_nesting_is_refused_before_parsing() {
        assert!(error(&"[".repeat(200_000)).contains("nests deeper"));
    }

    #[test]
    fn integers_beyond_32_bits_do_not_wrap_to_small_indices() {
        let text = r#"{"asset":{"version":"2.0"},"nodes":[{},{"mesh":4294967296}]}"#;
        assert!(error(text).contains("node 1: mesh"), "{}", error(text));
    }
}
