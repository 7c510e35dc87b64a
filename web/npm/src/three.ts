/**
 * A rig in three.js: `DirectionalLight`s, of which the sun and lamps cast shadows, and the residual of the map as environment.
 *
 * three.js has the same axes and units: the world is right-handed with +Y up, and color times intensity of a `DirectionalLight` is
 * the irradiance of a surface that faces it. Its panoramas stand otherwise, which the scene's `environmentRotation` makes up for.
 */

import {
  Box3,
  DataTexture,
  DataUtils,
  DirectionalLight,
  EquirectangularReflectionMapping,
  Euler,
  Group,
  HalfFloatType,
  LightProbe,
  LinearFilter,
  LinearSRGBColorSpace,
  MathUtils,
  RepeatWrapping,
  type Scene,
  Sphere,
  type Texture,
  Vector3,
} from "three";
import type { Light, LightMap, Rig } from "./types.js";

/** The options of `addRig`. */
export interface AddRigOptions {
  /** Which lights cast shadows. Default: the sun and lamps. */
  castShadow?: (light: Light) => boolean;
  /** Columns and rows of a shadow map. Default: 2048. */
  shadowMapSize?: number;
  /** What casts and receives shadows, in world space; a smaller box has finer shadows. Default: the whole scene, as it is now. */
  bounds?: Box3;
  /** Lights the scene by the residual. Default: true. */
  environment?: boolean;
  /** A map to show behind the scene, such as the one that the rig was made of. Default: none. */
  background?: LightMap | null;
}

/** What was added to a scene. */
export interface AddedRig {
  /** The lights and their targets. */
  group: Group;
  /** The residual, if it is the environment. */
  environment: Texture | null;
  /** The map behind the scene, if there is one. */
  background: Texture | null;
}

/** What a scene had before. */
interface Added extends AddedRig {
  restore(): void;
}

const added = new WeakMap<Scene, Added>();

/** Where three.js' panoramas have to stand so that the map's center is where `map` has it: three.js looks for it at +X. */
const rotationOf = ({ rotation }: { rotation: number }) => new Euler(0, MathUtils.degToRad(rotation + 90), 0);

/** The largest number of half precision. */
const LARGEST = 65504;

/** A map as a panorama of half precision, whose filtering all devices can do. */
async function panorama(map: LightMap): Promise<DataTexture> {
  const pixels = await map.pixels(), texels = new Uint16Array(pixels.length), row = 4 * map.width;
  for (let y = 0; y < map.height; y++) {
    // The first row of a DataTexture is the lowest.
    const from = y * row, to = (map.height - 1 - y) * row;
    for (let x = 0; x < row; x++) texels[to + x] = DataUtils.toHalfFloat(Math.min(pixels[from + x]!, LARGEST));
  }
  const texture = new DataTexture(texels, map.width, map.height);
  texture.type = HalfFloatType;
  texture.mapping = EquirectangularReflectionMapping;
  texture.colorSpace = LinearSRGBColorSpace;
  texture.minFilter = texture.magFilter = LinearFilter;
  texture.wrapS = RepeatWrapping;
  texture.name = map.name;
  texture.needsUpdate = true;
  return texture;
}

/** A light that shines across a sphere, to its center. */
function directional(light: Light, { center, radius }: Sphere): DirectionalLight {
  const made = new DirectionalLight(undefined, light.intensity);
  made.name = light.name;
  made.color.setRGB(...light.color, LinearSRGBColorSpace);
  made.target.position.copy(center);
  made.position.copy(center).addScaledVector(new Vector3(...light.direction), 2 * radius);
  return made;
}

/** Shadows of all that is in the sphere. */
function withShadow(light: DirectionalLight, { radius }: Sphere, size: number): void {
  light.castShadow = true;
  light.shadow.mapSize.set(size, size);
  const { camera } = light.shadow;
  [camera.left, camera.right, camera.bottom, camera.top] = [-radius, radius, -radius, radius];
  [camera.near, camera.far] = [radius, 3 * radius];
  camera.updateProjectionMatrix();
  // A texel and a half: surfaces do not shade themselves.
  light.shadow.normalBias = (3 * radius) / size;
}

/**
 * Adds a rig to a scene, in place of one that was added before; `removeRig` takes it back. The renderer draws shadows if its
 * `shadowMap.enabled` is set, of objects with `castShadow` and on those with `receiveShadow`.
 *
 * ```js
 * const map = await load("venice.hdr");
 * await addRig(scene, await lights(map, { sun: true, residual: true }), { background: map });
 * ```
 *
 * Without `residual`, what the lights leave of the map lights matte surfaces alone, by a `LightProbe`. Rejects if +Z is up.
 */
export async function addRig(scene: Scene, rig: Rig, options: AddRigOptions = {}): Promise<AddedRig> {
  const { castShadow = ({ kind }) => kind !== "region", shadowMapSize = 2048, environment = true, background = null } = options;
  if (rig.orientation.up !== "y") throw new Error("+Y is up in scenes of three.js; load the map with up: \"y\"");
  const [residual, behind] = await Promise.all([environment && rig.residual ? panorama(rig.residual) : null, background && panorama(background)]);
  removeRig(scene);
  const bounds = options.bounds ?? new Box3().setFromObject(scene);
  const sphere = bounds.isEmpty() ? new Sphere(new Vector3(), 1) : bounds.getBoundingSphere(new Sphere());
  const group = new Group();
  group.name = "domelight";
  for (const light of rig.lights) {
    const made = directional(light, sphere);
    if (castShadow(light)) withShadow(made, sphere, shadowMapSize);
    group.add(made, made.target);
  }
  if (environment && !residual && rig.harmonics) {
    const probe = new LightProbe();
    probe.sh.fromArray(Array.from(rig.harmonics));
    group.add(probe);
  }
  scene.add(group);
  const before = {
    environment: scene.environment,
    environmentRotation: scene.environmentRotation.clone(),
    background: scene.background,
    backgroundRotation: scene.backgroundRotation.clone(),
  };
  if (residual) {
    scene.environment = residual;
    scene.environmentRotation.copy(rotationOf(rig.orientation));
  }
  if (background && behind) {
    scene.background = behind;
    scene.backgroundRotation.copy(rotationOf(background));
  }
  const restore = () => {
    if (residual && scene.environment === residual) {
      scene.environment = before.environment;
      scene.environmentRotation.copy(before.environmentRotation);
    }
    if (behind && scene.background === behind) {
      scene.background = before.background;
      scene.backgroundRotation.copy(before.backgroundRotation);
    }
  };
  const result: Added = { group, environment: residual, background: behind, restore };
  added.set(scene, result);
  return result;
}

/** Takes back what `addRig` added to a scene, and frees it; does nothing if there is no rig. */
export function removeRig(scene: Scene): void {
  const found = added.get(scene);
  if (!found) return;
  added.delete(scene);
  found.restore();
  scene.remove(found.group);
  for (const object of found.group.children) if (object instanceof DirectionalLight) object.dispose();
  found.environment?.dispose();
  found.background?.dispose();
}
