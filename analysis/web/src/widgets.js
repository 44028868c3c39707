// The parts that sections are made of. Sections of `data.sections` are made of these by their data alone:
//   {id, title, text, widgets: [{type: 'table' | 'bars' | 'lines' | 'scatter' | 'tree' | 'text', …}]}
// docs/report.md tells what each takes.
import {el, svg, whenSized} from './dom.js';
import {axes, band, dots, errorBar, extent, hover, linePath} from './plot.js';
import {column, OUTCOMES, policyColor, short, titled, whole, withUnit} from './data.js';

const NAMED = {ink: 'var(--ink)', success: OUTCOMES[0].color, known: OUTCOMES[1].color, unknown: OUTCOMES[2].color, invalid: OUTCOMES[3].color};
/** A colour by its name in `color` ("success", "known", …), else by its place among its neighbours. */
export const colorOf = (one, index) => /^policy-\d+$/.test(one?.color) ? policyColor(Number(one.color.slice(7))) : NAMED[one?.color] ?? OUTCOMES.find((o) => o.name === one?.color)?.color ?? policyColor(index);

export function legend(entries) {
  return el('div', {class: 'legend'}, entries.map(([text, color, dash]) => el('span', {},
    el('i', {style: {background: dash ? `repeating-linear-gradient(90deg, ${color} 0 4px, transparent 4px 7px)` : color}}), text)));
}

const sortKey = (cell) => (cell && typeof cell === 'object' && !(cell instanceof Node) ? cell.value : cell);

function cellContent(cell, spec) {
  if (cell === null || cell === undefined) return '–';
  if (cell instanceof Node) return cell;
  if (typeof cell === 'object') return cell.node ?? cell.text ?? cellContent(cell.value, spec);
  if (typeof cell !== 'number') return cell;
  return withUnit(spec.digits === undefined ? Number.isInteger(cell) ? whole(cell) : short(cell) : cell.toFixed(spec.digits).replace('-', '−'), spec.unit);
}

function compare(a, b) {
  const [x, y] = [sortKey(a), sortKey(b)];
  const missing = (v) => v === null || v === undefined || Number.isNaN(v);
  if (missing(x) || missing(y)) return missing(x) - missing(y);
  return typeof x === 'number' && typeof y === 'number' ? x - y : String(x).localeCompare(String(y), 'en', {numeric: true});
}

const LINES = 12; // of a table that is folded

/**
 * columns: ["name" | {name, unit?, digits?, align?: 'left' | 'right', title?}]; rows: arrays of text, numbers, null,
 * elements, or {value, text | node}. Columns sort when their heads are clicked; long tables are folded.
 */
export function table({columns, rows, fold = LINES, caption}) {
  const specs = columns.map((one) => (typeof one === 'string' ? {name: one} : one));
  const numeric = specs.map((spec, k) => spec.align ? spec.align === 'right'
    : rows.some((row) => typeof sortKey(row[k]) === 'number') && rows.every((row) => typeof sortKey(row[k]) !== 'string'));
  let order = rows.map((_, i) => i), sorted = null, down = false, open = rows.length <= fold + 3;
  const body = el('tbody'), more = el('button', {class: 'more', onclick: () => { open = !open; draw(); }});
  const heads = specs.map((spec, k) => el('th', {class: numeric[k] ? 'number' : '', title: spec.title, scope: 'col', tabindex: 0,
    onclick: () => sort(k), onkeydown: (event) => { if (event.key === 'Enter') sort(k); }}, spec.name));
  function sort(k) {
    down = sorted === k ? !down : numeric[k];
    sorted = k;
    order = rows.map((_, i) => i).sort((a, b) => (down ? -1 : 1) * compare(rows[a][k], rows[b][k]) || a - b);
    heads.forEach((head, i) => head.setAttribute('aria-sort', i === k ? down ? 'descending' : 'ascending' : 'none'));
    draw();
  }
  function draw() {
    body.replaceChildren(...(open ? order : order.slice(0, fold)).map((i) => el('tr', {},
        specs.map((spec, k) => el('td', {class: numeric[k] ? 'number' : spec.class}, cellContent(rows[i][k], spec))))));
    more.textContent = open ? 'Show fewer' : `Show all ${rows.length}`;
  }
  draw();
  return el('div', {class: 'table'}, caption && el('p', {class: 'caption'}, caption),
      el('div', {class: 'scroll'}, el('table', {}, el('thead', {}, el('tr', {}, heads)), body)), rows.length > fold + 3 && more);
}

