use super::super::cases::{Case, Family, Kernel, Solid};
use super::super::rng::{Rng, nudged, nudged_each};
use super::shared_families;
use truehit::Interval;
use truehit::glam::DVec3;

const fn cylinder(number: u32, name: &'static str, generate: fn(&mut Rng, usize) -> Case) -> Family {
    super::family(Kernel::Cylinder, number, name, generate)
}

const fn cone(number: u32, name: &'static str, generate: fn(&mut Rng, usize) -> Case) -> Family {
    super::family(Kernel::Cone, number, name, generate)
}

const OWN_CYLINDER: [Family; 10] = [
    cylinder(5, "grazed", |rng, _| {
        let f = Parts::cylinder(rng);
        f.grazed(rng, 3.0)
    }),
    cylinder(6, "grazed from 1e5 r", |rng, _| {
        let f = Parts::cylinder(rng);
        f.grazed(rng, 1e5)
    }),
    cylinder(11, "from 1e6 r, tilt 1e-6 and any", |rng, i| {
        let f = Parts::cylinder(rng);
        f.far(rng, i)
    }),
    cylinder(25, "along the axis but 1e-3..1e-12", |rng, _| {
        let f = Parts::cylinder(rng);
        let axis = (f.top - f.base).normalize();
        let u = axis * rng.sign() + rng.across(axis) * rng.log(1e-12, 1e-3);
        let target = f.base + rng.across(axis) * f.r0 * rng.uniform(0.0, 1.3) + axis * rng.uniform(-1.0, 3.0);
        let origin = target - u * rng.uniform(0.0, 8.0);
        Case { within: Interval::LINE, ..Case::new(origin, u * rng.length(), f.solid()) }
    }),
    cylinder(26, "exactly along the axis", parallel_to_axis),
    cylinder(51, "origin on a rim, six directions", |rng, i| {
        let f = Parts::cylinder_or_exact(rng);
        f.on_rim(rng, i)
    }),
    cylinder(52, "aimed at a rim", |rng, i| {
        let f = Parts::cylinder_or_exact(rng);
        f.at_rim(rng, i)
    }),
    cylinder(46, "origin on the wall, a cap, inside", |rng, i| {
        let f = Parts::cylinder(rng);
        f.on_surface(rng, i)
    }),
    cylinder(3, "exact tangents, r and r ± 1 ulp", tangent_cylinder),
    cylinder(59, "in a cap's plane", |rng, i| {
        let f = Parts::exact(rng, 1.0);
        f.in_cap_plane(rng, i)
    }),
];
pub fn cylinders() -> Vec<Family> {
    [&OWN_CYLINDER[..], &shared_families!(Kernel::Cylinder, super::frustum::ordinary_cylinder)].concat()
}

