//! The suite `kernels`: rays per second of the ray kernel and the build time of its BVH, against Embree 4
//! if its library is given.
//!
//! All engines trace the same rays in turns, in one process, so that other load affects them equally. A
//! ratio is computed in each round. One thread is measured by its own CPU time.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use domelight::bvh::Bvh;
use domelight::geometry::{Hit, Mesh, Ray, RayBatch, offset_origin};
use domelight::math::{Frame, Vec2, Vec3, vec3};
use domelight::sampling::rng::Pcg32;
use domelight::sampling::warp::cosine_hemisphere;
use domelight::scene::builtin::shapes::icosphere;
use serde::{Deserialize, Serialize};

use super::Bench;
use super::embree::{self, Committed, Embree};
use super::table::{Table, number};
use crate::Error;
use crate::usage::thread_seconds;

/// Measurements of everything.
const ROUNDS: usize = 7;
/// Pixels along an edge of the picture, and of the tiles in which its rays are traced.
const PICTURE: u32 = 512;
const TILE: u32 = 8;
/// Shadow rays of a camera ray's hit.
const SHADOW_RAYS: u32 = 2;
/// Rays that one of two threads takes at a time.
const SHARE: usize = 4096;

/// A mesh, and what each engine does with it.
#[derive(Serialize, Deserialize)]
pub(super) struct Row {
    mesh: String,
    triangles: usize,
    /// Version of Embree, if it took part.
    embree: Option<String>,
    builds: Vec<Build>,
    /// Closest hits of camera rays.
    camera: Vec<Trace>,
    /// Any hit of shadow rays.
    shadow: Vec<Trace>,
    threads: Scaling,
}

/// The build of a tree.
#[derive(Serialize, Deserialize)]
struct Build {
    engine: String,
    cpu_seconds: MedianAndRange,
    /// To Embree's seconds.
    ratio: Option<MedianAndRange>,
    bytes_per_triangle: f64,
}

/// Rays through a tree.
#[derive(Serialize, Deserialize)]
struct Trace {
    engine: String,
    rays: usize,
    /// Rays that hit.
    hits: usize,
    million_rays_per_cpu_second: MedianAndRange,
    /// To the rate of Embree, one ray at a time.
    ratio: Option<MedianAndRange>,
    /// Rays of which Embree thinks otherwise.
    differing: Option<usize>,
}

/// Shadow rays on two threads.
#[derive(Serialize, Deserialize)]
struct Scaling {
    /// CPU time of one thread over that of both together.
    cpu: MedianAndRange,
    /// Wall-clock time of one thread over that of two.
    wall: MedianAndRange,
}

/// The median of the rounds, and the least and the largest.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct MedianAndRange {
    median: f64,
    min: f64,
    max: f64,
}

impl MedianAndRange {
    fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let mut values: Vec<f64> = values.into_iter().collect();
        values.sort_by(f64::total_cmp);
        Self { median: values[values.len() / 2], min: values[0], max: values[values.len() - 1] }
    }

    fn text(&self) -> String {
        let [median, min, max] = [self.median, self.min, self.max].map(number);
        format!("{median} [{min}, {max}]")
    }
}

/// Measures, and keeps each row as it is done.
pub(super) fn run(bench: &Bench, rows: &mut Vec<Row>) -> Result<(), Error> {
    let embree = bench.settings.embree.as_deref().map(Embree::load).transpose()?;
    if embree.is_none() {
        bench.host.status(&format!("without Embree; to get it: {}", embree::HOW_TO_GET));
    }
    for (name, mesh, camera) in [
        ("ball 82k", ball(6), vec3(0.0, 0.0, 3.0)),
        ("ball 1.3M", ball(8), vec3(0.0, 0.0, 3.0)),
        ("clutter 1.3M", clutter(), vec3(0.0, 2.5, 3.5)),
    ] {
        bench.host.check_canceled()?;
        bench.host.status(name);
        rows.push(measure(name, &mesh, camera, embree.as_ref())?);
    }
    Ok(())
}

fn measure(name: &str, mesh: &Mesh, camera: Vec3, embree: Option<&Embree>) -> Result<Row, Error> {
    let (builds, bvh, peer) = build(mesh, embree)?;
    let rays = camera_rays(camera);
    let shadow = shadow_rays(mesh, &bvh, &rays);
    Ok(Row {
        mesh: name.to_owned(),
        triangles: mesh.triangles.len(),
        embree: embree.map(|e| e.version().map(|n| n.to_string()).join(".")),
        builds,
        camera: trace_camera_rays(&bvh, peer.as_ref(), &rays),
        shadow: trace_shadow_rays(&bvh, peer.as_ref(), &shadow),
        threads: scaling(&bvh, &shadow),
    })
}

