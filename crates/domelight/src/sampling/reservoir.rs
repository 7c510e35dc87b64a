//! Samples from a stream of weighted items whose number and total weight are unknown until its end.
//!
//! Each reservoir keeps item i with probability wᵢ / Σw, at any time of the stream: Chao 1982, "A
//! General Purpose Unequal Probability Sampling Plan", as Bitterli et al. 2020, "Spatiotemporal
//! Reservoir Resampling for Real-Time Ray Tracing with Dynamic Direct Lighting", use it. Several
//! independent reservoirs make a multinomial choice.
//!
//! One random number per item and reservoir is not necessary. An item chosen at the running total W is
//! still there at the total W′ with probability W / W′, so it stays until the total exceeds W / u
//! (the exponential jumps of Efraimidis & Spirakis 2006, "Weighted Random Sampling with a
//! Reservoir"). This takes one comparison per item, and about ln(number of items) random numbers per
//! reservoir.

use super::Pcg32;

/// Independent reservoirs over one stream.
#[derive(Clone, Debug)]
pub struct WeightedReservoirs<T> {
    reservoirs: Vec<Reservoir<T>>,
    total: f64,
    /// The least total at which any reservoir changes.
    next: f64,
}

#[derive(Clone, Copy, Debug)]
struct Reservoir<T> {
    item: T,
    /// The running total up to which the item stays.
    until: f64,
}

impl<T> Default for WeightedReservoirs<T> {
    fn default() -> Self {
        Self { reservoirs: Vec::new(), total: 0.0, next: 0.0 }
    }
}

impl<T: Copy> WeightedReservoirs<T> {
    /// Clears the reservoirs and keeps the memory.
    pub fn clear(&mut self) {
        self.reservoirs.clear();
        self.total = 0.0;
    }

    /// Offers the next item to each of `n` reservoirs, with the same `n` for the whole stream. Items
    /// without weight are ignored. `numbers` must be independent of the items.
    pub fn add(&mut self, item: T, weight: f64, n: usize, numbers: &mut Pcg32) {
        if weight == 0.0 {
            return;
        }
        self.total += weight;
        let total = self.total;
        // u in (0, 1]
        let mut until = || total / f64::from(1.0 - numbers.next_f32());
        if self.reservoirs.is_empty() {
            self.reservoirs.extend((0..n).map(|_| Reservoir { item, until: until() }));
        } else if total <= self.next {
            return;
        } else {
            for r in self.reservoirs.iter_mut().filter(|r| total > r.until) {
                *r = Reservoir { item, until: until() };
            }
        }
        self.next = self.reservoirs.iter().map(|r| r.until).fold(f64::INFINITY, f64::min);
    }

    /// The sum of the weights offered.
    pub fn total(&self) -> f64 {
        self.total
    }

    /// The item in each reservoir; empty before the first item with weight.
    pub fn items(&self) -> impl ExactSizeIterator<Item = &T> {
        self.reservoirs.iter().map(|r| &r.item)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each item is kept in proportion to its weight, whatever the order, and two reservoirs choose
    /// independently.
    #[test]
    fn items_are_kept_in_proportion() {
        const WEIGHTS: [f64; 6] = [3.0, 0.0, 1.0, 8.0, 0.5, 7.5];
        let total: f64 = WEIGHTS.iter().sum();
        for reversed in [false, true] {
            let n = 200_000;
            let mut counts = [[0.0f64; 6]; 6];
            let mut reservoirs = WeightedReservoirs::default();
            let mut numbers = Pcg32::new(4, u64::from(reversed));
            for _ in 0..n {
                reservoirs.clear();
                for k in 0..6 {
                    let i = if reversed { 5 - k } else { k };
                    reservoirs.add(i, WEIGHTS[i], 2, &mut numbers);
                }
                assert_eq!(reservoirs.total(), total);
                let kept: Vec<usize> = reservoirs.items().copied().collect();
                counts[kept[0]][kept[1]] += 1.0;
            }
            let mut chi2 = 0.0;
            for (i, row) in counts.iter().enumerate() {
                for (j, &observed) in row.iter().enumerate() {
                    let expected = f64::from(n) * WEIGHTS[i] * WEIGHTS[j] / (total * total);
                    if expected == 0.0 {
                        assert_eq!(observed, 0.0);
                    } else {
                        chi2 += (observed - expected).powi(2) / expected;
                    }
                }
            }
            // 24 degrees of freedom; the quantile of 1 − 10⁻⁴.
            assert!(chi2 < 58.6, "{chi2}");
        }
    }

    #[test]
    fn an_empty_stream_keeps_nothing() {
        let mut reservoirs = WeightedReservoirs::default();
        reservoirs.add(1, 0.0, 3, &mut Pcg32::new(1, 1));
        assert_eq!((reservoirs.total(), reservoirs.items().len()), (0.0, 0));
        reservoirs.add(1, 2.0, 3, &mut Pcg32::new(1, 1));
        assert_eq!((reservoirs.total(), reservoirs.items().len()), (2.0, 3));
    }
}
