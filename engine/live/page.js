// The page of `ensonify live`: reads and draws the frames of engine/live/frames.h, requests changes.
import {$, clamp, css, dark, fitCanvas, portsOf, rgb} from './common.js';
import {drawMap, map, onMap, takeBed} from './map.js';
import {drawMesh, scene, startMesh, takeMesh} from './mesh.js';

const token = document.querySelector('meta[name=token]').content;
const ask = {headers: {'X-Ensonify-Token': token}};
const fixed = (x, digits) => Number.isFinite(x) ? x.toFixed(digits) : '–';
const mostRows = 6000, stripRows = 2048;
// Canvases that are written pixel by pixel stay in memory, not on the graphics card.
const inMemory = {alpha: false, willReadFrequently: true};

let setting = null, settingNumber = 0, status = null;
let lastLine = -1, linesSeen = 0, missed = 0;
const rows = new Map();  // by sonar: its rows, the oldest first
let newestRow = null, newLine = false;  // newLine: since the side panels were drawn
const of = sonar => rows.get(sonar) ?? rows.set(sonar, {first: 0, list: []}).get(sonar);

// ---- receiving frames ----

async function listen() {
  for (;;) {
    try {
      const answer = await fetch('/lines?mesh=1', ask);
      if (answer.status === 403) return showState('this session has ended: load the page again');
      if (answer.ok) await take(answer.body.getReader());
    } catch { /* the program has ended; it may be started again */ }
    showState('no connection; trying again');
    await new Promise(wake => setTimeout(wake, 1000));
  }
}

async function take(reader) {
  let held = new Uint8Array(1 << 20), length = 0;
  for (;;) {
    const {done, value} = await reader.read();
    if (done) return;
    if (length + value.length > held.length) {
      const more = new Uint8Array(2 * (length + value.length));
      more.set(held.subarray(0, length));
      held = more;
    }
    held.set(value, length);
    length += value.length;
    let at = 0;
    const view = new DataView(held.buffer);
    while (length - at >= 8) {
      const size = view.getUint32(at + 4, true);
      if (length - at - 8 < size) break;
      frame(view.getUint32(at, true), held.buffer.slice(at + 8, at + 8 + size));
      at += 8 + size;
    }
    held.copyWithin(0, at, length);
    length -= at;
  }
}

function frame(kind, bytes) {
  const json = () => JSON.parse(new TextDecoder().decode(bytes));
  if (kind === 1) takeSetting(json());
  else if (kind === 2) takeLine(bytes);
  else if (kind === 3) takeStatus(json());
  else if (kind === 4) takeMesh(bytes);
  else if (kind === 5) takeGap(json());
  else if (kind === 6) takeBed(bytes, of(picture.sonar).list, picture.colours);
}

function takeLine(bytes) {
  const view = new DataView(bytes);
  const number = Number(view.getBigUint64(0, true));
  if (number <= lastLine) return;  // a new connection repeats lines
  lastLine = number;
  ++linesSeen;
  const word = i => view.getUint32(i, true), real = i => view.getFloat32(i, true);
  const n = word(16);
  const at = 64 + 2 * n;
  const ends = (at + 3 * n + 3) & ~3, origin = ends + 4 + 12 * word(ends);
  const [sonarX, sonarY, sonarZ, sonarHeading, height] = [0, 1, 2, 3, 4].map(i => view.getFloat64(origin + 8 * i, true));
  const row = {
    number, ping: word(8), sonar: word(12), columns: n, lost: (word(20) & 1) === 1,
    x: real(24), y: real(28), z: real(32), heading: real(36), pitch: real(40), roll: real(44),
    altitude: real(48), t: real(52), setting, settingNumber,
    levels: new Uint16Array(bytes, 64, n), brightness: new Uint8Array(bytes, at, n),
    regions: new Uint8Array(bytes, at + n, n), classes: new Uint8Array(bytes, at + 2 * n, n),
    ends: new Float32Array(bytes, ends + 4, 3 * word(ends)),
    origin: {x: sonarX, y: sonarY, z: sonarZ, heading: sonarHeading, height},  // pose of the sonar; height: over the bed
  };
  keep(row.sonar, row);
  if (row.sonar === picture.sonar) {
    newestRow = row;
    onMap(row, picture.colours);
    newLine = true;
  }
}

