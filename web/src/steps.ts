// The text of the lecture: sampling direct illumination under a light probe.

import type { Kind } from "./plot";

export interface Step {
  title: string;
  text: string[];
  /** Equations in presentation MathML. */
  formulas: string[];
  /** An algorithm, as numbered lines. */
  algorithm?: string[];
  question: string;
  answer: string;
  /** The literature. */
  sources: string[];
}

/** What several steps cite. */
const KAJIYA = "Kajiya, The Rendering Equation, SIGGRAPH 1986.";
const BURKE = "Burke, Ghosh and Heidrich, Bidirectional Importance Sampling for Direct Illumination, EGSR 2005.";
const VEACH = "Veach and Guibas, Optimally Combining Sampling Techniques for Monte Carlo Rendering, SIGGRAPH 1995.";
const DEBEVEC = "Debevec, A Median Cut Algorithm for Light Probe Sampling, SIGGRAPH 2005 posters.";
const VIRIYOTHAI = "Viriyothai and Debevec, Variance Minimization Light Probe Sampling, SIGGRAPH 2009 posters.";
const PROBES = "Debevec, Rendering Synthetic Objects into Real Scenes, SIGGRAPH 1998.";
const PBRT = "Pharr, Jakob and Humphreys, Physically Based Rendering, 4th edition, 2023.";

const i = (x: string) => `<mi>${x}</mi>`;
const n = (x: number | string) => `<mn>${x}</mn>`;
const o = (x: string) => `<mo>${x}</mo>`;
const row = (...x: string[]) => `<mrow>${x.join("")}</mrow>`;
/** A term in the color of its curve in the figures. */
const ofKind = (kind: Kind, ...x: string[]) => `<mrow class="${kind}">${x.join("")}</mrow>`;
const frac = (a: string, b: string) => `<mfrac>${row(a)}${row(b)}</mfrac>`;
const sub = (a: string, b: string) => `<msub>${row(a)}${row(b)}</msub>`;
const sup = (a: string, b: string) => `<msup>${row(a)}${row(b)}</msup>`;
const both = (a: string, b: string, c: string) => `<msubsup>${row(a)}${row(b)}${row(c)}</msubsup>`;
const thin = `<mspace width="0.17em"/>`;
/** Between a function and its argument, in parentheses or without. */
const on = `<mo>⁡</mo>`, of = `${on}${thin}`;
const sum = (a: string, b: string) => `<munderover>${o("∑")}${row(a)}${row(b)}</munderover>`;
const int = (a: string) => `<msub>${o("∫")}${row(a)}</msub>`;
/** Parentheses that grow with what they hold. */
const tall = (...x: string[]) => row(o("("), ...x, o(")"));
const par = (...x: string[]) => row('<mo stretchy="false">(</mo>', ...x, '<mo stretchy="false">)</mo>');
const sqrt = (...x: string[]) => `<msqrt>${x.join("")}</msqrt>`;
const at = (j: string) => par(sub(i("ω"), row(i("i"), o(","), j)));
const space = `<mspace width="0.6em"/>`;
/** A term that cancels against another. */
const canceled = (...x: string[]) => `<mrow class="canceled">${x.join("")}</mrow>`;
/** A sign, not a difference, where something stands before it. */
const minus = '<mo form="prefix">−</mo>';
const eq = o("="), d = `${thin}<mi mathvariant="normal">d</mi>`;
const wi = sub(i("ω"), i("i")), wo = sub(i("ω"), i("o")), wh = sub(i("ω"), i("h"));
const fr = ofKind("lobe", sub(i("f"), i("r"))), cos = (x: string) => ofKind("lobe", thin, i("cos"), of, sub(i("θ"), x));
const Li = ofKind("light", sub(i("L"), i("i"))), V = ofKind("visibility", i("V")), qLight = ofKind("light", sub(i("q"), i("m"))), qLobe = ofKind("lobe", sub(i("q"), i("n")));
const phat = `<mover>${i("p")}${o("^")}</mover>`;
const V_HAT = `<mover>${i("V")}${o("^")}</mover>`;
const Lns = sub(i("L"), i("ns"));
const overN = frac(n(1), i("N")), sumN = sum(row(i("j"), eq, n(1)), i("N"));

