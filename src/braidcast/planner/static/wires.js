// Wires as lit tubes. The vertex shader reads the nodes from a texture: to move all wires is to
// write that texture, 54 kB for the paper's device.

import * as THREE from "three";

/** Wires are 28 µm thick: at their own size most would be thinner than a pixel. */
export const MAGNIFICATION = 2;

// 32 colours of each, RRGGBB: perceptually uniform, in order also for the colour-blind (matplotlib, CC0).
const TABLES = {
  viridis:
    "440154470d6048186a482374472e7c4538824241863e4a893a548c365d8d32658e2e6d8e2b758e287d8e25848e228c8d1f948c1e9c8920a38625ab822eb37c3aba7648c16e58c7656ccd5a7fd34e93d741a8db34c0df25d5e21aeae51afde725",
  cividis:
    "00224e00285b002e6a0533711c396f293f6e33446d3c4a6c45506c4d556c555b6d5c616e6467706b6d72727274787877807f78888578908b78979177a09875a89e73b0a571b9ab6dc2b369cbb965d3c05fdcc859e6d051efd748f8df3cfee838",
};
const COLOURS = 32;

/** The colours of a palette from its low to its high end, ["#rrggbb" × 32]: a legend's gradient. */
export function palette(name) {
  return Array.from({ length: COLOURS }, (_, i) => `#${TABLES[name].slice(6 * i, 6 * i + 6)}`);
}

function paletteTexture(name) {
  const bytes = Uint8Array.from(palette(name).flatMap((c) => [1, 3, 5].map((i) => parseInt(c.slice(i, i + 2), 16)).concat(255)));
  const texture = new THREE.DataTexture(bytes, COLOURS, 1);
  texture.minFilter = texture.magFilter = THREE.LinearFilter;
  texture.needsUpdate = true;
  return texture;
}

const VERTEX = /* glsl */ `
// x, y, z in mm and share of the palette; a row for each wire, and one of the rings' centres.
uniform highp sampler2D nodes;
uniform float radius, leastRadius;  // mm
out vec3 vNormal;
out float vShare, vAverted;

void main() {
  int last = textureSize(nodes, 0).x - 1, node = int(position.x), wire = gl_InstanceID;
  vec4 here = texelFetch(nodes, ivec2(node, wire), 0);
  vec3 along = texelFetch(nodes, ivec2(min(node + 1, last), wire), 0).xyz
             - texelFetch(nodes, ivec2(max(node - 1, 0), wire), 0).xyz;
  vec3 tangent = normalize((modelViewMatrix * vec4(along, 0.0)).xyz);
  // Half a tube turned to the eye is all of it that is seen; the projection is parallel.
  vec3 side = vec3(tangent.y, -tangent.x, 0.0);
  side = dot(side, side) > 1e-8 ? normalize(side) : vec3(1.0, 0.0, 0.0);
  vNormal = cos(position.y) * cross(side, tangent) + sin(position.y) * side;
  vec3 centre = (modelViewMatrix * vec4(here.xyz, 1.0)).xyz;
  vShare = here.w;
  vec3 ring = texelFetch(nodes, ivec2(node, textureSize(nodes, 0).y - 1), 0).xyz;
  vec3 outward = (modelViewMatrix * vec4(here.xyz - ring, 0.0)).xyz;
  vAverted = 0.5 - 0.5 * outward.z / max(length(outward), 1e-6);
  gl_Position = projectionMatrix * vec4(centre + max(radius, leastRadius) * vNormal, 1.0);
}`;

const FRAGMENT = /* glsl */ `
uniform sampler2D palette;
uniform vec3 plain, background;
uniform float coloured, fading;
in vec3 vNormal;
in float vShare, vAverted;
out vec4 colour;

void main() {
  vec3 normal = normalize(vNormal);
  vec3 own = mix(plain, texture(palette, vec2((0.5 + ${COLOURS - 1}.0 * clamp(vShare, 0.0, 1.0)) / ${COLOURS}.0, 0.5)).rgb, coloured);
  float light = max(dot(normal, vec3(-0.30, 0.45, 0.84)), 0.0);
  vec3 lit = own * (0.5 + 0.55 * light) + 0.16 * pow(light, 24.0);
  // The side of the braid that is turned away fades: a parallel view has no other sign of depth.
  colour = vec4(mix(lit, background, fading * vAverted), 1.0);
}`;

