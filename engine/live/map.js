// The map: the seabed from above, with the echoes on it.
import {$, clamp, columnOf, css, dark, fitCanvas} from './common.js';

export const map = {dirty: true};

export function takeBed(bytes, rows, colours) {
  const view = new DataView(bytes), columns = view.getUint32(0, true), rowCount = view.getUint32(4, true);
  const [west, south, east, north] = new Float32Array(bytes, 8, 4);
  const heights = new Float32Array(bytes, 24, columns * rowCount), at = 24 + 4 * columns * rowCount;
  const track = new Float32Array(bytes, at + 4, 2 * view.getUint32(at, true));
  Object.assign(map, {columns, rows: rowCount, west, south, east, north, heights, track, dirty: true, shade: null});
  const mosaic = document.createElement('canvas'), long = 800, size = Math.max(east - west, north - south);
  mosaic.width = Math.ceil((east - west) / size * long);
  mosaic.height = Math.ceil((north - south) / size * long);
  map.mosaic = mosaic;
  map.pen = mosaic.getContext('2d', {willReadFrequently: true});
  map.image = map.pen.createImageData(mosaic.width, mosaic.height);
  map.pixels = new Uint32Array(map.image.data.buffer);
  map.perMetre = long / size;
  for (const row of rows) onMap(row, colours);
}

function shadeBed() {
  const {columns, rows: rowCount, heights} = map, canvas = document.createElement('canvas');
  canvas.width = columns;
  canvas.height = rowCount;
  const context = canvas.getContext('2d'), image = context.createImageData(columns, rowCount);
  const cell = (map.east - map.west) / (columns - 1);
  let low = Infinity, high = -Infinity, slope = 0, n = 0;
  for (const h of heights) if (h === h) { low = Math.min(low, h); high = Math.max(high, h); }
  const gradient = (c, r) => {
    const h = (i, j) => heights[clamp(j, 0, rowCount - 1) * columns + clamp(i, 0, columns - 1)];
    return [(h(c + 1, r) - h(c - 1, r)) / (2 * cell), (h(c, r + 1) - h(c, r - 1)) / (2 * cell)];
  };
  for (let r = 0; r < rowCount; r += 3) for (let c = 0; c < columns; c += 3) {
    const [a, b] = gradient(c, r);
    if (a === a && b === b) { slope += a * a + b * b; ++n; }
  }
  const steep = 0.35 / Math.max(1e-6, Math.sqrt(slope / Math.max(1, n)));
  const base = dark.matches ? [30, 46, 58] : [186, 200, 208], peak = dark.matches ? [74, 104, 116] : [238, 240, 234];
  for (let r = 0; r < rowCount; ++r) for (let c = 0; c < columns; ++c) {
    const h = heights[r * columns + c], [a, b] = gradient(c, r), out = 4 * ((rowCount - 1 - r) * columns + c);
    if (!(h === h)) continue;
    const up = (h - low) / Math.max(1e-6, high - low), light = clamp(1 + steep * (a - b) * 0.4, 0.7, 1.3);
    for (let k = 0; k < 3; ++k) image.data[out + k] = clamp((base[k] + up * (peak[k] - base[k])) * light, 0, 255);
    image.data[out + 3] = 255;
  }
  context.putImageData(image, 0, 0);
  map.shade = canvas;
}

// Draws a line's echoes at their positions, as if the bed were level.
export function onMap(row, colours) {
  if (!map.pixels || row.gap || row.lost) return;
  const sonar = row.setting.sonars[row.sonar], {x: east, y: north, heading, height} = row.origin;
  const right = [Math.cos(heading), -Math.sin(heading)];
  const size = Math.max(2, Math.ceil(0.45 * map.perMetre)), {width, height: high} = map.image;
  const step = Math.max(1, Math.round(size / 1.5 / map.perMetre / sonar.bin_m));
  for (let bin = Math.ceil(height / sonar.bin_m); bin < sonar.bins; bin += step) {
    const slant = (bin + 0.5) * sonar.bin_m, over = Math.sqrt(Math.max(0, slant * slant - height * height));
    for (const line of sonar.lines) {
      const light = row.brightness[columnOf(sonar, line, bin)], side = line.to_starboard;
      const x = Math.round((east + side * over * right[0] - map.west) * map.perMetre - size / 2);
      const y = Math.round((map.north - north - side * over * right[1]) * map.perMetre - size / 2);
      for (let v = Math.max(0, y); v < Math.min(high, y + size); ++v)
        for (let u = Math.max(0, x); u < Math.min(width, x + size); ++u) map.pixels[v * width + u] = colours[light];
    }
  }
}

