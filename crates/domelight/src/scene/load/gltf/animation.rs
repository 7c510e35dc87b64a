//! Animations, evaluated at one time.

use std::collections::HashMap;

use super::error::{Failure, GltfErrorKind, KeyError};
use super::json::{self, Interpolation};
use super::source::Source;
use crate::math::{Quat, Vec4, functions};
use crate::scene::load::AnimationTime;

/// The animated properties of a node.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct NodePose {
    pub(super) translation: Option<[f32; 3]>,
    pub(super) rotation: Option<[f32; 4]>,
    pub(super) scale: Option<[f32; 3]>,
    pub(super) weights: Option<Vec<f32>>,
}

/// The index of a choice by name, otherwise by number.
pub(super) fn choose(
    what: &'static str,
    asked: &str,
    known: Vec<String>,
) -> Result<usize, GltfErrorKind> {
    let by_name = known.iter().position(|name| name == asked);
    let by_number = || asked.parse().ok().filter(|&i| i < known.len());
    by_name.or_else(by_number).ok_or_else(|| {
        let asked = asked.to_owned();
        GltfErrorKind::NoChoice { what, asked, known }
    })
}

/// The poses of nodes in an animation at a time. Channels with unusable keys are left out with one warning, unless the
/// load is strict.
pub(super) fn at(
    source: &Source<'_>,
    time: &AnimationTime,
) -> Result<HashMap<usize, NodePose>, Failure> {
    let count = source.document.count::<json::Animation>();
    let all = (0..count).map(|i| source.document.get::<json::Animation>(i));
    let names = all.map(|a| a.map(|a| a.name).unwrap_or_default()).collect();
    let index = choose("animation", &time.name, names)?;
    let animation: json::Animation = source.document.get(index)?;
    let name = match &*animation.name {
        "" => format!("animation {index}"),
        name => format!("animation '{name}'"),
    };
    let mut poses: HashMap<usize, NodePose> = HashMap::new();
    let mut unusable = Vec::new();
    for (i, channel) in animation.channels.iter().enumerate() {
        let Some(node) = channel.target.node else { continue };
        let place = || format!("{name}, channel {i} ({} of node {node})", channel.target.path);
        let pose = poses.entry(node).or_default();
        match channel_at(source, &animation, channel, time.seconds, pose) {
            Err(Failure::Problem(GltfErrorKind::Keys { source: problem })) if !source.strict => {
                unusable.push(format!("{}: {problem}", place()));
            }
            result => result.map_err(|e| e.within(place))?,
        }
    }
    if let [first, others @ ..] = &unusable[..] {
        let all = match others.len() {
            0 => "it is".into(),
            1 => "it and one more channel like it are".into(),
            n => format!("it and {n} more channels like it are"),
        };
        source.warn(&format!("{first}; {all} left out"));
    }
    Ok(poses)
}

fn channel_at(
    source: &Source<'_>,
    animation: &json::Animation,
    channel: &json::Channel,
    seconds: f32,
    pose: &mut NodePose,
) -> Result<(), Failure> {
    let sampler = animation.samplers.get(channel.sampler).ok_or_else(|| {
        let (index, count) = (channel.sampler, animation.samplers.len());
        GltfErrorKind::NoSuch { what: "animation sampler", index, count }
    })?;
    let times = source.floats::<1>(sampler.input, "SCALAR", "times of an animation")?;
    let times: Vec<f32> = times.into_iter().map(|[t]| t).collect();
    let shape = match &*channel.target.path {
        "translation" | "scale" => "VEC3",
        "rotation" => "VEC4",
        "weights" => "SCALAR",
        other => {
            source.warn(&format!("the animation of '{other}' is not known; it stays at rest"));
            return Ok(());
        }
    };
    let values = source.floats::<4>(sampler.output, shape, "values of an animation")?;
    let n = match shape {
        "VEC3" => 3,
        "VEC4" => 4,
        _ => 1,
    };
    let flat: Vec<f32> = values.iter().flat_map(|v| v[..n].iter().copied()).collect();
    let curve = Curve { times: &times, values: &flat, interpolation: sampler.interpolation };
    let size = (shape != "SCALAR").then_some(n);
    curve.check(size).map_err(|source| GltfErrorKind::Keys { source })?;
    let mut value = curve.at(seconds, &channel.target.path);
    match &*channel.target.path {
        "translation" => pose.translation = value.try_into().ok(),
        "scale" => pose.scale = value.try_into().ok(),
        "rotation" => {
            let q: [f32; 4] = std::array::from_fn(|i| value.get(i).copied().unwrap_or_default());
            pose.rotation = Some(Vec4::from(q).normalize_or(Vec4::W).to_array());
        }
        _ => {
            value.truncate(MAX_WEIGHTS);
            pose.weights = Some(value);
        }
    }
    Ok(())
}