const OWN_CONE: [Family; 15] = [
    cone(5, "grazed", |rng, _| {
        let f = Parts::cone(rng);
        f.grazed(rng, 3.0)
    }),
    cone(6, "tangent along a generator", |rng, _| {
        let f = Parts::cone(rng);
        let (p, n, generator) = f.on_wall(rng);
        let u = (generator + rng.across(generator) * rng.log(1e-12, 1.0)).normalize();
        // Into the tangent plane.
        let u = (u - n * n.dot(u)).normalize();
        let origin = p + n * f.r0 * rng.sign() * rng.log(1e-16, 1e-4) - u * rng.uniform(1.0, 5.0);
        Case { within: Interval::LINE, ..Case::new(origin, u * rng.length(), f.solid()) }
    }),
    cone(12, "from 1e6", |rng, i| {
        let f = Parts::cone(rng);
        f.far(rng, i)
    }),
    cone(27, "along a generator but 1e-3..1e-12", |rng, _| {
        let f = Parts::cone(rng);
        let (_, _, generator) = f.on_wall(rng);
        let u = generator * rng.sign() + rng.across(generator) * rng.log(1e-12, 1e-3);
        let target = f.inside(rng);
        Case { within: Interval::LINE, ..Case::new(target - u * rng.uniform(0.0, 8.0), u * rng.length(), f.solid()) }
    }),
    cone(28, "exactly along a generator", parallel_to_generator),
    cone(46, "origin on the wall, a cap, inside", |rng, i| {
        let f = Parts::cone(rng);
        f.on_surface(rng, i)
    }),
    cone(51, "origin on a rim, six directions", |rng, i| {
        let f = Parts::cone_or_exact(rng);
        f.on_rim(rng, i)
    }),
    cone(52, "aimed at a rim", |rng, i| {
        let f = Parts::cone_or_exact(rng);
        f.at_rim(rng, i)
    }),
    cone(53, "aimed at the apex", |rng, i| {
        let mut f = Parts::exact(rng, 0.0);
        if i % 3 == 0 {
            f = Parts { r1: 0.0, ..Parts::cone(rng) };
            let distance = rng.log(0.1, 1e6);
            return super::towards(rng, f.top, distance, f.solid());
        }
        super::exactly_towards(rng, f.top, f.solid())
    }),
    cone(54, "passing the apex by 1e-3..1e-14", |rng, _| {
        let f = Parts { r1: 0.0, ..Parts::cone(rng) };
        let target = f.top + rng.unit() * rng.log(1e-14, 1e-3);
        let distance = rng.log(0.1, 10.0);
        super::towards(rng, target, distance, f.solid())
    }),
    cone(55, "origin at the apex", |rng, _| {
        let f = Parts { r1: 0.0, ..Parts::cone(rng) };
        let case = Case::new(f.top, rng.unit() * rng.length(), f.solid());
        Case { within: if rng.chance(0.5) { Interval::LINE } else { Interval::FORWARD }, ..case }
    }),
    cone(56, "mirror nappe only", |rng, _| {
        let f = Parts { r1: 0.0, ..Parts::cone(rng) };
        let axis = f.top - f.base;
        // Across the axis, beyond the apex.
        let target = f.top + axis * rng.uniform(0.1, 1.0) + rng.across(axis) * 0.01;
        let u = rng.across(axis);
        Case { within: Interval::LINE, ..Case::new(target - u * 9.0, u * rng.length(), f.solid()) }
    }),
    cone(57, "truncated 1 ulp from the apex", |rng, _| {
        let f = Parts { r1: f64::EPSILON * rng.uniform(0.5, 4.0), ..Parts::cone(rng) };
        let target = f.top + rng.unit() * f.r1 * rng.uniform(0.0, 2.0);
        super::towards(rng, target, 3.0, f.solid())
    }),
    cone(59, "in a cap's plane", |rng, i| {
        let f = Parts::exact(rng, 0.5);
        f.in_cap_plane(rng, i)
    }),
    cone(60, "nearly a cylinder, nearly flat", |rng, i| {
        let mut f = Parts::cone(rng);
        if i.is_multiple_of(2) {
            f.r1 = nudged(f.r0, rng.integer(-3, 3));
        } else {
            f.top = f.base + (f.top - f.base) * rng.log(1e-12, 1e-2);
        }
        let target = f.inside(rng);
        super::towards(rng, target, 5.0, f.solid())
    }),
];
pub fn cones() -> Vec<Family> {
    [&OWN_CONE[..], &shared_families!(Kernel::Cone, super::frustum::ordinary_cone)].concat()
}

pub fn ordinary_cylinder(rng: &mut Rng, _: usize) -> Case {
    Parts::cylinder(rng).ordinary(rng)
}

pub fn ordinary_cone(rng: &mut Rng, _: usize) -> Case {
    Parts::cone(rng).ordinary(rng)
}

#[derive(Clone, Copy)]
struct Parts {
    base: DVec3,
    top: DVec3,
    r0: f64,
    r1: f64,
}

impl Parts {
    fn cylinder(rng: &mut Rng) -> Self {
        let base = if rng.chance(0.3) { DVec3::ZERO } else { rng.in_cube(3.0) };
        let axis = if rng.chance(0.3) { DVec3::Z } else { rng.unit() };
        let r = rng.log(0.2, 2.0);
        Self { base, top: base + axis * rng.log(0.5, 4.0), r0: r, r1: r }
    }

    /// A third of them truncated.
    fn cone(rng: &mut Rng) -> Self {
        let f = Self::cylinder(rng);
        let r1 = if rng.chance(0.33) { f.r0 * rng.uniform(0.0, 1.5) } else { 0.0 };
        Self { r1, ..f }
    }

    /// Few bits, its axis along z or (1, 2, 2); radii 5·2^k and `ratio` times that.
    fn exact(rng: &mut Rng, ratio: f64) -> Self {
        let s = 2f64.powi(rng.integer(-3, 3) as i32);
        let base = rng.small(4);
        let axis = if rng.chance(0.5) { DVec3::new(0.0, 0.0, 4.0) } else { DVec3::new(1.0, 2.0, 2.0) };
        Self { base, top: base + axis * s, r0: 5.0 * s, r1: 5.0 * s * ratio }
    }

    fn cylinder_or_exact(rng: &mut Rng) -> Self {
        if rng.chance(0.5) { Self::cylinder(rng) } else { Self::exact(rng, 1.0) }
    }

