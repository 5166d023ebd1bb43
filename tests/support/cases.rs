//! A case: a ray, an interval, a shape; and the families they come in.

use super::rng::Rng;
use truehit::glam::{DAffine3, DMat3, DVec3};
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

    /// All of it in hexadecimal floats, to be pasted into a test; [`from_hex`](Self::from_hex) reads it.
    pub fn hex(&self) -> String {
        format!(
            "origin {} direction {} within ({}, {}) {}",
            hex_vector(self.ray.origin),
            hex_vector(self.ray.direction),
            hex(self.within.min),
            hex(self.within.max),
            self.solid.hex()
        )
    }

    /// What [`hex`](Self::hex) wrote.
    pub fn from_hex(text: &str) -> Self {
        let mut words = text.split(|c: char| c.is_whitespace() || "[](),".contains(c)).filter(|w| !w.is_empty());
        let (_, origin) = (words.find(|&w| w == "origin"), vector(&mut words));
        let (_, direction) = (words.next(), vector(&mut words));
        let (_, min, max) = (words.next(), number(&mut words), number(&mut words));
        Self { ray: Ray { origin, direction }, within: Interval::new(min, max), solid: Solid::from_hex(&mut words) }
    }
}

impl Solid {
    fn hex(&self) -> String {
        let v = hex_vector;
        match self {
            Self::Plane { point, normal } => format!("plane {} {}", v(*point), v(*normal)),
            Self::Triangle(t) => format!("triangle {} {} {}", v(t[0]), v(t[1]), v(t[2])),
            Self::Sphere { center, radius } => format!("sphere {} {}", v(*center), hex(*radius)),
            Self::Frustum { base, top, base_radius, top_radius } => {
                format!("frustum {} {} {} {}", v(*base), v(*top), hex(*base_radius), hex(*top_radius))
            }
            Self::Slab { min, max } => format!("slab {} {}", v(*min), v(*max)),
            Self::Affine { world_from_object: DAffine3 { matrix3: m, translation }, inner, .. } => {
                format!("affine {} {} {} {} {}", v(m.x_axis), v(m.y_axis), v(m.z_axis), v(*translation), inner.hex())
            }
            Self::Polygon(contours) => {
                let contour = |c: &Vec<DVec3>| format!(" {} {}", c.len(), c.iter().map(|&p| v(p)).collect::<String>());
                format!("polygon {}{}", contours.len(), contours.iter().map(contour).collect::<String>())
            }
            Self::Mesh { positions, triangles } => format!(
                "mesh {} {} {} {triangles:?}",
                positions.len(),
                triangles.len(),
                positions.iter().map(|&p| v(p)).collect::<String>()
            ),
        }
    }

    fn from_hex<'a>(words: &mut impl Iterator<Item = &'a str>) -> Self {
        match words.next().expect("a shape") {
            "plane" => Self::Plane { point: vector(words), normal: vector(words) },
            "triangle" => Self::Triangle([vector(words), vector(words), vector(words)]),
            "sphere" => Self::Sphere { center: vector(words), radius: number(words) },
            "frustum" => Self::Frustum {
                base: vector(words),
                top: vector(words),
                base_radius: number(words),
                top_radius: number(words),
            },
            "slab" => Self::Slab { min: vector(words), max: vector(words) },
            "affine" => {
                let matrix3 = DMat3::from_cols(vector(words), vector(words), vector(words));
                let world_from_object = DAffine3 { matrix3, translation: vector(words) };
                // What a shape stores is asked of the shape: `shapes::as_stored`.
                let object_from_world = DAffine3::IDENTITY;
                Self::Affine { world_from_object, object_from_world, inner: Box::new(Self::from_hex(words)) }
            }
            "polygon" => {
                let contours = count(words);
                let contour = |words: &mut _| (0..count(words)).map(|_| vector(words)).collect();
                Self::Polygon((0..contours).map(|_| contour(words)).collect())
            }
            "mesh" => {
                let (positions, triangles) = (count(words), count(words));
                Self::Mesh {
                    positions: (0..positions).map(|_| vector(words)).collect(),
                    triangles: (0..triangles).map(|_| std::array::from_fn(|_| count(words) as u32)).collect(),
                }
            }
            other => panic!("no shape: {other}"),
        }
    }
}

fn vector<'a>(words: &mut impl Iterator<Item = &'a str>) -> DVec3 {
    DVec3::new(number(words), number(words), number(words))
}

fn count<'a>(words: &mut impl Iterator<Item = &'a str>) -> usize {
    words.next().and_then(|w| w.parse().ok()).expect("a count")
}

fn number<'a>(words: &mut impl Iterator<Item = &'a str>) -> f64 {
    from_hex(words.next().expect("a number"))
}

fn hex_vector(v: DVec3) -> String {
    format!("[{}, {}, {}]", hex(v.x), hex(v.y), hex(v.z))
}

/// A float as [`hex`] writes it: C's %a, or `inf`, `0.0` and their negatives.
pub fn from_hex(text: &str) -> f64 {
    let (sign, digits) = text.strip_prefix('-').map_or((1.0, text), |t| (-1.0, t));
    let Some(hex) = digits.strip_prefix("0x") else {
        return sign * digits.parse::<f64>().unwrap();
    };
    let (mantissa, exponent) = hex.split_once('p').unwrap();
    let (lead, fraction) = mantissa.split_once('.').unwrap();
    let fraction = u64::from_str_radix(fraction, 16).unwrap();
    let exponent: i64 = exponent.parse().unwrap();
    let field = if lead == "1" { (exponent + 1023) as u64 } else { 0 };
    sign * f64::from_bits(field << 52 | fraction)
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
    /// λ's contract in ulps: under a map the surface moves by the rounding of the ray's image, which a ray that grazes,
    /// or that starts on the surface and hardly leaves it, turns into many of its own; the bound says so.
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
