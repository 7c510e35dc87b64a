// The text of the lecture: sampling direct illumination under a light probe.

export interface Step {
  title: string;
  text: string[];
  /** Equations in presentation MathML. */
  formulas: string[];
  question: string;
  answer: string;
}

const i = (x: string) => `<mi>${x}</mi>`;
const n = (x: number | string) => `<mn>${x}</mn>`;
const o = (x: string) => `<mo>${x}</mo>`;
const row = (...x: string[]) => `<mrow>${x.join("")}</mrow>`;
const frac = (a: string, b: string) => `<mfrac>${row(a)}${row(b)}</mfrac>`;
const sub = (a: string, b: string) => `<msub>${row(a)}${row(b)}</msub>`;
const sup = (a: string, b: string) => `<msup>${row(a)}${row(b)}</msup>`;
const both = (a: string, b: string, c: string) => `<msubsup>${row(a)}${row(b)}${row(c)}</msubsup>`;
/** Between a function and its argument. */
const of = `<mo>⁡</mo><mspace width="0.17em"/>`;
const sum = (a: string, b: string) => `<munderover>${o("∑")}${row(a)}${row(b)}</munderover>`;
const int = (a: string) => `<msub>${o("∫")}${row(a)}</msub>`;
/** Parentheses that grow with what they hold. */
const tall = (...x: string[]) => row(o("("), ...x, o(")"));
const par = (...x: string[]) => row('<mo stretchy="false">(</mo>', ...x, '<mo stretchy="false">)</mo>');
const sqrt = (...x: string[]) => `<msqrt>${x.join("")}</msqrt>`;
const eq = o("="), d = `<mi mathvariant="normal">d</mi>`;
const wi = sub(i("ω"), i("i")), wo = sub(i("ω"), i("o")), wh = sub(i("ω"), i("h"));
const fr = sub(i("f"), i("r")), cos = (x: string) => row(i("cos"), of, sub(i("θ"), x));
const phat = `<mover>${i("p")}${o("^")}</mover>`;
const overN = frac(n(1), i("N")), sumN = sum(row(i("j"), eq, n(1)), i("N"));

