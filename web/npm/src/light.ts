// The engine without scenes, a sixth of the size of the other.

import * as engine from "./light/engine.js";
import { callsOf } from "./calls.js";

export const calls = callsOf(engine, new URL("./light/engine_bg.wasm", import.meta.url));
