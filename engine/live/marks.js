// Drawn over the waterfall: ranges, the cursor with the truth there, a measurement.
import {$, clamp, css, fitCanvas, fixed, list, placeOf} from './common.js';
import {ask, of, setting} from './session.js';
import {columnsNow, picture, scales, setZoom, sourceOf, zoomBy} from './waterfall.js';

export const marks = {dirty: true, cursor: null, measure: null, measuring: false};

function placeAt(x, y) {  // device pixels
  const {across, down, left, margin} = scales(), list = of(picture.sonar).list;
  const column = Math.floor((x - margin) / across + left);
  const row = list[list.length - 1 - picture.scroll - Math.floor(y / down)];
  if (!row || row.gap || column < 0 || column >= columnsNow()) return null;
  return {row, column, from: sourceOf(row, column), age: picture.scroll + Math.floor(y / down)};
}

function rangesOf(place) {
  const now = setting.sonars[picture.sonar], {line, bin} = placeOf(now, place.column);
  const along = (bin + 0.5) * now.bin_m, {height} = place.row.origin;
  return {
    side: line.name,
    slant: picture.ground ? Math.hypot(along, height) : along,
    over: picture.ground ? along : along > height ? Math.sqrt(along * along - height * height) : NaN,
  };
}

export function drawMarks() {
  const canvas = $('marks');
  if (fitCanvas(canvas)) marks.dirty = true;
  if (!setting || !marks.dirty) return;
  marks.dirty = false;
  const context = canvas.getContext('2d'), scale = devicePixelRatio || 1;
  context.clearRect(0, 0, canvas.width, canvas.height);
  const {across, left, margin} = scales(), sonar = setting.sonars[picture.sonar];
  const metres = canvas.width / across * sonar.bin_m;
  const step = [1, 2, 5, 10, 20, 25, 50, 100, 200, 500, 1000].find(s => metres / s < canvas.width / scale / 90) ?? 2000;
  context.font = `${11 * scale}px system-ui, sans-serif`;
  context.textAlign = 'center';
  context.fillStyle = 'rgba(0,0,0,.55)';
  context.fillRect(0, 0, canvas.width, 20 * scale);
  for (const line of sonar.lines)
    for (let m = 0; m <= sonar.range_m + 1e-6; m += step) {
      if (m === 0 && line !== sonar.lines[0]) continue;
      const bin = m / sonar.bin_m, x = margin + (line.first + (line.mirrored ? sonar.bins - bin : bin) - left) * across;
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
export async function readCursor() {
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

export function bindStage() {
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
