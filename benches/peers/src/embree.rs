//! Embree 4 by `dlopen`: the only file of this package with `unsafe` in it.
//!
//! Layouts and constants are those of Embree 4.4's `rtcore_ray.h`, `rtcore_scene.h`, `rtcore_common.h`,
//! `rtcore_buffer.h` and `rtcore_device.h` (x86-64, `RTC_MAX_INSTANCE_LEVEL_COUNT` 1). `instPrimID` is only there when
//! the library was configured with instance arrays; it comes last, so a structure that has room for it fits both.

use crate::engine::{Engine, Found, MISS, RaySet};
use crate::mesh::Mesh;
use libloading::Library;
use std::ffi::{CStr, c_char, c_void};
use std::path::{Path, PathBuf};
use std::ptr::{null, null_mut};
use std::sync::Arc;
use std::sync::atomic::{AtomicIsize, Ordering};

type Handle = *mut c_void;

/// `RTCRay` followed by `RTCHit`.
#[repr(C, align(16))]
#[derive(Clone, Copy)]
struct RayHit {
    origin: [f32; 3],
    near: f32,
    direction: [f32; 3],
    time: f32,
    far: f32,
    mask: u32,
    id: u32,
    flags: u32,
    normal: [f32; 3],
    u: f32,
    v: f32,
    primitive: u32,
    geometry: u32,
    instance: u32,
    instance_primitive: u32,
    pad: [u32; 3],
}
const _: () = assert!(size_of::<RayHit>() == 96 && std::mem::offset_of!(RayHit, primitive) == 48 + 20);

/// `RTCRay16` followed by `RTCHit16`.
#[repr(C, align(64))]
#[derive(Clone, Copy)]
struct RayHit16 {
    origin: [[f32; 16]; 3],
    near: [f32; 16],
    direction: [[f32; 16]; 3],
    time: [f32; 16],
    far: [f32; 16],
    mask: [u32; 16],
    id: [u32; 16],
    flags: [u32; 16],
    normal: [[f32; 16]; 3],
    u: [f32; 16],
    v: [f32; 16],
    primitive: [u32; 16],
    geometry: [u32; 16],
    instance: [u32; 16],
    instance_primitive: [u32; 16],
}
const _: () =
    assert!(std::mem::offset_of!(RayHit16, normal) == 768 && std::mem::offset_of!(RayHit16, primitive) == 1088);

/// `RTCIntersectArguments` and `RTCOccludedArguments`.
#[repr(C)]
struct Arguments {
    flags: u32,
    features: u32,
    context: *const c_void,
    filter: *const c_void,
    callback: *const c_void,
    min_width: f32,
}
const COHERENT: u32 = 1 << 16;
const ROBUST: u32 = 1 << 2;
const QUALITY_MEDIUM: u32 = 1;
const QUALITY_HIGH: u32 = 2;
const BUFFER_INDEX: u32 = 0;
const BUFFER_VERTEX: u32 = 1;
const FORMAT_UINT3: u32 = 0x5003;
const FORMAT_FLOAT3: u32 = 0x9003;
const GEOMETRY_TRIANGLE: u32 = 0;

type Closest1 = unsafe extern "C" fn(Handle, *mut RayHit, *const Arguments);
type Closest16 = unsafe extern "C" fn(*const i32, Handle, *mut RayHit16, *const Arguments);