/** bars: [{label, value | parts: [{value, color, name}], low?, high?, note?}], horizontal. */
export function bars({bars, title, label = title, unit, domain}) {
  const total = (bar) => bar.parts ? bar.parts.reduce((sum, part) => sum + part.value, 0) : bar.value;
  const box = el('div', {class: 'figure'});
  const ends = bars.map((bar) => Math.max(total(bar), bar.high ?? 0)), starts = bars.map((bar) => Math.min(0, total(bar), bar.low ?? 0));
  const range = domain ?? [Math.min(0, ...starts), Math.max(...ends, 1e-12) * 1.03];
  whenSized(box, (width) => {
    const height = 54 + 26 * bars.length;
    const labels = bars.map((bar, i) => [i, bar.label.length > 42 ? bar.label.slice(0, 41) + '…' : bar.label]);
    const plot = axes({width, height, label, x: {domain: range, title: titled(label ?? '', unit)},
      y: {domain: [bars.length - 0.4, -0.6], ticks: labels, grid: false}});
    bars.forEach((bar, i) => {
      let from = 0;
      for (const [k, part] of (bar.parts ?? [bar]).entries()) {
        const [a, b] = [plot.x(from), plot.x(from + part.value)];
        plot.layer.append(svg('rect', {x: Math.min(a, b), width: Math.abs(b - a), y: plot.y(i) - 8, height: 16, fill: colorOf(part, bar.parts ? k : 0)},
            svg('title', {}, `${bar.label}${part.name ? `: ${part.name}` : ''}: ${short(part.value)}`)));
        from += part.value;
      }
      if (bar.low !== undefined && bar.high !== undefined) {
        plot.layer.append(svg('path', {class: 'error ink', d: `M${plot.x(bar.low)} ${plot.y(i)}H${plot.x(bar.high)}`}));
      }
    });
    box.replaceChildren(plot.root);
  });
  const names = [...new Map(bars.flatMap((bar) => bar.parts ?? []).map((part, k) => [part.name, colorOf(part, k)])).entries()].filter(([n]) => n);
  return el('div', {}, names.length > 0 && legend(names), box);
}

/** What holds from each x until the next: the corners of its stairs. */
function stairs(xs, ys) {
  const out = [];
  for (let i = 0; i < xs.length; ++i) {
    if (i > 0) out.push([xs[i], ys[i - 1]]);
    out.push([xs[i], ys[i]]);
  }
  return [out.map((one) => one[0]), out.map((one) => one[1])];
}

/**
 * lines: [{name, x: [], y: [], low?: [], high?: [], color?, marks?: true, errors?: true, dash?}]; x, y: {title, unit,
 * domain?, labels?: [[value, text]]}. low and high make a band, or with `errors` bars. steps: what holds at a point holds
 * until the next. y.zero: a line at 0; legend: false: names stand elsewhere.
 */
export function lines({lines, x, y, height = 300, label, steps = false, legend: named = true}) {
  const path = (xs, ys) => (steps ? stairs(xs, ys) : [[...xs], ys]);
  const all = lines.map((one) => ({...one, x: column(one.x), y: column(one.y), low: column(one.low), high: column(one.high)}));
  const box = el('div', {class: 'figure'});
  whenSized(box, (width) => {
    const plot = axes({width, height, label: label ?? y.title,
      x: {domain: x.domain ?? extent(all.map((one) => one.x)), title: titled(x.title, x.unit), ticks: x.labels, grid: !x.labels},
      y: {domain: y.domain ?? extent(all.flatMap((one) => [one.y, one.low, one.high])), title: titled(y.title, y.unit)}});
    if (y.zero) plot.layer.append(svg('line', {class: 'zero', x1: plot.area.left, x2: plot.area.right, y1: plot.y(0), y2: plot.y(0)}));
    all.forEach((one, k) => {
      const color = colorOf(one, k);
      if (one.low.length && !one.errors) band(plot, path(one.x, one.low)[0], path(one.x, one.low)[1], path(one.x, one.high)[1], color);
      if (one.line !== false) plot.layer.append(svg('path', {class: 'line', stroke: color, d: linePath(plot, ...path(one.x, one.y)), 'stroke-dasharray': one.dash ? '5 4' : null}));
      if (one.errors) one.x.forEach((v, i) => errorBar(plot, v, one.low[i], one.high[i], color));
      if (one.marks) dots(plot, one.x, one.y, color, 4);
    });
    hover(plot, () => all.flatMap((one, k) => [...one.x].map((v, i) => ({x: v, y: one.y[i], lines: () => [
      lines[k].name, `${x.title}: ${x.labels?.find(([at]) => at === v)?.[1] ?? withUnit(short(v), x.unit)}`, `${y.title}: ${withUnit(short(one.y[i]), y.unit)}`,
      ...(one.low.length ? [`95 %: ${short(one.low[i])} … ${short(one.high[i])}`] : [])].filter(Boolean)}))));
    box.replaceChildren(plot.root);
  });
  const names = named ? lines.filter((one) => one.name) : [];
  return el('div', {}, names.length > 1 && legend(names.map((one) => [one.name, colorOf(one, lines.indexOf(one)), one.dash])), box);
}

