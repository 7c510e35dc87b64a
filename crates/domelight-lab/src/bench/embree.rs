//! Embree 4, loaded at run time, as the peer of the ray kernel.
//!
//! The declarations follow the headers of Embree 4 (rtcore_device.h, rtcore_scene.h, rtcore_ray.h); one
//! thread, default build quality, no flags.
#![allow(unsafe_code)]

use std::ffi::{c_char, c_uint, c_void};
use std::mem::ManuallyDrop;
use std::path::Path;
use std::ptr::{null, null_mut};
use std::sync::atomic::{AtomicIsize, Ordering};

use domelight::geometry::{Hit, Mesh, Ray, RayBatch};
use domelight::math::Vec3;
use libloading::Library;

use crate::Error;

/// Where the library comes from.
pub(super) const HOW_TO_GET: &str = "pip download --no-deps embreex && unzip embreex-*.whl 'embreex.libs/*', \
     then --embree embreex.libs/libembree4-*.so.4";

const NONE: u32 = u32::MAX;
/// Rays of a packet.
const PACKET: usize = 16;

/// `RTCRay`
#[repr(C, align(16))]
#[derive(Clone, Copy)]
struct RtcRay {
    origin: [f32; 3],
    t_near: f32,
    direction: [f32; 3],
    time: f32,
    t_far: f32,
    mask: u32,
    id: u32,
    flags: u32,
}

impl RtcRay {
    fn new(ray: &Ray) -> Self {
        Self {
            origin: ray.origin.to_array(),
            t_near: 0.0,
            direction: ray.direction.to_array(),
            time: 0.0,
            t_far: ray.t_max,
            mask: u32::MAX,
            id: 0,
            flags: 0,
        }
    }
}

/// `RTCHit` for one level of instances, and room for those of a library with more.
#[repr(C, align(16))]
#[derive(Clone, Copy)]
struct RtcHit {
    normal: [f32; 3],
    u: f32,
    v: f32,
    triangle: u32,
    geometry: u32,
    instances: [u32; 4],
}

impl RtcHit {
    const NONE: Self = Self {
        normal: [0.0; 3],
        u: 0.0,
        v: 0.0,
        triangle: NONE,
        geometry: NONE,
        instances: [NONE; 4],
    };
}

/// `RTCRayHit`
#[repr(C)]
struct RtcRayHit {
    ray: RtcRay,
    hit: RtcHit,
}

/// -1 for a lane with a ray, 0 for one without.
#[repr(C, align(64))]
struct Active([i32; PACKET]);

/// `RTCRay16`
#[repr(C, align(64))]
#[derive(Clone, Copy)]
struct RtcRays {
    origins: [[f32; PACKET]; 3],
    t_near: [f32; PACKET],
    directions: [[f32; PACKET]; 3],
    time: [f32; PACKET],
    t_far: [f32; PACKET],
    mask: [u32; PACKET],
    id: [u32; PACKET],
    flags: [u32; PACKET],
}

impl RtcRays {
    /// The first sixteen rays.
    fn new(rays: impl Iterator<Item = Ray>) -> (Self, Active) {
        let mut packet = Self {
            origins: [[0.0; PACKET]; 3],
            t_near: [0.0; PACKET],
            directions: [[0.0; PACKET]; 3],
            time: [0.0; PACKET],
            t_far: [0.0; PACKET],
            mask: [u32::MAX; PACKET],
            id: [0; PACKET],
            flags: [0; PACKET],
        };
        let mut active = Active([0; PACKET]);
        for (lane, ray) in rays.take(PACKET).enumerate() {
            for axis in 0..3 {
                packet.origins[axis][lane] = ray.origin[axis];
                packet.directions[axis][lane] = ray.direction[axis];
            }
            packet.t_far[lane] = ray.t_max;
            active.0[lane] = -1;
        }
        (packet, active)
    }
}

/// `RTCHit16`, with the same room.
#[repr(C, align(64))]
#[derive(Clone, Copy)]
struct RtcHits {
    normals: [[f32; PACKET]; 3],
    u: [f32; PACKET],
    v: [f32; PACKET],
    triangle: [u32; PACKET],
    geometry: [u32; PACKET],
    instances: [[u32; PACKET]; 4],
}