/// The loaded library.
pub struct Embree {
    new_device: unsafe extern "C" fn(*const c_char) -> Handle,
    release_device: unsafe extern "C" fn(Handle),
    device_error: unsafe extern "C" fn(Handle) -> u32,
    device_property: unsafe extern "C" fn(Handle, u32) -> isize,
    memory_monitor:
        unsafe extern "C" fn(Handle, Option<unsafe extern "C" fn(*mut c_void, isize, bool) -> bool>, *mut c_void),
    new_geometry: unsafe extern "C" fn(Handle, u32) -> Handle,
    set_shared_buffer: unsafe extern "C" fn(Handle, u32, u32, u32, *const c_void, usize, usize, usize),
    set_geometry_quality: unsafe extern "C" fn(Handle, u32),
    commit_geometry: unsafe extern "C" fn(Handle),
    release_geometry: unsafe extern "C" fn(Handle),
    new_scene: unsafe extern "C" fn(Handle) -> Handle,
    attach: unsafe extern "C" fn(Handle, Handle) -> u32,
    set_flags: unsafe extern "C" fn(Handle, u32),
    set_quality: unsafe extern "C" fn(Handle, u32),
    commit_scene: unsafe extern "C" fn(Handle),
    release_scene: unsafe extern "C" fn(Handle),
    intersect1: Closest1,
    occluded1: Closest1,
    intersect16: Closest16,
    occluded16: Closest16,
    path: PathBuf,
    /// Last, so that the functions go before their code does.
    _library: Library,
}

/// How to get the library.
pub const HOW_TO_GET: &str = "Embree is not raced: no library found.
    pip download --no-deps embreex==4.4.0.post1 && unzip -d embreex embreex-*.whl
    cargo run --release -- --embree embreex/embreex.libs
(any libembree4 of version 4 will do: a file, or a directory that holds it; also as TRUEHIT_EMBREE=path)";

impl Embree {
    /// From a library, a directory that holds one, or, without `path`, from where the loader looks.
    pub fn load(path: Option<&Path>) -> Result<Arc<Self>, String> {
        let file = match path {
            Some(p) if p.is_dir() => std::fs::read_dir(p)
                .map_err(|e| format!("{}: {e}", p.display()))?
                .filter_map(|entry| Some(entry.ok()?.path()))
                .find(|f| f.file_name().is_some_and(|n| n.to_string_lossy().starts_with("libembree4")))
                .ok_or_else(|| format!("{} holds no libembree4*", p.display()))?,
            Some(p) => p.to_owned(),
            None => PathBuf::from("libembree4.so.4"),
        };
        // SAFETY: the library's initialisers are Embree's and TBB's; the symbols below have the signatures of its
        // public headers, whose major version the name carries and `rtcGetDeviceProperty` confirms.
        unsafe {
            let library = Library::new(&file).map_err(|e| format!("{}: {e}", file.display()))?;
            macro_rules! symbol {
                ($name:literal) => {
                    *library.get($name).map_err(|e| e.to_string())?
                };
            }
            Ok(Arc::new(Self {
                new_device: symbol!("rtcNewDevice"),
                release_device: symbol!("rtcReleaseDevice"),
                device_error: symbol!("rtcGetDeviceError"),
                device_property: symbol!("rtcGetDeviceProperty"),
                memory_monitor: symbol!("rtcSetDeviceMemoryMonitorFunction"),
                new_geometry: symbol!("rtcNewGeometry"),
                set_shared_buffer: symbol!("rtcSetSharedGeometryBuffer"),
                set_geometry_quality: symbol!("rtcSetGeometryBuildQuality"),
                commit_geometry: symbol!("rtcCommitGeometry"),
                release_geometry: symbol!("rtcReleaseGeometry"),
                new_scene: symbol!("rtcNewScene"),
                attach: symbol!("rtcAttachGeometry"),
                set_flags: symbol!("rtcSetSceneFlags"),
                set_quality: symbol!("rtcSetSceneBuildQuality"),
                commit_scene: symbol!("rtcCommitScene"),
                release_scene: symbol!("rtcReleaseScene"),
                intersect1: symbol!("rtcIntersect1"),
                occluded1: symbol!("rtcOccluded1"),
                intersect16: symbol!("rtcIntersect16"),
                occluded16: symbol!("rtcOccluded16"),
                path: file,
                _library: library,
            }))
        }
    }