/** groups: [{name, x: [], y: [], color?, labels?: []}]; x, y as of lines. */
export function scatter({groups, x, y, height = 320, label, radius}) {
  const all = groups.map((one) => ({...one, x: column(one.x), y: column(one.y)}));
  const box = el('div', {class: 'figure'});
  whenSized(box, (width) => {
    const plot = axes({width, height, label: label ?? y.title,
      x: {domain: x.domain ?? extent(all.map((one) => one.x)), title: titled(x.title, x.unit), ticks: x.labels},
      y: {domain: y.domain ?? extent(all.map((one) => one.y)), title: titled(y.title, y.unit), ticks: y.labels}});
    if (y.zero) plot.layer.append(svg('line', {class: 'zero', x1: plot.area.left, x2: plot.area.right, y1: plot.y(0), y2: plot.y(0)}));
    all.forEach((one, k) => dots(plot, one.x, one.y, colorOf(one, k), radius));
    hover(plot, function* () {
      for (const one of all) {
        for (let i = 0; i < one.x.length; ++i) {
          yield {x: one.x[i], y: one.y[i], lines: () => [one.labels?.[i] ?? one.name, `${x.title}: ${withUnit(short(one.x[i]), x.unit)}`,
            `${y.title}: ${withUnit(short(one.y[i]), y.unit)}`]};
        }
      }
    });
    box.replaceChildren(plot.root);
  });
  return el('div', {}, groups.length > 1 && legend(groups.map((one, k) => [one.name, colorOf(one, k)])), box);
}

/** S, K, U as one bar of shares. */
export function shareBar(counts) {
  const total = counts.reduce((sum, [, value]) => sum + value, 0);
  return el('span', {class: 'shares', role: 'img', 'aria-label': counts.map(([name, v]) => `${name} ${v}`).join(', ')},
      counts.filter(([, value]) => value > 0).map(([name, value, color]) =>
        el('i', {style: {width: `${100 * value / total}%`, background: color}, title: `${name}: ${value} of ${total}`})));
}

function node(one, depth, rootCount) {
  const outcomes = one.outcomes ?? {};
  const bar = one.said !== undefined && !one.parts ? null : shareBar(one.parts ? one.parts.map((part, k) => [part.name, part.value, colorOf(part, k)])
    : [['Success', outcomes.S ?? 0, OUTCOMES[0].color], ['Known failure', outcomes.K ?? 0, OUTCOMES[1].color], ['Unknown failure', outcomes.U ?? 0, OUTCOMES[2].color]]);
  const line = [el('span', {class: 'name'}, one.label), el('span', {class: 'count'}, one.n === undefined ? '' : whole(one.n)),
    el('span', {class: 'when'}, one.said ?? (one.time === undefined || one.time === null ? '' : `${short(one.time, 3)} s`)),
    el('span', {class: 'width'}, el('span', {style: {width: `${100 * (one.n ?? 0) / (rootCount || 1)}%`, display: 'block'}}, bar))];
  const children = one.children ?? [];
  if (children.length === 0) return el('li', {}, el('div', {class: 'line leaf'}, line));
  return el('li', {}, el('details', {open: depth < 3 && !one.closed}, el('summary', {class: 'line'}, line),
      el('ul', {}, children.map((child) => node(child, depth + 1, rootCount)))));
}

/**
 * root: {label, n, outcomes: {S, K, U}, time, children}, or a list of such. In place of outcomes: parts as of bars; in place
 * of a time: `said`, a text; closed: true folds it. legend: [{name, color}], of parts.
 */
export function tree({root, legend: names}) {
  const roots = Array.isArray(root) ? root : [root];
  const most = Math.max(...roots.map((one) => one.n ?? 0));
  return el('div', {class: 'tree scroll'}, legend(names ? names.map((one, k) => [one.name, colorOf(one, k)]) : OUTCOMES.slice(0, 3).map((one) => [one.title, one.color])),
      el('ul', {}, roots.map((one) => node(one, 0, most))));
}

/** Widgets beside each other, where there is room. */
const row = ({widgets, three}) => el('div', {class: three ? 'columns three' : 'columns'}, widgets.map(widget));

const TYPES = {table, bars, lines, scatter, tree, row, legend: ({entries}) => legend(entries.map((one, k) => [one.name, colorOf(one, k), one.dash])), text: ({text}) => el('p', {}, text)};

export function widget(spec) {
  const make = TYPES[spec.type];
  if (!make) return el('p', {class: 'note'}, `(a widget of a kind that this page does not know: ${spec.type})`);
  return el('div', {class: `widget ${spec.type}`}, spec.title && el('h3', {}, spec.title), make(spec), spec.note && el('p', {class: 'note'}, spec.note));
}
