//! What goes into leaves: triangles, the large ones cut into pieces by planes before the build, so that their
//! boxes overlap less (early split clipping: Ernst and Greiner 2007; obvhs's heuristic chooses what to cut).

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::splits::split_aabbs_preset;
use obvhs::triangle::Triangle;
use rayon::prelude::*;

use crate::shared::LEAF_FIRST_MASK;

/// How much a piece's box grows, relative to the triangle's largest coordinate. Where a plane cuts an edge is
/// computed with an error of at most 9 roundings of 2^-24 of it: two in the fraction of the edge, each of
/// an edge at most twice as long, and one of the sum. 2^-20.
const CUT_ERROR: f32 = 9.536_743e-7;

/// Coordinates below this are 0 to the cutter: an edge between two of them has no finite reciprocal. Below
/// [`CUT_ERROR`] of any triangle whose box has an area in f32.
const SMALLEST_CUT: f32 = 1.0e-30;

/// Pieces of triangles. A triangle that is not cut is one piece.
pub struct Pieces {
    /// Box of each: all pieces of a triangle together cover it.
    pub boxes: Vec<Aabb>,
    /// Primitive id of each.
    pub prims: Vec<u32>,
}

impl Pieces {
    /// One piece a triangle.
    pub fn whole(positions: &[[Vec3; 3]]) -> Pieces {
        Pieces { boxes: positions.par_iter().map(bounds).collect(), prims: (0..positions.len() as u32).collect() }
    }

    /// Large triangles cut. There are less than twice as many pieces as triangles: a triangle is cut while its
    /// pieces' areas are above three times the mean and a cut takes a third of the area away.
    pub fn cut(positions: &[[Vec3; 3]]) -> Pieces {
        let Pieces { mut boxes, prims } = Pieces::cut_as_computed(positions);
        if boxes.len() > LEAF_FIRST_MASK as usize {
            return Pieces::whole(positions);
        }
        boxes.par_iter_mut().zip(&prims).for_each(|(aabb, &prim)| *aabb = safe(aabb, &positions[prim as usize]));
        Pieces { boxes, prims }
    }

    /// The same with boxes that may be too small by [`CUT_ERROR`].
    fn cut_as_computed(positions: &[[Vec3; 3]]) -> Pieces {
        let Pieces { mut boxes, mut prims } = Pieces::whole(positions);
        let triangles: Vec<Triangle> = positions.par_iter().map(to_cut).collect();
        let areas = || boxes.par_iter().map(|aabb| f64::from(aabb.half_area()));
        let (mean, largest) = (areas().sum::<f64>() / boxes.len() as f64, areas().reduce(|| 0.0, f64::max));
        split_aabbs_preset(&mut boxes, &mut prims, &triangles, mean as f32, largest as f32);
        Pieces { boxes, prims }
    }

    /// The box around some of them.
    pub fn union(&self, pieces: &[u32]) -> Aabb {
        pieces.iter().fold(Aabb::empty(), |all, &piece| all.union(&self.boxes[piece as usize]))
    }
}

/// The box of a triangle.
fn bounds(&[a, b, c]: &[Vec3; 3]) -> Aabb {
    Aabb::new(a.min(b).min(c).into(), a.max(b).max(c).into())
}

fn to_cut(positions: &[Vec3; 3]) -> Triangle {
    let flushed =
        |v: Vec3| Vec3A::select(Vec3A::from(v).abs().cmplt(Vec3A::splat(SMALLEST_CUT)), Vec3A::ZERO, v.into());
    let [v0, v1, v2] = positions.map(flushed);
    Triangle { v0, v1, v2 }
}

