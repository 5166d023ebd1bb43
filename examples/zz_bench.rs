//! dbg
use truehit::glam::*;
use truehit::*;
use std::time::Instant;
fn main() {
    let mut s = 1u64;
    let mut r = || { s = s.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407); (s >> 11) as f64 / (1u64<<53) as f64 * 2.0 - 1.0 };
    let map = DAffine3 { matrix3: DMat3::from_quat(DQuat::from_axis_angle(DVec3::new(0.6,0.0,0.8), 1.1)) * DMat3::from_diagonal(DVec3::new(1.5,0.7,1.1)), translation: DVec3::new(3.0,-2.0,1.0) };
    let shapes: Vec<(&str, Box<dyn Shape>, Box<dyn Shape>)> = vec![
        ("sphere", Box::new(Sphere::UNIT), Box::new(Affine::new(Sphere::UNIT, map).unwrap())),
        ("triangle", Box::new(Triangle::new([1.0,0.0,0.0],[-1.0,1.0,0.2],[-1.0,-1.0,0.1]).unwrap()), Box::new(Affine::new(Triangle::new([1.0,0.0,0.0],[-1.0,1.0,0.2],[-1.0,-1.0,0.1]).unwrap(), map).unwrap())),
    ];
    let rays: Vec<(Ray, Ray)> = (0..4000).map(|_| { let t = DVec3::new(r(),r(),r())*1.2; let o = DVec3::new(r(),r(),r()).normalize()*5.0; (Ray::new(o, t-o), Ray::new(map.transform_point3(o), map.transform_vector3(t-o))) }).collect();
    for (name, plain, affine) in &shapes {
        for (what, body, k) in [("plain", plain, 0), ("affine", affine, 1)] {
            for (kind, within) in [("closest", Interval::FORWARD), ("limited", Interval::new(0.0, 3.0))] {
            let mut best = f64::INFINITY; let mut hits = 0;
            for _ in 0..30 { hits = 0; let t = Instant::now();
                for x in &rays { let ray = if k == 0 { &x.0 } else { &x.1 }; hits += usize::from(std::hint::black_box(&**body).intersect(std::hint::black_box(ray), within).is_some()); }
                best = best.min(t.elapsed().as_secs_f64() / rays.len() as f64 * 1e9); }
            println!("{name} {what} {kind}: {best:.1} ns, {hits} hits");
        }}
    }
}
