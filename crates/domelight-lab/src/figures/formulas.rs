//! The formulas of the page, as MathML.

use std::fmt::Display;

fn mi(name: &str) -> String {
    format!("<mi>{name}</mi>")
}

fn mn(number: &str) -> String {
    format!("<mn>{number}</mn>")
}

fn mo(operator: &str) -> String {
    format!("<mo>{operator}</mo>")
}

/// A thin space.
fn thin() -> String {
    "<mspace width=\"0.17em\"/>".to_owned()
}

/// A function name.
fn function(name: &str) -> String {
    mi(name) + &thin()
}

fn row<T: Display>(parts: impl IntoIterator<Item = T>) -> String {
    let parts: String = parts.into_iter().map(|p| p.to_string()).collect();
    format!("<mrow>{parts}</mrow>")
}

/// A separator between two equations.
fn and() -> String {
    "<mo>,</mo><mspace width=\"1.6em\"/>".to_owned()
}

fn paren(inside: &str) -> String {
    row([mo("("), inside.to_owned(), mo(")")])
}

fn frac(above: &str, below: &str) -> String {
    format!("<mfrac>{above}{below}</mfrac>")
}

fn sub(base: &str, index: &str) -> String {
    format!("<msub>{base}{index}</msub>")
}

fn sup(base: &str, exponent: &str) -> String {
    format!("<msup>{base}{exponent}</msup>")
}

fn sqrt(inside: &str) -> String {
    format!("<msqrt>{inside}</msqrt>")
}

fn sum(from: &str, to: &str) -> String {
    format!("<munderover><mo movablelimits=\"false\">∑</mo>{from}{to}</munderover>")
}

fn integral(domain: &str) -> String {
    format!("<msub><mo>∫</mo>{domain}</msub>")
}

fn math<T: Display>(parts: impl IntoIterator<Item = T>) -> String {
    format!("<math display=\"block\">{}</math>", row(parts))
}

fn omega(index: &str) -> String {
    sub(&mi("ω"), &mi(index))
}

fn alpha(index: &str) -> String {
    sub(&mi("α"), &mi(index))
}

fn f_cos() -> String {
    row([sub(&mi("f"), &mi("r")), function("cos"), mi("θ")])
}

/// cos² φ / αx² + sin² φ / αy²: the exponent tan² θ (…) without its tangent.
fn ellipse() -> String {
    let square = |f: &str| row([sup(&mi(f), &mn("2")), thin(), sub(&mi("φ"), &mi("h"))]);
    let term = |f: &str, axis: &str| {
        frac(&square(f), &format!("<msubsup>{}{}{}</msubsup>", mi("α"), mi(axis), mn("2")))
    };
    row([term("cos", "x"), mo("+"), term("sin", "y")])
}