/// A piece's box grown by what its cuts may be off, but not beyond the triangle's.
fn safe(piece: &Aabb, triangle: &[Vec3; 3]) -> Aabb {
    let whole = bounds(triangle);
    let error = Vec3A::splat(whole.min.abs().max(whole.max.abs()).max_element() * CUT_ERROR);
    Aabb::new((piece.min - error).max(whole.min), (piece.max + error).min(whole.max))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::{Bvh, Quality};
    use crate::layout::{Hit, Ray};
    use crate::scene::procedural::random::Random;
    use crate::shared::{FAR_AWAY, LEAF_BIT, LEAF_COUNT_MASK, LEAF_COUNT_SHIFT, NO_HIT};
    use crate::twin::box_test::box_ray;
    use crate::twin::trace;
    use crate::twin::triangle::{intersect, shear_of};

    /// A thousand small triangles, and a few large, thin and slanted ones that are cut.
    fn mixed(offset: f32, scale: f32) -> Vec<[Vec3; 3]> {
        let mut random = Random::new(7);
        let mut point = |size: f32| Vec3::from([(); 3].map(|()| (random.unit() - 0.5) * size));
        let mut triangle = |spread, length, width| {
            let (middle, half) = (point(spread), point(length));
            [middle - half, middle + half, middle + half + point(width)].map(|v| v * scale + offset)
        };
        let mut positions: Vec<_> = (0..1_000).map(|_| triangle(10.0, 0.1, 0.1)).collect();
        positions.extend((0..40).map(|_| triangle(2.0, 10.0, 0.3)));
        // Over the origin, with coordinates that have no reciprocal: a cut at the middle of its box meets them.
        let corners = [Vec3::splat(-5.0), Vec3::splat(5.0), Vec3::new(0.0, 1.0e-40, -1.0e-40)];
        positions.push(corners.map(|v| v * scale + offset));
        positions
    }

    /// Points of a triangle, computed in f64: on its edges and inside.
    fn points(&[a, b, c]: &[Vec3; 3]) -> impl Iterator<Item = glam::DVec3> {
        let [a, b, c] = [a, b, c].map(Vec3::as_dvec3);
        let step = |i: i32| f64::from(i) / 101.0;
        (0..=101).flat_map(move |i| (0..=101 - i).map(move |j| a + (b - a) * step(i) + (c - a) * step(j)))
    }

    fn outside(boxes: &[&Aabb], triangle: &[Vec3; 3]) -> usize {
        let holds = |aabb: &Aabb, p: glam::DVec3| {
            // Half a rounding of f64: points on the triangle's own border.
            let slack = p.abs() * f64::EPSILON;
            let (low, high) = (Vec3::from(aabb.min).as_dvec3(), Vec3::from(aabb.max).as_dvec3());
            (low - slack).cmple(p).all() && (high + slack).cmpge(p).all()
        };
        points(triangle).filter(|&p| !boxes.iter().any(|aabb| holds(aabb, p))).count()
    }

    #[test]
    fn pieces_cover_their_triangle_and_growth_is_what_it_takes() {
        let mut uncovered_without_growth = 0;
        for (offset, scale) in [(0.0, 1.0), (1.0e5, 1.0), (-3.0e7, 1.0e4), (0.0, 1.0e-18), (0.0, 1.0e15)] {
            let positions = mixed(offset, scale);
            let pieces = Pieces::cut(&positions);
            let mut of: Vec<Vec<usize>> = vec![Vec::new(); positions.len()];
            pieces.prims.iter().enumerate().for_each(|(piece, &prim)| of[prim as usize].push(piece));
            let cut = of.iter().filter(|pieces| pieces.len() > 1).count();
            assert!(cut > 5 && pieces.prims.len() < 2 * positions.len(), "{cut} cut at {offset}, {scale}");
            let naive = Pieces::cut_as_computed(&positions).boxes;
            for (triangle, of) in positions.iter().zip(&of) {
                let boxes: Vec<&Aabb> = of.iter().map(|&piece| &pieces.boxes[piece]).collect();
                assert_eq!(outside(&boxes, triangle), 0, "{triangle:?} of {} pieces", of.len());
                let naive: Vec<&Aabb> = of.iter().map(|&piece| &naive[piece]).collect();
                uncovered_without_growth += outside(&naive, triangle);
            }
        }
        println!("{uncovered_without_growth} points in no box that has not grown");
        assert!(uncovered_without_growth > 0);
    }

    /// Rays at and around points of cut triangles hit what a test of every triangle finds, bit for bit.
    #[test]
    fn cutting_changes_no_hit() {
        let positions = mixed(1.0e3, 1.0);
        let bvh = Bvh::build(&positions, Quality::Medium).unwrap();
        assert!(bvh.references() > positions.len());
        let mut random = Random::new(3);
        let mut toward = |target: glam::DVec3| {
            let origin = Vec3::from([(); 3].map(|()| 1.0e3 + (random.unit() - 0.5) * 30.0));
            let direction = (target.as_vec3() - origin).into();
            Ray { origin: origin.into(), t_min: 0.0, direction, t_max: FAR_AWAY }
        };
        let rays: Vec<Ray> = positions[1_000..].iter().flat_map(points).map(&mut toward).collect();
        let hits = trace::hits(&bvh, &rays);
        for (ray, hit) in rays.iter().zip(&hits) {
            let box_ray = box_ray(ray, bvh.bounds.0, bvh.bounds.1);
            let mut closest = Hit { t: ray.t_max, prim: NO_HIT, u: 0.0, v: 0.0 };
            for triangle in &bvh.triangles {
                intersect(ray, &box_ray, &shear_of(ray.direction), triangle, &mut closest);
            }
            assert_eq!(bytemuck::bytes_of(&trace::finished::<false>(closest)), bytemuck::bytes_of(hit), "{ray:?}");
        }
    }

    #[test]
    fn validation_finds_a_piece_that_is_in_no_leaf() {
        let positions = mixed(0.0, 1.0);
        let good = Bvh::build(&positions, Quality::Medium).unwrap();
        assert_eq!(good.validate(&positions), Ok(()));
        let is_cut = |triangle: &crate::layout::Triangle| triangle.prim as usize >= 1_000;
        let holds_piece = |link: u32| {
            let (first, count) = (link & LEAF_FIRST_MASK, link >> LEAF_COUNT_SHIFT & LEAF_COUNT_MASK);
            link & LEAF_BIT != 0 && good.triangles[first as usize..(first + count) as usize].iter().any(is_cut)
        };
        let found = good.nodes.iter().position(|node| holds_piece(node.child[0])).unwrap();
        let mut bvh = good.clone();
        bvh.nodes[found].child[0] = LEAF_BIT;
        assert!(bvh.validate(&positions).is_err());
        let mut bvh = good.clone();
        bvh.nodes[found].x[1] = bvh.nodes[found].x[0];
        assert!(bvh.validate(&positions).unwrap_err().contains("in no leaf's box"));
    }
}
