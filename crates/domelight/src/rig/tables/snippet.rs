//! Tables in the languages of shaders.

use crate::names::read_by_name;

/// A language of shaders.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ShaderLanguage {
    /// WebGPU's language.
    Wgsl,
    /// OpenGL's language, as WebGL 2 has it.
    Glsl,
    /// Direct3D's language.
    Hlsl,
    /// Slang.
    Slang,
    /// CUDA C++, for OptiX as well.
    Cuda,
    /// The Metal shading language.
    Metal,
}

/// The words of a language that looks like C.
struct Dialect {
    /// How the tables are bound and loaded.
    head: &'static str,
    /// Before a function.
    function: &'static str,
    /// The first parameter of functions, and what is passed for it.
    tables: [&'static str; 2],
    inout_float: &'static str,
    /// The type of two, three and four numbers, without the number.
    vector: &'static str,
    new_float3: &'static str,
}

const GLSL: Dialect = Dialect {
    head: "\
// The light of an environment map, made by domelight: a texture of RGBA32F without filtering, row 0 of the file first.
uniform highp sampler2D domelight_tables;
vec4 domelight_load(int i) { int n = textureSize(domelight_tables, 0).x; \
return texelFetch(domelight_tables, ivec2(i % n, i / n), 0); }
",
    function: "",
    tables: ["", ""],
    inout_float: "inout float",
    vector: "vec",
    new_float3: "vec3",
};

const HLSL: Dialect = Dialect {
    head: "\
// The light of an environment map, made by domelight: a buffer of the numbers in the .bin file.
StructuredBuffer<float4> domelight_tables : register(t0);
float4 domelight_load(int i) { return domelight_tables[i]; }
",
    function: "",
    tables: ["", ""],
    inout_float: "inout float",
    vector: "float",
    new_float3: "float3",
};

const SLANG: Dialect = Dialect {
    head: "\
// The light of an environment map, made by domelight: a buffer of the numbers in the .bin file.
StructuredBuffer<float4> domelight_tables;
float4 domelight_load(int i) { return domelight_tables[i]; }
",
    ..HLSL
};

const CUDA: Dialect = Dialect {
    head: "\
// The light of an environment map, made by domelight: `tables` points to the numbers in the .bin file.
__device__ inline float4 domelight_load(const float4* tables, int i) { return tables[i]; }
",
    function: "__device__ inline ",
    tables: ["const float4* tables, ", "tables, "],
    inout_float: "float&",
    vector: "float",
    new_float3: "make_float3",
};

const METAL: Dialect = Dialect {
    head: "\
// The light of an environment map, made by domelight: `tables` is a buffer of the numbers in the .bin file.
// After #include <metal_stdlib> and using namespace metal.
inline float4 domelight_load(const device float4* tables, int i) { return tables[i]; }
",
    function: "inline ",
    tables: ["const device float4* tables, ", "tables, "],
    inout_float: "thread float&",
    vector: "float",
    new_float3: "float3",
};

impl Dialect {
    fn write(&self) -> String {
        let words = [
            ("FN ", self.function),
            ("TABLES ", self.tables[0]),
            ("LOAD(", "domelight_load(PASS "),
            ("PASS ", self.tables[1]),
            ("INOUT_FLOAT", self.inout_float),
            ("NEW_FLOAT3", self.new_float3),
            ("FLOAT", self.vector),
        ];
        let body = include_str!("snippet.c").to_owned();
        let body = words.iter().fold(body, |text, (from, to)| text.replace(from, to));
        format!("{}{body}", self.head)
    }
}

impl ShaderLanguage {
    /// All languages.
    pub const ALL: [Self; 6] =
        [Self::Wgsl, Self::Glsl, Self::Hlsl, Self::Slang, Self::Cuda, Self::Metal];

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Wgsl => "wgsl",
            Self::Glsl => "glsl",
            Self::Hlsl => "hlsl",
            Self::Slang => "slang",
            Self::Cuda => "cuda",
            Self::Metal => "metal",
        }
    }

    /// The extension of a file with a snippet.
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Wgsl => "wgsl",
            Self::Glsl => "glsl",
            Self::Hlsl => "hlsl",
            Self::Slang => "slang",
            Self::Cuda => "cuh",
            Self::Metal => "metal",
        }
    }

    /// At most 60 lines that read the tables: `domelight_sample(u)` gives a direction, its radiance and its density,
    /// `domelight_pdf(direction)` the density, `domelight_look_up(direction)` radiance and density. CUDA and Metal pass
    /// the tables first.
    pub fn snippet(self) -> String {
        match self {
            Self::Wgsl => concat!(
                "// The light of an environment map, made by domelight: a buffer of the numbers in the .bin file.\n",
                include_str!("snippet.wgsl")
            )
            .to_owned(),
            Self::Glsl => GLSL.write(),
            Self::Hlsl => HLSL.write(),
            Self::Slang => SLANG.write(),
            Self::Cuda => CUDA.write(),
            Self::Metal => METAL.write(),
        }
    }
}

read_by_name!(ShaderLanguage::ALL, UnknownLanguage, "unknown language");

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn snippets_are_short_and_complete() {
        for language in ShaderLanguage::ALL {
            let text = language.snippet();
            assert!(text.lines().count() <= 60, "{}: {}", language.name(), text.lines().count());
            assert!(text.lines().all(|line| line.len() <= 160), "{}", language.name());
            for word in ["FN ", "LOAD", "TABLES", "PASS", "FLOAT"] {
                assert!(!text.contains(word), "{} has {word}", language.name());
            }
            for name in ["domelight_sample", "domelight_pdf", "domelight_look_up"] {
                assert!(text.contains(name), "{} lacks {name}", language.name());
            }
            assert_eq!(language.name().parse(), Ok(language));
        }
        assert!("basic".parse::<ShaderLanguage>().is_err());
    }
}