    fn cone_or_exact(rng: &mut Rng) -> Self {
        let ratio = rng.pick(&[0.0, 0.5, 2.0]);
        if rng.chance(0.5) { Self::cone(rng) } else { Self::exact(rng, ratio) }
    }

    fn solid(&self) -> Solid {
        Solid::Frustum { base: self.base, top: self.top, base_radius: self.r0, top_radius: self.r1 }
    }

    fn size(&self) -> f64 {
        self.r0.max(self.r1).max((self.top - self.base).length())
    }

    /// Around it: inside about half of the time.
    fn inside(&self, rng: &mut Rng) -> DVec3 {
        let t = rng.uniform(-0.2, 1.2);
        let axis = self.top - self.base;
        self.base + axis * t + rng.across(axis) * (self.r0 + (self.r1 - self.r0) * t) * rng.uniform(0.0, 1.4)
    }

    fn ordinary(&self, rng: &mut Rng) -> Case {
        let (target, distance) = (self.inside(rng), self.size() * rng.uniform(2.0, 10.0));
        super::towards(rng, target, distance, self.solid())
    }

    fn far(&self, rng: &mut Rng, i: usize) -> Case {
        let target = self.inside(rng);
        let axis = (self.top - self.base).normalize();
        let u = if i.is_multiple_of(2) { axis + rng.across(axis) * rng.uniform(-2e-6, 2e-6) } else { rng.unit() };
        Case::new(target - u * 1e6 * self.size(), u * rng.length(), self.solid())
    }

    /// A point of the wall, its normal, and the generator through it (towards the top), nearly.
    fn on_wall(&self, rng: &mut Rng) -> (DVec3, DVec3, DVec3) {
        let axis = self.top - self.base;
        let out = rng.across(axis);
        let t = rng.uniform(0.02, 0.98);
        let generator = (axis + out * (self.r1 - self.r0)).normalize();
        let normal = (out - generator * generator.dot(out)).normalize();
        (self.base + axis * t + out * (self.r0 + (self.r1 - self.r0) * t), normal, generator)
    }

    fn grazed(&self, rng: &mut Rng, distance: f64) -> Case {
        let (p, n, _) = self.on_wall(rng);
        let u = rng.across(n);
        let off = self.r0 * rng.sign() * rng.log(1e-16, 1e-4);
        Case::new(p + n * off - u * distance * self.size(), u * rng.length(), self.solid())
    }

    fn on_surface(&self, rng: &mut Rng, i: usize) -> Case {
        let axis = self.top - self.base;
        let origin = match i % 4 {
            0 | 1 => self.on_wall(rng).0,
            2 => self.base + rng.across(axis) * self.r0 * rng.uniform(0.0, 1.0),
            _ => self.top + rng.across(axis) * self.r1 * rng.uniform(0.0, 1.0),
        };
        let origin = if rng.chance(0.5) { origin } else { nudged_each(origin, 1, rng) };
        Case::new(origin, rng.unit() * rng.length(), self.solid())
    }

    /// A point of a rim, exactly on it where the frustum is exact: (3, 4, 0)/5 for the z axis, (2, −2, 1)/3 and its
    /// like for (1, 2, 2) have no exact multiple 5/3, so only rounded there.
    fn rim(&self, rng: &mut Rng) -> DVec3 {
        let (c, r) = if rng.chance(0.5) { (self.base, self.r0) } else { (self.top, self.r1) };
        let axis = self.top - self.base;
        let out = if axis.x == 0.0 && axis.y == 0.0 && rng.chance(0.7) {
            let (x, y) = rng.pick(&[(3.0, 4.0), (-4.0, 3.0), (5.0, 0.0), (0.0, -5.0), (-3.0, -4.0)]);
            return c + DVec3::new(x, y, 0.0) * (r / 5.0);
        } else {
            rng.across(axis)
        };
        c + out * r
    }

    fn on_rim(&self, rng: &mut Rng, i: usize) -> Case {
        let p = self.rim(rng);
        let axis = self.top - self.base;
        let out = p - self.base;
        let out = out - axis * (out.dot(axis) / axis.dot(axis));
        let d = [axis, -axis, out, -out, axis.cross(out), out - axis * rng.uniform(0.1, 2.0)][i % 6];
        let d = if d == DVec3::ZERO { axis } else { d };
        Case {
            within: if rng.chance(0.5) { Interval::LINE } else { Interval::FORWARD },
            ..Case::new(p, d, self.solid())
        }
    }