/// `RTCRayHit16`
#[repr(C)]
struct RtcRaysHits {
    rays: RtcRays,
    hits: RtcHits,
}

/// `RTCIntersectArguments` and `RTCOccludedArguments`, and room for what a version may add.
#[repr(C)]
struct RtcArguments {
    flags: c_uint,
    features: c_uint,
    context: *mut c_void,
    filter: *const c_void,
    function: *const c_void,
    more: [u64; 4],
}

impl RtcArguments {
    const COHERENT: c_uint = 1 << 16;

    fn new(flags: c_uint) -> Self {
        Self {
            flags,
            features: c_uint::MAX,
            context: null_mut(),
            filter: null(),
            function: null(),
            more: [0; 4],
        }
    }
}

type Device = *mut c_void;
type Scene = *mut c_void;
type Geometry = *mut c_void;
type MemoryMonitor = extern "C" fn(*mut c_void, isize, bool) -> bool;

macro_rules! functions {
    ($($name:ident($($argument:ty),*) $(-> $result:ty)?;)*) => {
        /// Those of the library that are used.
        #[allow(non_snake_case)]
        struct Functions {
            $($name: unsafe extern "C" fn($($argument),*) $(-> $result)?,)*
        }

        impl Functions {
            fn find(library: &Library) -> Result<Self, libloading::Error> {
                // SAFETY: the types are those of Embree 4's headers.
                unsafe {
                    Ok(Self { $($name: *library.get(concat!(stringify!($name), "\0"))?,)* })
                }
            }
        }
    };
}
functions! {
    rtcNewDevice(*const c_char) -> Device;
    rtcReleaseDevice(Device);
    rtcGetDeviceProperty(Device, c_uint) -> isize;
    rtcGetDeviceError(Device) -> c_uint;
    rtcSetDeviceMemoryMonitorFunction(Device, MemoryMonitor, *mut c_void);
    rtcNewScene(Device) -> Scene;
    rtcReleaseScene(Scene);
    rtcNewGeometry(Device, c_uint) -> Geometry;
    rtcReleaseGeometry(Geometry);
    rtcSetNewGeometryBuffer(Geometry, c_uint, c_uint, c_uint, usize, usize) -> *mut c_void;
    rtcCommitGeometry(Geometry);
    rtcAttachGeometry(Scene, Geometry) -> c_uint;
    rtcCommitScene(Scene);
    rtcIntersect1(Scene, *mut RtcRayHit, *mut RtcArguments);
    rtcIntersect16(*const i32, Scene, *mut RtcRaysHits, *mut RtcArguments);
    rtcOccluded1(Scene, *mut RtcRay, *mut RtcArguments);
    rtcOccluded16(*const i32, Scene, *mut RtcRays, *mut RtcArguments);
}

/// Bytes that the library holds, of all devices.
static BYTES: AtomicIsize = AtomicIsize::new(0);

extern "C" fn count_bytes(_: *mut c_void, bytes: isize, _: bool) -> bool {
    BYTES.fetch_add(bytes, Ordering::Relaxed);
    true
}

/// The library and a device of one thread.
pub(super) struct Embree {
    functions: Functions,
    device: Device,
    /// Never unloaded: threads of the library may still run its code at the end of the process.
    _library: ManuallyDrop<Library>,
}

impl Embree {
    /// Loads the library; what is wrong with it is a usage error.
    pub(super) fn load(path: &Path) -> Result<Self, Error> {
        let usage = |why: String| Error::Usage(format!("--embree {}: {why}", path.display()));
        // SAFETY: the user names Embree's library, whose initializers have no preconditions.
        let library = unsafe { Library::new(path) }
            .map_err(|error| usage(format!("{error}; to get the library: {HOW_TO_GET}")))?;
        let functions = Functions::find(&library)
            .map_err(|error| usage(format!("this is not Embree 4 ({error})")))?;
        // SAFETY: the configuration is a C string.
        let device = unsafe { (functions.rtcNewDevice)(c"threads=1".as_ptr()) };
        if device.is_null() {
            return Err(Error::Failed("Embree cannot create a device".into()));
        }
        let embree = Self { functions, device, _library: ManuallyDrop::new(library) };
        let [major, minor, patch] = embree.version();
        if major != 4 {
            let why = format!("this is Embree {major}.{minor}.{patch}, and 4 is needed");
            return Err(usage(why));
        }
        // SAFETY: the device lives; the function touches nothing but a static number.
        unsafe {
            let monitor = embree.functions.rtcSetDeviceMemoryMonitorFunction;
            monitor(embree.device, count_bytes, null_mut());
        };
        Ok(embree)
    }

