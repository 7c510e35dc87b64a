struct DomelightSample { FLOAT3 direction; FLOAT3 radiance; float pdf; };
// The sine of t turns, |t| <= 1/4: those of some graphics cards are off by 0.0005.
FN float domelight_sine(float t) {
    float s = t * t;
    return t * (6.2831855f + s * (-41.34168f + s * (81.602234f + s * (-76.57499f + s * 39.71092f))));
}
// The angle of (x, y) in turns.
FN float domelight_angle(float y, float x) {
    float a = abs(x), b = abs(y), t = min(a, b) / max(max(a, b), 1e-37f), s = t * t;
    float r = ((s * 0.0028498906f - 0.016068636f) * s + 0.042691533f) * s - 0.07504296f;
    r = ((((r * s + 0.10640935f) * s - 0.14203645f) * s + 0.1999262f) * s - 0.33333072f) * s + 1.0f;
    r = a < b ? 0.25f - 0.15915494f * t * r : 0.15915494f * t * r;
    r = x < 0.0f ? 0.5f - r : r; return y < 0.0f ? -r : r;
}
// Whether u is in the second of two parts; stretches that part over [0, 1).
FN bool domelight_split(INOUT_FLOAT u, float first, float second) {
    float at = u * (first + second); bool beyond = at >= first && second > 0.0f;
    u = min(beyond ? (at - first) / second : at / first, 0.99999994f);
    return beyond;
}
// Radiance (xyz) from a unit direction of the world, and the density (w) of domelight_sample there [1/sr].
FN FLOAT4 domelight_look_up(TABLES FLOAT3 d) {
    FLOAT4 size = LOAD(0), right = LOAD(1), up = LOAD(2), back = LOAD(3);
    float x = right.x * d.x + right.y * d.y + right.z * d.z, y = up.x * d.x + up.y * d.y + up.z * d.z;
    float z = back.x * d.x + back.y * d.y + back.z * d.z;
    int column = min(max(int((domelight_angle(x, -z) + 0.5f) * size.x), 0), int(size.x) - 1);
    int row = min(max(int(2.0f * domelight_angle(sqrt(x * x + z * z), y) * size.y), 0), int(size.y) - 1);
    return LOAD(int(size.w) + row * int(size.x) + column);
}
FN float domelight_pdf(TABLES FLOAT3 direction) { return domelight_look_up(PASS direction).w; }
// A direction toward the light, from u in [0, 1)^2.
FN DomelightSample domelight_sample(TABLES FLOAT2 u) {
    FLOAT4 size = LOAD(0), right = LOAD(1), up = LOAD(2), back = LOAD(3);
    int width = int(size.x), height = int(size.y), first = 4, column = 0, row = 0;
    float x = u.x, y = u.y;
    for (int level = int(size.z); level > 0; level--) { // Descend from quarters of the map to a texel.
        int across = (width + (1 << level) - 1) >> level, down = (height + (1 << level) - 1) >> level;
        FLOAT4 four = LOAD(first + row * across + column);
        first += across * down;
        bool lower = domelight_split(y, four.x + four.y, four.z + four.w);
        float left = lower ? four.z : four.x, other = lower ? four.w : four.y;
        column = 2 * column + int(domelight_split(x, left, other)); row = 2 * row + int(lower);
    } // Uniform in solid angle within the texel, measured from the nearer pole, where no digits are lost.
    float turn = (float(column) + min(max(x, right.w), 1.0f - right.w)) / size.x - 0.5f, t = abs(turn);
    bool south = 2 * row >= height;
    float top = float(south ? height - 1 - row : row), down = min(max(south ? 1.0f - y : y, up.w), 1.0f - up.w);
    float inner = domelight_sine(0.25f * top / size.y), outer = domelight_sine(0.25f * (top + 1.0f) / size.y);
    float s = inner * inner + down * (outer * outer - inner * inner), sin_theta = 2.0f * sqrt(s * (1.0f - s));
    float mx = domelight_sine(min(t, 0.5f - t)) * (turn < 0.0f ? -sin_theta : sin_theta);
    float my = south ? 2.0f * s - 1.0f : 1.0f - 2.0f * s, mz = -domelight_sine(0.25f - t) * sin_theta;
    FLOAT4 texel = LOAD(first + row * width + column);
    DomelightSample drawn;
    drawn.direction = NEW_FLOAT3(right.x * mx + up.x * my + back.x * mz, right.y * mx + up.y * my + back.y * mz,
                                 right.z * mx + up.z * my + back.z * mz);
    drawn.radiance = NEW_FLOAT3(texel.x, texel.y, texel.z); drawn.pdf = texel.w;
    return drawn;
}
