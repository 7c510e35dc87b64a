//! The list of calls.

/// Passes the list of the calls that the page makes to a macro: the name in JavaScript, and the method of
/// [`Engine`](crate::Engine) with its arguments and its result.
#[macro_export]
macro_rules! for_each_call {
    ($macro:ident) => {
        $macro! {
            addFile = add_file(path: &str, bytes: Vec<u8>) -> ();
            clearFiles = clear_files() -> ();
            loadScene = load_scene(settings: &str) -> String;
            loadEnvironment = load_environment(settings: &str) -> String;
            smallerMaps = smaller_maps(probe: &str) -> String;
            turnEnvironment = turn_environment(degrees: f32) -> ();
            automaticExposure = automatic_exposure(settings: &str) -> f32;
            part = part() -> Vec<u8>;
            addPart = add_part(part: &[u8]) -> ();
            exr = exr(making: &str) -> Vec<u8>;
            png = png(exposure: f32, curve: &str) -> Vec<u8>;
            map = map(width: usize) -> Vec<f32>;
            mapView = map_view(mapping: &str, rotate: f32, width: usize) -> MapView;
            placesOf = places_of(mapping: &str, rotate: f32, places: &[f32]) -> Vec<f32>;
            importance = importance(pixel: &str, mapping: &str, width: usize) -> MapView;
            rayDensity = ray_density(pixel: &str, strategy: &str, mapping: &str, width: usize) -> MapView;
            materialAt = material_at(pixel: &str) -> Option<u32>;
            point = point(pixel: &str) -> String;
            samples = samples(pixel: &str, strategy: &str, mapping: &str, n: u32, seed: u32) -> Vec<f32>;
            directionAt = direction_at(pixel: &str, from: &str, a: f32, b: f32, mapping: &str) -> Vec<f32>;
            rowProbabilities = row_probabilities(width: usize, row: usize, weighted: bool) -> String;
            mapSamples = map_samples(n: u32, seed: u32) -> String;
            inspect = inspect(settings: &str) -> String;
            hemisphere = hemisphere(settings: &str, resolution: usize) -> Vec<f32>;
            directions = directions(settings: &str, resolution: usize) -> Vec<f32>;
            lobeSection = lobe_section(material: &str, theta_o: f32, n: usize) -> Vec<f32>;
            lobeSamples = lobe_samples(material: &str, theta_o: f32, n: u32, seed: u32) -> Vec<f32>;
            lights = lights(settings: &str) -> String;
            regions = regions(settings: &str, width: usize) -> Vec<u32>;
            rigFile = rig_file(settings: &str, format: &str, probe: &str) -> Vec<u8>;
            domeFile = dome_file(settings: &str, name: &str) -> Vec<u8>;
            spheres = spheres(settings: &str, size: usize, exponent: i32) -> Vec<f32>;
            targets = targets() -> String;
            prefilter = prefilter(settings: &str) -> String;
            iblFile = ibl_file(settings: &str, content: &str, container: &str) -> Vec<u8>;
            tablesFile = tables_file(settings: &str, format: &str) -> Vec<u8>;
            snippet = snippet(language: &str) -> Vec<u8>;
        }
    };
}
