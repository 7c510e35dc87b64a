// The interactive figures of the lecture, one for each step.

import { biasAndVariance, combination, inversion, product, rejection, resampling } from "./figures/curve_figures";
import { cuts } from "./figures/cuts";
import { estimator } from "./figures/estimator";
import { learning } from "./figures/learning";
import { halfVectors, lobes, ward } from "./figures/lobes";
import { environmentSamples, rowsAndColumns } from "./figures/maps";
import { roomWithWindow } from "./figures/rooms";
import { stratification } from "./figures/stratification";
import { fourWays } from "./figures/ways";
import type { Stage } from "./stage";

export const FIGURES: ((stage: Stage) => void)[] = [
  estimator, lobes, ward, halfVectors, inversion, rowsAndColumns, environmentSamples, combination, product, rejection, resampling,
  fourWays, biasAndVariance, cuts("median-cut", "variance-minimization"), cuts("variance-minimization", "median-cut"),
  stratification, learning, roomWithWindow,
];
