// The Worker of the engine without scenes.

import { calls } from "./light.js";
import { serve } from "./serve.js";

serve(calls);