/// Figure 1: the lobes and their sampling.
pub(crate) fn lobes() -> Vec<String> {
    let (theta_h, phi_h) = (sub(&mi("θ"), &mi("h")), sub(&mi("φ"), &mi("h")));
    let (u1, u2) = (sub(&mi("u"), &mn("1")), sub(&mi("u"), &mn("2")));
    let n1 = row([mi("n"), mo("+"), mn("1")]);
    let two_pi_u = row([mn("2"), mi("π"), u2]);
    let rest = row([mn("1"), mo("−"), u1]);
    let minus_log = row([mo("−"), function("ln"), paren(&rest)]);
    let tan2 = row([sup(&mi("tan"), &mn("2")), thin(), theta_h.clone()]);
    let cos = |power: &str| row([sup(&mi("cos"), &mn(power)), thin(), theta_h.clone()]);
    let pi_alphas = row([mi("π"), alpha("x"), alpha("y")]);
    vec![
        math([
            mi("p"),
            paren(&row([mi("θ"), mo(","), mi("φ")])),
            mo("="),
            frac(
                &row([paren(&n1), sup(&mi("cos"), &mi("n")), thin(), mi("θ")]),
                &row([mn("2"), mi("π")]),
            ),
            and(),
            mi("θ"),
            mo("="),
            function("arccos"),
            sup(&paren(&rest), &frac(&mn("1"), &n1)),
            and(),
            mi("φ"),
            mo("="),
            two_pi_u.clone(),
        ]),
        math([
            mi("p"),
            paren(&omega("h")),
            mo("="),
            frac(
                &row([function("exp"), paren(&row([mo("−"), tan2.clone(), paren(&ellipse())]))]),
                &row([pi_alphas.clone(), cos("3")]),
            ),
            and(),
            theta_h.clone(),
            mo("="),
            function("arctan"),
            sqrt(&frac(&minus_log, &ellipse())),
            and(),
            phi_h,
            mo("="),
            function("atan2"),
            paren(&row([
                alpha("y"),
                function("sin"),
                two_pi_u.clone(),
                mo(","),
                alpha("x"),
                function("cos"),
                two_pi_u,
            ])),
        ]),
        math([
            mi("D"),
            paren(&omega("h")),
            mo("="),
            frac(
                &mn("1"),
                &row([
                    pi_alphas,
                    cos("4"),
                    sup(&paren(&row([mn("1"), mo("+"), tan2, paren(&ellipse())])), &mn("2")),
                ]),
            ),
            and(),
            mi("p"),
            paren(&omega("i")),
            mo("="),
            frac(
                &row([mi("p"), paren(&omega("h"))]),
                &row([mn("4"), paren(&row([omega("h"), mo("·"), omega("i")]))]),
            ),
        ]),
    ]
}

/// Figure 2: rows, columns, and the density on the sphere.
pub(crate) fn inversion() -> Vec<String> {
    let weight = row([
        mi("L"),
        paren(&row([mi("x"), mo(","), mi("y")])),
        function("sin"),
        sub(&mi("θ"), &mi("y")),
    ]);
    let sum_x = format!("<munder><mo movablelimits=\"false\">∑</mo>{}</munder>", mi("x"));
    let sum_xy = format!(
        "<munder><mo movablelimits=\"false\">∑</mo>{}</munder>",
        row([mi("x"), mo(","), mi("y")])
    );
    let all = |s: &str| row([s.to_owned(), weight.clone()]);
    let wh = row([mi("W"), mi("H")]);
    vec![math([
        mi("p"),
        paren(&mi("y")),
        mo("="),
        frac(&all(&sum_x), &all(&sum_xy)),
        and(),
        mi("p"),
        paren(&row([mi("x"), mo("|"), mi("y")])),
        mo("="),
        frac(&weight, &all(&sum_x)),
        and(),
        mi("p"),
        paren(&mi("ω")),
        mo("="),
        mi("p"),
        paren(&mi("y")),
        mi("p"),
        paren(&row([mi("x"), mo("|"), mi("y")])),
        frac(&wh, &row([mn("2"), sup(&mi("π"), &mn("2")), function("sin"), mi("θ")])),
    ])]
}

/// Figure 3: the three densities.
pub(crate) fn product() -> Vec<String> {
    let over =
        |f: &str| frac(f, &row([integral(&mi("Ω")), f.to_owned(), thin(), mi("d"), omega("i")]));
    let light = row([mi("L"), paren(&omega("i"))]);
    let density = |index: &str| row([sub(&mi("q"), &mi(index)), paren(&omega("i"))]);
    let product = row([f_cos(), light.clone()]);
    vec![math([
        density("L"),
        mo("="),
        over(&light),
        and(),
        density("f"),
        mo("="),
        over(&f_cos()),
        and(),
        mi("p"),
        paren(&omega("i")),
        mo("="),
        over(&product),
    ])]
}

