// Plots as SVG: axes with titles and units, and what is drawn into them.
import {svg, tooltip} from './dom.js';
import {short} from './data.js';

/** Round numbers within [low, high], about `count` of them. */
export function ticks([low, high], count = 5) {
  const span = high - low;
  if (!(span > 0)) return [low];
  const raw = span / Math.max(1, count), power = 10 ** Math.floor(Math.log10(raw));
  const at = (step) => {
    const out = [];
    for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * span; ++i) out.push(Number((i * step).toPrecision(12)));
    return out;
  };
  // The coarsest steps that are as many; one number alone, as a 0 in the middle, gives no scale.
  const all = [10, 5, 2, 1, 0.5, 0.2].map((m) => m * power), step = [...all].reverse().find((s) => s >= raw * 0.999) ?? all[0];
  return all.slice(all.indexOf(step)).map(at).find((out) => out.length > 1) ?? at(step);
}

/** The range of all finite values, a little wider. */
export function extent(columns, pad = 0.04) {
  let low = Infinity, high = -Infinity;
  for (const values of columns) {
    for (const x of values) {
      if (x < low) low = x;
      if (x > high) high = x;
    }
  }
  if (!(low <= high)) return [0, 1];
  const wider = low === high ? Math.max(Math.abs(low) * 0.1, 1e-6) : (high - low) * pad;
  return [low - wider, high + wider];
}

const CHARACTER = 6.6; // px, a digit of the ticks' font

/**
 * An empty plot. axis: {domain: [low, high], title, ticks: [[value, text], …]?, grid: true?}. Returns the svg, the layer to
 * draw into (clipped), and functions x(value), y(value) to pixels.
 */
export function axes({width, height, x, y, label}) {
  const yTicks = y.ticks ?? ticks(y.domain, height / 55).map((v) => [v, short(v)]);
  const widest = Math.max(0, ...yTicks.map(([, text]) => text.length));
  const left = Math.min(Math.round(width * 0.45), Math.round(14 + widest * CHARACTER + (y.title ? 22 : 0)));
  const area = {left, right: width - 14, top: 10, bottom: height - (x.title ? 44 : 26)};
  const scale = (domain, from, to) => (v) => from + (v - domain[0]) / (domain[1] - domain[0] || 1) * (to - from);
  const toX = scale(x.domain, area.left, area.right), toY = scale(y.domain, area.bottom, area.top);
  const xTicks = x.ticks ?? ticks(x.domain, (area.right - area.left) / 90).map((v) => [v, short(v)]);
  const id = `clip${++axes.count}`;
  const layer = svg('g', {'clip-path': `url(#${id})`});
  const root = svg('svg', {width, height, viewBox: `0 0 ${width} ${height}`, class: 'plot', role: 'img', 'aria-label': label},
      svg('clipPath', {id}, svg('rect', {x: area.left, y: area.top - 3, width: area.right - area.left, height: area.bottom - area.top + 6})),
      xTicks.map(([v, text]) => [
        x.grid === false ? null : svg('line', {class: 'grid', x1: toX(v), x2: toX(v), y1: area.top, y2: area.bottom}),
        svg('text', {class: 'tick', x: toX(v), y: area.bottom + 17, 'text-anchor': 'middle'}, text)]),
      yTicks.map(([v, text]) => [
        y.grid === false ? null : svg('line', {class: 'grid', x1: area.left, x2: area.right, y1: toY(v), y2: toY(v)}),
        svg('text', {class: 'tick', x: area.left - 8, y: toY(v) + 4, 'text-anchor': 'end'}, text)]),
      svg('line', {class: 'axis', x1: area.left, x2: area.right, y1: area.bottom, y2: area.bottom}),
      layer,
      x.title && svg('text', {class: 'title', x: (area.left + area.right) / 2, y: height - 8, 'text-anchor': 'middle'}, x.title),
      y.title && svg('text', {class: 'title', transform: `translate(13 ${(area.top + area.bottom) / 2}) rotate(-90)`, 'text-anchor': 'middle'}, y.title));
  return {root, layer, x: toX, y: toY, area};
}
axes.count = 0;

const at = (n) => Math.round(n * 10) / 10;

/** An SVG path through the points; it is broken where one is missing. */
export function linePath(plot, xs, ys) {
  let out = '', pen = 'M';
  for (let i = 0; i < xs.length; ++i) {
    if (!Number.isFinite(xs[i]) || !Number.isFinite(ys[i])) {
      pen = 'M';
      continue;
    }
    out += `${pen}${at(plot.x(xs[i]))} ${at(plot.y(ys[i]))}`;
    pen = 'L';
  }
  return out;
}

/** Many dots of one colour as one path, which is fast. */
export function dots(plot, xs, ys, color, radius = 2.4) {
  let path = '';
  for (let i = 0; i < xs.length; ++i) {
    if (Number.isFinite(xs[i]) && Number.isFinite(ys[i])) path += `M${at(plot.x(xs[i]))} ${at(plot.y(ys[i]))}h0`;
  }
  plot.layer.append(svg('path', {d: path, class: 'dots', stroke: color, 'stroke-width': 2 * radius}));
}

export function band(plot, xs, lows, highs, color) {
  const there = xs.map((_, i) => i).filter((i) => Number.isFinite(lows[i]) && Number.isFinite(highs[i]));
  const up = there.map((i) => `${at(plot.x(xs[i]))} ${at(plot.y(highs[i]))}`);
  const down = there.map((i) => `${at(plot.x(xs[i]))} ${at(plot.y(lows[i]))}`).reverse();
  if (up.length > 1) plot.layer.append(svg('path', {class: 'band', fill: color, d: `M${[...up, ...down].join('L')}Z`}));
}

export function errorBar(plot, x, low, high, color) {
  const X = plot.x(x), [a, b] = [plot.y(low), plot.y(high)];
  plot.layer.append(svg('path', {class: 'error', stroke: color, d: `M${X} ${a}V${b}M${X - 5} ${a}h10M${X - 5} ${b}h10`}));
}

/** Tells of the point nearest to the pointer: candidates {x, y, lines} in the plot's units. */
export function hover(plot, candidates, click) {
  const nearest = (event) => {
    const box = plot.root.getBoundingClientRect();
    const px = event.clientX - box.left, py = event.clientY - box.top;
    let best = null, least = 18 * 18;
    for (const one of candidates()) {
      const distance = (plot.x(one.x) - px) ** 2 + (plot.y(one.y) - py) ** 2;
      if (distance < least) [best, least] = [one, distance];
    }
    return best;
  };
  plot.root.addEventListener('pointermove', (event) => tooltip(event, nearest(event)?.lines()));
  plot.root.addEventListener('pointerleave', (event) => tooltip(event, null));
  if (click) plot.root.addEventListener('click', (event) => nearest(event)?.go?.());
}
