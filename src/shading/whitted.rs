//! The global model: the local one at every hit, plus what a perfect mirror sees (Whitted 1980).

use super::color::Rgb;
use super::material::{Material, Mirror, Sides};
use super::{Light, phong};
use crate::kernel::float::unit;
use crate::raster::each_row;
use crate::{Camera, Interval, Raster, Ray, Scene, SceneHit, Surface};
use glam::DVec3;
use std::ops::AddAssign;

/// A scene with its lights: everything a picture needs but the camera.
///
/// E = r_d I_d max(0, s·n) + r_a I_a + r_s I_s max(0, r·c)^α + r_g I_spec, where s, n, r, c are unit vectors and
/// I_spec is E of what the mirrored ray meets. A ray is cast only if its result can matter: no shadow ray where
/// s·n ≤ 0 or the light could add nothing, no mirror ray where r_g = 0, or beyond r_g's range. Rays leave surfaces by
/// [`Surface::spawn`]: there is no shadow bias to tune.
///
/// ```
/// use truehit::shading::{Light, Material, Whitted, color::srgb};
/// use truehit::{Camera, Scene, Sphere};
/// let mut scene = Scene::builder();
/// scene.push(Sphere::UNIT, Material::matt(srgb(200, 60, 40)).with_gloss(0.4, 80.0));
/// let scene = scene.build();
/// let camera = Camera::look_at([0.0, 0.0, 4.0], [0.0; 3], [0.0, 1.0, 0.0], 0.6, [16, 16])?;
/// let rendering = Whitted::new(&scene).light(Light::directional([1.0, 1.0, 1.0], [1.0; 3])).render(&camera, 2);
/// assert_eq!(rendering.rays.camera, 16 * 16 * 2 * 2);
/// # Ok::<(), truehit::InvalidCamera>(())
/// ```
#[derive(Clone, Debug)]
pub struct Whitted<'a> {
    /// What there is.
    pub scene: &'a Scene<Material>,
    /// What shines.
    pub lights: Vec<Light>,
    /// I_a: light from everywhere, a stand-in for what surfaces scatter to each other.
    pub ambient: Rgb,
    /// What a ray sees that meets nothing.
    pub background: Background,
    /// How many mirrors a ray may see behind each other; 0 for none.
    pub depth: u32,
    /// A mirror ray is not cast if no channel of what it brings could count for more than this share of the pixel.
    pub cutoff: f64,
}

/// What a ray sees that meets nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Background {
    /// One colour.
    Uniform(Rgb),
    /// A sky: `horizon` for every level or falling direction, towards `zenith` the higher it goes.
    Sky {
        /// Straight up: a unit vector.
        up: DVec3,
        /// The colour at the horizon and below.
        horizon: Rgb,
        /// The colour overhead.
        zenith: Rgb,
    },
}

impl Background {
    /// The colour seen along `direction`, of any non-zero length.
    #[must_use]
    pub fn color(&self, direction: DVec3) -> Rgb {
        match *self {
            Self::Uniform(color) => color,
            Self::Sky { up, horizon, zenith } => {
                horizon.lerp(zenith, unit(direction).unwrap_or(up).dot(up).clamp(0.0, 1.0))
            }
        }
    }
}

/// How many rays of each kind were cast.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCount {
    /// From the eye.
    pub camera: u64,
    /// Towards a light.
    pub shadow: u64,
    /// Off a mirror.
    pub mirror: u64,
}

impl RayCount {
    /// All of them.
    #[must_use]
    pub fn total(self) -> u64 {
        self.camera + self.shadow + self.mirror
    }
}

impl AddAssign for RayCount {
    fn add_assign(&mut self, other: Self) {
        self.camera += other.camera;
        self.shadow += other.shadow;
        self.mirror += other.mirror;
    }
}

/// A finished picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Rendering {
    /// Linear RGB; [`Raster::to_srgb8`] makes it bytes.
    pub picture: Raster<Rgb>,
    /// What it took.
    pub rays: RayCount,
}

impl<'a> Whitted<'a> {
    /// `scene` without lights or ambient light before a black background; up to 8 mirrors deep, cut off at 1/1000.
    #[must_use]
    pub fn new(scene: &'a Scene<Material>) -> Self {
        Self {
            scene,
            lights: Vec::new(),
            ambient: Rgb::ZERO,
            background: Background::Uniform(Rgb::ZERO),
            depth: 8,
            cutoff: 1e-3,
        }
    }

    /// With one more light.
    #[must_use]
    pub fn light(mut self, light: Light) -> Self {
        self.lights.push(light);
        self
    }

