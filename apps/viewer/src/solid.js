// The colours of the solid where it is cut: those of the layers there.

import { Color, Data3DTexture, LinearFilter, MeshLambertMaterial, RGBAFormat, Vector3 } from 'three';

const unknown = [201, 204, 210];

/** What the shaders of all cuts of a block share. */
export function solidUniforms() {
  return {
    volume: { value: new Data3DTexture(new Uint8Array(4), 1, 1, 1) },
    volumeNodes: { value: new Vector3(1, 1, 1) },
    volumeLower: { value: new Vector3() },
    volumeUpper: { value: new Vector3(1, 1, 1) },
    lowerLayers: { value: 0 },
    layerColours: { value: Array.from({ length: 5 }, () => new Color()) },
  };
}

/** solid has nodes, bytes, lower, upper and colours, bottom up; null where the layers are not known. */
export function setSolid(uniforms, solid) {
  uniforms.volume.value.dispose();
  uniforms.lowerLayers.value = solid ? solid.colours.length - 1 : 0;
  uniforms.layerColours.value.forEach((colour, n) => {
    const [red, green, blue] = solid?.colours[n] ?? unknown;
    colour.setRGB(red / 255, green / 255, blue / 255);
  });
  if (!solid) return;
  const texture = new Data3DTexture(solid.bytes, ...solid.nodes);
  texture.format = RGBAFormat;
  texture.minFilter = texture.magFilter = LinearFilter;
  texture.needsUpdate = true;
  uniforms.volume.value = texture;
  uniforms.volumeNodes.value.set(...solid.nodes);
  uniforms.volumeLower.value.copy(solid.lower);
  uniforms.volumeUpper.value.copy(solid.upper);
}

const declarations = `
uniform sampler3D volume;
uniform vec3 volumeNodes;
uniform vec3 volumeLower;
uniform vec3 volumeUpper;
uniform int lowerLayers;
uniform vec3 layerColours[5];
varying vec3 placeInBlock;
`;

// The lowest layer that holds a place is what is there; a line where one ends.
const colouring = `
vec3 part = (placeInBlock - volumeLower) / (volumeUpper - volumeLower);
vec4 layers = texture(volume, (part * (volumeNodes - 1.0) + 0.5) / volumeNodes) - 128.0 / 255.0;
vec4 change = fwidth(layers);
diffuseColor.rgb = layerColours[lowerLayers];
for (int n = 3; n >= 0; --n) {
  if (n >= lowerLayers) continue;
  if (layers[n] < 0.0) diffuseColor.rgb = layerColours[n];
  if (abs(layers[n]) < 0.8 * change[n]) diffuseColor.rgb = vec3(0.16);
}
`;

/** The material of a cut; parameters are those of MeshLambertMaterial. */
export function solidMaterial(uniforms, parameters) {
  const material = new MeshLambertMaterial(parameters);
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, uniforms);
    shader.vertexShader = shader.vertexShader
      .replace('#include <common>', '#include <common>\nvarying vec3 placeInBlock;')
      .replace(
        '#include <project_vertex>',
        '#include <project_vertex>\nplaceInBlock = (modelMatrix * vec4(transformed, 1.0)).xyz;',
      );
    shader.fragmentShader = shader.fragmentShader
      .replace('#include <common>', `#include <common>\n${declarations}`)
      .replace('#include <color_fragment>', `#include <color_fragment>\n${colouring}`);
  };
  return material;
}