// ---- meshes and rays -----------------------------------------------------------------------------

/// A bumpy ball of 20 · 4^`subdivisions` triangles.
fn ball(subdivisions: u32) -> Mesh {
    let mut mesh = icosphere(subdivisions);
    for p in &mut mesh.positions {
        let waves = |k: f32| (k * p.x).sin() * (k * p.y + 1.0).sin() * (k * p.z + 2.0).cos();
        *p *= 1.0 + 0.15 * waves(5.0) + 0.02 * waves(37.0);
    }
    mesh
}

/// 250 bumpy balls of all sizes over a floor.
fn clutter() -> Mesh {
    let (part, mut rng) = (ball(4), Pcg32::new(7, 1));
    let mut mesh = Mesh::default();
    let mut add = |positions: &mut dyn Iterator<Item = Vec3>, triangles: &[[u32; 3]]| {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(positions);
        mesh.triangles.extend(triangles.iter().map(|t| t.map(|i| first + i)));
    };
    for _ in 0..250 {
        let radius = 0.05 + 0.2 * rng.next_f32().powi(2);
        let [x, y, z] = [4.0, 1.2, 4.0].map(|width| width * rng.next_f32() - 0.5 * width);
        let center = vec3(x, y + 0.6, z);
        add(&mut part.positions.iter().map(|&p| center + radius * p), &part.triangles);
    }
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    add(&mut corners.iter().map(|[x, z]| vec3(4.0 * x, -0.2, 4.0 * z)), &[[0, 2, 1], [0, 3, 2]]);
    mesh
}

/// Through the middles of all pixels, tile by tile, toward the origin.
fn camera_rays(eye: Vec3) -> Vec<Ray> {
    let z = eye.normalize();
    let x = Vec3::Y.cross(z).normalize();
    let y = z.cross(x);
    let middle = |i: u32| 2.0 * (i as f32 + 0.5) / PICTURE as f32 - 1.0;
    let tiles = PICTURE / TILE;
    let pixel = |i: u32| {
        let (tile, within) = (i / (TILE * TILE), i % (TILE * TILE));
        let column = tile % tiles * TILE + within % TILE;
        let row = tile / tiles * TILE + within / TILE;
        0.45 * (middle(column) * x - middle(row) * y) - z
    };
    (0..PICTURE * PICTURE).map(|i| Ray::new(eye, pixel(i).normalize())).collect()
}

/// Spread over the hemisphere of each hit like its irradiance.
fn shadow_rays(mesh: &Mesh, bvh: &Bvh, rays: &[Ray]) -> RayBatch {
    let mut rng = Pcg32::new(7, 2);
    let extent = bvh.bounds().size().max_element();
    let mut batch = RayBatch::default();
    for ray in rays {
        let Some(hit) = bvh.closest_hit(ray) else { continue };
        let corners = mesh.triangles[hit.triangle as usize].map(|i| mesh.positions[i as usize]);
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).normalize();
        let normal = if normal.dot(ray.direction) > 0.0 { -normal } else { normal };
        let position = a + hit.u * (b - a) + hit.v * (c - a);
        let origin = offset_origin(position, normal, extent);
        for _ in 0..SHADOW_RAYS {
            let u = Vec2::new(rng.next_f32(), rng.next_f32());
            batch.push(origin, Frame::from_z(normal).to_world(cosine_hemisphere(u)));
        }
    }
    batch
}

// ---- measurements --------------------------------------------------------------------------------

type Tree<'a> = (Vec<Build>, Bvh, Option<Committed<'a>>);

