// The wall as a translucent shell, tube and sac of different colours.

import * as THREE from "three";
import { rgb } from "./wires.js";

const VERTEX = /* glsl */ `
uniform vec4 sac;        // centre and radius, mm
uniform float sphere, nearer;
out vec3 vNormal, vPlace;

void main() {
  vPlace = position;
  vNormal = (modelViewMatrix * vec4(mix(normal, position - sac.xyz, sphere), 0.0)).xyz;
  vec4 place = modelViewMatrix * vec4(position, 1.0);
  // Wires are drawn thicker than they are, and may press into the wall: it steps aside, mm, so as
  // not to cut into them. In a parallel view that is not seen.
  place.z += nearer;
  gl_Position = projectionMatrix * place;
}`;

const FRAGMENT = /* glsl */ `
uniform vec4 sac;
uniform vec3 vessel, inSac;
uniform float sphere, strength;
in vec3 vNormal, vPlace;
out vec4 colour;

void main() {
  float facing = abs(normalize(vNormal).z);
  float marked = max(sphere, step(distance(vPlace, sac.xyz), sac.w));
  colour = vec4(mix(vessel, inSac, marked), 0.16 * strength + 0.45 * pow(1.0 - facing, 2.5));
}`;

/** Far and near side of the wall; a three.js object, to be added after the wires. */
export class VesselShell extends THREE.Group {
  constructor() {
    super();
    this.geometry = new THREE.BufferGeometry();
    // Of the first part what lies in the sphere is marked, of the second, a sphere, everything.
    this.sacs = [new THREE.Vector4(0, 0, 0, -1), new THREE.Vector4()];
    this.sides = [THREE.BackSide, THREE.FrontSide].map((side) => {
      const mesh = new THREE.Mesh(this.geometry, this.sacs.map((sac, sphere) => material(side, sac, sphere)));
      mesh.frustumCulled = false;
      return mesh;
    });
    this.add(...this.sides);
  }

  /** Tube and sac as lumenMesh makes them. */
  setTube({ vertices, normals, triangles, tubeTriangles }) {
    this.tube = true;
    this.#fill(vertices, normals, triangles, tubeTriangles);
  }

  /** Any surface, vertices (3n) mm and triangles (3m); its bounding sphere. */
  setSurface(vertices, triangles) {
    this.tube = false;
    const surface = new THREE.BufferGeometry();
    surface.setAttribute("position", new THREE.BufferAttribute(Float32Array.from(vertices), 3));
    surface.setIndex(new THREE.BufferAttribute(Uint32Array.from(triangles), 1));
    surface.computeVertexNormals();
    surface.computeBoundingSphere();
    const { position, normal } = surface.attributes;
    this.#fill(position.array, normal.array, surface.index.array, triangles.length / 3);
    return surface.boundingSphere;
  }

  /** `colours` of View; sac {centre, radius} mm, or null. */
  setColours({ vessel, sac: inSac, ground }, sac) {
    const centre = sac?.centre ?? [0, 0, 0];
    this.sacs[0].set(...centre, sac && !this.tube ? sac.radius : -1);
    this.sacs[1].set(...centre, 0);
    for (const { side, uniforms } of this.sides.flatMap((mesh) => mesh.material)) {
      // The far side is the ground on which wires are seen, the near side must not veil them.
      uniforms.strength.value = side === THREE.FrontSide ? 0.5 : ground;
      uniforms.vessel.value.set(...rgb(vessel));
      uniforms.inSac.value.set(...rgb(inSac));
    }
  }

  /** Frees what it has in graphics memory; if it is drawn again, that is put there again. */
  dispose() {
    this.geometry.dispose();
    this.sides.flatMap((mesh) => mesh.material).forEach((each) => each.dispose());
  }

  #fill(vertices, normals, triangles, first) {
    fill(this.geometry, "position", vertices);
    fill(this.geometry, "normal", normals);
    fill(this.geometry, "index", triangles);
    this.geometry.clearGroups();
    this.geometry.addGroup(0, 3 * first, 0);
    this.geometry.addGroup(3 * first, triangles.length - 3 * first, 1);
  }
}

function material(side, sac, sphere) {
  return new THREE.ShaderMaterial({
    glslVersion: THREE.GLSL3,
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
    side,
    transparent: true,
    depthWrite: false,
    uniforms: {
      sac: { value: sac },
      sphere: { value: sphere },
      nearer: { value: side === THREE.FrontSide ? 0.5 : -0.5 },
      strength: { value: 1 },
      vessel: { value: new THREE.Vector3() },
      inSac: { value: new THREE.Vector3() },
    },
  });
}

/** Writes an attribute, or the index, into its buffer, or into a larger one. */
function fill(geometry, name, values) {
  const old = name === "index" ? geometry.index : geometry.attributes[name];
  if (old && old.array.length >= values.length) {
    old.array.set(values);
    old.needsUpdate = true;
    return;
  }
  // The buffer that has become too small goes with the geometry's others, which come again.
  geometry.dispose();
  const array = new values.constructor(3 * Math.ceil((1.3 * values.length) / 3));
  array.set(values);
  if (name === "index") geometry.setIndex(new THREE.BufferAttribute(array, 1));
  else geometry.setAttribute(name, new THREE.BufferAttribute(array, 3));
}