// Draws the map with the vehicle at the row's position, if the row or the map is new.
export function drawMap(row, isNew) {
  const canvas = $('map');
  if (!map.heights || !(map.dirty || isNew)) return;
  map.dirty = false;
  fitCanvas(canvas);
  if (!map.shade) shadeBed();
  const context = canvas.getContext('2d', {willReadFrequently: true}), scale = devicePixelRatio || 1, pad = 12 * scale, head = 26 * scale;
  const zoom = Math.min((canvas.width - 2 * pad) / (map.east - map.west), (canvas.height - head - pad) / (map.north - map.south));
  const left = (canvas.width - zoom * (map.east - map.west)) / 2, top = head + (canvas.height - head - pad - zoom * (map.north - map.south)) / 2;
  const at = (x, y) => [left + (x - map.west) * zoom, top + (map.north - y) * zoom];
  context.clearRect(0, 0, canvas.width, canvas.height);
  context.imageSmoothingEnabled = true;
  context.drawImage(map.shade, left, top, zoom * (map.east - map.west), zoom * (map.north - map.south));
  map.pen.putImageData(map.image, 0, 0);
  context.drawImage(map.mosaic, left, top, zoom * (map.east - map.west), zoom * (map.north - map.south));
  context.strokeStyle = dark.matches ? 'rgba(255,255,255,.55)' : 'rgba(20,30,40,.55)';
  context.lineWidth = scale;
  context.setLineDash([4 * scale, 4 * scale]);
  context.beginPath();
  for (let i = 0; i < map.track.length; i += 2) context.lineTo(...at(map.track[i], map.track[i + 1]));
  context.stroke();
  context.setLineDash([]);
  if (row) {
    const sonar = row.setting.sonars[row.sonar], {x: east, y: north, heading, height} = row.origin;
    const swath = Math.sqrt(Math.max(0, sonar.range_m ** 2 - height ** 2)), right = [Math.cos(heading), -Math.sin(heading)];
    const [port, starboard] = [-1, 1].map(side => sonar.lines.some(line => line.to_starboard === side) ? swath : 0);
    context.strokeStyle = context.fillStyle = css('--accent');
    context.lineWidth = 2 * scale;
    context.beginPath();
    context.moveTo(...at(east - port * right[0], north - port * right[1]));
    context.lineTo(...at(east + starboard * right[0], north + starboard * right[1]));
    context.stroke();
    const [x, y] = at(row.x, row.y);
    context.save();
    context.translate(x, y);
    context.rotate(row.heading);
    context.beginPath();
    context.moveTo(0, -9 * scale);
    context.lineTo(5 * scale, 6 * scale);
    context.lineTo(0, 3 * scale);
    context.lineTo(-5 * scale, 6 * scale);
    context.closePath();
    context.fill();
    context.strokeStyle = css('--deep');
    context.lineWidth = scale;
    context.stroke();
    context.restore();
    $('map-note').textContent = `${row.x.toFixed(1)} m E, ${row.y.toFixed(1)} m N, ${((row.heading * 180 / Math.PI % 360 + 360) % 360).toFixed(0)}°`;
  }
  const bar = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000].find(m => m * zoom > 40 * scale) ?? 10000;
  context.fillStyle = css('--ink');
  context.fillRect(pad, canvas.height - pad, bar * zoom, 2 * scale);
  context.font = `${11 * scale}px system-ui, sans-serif`;
  context.fillText(`${bar} m`, pad, canvas.height - pad - 4 * scale);
}