/// An upper bound on the morph targets of any real mesh.
const MAX_WEIGHTS: usize = 1 << 16;

/// Values at times, checked; the number of components per value is the ratio of the counts.
struct Curve<'c> {
    times: &'c [f32],
    values: &'c [f32],
    interpolation: Interpolation,
}

impl Curve<'_> {
    /// The number of values for each key: a spline's key holds in-tangent, value and out-tangent.
    fn per_key(&self) -> usize {
        if self.interpolation == Interpolation::CubicSpline { 3 } else { 1 }
    }

    /// Checks that there is a value at any time. Values have `size` components each, or as many as there are morph
    /// targets.
    fn check(&self, size: Option<usize>) -> Result<(), KeyError> {
        let (keys, numbers, per_key) = (self.times.len(), self.values.len(), self.per_key());
        if keys == 0 {
            return Err(KeyError::Empty);
        }
        let before = std::iter::once(&f32::NEG_INFINITY).chain(self.times);
        let is_bad = |(&time, &before): (&f32, &f32)| !(time.is_finite() && time >= before);
        if let Some(key) = self.times.iter().zip(before).position(is_bad) {
            return Err(KeyError::Time { key, time: self.times[key] });
        }
        let fits = match size {
            Some(size) => numbers == keys * per_key * size,
            None => numbers > 0 && numbers.is_multiple_of(keys * per_key),
        };
        if !fits {
            let needed = match (size, per_key) {
                (Some(_), 1) => "one",
                (Some(_), _) => "three",
                (None, 1) => "one for each morph target",
                (None, _) => "three for each morph target",
            };
            let values = numbers / size.unwrap_or(1);
            return Err(KeyError::Count { values, keys, needed });
        }
        match self.values.iter().position(|value| !value.is_finite()) {
            Some(i) => {
                let index = i / size.unwrap_or(1);
                Err(KeyError::Value { index, value: self.values[i] })
            }
            None => Ok(()),
        }
    }

    /// The value at a time, clamped to the first and last keys.
    fn at(&self, seconds: f32, path: &str) -> Vec<f32> {
        let (cubic, per_key) = (self.interpolation == Interpolation::CubicSpline, self.per_key());
        let n = self.values.len() / (self.times.len() * per_key);
        let of_key = |key: usize, part: usize| {
            let begin = (key * per_key + part) * n;
            &self.values[begin..begin + n]
        };
        let value = |key| of_key(key, usize::from(cubic));
        let next = self.times.partition_point(|&t| t <= seconds);
        if next == 0 || next == self.times.len() {
            return value(next.saturating_sub(1)).to_vec();
        }
        let key = next - 1;
        let interval = self.times[next] - self.times[key];
        let t = ((seconds - self.times[key]) / interval).clamp(0.0, 1.0);
        let mix = |i: usize| {
            let (a, b) = (value(key)[i], value(next)[i]);
            match self.interpolation {
                Interpolation::Step => a,
                Interpolation::Linear => a + (b - a) * t,
                Interpolation::CubicSpline => {
                    let (out, into) = (interval * of_key(key, 2)[i], interval * of_key(next, 0)[i]);
                    let (t2, t3) = (t * t, t * t * t);
                    (2.0 * t3 - 3.0 * t2 + 1.0) * a
                        + (t3 - 2.0 * t2 + t) * out
                        + (3.0 * t2 - 2.0 * t3) * b
                        + (t3 - t2) * into
                }
            }
        };
        if path == "rotation" && self.interpolation == Interpolation::Linear && n == 4 {
            let q = |key| Quat::from_slice(value(key)).normalize();
            return slerp(q(key), q(next), t).to_array().to_vec();
        }
        (0..n).map(mix).collect()
    }
}