function keep(sonar, row) {
  const store = of(sonar);
  store.list.push(row);
  if (store.list.length > mostRows + 500) {
    store.list.splice(0, 500);
    store.first += 500;
  }
  if (sonar !== picture.sonar) return;
  if (picture.scroll > 0 || picture.paused) ++picture.scroll;
  picture.dirty = true;
}

function takeGap(gap) {
  missed += gap.count;
  lastLine = gap.first + gap.count - 1;
  keep(picture.sonar, {gap: gap.count, columns: 0, setting, settingNumber});
}

function takeSetting(json) {
  setting = json;
  ++settingNumber;
  $('scene').textContent = json.scene;
  document.title = `${json.scene} – ensonify live`;
  picture.sonar = Math.min(picture.sonar, json.sonars.length - 1);
  options($('sonar'), json.sonars.map(s => s.name), json.sonars[picture.sonar].name);
  $('which').hidden = json.sonars.length < 2;
  if (!picture.palette || !picture.chosen) picture.palette = json.palette;
  const names = {copper: 'sonar copper'};
  options($('palette'), Object.keys(json.palettes), picture.palette, name => names[name] ?? name);
  if (!picture.chosen) asRun();
  showControls();
  picture.remake();
}

function options(select, values, chosen, label = x => x) {
  select.replaceChildren(...values.map(value => new Option(label(value), value, false, value === chosen)));
}

function showControls() {
  const sonar = setting.sonars[picture.sonar];
  for (const input of document.querySelectorAll('[data-sonar]'))
    put(input, +(sonar[input.dataset.sonar] / (input.dataset.scale ?? 1)).toPrecision(6));
  const beds = setting.beds.includes(setting.bed.material) ? setting.beds : [setting.bed.material, ...setting.beds];
  options($('material'), beds, setting.bed.material);
  for (const [key, value] of [['seafloor.fractal.height_at_1m_m', setting.bed.height_at_1m_m],
    ['seafloor.ripples.rms_height_m', setting.bed.ripple_height_m], ['seafloor.ripples.wavelength_m', setting.bed.ripple_length_m]]) {
    const input = document.querySelector(`[data-key="${key}"]`);
    input.parentElement.hidden = !setting.bed.fractal;
    put(input, value);
  }
}

function put(input, value) {
  if (document.activeElement !== input) input.value = value;
}

let troubleNumber = 0;
function takeStatus(json) {
  status = json;
  const doing = json.preparing ? 'preparing another seabed' : json.finished ? 'track done' : json.hold ? 'on hold' : 'pinging';
  const strong = document.createElement('b');
  strong.textContent = doing;
  $('state').replaceChildren(strong, ` · ping ${Math.min(Math.round(json.along), json.of)} of ${json.of}` + (missed ? ` · ${missed} lines missed` : ''));
  $('hold').textContent = json.hold ? 'Continue' : 'Hold';
  if (json.rate !== null && ![...$('pace').options].some(o => o.value === String(json.rate)))
    $('pace').append(new Option(`${json.rate} pings/s`, json.rate));
  put($('pace'), json.rate ?? '');
  put(document.querySelector('[data-key="track.altitude_m"]'), +json.vehicle.altitude_m.toFixed(2));
  put(document.querySelector('[data-key="track.speed_mps"]'), +json.vehicle.speed_mps.toFixed(4));
  if (json.trouble_number > troubleNumber) {
    troubleNumber = json.trouble_number;
    trouble(json.trouble);
  }
  const mesh = json.mesh ?? {};
  const count = x => x === undefined ? '–' : x.toLocaleString('en');
  list($('statistics'), [
    ['pings/s', fixed(json.pings_per_s, 1)], ['target', fixed(json.wanted_pings_per_s, 1)],
    ['faces', count(setting?.faces)], ['active', count(mesh.active_faces)], ['exact', count(mesh.exact_faces)],
    ['splits', count(mesh.splits)], ['collapses', count(mesh.collapses)], ['pages', json.pages]]);
  const stages = Object.entries(json.stages_ms), sum = stages.reduce((a, [, ms]) => a + ms, 0);
  if (sum > 0) {
    $('stages').replaceChildren(...stages.map(([name, ms]) => {
      const part = document.createElement('span');
      part.style.flex = `${ms} 0 0`;
      part.title = `${name} ${ms.toFixed(2)} ms`;
      part.textContent = ms > 0.16 * sum ? `${name} ${ms.toFixed(1)} ms` : '';
      return part;
    }));
    $('stages').title = `${sum.toFixed(2)} ms per ping`;
  }
}