    /// With ambient light I_a.
    #[must_use]
    pub fn ambient(self, ambient: impl Into<Rgb>) -> Self {
        Self { ambient: ambient.into(), ..self }
    }

    /// Before another background.
    #[must_use]
    pub fn background(self, background: Background) -> Self {
        Self { background, ..self }
    }

    /// The picture that `camera` takes with `strata`² rays a pixel. Rows are rendered in parallel with the feature
    /// `rayon`, by the current thread pool; every pixel is the same bits without it.
    #[must_use]
    pub fn render(&self, camera: &Camera, strata: u32) -> Rendering {
        self.render_with(camera, strata, |_| {})
    }

    /// [`render`](Self::render), with `row_done` called after each row with the rays it took, from whichever thread
    /// rendered it: rows finish in no particular order.
    pub fn render_with(&self, camera: &Camera, strata: u32, row_done: impl Fn(RayCount) + Sync) -> Rendering {
        let rows = each_row(camera.height(), |j| {
            let mut rays = RayCount::default();
            let row = self.row(camera, j, strata, &mut rays);
            row_done(rays);
            (row, rays)
        });
        let mut rays = RayCount::default();
        for row in &rows {
            rays += row.1;
        }
        let picture = Raster::assemble(camera.width(), camera.height(), rows.into_iter().map(|row| row.0));
        Rendering { picture, rays }
    }

    /// The pixels of row j, each the mean over its samples.
    fn row(&self, camera: &Camera, j: u32, strata: u32, rays: &mut RayCount) -> Vec<Rgb> {
        let samples = u64::from(strata.clamp(1, 0xFFFF).pow(2));
        let mut row = vec![Rgb::ZERO; camera.width() as usize];
        let end = u64::from(camera.width()) * samples;
        let mut from = 0;
        while from < end {
            let wave = from..(from + WAVE).min(end);
            let ray = |at: u64| camera.sample((at / samples) as u32, j, (at % samples) as u32, strata);
            for (at, color) in wave.clone().zip(self.radiances(wave.clone().map(ray), rays)) {
                row[(at / samples) as usize] += color;
            }
            from = wave.end;
        }
        row.iter().map(|&sum| sum / samples as f64).collect()
    }

    /// E seen along `ray`, in linear RGB.
    #[must_use]
    pub fn radiance(&self, ray: &Ray, rays: &mut RayCount) -> Rgb {
        self.radiances(std::iter::once(*ray), rays)[0]
    }

    /// E seen along each of `camera_rays`, in linear RGB. All of them are followed bounce by bounce together, since
    /// rays of neighbouring pixels, and their shadow rays to one light, are found much faster so; each answer is the
    /// ray's own.
    ///
    /// They are all held in memory: give it some hundreds at a time.
    ///
    /// The recursion E = local + r_g·E' has one branch, so it is a loop.
    #[must_use]
    pub fn radiances(&self, camera_rays: impl IntoIterator<Item = Ray>, rays: &mut RayCount) -> Vec<Rgb> {
        let mut paths: Vec<Path> = camera_rays.into_iter().map(Path::from_camera).collect();
        rays.camera += paths.len() as u64;
        let mut open: Vec<usize> = (0..paths.len()).collect();
        for bounce in 0.. {
            let asked: Vec<(Ray, Interval)> = open.iter().map(|&path| (paths[path].ray, paths[path].within)).collect();
            let mut found = vec![None; asked.len()];
            self.scene.intersect_each(&asked, &mut found);
            let mut seen: Vec<Seen> = Vec::with_capacity(open.len());
            for (&path, found) in open.iter().zip(&found) {
                seen.extend(self.see(path, &mut paths[path], found.as_ref()));
            }
            self.light_up(&mut seen, rays);
            open.clear();
            for Seen { path: index, material, surface, view, local, .. } in &seen {
                let path = &mut paths[*index];
                path.sum += path.share * local;
                let next = path.share * material.mirror.reflectance;
                let reflects = view.front || material.sides == Sides::Both;
                let counts = next.max_element() > self.cutoff.max(0.0);
                if bounce == self.depth || !reflects || !counts {
                    continue;
                }
                rays.mirror += 1;
                path.ray = surface.spawn(view.mirrored());
                path.within = Interval::new(0.0, material.mirror.range);
                path.mirror = Some(material.mirror);
                open.push(*index);
            }
            if open.is_empty() {
                break;
            }
        }
        paths.iter().map(|path| path.sum).collect()
    }

