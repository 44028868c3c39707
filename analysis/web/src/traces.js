// Traces that were simulated again: paths from above, channels against time, contact phases.
import {checkbox, el, select, svg, tooltip, whenSized} from './dom.js';
import {column, counted, OUTCOMES, outcomeOf, policyColor, short, titled, withUnit} from './data.js';
import {axes, extent, hover, linePath} from './plot.js';
import {legend} from './widgets.js';

export const traceName = (one) => `${one.policy}, particle ${one.particle}`;
export const traceFate = (one) => one.outcome + (one.what && one.outcome !== 'unknown failure' ? `: ${one.what}` : '') +
    (one.violated_at !== null && one.violated_at !== undefined ? ` at ${short(one.violated_at)} s` : '');

/** Columns of a trace, unpacked once. */
const rowsOf = new WeakMap();
export function channel(trace, k) {
  if (!rowsOf.has(trace)) rowsOf.set(trace, []);
  const rows = rowsOf.get(trace);
  return (rows[k] ??= column(trace.rows[k]));
}

export function trajectories(data) {
  const traces = data.trajectories.filter((one) => one.rows);
  if (!traces.length) return null;
  const policies = [...new Set(traces.map((one) => one.policy))];
  const all = data.score ? data.score.policies.map((one) => one.policy) : policies;
  const state = {by: 'outcome', policy: '', channel: firstChannel(data)};
  const color = (one) => (state.by === 'outcome' ? outcomeOf(one.outcome).color : policyColor(all.indexOf(one.policy)));
  const shown = () => traces.filter((one) => !state.policy || one.policy === state.policy);
  const above = el('div'), time = el('div'), names = el('div');
  const x = data.channels.findIndex((one) => one.group === 'position' && one.name.endsWith('.x'));
  const plan = data.scene?.floating_base && x >= 0 ? {title: 'From above', x: [x, x + 1]} : null;
  function draw() {
    const there = OUTCOMES.filter((o) => shown().some((one) => one.outcome === o.name));
    names.replaceChildren(legend(state.by === 'outcome' ? there.map((o) => [o.title, o.color]) : policies.map((p) => [p, policyColor(all.indexOf(p))])));
    if (plan) above.replaceChildren(el('h3', {}, 'Path of the base from above'), planView(shown(), plan.x, color));
    const spec = data.channels[state.channel];
    time.replaceChildren(el('h3', {}, 'Against time'), timeView(shown(), state.channel, spec, color));
  }
  const groups = data.channels.map((one, k) => [k, `${one.group}: ${one.name}`]);
  draw();
  return {id: 'trajectories', title: 'Trajectories', text: data.kind === 'view' ? 'What the particles did, simulated again.' : `${counted(traces.length, 'trace', 'traces')}, simulated again: of each policy the success nearest to the nominal robot, a typical trace of each way to fail, the earliest violation, and the first particles.`, parts: [
    el('div', {class: 'choices'},
        select('Colour by', [['outcome', 'outcome'], ['policy', 'policy']], state.by, (v) => { state.by = v; draw(); }),
        select('Policy', [['', 'all'], ...policies.map((p) => [p, p])], '', (v) => { state.policy = v; draw(); }),
        select('Channel', groups, state.channel, (v) => { state.channel = Number(v); draw(); })),
    names, el('div', {class: plan ? 'columns' : ''}, plan && above, time)]};
}

/** Height of the base, else the first witness, else anything. */
function firstChannel(data) {
  const find = (test) => data.channels.findIndex(test);
  const z = find((one) => one.group === 'position' && one.name.endsWith('.z'));
  const first = z >= 0 && data.scene?.floating_base ? z : find((one) => one.group === 'requirement');
  return Math.max(0, first);
}

const about = (one) => [traceName(one), traceFate(one)];

function planView(traces, [x, y], color) {
  const box = el('div', {class: 'figure'});
  whenSized(box, (width) => {
    const xs = traces.map((one) => channel(one, x)), ys = traces.map((one) => channel(one, y));
    const [dx, dy] = [extent(xs), extent(ys)];
    const height = 340, aspect = (height - 54) / (width - 75);
    // One scale for both axes.
    const span = Math.max(dx[1] - dx[0], (dy[1] - dy[0]) / aspect);
    const around = ([a, b], s) => [(a + b - s) / 2, (a + b + s) / 2];
    const plot = axes({width, height, label: 'Path of the base from above', x: {domain: around(dx, span), title: 'x [m]'}, y: {domain: around(dy, span * aspect), title: 'y [m]'}});
    traces.forEach((one, k) => {
      plot.layer.append(svg('path', {class: 'line thin', stroke: color(one), d: linePath(plot, xs[k], ys[k])}));
      plot.layer.append(svg('circle', {cx: plot.x(xs[k].at(-1)), cy: plot.y(ys[k].at(-1)), r: 3, fill: color(one)}));
    });
    hover(plot, function* () {
      for (const [k, one] of traces.entries()) {
        for (let i = 0; i < xs[k].length; ++i) yield {x: xs[k][i], y: ys[k][i], lines: () => [...about(one), `${short(one.time[i])} s: x ${short(xs[k][i])} m, y ${short(ys[k][i])} m`]};
      }
    });
    box.replaceChildren(plot.root);
  });
  return box;
}