export const STEPS: Step[] = [
  {
    title: "Estimate an integral",
    text: [
      "A pixel’s direct illumination is an integral over the hemisphere: reflectance times cosine, times incident light, times visibility. Under a photographed sky it has no closed form, and summing over all texels of the map, with a shadow ray to each, is too expensive for every pixel.",
      "But it has a Monte Carlo estimate. Sample directions from any density that is positive wherever the integrand is, divide each value by the density of its direction, and average. The estimate is unbiased for every N; only its standard deviation depends on the density, and it falls with the square root of N.",
    ],
    formulas: [row(sub(i("L"), i("r")), par(wo), eq, int(i("Ω")), fr, par(wo, o(","), wi), Li, par(wi), cos(i("i")), V, par(wi), d, wi), row(i("I"), eq, o("∫"), ofKind("product", i("f"), par(i("x"))), d, i("x"), o("≈"), overN, sumN, frac(ofKind("product", i("f"), par(sub(i("x"), i("j")))), ofKind("light", i("p"), par(sub(i("x"), i("j")))))), row(i("σ"), o("∝"), frac(n(1), sqrt(i("N"))))],
    question: "How many more samples halve the error? Press Play, then drag p until it resembles f.",
    answer: "Four times as many: on log axes the error falls with slope −½. A density shaped like the integrand lowers the whole line, and a density exactly proportional to it has no error at all.",
    sources: [KAJIYA, PBRT],
  },
  {
    title: "Cosine and Phong lobes",
    text: [
      "If the reflectance has a simple shape, directions can be sampled in proportion to it: map two uniform numbers through its inverse cumulative distribution. For a power of the cosine about an axis, the polar angle is the arc cosine of a root.",
      "The diffuse lobe is the power 1 about the normal. Phong’s lobe is the power n about the mirror direction, so directions sampled about the z axis must be rotated to it; directions below the surface count as zero. Gaussian and GGX lobes can be inverted in the same way.",
    ],
    formulas: [row(i("p"), par(i("θ"), o(","), i("φ")), eq, frac(row(i("n"), o("+"), n(1)), row(n(2), i("π"))), thin, sup(i("cos"), i("n")), of, i("θ")), row(i("θ"), eq, i("arccos"), of, sup(par(n(1), o("−"), sub(i("u"), n(1))), frac(n(1), row(i("n"), o("+"), n(1))))), row(i("φ"), eq, n(2), i("π"), sub(i("u"), n(2)))],
    question: "Lower the exponent, then raise it. Why does the taller lobe lose fewer samples?",
    answer: "A density integrates to one, so a narrow lobe is tall. It also stays clear of the horizon, below which samples are lost, unless the viewer is at a grazing angle.",
    sources: ["Phong, Illumination for Computer Generated Pictures, CACM 1975.", "Lafortune and Willems, Using the Modified Phong Reflectance Model for Physically Based Rendering, 1994."],
  },
  {
    title: "Ward’s anisotropic Gaussian",
    text: [
      "Ward models a rough surface by a Gaussian of the half vector’s slope. Proportionality is enough: constants cancel when the cumulative distribution is normalized. Per solid angle, the density is the Gaussian divided by π αx αy cos³ θh. With one width α, the azimuth is uniform and the tangent of the polar angle is α √(−ln u).",
      "Brushed metal has elongated highlights: one width along the brush and another across it. The azimuth is then sampled first, scaled by the ratio of the widths; the polar angle follows from the width at that azimuth. The arc tangent of the azimuth has values between −90° and 90° only, so the azimuth must be put into the quadrant of 2π u: without that, half of the lobe would never be sampled.",
    ],
    formulas: [
      row(i("p"), par(wh), o("∝"), i("exp"), on, tall(minus, frac(row(sup(i("tan"), n(2)), of, sub(i("θ"), i("h"))), sup(i("α"), n(2))))), row(i("tan"), of, sub(i("θ"), i("h")), eq, i("α"), sqrt(row(o("−"), i("ln"), of, sub(i("u"), n(1))))), row(sub(i("φ"), i("h")), eq, n(2), i("π"), sub(i("u"), n(2))),
      row(i("p"), par(wh), o("∝"), i("exp"), on, tall(minus, sup(i("tan"), n(2)), of, sub(i("θ"), i("h")), tall(frac(row(sup(i("cos"), n(2)), of, sub(i("φ"), i("h"))), both(i("α"), i("x"), n(2))), o("+"), frac(row(sup(i("sin"), n(2)), of, sub(i("φ"), i("h"))), both(i("α"), i("y"), n(2)))))),
      row(sub(i("φ"), i("h")), eq, i("arctan"), on, tall(frac(sub(i("α"), i("y")), sub(i("α"), i("x"))), thin, i("tan"), on, par(n(2), i("π"), sub(i("u"), n(2))))), row(sup(i("tan"), n(2)), of, sub(i("θ"), i("h")), eq, frac(row(o("−"), i("ln"), of, sub(i("u"), n(1))), row(frac(row(sup(i("cos"), n(2)), of, sub(i("φ"), i("h"))), both(i("α"), i("x"), n(2))), o("+"), frac(row(sup(i("sin"), n(2)), of, sub(i("φ"), i("h"))), both(i("α"), i("y"), n(2))))))],
    question: "Which way does the highlight stretch when α along x grows?",
    answer: "Along x: the half vectors tilt farther that way, and the reflected directions twice as far.",
    sources: ["Ward, Measuring and Modeling Anisotropic Reflection, SIGGRAPH 1992.", "Walter, Notes on the Ward BRDF, Cornell University, 2005."],
  },
  {
    title: "From half vector to direction",
    text: [
      "Microfacet lobes are sampled as half vectors: the incident direction is the viewer’s direction reflected about the half vector. Reflection enlarges solid angles, so the density must be divided by the magnification.",
      "In the plane of incidence, equal steps of the half vector make double steps of the direction; across it the magnification depends on the angle between the two.",
    ],
    formulas: [row(wi, eq, n(2), par(wh, o("·"), wo), wh, o("−"), wo), row(i("p"), par(wi), eq, frac(row(i("p"), par(wh)), row(n(4), par(wh, o("·"), wi))))],
    question: "Which patches of half vectors grow least under reflection, and how does the factor change the density there? Also lower the viewer.",
    answer: "Patches that lean away from the viewer: their directions are at grazing angles, far from the half vector, where 4 ωh·ωi is small. The same half vectors cover less solid angle there, so the density is higher. A lower viewer extends this to more patches.",
    sources: ["Torrance and Sparrow, Theory for Off-Specular Reflection from Roughened Surfaces, JOSA 1967.", "Walter, Marschner, Li and Torrance, Microfacet Models for Refraction through Rough Surfaces, EGSR 2007."],
  },
  {
    title: "Invert a distribution",
    text: [
      "A photograph has no formula to invert. Instead, tabulate it: the running sum of the texels, divided by the total, is a staircase from 0 to 1. A uniform number on the vertical axis hits a texel’s step, and it hits tall steps more often.",
      "Evenly spaced uniform numbers give samples spread evenly over the light: inversion preserves stratification.",
    ],
    formulas: [row(i("P"), par(sub(i("x"), i("k"))), eq, frac(row(sum(row(i("j"), o("≤"), i("k")), ""), sub(i("L"), i("j"))), row(sum(i("j"), ""), sub(i("L"), i("j"))))), row(i("x"), eq, sup(i("P"), row(o("−"), n(1))), par(i("u")))],
    question: "Where on the curve do most samples land, and why?",
    answer: "Where the curve is steep, because the density is high there: equal steps in u are short steps in x.",
    sources: [PBRT],
  },
  {
    title: "Rows, then columns",
    text: [
      "A map needs two inversions. The row sums give the density of rows; the texels of the sampled row give the density of columns. The product of both is the density of the texel.",
      "Rows near the poles of a latitude–longitude map cover little of the sphere. Each row must be weighted by its solid angle, the integral of sin θ over it; otherwise the poles get far too many samples.",
    ],
    formulas: [row(i("p"), par(i("x"), o(","), i("y")), eq, i("p"), par(i("y")), i("p"), par(i("x"), o("|"), i("y"))), row(i("p"), par(i("y")), o("∝"), i("sin"), of, sub(i("θ"), i("y")), sum(i("x"), ""), sub(i("L"), row(i("x"), i("y"))))],
    question: "Leave sin θ out: which rows gain?",
    answer: "The rows at the top and bottom. Under a constant sky all rows would be equally likely, although the upper edge of the top row is a single point.",
    sources: [PROBES, PBRT],
  },
  {
    title: "Sample the environment",
    text: [
      "With both tables, directions are sampled in proportion to the light, by a density with the index L. Then light over density is constant, equal to the map’s total, and only reflectance times cosine times visibility varies: the variance of environment sampling is that of the BRDF and the shadows.",
      "So environment sampling works well for matte surfaces under a small sun, and poorly for mirrors, whose reflected direction is almost never sampled.",
    ],
    formulas: [
      row(ofKind("estimate", sub(i("L"), row(i("r"), o(","), i("N")))), eq, overN, sumN, frac(row(fr, cos(row(i("i"), o(","), i("j"))), Li, at(i("j")), V, at(i("j"))), row(i("q"), at(i("j"))))),
      row(ofKind("light", sub(i("q"), i("L"))), par(wi), eq, frac(row(Li, par(wi)), row(int(i("Ω")), Li, d, wi))),
      row(ofKind("estimate", sub(i("L"), row(i("r"), o(","), i("N")))), eq, frac(row(int(i("Ω")), Li, d, wi), i("N")), sumN, fr, cos(row(i("i"), o(","), i("j"))), V, at(i("j"))),
      row(i("Var"), of, ofKind("estimate", sub(i("L"), row(i("r"), o(","), i("N")))), eq, frac(sup(tall(int(i("Ω")), Li, d, wi), n(2)), i("N")), thin, i("Var"), on, par(fr, cos(i("i")), V)),
    ],
    question: "How many of the samples hit the brightest hundredth of the map?",
    answer: "About the same share as its share of the total light, which the figure states; under a sky with a sun, most samples.",
    sources: [PROBES, "Agarwal, Ramamoorthi, Belongie and Jensen, Structured Importance Sampling of Environment Maps, SIGGRAPH 2003."],
  },
  {
    title: "Combine two densities",
    text: [
      "Neither density is good everywhere. Multiple importance sampling draws directions from both and weights each sample by the densities of all techniques. Where one density is nearly zero but the integrand is not, the other technique takes over.",
      "The weights of all techniques add up to one for every direction, so the estimate stays unbiased. With the balance heuristic, both sums have the same terms, as if all M + N samples came from the mixture of the two densities. The power heuristic sharpens the weights; the split of samples into M and N is a separate choice. Most renderers, pbrt among them, sample direct illumination in this way.",
    ],
    formulas: [row(sub(i("w"), i("m")), eq, frac(row(i("M"), qLight), row(i("M"), qLight, o("+"), i("N"), qLobe))), row(ofKind("estimate", sub(i("I"), i("MIS"))), eq, frac(n(1), i("M")), sum("", i("M")), frac(row(i("f"), sub(i("w"), i("m"))), qLight), o("+"), frac(n(1), i("N")), sum("", i("N")), frac(row(i("f"), sub(i("w"), i("n"))), qLobe)), row(ofKind("estimate", sub(i("I"), i("MIS"))), eq, sum("", row(i("M"), o("+"), i("N"))), frac(i("f"), row(i("M"), qLight, o("+"), i("N"), qLobe)))],
    question: "Is there a lobe for which one technique alone beats the combination?",
    answer: "Yes, at the extremes: for a very wide lobe the light’s density alone, for a very narrow lobe the lobe’s density alone. The combination then has more error, but it works at both extremes, where the other technique alone fails.",
    sources: [VEACH, PBRT],
  },
  {
    title: "The product is the target",
    text: [
      "The density proportional to reflectance times cosine times light follows the whole integrand but its visibility. Its normalization is the picture without shadows, the unoccluded radiance. It is the best density where nothing is occluded, and only there: where most of the product is in shadow, a density that sends more rays to the visible rest, even one of the two factors, may have less variance.",
      "Reflectance, cosine and light cancel against the density: what remains of each sample is the unoccluded radiance, times its visibility. Only the binary visibility has variance: zero without occlusion and in full shadow, largest where half of the light is occluded. Reflectance and light no longer contribute.",
      "On the sphere, the figure shows these densities for a pixel of a shiny sphere in a nave, with samples of each, and pictures with equally many rays.",
    ],
    formulas: [
      row(ofKind("product", i("p"), par(wi)), eq, frac(row(fr, cos(i("i")), Li), Lns)), row(Lns, eq, int(i("Ω")), fr, cos(i("i")), Li, d, wi),
      row(ofKind("estimate", sub(i("L"), row(i("r"), o(","), i("N")))), eq, overN, sumN, frac(row(canceled(fr, cos(i("i")), Li), V, at(i("j"))), row(canceled(fr, cos(i("i")), Li), o("/"), Lns))), row(ofKind("estimate", sub(i("L"), row(i("r"), o(","), i("N")))), eq, frac(Lns, i("N")), sumN, V, at(i("j"))),
      row(i("Var"), of, ofKind("estimate", sub(i("L"), row(i("r"), o(","), i("N")))), eq, frac(both(i("L"), i("ns"), n(2)), i("N")), thin, i("Var"), on, par(V)),
    ],
    question: "When does the product resemble neither of its factors?",
    answer: "When light and lobe overlap only in their tails. Then both densities waste nearly all samples, and the product has a peak that neither factor has.",
    sources: [BURKE, "Clarberg, Jarosz, Akenine-Möller and Jensen, Wavelet Importance Sampling, SIGGRAPH 2005.", "Ghosh and Heidrich, Correlated Visibility Sampling for Direct Illumination, The Visual Computer 2006."],
  },
  {
    title: "Rejection",
    text: [
      "The product cannot be inverted, but it can be sampled in two steps: draw samples from one factor, then adjust them until they follow the product. Two methods do that, rejection and resampling. To reject, sample that factor, and accept the direction with a probability proportional to the other factor; a bound on the ratio keeps the probability at most one.",
      "Accepted directions follow the product exactly. The price is the number of tries, which grows with the looseness of the envelope and differs between pixels: the time of a picture cannot be known before. Tries that end with the N-th accepted direction count (N − 1)/(T − 1) of T tries as accepted: N/T would be biased.",
    ],
    formulas: [row(i("P"), par(i("keep")), eq, frac(ofKind("product", i("p"), par(wi)), ofKind("light", i("c"), o("·"), sub(i("q"), i("L")), par(wi))), eq, frac(row(fr, cos(i("i")), int(i("Ω")), Li, d, wi), row(i("c"), o("·"), Lns)), o("≤"), n(1)), row(i("E"), par(i("tries")), eq, i("c"))],
    question: "How do the accepted samples change when the bound is twice too high, and when it is too low?",
    answer: "Twice too high: the same distribution, half as many samples. Too low: the target is cut off where it exceeds the envelope, here beside the peak, where the lobe is strongest relative to the light; the result is biased.",
    sources: ["von Neumann, Various Techniques Used in Connection with Random Digits, 1951.", "Haldane, On a Method of Estimating Frequencies, Biometrika 1945.", BURKE],
  },
  {
    title: "Resampling",
    text: [
      "Sampling importance resampling has a fixed cost. Draw M candidates from an easy density, weight each by target over density, and select N of them in proportion to the weights. Only those N are traced.",
      "Few candidates give a distribution between the easy density and the product; as M grows, it approaches the target. The estimate is unbiased for every M if it is multiplied by the mean weight.",
    ],
    formulas: [row(ofKind("estimate", sub(i("L"), i("SIR"))), eq, tall(frac(n(1), i("M")), sum(row(i("m"), eq, n(1)), i("M")), sub(i("w"), i("m"))), frac(n(1), i("N")), sumN, frac(row(i("f"), par(sub(i("ω"), i("j"))), V), ofKind("product", phat, par(sub(i("ω"), i("j")))))), row(sub(i("w"), i("m")), eq, frac(ofKind("product", phat), ofKind("light", i("q"))))],
    question: "From which M can you no longer distinguish the histogram from the target?",
    answer: "It depends on the distance between candidates and target: here from 32, when the difference is within the counting noise. A narrower lobe, or light that the candidates rarely find, needs more.",
    sources: ["Rubin, Using the SIR Algorithm to Simulate Posterior Distributions, 1988.", BURKE, "Talbot, Cline and Egbert, Importance Resampling for Global Illumination, EGSR 2005."],
  },
  {
    title: "Four ways, side by side",
    text: [
      "A shiny sphere in a dim nave with small bright windows, rendered in four ways: 100 environment samples, 75 reflectance samples, both combined, and 15 rays resampled from 800 candidates. Environment sampling is noisy where the sphere reflects dim walls, which it rarely samples; reflectance sampling where the sphere reflects the small windows, which the lobe rarely hits.",
      "Per ray, resampling wins by far: the candidates’ variance falls with their number M, and only the variance of visibility remains for the N rays. But a candidate costs about a third of a short ray, so at equal time the order may change.",
    ],
    formulas: [
      row(i("Var"), of, sub(i("L"), i("SIR")), eq, frac(sup(i("σ"), n(2)), i("M")), o("+"), tall(n(1), o("−"), frac(n(1), i("M"))), frac(row(sub(i("L"), i("r")), par(sub(i("L"), i("ns")), o("−"), sub(i("L"), i("r")))), i("N"))),
      row(sup(i("σ"), n(2)), eq, i("Var"), on, tall(frac(row(fr, cos(i("i")), Li, V), i("q")))),
    ],
    question: "Which method is best per ray, and which at equal time? Add some diffuse reflectance and compare again.",
    answer: "Per ray, resampling; at equal time, usually multiple importance sampling. Diffuse reflectance hurts reflectance sampling most.",
    sources: [VEACH, BURKE],
  },
  {
    title: "Bias versus variance",
    text: [
      "Random samples are unbiased: the mean of many pictures is correct for every N. A single picture is noisy. A fixed set of lights is consistent: its picture approaches the correct one as N grows. For a fixed N it has no noise, but the same error every time: shadows have steps instead of soft edges.",
      "Both converge. The noise falls with the square root of N for any function; the error of fixed points depends on the function, and on the position of an edge between the points.",
    ],
    formulas: [row(i("E"), par(sup(par(i("error")), n(2))), eq, sup(i("bias"), n(2)), o("+"), i("variance")), row(i("unbiased:"), space, i("E"), par(ofKind("estimate", sub(i("I"), i("N")))), eq, i("I")), row(i("consistent:"), space, ofKind("estimate", sub(i("I"), i("N"))), o("→"), i("I"))],
    question: "Move the edge: which curve changes, and how?",
    answer: "The error of the fixed lights jumps up and down, sometimes near zero by luck. The curve of the random samples stays a line, because it shows the root of the mean square.",
    sources: [DEBEVEC, PBRT],
  },
  {
    title: "Median cut",
    text: [
      "To convert a probe to lights, cut it into two halves of equal energy; cut each half again across its longer side, and so on. After k rounds there are 2ᵏ regions of about equal energy; only a single texel, such as a small sun, cannot be cut further.",
      "A light is placed at the centroid of each region, with the region’s sum as its color. Bright areas get many small regions, dark areas a few large ones.",
    ],
    formulas: [row(int(sub(i("R"), n(1))), i("L"), d, i("ω"), eq, int(sub(i("R"), n(2))), i("L"), d, i("ω"), eq, frac(n(1), n(2)), int(i("R")), i("L"), d, i("ω"))],
    algorithm: [
      "Put the whole light probe into the list as one region.",
      "Cut each region of the list across its longest side, so that both parts have the same energy. Widths count less near the poles, by the cosine of the elevation.",
      "Repeat step 2 until there are enough regions.",
      "Put a light at the centroid of each region, with the sum of its texels as its color.",
    ],
    question: "How many lights end up in the brightest source, such as a sun or a lamp, and does that help?",
    answer: "As many as its energy is worth, until its regions are single texels; the figure counts them. They all shine from almost the same direction, so one light with their sum would do as well, and the rest of the map lacks the others.",
    sources: [DEBEVEC],
  },
  {
    title: "Variance minimization",
    text: [
      "The goal is not equal energy but a small error. The error of a light at a centroid grows with the variance of its region’s light around it. The rule of 2009 measures distances on the map and cuts where the larger of the two variances is smallest; the regions stay rectangles.",
      "Here distances are measured on the sphere, and a cut minimizes the sum of the two variances. Finally, regions that belong together are joined, and each light moves to the centroid of what is nearest to it, until nothing moves; this bends the borders.",
      "Then a small sun or lamp stays in one region, and the lights go where the energy is spread out: to the rest of the map. The figure shows the regions of both rules from near, and pictures under the lights of all three methods.",
    ],
    formulas: [row(i("2009:"), space, `<munder>${row(i("min"))}${i("cut")}</munder>`, of, i("max"), on, par(i("v"), par(sub(i("R"), n(1))), o(","), i("v"), par(sub(i("R"), n(2))))), row(i("here:"), space, `<munder>${row(i("min"))}${i("cut")}</munder>`, par(i("v"), par(sub(i("R"), n(1))), o("+"), i("v"), par(sub(i("R"), n(2))))), row(i("v"), par(i("R")), eq, int(i("R")), i("L"), sup(row(o("‖"), i("ω"), o("−"), sub(i("c"), i("R")), o("‖")), n(2)), d, i("ω"))],
    algorithm: [
      "Put the whole light probe into the list as one region.",
      "Cut each region of the list where the larger of the two parts’ variances is smallest.",
      "Repeat step 2 until there are enough regions.",
      "Put a light at the centroid of each region, with the sum of its texels as its color.",
    ],
    question: "Which method has the smaller shading error with equally many lights, and by how much?",
    answer: "Variance minimization, as the numbers under the picture show; on a map without small bright lights the difference is smaller.",
    sources: [VIRIYOTHAI, DEBEVEC, "Lloyd, Least Squares Quantization in PCM, 1982."],
  },
  {
    title: "Why stratification is steeper",
    text: [
      "Divide the samples’ square into N equal strata, with one sample in each. The variance of the mean is then the sum of the variances within the strata, divided by N²: what differs only between strata no longer counts.",
      "A shadow’s edge crosses about √N of the N strata, and only these contribute. So the error falls with the power −¾ instead of −½. Smooth light varies in every stratum, but in proportion to its width, and the error falls with the power −1. Scrambled Sobol’ points, which this page’s strategies use, are stratified in many ways at once.",
    ],
    formulas: [row(i("Var"), of, ofKind("estimate", sub(i("I"), i("N"))), eq, frac(n(1), sup(i("N"), n(2))), sum(row(i("k"), eq, n(1)), i("N")), sub(i("Var"), i("k")), of, i("f")), row(i("edge:"), space, i("σ"), o("∝"), sqrt(frac(sqrt(i("N")), sup(i("N"), n(2)))), eq, sup(i("N"), row(o("−"), n(3), o("/"), n(4)))), row(i("smooth:"), space, i("σ"), o("∝"), sup(i("N"), row(o("−"), n(1))))],
    question: "Which strata contribute to the error, and how does their share change with N? Press Play, then drag and tilt the edge.",
    answer: "Those that the edge crosses. Their share falls as 1/√N, so the error falls faster than that of random samples.",
    sources: ["Mitchell, Consequences of Stratified Sampling in Graphics, SIGGRAPH 1996.", "Owen, Monte Carlo Variance of Scrambled Net Quadrature, SIAM Journal on Numerical Analysis 1997.", PBRT],
  },
  {
    title: "Learn the visibility",
    text: [
      "With the product as density, only visibility has variance. But pixels nearby know much of it. The default strategy, product, takes one candidate in each stratum of the light, with the weight W, and approximates the product by a control variate h, linear in each stratum, whose integral is known. A few pixels trace all of their candidates; from them, each stratum of other pixels has an estimate V̂ of its visibility.",
      "What V̂ predicts needs no rays. The rest is estimated: candidates are traced with a probability π in proportion to their weight and to the standard deviation of visibility, and the weights W/π make up for those that are not. The estimate is unbiased for any V̂ and any h; the better they are, the smaller its variance.",
    ],
    formulas: [row(ofKind("estimate", sub(i("L"), i("r"))), eq, sum("", ""), ofKind("visibility", V_HAT), int(""), ofKind("lobe", i("h")), o("+"), sum("", ""), ofKind("visibility", V_HAT), par(i("W"), o("−"), ofKind("lobe", i("h"))), o("+"), sum(i("traced"), ""), frac(i("W"), i("π")), par(V, o("−"), ofKind("visibility", V_HAT))), row(i("π"), o("∝"), i("W"), sqrt(row(ofKind("visibility", V_HAT), par(n(1), o("−"), ofKind("visibility", V_HAT)))))],
    question: "Where do the rays go, and what happens when the penumbra narrows?",
    answer: "To the strata in which visibility is uncertain. A narrower penumbra leaves fewer of them, and less error for the same rays.",
    sources: ["Ghosh and Heidrich, Correlated Visibility Sampling for Direct Illumination, The Visual Computer 2006.", "Clarberg and Akenine-Möller, Exploiting Visibility Correlation in Direct Illumination, EGSR 2008.", "Owen and Zhou, Safe and Effective Importance Sampling, JASA 2000.", "Madow, On the Theory of Systematic Sampling, Annals of Mathematical Statistics 1949."],
  },
  {
    title: "A room with a window",
    text: [
      "Inside a room, the sky is the same as before, but nearly all of it is occluded. Neither light nor reflectance nor their product knows where the window is, so most rays end at a wall, and the few that pass carry all of the light.",
      "Points on the window are another density: every ray passes. A scene may name its windows as portals, and the default strategy finds others with a few rays ahead of the picture; half of its candidates are then points on them. The figure computes a section of a room by quadrature, and renders the built-in scene room, which has such a window and names it.",
    ],
    formulas: [row(i("p"), par(i("ω")), eq, frac(sup(i("r"), n(2)), row(i("A"), thin, i("cos"), of, sub(i("θ"), i("w"))))), row(frac(i("σ"), i("I")), eq, sqrt(row(frac(n(1), sup(i("I"), n(2))), int(""), frac(sup(par(fr, cos(i("i")), Li, V), n(2)), i("p")), d, i("ω"), o("−"), n(1))))],
    question: "Which strategy finds the window best, and how many rays does it need? Drag the point, the window’s edges and the sun.",
    answer: "None of the first four knows where the window is; points on it need the fewest rays.",
    sources: [VEACH, "Bitterli, Novák and Jarosz, Portal-Masked Environment Map Sampling, EGSR 2015.", PBRT],
  },
];