function list(dl, pairs) {
  if (dl.children.length === pairs.length) {
    pairs.forEach(([name, value], i) => {
      const [dt, dd] = dl.children[i].children;
      if (dt.textContent !== name) dt.textContent = name;
      if (dd.textContent !== String(value)) dd.textContent = value;
    });
    return;
  }
  dl.replaceChildren(...pairs.map(([name, value]) => {
    const div = document.createElement('div'), dt = document.createElement('dt'), dd = document.createElement('dd');
    dt.textContent = name;
    dd.textContent = value;
    div.append(dt, dd);
    return div;
  }));
}

const showState = text => { $('state').textContent = text; };
const trouble = text => { $('trouble').textContent = text; };

// ---- the waterfall ----

const picture = {
  sonar: 0, palette: '', chosen: false, gain: 0, contrast: 0.7, range: 0, ground: false, labels: false,
  paused: false, scroll: 0, zoom: 0, left: 0, row_px: 1, version: 0, dirty: true,
  colours: new Uint32Array(256), curve: null, bins: null, strip: null, layout: '', made: [],
  remake() {
    ++this.version;
    this.dirty = true;
    if (!setting) return;
    const palette = setting.palettes[this.palette];
    for (let i = 0; i < 256; ++i)
      this.colours[i] = (255 << 24 | palette[3 * i + 2] << 16 | palette[3 * i + 1] << 8 | palette[3 * i]) >>> 0;
    const display = setting.display;
    this.plain = this.gain === display.gain_db && this.contrast === display.gamma &&
      this.range === (display.mapping === 'gamma' ? 0 : display.range_db);
    this.curve = null;
    if (!this.plain) {
      this.curve = new Uint8Array(65536);
      const mid_db = 20 * Math.log10(display.mid_amplitude);
      for (let i = 1; i < 65536; ++i) {
        const db = (i - 32768) / 256 + this.gain;
        const light = this.range > 0 ? 0.5 + db / this.range : Math.pow(10, (db + mid_db) / 20 * this.contrast);
        this.curve[i] = Math.round(255 * clamp(light, 0, 1));
      }
    }
    const width = columnsNow();
    if (this.bins?.length !== width) this.bins = new Uint32Array(width);
  },
  // Rows are made with the displayed width, so that drawing them is only a copy.
  lay(width, layout) {
    if (this.layout !== layout) {
      this.layout = layout;
      ++this.version;
    }
    if (this.strip?.width === width) return;
    this.strip = document.createElement('canvas');
    this.strip.width = width;
    this.strip.height = stripRows;
    this.paper = this.strip.getContext('2d', inMemory);
    this.line = this.paper.createImageData(width, 1);
    this.made = new Array(stripRows);
  },
};
const columnsNow = () => {
  const sonar = setting.sonars[picture.sonar];
  return sonar.bins * (sonar.sides === 'both' ? 2 : 1);
};

function tint(colour, id, region) {
  // Mixes in a tint: for the water, for shadows, and for classes and objects.
  let r = colour & 255, g = colour >> 8 & 255, b = colour >> 16 & 255, to = null;
  if (region === 1) to = [18, 60, 110];
  else if (region === 4) to = [150, 60, 220];
  else if (id > 1 || region === 3) to = hue(id);
  if (!to) return colour;
  r = 0.5 * r + 0.5 * to[0];
  g = 0.5 * g + 0.5 * to[1];
  b = 0.5 * b + 0.5 * to[2];
  return (255 << 24 | b << 16 | g << 8 | r) >>> 0;
}
const hues = [[240, 60, 50], [255, 214, 10], [0, 214, 226], [90, 220, 60], [255, 130, 20], [60, 130, 255], [230, 80, 190], [200, 230, 120]];
const hue = id => hues[id % hues.length];