    /// Major, minor, patch.
    pub(super) fn version(&self) -> [isize; 3] {
        // SAFETY: the device lives; 1, 2 and 3 are RTC_DEVICE_PROPERTY_VERSION_MAJOR, _MINOR and _PATCH.
        [1, 2, 3]
            .map(|property| unsafe { (self.functions.rtcGetDeviceProperty)(self.device, property) })
    }

    /// Copies the mesh; the tree is built by [`Committed::new`].
    pub(super) fn geometry(&self, mesh: &Mesh) -> Result<Uncommitted<'_>, Error> {
        const TRIANGLES: c_uint = 0;
        const INDEX: c_uint = 0;
        const VERTEX: c_uint = 1;
        const UINT3: c_uint = 0x5003;
        const FLOAT3: c_uint = 0x9003;
        let f = &self.functions;
        // SAFETY: the device lives; each buffer is checked, has room for all elements of 12 bytes and
        // is written before anything reads it.
        unsafe {
            let geometry = (f.rtcNewGeometry)(self.device, TRIANGLES);
            let uncommitted = Uncommitted { embree: self, geometry };
            let buffer =
                |kind, format, len| (f.rtcSetNewGeometryBuffer)(geometry, kind, 0, format, 12, len);
            let triangles = buffer(INDEX, UINT3, mesh.triangles.len()).cast::<[u32; 3]>();
            let positions = buffer(VERTEX, FLOAT3, mesh.positions.len()).cast::<Vec3>();
            if triangles.is_null() || positions.is_null() {
                return Err(Error::Failed("Embree rejects the mesh".into()));
            }
            triangles.copy_from_nonoverlapping(mesh.triangles.as_ptr(), mesh.triangles.len());
            positions.copy_from_nonoverlapping(mesh.positions.as_ptr(), mesh.positions.len());
            Ok(uncommitted)
        }
    }
}

impl Drop for Embree {
    fn drop(&mut self) {
        // SAFETY: made by rtcNewDevice, released once; nothing made of it outlives the borrow of `self`.
        unsafe { (self.functions.rtcReleaseDevice)(self.device) };
    }
}

/// A mesh without a tree.
pub(super) struct Uncommitted<'a> {
    embree: &'a Embree,
    geometry: Geometry,
}

impl Drop for Uncommitted<'_> {
    fn drop(&mut self) {
        // SAFETY: made by rtcNewGeometry, released once; a scene keeps its own reference.
        unsafe { (self.embree.functions.rtcReleaseGeometry)(self.geometry) };
    }
}

/// A tree to trace rays through.
pub(super) struct Committed<'a> {
    embree: &'a Embree,
    scene: Scene,
    bytes: usize,
}

impl<'a> Committed<'a> {
    /// Builds the tree.
    pub(super) fn new(mesh: &Uncommitted<'a>) -> Result<Self, Error> {
        let f = &mesh.embree.functions;
        let before = BYTES.load(Ordering::Relaxed);
        // SAFETY: device and geometry live.
        let (scene, error) = unsafe {
            let scene = (f.rtcNewScene)(mesh.embree.device);
            (f.rtcCommitGeometry)(mesh.geometry);
            (f.rtcAttachGeometry)(scene, mesh.geometry);
            (f.rtcCommitScene)(scene);
            (scene, (f.rtcGetDeviceError)(mesh.embree.device))
        };
        let bytes = BYTES.load(Ordering::Relaxed).wrapping_sub(before) as usize;
        let committed = Self { embree: mesh.embree, scene, bytes };
        if error != 0 {
            return Err(Error::Failed(format!("Embree cannot build its BVH: error {error}")));
        }
        Ok(committed)
    }

