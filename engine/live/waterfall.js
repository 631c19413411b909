// The waterfall: the rows of one sonar as a picture, the newest on top.
import {$, clamp, columnOf, css, fitCanvas, placeOf, rgb} from './common.js';
import {of, setting, settingNumber} from './session.js';

const stripRows = 2048;
// Canvases that are written pixel by pixel stay in memory, not on the graphics card.
const inMemory = {alpha: false, willReadFrequently: true};

export const picture = {
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
export const columnsNow = () => {
  const sonar = setting.sonars[picture.sonar];
  return sonar.bins * sonar.lines.length;
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
// row was made with another setting, or if the picture is in ground range (as in picture_columns.cpp).
export function sourceOf(row, column) {
  const now = setting.sonars[picture.sonar], then = row.setting.sonars[picture.sonar];
  const {line, bin} = placeOf(now, column);
  let range = (bin + 0.5) * now.bin_m;
  if (picture.ground) {
    range = Math.sqrt(range * range + row.origin.height * row.origin.height);
  } else if (row.settingNumber === settingNumber) {
    return column;
  }
  const from = Math.floor(range / then.bin_m);
  if (!then.bins || from >= then.bins) return -1;
  const before = then.lines.find(each => each.name === line.name);
  return before ? columnOf(then, before, from) : -1;
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
export function scales() {
  const canvas = $('picture'), fit = canvas.width / columnsNow();
  const across = picture.zoom > 0 ? picture.zoom : fit;
  const most = Math.max(0, columnsNow() - canvas.width / across);
  picture.left = clamp(picture.left, 0, most);
  const left = across === 1 ? Math.floor(picture.left) : picture.left;
  const spare = Math.max(0, canvas.width - across * columnsNow());
  return {across, down: picture.row_px * (picture.zoom > 0 ? Math.max(1, picture.zoom) : 1), left, margin: Math.floor(spare / 2)};
}

// Draws the waterfall if it has changed. Returns whether it did.
export function drawPicture() {
  const canvas = $('picture');
  if (fitCanvas(canvas)) picture.dirty = true;
  if (!setting || !picture.dirty) return false;
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
  return true;
}

export function zoomBy(factor, x = $('picture').width / 2) {
  const before = scales();
  const column = (x - before.margin) / before.across + before.left;
  const fit = $('picture').width / columnsNow();
  const zoom = before.across * factor;
  setZoom(zoom <= fit * 1.001 ? 0 : Math.min(zoom, 32));
  const after = scales();
  picture.left = column - (x - after.margin) / after.across;
}
export function setZoom(zoom) {
  picture.zoom = zoom;
  picture.dirty = true;
}