function timeView(traces, k, spec, color) {
  const box = el('div', {class: 'figure'});
  whenSized(box, (width) => {
    const ys = traces.map((one) => channel(one, k));
    const plot = axes({width, height: 340, label: spec.name, x: {domain: extent(traces.map((one) => one.time), 0), title: 'Time [s]'},
      y: {domain: extent(ys), title: titled(spec.name.length > 44 ? spec.name.slice(0, 43) + '…' : spec.name, spec.unit)}});
    if (plot.y.length && ['requirement', 'measure', 'objective'].includes(spec.group)) {
      plot.layer.append(svg('line', {class: 'zero', x1: plot.area.left, x2: plot.area.right, y1: plot.y(0), y2: plot.y(0)}));
    }
    traces.forEach((one, i) => plot.layer.append(svg('path', {class: 'line thin', stroke: color(one), d: linePath(plot, one.time, ys[i])})));
    hover(plot, function* () {
      for (const [t, one] of traces.entries()) {
        for (let i = 0; i < one.time.length; ++i) yield {x: one.time[i], y: ys[t][i], lines: () => [...about(one), `${short(one.time[i])} s: ${withUnit(short(ys[t][i]), spec.unit)}`]};
      }
    });
    box.replaceChildren(plot.root);
  });
  return box;
}

export function phases(data) {
  const traces = data.trajectories.filter((one) => one.phases.length);
  if (!traces.length) return null;
  const chart = el('div'), words = el('p', {class: 'note'});
  const colliders = data.campaign.colliders;
  let now = 0;
  const draw = () => {
    const one = traces[now];
    words.textContent = `${traceFate(one)}${one.why ? ` (${one.why})` : ''}`;
    chart.replaceChildren(gantt(one, colliders));
  };
  draw();
  return {id: 'phases', title: 'Contact phases', text: 'Which parts touched, and when, from touch-down to lift-off. The darker, the larger the mean force.', parts: [
    el('div', {class: 'choices'}, select('Trace', traces.map((one, k) => [k, `${traceName(one)}: ${one.outcome}`]), 0, (k) => { now = Number(k); draw(); })), words, chart]};
}

const MOST_LANES = 30;

function gantt(trace, colliders) {
  const lanes = new Map();
  for (const phase of trace.phases) {
    const key = `${colliders[phase[2]]} – ${colliders[phase[3]]}`;
    lanes.set(key, [...(lanes.get(key) ?? []), phase]);
  }
  const list = [...lanes.entries()].slice(0, MOST_LANES);
  const force = ([begin, end, , , , impulse]) => impulse / Math.max(end - begin, 1e-6);
  const strongest = Math.max(...trace.phases.map(force), 1e-12);
  const box = el('div', {class: 'figure'});
  whenSized(box, (width) => {
    const plot = axes({width, height: 54 + 26 * list.length, label: 'Contact phases', x: {domain: [0, Math.max(trace.end, 1e-6)], title: 'Time [s]'},
      y: {domain: [list.length - 0.4, -0.6], ticks: list.map(([name], k) => [k, name]), grid: false}});
    list.forEach(([name, items], k) => {
      for (const phase of items) {
        const [a, b] = [plot.x(phase[0]), plot.x(phase[1])];
        plot.layer.append(svg('rect', {x: a, width: Math.max(1.5, b - a), y: plot.y(k) - 8, height: 16, rx: 2, fill: 'var(--policy-0)', opacity: 0.3 + 0.7 * Math.sqrt(force(phase) / strongest),
          onpointermove: (event) => tooltip(event, [name, `${short(phase[0])} to ${short(phase[1])} s`, `impulse ${short(phase[5])} N s, mean ${short(force(phase))} N`, `largest of one step ${short(phase[4])} N s`]),
          onpointerleave: (event) => tooltip(event, null)}));
      }
    });
    if (trace.violated_at !== null) {
      const X = plot.x(trace.violated_at);
      plot.layer.append(svg('line', {class: 'zero', x1: X, x2: X, y1: plot.area.top, y2: plot.area.bottom, style: {stroke: 'var(--known)'}}));
    }
    box.replaceChildren(plot.root);
  });
  return el('div', {}, box, lanes.size > MOST_LANES && el('p', {class: 'note'}, `${lanes.size - MOST_LANES} more pairs are left out.`));
}