    /// Where it was found, and its version.
    pub fn describe(&self) -> String {
        // SAFETY: a device is made, asked for a property (RTC_DEVICE_PROPERTY_VERSION = 0) and released.
        let version = unsafe {
            let device = (self.new_device)(c"threads=1".as_ptr());
            let version = (self.device_property)(device, 0);
            (self.release_device)(device);
            version
        };
        let file = self.path.file_name().unwrap_or_default().to_string_lossy();
        format!("Embree {}.{}.{} ({file})", version / 10000, version / 100 % 100, version % 100)
    }
}

/// Which Embree.
#[derive(Clone, Copy, Debug)]
pub struct Mode {
    /// `RTC_SCENE_FLAG_ROBUST`; else the default flags with a HIGH quality build, its fastest.
    pub robust: bool,
    /// Packets of 16 instead of single rays.
    pub packets: bool,
}

/// A scene of one mesh.
pub struct Scene {
    embree: Arc<Embree>,
    device: Handle,
    scene: Handle,
    mode: Mode,
    // Shared with Embree while the scene lives. Vertices are read 16 bytes at a time: one float of padding.
    _positions: Vec<f32>,
    _triangles: Vec<[u32; 3]>,
    bytes: Box<Bytes>,
}

#[derive(Default)]
struct Bytes {
    live: AtomicIsize,
    peak: AtomicIsize,
}

unsafe extern "C" fn monitor(bytes: *mut c_void, change: isize, _post: bool) -> bool {
    // SAFETY: `bytes` is the address given to rtcSetDeviceMemoryMonitorFunction, boxed for as long as the device.
    let bytes = unsafe { &*bytes.cast::<Bytes>() };
    let live = bytes.live.fetch_add(change, Ordering::Relaxed) + change;
    bytes.peak.fetch_max(live, Ordering::Relaxed);
    true
}

impl Scene {
    pub fn new(embree: &Arc<Embree>, mesh: &Mesh, mode: Mode, config: &CStr) -> Self {
        let mut positions: Vec<f32> = mesh.positions.iter().flatten().copied().collect();
        positions.push(0.0);
        let triangles = mesh.triangles.clone();
        let bytes = Box::<Bytes>::default();
        let e = embree.as_ref();
        // SAFETY: as the headers ask: handles from the calls that make them, buffers that outlive the scene (they are
        // moved into the returned value, whose `Drop` releases the scene first) and are padded to 16 bytes a vertex.
        let (device, scene) = unsafe {
            let device = (e.new_device)(config.as_ptr());
            assert!(!device.is_null(), "rtcNewDevice: error {}", (e.device_error)(null_mut()));
            (e.memory_monitor)(device, Some(monitor), (&raw const *bytes).cast_mut().cast());
            let geometry = (e.new_geometry)(device, GEOMETRY_TRIANGLE);
            let share = |buffer, format, data: *const c_void, count| {
                (e.set_shared_buffer)(geometry, buffer, 0, format, data, 0, 12, count);
            };
            share(BUFFER_VERTEX, FORMAT_FLOAT3, positions.as_ptr().cast(), mesh.positions.len());
            share(BUFFER_INDEX, FORMAT_UINT3, triangles.as_ptr().cast(), triangles.len());
            // Robust scenes never get spatial splits, so HIGH would only cost them build time.
            let quality = if mode.robust { QUALITY_MEDIUM } else { QUALITY_HIGH };
            (e.set_geometry_quality)(geometry, quality);
            (e.commit_geometry)(geometry);
            let scene = (e.new_scene)(device);
            (e.set_flags)(scene, if mode.robust { ROBUST } else { 0 });
            (e.set_quality)(scene, quality);
            (e.attach)(scene, geometry);
            (e.release_geometry)(geometry);
            (e.commit_scene)(scene);
            let error = (e.device_error)(device);
            assert!(error == 0, "Embree: error {error}");
            (device, scene)
        };
        Self { embree: embree.clone(), device, scene, mode, _positions: positions, _triangles: triangles, bytes }
    }

