//! The Python module `domelight._domelight`: a thin front end over the library's public functions.
//!
//! [`arrays`] converts arrays in both directions; [`engine`] releases the interpreter while the engine works. Parts
//! that are simpler in Python (strategies as functions, metrics by name, progress) are in `python/domelight`.

mod arrays;
mod bsdf;
mod camera;
mod compare;
mod engine;
mod environment;
mod error;
mod failure;
mod film;
mod ibl;
mod inspect;
mod lobe;
mod metrics;
mod notebook;
mod options;
mod picture;
mod progressive;
mod recipe;
mod render;
mod rig;
mod scene;
mod strategy;
mod testing;

use pyo3::prelude::*;

#[pymodule(gil_used = false)]
mod _domelight {
    #[pymodule_export]
    use super::{
        bsdf::{Bsdf, Material},
        compare::compare,
        environment::{Density, Environment, shader_code},
        error::{DomelightWarning, RenderInterrupted},
        film::Film,
        ibl::{PrefilteredLight, prefilter},
        inspect::inspect,
        metrics::{compare_pictures, error_map, flip, hdr_flip},
        options::job_options,
        picture::{read, tone_map, write},
        progressive::{Progressive, progressive},
        render::{render, strategy_names},
        rig::{Rig, lights},
        scene::Scene,
        strategy::ShadingPoints,
        testing::{chi2, z_test},
    };

    use super::{Bound, PyModule, PyModuleMethods as _, PyResult};

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