fn build<'a>(mesh: &Mesh, embree: Option<&'a Embree>) -> Result<Tree<'a>, Error> {
    let build = || Bvh::build(&mesh.positions, &mesh.triangles);
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let one_thread = one_thread.map_err(|error| Error::Failed(error.to_string()))?;
    let uncommitted = embree.map(|embree| embree.geometry(mesh)).transpose()?;
    let (mut seconds, mut of_peer) = (Vec::new(), Vec::new());
    let (mut bvh, mut peer) = (build()?, None);
    for _ in 0..ROUNDS {
        let (built, time) = one_thread.install(|| timed(build));
        bvh = built?;
        seconds.push(time);
        if let Some(uncommitted) = &uncommitted {
            drop(peer.take());
            let (committed, time) = timed(|| Committed::new(uncommitted));
            peer = Some(committed?);
            of_peer.push(time);
        }
    }
    let per_triangle = |bytes: usize| bytes as f64 / mesh.triangles.len() as f64;
    let mut builds = vec![Build {
        engine: "domelight".to_owned(),
        cpu_seconds: MedianAndRange::of(seconds.iter().copied()),
        ratio: peer
            .as_ref()
            .map(|_| MedianAndRange::of(seconds.iter().zip(&of_peer).map(|(a, b)| a / b))),
        bytes_per_triangle: per_triangle(bvh.bytes()),
    }];
    builds.extend(peer.as_ref().map(|peer| Build {
        engine: "Embree".to_owned(),
        cpu_seconds: MedianAndRange::of(of_peer),
        ratio: Some(MedianAndRange::of([1.0])),
        bytes_per_triangle: per_triangle(peer.bytes()),
    }));
    Ok((builds, bvh, peer))
}

fn trace_camera_rays(bvh: &Bvh, peer: Option<&Committed<'_>>, rays: &[Ray]) -> Vec<Trace> {
    let single = |rays: &[Ray], hits: &mut Vec<Option<Hit>>| {
        hits.clear();
        hits.extend(rays.iter().map(|ray| bvh.closest_hit(ray)));
    };
    let mut engines: Vec<Engine<'_, [Ray], Option<Hit>>> = vec![
        ("domelight, batch", Box::new(|rays, hits| bvh.closest_hits(rays, hits))),
        ("domelight, single", Box::new(single)),
    ];
    if let Some(peer) = peer {
        engines.push((REFERENCE, Box::new(|rays, hits| peer.closest_hits(rays, hits))));
        engines.push((
            "Embree, packets of 16",
            Box::new(|rays, hits| peer.closest_hits_of_packets(rays, hits)),
        ));
    }
    // Another triangle at the same distance is no difference.
    let differ = |a: &Option<Hit>, b: &Option<Hit>| match (a, b) {
        (Some(a), Some(b)) => (a.t - b.t).abs() > 1e-4 * b.t,
        (a, b) => a.is_some() != b.is_some(),
    };
    race(&engines, rays, differ, Option::is_some)
}

fn trace_shadow_rays(bvh: &Bvh, peer: Option<&Committed<'_>>, rays: &RayBatch) -> Vec<Trace> {
    let single = |rays: &RayBatch, occluded: &mut Vec<bool>| {
        let rays = rays.origins.iter().zip(&rays.directions);
        occluded.clear();
        occluded.extend(rays.map(|(&o, &d)| bvh.any_hit(&Ray::new(o, d))));
    };
    let mut engines: Vec<Engine<'_, RayBatch, bool>> = vec![
        ("domelight, batch", Box::new(|rays, occluded| bvh.occluded(rays, occluded))),
        ("domelight, single", Box::new(single)),
    ];
    if let Some(peer) = peer {
        engines.push((REFERENCE, Box::new(|rays, occluded| peer.occluded(rays, occluded))));
        engines.push((
            "Embree, packets of 16",
            Box::new(|rays, occluded| peer.occluded_of_packets(rays, occluded)),
        ));
    }
    race(&engines, rays, |a, b| a != b, |&occluded| occluded)
}

/// What ratios and differences refer to.
const REFERENCE: &str = "Embree, single";

/// A name, and how it answers.
type Engine<'a, Rays, Answer> = (&'static str, Box<dyn Fn(&Rays, &mut Vec<Answer>) + 'a>);