/// Spherical linear interpolation of unit quaternions along the shorter arc from `a` to `b`, `t` in [0, 1].
fn slerp(a: Quat, b: Quat, t: f32) -> Quat {
    let cos = a.dot(b);
    let b = if cos < 0.0 { -b } else { b };
    // Use the half angle's tangent, because the arc cosine is inaccurate near 1.
    let angle = 2.0 * functions::atan2((b - a).length(), (b + a).length());
    let sin = functions::sin(angle);
    if sin < 1e-6 {
        return a.lerp(b, t);
    }
    a * (functions::sin((1.0 - t) * angle) / sin) + b * (functions::sin(t * angle) / sin)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_interpolate_and_stay_at_their_ends() {
        let curve = |interpolation, values| Curve { times: &[1.0, 3.0], values, interpolation };
        let linear = curve(Interpolation::Linear, &[10.0, 0.0, 20.0, 2.0]);
        for (t, expected) in [(0.0, [10.0, 0.0]), (2.0, [15.0, 1.0]), (9.0, [20.0, 2.0])] {
            assert_eq!(linear.at(t, "translation"), expected);
        }
        let step = curve(Interpolation::Step, &[10.0, 20.0]);
        assert_eq!(step.at(2.9, "weights"), [10.0]);
        // At the middle of a 2 s interval: the mean, plus 2 s / 8 times the tangents' difference.
        let spline = curve(Interpolation::CubicSpline, &[9.0, 10.0, 4.0, 0.0, 20.0, 9.0]);
        assert_eq!(spline.at(2.0, "translation"), [16.0]);
        assert_eq!(spline.at(3.0, "translation"), [20.0]);
    }

    #[test]
    fn curves_have_keys_in_order_with_a_value_each() {
        let check = |times: &[f32], values: &[f32], interpolation, size| {
            Curve { times, values, interpolation }.check(size).map_err(|e| e.to_string())
        };
        let (linear, cubic) = (Interpolation::Linear, Interpolation::CubicSpline);
        assert_eq!(check(&[1.0, 2.0, 2.0], &[0.0; 9], linear, Some(3)), Ok(()));
        assert_eq!(check(&[1.0], &[0.0; 6], cubic, None), Ok(()));
        let bad = |times: &[f32], values: &[f32], interpolation, size, words: &str| {
            let error = check(times, values, interpolation, size).unwrap_err();
            assert!(error.contains(words), "{error}");
        };
        bad(&[], &[], linear, Some(3), "no keys");
        bad(
            &[1.0, 2.0],
            &[0.0; 3],
            linear,
            Some(3),
            "1 values for 2 keys, each of which needs one",
        );
        bad(&[1.0], &[0.0; 6], linear, Some(3), "2 values for 1 keys");
        bad(&[1.0], &[0.0; 3], cubic, Some(3), "needs three");
        bad(&[1.0, 2.0], &[0.0; 3], linear, None, "needs one for each morph target");
        bad(&[1.0], &[], linear, None, "0 values");
        bad(&[f32::NAN], &[0.0; 3], linear, Some(3), "key 0 is at NaN s");
        bad(&[2.0, 1.0], &[0.0; 6], linear, Some(3), "key 1 is at 1 s");
        bad(&[1.0], &[0.0, f32::INFINITY, 0.0], linear, Some(3), "value 0 is not finite: inf");
    }

    #[test]
    fn rotations_turn_at_one_speed() {
        let (a, b) = (Quat::IDENTITY, Quat::from_rotation_z(2.0));
        let values = [a.to_array(), (-b).to_array()].concat();
        let curve =
            Curve { times: &[0.0, 1.0], values: &values, interpolation: Interpolation::Linear };
        let quarter = Quat::from_slice(&curve.at(0.25, "rotation"));
        assert!(quarter.dot(Quat::from_rotation_z(0.5)).abs() > 0.999_999);
    }

    #[test]
    fn choices_are_names_before_numbers() {
        let known = || vec!["walk".to_owned(), "0".to_owned()];
        assert_eq!(choose("animation", "walk", known()).unwrap(), 0);
        assert_eq!(choose("animation", "0", known()).unwrap(), 1);
        assert_eq!(choose("animation", "1", known()).unwrap(), 1);
        let error = choose("animation", "run", known()).unwrap_err().to_string();
        assert!(error.contains("run") && error.contains("0 'walk', 1 '0'"), "{error}");
    }
}
