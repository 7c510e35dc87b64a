// The engine that also renders scenes, and reads PNG and JPEG.

import * as engine from "./full/engine.js";
import { callsOf, using } from "./calls.js";

const { maps, ...ofMaps } = callsOf(engine, new URL("./full/engine_bg.wasm", import.meta.url));

export const calls = {
  ...ofMaps,

  render(id: number, scene: string, files: Map<string, Uint8Array>, options: string, progress: (share: number) => void) {
    return using(new engine.Files(), (kept) => {
      for (const [path, bytes] of files) kept.add(path, bytes);
      const map = maps.get(id) as engine.LightMap;
      return using(engine.render(kept, scene, map, options, progress), (picture) => ({
        linear: picture.takeLinear(),
        display: picture.takeDisplay(),
        report: picture.report(),
      }));
    });
  },
};
