//! The map as a table of rows and columns, for figures: the library's own, that the program's figure draws from.

use domelight::environment::LatLongGrid;
use domelight::math::vec2;
use domelight::sampling::{Dimension, Sampler, SamplerKind, Table2d};
use serde::Serialize;

use crate::error::refused;
use crate::setup::to_json;
use crate::{Engine, Error};

/// The probabilities of rows, and of the columns of one, for the page.
#[derive(Serialize)]
struct RowReport {
    rows: Vec<f64>,
    columns: Vec<f64>,
}

/// Samples of the map, for the page.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct SampleReport {
    /// u and v of each on the map as the probe has it, not turned.
    places: Vec<[f64; 2]>,
    /// How many of them lie in the brightest hundredth of the texels.
    n_in_brightest: usize,
    /// What these have of the map's light.
    share_of_brightest: f64,
}

impl Engine {
    /// The probabilities of the rows of the map in `width` columns and half as many rows, and of the columns of one row;
    /// rows count by their solid angle if `weighted`, and all alike otherwise.
    ///
    /// # Errors
    /// If there is no environment, it is black, or it has no such row.
    pub fn row_probabilities(
        &self,
        width: usize,
        row: usize,
        weighted: bool,
    ) -> Result<String, Error> {
        let height = width / 2;
        if row >= height {
            return Err(refused("the map has no such row"));
        }
        let grid = LatLongGrid::new(width, height);
        let colors = self.map(width)?;
        let luminance = |[r, g, b]: [f32; 3]| f64::from(domelight::Rgb::new(r, g, b).luminance());
        let texels = colors.as_chunks::<3>().0.iter().enumerate();
        let of_row = |y| if weighted { grid.solid_angle(y) } else { 1.0 };
        let weights: Vec<f64> = texels.map(|(i, &c)| luminance(c) * of_row(i / width)).collect();
        let table = Table2d::from_rows(width, height, |y, out| {
            out.copy_from_slice(&weights[y * width..(y + 1) * width]);
        })
        .map_err(refused)?;
        Ok(to_json(&RowReport {
            rows: (0..height).map(|y| table.rows().pmf(y)).collect(),
            columns: (0..width).map(|x| table.conditional_pmf(x, row)).collect(),
        }))
    }

    /// `n` texels of the map drawn by rows and columns, with places inside them.
    ///
    /// # Errors
    /// If there is no environment or it is black.
    pub fn map_samples(&self, n: usize, seed: u32) -> Result<String, Error> {
        let table = self.environment()?.rows_and_columns().map_err(refused)?;
        let (width, height) = (table.width(), table.height());
        let sampler = Sampler::new(SamplerKind::Independent, seed.into(), 0);
        let drawn: Vec<_> = (0..n as u32)
            .map(|i| {
                let u = sampler.numbers(Dimension::Environment, i);
                table.sample(vec2(u.0[0], u.0[1]))
            })
            .collect();
        // What the least of the brightest hundredth has.
        let texels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let mut shares: Vec<f64> = texels.map(|(x, y)| table.pmf(x, y)).collect();
        let n_brightest = (shares.len() / 100).max(1);
        shares.select_nth_unstable_by(n_brightest - 1, |a, b| b.total_cmp(a));
        let least = shares[n_brightest - 1];
        let place = |column: usize, x: f32, n: usize| (column as f64 + f64::from(x)) / n as f64;
        Ok(to_json(&SampleReport {
            places: drawn
                .iter()
                .map(|s| [place(s.column, s.inside.x, width), place(s.row, s.inside.y, height)])
                .collect(),
            n_in_brightest: drawn.iter().filter(|s| s.pmf >= least).count(),
            share_of_brightest: shares[..n_brightest].iter().sum(),
        }))
    }
}
