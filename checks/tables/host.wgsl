// What calls the snippet: the points, the samples, and the loop over them.
@group(0) @binding(1) var<storage, read> points: array<vec2<f32>>;
@group(0) @binding(2) var<storage, read_write> samples: array<vec4<f32>>;
@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&points) { return; }
    let s = domelight_sample(points[id.x]);
    samples[2u * id.x] = vec4<f32>(s.direction, s.pdf);
    samples[2u * id.x + 1u] = vec4<f32>(s.radiance, domelight_pdf(s.direction));
}
