"""Mitsuba 3 renders the sphere under a scene file that includes the rig."""

import mitsuba as mi
import numpy as np

import reference

mi.set_variant("scalar_rgb")
VERSION = mi.__version__

SCENE = """<scene version="3.0.0">
    <include filename="{rig}"/>
    <integrator type="direct">
        <integer name="emitter_samples" value="1"/><integer name="bsdf_samples" value="0"/>
    </integrator>
    <sensor type="orthographic">
        <transform name="to_world">
            <lookat origin="0, 0, {z}" target="0, 0, 0" up="0, 1, 0"/>
        </transform>
        <sampler type="multijitter"/>
        <film type="hdrfilm">
            <integer name="width" value="{size}"/><integer name="height" value="{size}"/>
            <rfilter type="box"/>
        </film>
    </sensor>
    <shape type="sphere"><bsdf type="diffuse"><rgb name="reflectance" value="1"/></bsdf></shape>
</scene>
"""


def render(rig, view, dome):
    """The picture of the rig in the file `rig`: the sum over its emitters, each rendered alone, for
    picking one at random is the most of the noise."""
    path = rig.with_name(f"mitsuba-{view}.xml")
    path.write_text(SCENE.format(rig=rig.name, z=4 * reference.VIEWS[view], size=reference.SIZE))
    picture = np.zeros((reference.SIZE, reference.SIZE, 3))
    for chosen in range(len(mi.load_file(str(path)).emitters())):
        scene = mi.load_file(str(path))
        parameters = mi.traverse(scene)
        weights = [key for key in parameters.keys() if key.endswith(".sampling_weight")]
        for i, key in enumerate(weights):
            if i != chosen:
                parameters[key] = 0.0
        parameters.update()
        delta = mi.has_flag(scene.emitters()[chosen].flags(), mi.EmitterFlags.DeltaDirection)
        picture += np.array(mi.render(scene, spp=16 if delta else 400), float)[..., :3]
    return picture
