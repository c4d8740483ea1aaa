//! Mesh instances to world-space triangles.

use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3};
use gltf::json::mesh::Semantic;

use super::accessor::Accessors;
use super::instances::Instance;
use super::remarks::Remarks;
use super::source::Source;
use crate::scene::{Scene, floored};
use crate::{Error, Result};

/// Appends the triangles of all instances to `scene`, whose materials are complete.
///
/// Mirrored instances (negative determinant) have their winding reversed, so that the geometric normal
/// `(v1 - v0) x (v2 - v0)` stays on the side of the shading normals (glTF 2.0, section 3.7.4).
pub(super) fn flatten(
    source: &Source,
    accessors: &Accessors,
    instances: &[Instance],
    uv_sets: &[Option<u32>],
    scene: &mut Scene,
    remarks: &mut Remarks,
) -> Result<()> {
    let triangles = instances.iter().map(|i| i.shape.triangles).sum();
    let with_normals = instances.iter().any(|i| i.shape.attribute(Semantic::Normals).is_some());
    let with_uvs = instances.iter().any(|i| uv_set(i, uv_sets).is_some());
    let reserved = scene
        .positions
        .try_reserve_exact(triangles)
        .and_then(|()| scene.material_ids.try_reserve_exact(triangles))
        .and_then(|()| scene.normals.try_reserve_exact(if with_normals { triangles } else { 0 }))
        .and_then(|()| scene.uvs.try_reserve_exact(if with_uvs { triangles } else { 0 }));
    reserved.map_err(|error| {
        source.fault("scene", format!("{triangles} triangles do not fit into memory: {error}"), "simplify the scene")
    })?;

    for instance in instances {
        let corners = Corners::read(source, accessors, instance)?;
        append_positions(source, accessors, instance, &corners, scene)?;
        let material = instance.shape.primitive.material.map_or(uv_sets.len(), |m| m.value());
        scene.material_ids.resize(scene.positions.len(), material as u32);
        if with_normals {
            append_normals(accessors, instance, &corners, scene, remarks)?;
        }
        if with_uvs {
            append_uvs(accessors, instance, &corners, uv_sets, scene, remarks)?;
        }
        scene.report.vertices += instance.shape.vertices;
    }
    scene.report.mesh_instances = instances.len();
    scene.report.degenerate_triangles = scene.positions.iter().filter(|t| is_degenerate(t)).count();
    Ok(())
}

/// The vertices of an instance's triangles.
struct Corners<'a> {
    instance: &'a Instance<'a>,
    indices: Option<Vec<u32>>,
    mirrored: bool,
}

impl<'a> Corners<'a> {
    /// Reads the indices; every one is below the vertex count.
    fn read(source: &Source, accessors: &Accessors, instance: &'a Instance) -> Result<Self> {
        let indices = instance.shape.primitive.indices.map(|accessor| accessors.indices(accessor)).transpose()?;
        if let (Some(indices), Some(accessor)) = (&indices, instance.shape.primitive.indices)
            && let Some(at) = indices.iter().position(|&i| i as usize >= instance.shape.vertices)
        {
            let problem = format!("element {at} is index {} of {} vertices", indices[at], instance.shape.vertices);
            let object = format!("accessor {} ({})", accessor.value(), instance.shape.name());
            return Err(source.fault(object, problem, "export the scene again"));
        }
        let mirrored = instance.world.matrix3.determinant() < 0.0;
        Ok(Corners { instance, indices, mirrored })
    }

    /// The vertex indices of each triangle, in their final winding.
    fn triangles(&self) -> impl Iterator<Item = [usize; 3]> {
        (0..self.instance.shape.triangles).map(|i| {
            let corners = self.instance.shape.topology.corners(i);
            let [a, b, c] = match &self.indices {
                Some(indices) => corners.map(|corner| indices[corner] as usize),
                None => corners,
            };
            if self.mirrored { [a, c, b] } else { [a, b, c] }
        })
    }
}

fn append_positions(
    source: &Source,
    accessors: &Accessors,
    instance: &Instance,
    corners: &Corners,
    scene: &mut Scene,
) -> Result<()> {
    let local = accessors.vec3(instance.shape.positions, "POSITION")?;
    let world: Vec<Vec3> = local.iter().map(|&p| world_position(instance.world, p)).collect();
    if let Some(at) = world.iter().position(|p| !p.is_finite()) {
        return Err(fault_position(source, instance, at, local[at]));
    }
    scene.positions.extend(corners.triangles().map(|t| t.map(|vertex| world[vertex])));
    Ok(())
}

/// A position in the world, rounded once; tiny components are 0.
fn world_position(world: &DAffine3, local: [f32; 3]) -> Vec3 {
    floored(world.transform_point3(DVec3::from(local.map(f64::from))).as_vec3())
}

fn fault_position(source: &Source, instance: &Instance, at: usize, local: [f32; 3]) -> Error {
    let accessor = format!("accessor {}", instance.shape.positions.value());
    if local.iter().all(|x| x.is_finite()) {
        let problem = format!("its transform moves element {at} of {accessor} beyond the largest number");
        return source.fault(format!("node {}", instance.node), problem, "correct the node's transform");
    }
    let problem = format!("element {at} is {local:?}: positions must be finite ({})", instance.shape.name());
    source.fault(accessor, problem, "repair the mesh and export the scene again")
}

