//! `bindgen MODULE FOLDER [--names]`: writes `engine.js`, `engine.d.ts` and `engine_bg.wasm`, what the command wasm-bindgen does
//! for pages, without the web servers and drivers that it is built with. The names of functions are 5 % of a module, and only
//! profiles show them.
use std::process::ExitCode;

use wasm_bindgen_cli_support::Bindgen;

fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args_os().skip(1).collect();
    let (module, folder, has_names) = match &arguments[..] {
        [module, folder] => (module, folder, false),
        [module, folder, option] if option == "--names" => (module, folder, true),
        _ => {
            eprintln!("usage: bindgen MODULE FOLDER [--names]");
            return ExitCode::from(2);
        }
    };
    let mut bindgen = Bindgen::new();
    let written = bindgen
        .input_path(module)
        .out_name("engine")
        .typescript(true)
        .remove_name_section(!has_names)
        .web(true)
        .and_then(|b| b.generate(folder));
    match written {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("bindgen: {error:#}");
            ExitCode::FAILURE
        }
    }
}
