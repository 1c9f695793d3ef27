// Files for other programs, the same as Python's write_polylines and write_stl write.

/** Wires as a VTK XML PolyData file (text): positions (3N) mm, wires (wires × (segments + 1)) node
 * indices, arrays {name: values (N) or (N k)}; whole-number arrays (Int32Array …) become Int64. */
export function vtp(positions, wires, arrays, segments) {
  const nodes = positions.length / 3;
  const count = wires.length / (segments + 1);
  if (!Number.isInteger(count)) throw new Error(`${wires.length} nodes are no whole number of wires of ${segments} segments`);
  const ends = Int32Array.from({ length: count }, (_, wire) => (wire + 1) * (segments + 1));
  return [
    '<?xml version="1.0"?>',
    '<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">',
    "<PolyData>",
    `<Piece NumberOfPoints="${nodes}" NumberOfLines="${count}" NumberOfVerts="0" NumberOfStrips="0" NumberOfPolys="0">`,
    "<PointData>",
    ...Object.entries(arrays).map(([name, values]) => dataArray(name, values, values.length / nodes)),
    "</PointData>",
    "<Points>",
    dataArray("Points", Float64Array.from(positions), 3),
    "</Points>",
    "<Lines>",
    dataArray("connectivity", Int32Array.from(wires), 1),
    dataArray("offsets", ends, 1),
    "</Lines>",
    "</Piece>",
    "</PolyData>",
    "</VTKFile>\n",
  ].join("\n");
}

/** Base64 of a 64-bit byte count followed by the little-endian values. */
function dataArray(name, values, components) {
  const whole = !(values instanceof Float64Array || values instanceof Float32Array || Array.isArray(values));
  const bytes = new Uint8Array(8 + 8 * values.length);
  const data = new DataView(bytes.buffer);
  data.setBigUint64(0, BigInt(8 * values.length), true);
  values.forEach((value, i) => (whole ? data.setBigInt64(8 + 8 * i, BigInt(value), true) : data.setFloat64(8 + 8 * i, value, true)));
  let text = "";
  // In parts: a call takes only so many arguments.
  for (let i = 0; i < bytes.length; i += 8192) text += String.fromCharCode(...bytes.subarray(i, i + 8192));
  const quoted = name.replace(/[&<"]/g, (sign) => `&#${sign.charCodeAt(0)};`);
  return `<DataArray type="${whole ? "Int64" : "Float64"}" Name="${quoted}" NumberOfComponents="${components}" format="binary">${btoa(text)}</DataArray>`;
}

/** A binary STL file (ArrayBuffer) of vertices (3n) mm and triangles (3m) vertex indices. */
export function stl(vertices, triangles) {
  const count = triangles.length / 3;
  const data = new DataView(new ArrayBuffer(84 + 50 * count));
  new Uint8Array(data.buffer).set(new TextEncoder().encode("braidcast lumen surface, mm".padEnd(80)));
  data.setUint32(80, count, true);
  for (let t = 0; t < count; t++) {
    const [a, b, c] = [0, 1, 2].map((k) => vertices.slice(3 * triangles[3 * t + k], 3 * triangles[3 * t + k] + 3));
    const [ux, uy, uz, vx, vy, vz] = [b[0] - a[0], b[1] - a[1], b[2] - a[2], c[0] - a[0], c[1] - a[1], c[2] - a[2]];
    const normal = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    const size = Math.hypot(...normal) || 1;
    [...normal.map((v) => v / size), ...a, ...b, ...c].forEach((v, i) => data.setFloat32(84 + 50 * t + 4 * i, v, true));
  }
  return data.buffer;
}
