//! Parallel loops whose result does not depend on the number of threads.

/// The number of threads of these loops.
#[cfg(feature = "picture")]
pub(crate) fn threads() -> usize {
    #[cfg(feature = "render")]
    {
        rayon::current_num_threads()
    }
    #[cfg(not(feature = "render"))]
    1
}

/// `f(0)`, …, `f(n − 1)`, in parallel with the feature `render`.
pub(crate) fn in_order<R: Send>(n: usize, f: impl Fn(usize) -> R + Sync) -> Vec<R> {
    #[cfg(feature = "render")]
    {
        use rayon::prelude::*;
        (0..n).into_par_iter().map(&f).collect()
    }
    #[cfg(not(feature = "render"))]
    (0..n).map(f).collect()
}

/// `f` of each item, in parallel with the feature `render`.
#[cfg(feature = "picture")]
pub(crate) fn map<T: Send, R: Send>(items: Vec<T>, f: impl Fn(T) -> R + Sync + Send) -> Vec<R> {
    #[cfg(feature = "render")]
    {
        use rayon::prelude::*;
        items.into_par_iter().map(f).collect()
    }
    #[cfg(not(feature = "render"))]
    items.into_iter().map(f).collect()
}

/// `f(i, chunk i)` of chunks of `len`, in parallel with the feature `render`.
pub(crate) fn bands<T: Send>(slice: &mut [T], len: usize, f: impl Fn(usize, &mut [T]) + Sync) {
    #[cfg(feature = "render")]
    {
        use rayon::prelude::*;
        slice.par_chunks_mut(len).enumerate().for_each(|(i, chunk)| f(i, chunk));
    }
    #[cfg(not(feature = "render"))]
    slice.chunks_mut(len).enumerate().for_each(|(i, chunk)| f(i, chunk));
}

/// Sorts numbers, in parallel with the feature `render`.
pub(crate) fn sort(numbers: &mut [u64]) {
    #[cfg(feature = "render")]
    {
        use rayon::prelude::*;
        numbers.par_sort_unstable();
    }
    #[cfg(not(feature = "render"))]
    numbers.sort_unstable();
}