/// Figure 4: multiple importance sampling, and resampling with its variance.
pub(crate) fn four_ways() -> Vec<String> {
    let (i, j) = (mi("i"), mi("j"));
    let x_ij = sub(&mi("x"), &row([i.clone(), j.clone()]));
    let of = |f: &str, x: &str| row([mi(f), paren(x)]);
    let n_i = sub(&mi("n"), &i);
    let one = |j: &str| row([mi(j), mo("="), mn("1")]);
    let indexed = |f: &str| row([sub(&mi(f), &i), paren(&x_ij)]);
    let omega_j = sub(&mi("ω"), &j);
    let mean = |n: &str, what: &str| {
        row([frac(&mn("1"), &mi(n)), sum(&one("j"), &mi(n)), what.to_owned()])
    };
    let ratio = frac(&row([f_cos(), mi("L")]), &mi("q"));
    let l_ns = sub(&mi("L"), &mi("ns"));
    vec![
        math([
            sub(&mi("I"), &mi("MIS")),
            mo("="),
            format!("<munder><mo movablelimits=\"false\">∑</mo>{i}</munder>"),
            frac(&mn("1"), &n_i),
            sum(&one("j"), &n_i),
            frac(&row([indexed("w"), of("f", &x_ij)]), &indexed("p")),
            and(),
            format!("<munder><mo movablelimits=\"false\">∑</mo>{i}</munder>"),
            sub(&mi("w"), &i),
            mo("="),
            mn("1"),
        ]),
        math([
            sub(&mi("I"), &mi("SIR")),
            mo("="),
            paren(&mean("M", &row([ratio, paren(&sub(&mi("x"), &j))]))),
            mo("·"),
            paren(&mean("N", &row([mi("V"), paren(&omega_j)]))),
            and(),
            function("Var"),
            sub(&mi("I"), &mi("SIR")),
            mo("="),
            frac(&mn("1"), &mi("M")),
            function("Var"),
            paren(&frac(&row([f_cos(), mi("L"), mi("V")]), &mi("q"))),
            mo("+"),
            paren(&row([mn("1"), mo("−"), frac(&mn("1"), &mi("M"))])),
            frac(&row([mi("I"), paren(&row([l_ns, mo("−"), mi("I")]))]), &mi("N")),
        ]),
    ]
}

/// Figure 5: the acceptance probability and the estimator.
pub(crate) fn rejection() -> Vec<String> {
    let g_max = sub(&mi("g"), &mi("max"));
    let minus_one = |n: &str| row([mi(n), mo("−"), mn("1")]);
    vec![math([
        mi("P"),
        paren(&mi("accept")),
        mo("="),
        frac(&f_cos(), &g_max),
        and(),
        mi("I"),
        mo("="),
        mi("Q"),
        g_max,
        frac(&minus_one("N"), &minus_one("T")),
        mo("·"),
        frac(&mn("1"), &mi("N")),
        sum(&row([mi("j"), mo("="), mn("1")]), &mi("N")),
        mi("V"),
        paren(&sub(&mi("ω"), &mi("j"))),
    ])]
}

/// Figures 6 and 7: the light of a region, and its variance on the map and on the sphere.
pub(crate) fn region_light() -> String {
    let over_r = integral(&mi("r"));
    let d_omega = row([thin(), mi("d"), mi("ω")]);
    let moment = row([over_r.clone(), mi("L"), mi("ω"), d_omega.clone()]);
    math([
        sub(&mi("E"), &mi("r")),
        mo("="),
        over_r,
        mi("L"),
        d_omega,
        and(),
        omega("r"),
        mo("="),
        frac(&moment, &row([mo("‖"), moment.clone(), mo("‖")])),
    ])
}

/// Figure 7.
pub(crate) fn region_variance() -> String {
    let sum_p = format!(
        "<munder><mo movablelimits=\"false\">∑</mo>{}</munder>",
        row([mi("p"), mo("∈"), mi("r")])
    );
    let d_p = format!("<msubsup>{}{}{}</msubsup>", mi("d"), mi("p"), mn("2"));
    let w = row([integral(&mi("r")), mi("L"), thin(), mi("d"), mi("ω")]);
    let r = row([integral(&mi("r")), mi("L"), mi("ω"), thin(), mi("d"), mi("ω")]);
    math([
        function("Var"),
        paren(&mi("r")),
        mo("="),
        sum_p,
        sub(&mi("L"), &mi("p")),
        d_p,
        mo(";"),
        mi("on the sphere:"),
        mi("W"),
        mo("−"),
        frac(&sup(&row([mo("‖"), mi("R"), mo("‖")]), &mn("2")), &mi("W")),
        and(),
        mi("W"),
        mo("="),
        w,
        and(),
        mi("R"),
        mo("="),
        r,
    ])
}