// The row's column (by slant range) for a column of the picture; -1: none. The two differ if the
// row was made with another setting, or if the picture is in ground range (as in over_ground.cpp).
function sourceOf(row, column) {
  const now = setting.sonars[picture.sonar], then = row.setting.sonars[picture.sonar];
  const ports = portsOf(now);
  const bin = column < ports ? ports - 1 - column : column - ports;
  let range = (bin + 0.5) * now.bin_m;
  if (picture.ground) {
    range = Math.sqrt(range * range + row.origin.height * row.origin.height);
  } else if (row.settingNumber === settingNumber) {
    return column;
  }
  const from = Math.floor(range / then.bin_m);
  if (!then.bins || from >= then.bins) return -1;
  const port = portsOf(then);
  if (column < ports) return port ? port - 1 - from : -1;
  return then.sides === 'port' ? -1 : port + from;
}

function makeRow(row, index, {across, left, margin}) {
  const {bins, line, colours, curve, labels} = picture, out = new Uint32Array(line.data.buffer), columns = bins.length;
  if (row.gap) {
    const [r, g, b] = rgb(css('--accent'));
    const colour = (255 << 24 | b << 16 | g << 8 | r) >>> 0;
    for (let x = 0; x < out.length; ++x) out[x] = (x >> 3) % 2 ? colour : 0xff000000;
  } else {
    const same = row.settingNumber === settingNumber && row.columns === columns && !picture.ground;
    for (let c = 0; c < columns; ++c) {
      const from = same ? c : sourceOf(row, c);
      let colour = from < 0 ? colours[0] : colours[curve ? curve[row.levels[from]] : row.brightness[from]];
      if (labels && from >= 0) colour = tint(colour, row.classes[from], row.regions[from]);
      bins[c] = colour;
    }
    out.fill(0xff000000);
    const end = Math.min(out.length, Math.ceil(margin + (columns - left) * across));
    for (let x = margin; x < end; ++x) {
      const begin = left + (x - margin) / across, first = Math.floor(begin + 1e-6), last = Math.min(columns, Math.max(first + 1, Math.floor(begin + 1 / across + 1e-6)));
      if (last - first === 1) { out[x] = bins[first]; continue; }
      let r = 0, g = 0, b = 0;
      for (let c = first; c < last; ++c) {
        const colour = bins[c];
        r += colour & 255;
        g += colour >> 8 & 255;
        b += colour >> 16 & 255;
      }
      const n = last - first;
      out[x] = (255 << 24 | b / n << 16 | g / n << 8 | r / n) >>> 0;
    }
  }
  picture.paper.putImageData(line, 0, stripRows - 1 - index % stripRows);
  picture.made[index % stripRows] = index + '/' + picture.version;
}

// Device pixels per column and per row, the column at the left edge, the margin in device pixels.
function scales() {
  const canvas = $('picture'), fit = canvas.width / columnsNow();
  const across = picture.zoom > 0 ? picture.zoom : fit;
  const most = Math.max(0, columnsNow() - canvas.width / across);
  picture.left = clamp(picture.left, 0, most);
  const left = across === 1 ? Math.floor(picture.left) : picture.left;
  const spare = Math.max(0, canvas.width - across * columnsNow());
  return {across, down: picture.row_px * (picture.zoom > 0 ? Math.max(1, picture.zoom) : 1), left, margin: Math.floor(spare / 2)};
}

function drawPicture() {
  const canvas = $('picture');
  if (fitCanvas(canvas)) picture.dirty = true;
  if (!setting || !picture.dirty) return;
  picture.dirty = false;
  const context = canvas.getContext('2d', inMemory);
  const store = of(picture.sonar), list = store.list;
  picture.scroll = clamp(picture.scroll, 0, Math.max(0, list.length - 1));
  $('newest').hidden = picture.scroll === 0;
  const scale = scales(), {down} = scale;
  picture.lay(canvas.width, `${scale.across} ${scale.left} ${scale.margin}`);
  context.fillStyle = '#000';
  context.fillRect(0, 0, canvas.width, canvas.height);
  const top = list.length - 1 - picture.scroll;
  const count = Math.min(top + 1, Math.ceil(canvas.height / down), stripRows);
  for (let i = 0; i < count; ++i) {
    const index = store.first + top - i;
    if (picture.made[index % stripRows] !== index + '/' + picture.version) makeRow(list[top - i], index, scale);
  }
  context.imageSmoothingEnabled = false;
  let y = 0, from = stripRows - 1 - (store.first + top) % stripRows, togo = count;
  while (togo > 0) {
    const part = Math.min(togo, stripRows - from);
    context.drawImage(picture.strip, 0, from, canvas.width, part, 0, y, canvas.width, part * down);
    y += part * down;
    togo -= part;
    from = 0;
  }
  marks.dirty = true;
}

