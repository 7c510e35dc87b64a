@group(0) @binding(0) var<storage, read> domelight_tables: array<vec4<f32>>;
struct DomelightSample { direction: vec3<f32>, radiance: vec3<f32>, pdf: f32 }
// The sine of t turns, |t| <= 1/4: those of some graphics cards are off by 0.0005.
fn domelight_sine(t: f32) -> f32 {
    let s = t * t;
    return t * (6.2831855 + s * (-41.34168 + s * (81.602234 + s * (-76.57499 + s * 39.71092))));
}
// The angle of (x, y) in turns.
fn domelight_angle(y: f32, x: f32) -> f32 {
    let t = min(abs(x), abs(y)) / max(max(abs(x), abs(y)), 1e-37); let s = t * t;
    var r = ((s * 0.0028498906 - 0.016068636) * s + 0.042691533) * s - 0.07504296;
    r = ((((r * s + 0.10640935) * s - 0.14203645) * s + 0.1999262) * s - 0.33333072) * s + 1.0;
    r = 0.15915494 * t * r;
    r = select(r, 0.25 - r, abs(x) < abs(y));
    r = select(r, 0.5 - r, x < 0.0);
    return select(r, -r, y < 0.0);
}
// Whether u is in the second of two parts; stretches that part over [0, 1).
fn domelight_split(u: ptr<function, f32>, first: f32, second: f32) -> bool {
    let at = *u * (first + second);
    let beyond = at >= first && second > 0.0;
    if beyond { *u = (at - first) / second; } else { *u = at / first; }
    *u = min(*u, 0.99999994);
    return beyond;
}
// From the map's own axes to the world; its transpose is the way back.
fn domelight_to_world() -> mat3x3<f32> {
    return mat3x3<f32>(domelight_tables[1].xyz, domelight_tables[2].xyz, domelight_tables[3].xyz);
}
// Radiance (xyz) from a unit direction of the world, and the density (w) of domelight_sample there [1/sr].
fn domelight_look_up(direction: vec3<f32>) -> vec4<f32> {
    let size = domelight_tables[0]; let d = transpose(domelight_to_world()) * direction;
    let column = clamp(i32((domelight_angle(d.x, -d.z) + 0.5) * size.x), 0, i32(size.x) - 1);
    let row = clamp(i32(2.0 * domelight_angle(length(d.xz), d.y) * size.y), 0, i32(size.y) - 1);
    return domelight_tables[i32(size.w) + row * i32(size.x) + column];
}
fn domelight_pdf(direction: vec3<f32>) -> f32 { return domelight_look_up(direction).w; }
// A direction toward the light, from u in [0, 1)^2.
fn domelight_sample(u: vec2<f32>) -> DomelightSample {
    let size = domelight_tables[0]; let margin = vec2<f32>(domelight_tables[1].w, domelight_tables[2].w);
    let width = i32(size.x); let height = i32(size.y);
    var first = 4; var at = vec2<i32>(0, 0); var x = u.x; var y = u.y;
    for (var level = u32(size.z); level > 0u; level--) { // Descend from quarters of the map to a texel.
        let across = (width + (1 << level) - 1) >> level; let down = (height + (1 << level) - 1) >> level;
        let four = domelight_tables[first + at.y * across + at.x];
        first += across * down;
        let lower = domelight_split(&y, four.x + four.y, four.z + four.w);
        let pair = select(four.xy, four.zw, lower);
        at = 2 * at + vec2<i32>(i32(domelight_split(&x, pair.x, pair.y)), i32(lower));
    } // Uniform in solid angle within the texel, measured from the nearer pole, where no digits are lost.
    let turn = (f32(at.x) + clamp(x, margin.x, 1.0 - margin.x)) / size.x - 0.5; let t = abs(turn);
    let south = 2 * at.y >= height; let top = f32(select(at.y, height - 1 - at.y, south));
    let inner = domelight_sine(0.25 * top / size.y); let outer = domelight_sine(0.25 * (top + 1.0) / size.y);
    let s = inner * inner + clamp(select(y, 1.0 - y, south), margin.y, 1.0 - margin.y) * (outer * outer - inner * inner);
    let across = 2.0 * sqrt(s * (1.0 - s)) * vec2<f32>(sign(turn) * domelight_sine(min(t, 0.5 - t)), -domelight_sine(0.25 - t));
    let d = vec3<f32>(across.x, select(1.0 - 2.0 * s, 2.0 * s - 1.0, south), across.y);
    let texel = domelight_tables[first + at.y * width + at.x];
    return DomelightSample(domelight_to_world() * d, texel.xyz, texel.w);
}
