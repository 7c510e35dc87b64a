// The Worker of the engine that renders scenes.

import { calls } from "./full.js";
import { serve } from "./serve.js";

serve(calls);
