//! A case: a ray, an interval, a shape; and the families they come in.

use super::rng::Rng;
use truehit::glam::{DAffine3, DVec3};
use truehit::{Interval, Ray};

#[derive(Clone, Debug)]
pub enum Solid {
    Plane {
        point: DVec3,
        normal: DVec3,
    },
    Triangle([DVec3; 3]),
    /// Outer contour first.
    Polygon(Vec<Vec<DVec3>>),
    Sphere {
        center: DVec3,
        radius: f64,
    },
    /// Cylinder (equal radii), cone (top radius 0), truncated cone.
    Frustum {
        base: DVec3,
        top: DVec3,
        base_radius: f64,
        top_radius: f64,
    },
    Slab {
        min: DVec3,
        max: DVec3,
    },
    Mesh {
        positions: Vec<DVec3>,
        triangles: Vec<[u32; 3]>,
    },
    /// A shape placed by a map, and defined by the stored inverse of it.
    Affine {
        world_from_object: DAffine3,
        object_from_world: DAffine3,
        inner: Box<Solid>,
    },
}

#[derive(Clone, Debug)]
pub struct Case {
    pub ray: Ray,
    pub within: Interval,
    pub solid: Solid,
}

impl Case {
    pub fn new(origin: DVec3, direction: DVec3, solid: Solid) -> Self {
        Self { ray: Ray { origin, direction }, within: Interval::FORWARD, solid }
    }

    /// All of it in hexadecimal floats, to be pasted into a test.
    pub fn hex(&self) -> String {
        let v = |v: DVec3| format!("[{}, {}, {}]", hex(v.x), hex(v.y), hex(v.z));
        let shape = match &self.solid {
            Solid::Plane { point, normal } => format!("plane {} {}", v(*point), v(*normal)),
            Solid::Triangle(t) => format!("triangle {} {} {}", v(t[0]), v(t[1]), v(t[2])),
            Solid::Sphere { center, radius } => format!("sphere {} {}", v(*center), hex(*radius)),
            Solid::Frustum { base, top, base_radius, top_radius } => {
                format!("frustum {} {} {} {}", v(*base), v(*top), hex(*base_radius), hex(*top_radius))
            }
            Solid::Slab { min, max } => format!("slab {} {}", v(*min), v(*max)),
            other => format!("{other:?}"),
        };
        format!(
            "origin {} direction {} within ({}, {}) {shape}",
            v(self.ray.origin),
            v(self.ray.direction),
            hex(self.within.min),
            hex(self.within.max)
        )
    }
}

/// A float as C's %a writes it.
pub fn hex(x: f64) -> String {
    if !x.is_finite() || x == 0.0 {
        return format!("{x:?}");
    }
    let bits = x.to_bits();
    let field = (bits >> 52 & 0x7ff) as i32;
    let (lead, e) = if field == 0 { (0, -1022) } else { (1, field - 1023) };
    format!("{}0x{lead}.{:013x}p{e}", if x < 0.0 { "-" } else { "" }, bits & ((1 << 52) - 1))
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kernel {
    Plane,
    Triangle,
    Polygon,
    Sphere,
    Cylinder,
    Cone,
    Slab,
    Mesh,
    Affine,
}

impl Kernel {
    pub const ALL: [Self; 9] = [
        Self::Plane,
        Self::Triangle,
        Self::Polygon,
        Self::Sphere,
        Self::Cylinder,
        Self::Cone,
        Self::Slab,
        Self::Mesh,
        Self::Affine,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Self::Plane => "plane",
            Self::Triangle => "triangle",
            Self::Polygon => "polygon",
            Self::Sphere => "sphere",
            Self::Cylinder => "cylinder",
            Self::Cone => "cone",
            Self::Slab => "slab",
            Self::Mesh => "mesh",
            Self::Affine => "affine",
        }
    }

    /// λ's contract in ulps.
    pub fn contract(self) -> f64 {
        match self {
            Self::Plane | Self::Sphere => 1.0,
            _ => 4.0,
        }
    }
}

/// A generator of cases of one kind. Numbers are those of the list of hard cases; 0 is ordinary rays.
#[derive(Clone, Copy)]
pub struct Family {
    pub number: u32,
    pub name: &'static str,
    pub kernel: Kernel,
    pub generate: fn(&mut Rng, usize) -> Case,
}

impl Family {
    /// λ's contract in ulps: under a map the surface moves by the rounding of the ray's image, which a ray that grazes, or
    /// that starts on the surface and hardly leaves it, turns into many of its own; the bound says so.
    pub fn contract(&self) -> f64 {
        let grazes = self.kernel == Kernel::Affine && matches!(self.number, 1 | 46);
        if grazes { f64::INFINITY } else { self.kernel.contract() }
    }

    /// The `i`th case: the same for everyone, whatever was generated before.
    pub fn case(&self, i: usize) -> Case {
        let seed = u64::from(self.number) << 48 ^ (self.kernel as u64) << 40 ^ i as u64;
        (self.generate)(&mut Rng::new(seed.wrapping_mul(0xd134_2543_de82_ef95)), i)
    }
}
