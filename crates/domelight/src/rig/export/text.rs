//! Numbers within other languages.

use crate::math::Vec3;
use crate::quote::Code;

/// Three numbers with `separator` between them.
pub(super) fn numbers<L>([a, b, c]: [f32; 3], separator: &'static str) -> Code<L> {
    Code::join([a, b, c].map(|number| Code::generated(number.to_string())), separator)
}

/// The numbers of a vector, none of them a negative zero.
pub(super) fn vector(v: Vec3) -> [f32; 3] {
    (v + Vec3::ZERO).to_array()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quote::Python;

    #[test]
    fn zeros_have_no_sign() {
        assert_eq!(numbers::<Python>(vector(-Vec3::ZERO), ", ").as_str(), "0, 0, 0");
    }
}