    fn each_single(&self, set: &RaySet, query: Closest1, mut answer: impl FnMut(usize, &RayHit)) {
        let arguments = arguments(set.coherent);
        for (i, ray) in set.rays.iter().enumerate() {
            let mut query_ray = RayHit {
                origin: ray.origin,
                near: 0.0,
                direction: ray.direction,
                time: 0.0,
                far: ray.max,
                mask: u32::MAX,
                id: 0,
                flags: 0,
                normal: [0.0; 3],
                u: 0.0,
                v: 0.0,
                primitive: MISS,
                geometry: MISS,
                instance: MISS,
                instance_primitive: MISS,
                pad: [0; 3],
            };
            // SAFETY: a committed scene, a ray of the layout above; rtcOccluded1 reads and writes its first 48 bytes.
            unsafe { query(self.scene, &mut query_ray, &arguments) };
            answer(i, &query_ray);
        }
    }

    fn each_packet(&self, set: &RaySet, query: Closest16, mut answer: impl FnMut(usize, &RayHit16, usize)) {
        #[repr(align(64))]
        struct Valid([i32; 16]);
        let arguments = arguments(set.coherent);
        for (p, rays) in set.rays.chunks(16).enumerate() {
            let mut valid = Valid([0; 16]);
            let mut packet = RayHit16 {
                origin: [[0.0; 16]; 3],
                near: [0.0; 16],
                direction: [[0.0; 16]; 3],
                time: [0.0; 16],
                far: [f32::NEG_INFINITY; 16],
                mask: [u32::MAX; 16],
                id: [0; 16],
                flags: [0; 16],
                normal: [[0.0; 16]; 3],
                u: [0.0; 16],
                v: [0.0; 16],
                primitive: [MISS; 16],
                geometry: [MISS; 16],
                instance: [MISS; 16],
                instance_primitive: [MISS; 16],
            };
            for (i, ray) in rays.iter().enumerate() {
                valid.0[i] = -1;
                for axis in 0..3 {
                    packet.origin[axis][i] = ray.origin[axis];
                    packet.direction[axis][i] = ray.direction[axis];
                }
                packet.far[i] = ray.max;
            }
            // SAFETY: as above, for packets, which are aligned to 64 bytes and whose idle lanes are not valid.
            unsafe { query(valid.0.as_ptr(), self.scene, &mut packet, &arguments) };
            for i in 0..rays.len() {
                answer(16 * p + i, &packet, i);
            }
        }
    }
}

fn arguments(coherent: bool) -> Arguments {
    let flags = if coherent { COHERENT } else { 0 };
    Arguments { flags, features: u32::MAX, context: null(), filter: null(), callback: null(), min_width: 0.0 }
}

impl Engine for Scene {
    fn closest(&mut self, set: &RaySet, found: &mut [Found]) {
        let hit = |geometry, triangle, far| {
            if geometry == MISS { Found::MISS } else { Found { triangle, lambda: f64::from(far) } }
        };
        if self.mode.packets {
            self.each_packet(set, self.embree.intersect16, |at, packet, i| {
                found[at] = hit(packet.geometry[i], packet.primitive[i], packet.far[i]);
            });
        } else {
            self.each_single(set, self.embree.intersect1, |at, r| found[at] = hit(r.geometry, r.primitive, r.far));
        }
    }

    fn any(&mut self, set: &RaySet, hit: &mut [bool]) {
        // An occluded ray's end is set to −∞.
        if self.mode.packets {
            self.each_packet(set, self.embree.occluded16, |at, packet, i| hit[at] = packet.far[i] < 0.0);
        } else {
            self.each_single(set, self.embree.occluded1, |at, ray| hit[at] = ray.far < 0.0);
        }
    }

    fn foreign_bytes(&self) -> (usize, usize) {
        let read = |b: &AtomicIsize| b.load(Ordering::Relaxed).max(0).cast_unsigned();
        (read(&self.bytes.live), read(&self.bytes.peak))
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        // SAFETY: each released once, the scene before its device.
        unsafe {
            (self.embree.release_scene)(self.scene);
            (self.embree.release_device)(self.device);
        }
    }
}