fn append_normals(
    accessors: &Accessors,
    instance: &Instance,
    corners: &Corners,
    scene: &mut Scene,
    remarks: &mut Remarks,
) -> Result<()> {
    let first = scene.normals.len();
    let geometric = |triangle: usize| geometric_normal(&scene.positions[first + triangle]);
    let Some(accessor) = instance.shape.attribute(Semantic::Normals) else {
        scene.normals.extend((0..instance.shape.triangles).map(|i| [geometric(i); 3]));
        return Ok(());
    };
    let matrix = normal_matrix(&instance.world.matrix3);
    // A zero vector stands for a normal that is none.
    let to_world = |n: [f32; 3]| (matrix * DVec3::from(n.map(f64::from))).normalize_or_zero().as_vec3();
    let world: Vec<Vec3> = accessors.vec3(accessor, "NORMAL")?.into_iter().map(to_world).collect();
    let unusable = world.iter().filter(|n| **n == Vec3::ZERO).count();
    remarks.add_times("A normal is zero or not finite; the geometric normal stands in for it", unusable);
    scene.normals.extend(corners.triangles().enumerate().map(|(i, triangle)| {
        triangle.map(|vertex| match world[vertex] {
            Vec3::ZERO => geometric(i),
            normal => normal,
        })
    }));
    Ok(())
}

/// The matrix that takes normals along: the inverse transpose but for a positive factor, in a form that
/// flat transforms have too (the cofactor matrix, with the determinant's sign).
fn normal_matrix(m: &DMat3) -> DMat3 {
    let sign = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
    DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis)) * sign
}

/// Unit normal of a triangle; the y axis for one without area, which nothing ever hits.
fn geometric_normal(triangle: &[Vec3; 3]) -> Vec3 {
    doubled_area(triangle).try_normalize().unwrap_or(DVec3::Y).as_vec3()
}

fn is_degenerate(triangle: &[Vec3; 3]) -> bool {
    doubled_area(triangle) == DVec3::ZERO
}

/// The vector of a triangle's doubled area. In double precision, as that of a small triangle far from the
/// origin underflows or cancels in single.
fn doubled_area(triangle: &[Vec3; 3]) -> DVec3 {
    let [a, b, c] = triangle.map(|p| p.as_dvec3());
    (b - a).cross(c - a)
}

/// The UV set that an instance's base-colour texture uses, if it has one. `uv_sets` is per material.
fn uv_set(instance: &Instance, uv_sets: &[Option<u32>]) -> Option<u32> {
    uv_sets[instance.shape.primitive.material?.value()]
}

fn append_uvs(
    accessors: &Accessors,
    instance: &Instance,
    corners: &Corners,
    uv_sets: &[Option<u32>],
    scene: &mut Scene,
    remarks: &mut Remarks,
) -> Result<()> {
    let set = uv_set(instance, uv_sets);
    let Some(accessor) = set.and_then(|set| instance.shape.attribute(Semantic::TexCoords(set))) else {
        if set.is_some() {
            remarks.add("A textured mesh primitive lacks the texture coordinates that its material names");
        }
        scene.uvs.resize(scene.positions.len(), [Vec2::ZERO; 3]);
        return Ok(());
    };
    let mut uvs = accessors.vec2(accessor, "TEXCOORD")?;
    let broken = uvs.iter_mut().filter(|uv| !uv.iter().all(|x| x.is_finite()));
    remarks.add_times("A texture coordinate is not finite and becomes 0", broken.map(|uv| *uv = [0.0; 2]).count());
    scene.uvs.extend(corners.triangles().map(|t| t.map(|vertex| Vec2::from(uvs[vertex]))));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_follow_the_inverse_transpose() {
        for m in [
            DMat3::from_diagonal(DVec3::new(2.0, 3.0, -4.0)),
            DMat3::from_cols_array(&[1.0, 2.0, 0.5, -3.0, 1.0, 0.0, 0.25, 7.0, 1.0]),
        ] {
            let normal = DVec3::new(0.2, -0.5, 0.7);
            let expected = (m.inverse().transpose() * normal).normalize();
            assert!((normal_matrix(&m) * normal).normalize().abs_diff_eq(expected, 1e-12));
        }
    }

    #[test]
    fn tiny_components_become_zero() {
        use crate::shared::COORDINATE_FLOOR;
        let p = world_position(&DAffine3::IDENTITY, [COORDINATE_FLOOR, -COORDINATE_FLOOR / 2.0, f32::from_bits(1)]);
        assert_eq!(p, Vec3::new(COORDINATE_FLOOR, 0.0, 0.0));
    }

    #[test]
    fn thin_triangles_far_away_have_an_area() {
        let far = Vec3::splat(1000.0);
        let step = 1.0 / 8192.0;
        assert!(!is_degenerate(&[far, far + Vec3::X * step, far + Vec3::Y * step]));
        assert!(is_degenerate(&[far, far + Vec3::X, far + Vec3::X * 2.0]));
    }
}