// ---- drawn over the waterfall: ranges, the cursor, the measurement ----

const marks = {dirty: true, cursor: null, measure: null, measuring: false};

function placeAt(x, y) {  // device pixels
  const {across, down, left, margin} = scales(), list = of(picture.sonar).list;
  const column = Math.floor((x - margin) / across + left);
  const row = list[list.length - 1 - picture.scroll - Math.floor(y / down)];
  if (!row || row.gap || column < 0 || column >= columnsNow()) return null;
  return {row, column, from: sourceOf(row, column), age: picture.scroll + Math.floor(y / down)};
}

function rangesOf(place) {
  const now = setting.sonars[picture.sonar], ports = portsOf(now);
  const bin = place.column < ports ? ports - 1 - place.column : place.column - ports;
  const along = (bin + 0.5) * now.bin_m, {height} = place.row.origin;
  return {
    side: place.column < ports ? 'port' : 'starboard',
    slant: picture.ground ? Math.hypot(along, height) : along,
    over: picture.ground ? along : along > height ? Math.sqrt(along * along - height * height) : NaN,
  };
}

function drawMarks() {
  const canvas = $('marks');
  if (fitCanvas(canvas)) marks.dirty = true;
  if (!setting || !marks.dirty) return;
  marks.dirty = false;
  const context = canvas.getContext('2d'), scale = devicePixelRatio || 1;
  context.clearRect(0, 0, canvas.width, canvas.height);
  const {across, left, margin} = scales(), sonar = setting.sonars[picture.sonar], ports = portsOf(sonar);
  const metres = canvas.width / across * sonar.bin_m;
  const step = [1, 2, 5, 10, 20, 25, 50, 100, 200, 500, 1000].find(s => metres / s < canvas.width / scale / 90) ?? 2000;
  context.font = `${11 * scale}px system-ui, sans-serif`;
  context.textAlign = 'center';
  context.fillStyle = 'rgba(0,0,0,.55)';
  context.fillRect(0, 0, canvas.width, 20 * scale);
  for (const side of sonar.sides === 'both' ? [-1, 1] : sonar.sides === 'port' ? [-1] : [1])
    for (let m = 0; m <= sonar.range_m + 1e-6; m += step) {
      if (m === 0 && side === 1 && sonar.sides === 'both') continue;
      const x = margin + (ports + side * m / sonar.bin_m - left) * across;
      context.fillStyle = 'rgba(255,255,255,.16)';
      context.fillRect(Math.round(x), 20 * scale, scale, canvas.height);
      context.fillStyle = '#fff';
      context.fillText(m === 0 ? '0 m' : `${m}`, clamp(x, 14 * scale, canvas.width - 14 * scale), 14 * scale);
    }
  if (marks.cursor && !marks.measuring) {
    context.fillStyle = css('--accent');
    context.globalAlpha = 0.75;
    context.fillRect(marks.cursor.x, 20 * scale, scale, canvas.height);
    context.fillRect(0, marks.cursor.y, canvas.width, scale);
    context.globalAlpha = 1;
  }
  const measure = marks.measure;
  if (measure && measure.to) {
    const at = end => {
      const {down} = scales();
      return [margin + (end.column + 0.5 - left) * across, (of(picture.sonar).list.length - 1 - picture.scroll - of(picture.sonar).list.indexOf(end.row) + 0.5) * down];
    };
    const [x0, y0] = at(measure.from), [x1, y1] = at(measure.to);
    context.strokeStyle = css('--accent');
    context.lineWidth = 2 * scale;
    context.beginPath();
    context.moveTo(x0, y0);
    context.lineTo(x1, y1);
    context.stroke();
    for (const [x, y] of [[x0, y0], [x1, y1]]) {
      context.beginPath();
      context.arc(x, y, 4 * scale, 0, 7);
      context.stroke();
    }
    const text = measure.text ?? `≈ ${flatDistance(measure.from, measure.to).toFixed(2)} m`;
    const width = context.measureText(text).width + 14 * scale, tx = clamp((x0 + x1) / 2, width / 2, canvas.width - width / 2), ty = (y0 + y1) / 2 - 14 * scale;
    context.fillStyle = 'rgba(0,0,0,.8)';
    context.fillRect(tx - width / 2, ty - 13 * scale, width, 19 * scale);
    context.fillStyle = '#fff';
    context.fillText(text, tx, ty + scale);
  }
}