    fn at_rim(&self, rng: &mut Rng, i: usize) -> Case {
        let p = self.rim(rng);
        match i % 3 {
            0 => super::exactly_towards(rng, p, self.solid()),
            1 => {
                let distance = rng.log(0.1, 1e4);
                super::towards(rng, p, distance, self.solid())
            }
            _ => {
                let target = nudged_each(p, 2, rng);
                super::exactly_towards(rng, target, self.solid())
            }
        }
    }

    fn in_cap_plane(&self, rng: &mut Rng, i: usize) -> Case {
        let axis = self.top - self.base;
        let c = if i.is_multiple_of(2) { self.base } else { self.top };
        // Perpendicular to z or to (1, 2, 2), exactly.
        let (p, q) =
            if axis.x == 0.0 { (DVec3::X, DVec3::Y) } else { (DVec3::new(2.0, 1.0, -2.0), DVec3::new(0.0, 1.0, -1.0)) };
        let d = p * rng.eighths(2) + q * rng.eighths(2);
        let d = if d == DVec3::ZERO { p } else { d };
        let o = c + p * rng.eighths(4) * self.r0 + q * rng.eighths(1) * self.r0;
        Case { within: Interval::LINE, ..Case::new(o, d, self.solid()) }
    }
}

/// d a multiple of the axis, exactly; origins inside, outside and exactly on the wall.
fn parallel_to_axis(rng: &mut Rng, i: usize) -> Case {
    let f = Parts::exact(rng, 1.0);
    let axis = f.top - f.base;
    let d = axis * rng.sign() * 2f64.powi(rng.integer(-4, 4) as i32);
    let across = if axis.x == 0.0 { DVec3::new(3.0, -4.0, 0.0) / 5.0 } else { DVec3::new(2.0, -2.0, 1.0) / 3.0 };
    // On the wall of the z cylinder exactly: (3, −4)/5·r has few bits.
    let r = match i % 3 {
        0 => f.r0,
        1 => f.r0 * rng.eighths(1),
        _ => nudged(f.r0, rng.integer(-2, 2)),
    };
    let foot = if axis.x == 0.0 { DVec3::new(3.0, -4.0, 0.0) * (r / 5.0) } else { across * r };
    let o = f.base + foot + axis * rng.eighths(3);
    Case { within: if rng.chance(0.5) { Interval::LINE } else { Interval::FORWARD }, ..Case::new(o, d, f.solid()) }
}

/// r = 3, h = 4: generators (3cosφ, 3sinφ, −4), exactly along one through a dyadic point.
fn parallel_to_generator(rng: &mut Rng, i: usize) -> Case {
    let s = 2f64.powi(rng.integer(-3, 3) as i32);
    let base = rng.small(4);
    let r1 = rng.pick(&[0.0, 0.0, 1.5]);
    // With r₁ = 1.5 the same slope takes half the height.
    let top = base + DVec3::new(0.0, 0.0, if r1 == 0.0 { 4.0 } else { 2.0 }) * s;
    let solid = Solid::Frustum { base, top, base_radius: 3.0 * s, top_radius: r1 * s };
    let g = if rng.chance(0.5) { DVec3::new(3.0, 0.0, -4.0) } else { DVec3::new(0.0, -3.0, -4.0) };
    let o = match i % 3 {
        // Through the apex: along the generator itself; beside it; anywhere.
        0 => base + DVec3::new(0.0, 0.0, 4.0) * s + g * rng.eighths(2),
        1 => base + DVec3::new(0.0, 0.0, rng.eighths(4)) * s + g * rng.eighths(2),
        _ => base + rng.small(4) * s,
    };
    Case {
        within: if rng.chance(0.7) { Interval::LINE } else { Interval::FORWARD },
        ..Case::new(o, g * rng.sign(), solid)
    }
}

/// Lines that touch the wall at distance exactly r from the axis.
fn tangent_cylinder(rng: &mut Rng, i: usize) -> Case {
    let s = 2f64.powi(rng.integer(-8, 8) as i32);
    let base = rng.small(4) * s;
    let n = if i.is_multiple_of(2) { 0 } else { rng.integer(-1, 1) };
    let r = nudged(5.0 * s, n);
    let solid = Solid::Frustum { base, top: base + DVec3::Z * 4.0 * s, base_radius: r, top_radius: r };
    // The tangent at (3, 4): along (4, −3), any slope.
    let d = DVec3::new(4.0, -3.0, rng.eighths(2));
    let o = base + DVec3::new(3.0, 4.0, rng.eighths(4).abs()) * s - d * s * rng.eighths(2);
    Case { within: Interval::LINE, ..Case::new(o, d, solid) }
}
