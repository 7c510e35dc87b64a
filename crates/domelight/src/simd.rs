//! Plain loops compiled for the processor's vectors.
//!
//! What runs below [`vectorized`] is ordinary code that the compiler turns into vector instructions.
//! It fuses and reorders no floating-point operation, so the bits are the same on every processor.
#![allow(unsafe_code)]

/// Work to be compiled for each instruction set.
///
/// `run` and all that it spends time in must be `#[inline(always)]`: what is not inlined lacks the
/// instructions.
pub(crate) trait Work {
    type Output;
    fn run(self) -> Self::Output;
}

/// Runs the work with the widest vectors that this processor has.
#[inline]
pub(crate) fn vectorized<W: Work>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
        fn avx2<W: Work>(work: W) -> W::Output {
            work.run()
        }
        let available = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("lzcnt")
            && is_x86_feature_detected!("popcnt");
        if available {
            // SAFETY: the processor has the features that `avx2` enables.
            return unsafe { avx2(work) };
        }
    }
    work.run()
}