function groundPlace(place) {
  const {side, over} = rangesOf(place), {x, y, heading} = place.row.origin, off = (side === 'port' ? -1 : 1) * (over || 0);
  return [x + Math.cos(heading) * off, y - Math.sin(heading) * off];
}
function flatDistance(a, b) {
  const [x0, y0] = groundPlace(a), [x1, y1] = groundPlace(b);
  return Math.hypot(x1 - x0, y1 - y0);
}

async function truthOf(place) {
  if (!place || place.from < 0) return null;
  const answer = await fetch(`/truth?line=${place.row.number}&column=${place.from}`, ask);
  return answer.ok ? answer.json() : null;
}

let asking = false, askAgain = false;
async function readCursor() {
  if (asking) { askAgain = true; return; }
  asking = true;
  do {
    askAgain = false;
    const place = marks.cursor && placeAt(marks.cursor.x, marks.cursor.y);
    if (!place) { list($('readout'), [['', 'Point at the picture to see the truth there. Drag to scroll back; Ctrl and wheel to zoom.']]); continue; }
    const {side, slant, over} = rangesOf(place);
    const known = [['ping', place.row.ping], ['side', side], ['slant', `${slant.toFixed(2)} m`], ['ground', `${fixed(over, 2)} m`], ['altitude', `${fixed(place.row.altitude, 2)} m`]];
    let truth = null;
    try { truth = await truthOf(place); } catch { /* the program has ended */ }
    if (truth) {
      known.push(['region', truth.region]);
      if (truth.x_m !== undefined)
        known.push(['east', `${truth.x_m.toFixed(2)} m`], ['north', `${truth.y_m.toFixed(2)} m`], ['depth', `${(-truth.z_m).toFixed(2)} m`],
          ['sediment', truth.sediment ?? '–'], ['class', (truth.class ?? '–') + (truth.instance ? ` ${truth.instance}` : '')], ['grazing', `${truth.grazing_deg.toFixed(1)}°`]);
    } else {
      known.push(['region', setting.regions[place.row.regions[place.from]] ?? '–'], ['truth', 'no longer kept']);
    }
    list($('readout'), known);
  } while (askAgain);
  asking = false;
}

async function finishMeasure() {
  const measure = marks.measure;
  const [a, b] = await Promise.all([truthOf(measure.from), truthOf(measure.to)]);
  if (a?.x_m !== undefined && b?.x_m !== undefined) {
    const east = b.x_m - a.x_m, north = b.y_m - a.y_m, up = b.z_m - a.z_m;
    const bearing = (Math.atan2(east, north) * 180 / Math.PI + 360) % 360;
    measure.text = `${Math.hypot(east, north).toFixed(2)} m at ${bearing.toFixed(0)}°, ${up >= 0 ? '+' : '−'}${Math.abs(up).toFixed(2)} m up`;
    marks.dirty = true;
  }
}