export const STEPS: Step[] = [
  {
    title: "Estimate an integral",
    text: [
      "A pixel’s direct light is an integral over all directions: reflectance times cosine, times the light from there, times whether anything is in the way. No formula solves it for a photographed sky.",
      "A random estimate does. Draw directions from any density that is positive wherever the integrand is, divide each value by the density it was drawn with, and average. The mean is right for every N; only the spread depends on the density, and it shrinks with the root of N.",
    ],
    formulas: [row(i("I"), eq, o("∫"), i("f"), par(i("x")), d, i("x"), o("≈"), overN, sumN, frac(row(i("f"), par(sub(i("x"), i("j")))), row(i("p"), par(sub(i("x"), i("j")))))), row(i("σ"), o("∝"), frac(n(1), sqrt(i("N"))))],
    question: "How many more samples halve the error? Try the density that resembles the integrand, too.",
    answer: "Four times as many: on log axes the error falls with slope −½. A density of the integrand’s shape lowers the whole line, and one in exact proportion to it would have no error at all.",
  },
  {
    title: "Cosine and Phong lobes",
    text: [
      "Where the reflectance has a simple shape, directions can be drawn in proportion to it: put two uniform numbers through the inverse of its cumulative distribution. For a power of the cosine about an axis, the polar angle is the arc cosine of a root.",
      "The diffuse lobe is the power 1 about the normal. Phong’s is the power n about the mirror direction, so what was drawn about the local axis is turned there; what ends below the surface counts as zero.",
    ],
    formulas: [row(i("p"), par(i("θ"), o(","), i("φ")), eq, frac(row(i("n"), o("+"), n(1)), row(n(2), i("π"))), sup(i("cos"), i("n")), of, i("θ")), row(i("θ"), eq, i("arccos"), of, sup(par(n(1), o("−"), sub(i("u"), n(1))), frac(n(1), row(i("n"), o("+"), n(1))))), row(i("φ"), eq, n(2), i("π"), sub(i("u"), n(2)))],
    question: "Why is the tallest curve the one with the fewest lost samples?",
    answer: "A density integrates to one, so a narrow lobe is a high one. It also keeps clear of the horizon, below which samples are lost, unless the viewer looks along the surface.",
  },
  {
    title: "Ward’s anisotropic Gaussian",
    text: [
      "Brushed metal reflects along a line. Ward describes it by a Gaussian of the half vector’s slope with one width along the brush and another across it. In proportion is enough: constants cancel when the cumulative distribution is normalized.",
      "The azimuth is drawn first, squeezed by the ratio of the widths; the polar angle follows from the width in that azimuth.",
    ],
    formulas: [row(sub(i("φ"), i("h")), eq, i("arctan"), of, tall(frac(sub(i("α"), i("y")), sub(i("α"), i("x"))), i("tan"), of, par(n(2), i("π"), sub(i("u"), n(2))))), row(sub(i("θ"), i("h")), eq, i("arctan"), of, sqrt(frac(row(o("−"), i("ln"), of, sub(i("u"), n(1))), row(frac(row(sup(i("cos"), n(2)), sub(i("φ"), i("h"))), both(i("α"), i("x"), n(2))), o("+"), frac(row(sup(i("sin"), n(2)), sub(i("φ"), i("h"))), both(i("α"), i("y"), n(2)))))))],
    question: "Which way does the highlight stretch when α along x grows?",
    answer: "Along x: the half vectors tilt further that way, and the reflected directions twice as far.",
  },
  {
    title: "From half vector to direction",
    text: [
      "Microfacet lobes are drawn as half vectors and then mirrored: the light’s direction is the viewer’s, reflected about the half vector. The rays are spread by that mirroring, so the density must be divided by how much the solid angle grew.",
      "Equal steps of the half vector make double steps of the direction, in the plane of incidence; across it the growth depends on the angle between the two.",
    ],
    formulas: [row(wi, eq, n(2), par(wh, o("·"), wo), wh, o("−"), wo), row(i("p"), par(wi), eq, frac(row(i("p"), par(wh)), row(n(4), par(wh, o("·"), wi))))],
    question: "Which patches of half vectors grow least when they are mirrored, and what does the factor do to the density there? Lower the viewer, too.",
    answer: "Those that lean away from the viewer: their directions graze, at a wide angle to the half vector, where 4 ωh·ωi is small. The same half vectors cover less solid angle there, so the density is higher. A lower viewer makes it so for more of them.",
  },
  {
    title: "Invert a distribution",
    text: [
      "A photograph has no formula to invert. Sum it up instead: the running sum of the texels, divided by the total, is a staircase from 0 to 1. A uniform number on the vertical axis meets it at a texel, and steep steps are met more often.",
      "Spread the uniform numbers evenly and the samples are spread evenly over the light as well: that is stratification, and it survives the inversion.",
    ],
    formulas: [row(i("P"), par(sub(i("x"), i("k"))), eq, frac(row(sum(row(i("j"), o("≤"), i("k")), ""), sub(i("L"), i("j"))), row(sum(i("j"), ""), sub(i("L"), i("j"))))), row(i("x"), eq, sup(i("P"), row(o("−"), n(1))), par(i("u")))],
    question: "Where on the curve do most samples land, and why?",
    answer: "Where the curve is steep, which is where the density is high: equal steps up the axis are short steps along it there.",
  },
  {
    title: "Rows, then columns",
    text: [
      "A map needs two inversions. The sum of each row gives the density of rows; within the row that was drawn, its texels give the density of columns. The product of both is the density of the texel.",
      "Rows near the poles of a latitude–longitude map cover little of the sphere. Each row counts with its solid angle, the integral of sin θ over it, or the poles get far too many samples.",
    ],
    formulas: [row(i("p"), par(i("x"), o(","), i("y")), eq, i("p"), par(i("y")), i("p"), par(i("x"), o("|"), i("y"))), row(i("p"), par(i("y")), o("∝"), i("sin"), of, sub(i("θ"), i("y")), sum(i("x"), ""), sub(i("L"), row(i("x"), i("y"))))],
    question: "Leave sin θ out: which rows gain?",
    answer: "Those at the top and the bottom. Under an even sky all rows would then be equally likely, though the top one is a point.",
  },
  {
    title: "Sample the environment",
    text: [
      "With both tables, directions come in proportion to the light itself. Then light over density is a constant, the map’s total, and what is left to vary is reflectance times cosine times visibility.",
      "So environment sampling is good for dull surfaces under a small sun, and poor for mirrors, which look at one place that is almost never drawn.",
    ],
    formulas: [row(sub(i("L"), row(i("r"), o(","), i("N"))), eq, frac(row(o("∫"), sub(i("L"), i("i")), d, i("ω")), i("N")), sumN, fr, par(sub(i("ω"), i("j"))), cos(i("j")), i("V"), par(sub(i("ω"), i("j"))))],
    question: "How many of the samples hit the brightest hundredth of the map?",
    answer: "About as many as it has of the whole light. Under a sky with a sun that is most of them.",
  },
  {
    title: "Combine two densities",
    text: [
      "Neither density is good everywhere. Multiple importance sampling draws some directions from each and weighs every sample by how likely all techniques were to draw it. Where one density is nearly zero and the integrand is not, the other one carries the sample.",
      "The weights of all techniques add up to one at every direction, so the mean stays right. The power heuristic sharpens them; how to split the samples between M and N is a choice of its own.",
    ],
    formulas: [row(sub(i("w"), i("m")), eq, frac(row(i("M"), sub(i("q"), i("m"))), row(i("M"), sub(i("q"), i("m")), o("+"), i("N"), sub(i("q"), i("n"))))), row(sub(i("I"), i("MIS")), eq, frac(n(1), i("M")), sum("", i("M")), frac(row(i("f"), sub(i("w"), i("m"))), sub(i("q"), i("m"))), o("+"), frac(n(1), i("N")), sum("", i("N")), frac(row(i("f"), sub(i("w"), i("n"))), sub(i("q"), i("n"))))],
    question: "Is there a lobe for which one technique alone beats the mixture?",
    answer: "Yes, at the ends: for a very wide lobe the light’s density alone, for a very narrow one the lobe’s. The mixture then errs more, but it stays usable at both ends, where the other technique alone fails.",
  },
  {
    title: "The product is the target",
    text: [
      "The best density known without tracing a ray is in proportion to reflectance times cosine times light. Its normalization is the picture without shadows, the unoccluded radiance.",
      "Drawn from it, every sample has the same value but for visibility. The variance is that of a yes or no: zero in the open and in full shadow, and largest where half of the light is hidden. Reflectance and light no longer matter.",
    ],
    formulas: [row(i("p"), par(wi), eq, frac(row(fr, cos(i("i")), sub(i("L"), i("i"))), sub(i("L"), i("ns")))), row(i("Var"), eq, frac(both(i("L"), i("ns"), n(2)), i("N")), i("Var"), of, par(i("V")))],
    question: "When does the product look like neither of its factors?",
    answer: "When light and lobe overlap by their tails only. Then both densities waste nearly all samples, and the product has a peak that neither shows.",
  },
  {
    title: "Rejection",
    text: [
      "The product has no inverse, but it can be reached from one factor. Draw from that factor, and keep the direction with a probability that makes up for the other one; a bound on the quotient keeps the probability below one.",
      "What is kept follows the product exactly. The price is the number of tries, which is as large as the envelope is loose, and differs from pixel to pixel.",
    ],
    formulas: [row(i("P"), par(i("keep")), eq, frac(row(i("p"), par(wi)), row(i("c"), o("·"), i("q"), par(wi))), o("≤"), n(1)), row(i("E"), par(i("tries")), eq, i("c"))],
    question: "What happens to the kept samples when the bound is twice too high, and when it is too low?",
    answer: "Twice too high: the same distribution, half as many kept. Too low: the peak is cut off where the target sticks out of the envelope, and the result is biased.",
  },
  {
    title: "Resampling",
    text: [
      "Sampling importance resampling has a fixed cost. Draw M candidates from something easy, weigh each by target over density, and pick N of them in proportion to the weights. Only those N are traced.",
      "Few candidates give a distribution between the easy one and the product; with growing M it approaches the target. The estimate is right for every M if it is multiplied by the mean weight.",
    ],
    formulas: [row(sub(i("L"), i("SIR")), eq, tall(frac(n(1), i("M")), sum(row(i("m"), eq, n(1)), i("M")), sub(i("w"), i("m"))), frac(n(1), i("N")), sumN, frac(row(i("f"), par(sub(i("ω"), i("j"))), i("V")), row(phat, par(sub(i("ω"), i("j")))))), row(sub(i("w"), i("m")), eq, frac(phat, i("q")))],
    question: "From which M on can you no longer tell the histogram from the target?",
    answer: "It depends on how far the candidates are from the target: here from 32 on, when the difference is no more than the noise of counting. A narrower lobe, or light that the candidates seldom find, needs more.",
  },
  {
    title: "Four ways, side by side",
    text: [
      "A shiny sphere under a dim nave with small bright windows, by all four: the environment with 100 samples, the reflectance with 75, both combined, and 15 rays picked from 800 candidates. The first is noisy where the sphere mirrors dim walls, which it seldom samples; the second where it mirrors the small windows, which its lobe seldom meets.",
      "Per ray resampling wins by far: the candidates’ variance falls with their number M, and the N rays are left with the variance of visibility. But a candidate costs about as much as a third of a short ray, so at equal time the order may turn.",
    ],
    formulas: [
      row(i("Var"), of, sub(i("L"), i("SIR")), eq, frac(sup(i("σ"), n(2)), i("M")), o("+"), tall(n(1), o("−"), frac(n(1), i("M"))), frac(row(sub(i("L"), i("r")), par(sub(i("L"), i("ns")), o("−"), sub(i("L"), i("r")))), i("N"))),
      row(sup(i("σ"), n(2)), eq, i("Var"), of, tall(frac(row(fr, cos(i("i")), sub(i("L"), i("i")), i("V")), i("q")))),
    ],
    question: "Which one is best by count, and which in equal time? Add some diffuse reflectance and look again.",
    answer: "By traced rays resampling is; in equal time multiple importance sampling usually is. With diffuse light the reflectance’s own samples suffer most.",
  },
  {
    title: "Bias against variance",
    text: [
      "Random samples are right on average and noisy. A fixed set of lights is not noisy at all, but it is off by the same amount every time: shadows have steps instead of soft edges.",
      "Both converge. The noise falls with the root of N whatever the function; the error of fixed points depends on it, and on where an edge happens to lie between them.",
    ],
    formulas: [row(i("E"), par(sup(par(i("error")), n(2))), eq, sup(i("bias"), n(2)), o("+"), i("variance"))],
    question: "Move the edge: which curve changes, and how?",
    answer: "The error of the fixed lights jumps up and down, at times near zero by luck. The random one stays the same line, for only its mean square is drawn.",
  },
  {
    title: "Median cut",
    text: [
      "To turn a probe into lights, cut it in two such that both halves hold the same light; cut each again across its longer side, and go on. After k rounds there are 2ᵏ regions of equal light.",
      "A light goes to the centroid of each, with the region’s sum as its color. Bright places get many small regions, dark ones a few large ones.",
    ],
    formulas: [row(int(sub(i("R"), n(1))), i("L"), d, i("ω"), eq, int(sub(i("R"), n(2))), i("L"), d, i("ω"), eq, frac(n(1), n(2)), int(i("R")), i("L"), d, i("ω"))],
    question: "Under a sky with a sun, how many of the lights end up in the sun, and is that useful?",
    answer: "As many as its share of the light demands. All of them shine from almost the same direction, so most are wasted.",
  },
  {
    title: "Variance minimization",
    text: [
      "Equal light is not the aim; a small error is. A light at a centroid errs by how widely its region’s light is spread about it. So cut where the larger of the two spreads becomes smallest.",
      "The sun then stays whole, and the lights go where the light is spread: to the sky around it and to the ground.",
    ],
    formulas: [row(`<munder>${row(i("min"))}${i("cut")}</munder>`, o("max"), par(i("v"), par(sub(i("R"), n(1))), o(","), i("v"), par(sub(i("R"), n(2))))), row(i("v"), par(i("R")), eq, int(i("R")), i("L"), sup(row(o("‖"), i("ω"), o("−"), sub(i("c"), i("R")), o("‖")), n(2)), d, i("ω"))],
    question: "With 64 lights, whose shading is nearer to the truth, and by how much?",
    answer: "This one’s, as the figures under the picture say; on a map without small bright lights the two are closer.",
  },
];
