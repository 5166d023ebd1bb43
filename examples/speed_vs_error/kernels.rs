//! The table: every kernel, shipped and textbook alike, is a function pointer of its shape's signature, fed by the same
//! generators.

use crate::support::cases::{Case, Kernel, Solid};
use truehit::glam::{DAffine3, DVec3};
use truehit::kernel::tally::Tally;
use truehit::{Hit, Interval, Ray};

pub type Answer = Option<Hit>;
/// Where a box is entered and left.
pub type Passage = Option<(f64, f64)>;
/// A ray, its interval and the other arguments.
pub type Arguments<A> = (Ray, Interval, A);

/// A kernel by its shape's signature.
#[derive(Clone, Copy)]
pub enum Function {
    Plane(fn(&Ray, DVec3, DVec3, Interval) -> Answer),
    Triangle(fn(&Ray, &[DVec3; 3], Interval) -> Answer),
    Polygon(fn(&Ray, &[&[DVec3]], Interval) -> Answer),
    Sphere(fn(&Ray, DVec3, f64, Interval) -> Answer),
    Frustum(fn(&Ray, DVec3, DVec3, f64, f64, Interval) -> Answer),
    Slab(fn(&Ray, DVec3, DVec3, Interval) -> Passage),
    /// A shape of the crate, through `dyn Shape`.
    Shape(fn(&Solid) -> Option<Box<dyn truehit::Shape>>),
    /// The lecture's way with a deformed shape: map the ray in this precision, then ask this entry.
    Mapped {
        map: fn(&Ray, &DAffine3) -> Ray,
        then: fn(Kernel) -> Function,
    },
}

/// Where a kernel comes from, which is also how it is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    TextbookF32,
    TextbookF64,
    Shipped,
}

#[derive(Clone, Copy)]
pub struct Entry {
    pub kernel: Kernel,
    pub name: &'static str,
    pub origin: Origin,
    pub function: Function,
}

/// A case with its arguments laid out as the kernel takes them, so that nothing else is timed.
pub enum Prepared {
    Plane(Vec<Arguments<(DVec3, DVec3)>>),
    Triangle(Vec<Arguments<[DVec3; 3]>>),
    Polygon(Vec<Arguments<Vec<Vec<DVec3>>>>),
    Sphere(Vec<Arguments<(DVec3, f64)>>),
    Frustum(Vec<Arguments<(DVec3, DVec3, f64, f64)>>),
    Slab(Vec<Arguments<(DVec3, DVec3)>>),
    Shape(Vec<Arguments<Box<dyn truehit::Shape>>>),
    Mapped(Vec<Arguments<(DAffine3, Vec<Solid>)>>),
}

fn call_solid(function: Function, ray: &Ray, within: Interval, solid: &Solid) -> Answer {
    match (function, solid) {
        (Function::Plane(f), Solid::Plane { point, normal }) => f(ray, *point, *normal, within),
        (Function::Triangle(f), Solid::Triangle(v)) => f(ray, v, within),
        (Function::Polygon(f), Solid::Polygon(c)) => f(ray, &c.iter().map(Vec::as_slice).collect::<Vec<_>>(), within),
        (Function::Sphere(f), Solid::Sphere { center, radius }) => f(ray, *center, *radius, within),
        (Function::Frustum(f), Solid::Frustum { base, top, base_radius, top_radius }) => {
            f(ray, *base, *top, *base_radius, *top_radius, within)
        }
        (Function::Slab(f), Solid::Slab { min, max }) => f(ray, *min, *max, within).map(entry_hit),
        (Function::Mapped { map, then }, Solid::Affine { object_from_world, inner, .. }) => {
            call_solid(then(kind(inner)), &map(ray, object_from_world), within, inner)
        }
        (Function::Shape(make), solid) => make(solid)?.intersect(ray, within),
        _ => unreachable!("a case of another shape"),
    }
}

/// The kernel of a solid; a frustum of equal radii is a cylinder.
pub fn kind(solid: &Solid) -> Kernel {
    match solid {
        Solid::Plane { .. } => Kernel::Plane,
        Solid::Triangle(_) => Kernel::Triangle,
        Solid::Polygon(_) => Kernel::Polygon,
        Solid::Sphere { .. } => Kernel::Sphere,
        Solid::Frustum { base_radius, top_radius, .. } if base_radius == top_radius => Kernel::Cylinder,
        Solid::Frustum { .. } => Kernel::Cone,
        Solid::Slab { .. } => Kernel::Slab,
        Solid::Mesh { .. } => Kernel::Mesh,
        Solid::Affine { .. } => Kernel::Affine,
    }
}

fn entry_hit((enter, _): (f64, f64)) -> Hit {
    Hit { lambda: enter, error: f64::INFINITY, uv: truehit::glam::DVec2::ZERO, part: 0 }
}

impl Entry {
    /// The answer to one case; `None` where the shape is refused at the door.
    pub fn answer(&self, case: &Case) -> Option<Answer> {
        self.counted(case).map(|counted| counted.0)
    }