    /// What the path's ray meets, without the lights yet; `None` if nothing comes of it any more.
    fn see(&self, index: usize, path: &mut Path, found: Option<&SceneHit>) -> Option<Seen<'a>> {
        if let Some(mirror) = path.mirror {
            path.share *= mirror.at(found.map_or(f64::INFINITY, |f| f.hit.lambda));
            if path.share == Rgb::ZERO {
                return None;
            }
        }
        let Some(found) = found else {
            path.sum += path.share * self.background.color(path.ray.direction);
            return None;
        };
        let material = self.scene.tag(found.object);
        let surface = self.scene.surface(&path.ray, found);
        let view = View::new(&surface, path.ray.direction);
        let (ambient, diffuse) = material.modulated(|| surface.texture_coordinates());
        Some(Seen { path: index, material, surface, view, diffuse, local: ambient * self.ambient })
    }

    /// Adds r_d I_d max(0, s·n) + r_s I_s max(0, r·c)^α of each light that is not in shadow.
    fn light_up(&self, seen: &mut [Seen], rays: &mut RayCount) {
        for light in &self.lights {
            let mut lit: Vec<(usize, Rgb)> = Vec::with_capacity(seen.len());
            let mut asked: Vec<(Ray, Interval)> = Vec::with_capacity(seen.len());
            for (index, seen) in seen.iter().enumerate() {
                let color = seen.under(light);
                if color != Rgb::ZERO {
                    lit.push((index, color));
                    asked.push(light.shadow_ray(&seen.surface));
                }
            }
            rays.shadow += asked.len() as u64;
            let mut dark = vec![false; asked.len()];
            self.scene.occludes_each(&asked, &mut dark);
            for (&(index, color), dark) in lit.iter().zip(dark) {
                if !dark {
                    seen[index].local += color;
                }
            }
        }
    }
}

/// How many rays are followed together: enough to fill many bundles, few enough to stay in the cache.
const WAVE: u64 = 512;

/// A camera ray and what has been seen along it so far.
struct Path {
    ray: Ray,
    within: Interval,
    sum: Rgb,
    /// The product of the r_g so far.
    share: Rgb,
    /// The mirror that `ray` comes from. Mirrored rays have unit directions, so their λ is a distance.
    mirror: Option<Mirror>,
}

impl Path {
    fn from_camera(ray: Ray) -> Self {
        Self { ray, within: Interval::FORWARD, sum: Rgb::ZERO, share: Rgb::ONE, mirror: None }
    }
}

/// Where a path's ray has met something.
struct Seen<'a> {
    path: usize,
    material: &'a Material,
    surface: Surface<'a>,
    view: View,
    /// r_d under the texture.
    diffuse: Rgb,
    /// r_a I_a, and what the lights add.
    local: Rgb,
}

impl Seen<'_> {
    /// What `light` adds here if nothing is in the way.
    fn under(&self, light: &Light) -> Rgb {
        let Self { material, surface, view, diffuse, .. } = self;
        if !view.front && material.sides == Sides::Front {
            return Rgb::ZERO;
        }
        let (n, facet) = (view.normal, view.facet);
        let incident = light.incident(surface.point());
        let s = incident.direction;
        // The light must be above the surface itself, not only above the interpolated normal's idea of it.
        if !(s.dot(n) > 0.0 && s.dot(facet) > 0.0) {
            return Rgb::ZERO;
        }
        let lit = diffuse * phong::diffuse(s, n)
            + material.specular * phong::specular(s, n, view.to_camera, material.shininess);
        phong::terminator(s, n, facet) * lit * incident.intensity
    }
}

/// How a surface is seen: the normals, turned to the side the ray comes from.
struct View {
    /// c, a unit vector.
    to_camera: DVec3,
    /// Whether the ray meets the side that the geometric normal points to.
    front: bool,
    /// The geometric normal on that side.
    facet: DVec3,
    /// The shading normal on that side.
    normal: DVec3,
}

impl View {
    fn new(surface: &Surface<'_>, direction: DVec3) -> Self {
        let to_camera = -unit(direction).unwrap_or(DVec3::NAN);
        let front = to_camera.dot(surface.normal()) >= 0.0;
        let turned = |n: DVec3| if front { n } else { -n };
        Self { to_camera, front, facet: turned(surface.normal()), normal: turned(surface.shading_normal()) }
    }

    /// The direction in which the mirror looks, a unit vector that leaves the surface on the camera's side.
    fn mirrored(&self) -> DVec3 {
        let r = phong::reflect(self.to_camera, self.normal);
        let above = r.dot(self.facet);
        // Under an interpolated normal r may dip below the facet, which mirrors it back up.
        (if above < 0.0 { r - 2.0 * above * self.facet } else { r }).normalize()
    }
}