    /// What the tree takes beside vertices and indices.
    pub(super) fn bytes(&self) -> usize {
        self.bytes
    }

    /// The closest hit of each ray, one ray at a time.
    pub(super) fn closest_hits(&self, rays: &[Ray], hits: &mut Vec<Option<Hit>>) {
        let mut arguments = RtcArguments::new(RtcArguments::COHERENT);
        hits.clear();
        hits.extend(rays.iter().map(|ray| {
            let mut query = RtcRayHit { ray: RtcRay::new(ray), hit: RtcHit::NONE };
            // SAFETY: the scene is committed; ray and arguments are aligned and writable.
            unsafe {
                (self.embree.functions.rtcIntersect1)(
                    self.scene,
                    &raw mut query,
                    &raw mut arguments,
                );
            };
            let RtcHit { u, v, triangle, geometry, .. } = query.hit;
            (geometry != NONE).then_some(Hit { t: query.ray.t_far, u, v, triangle })
        }));
    }

    /// The same in packets of sixteen.
    pub(super) fn closest_hits_of_packets(&self, rays: &[Ray], hits: &mut Vec<Option<Hit>>) {
        let mut arguments = RtcArguments::new(RtcArguments::COHERENT);
        hits.clear();
        for rays in rays.chunks(PACKET) {
            let (packet, active) = RtcRays::new(rays.iter().copied());
            let none = RtcHits {
                normals: [[0.0; PACKET]; 3],
                u: [0.0; PACKET],
                v: [0.0; PACKET],
                triangle: [NONE; PACKET],
                geometry: [NONE; PACKET],
                instances: [[NONE; PACKET]; 4],
            };
            let mut query = RtcRaysHits { rays: packet, hits: none };
            // SAFETY: the scene is committed; rays, lanes and arguments are aligned, rays writable.
            unsafe {
                let intersect = self.embree.functions.rtcIntersect16;
                intersect(active.0.as_ptr(), self.scene, &raw mut query, &raw mut arguments);
            };
            let (t, h) = (&query.rays.t_far, &query.hits);
            hits.extend((0..rays.len()).map(|i| {
                let hit = Hit { t: t[i], u: h.u[i], v: h.v[i], triangle: h.triangle[i] };
                (h.geometry[i] != NONE).then_some(hit)
            }));
        }
    }

    /// Whether each ray hits anything, one ray at a time.
    pub(super) fn occluded(&self, rays: &RayBatch, occluded: &mut Vec<bool>) {
        let mut arguments = RtcArguments::new(0);
        occluded.clear();
        occluded.extend(rays.origins.iter().zip(&rays.directions).map(|(&origin, &direction)| {
            let mut query = RtcRay::new(&Ray::new(origin, direction));
            // SAFETY: the scene is committed; ray and arguments are aligned and writable.
            unsafe {
                (self.embree.functions.rtcOccluded1)(
                    self.scene,
                    &raw mut query,
                    &raw mut arguments,
                );
            };
            query.t_far < 0.0
        }));
    }

    /// The same in packets of sixteen.
    pub(super) fn occluded_of_packets(&self, rays: &RayBatch, occluded: &mut Vec<bool>) {
        let mut arguments = RtcArguments::new(0);
        occluded.clear();
        for (origins, directions) in rays.origins.chunks(PACKET).zip(rays.directions.chunks(PACKET))
        {
            let rays = origins.iter().zip(directions).map(|(&o, &d)| Ray::new(o, d));
            let (mut packet, active) = RtcRays::new(rays);
            // SAFETY: the scene is committed; rays, lanes and arguments are aligned, rays writable.
            unsafe {
                let occluded = self.embree.functions.rtcOccluded16;
                occluded(active.0.as_ptr(), self.scene, &raw mut packet, &raw mut arguments);
            };
            occluded.extend(packet.t_far[..origins.len()].iter().map(|&t| t < 0.0));
        }
    }
}

impl Drop for Committed<'_> {
    fn drop(&mut self) {
        // SAFETY: made by rtcNewScene, released once.
        unsafe { (self.embree.functions.rtcReleaseScene)(self.scene) };
    }
}
