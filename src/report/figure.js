// Figures: toggle curves in the legend, read values under the pointer, zoom by dragging, double-click to reset.
'use strict';
(() => {
const SVG = 'http://www.w3.org/2000/svg';
const PREFIXES = [[1e12, 'T'], [1e9, 'G'], [1e6, 'M'], [1e3, 'k'], [1, ''], [1e-3, 'm'], [1e-6, 'µ'], [1e-9, 'n'], [1e-12, 'p'], [1e-15, 'f']];
const readout = document.createElement('div');
readout.id = 'readout';
readout.hidden = true;
document.body.append(readout);

const element = (name, attributes, text) => {
  const made = document.createElementNS(SVG, name);
  for (const key in attributes) made.setAttribute(key, attributes[key]);
  if (text !== undefined) made.textContent = text;
  return made;
};
const minus = text => text.replace(/-/g, '−');
const superscript = n => String(n).replace(/./g, c => '⁻⁰¹²³⁴⁵⁶⁷⁸⁹'['-0123456789'.indexOf(c)]);
const trim = text => text.includes('.') ? text.replace(/\.?0+$/, '') : text;

function prefixed(value, unit, digits) {
  const size = Math.abs(value) * (1 + 1e-9);
  const [factor, prefix] = PREFIXES.find(([f]) => size >= f) || [1, ''];
  return `${minus(trim((value / factor).toPrecision(digits)))} ${prefix}${unit}`;
}
function power(value, digits, low = -3, high = 4) {
  const exponent = Math.floor(Math.log10(Math.abs(value)) + 1e-9);
  if (value === 0 || exponent >= low && exponent <= high) return minus(trim(value.toPrecision(digits)));
  const mantissa = trim((value / 10 ** exponent).toPrecision(digits));
  return minus(mantissa === '1' ? '' : mantissa + '·') + '10' + superscript(exponent);
}
function written(axis, value) {
  if (axis.style === 'prefixed') return prefixed(value, axis.unit, 5);
  if (axis.log) return `${power(value, 4)} ${axis.unit}`.trim();
  const span = Math.abs(axis.high - axis.low) / axis.factor;
  const decimals = Math.min(12, Math.max(0, 4 - Math.ceil(Math.log10(span))));
  return `${minus(trim((value / axis.factor).toFixed(decimals)))} ${axis.unit}`.trim();
}

// place of a value between 0 and 1, and back
const place = (axis, value) => axis.log ? Math.log(value / axis.low) / Math.log(axis.high / axis.low) : (value - axis.low) / (axis.high - axis.low);
const value = (axis, at) => axis.log ? axis.low * (axis.high / axis.low) ** at : axis.low + at * (axis.high - axis.low);

function ticks(axis, length) {
  const wanted = Math.max(2, length / ({ prefixed: 95, degrees: 40 }[axis.style] || 62));
  const decades = axis.log ? Math.log10(axis.high / axis.low) : 0;
  if (axis.log && decades >= 0.7) {
    const every = Math.max(1, Math.ceil(decades / wanted)), found = [];
    for (let e = Math.floor(Math.log10(axis.low)); e <= Math.ceil(Math.log10(axis.high)); e++) {
      for (let d = 1; d <= (decades > 8 ? 1 : 9); d++) {
        const at = d * 10 ** e;
        if (at < axis.low * (1 - 1e-9) || at > axis.high * (1 + 1e-9)) continue;
        const major = (d === 1 || decades < 1.8 && (d === 2 || d === 5)) && (d !== 1 || ((e % every) + every) % every === 0);
        found.push([at, major ? label(axis, at) : null]);
      }
    }
    return found;
  }
  const [low, high] = [axis.low / axis.factor, axis.high / axis.factor];
  const rough = (high - low) / wanted;
  const base = 10 ** Math.floor(Math.log10(rough));
  let step = [1, 2, 2.5, 5, 10].map(m => m * base).find(s => s >= rough * 0.999);
  if (axis.style === 'degrees' && rough >= 20) step = [45, 90, 180, 360, 720, 1440, 3600].find(s => s >= rough) || step;
  if (axis.style === 'whole') step = Math.max(1, step);
  const decimals = Math.max(0, ...[0, 1, 2, 3, 4, 5, 6, 7, 8, 9].filter(n => Math.abs(step * 10 ** n - Math.round(step * 10 ** n)) > 1e-6 * step * 10 ** n).map(n => n + 1));
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * (high - low) && found.length < 200; k++) {
    const at = k * step;
    found.push([at * axis.factor, axis.log || axis.style === 'prefixed' ? label(axis, at * axis.factor) : minus(at.toFixed(decimals).replace(/^-(0\.?0*)$/, '$1'))]);
  }
  return found;
}
const label = (axis, at) => axis.style === 'prefixed' ? prefixed(at, axis.unit, 6) : power(at, 6, -1, 1);

// the point of a curve at x: between two drawn ones, or the nearest end of a stretch
function between(runs, x) {
  let best = null;
  for (const run of runs) {
    for (let k = 0; k < run.length; k++) {
      const [x0, y0] = run[k], [x1, y1] = run[k + 1] || run[k];
      if (x0 <= x && x <= x1 && x1 > x0) return [x, y0 + (y1 - y0) * (x - x0) / (x1 - x0)];
      if (best === null || Math.abs(x0 - x) < Math.abs(best[0] - x)) best = run[k];
    }
  }
  return best;
}

class Panel {
  constructor(figure, group) {
    Object.assign(this, JSON.parse(group.dataset.panel));
    this.figure = figure;
    this.group = group;
    this.frame = group.querySelector('.frame');
    this.axes = group.querySelector('.axes');
    this.zoom = group.querySelector('.zoom');
    this.home = { x: { ...this.x }, y: { ...this.y } };
    this.cursor = element('path', { class: 'cursor', visibility: 'hidden' });
    group.append(this.cursor);
    group.addEventListener('pointermove', event => this.moved(event));
    group.addEventListener('pointerleave', () => this.left_());
    group.addEventListener('pointerdown', event => this.pressed(event));
    group.addEventListener('dblclick', () => this.figure.reset());
  }
  // pointer in figure units
  at(event) {
    const p = new DOMPoint(event.clientX, event.clientY).matrixTransform(this.figure.svg.getScreenCTM().inverse());
    return { x: p.x, y: p.y };
  }
  inside(p) {
    return p.x >= this.left && p.x <= this.left + this.width && p.y >= this.top && p.y <= this.top + this.height;
  }
  // drawn pixels (of the home limits) to shown ones: affine on every axis, logarithmic or not
  scales() {
    const { x: hx, y: hy } = this.home;
    const sx = 1 / (place(hx, this.x.high) - place(hx, this.x.low)), sy = 1 / (place(hy, this.y.high) - place(hy, this.y.low));
    const bottom = this.top + this.height;
    return { sx, sy, tx: this.left - sx * (this.left + place(hx, this.x.low) * this.width), ty: bottom - sy * (bottom - place(hy, this.y.low) * this.height) };
  }
  lines() {
    if (!this.curves) {
      this.curves = [...this.zoom.querySelectorAll('path.line')].map(path => ({
        path, series: path.dataset.series,
        runs: path.getAttribute('d').split('M').filter(Boolean).map(run => run.split(' ').map(pair => pair.split(',').map(parseFloat))),
      }));
      this.marks = [...this.zoom.querySelectorAll('.mark,.dot')].map(mark => {
        const box = mark.getBBox();
        return { mark, x: box.x + box.width / 2, y: box.y + box.height / 2, text: (mark.querySelector('title') || {}).textContent };
      });
      for (const { mark } of this.marks) { const title = mark.querySelector('title'); if (title) title.remove(); }
    }
    return this.curves;
  }
  moved(event) {
    const p = this.at(event);
    if (this.from) return this.choose(p);
    if (!this.inside(p)) return this.left_();
    this.lines();
    const { sx, sy, tx, ty } = this.scales();
    const drawn = (p.x - tx) / sx;
    const rows = [];
    const near = this.marks.filter(m => m.text && !m.mark.closest('.hidden')).map(m => ({ m, d: Math.hypot(m.x * sx + tx - p.x, m.y * sy + ty - p.y) })).sort((a, b) => a.d - b.d)[0];
    if (near && near.d < 14) {
      this.show(event, null, [[getComputedStyle(near.m.mark).stroke === 'none' ? getComputedStyle(near.m.mark).fill : getComputedStyle(near.m.mark).stroke, near.m.text]]);
      return;
    }
    for (const { path, series, runs } of this.curves) {
      if (path.closest('.hidden')) continue;
      const best = between(runs, drawn);
      if (best === null || Math.abs(best[0] - drawn) * sx > 8) continue;
      const y = value(this.home.y, 1 - (best[1] - this.top) / this.height);
      rows.push([getComputedStyle(path).stroke, `${this.figure.names[series] || ''} ${written(this.y, y)}`]);
    }
    const x = value(this.home.x, (drawn - this.left) / this.width);
    this.show(event, `${this.x.label} ${written(this.x, x)}`, rows.slice(0, 8));
    this.cursor.setAttribute('d', `M${p.x},${this.top} ${p.x},${this.top + this.height}`);
    this.cursor.setAttribute('visibility', 'visible');
  }
  show(event, head, rows) {
    readout.replaceChildren();
    if (head) { const line = document.createElement('div'); line.textContent = head; line.className = 'off'; readout.append(line); }
    for (const [colour, text] of rows) {
      const line = document.createElement('div'), swatch = document.createElement('i');
      swatch.style.borderTopColor = colour;
      line.append(swatch, text);
      readout.append(line);
    }
    readout.hidden = false;
    const box = readout.getBoundingClientRect();
    const right = event.clientX + 18 + box.width > innerWidth;
    readout.style.left = `${right ? event.clientX - 14 - box.width : event.clientX + 18}px`;
    readout.style.top = `${Math.max(4, Math.min(innerHeight - box.height - 4, event.clientY + 14))}px`;
  }
  left_() {
    readout.hidden = true;
    this.cursor.setAttribute('visibility', 'hidden');
  }
  pressed(event) {
    const p = this.at(event);
    if (event.button !== 0 || event.pointerType === 'touch' || !this.inside(p)) return;
    event.preventDefault();
    this.left_();
    this.from = p;
    this.box = element('rect', { class: 'choice', width: 0, height: 0 });
    this.group.append(this.box);
    this.group.setPointerCapture(event.pointerId);
    this.group.addEventListener('pointerup', last => this.released(last), { once: true });
  }
  // what a drag chooses: a band where it runs along one axis, else a rectangle
  chosen(p) {
    const clampX = x => Math.min(this.left + this.width, Math.max(this.left, x)), clampY = y => Math.min(this.top + this.height, Math.max(this.top, y));
    let [x0, x1] = [this.from.x, clampX(p.x)].sort((a, b) => a - b), [y0, y1] = [this.from.y, clampY(p.y)].sort((a, b) => a - b);
    if (y1 - y0 < 12) [y0, y1] = [this.top, this.top + this.height];
    else if (x1 - x0 < 12) [x0, x1] = [this.left, this.left + this.width];
    return { x0, x1, y0, y1 };
  }
  choose(p) {
    const { x0, x1, y0, y1 } = this.chosen(p);
    for (const [key, at] of Object.entries({ x: x0, y: y0, width: x1 - x0, height: y1 - y0 })) this.box.setAttribute(key, at);
  }
  released(event) {
    const p = this.at(event), { x0, x1, y0, y1 } = this.chosen(p);
    const far = Math.hypot(p.x - this.from.x, p.y - this.from.y) > 8;
    this.box.remove();
    this.from = null;
    if (!far) return;
    const bottom = this.top + this.height;
    const x = [value(this.x, (x0 - this.left) / this.width), value(this.x, (x1 - this.left) / this.width)];
    const y = [value(this.y, (bottom - y1) / this.height), value(this.y, (bottom - y0) / this.height)];
    this.figure.zoomed(this, x, y);
  }
  limit(x, y) {
    // a double holds no more
    const fits = ([low, high], axis) => high > low && (axis.log ? high / low > 1 + 1e-9 : high - low > 1e-9 * Math.max(Math.abs(low), Math.abs(high)));
    if (x && fits(x, this.x)) [this.x.low, this.x.high] = x;
    if (y && fits(y, this.y)) [this.y.low, this.y.high] = y;
    this.redraw();
  }
  redraw() {
    this.lines();
    const { sx, sy, tx, ty } = this.scales();
    this.zoom.setAttribute('transform', `matrix(${sx} 0 0 ${sy} ${tx} ${ty})`);
    // markers keep their size
    for (const { mark, x, y } of this.marks) mark.setAttribute('transform', `translate(${x} ${y}) scale(${1 / sx} ${1 / sy}) translate(${-x} ${-y})`);
    const bottom = this.top + this.height, right = this.left + this.width;
    for (const old of this.axes.querySelectorAll('.major,.minor,.tick')) old.remove();
    const grid = document.createDocumentFragment();
    for (const [at, text] of ticks(this.x, this.width)) {
      const x = this.left + place(this.x, at) * this.width;
      grid.append(element('path', { class: text === null ? 'minor' : 'major', d: `M${x},${bottom} ${x},${this.top}` }));
      if (text !== null && !this.x.bare) grid.append(element('text', { class: 'tick x', x, y: bottom + 17 }, text));
    }
    for (const [at, text] of ticks(this.y, this.height * 1.4)) {
      const y = bottom - place(this.y, at) * this.height;
      grid.append(element('path', { class: text === null ? 'minor' : 'major', d: `M${this.left},${y} ${right},${y}` }));
      if (text !== null) grid.append(element('text', { class: 'tick y', x: this.left - 8, y: y + 4 }, text));
    }
    this.axes.prepend(grid);
    for (const rule of this.group.querySelectorAll('.rules')) rule.style.visibility = sx === 1 && sy === 1 ? '' : 'hidden';
  }
}

class Figure {
  constructor(svg) {
    this.svg = svg;
    this.names = {};
    this.panels = [...svg.querySelectorAll('.panel[data-panel]')].map(group => new Panel(this, group));
    for (const key of svg.querySelectorAll('.key')) {
      this.names[key.dataset.key] = key.textContent;
      key.setAttribute('tabindex', '0');
      key.setAttribute('role', 'switch');
      key.setAttribute('aria-checked', 'true');
      key.addEventListener('click', () => this.toggle(key));
      key.addEventListener('keydown', event => {
        if (event.key === 'Enter' || event.key === ' ') { event.preventDefault(); this.toggle(key); }
      });
    }
  }
  toggle(key) {
    const off = key.classList.toggle('off');
    key.setAttribute('aria-checked', String(!off));
    for (const mark of this.svg.querySelectorAll(`[data-series="${key.dataset.key}"]`)) mark.classList.toggle('hidden', off);
  }
  // panels that share an x axis zoom along it together
  zoomed(panel, x, y) {
    const same = other => ['label', 'unit', 'log', 'low', 'high'].every(key => other.home.x[key] === panel.home.x[key]);
    for (const other of this.panels) {
      if (other === panel) other.limit(x, y);
      else if (same(other)) other.limit(x, null);
    }
  }
  reset() {
    for (const panel of this.panels) panel.limit([panel.home.x.low, panel.home.x.high], [panel.home.y.low, panel.home.y.high]);
  }
}

for (const svg of document.querySelectorAll('svg.figure')) new Figure(svg);
// a link into a closed part opens it
const open = () => {
  const target = location.hash && document.getElementById(decodeURIComponent(location.hash.slice(1)));
  const part = target && target.closest('details');
  if (part) part.open = true;
};
addEventListener('hashchange', open);
open();
})();