function bindStage() {
  const canvas = $('marks');
  let grip = null;
  const at = event => {
    const box = canvas.getBoundingClientRect(), scale = canvas.width / box.width;
    return {x: (event.clientX - box.left) * scale, y: (event.clientY - box.top) * scale};
  };
  canvas.addEventListener('pointerdown', event => {
    if (!setting) return;
    canvas.setPointerCapture(event.pointerId);
    const here = at(event);
    if ($('measure').ariaPressed === 'true') {
      const from = placeAt(here.x, here.y);
      marks.measure = from && {from};
      marks.measuring = !!from;
    } else {
      grip = {...here, scroll: picture.scroll, left: picture.left, rows: of(picture.sonar).list.length};
    }
  });
  canvas.addEventListener('pointermove', event => {
    if (!setting) return;
    const here = at(event), {across, down} = scales();
    marks.cursor = here;
    marks.dirty = true;
    if (marks.measuring) {
      const to = placeAt(here.x, here.y);
      if (to) marks.measure.to = to;
    } else if (grip) {
      picture.scroll = Math.max(0, Math.round(grip.scroll + (of(picture.sonar).list.length - grip.rows) - (here.y - grip.y) / down));
      picture.left = grip.left - (here.x - grip.x) / across;
      picture.dirty = true;
    }
    readCursor();
  });
  const letGo = () => {
    grip = null;
    if (marks.measuring && marks.measure.to) finishMeasure();
    marks.measuring = false;
  };
  canvas.addEventListener('pointerup', letGo);
  canvas.addEventListener('pointercancel', letGo);
  canvas.addEventListener('pointerleave', () => { marks.cursor = null; marks.dirty = true; readCursor(); });
  canvas.addEventListener('wheel', event => {
    event.preventDefault();
    if (!setting) return;
    if (event.ctrlKey) {
      zoomBy(event.deltaY < 0 ? 1.25 : 0.8, at(event).x);
    } else {
      picture.scroll = Math.max(0, picture.scroll + Math.round(event.deltaY / scales().down));
      picture.left += event.deltaX / scales().across;
      picture.dirty = true;
    }
    readCursor();
  }, {passive: false});
  canvas.addEventListener('dblclick', () => setZoom(0));
}

function zoomBy(factor, x = $('picture').width / 2) {
  const before = scales();
  const column = (x - before.margin) / before.across + before.left;
  const fit = $('picture').width / columnsNow();
  const zoom = before.across * factor;
  setZoom(zoom <= fit * 1.001 ? 0 : Math.min(zoom, 32));
  const after = scales();
  picture.left = column - (x - after.margin) / after.across;
}
function setZoom(zoom) {
  picture.zoom = zoom;
  picture.dirty = true;
}

function asRun() {
  if (!setting) return;
  const display = setting.display;
  Object.assign(picture, {gain: display.gain_db, contrast: display.gamma, ground: display.ground, labels: false, palette: setting.palette,
    range: display.mapping === 'gamma' ? 0 : display.range_db});
  picture.chosen = false;
  showDisplay();
}

function showDisplay() {
  $('gain').value = picture.gain;
  $('gain-out').value = `${picture.gain > 0 ? '+' : ''}${picture.gain} dB`;
  $('contrast').value = picture.contrast;
  $('contrast-out').value = picture.contrast.toFixed(2);
  $('contrast').disabled = picture.range > 0;
  if (![...$('range').options].some(o => +o.value === picture.range)) $('range').append(new Option(`${picture.range} dB`, picture.range));
  $('range').value = picture.range;
  $('palette').value = picture.palette;
  $('ground').ariaPressed = String(picture.ground);
  $('labels').ariaPressed = String(picture.labels);
}

function bindDisplay() {
  const change = (id, event, apply) => $(id).addEventListener(event, () => {
    apply($(id));
    picture.chosen = true;
    showDisplay();
    picture.remake();
  });
  change('palette', 'change', e => { picture.palette = e.value; });
  change('gain', 'input', e => { picture.gain = +e.value; });
  change('contrast', 'input', e => { picture.contrast = +e.value; });
  change('range', 'change', e => { picture.range = +e.value; });
  change('ground', 'click', () => { picture.ground = !picture.ground; });
  change('labels', 'click', () => { picture.labels = !picture.labels; });
  $('plain').addEventListener('click', () => { asRun(); picture.remake(); });
  $('sonar').addEventListener('change', () => {
    picture.sonar = $('sonar').selectedIndex;
    picture.scroll = 0;
    showControls();
    picture.remake();
  });
  $('measure').addEventListener('click', () => {
    $('measure').ariaPressed = String($('measure').ariaPressed !== 'true');
    marks.measure = null;
    marks.dirty = true;
  });
  $('pause').addEventListener('click', () => pause(!picture.paused));
  $('newest').addEventListener('click', () => { pause(false); picture.scroll = 0; picture.dirty = true; });
  $('fit').addEventListener('click', () => setZoom(0));
  $('one').addEventListener('click', () => setZoom(1));
  $('in').addEventListener('click', () => zoomBy(1.5));
  $('out').addEventListener('click', () => zoomBy(1 / 1.5));
  addEventListener('keydown', event => {
    if (event.key === ' ' && event.target === document.body) { event.preventDefault(); pause(!picture.paused); }
  });
}
function pause(yes) {
  picture.paused = yes;
  $('pause').ariaPressed = String(yes);
  $('pause').textContent = yes ? 'Resume' : 'Pause';
  if (!yes) { picture.scroll = 0; picture.dirty = true; }
}

