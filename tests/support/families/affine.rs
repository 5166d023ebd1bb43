use super::super::cases::{Case, Family, Kernel, Solid};
use super::super::rng::Rng;
use truehit::glam::{DAffine3, DMat3, DQuat, DVec3};

const fn family(number: u32, name: &'static str, generate: fn(&mut Rng, usize) -> Case) -> Family {
    super::family(Kernel::Affine, number, name, generate)
}

/// The case's `object_from_world` is a good inverse; the truth about a shape is asked with the map it stores.
pub const FAMILIES: &[Family] = &[
    family(0, "ordinary", |rng, i| {
        let map = random(rng, 3.0);
        through(rng, i, map)
    }),
    family(66, "scales (1, 1e-8, 1e8)", |rng, i| {
        let map = turned(rng, DMat3::from_diagonal(DVec3::new(1.0, 1e-8, 1e8)));
        through(rng, i, map)
    }),
    family(67, "shear 1e6", |rng, i| {
        let shear = DMat3::from_cols(DVec3::X, DVec3::new(1e6, 1.0, 0.0), DVec3::Z);
        let map = turned(rng, shear);
        through(rng, i, map)
    }),
    family(68, "mirrored", |rng, i| {
        let map = turned(rng, DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)));
        through(rng, i, map)
    }),
    family(70, "condition 1e15", |rng, i| {
        let map = turned(rng, DMat3::from_diagonal(DVec3::new(1e15, 1.0, 1e7)));
        through(rng, i, map)
    }),
    family(71, "unit object at 1e9", |rng, i| {
        let map = DAffine3 { translation: rng.unit() * 1e9, ..random(rng, 0.0) };
        through(rng, i, map)
    }),
    family(1, "grazed through a map", |rng, i| {
        let map = random(rng, 3.0);
        let inner = if i.is_multiple_of(2) {
            let mut sphere = super::sphere::ordinary(rng, i);
            if let Solid::Sphere { center, radius } = sphere.solid {
                let u = rng.unit();
                let impact = radius * (1.0 + rng.sign() * rng.log(1e-16, 1e-4));
                let origin = center + rng.across(u) * impact - u * 3.0 * radius;
                sphere.ray = truehit::Ray { origin, direction: u * rng.length() };
            }
            sphere
        } else {
            let mut triangle = super::flat::ordinary_triangle(rng, i);
            if let Solid::Triangle(v) = triangle.solid {
                let target = v[0].lerp(v[1], rng.uniform(0.0, 1.0));
                let u = rng.unit();
                triangle.ray = truehit::Ray { origin: target - u * 3.0, direction: u * rng.length() };
            }
            triangle
        };
        place(inner, map)
    }),
    family(46, "origin on the surface", |rng, i| {
        let map = random(rng, 3.0);
        let mut inner = super::sphere::ordinary(rng, i);
        if let Solid::Sphere { center, radius } = inner.solid {
            inner.ray.origin = center + rng.unit() * radius;
        }
        place(inner, map)
    }),
    family(72, "a chain of 20", |rng, i| {
        let mut case = super::sphere::ordinary(rng, i);
        for _ in 0..20 {
            let map = random(rng, 3.0);
            case = place(case, map);
        }
        case
    }),
    family(73, "uniform scale 1e±120", |rng, i| {
        let s = 10f64.powf(120.0 * rng.sign());
        let map = turned(rng, DMat3::from_diagonal(DVec3::splat(s)));
        through(rng, i, map)
    }),
    family(85, "scaled until |d'| < 1e-8", |rng, i| {
        let s = rng.log(1e8, 1e12);
        let map = turned(rng, DMat3::from_diagonal(DVec3::splat(s)));
        through(rng, i, map)
    }),
];

/// A rotation, a translation by up to `offset`, a mild stretch.
fn random(rng: &mut Rng, offset: f64) -> DAffine3 {
    let stretch = DVec3::new(rng.log(0.3, 3.0), rng.log(0.3, 3.0), rng.log(0.3, 3.0));
    DAffine3 {
        matrix3: rotation(rng) * DMat3::from_diagonal(stretch) * rotation(rng),
        translation: rng.in_cube(1.0) * offset,
    }
}

fn turned(rng: &mut Rng, matrix: DMat3) -> DAffine3 {
    DAffine3 { matrix3: rotation(rng) * matrix * rotation(rng), translation: rng.in_cube(3.0) }
}

fn rotation(rng: &mut Rng) -> DMat3 {
    DMat3::from_quat(DQuat::from_axis_angle(rng.unit(), rng.uniform(0.0, 6.0)))
}

/// An ordinary ray of an ordinary shape, both taken to the world by `world_from_object`.
fn through(rng: &mut Rng, i: usize, world_from_object: DAffine3) -> Case {
    let inner = match i % 5 {
        0 => super::sphere::ordinary(rng, i),
        1 => super::frustum::ordinary_cylinder(rng, i),
        2 => super::frustum::ordinary_cone(rng, i),
        3 => super::flat::ordinary_triangle(rng, i),
        _ => super::flat::ordinary_plane(rng, i),
    };
    place(inner, world_from_object)
}

/// A case taken to the world by `world_from_object`, ray and all.
fn place(inner: Case, world_from_object: DAffine3) -> Case {
    let origin = world_from_object.transform_point3(inner.ray.origin);
    let direction = world_from_object.transform_vector3(inner.ray.direction);
    let solid = Solid::Affine {
        world_from_object,
        object_from_world: inverse(&world_from_object),
        inner: Box::new(inner.solid),
    };
    Case::new(origin, direction, solid)
}

/// The inverse where the determinant would leave the range of floats, too.
fn inverse(map: &DAffine3) -> DAffine3 {
    let m = map.matrix3;
    let largest = m.to_cols_array().into_iter().fold(0.0, |a: f64, x| a.max(x.abs()));
    let s = 2f64.powi(-largest.log2().floor() as i32);
    let matrix3 = (m * s).inverse() * s;
    DAffine3 { matrix3, translation: -(matrix3 * map.translation) }
}