/// Figure 9: the half vector and its Jacobian.
pub(crate) fn half_vector() -> Vec<String> {
    let both = row([omega("o"), mo("+"), omega("i")]);
    let d = |index: &str| row([mi("d"), omega(index)]);
    let four = row([mn("4"), paren(&row([omega("h"), mo("·"), omega("i")]))]);
    vec![math([
        omega("h"),
        mo("="),
        frac(&both, &row([mo("‖"), both.clone(), mo("‖")])),
        and(),
        frac(&d("h"), &d("i")),
        mo("="),
        frac(&mn("1"), &four),
        and(),
        mi("p"),
        paren(&omega("i")),
        mo("="),
        frac(&row([mi("p"), paren(&omega("h"))]), &four),
    ])]
}

/// Figure 10: the two heuristics.
pub(crate) fn mis_weights() -> Vec<String> {
    let np = |index: &str| row([sub(&mi("n"), &mi(index)), sub(&mi("p"), &mi(index))]);
    let square = |index: &str| sup(&paren(&np(index)), &mn("2"));
    let w = sub(&mi("w"), &mi("L"));
    vec![math([
        mi("balance:"),
        thin(),
        w.clone(),
        mo("="),
        frac(&np("L"), &row([np("L"), mo("+"), np("f")])),
        and(),
        mi("power:"),
        thin(),
        w,
        mo("="),
        frac(&square("L"), &row([square("L"), mo("+"), square("f")])),
        and(),
        sub(&mi("w"), &mi("L")),
        mo("+"),
        sub(&mi("w"), &mi("f")),
        mo("="),
        mn("1"),
    ])]
}

/// Figure 12: the density of resampled directions.
pub(crate) fn sir_density() -> Vec<String> {
    let ratio = frac(&mi("p"), &mi("q"));
    let of = |x: &str| paren(&sub(&mi("ω"), &mi(x)));
    let all = format!(
        "<munder><mo movablelimits=\"false\">∑</mo>{}</munder>",
        row([mi("k"), mo("≤"), mi("M")])
    );
    vec![math([
        mi("P"),
        paren(&row([mi("keep"), thin(), sub(&mi("ω"), &mi("j"))])),
        mo("="),
        frac(&row([ratio.clone(), of("j")]), &row([all, ratio, of("k")])),
        and(),
        sub(&mi("q"), &mi("M")),
        mo("→"),
        mi("p"),
        thin(),
        mi("for"),
        thin(),
        mi("M"),
        mo("→"),
        mi("∞"),
    ])]
}

/// Figure 13: the two envelopes, and the product's share of each.
pub(crate) fn envelope() -> Vec<String> {
    let light = mi("L");
    let max = |f: &str| row([sub(&mi("max"), &mi("ω")), thin(), f.to_owned()]);
    let over = |f: &str| row([integral(&mi("Ω")), f.to_owned(), thin(), mi("d"), mi("ω")]);
    let product = row([f_cos(), light.clone()]);
    vec![math([
        product.clone(),
        mo("≤"),
        paren(&max(&f_cos())),
        light.clone(),
        and(),
        product.clone(),
        mo("≤"),
        paren(&max(&light)),
        f_cos(),
        and(),
        mi("P"),
        paren(&mi("accept")),
        mo("="),
        frac(&over(&product), &row([paren(&max(&f_cos())), over(&light)])),
    ])]
}

/// Figure 8.
pub(crate) fn convergence() -> Vec<String> {
    let sigma = sup(&mi("σ"), &mn("2"));
    vec![math([
        function("Var"),
        sub(&mi("I"), &mi("N")),
        mo("="),
        frac(&sigma, &mi("N")),
        and(),
        mi("RMS error"),
        mo("="),
        frac(&mi("σ"), &sqrt(&mi("N"))),
        mo("∝"),
        sup(&mi("N"), &row([mo("−"), mn("1/2")])),
    ])]
}
