// Shared by the page's scripts.
export const $ = id => document.getElementById(id);
export const clamp = (x, low, high) => Math.min(high, Math.max(low, x));
export const css = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
export const dark = matchMedia('(prefers-color-scheme: dark)');
export const rgb = hex => [1, 3, 5].map(i => parseInt(hex.slice(i, i + 2), 16));

// How the lines of a sonar lie in a row (line_layout.h): the line and the bin of a column, and back.
export function placeOf(sonar, column) {
  const line = sonar.lines[Math.floor(column / sonar.bins)], at = column - line.first;
  return {line, bin: line.mirrored ? sonar.bins - 1 - at : at};
}
export const columnOf = (sonar, line, bin) => line.first + (line.mirrored ? sonar.bins - 1 - bin : bin);

// Sets a canvas's size to its displayed size in device pixels. Returns whether that changed it.
export function fitCanvas(canvas) {
  const scale = devicePixelRatio || 1;
  const width = Math.max(1, Math.round(canvas.clientWidth * scale)), height = Math.max(1, Math.round(canvas.clientHeight * scale));
  if (canvas.width === width && canvas.height === height) return false;
  canvas.width = width;
  canvas.height = height;
  return true;
}

export const fixed = (x, digits) => Number.isFinite(x) ? x.toFixed(digits) : '–';

// Writes pairs of a name and a value into a <dl>; elements that are there stay.
export function list(dl, pairs) {
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
