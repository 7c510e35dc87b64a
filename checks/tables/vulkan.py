"""Runs a snippet on a Vulkan driver without a graphics card: vulkan.py wgsl|glsl|hlsl FOLDER.

Reads u.bin and each NAME.tables, the columns of a texture and its numbers, and writes NAME.samples: direction, density,
radiance, and the density of a look-up in that direction. glslang compiles GLSL and HLSL to SPIR-V; naga, in wgpu, compiles that
and WGSL for the driver.
"""

import pathlib
import struct
import subprocess
import sys

import wgpu

# What each host adds to its snippet: the points, the samples, and the loop over them.
WGSL = pathlib.Path(__file__).with_name("host.wgsl").read_text()
# Vulkan has no uniforms without a binding, and naga no textures that are samplers.
GLSL_HEAD = """#version 450
#extension GL_EXT_samplerless_texture_functions : require
#define sampler2D texture2D
"""
GLSL = """
layout(set = 0, binding = 1) readonly buffer Points { vec2 points[]; };
layout(set = 0, binding = 2) buffer Samples { vec4 samples[]; };
layout(local_size_x = 64) in;
void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= points.length()) return;
    DomelightSample s = domelight_sample(points[i]);
    samples[2u * i] = vec4(s.direction, s.pdf);
    samples[2u * i + 1u] = vec4(s.radiance, domelight_pdf(s.direction));
}
"""
HLSL = """
StructuredBuffer<float2> points : register(t1);
RWStructuredBuffer<float4> samples : register(u2);
[numthreads(64, 1, 1)] void main(uint3 id : SV_DispatchThreadID) {
    uint n, stride;
    points.GetDimensions(n, stride);
    if (id.x >= n) return;
    DomelightSample s = domelight_sample(points[id.x]);
    samples[2 * id.x] = float4(s.direction, s.pdf);
    samples[2 * id.x + 1] = float4(s.radiance, domelight_pdf(s.direction));
}
"""


def spir_v(folder, code, *options):
    """What glslang makes of a compute shader."""
    source, binary = folder / "shader.comp", folder / "shader.spv"
    source.write_text(code)
    command = ["glslangValidator", "--quiet", "-V", "-S", "comp", "-e", "main", *options, "-o", binary, source]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"glslang: {done.stdout}{done.stderr}")
    return binary.read_bytes()


def compiled(language, folder):
    snippet = (folder / "snippet").read_text()
    if language == "wgsl":
        return f"{snippet}\n{WGSL}"
    if language == "glsl":
        return spir_v(folder, GLSL_HEAD + snippet + GLSL, "--auto-map-bindings")
    return spir_v(folder, snippet + HLSL, "-D")


def device():
    """A processor as a Vulkan device, such as Mesa's lavapipe."""
    for adapter in wgpu.gpu.enumerate_adapters_sync():
        if (adapter.info["backend_type"], adapter.info["adapter_type"]) == ("Vulkan", "CPU"):
            return adapter.request_device_sync()
    sys.exit("no Vulkan driver without a graphics card; install mesa-vulkan-drivers")


def tables(device, language, numbers):
    """As the snippet takes them: a buffer, or a texture."""
    columns, numbers = struct.unpack_from("<I", numbers)[0], numbers[4:]
    if language != "glsl":
        buffer = device.create_buffer_with_data(data=numbers, usage=wgpu.BufferUsage.STORAGE)
        return {"buffer": buffer}
    size = (columns, len(numbers) // 16 // columns, 1)
    usage = wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_DST
    texture = device.create_texture(size=size, format="rgba32float", usage=usage)
    layout = {"bytes_per_row": 16 * columns, "rows_per_image": size[1]}
    device.queue.write_texture({"texture": texture}, numbers, layout, size)
    return texture.create_view()


def layout(device, language):
    compute = wgpu.ShaderStage.COMPUTE
    read = {"buffer": {"type": "read-only-storage"}}
    light = {"texture": {"sample_type": "unfilterable-float"}} if language == "glsl" else read
    kinds = [light, read, {"buffer": {"type": "storage"}}]
    return device.create_bind_group_layout(
        entries=[{"binding": i, "visibility": compute, **kind} for i, kind in enumerate(kinds)]
    )


def main():
    language, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    gpu = device()
    points = (folder / "u.bin").read_bytes()
    u = gpu.create_buffer_with_data(data=points, usage=wgpu.BufferUsage.STORAGE)
    module = gpu.create_shader_module(code=compiled(language, folder))
    groups = layout(gpu, language)
    pipeline = gpu.create_compute_pipeline(
        layout=gpu.create_pipeline_layout(bind_group_layouts=[groups]),
        compute={"module": module, "entry_point": "main"},
    )
    for path in folder.glob("*.tables"):
        usage = wgpu.BufferUsage.STORAGE | wgpu.BufferUsage.COPY_SRC
        samples = gpu.create_buffer(size=4 * len(points), usage=usage)
        resources = [tables(gpu, language, path.read_bytes()), {"buffer": u}, {"buffer": samples}]
        entries = [{"binding": i, "resource": resource} for i, resource in enumerate(resources)]
        encoder = gpu.create_command_encoder()
        compute = encoder.begin_compute_pass()
        compute.set_pipeline(pipeline)
        compute.set_bind_group(0, gpu.create_bind_group(layout=groups, entries=entries))
        compute.dispatch_workgroups((len(points) // 8 + 63) // 64)
        compute.end()
        gpu.queue.submit([encoder.finish()])
        path.with_suffix(".samples").write_bytes(gpu.queue.read_buffer(samples))


main()