/** Tubes through `nodes` nodes each, `count` of them; a three.js object. */
export class Wires extends THREE.Mesh {
  /** Radius in mm as drawn, least radius in pixels, plain colour "#rrggbb" and share 0…1 of
   * the background that the side turned away takes on. */
  constructor(count, nodes, { radius, pixels = 0.6, colour = "#6b7785", fading = 0 }) {
    const across = [-1, -0.5, 0, 0.5, 1].map((share) => (share * Math.PI) / 2);
    const place = new Float32Array(3 * nodes * across.length);
    const index = [];
    for (let i = 0; i < nodes; i++) {
      across.forEach((angle, k) => place.set([i, angle, 0], 3 * (i * across.length + k)));
      for (let k = 1; k < across.length && i > 0; k++) {
        const b = i * across.length + k;
        const d = b - across.length;
        index.push(d - 1, b - 1, d, d, b - 1, b);
      }
    }
    const geometry = new THREE.InstancedBufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(place, 3));
    geometry.setIndex(index);
    geometry.instanceCount = count;
    const texture = new THREE.DataTexture(new Float32Array(4 * (count + 1) * nodes), nodes, count + 1, THREE.RGBAFormat, THREE.FloatType);
    const material = new THREE.ShaderMaterial({
      glslVersion: THREE.GLSL3,
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      side: THREE.DoubleSide,
      uniforms: {
        nodes: { value: texture },
        radius: { value: radius },
        leastRadius: { value: 0 },
        palette: { value: null },
        plain: { value: new THREE.Vector3() },
        background: { value: new THREE.Vector3() },
        coloured: { value: 0 },
        fading: { value: fading },
      },
    });
    super(geometry, material);
    Object.assign(this, { wireCount: count, nodes, pixels, frustumCulled: false });
    this.data = texture.image.data;
    this.setColour(colour);
  }

  setColour(colour) {
    this.material.uniforms.plain.value.set(...rgb(colour));
  }

  /** Move to positions (3N) mm, node `order[k]` being the k-th along the wires, one after another. */
  setPositions(positions, order = null) {
    const { data, nodes, wireCount } = this;
    const rings = data.subarray(4 * wireCount * nodes).fill(0);
    for (let k = 0; k < wireCount * nodes; k++) {
      const node = 3 * (order ? order[k] : k);
      const ring = 4 * (k % nodes);
      for (let i = 0; i < 3; i++) {
        data[4 * k + i] = positions[node + i];
        rings[ring + i] += positions[node + i] / wireCount;
      }
    }
    this.material.uniforms.nodes.value.needsUpdate = true;
  }

  /** Colours of values (N), `low` and `high` being the ends of the palette; null: plain. */
  setValues(values, [low, high] = [0, 1], name = "viridis", order = null) {
    const { uniforms } = this.material;
    uniforms.coloured.value = values ? 1 : 0;
    if (!values) return;
    for (let k = 0; k < this.wireCount * this.nodes; k++) {
      // The texture interpolates shares: beyond the ends they stay at the ends.
      const share = (values[order ? order[k] : k] - low) / (high - low);
      this.data[4 * k + 3] = share > 0 ? Math.min(share, 1) : 0;
    }
    uniforms.nodes.value.needsUpdate = true;
    if (this.palette === name) return;
    uniforms.palette.value?.dispose();
    uniforms.palette.value = paletteTexture(name);
    this.palette = name;
  }

  /** What depends on the camera, mm of a device pixel, and on the background. */
  prepare(pixel, background) {
    this.material.uniforms.leastRadius.value = this.pixels * pixel;
    this.material.uniforms.background.value.set(...rgb(background));
  }

  dispose() {
    this.geometry.dispose();
    this.material.uniforms.nodes.value.dispose();
    this.material.uniforms.palette.value?.dispose();
    this.material.dispose();
  }
}

/** Red, green and blue, 0…1, of "#rrggbb", as the screen shows them. */
export function rgb(colour) {
  return [1, 3, 5].map((i) => parseInt(colour.slice(i, i + 2), 16) / 255);
}