// ---- requests to the session ----

async function send(wish) {
  trouble('');
  try {
    const answer = await fetch('/change', {method: 'POST', headers: {...ask.headers, 'Content-Type': 'application/json'}, body: JSON.stringify(wish)});
    if (!answer.ok) trouble((await answer.json().catch(() => ({}))).error ?? `refused: ${answer.status}`);
  } catch { trouble('the session does not answer'); }
}

function bindControls() {
  for (const input of document.querySelectorAll('[data-key]'))
    input.addEventListener('change', () => {
      const value = input.type === 'number' ? input.valueAsNumber : input.value;
      if (input.type !== 'number' || Number.isFinite(value)) send({set: {[input.dataset.key]: value}});
    });
  for (const input of document.querySelectorAll('[data-sonar]'))
    input.addEventListener('change', () => {
      if (!setting || !Number.isFinite(input.valueAsNumber)) return;
      send({set: {[`sonar.${setting.sonars[picture.sonar].name}.${input.dataset.sonar}`]: input.valueAsNumber * (input.dataset.scale ?? 1)}});
    });
  $('hold').addEventListener('click', () => send({hold: !status?.hold}));
  $('again').addEventListener('click', () => send({again: true, hold: false}));
  $('pace').addEventListener('change', () => send({pings_per_s: $('pace').value === '' ? null : +$('pace').value}));
  $('drop').addEventListener('click', () => send({add: {shape: $('shape').value, ahead_m: 8, starboard_m: +$('aside').value * $('off').valueAsNumber}}));
  $('clear').addEventListener('click', () => send({clear: true}));
  const splitter = $('splitter');
  let width = 440;
  const resize = to => {
    width = clamp(to, 260, innerWidth - 380);
    $('main').style.setProperty('--side', `${width}px`);
  };
  splitter.addEventListener('pointerdown', event => splitter.setPointerCapture(event.pointerId));
  splitter.addEventListener('pointermove', event => { if (splitter.hasPointerCapture(event.pointerId)) resize(innerWidth - event.clientX); });
  splitter.addEventListener('keydown', event => {
    if (event.key === 'ArrowLeft') resize(width + 20);
    if (event.key === 'ArrowRight') resize(width - 20);
  });
}

// ---- the drawing loop ----

// The waterfall has priority: the side panels are drawn alternately and take at most a third of the
// time. The next frame waits for the graphics card (or its software substitute).
let sideDue = 0, turn = 0, sideBegun = 0;
function draw(now) {
  requestAnimationFrame(draw);
  if (sideBegun > 0) {
    sideDue = now + clamp(2 * (performance.now() - sideBegun), 60, 2000);
    sideBegun = 0;
  }
  drawPicture();
  drawMarks();
  if (now >= sideDue) {
    sideBegun = performance.now();
    if (++turn % 2) {
      if (newestRow) drawMesh(newestRow, of(newestRow.sonar).list, newLine, status?.mesh);
    } else {
      if (setting) drawMap(newestRow, newLine);
      newLine = false;
    }
  }
}

dark.addEventListener('change', () => { map.shade = null; map.dirty = scene.dirty = marks.dirty = true; picture.remake(); });
bindStage();
bindDisplay();
bindControls();
startMesh();
readCursor();
requestAnimationFrame(draw);
listen();

// For the browser's console and for tests.
window.live = {picture, map, scene, rows, send, get status() { return status; }, get setting() { return setting; },
  get lines() { return linesSeen; }, get missed() { return missed; }, get newest() { return newestRow; }};
