// CPU time of the engine as the page runs it, on one thread in Node: node engine_time.js STRATEGY SIZE SPP; prints seconds
// of the second of two renders, when what is hot has been compiled for good.

import { readFileSync } from "node:fs";
import { Engine, initSync } from "../dist/engine/engine.js";

const [strategy, size, spp] = process.argv.slice(2);
initSync({ module: new WebAssembly.Module(readFileSync(new URL("../dist/engine/engine_bg.wasm", import.meta.url))) });
const engine = new Engine();
engine.loadScene(JSON.stringify({ scene: "statue", material: "", ground: false }));
engine.loadEnvironment(JSON.stringify({ probe: "sky", rows: 256, rotate: 125, scale: 1, exposure: 0 }));
const settings = { width: Number(size), height: Number(size), spp: Number(spp), strategy, seed: 0, hideEnvironment: false, camera: null, shard: [0, 1] };
const seconds = () => {
  const { user, system } = process.cpuUsage();
  return (user + system) / 1e6;
};
const render = () => {
  const start = seconds();
  engine.start(JSON.stringify(settings));
  for (let complete = false; !complete;) {
    const update = engine.step(16);
    update.windows();
    update.pixels();
    update.statistics();
    ({ complete } = update);
    update.free();
  }
  return seconds() - start;
};
render();
console.log(render().toFixed(2));
