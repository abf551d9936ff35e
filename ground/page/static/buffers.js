// Buffers of the 3D panel (ground/page/map/buffers.py), in a form that a graphics library takes. Pure: no drawing here.
const CLOUD_HEAD = 4, TERRAIN_HEAD = 5, F64_BYTES = 8;
const RAMP = [[0, 32, 77], [60, 77, 110], [124, 123, 120], [188, 175, 111], [255, 234, 70]];  // cividis, as the map's

// Returns the cloud: positions (points x 3, m), colours (points x 3, 0..1, by height), taken_utc_s (null: not known).
export function cloud_of(buffer) {
  const [points, whole, stop, taken] = new Float64Array(buffer, 0, CLOUD_HEAD);
  const positions = new Float32Array(buffer, CLOUD_HEAD * F64_BYTES, 3 * points);
  return { points, whole, stop, taken_utc_s: Number.isNaN(taken) ? null : taken, positions, colours: colours_of(positions) };
}

// Returns colours by height: dark blue low, yellow high; the ends are the 2nd and 98th percentile.
export function colours_of(positions) {
  const heights = positions.filter((_, k) => k % 3 === 2), sorted = Float32Array.from(heights).sort();
  const low = sorted[Math.floor(0.02 * sorted.length)], high = sorted[Math.floor(0.98 * sorted.length)];
  const colours = new Float32Array(positions.length);
  heights.forEach((height, k) => {
    const at = Math.max(0, Math.min(1, (height - low) / Math.max(high - low, 0.05))) * (RAMP.length - 1), step = Math.min(RAMP.length - 2, Math.floor(at));
    for (let part = 0; part < 3; part += 1) colours[3 * k + part] = (RAMP[step][part] + (at - step) * (RAMP[step + 1][part] - RAMP[step][part])) / 255;
  });
  return colours;
}

// Returns the terrain: positions (cells x 3, m) and triangles (indices) between neighbours whose heights are all known.
export function terrain_of(buffer) {
  const [x0, y0, cell, rows, columns] = new Float64Array(buffer, 0, TERRAIN_HEAD);
  const heights = new Float32Array(buffer, TERRAIN_HEAD * F64_BYTES, rows * columns), positions = new Float32Array(3 * heights.length), triangles = [];
  heights.forEach((height, k) => positions.set([x0 + cell * (k % columns), y0 + cell * Math.floor(k / columns), Number.isNaN(height) ? 0 : height], 3 * k));
  for (let row = 0; row + 1 < rows; row += 1) {
    for (let column = 0; column + 1 < columns; column += 1) {
      const k = row * columns + column, corners = [k, k + 1, k + columns + 1, k + columns];
      if (corners.every((one) => !Number.isNaN(heights[one]))) triangles.push(corners[0], corners[1], corners[2], corners[0], corners[2], corners[3]);
    }
  }
  return { positions, triangles };
}
