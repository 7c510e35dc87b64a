"""Renders what standard input asks for, one JSON object a line; an answer a line on standard output.

{"scene": {...}}                        reads and builds a scene: {"cpu": s, "wall": s}
{"spp": n, "seed": n, "out": "file"}    renders it, RGBA as raw float32: {"cpu": s, "wall": s}

Times are of the call alone; CPU time is that of all threads of this process.
"""
import json
import os
import signal
import sys
import time

# The program that asks decides when to end; and what others print is no answer.
signal.signal(signal.SIGINT, signal.SIG_IGN)
answers = os.fdopen(os.dup(1), "w")
os.dup2(2, 1)


def answer(**values):
    print(json.dumps(values), file=answers, flush=True)


threads, variant = int(sys.argv[1]), sys.argv[2]
import drjit as dr
import mitsuba as mi
import numpy as np

mi.set_variant(variant)
dr.set_thread_count(threads)
answer(version=mi.__version__, variant=variant, threads=dr.thread_count())


def timed(work):
    cpu, wall = time.process_time(), time.perf_counter()
    result = work()
    return result, {"cpu": time.process_time() - cpu, "wall": time.perf_counter() - wall}


def load(s):
    mi_t = mi.ScalarTransform4f
    matrix = np.eye(4)
    matrix[:3, :3] = s["rotation"]
    environment = {
        "type": "envmap",
        "filename": s["environment"],
        "mis_compensation": True,
        "to_world": mi_t(matrix.tolist()),
    }
    sensor = {
        "type": "perspective",
        "fov": s["fov"],
        "fov_axis": "y",
        "near_clip": 1e-3,
        "far_clip": 1e4,
        "to_world": mi_t().look_at(origin=s["origin"], target=s["target"], up=s["up"]),
        "film": {
            "type": "hdrfilm",
            "width": s["size"][0],
            "height": s["size"][1],
            "pixel_format": "rgba",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
        "sampler": {"type": "multijitter", "sample_count": 4},
    }
    return mi.load_dict({
        "type": "scene",
        "integrator": {
            "type": "direct",
            "emitter_samples": 1,
            "bsdf_samples": 1,
            "hide_emitters": True,
        },
        "sensor": sensor,
        "mesh": {"type": "ply", "filename": s["mesh"], "bsdf": s["bsdf"]},
        "environment": environment,
    })


def render(spp, seed):
    image = mi.render(scene, spp=spp, seed=seed)
    dr.eval(image)
    dr.sync_thread()
    return image


scene = None
for line in sys.stdin:
    asked = json.loads(line)
    try:
        if "scene" in asked:
            scene, times = timed(lambda: load(asked["scene"]))
        else:
            image, times = timed(lambda: render(asked["spp"], asked["seed"]))
            np.array(image).astype(np.float32).tofile(asked["out"])
        answer(**times)
    except Exception as error:
        answer(error=str(error))
