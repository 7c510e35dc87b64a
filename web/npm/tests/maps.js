// Small maps as files, and integrals over them.

/** A PFM of r, g and b of each texel, from the top left. */
export function pfm(width, height, texel) {
  const header = Buffer.from(`PF\n${width} ${height}\n-1.0\n`);
  const texels = new Float32Array(3 * width * height);
  // The lowest row is first.
  for (let y = 0; y < height; y++) for (let x = 0; x < width; x++) texels.set(texel(x, height - 1 - y), 3 * (y * width + x));
  return new Uint8Array(Buffer.concat([header, Buffer.from(texels.buffer)]));
}

export const WIDTH = 64, HEIGHT = 32;
const SUN = { x: 40, y: 8, radiance: [4000, 3500, 2500] };

/** A blue sky over brown ground, with a sun of one texel. */
export const sunny = () => pfm(WIDTH, HEIGHT, (x, y) => {
  if (x === SUN.x && y === SUN.y) return SUN.radiance;
  return y < HEIGHT / 2 ? [0.4, 0.6, 1] : [0.2, 0.15, 0.1];
});

/** The solid angle of a texel of a row. */
export const solidAngle = (y, width = WIDTH, height = HEIGHT) =>
  (2 * Math.PI / width) * (Math.cos(Math.PI * y / height) - Math.cos(Math.PI * (y + 1) / height));

/** The direction of a place of a map that is not turned, in texels: the center column is toward −Z. */
export function direction(x, y, width = WIDTH, height = HEIGHT) {
  const azimuth = 2 * Math.PI * (x / width - 0.5), polar = Math.PI * y / height;
  return [Math.sin(polar) * Math.sin(azimuth), Math.cos(polar), -Math.sin(polar) * Math.cos(azimuth)];
}

/** The direction and the irradiance of the sun, without the sky that its texel would have. */
export const sun = {
  direction: direction(SUN.x + 0.5, SUN.y + 0.5),
  irradiance: SUN.radiance.map((l) => l * solidAngle(SUN.y)),
};

/** ∫ L dω of a map's texels, 4 numbers each. */
export function irradiance(pixels, width = WIDTH, height = HEIGHT) {
  const sums = [0, 0, 0];
  for (let i = 0; i < width * height; i++) {
    const weight = solidAngle(Math.floor(i / width), width, height);
    for (let c = 0; c < 3; c++) sums[c] += weight * pixels[4 * i + c];
  }
  return sums;
}

/** The angle between two unit vectors [degrees]. */
export function angle(a, b) {
  const cross = Math.hypot(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]);
  return Math.atan2(cross, a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) * 180 / Math.PI;
}