    /// The answer, and how often it left a fast path on the way: making the shape does not count.
    pub fn counted(&self, case: &Case) -> Option<(Answer, Tally)> {
        let counted = |answer: &dyn Fn() -> Answer| {
            let before = Tally::now();
            let answer = answer();
            (answer, Tally::now().since(before))
        };
        if let Function::Shape(make) = self.function {
            let shape = make(&case.solid)?;
            return Some(counted(&|| shape.intersect(&case.ray, case.within)));
        }
        self.answers(&case.solid).then(|| counted(&|| call_solid(self.function, &case.ray, case.within, &case.solid)))
    }

    /// The textbook has no kernel for meshes, whatever maps lie over them.
    fn answers(&self, solid: &Solid) -> bool {
        match solid {
            Solid::Affine { inner, .. } => self.answers(inner),
            Solid::Mesh { .. } => self.origin == Origin::Shipped,
            _ => true,
        }
    }

    /// The cases as arguments; refused shapes are left out.
    pub fn prepare(&self, cases: &[Case]) -> Prepared {
        macro_rules! prepared {
            ($variant:ident, $solid:pat => $arguments:expr) => {
                Prepared::$variant(
                    cases
                        .iter()
                        .filter(|c| self.answers(&c.solid))
                        .map(|c| match &c.solid {
                            $solid => (c.ray, c.within, $arguments),
                            _ => unreachable!("a case of another shape"),
                        })
                        .collect(),
                )
            };
        }
        match self.function {
            Function::Plane(_) => prepared!(Plane, Solid::Plane { point, normal } => (*point, *normal)),
            Function::Triangle(_) => prepared!(Triangle, Solid::Triangle(v) => *v),
            Function::Polygon(_) => prepared!(Polygon, Solid::Polygon(c) => c.clone()),
            Function::Sphere(_) => prepared!(Sphere, Solid::Sphere { center, radius } => (*center, *radius)),
            Function::Frustum(_) => prepared!(
                Frustum, Solid::Frustum { base, top, base_radius, top_radius } =>
                (*base, *top, *base_radius, *top_radius)
            ),
            Function::Slab(_) => prepared!(Slab, Solid::Slab { min, max } => (*min, *max)),
            Function::Mapped { .. } => prepared!(
                Mapped, Solid::Affine { object_from_world, inner, .. } =>
                (*object_from_world, vec![(**inner).clone()])
            ),
            Function::Shape(make) => {
                Prepared::Shape(cases.iter().filter_map(|c| Some((c.ray, c.within, make(&c.solid)?))).collect())
            }
        }
    }

    /// Runs `timer` with the kernel called on the `i`th case, whose ray's origin takes the bits of `link`.
    pub fn each<R>(&self, prepared: &Prepared, timer: impl Timer<R>) -> R {
        use std::hint::black_box;
        // Opaque pointers: nothing is inlined into the loop or folded away, for any kernel alike.
        macro_rules! timed {
            ($list:expr, |$ray:ident, $arguments:ident, $within:ident| $call:expr) => {
                timer.time($list.len(), |i, link| {
                    let (ray, $within, $arguments) = &$list[i];
                    let $ray = &linked(ray, link);
                    let $within = *$within;
                    $call
                })
            };
        }
        match (self.function, prepared) {
            (Function::Plane(f), Prepared::Plane(list)) => {
                let f = black_box(f);
                timed!(list, |ray, a, within| f(ray, a.0, a.1, within))
            }
            (Function::Triangle(f), Prepared::Triangle(list)) => {
                let f = black_box(f);
                timed!(list, |ray, a, within| f(ray, a, within))
            }
            (Function::Polygon(f), Prepared::Polygon(list)) => {
                let f = black_box(f);
                let views: Vec<Arguments<Vec<&[DVec3]>>> =
                    list.iter().map(|(r, w, c)| (*r, *w, c.iter().map(Vec::as_slice).collect())).collect();
                timed!(views, |ray, a, within| f(ray, a, within))
            }
            (Function::Sphere(f), Prepared::Sphere(list)) => {
                let f = black_box(f);
                timed!(list, |ray, a, within| f(ray, a.0, a.1, within))
            }
            (Function::Frustum(f), Prepared::Frustum(list)) => {
                let f = black_box(f);
                timed!(list, |ray, a, within| f(ray, a.0, a.1, a.2, a.3, within))
            }
            (Function::Slab(f), Prepared::Slab(list)) => {
                let f = black_box(f);
                timed!(list, |ray, a, within| f(ray, a.0, a.1, within).map(entry_hit))
            }
            (Function::Shape(_), Prepared::Shape(list)) => {
                timed!(list, |ray, a, within| a.intersect(ray, within))
            }
            (Function::Mapped { map, then }, Prepared::Mapped(list)) => {
                let map = black_box(map);
                timed!(list, |ray, a, within| call_solid(then(kind(&a.1[0])), &map(ray, &a.0), within, &a.1[0]))
            }
            _ => unreachable!("prepared for another kernel"),
        }
    }
}

/// What is done with a kernel ready to be called.
pub trait Timer<R> {
    fn time(self, count: usize, call: impl FnMut(usize, u64) -> Answer) -> R;
}

/// The ray, with `link` (which is 0, but the compiler does not know) in its origin: where `link` comes from the
/// previous answer, this ray waits for it.
#[inline(always)]
fn linked(ray: &Ray, link: u64) -> Ray {
    let mut ray = *ray;
    ray.origin.x = f64::from_bits(ray.origin.x.to_bits() | link);
    ray
}
