// The page of `ensonify live`: reads and draws the frames of engine/live/frames.h, requests changes.
import {$, clamp, dark, fixed, list} from './common.js';
import {drawMap, map, onMap, takeBed} from './map.js';
import {bindStage, drawMarks, marks, readCursor} from './marks.js';
import {drawMesh, scene, startMesh, takeMesh} from './mesh.js';
import {ask, keepRow, keepSetting, of, rows, setting, settingNumber} from './session.js';
import {drawPicture, picture, setZoom, zoomBy} from './waterfall.js';

let status = null;
let lastLine = -1, linesSeen = 0, missed = 0;
let newestRow = null, newLine = false;  // newLine: since the side panels were drawn

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
  keepRow(sonar, row);
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
  keepSetting(json);
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

const showState = text => { $('state').textContent = text; };
const trouble = text => { $('trouble').textContent = text; };

// ---- how the picture is shown ----

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
  if (drawPicture()) marks.dirty = true;
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