/// Lets the engines answer in turns.
fn race<Rays: ?Sized, Answer>(
    engines: &[Engine<'_, Rays, Answer>],
    rays: &Rays,
    differ: impl Fn(&Answer, &Answer) -> bool,
    is_hit: impl Fn(&Answer) -> bool,
) -> Vec<Trace> {
    let mut seconds: Vec<Vec<f64>> = engines.iter().map(|_| Vec::new()).collect();
    let mut answers: Vec<Vec<Answer>> = engines.iter().map(|_| Vec::new()).collect();
    for _ in 0..ROUNDS {
        for (((_, engine), seconds), answers) in engines.iter().zip(&mut seconds).zip(&mut answers)
        {
            seconds.push(timed(|| engine(rays, answers)).1);
        }
    }
    let reference = engines.iter().position(|(name, _)| *name == REFERENCE);
    let trace = |i: usize| {
        let (own, count) = (&seconds[i], answers[i].len());
        let ratio =
            |r: usize| MedianAndRange::of(seconds[r].iter().zip(own).map(|(r, own)| r / own));
        let differing = |r: usize| {
            answers[i].iter().zip(&answers[r]).filter(|(own, other)| differ(own, other)).count()
        };
        Trace {
            engine: engines[i].0.to_owned(),
            rays: count,
            hits: answers[i].iter().filter(|answer| is_hit(answer)).count(),
            million_rays_per_cpu_second: MedianAndRange::of(
                own.iter().map(|s| count as f64 / s / 1e6),
            ),
            ratio: reference.map(ratio),
            differing: reference.map(differing),
        }
    };
    (0..engines.len()).map(trace).collect()
}

/// Shadow rays on one thread and on two, in turns.
fn scaling(bvh: &Bvh, rays: &RayBatch) -> Scaling {
    let shares: Vec<RayBatch> = (rays.origins.chunks(SHARE).zip(rays.directions.chunks(SHARE)))
        .map(|(o, d)| RayBatch { origins: o.to_vec(), directions: d.to_vec() })
        .collect();
    let mut cpu = Vec::new();
    let mut wall = Vec::new();
    for _ in 0..ROUNDS {
        let [one, two] = [1, 2].map(|threads| trace_on_threads(bvh, &shares, threads));
        cpu.push(one.0 / two.0);
        wall.push(one.1 / two.1);
    }
    Scaling { cpu: MedianAndRange::of(cpu), wall: MedianAndRange::of(wall) }
}

/// CPU seconds of all threads together and wall-clock seconds.
fn trace_on_threads(bvh: &Bvh, shares: &[RayBatch], threads: usize) -> (f64, f64) {
    let next = AtomicUsize::new(0);
    let work = || {
        let mut occluded = Vec::new();
        while let Some(share) = shares.get(next.fetch_add(1, Ordering::Relaxed)) {
            bvh.occluded(share, &mut occluded);
        }
    };
    let start = Instant::now();
    let cpu = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..threads).map(|_| scope.spawn(|| timed(work).1)).collect();
        threads.into_iter().map(|thread| thread.join().expect("it does not panic")).sum()
    });
    (cpu, start.elapsed().as_secs_f64())
}

/// The result and this thread's CPU seconds.
fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let start = thread_seconds();
    let result = work();
    (result, thread_seconds() - start)
}

// ---- tables --------------------------------------------------------------------------------------

pub(super) fn tables(rows: &[Row]) -> Vec<Table> {
    let embree = rows.iter().find_map(|row| row.embree.as_deref());
    let mut tables = vec![
        rays(rows, "Camera rays, closest hit", |row| &row.camera),
        rays(rows, "Shadow rays, any hit", |row| &row.shadow),
        builds(rows),
        threads(rows),
    ];
    if let (Some(table), Some(version)) = (tables.last_mut(), embree) {
        table.notes.push(format!("Embree {version}; ratios are to it, one ray at a time."));
    }
    tables
}

fn rays(rows: &[Row], title: &str, traces: impl Fn(&Row) -> &[Trace]) -> Table {
    let head = ["mesh", "engine", "M rays/CPU-s", "ratio", "hits", "differing", "of rays"];
    let mut table = Table::new(format!("{title}: median and range of {ROUNDS} rounds"), &head);
    for row in rows {
        table.rows.extend(traces(row).iter().map(|trace| {
            vec![
                row.mesh.clone(),
                trace.engine.clone(),
                trace.million_rays_per_cpu_second.text(),
                trace.ratio.map_or(String::new(), |ratio| ratio.text()),
                trace.hits.to_string(),
                trace.differing.map_or(String::new(), |n| n.to_string()),
                trace.rays.to_string(),
            ]
        }));
    }
    table
}

fn builds(rows: &[Row]) -> Table {
    let head = ["mesh", "engine", "triangles", "CPU s", "ratio", "bytes/triangle"];
    let mut table = Table::new("BVH build on one thread", &head);
    for row in rows {
        table.rows.extend(row.builds.iter().map(|build| {
            vec![
                row.mesh.clone(),
                build.engine.clone(),
                row.triangles.to_string(),
                build.cpu_seconds.text(),
                build.ratio.map_or(String::new(), |ratio| ratio.text()),
                number(build.bytes_per_triangle),
            ]
        }));
    }
    table
}

fn threads(rows: &[Row]) -> Table {
    let head = ["mesh", "CPU time of 1 / 2 threads", "wall-clock time of 1 / 2 threads"];
    let mut table = Table::new("Shadow rays on two threads against one", &head);
    table.rows = rows
        .iter()
        .map(|row| vec![row.mesh.clone(), row.threads.cpu.text(), row.threads.wall.text()])
        .collect();
    table
}
