// The sections of a report, in the order of the page.
import {el, select, svg, whenSized} from './dom.js';
import {column, counted, fixed, normalTail, OUTCOMES, outcomeOf, policyColor, pText, short, titled, whole, wilson, withUnit} from './data.js';
import {axes, extent} from './plot.js';
import {bars, legend, lines, scatter, shareBar, table} from './widgets.js';

const swatch = (color, text) => el('span', {}, el('i', {class: 'swatch', style: {background: color}}), text);
const intervalText = ([low, high]) => `${fixed(low, 4)} … ${fixed(high, 4)}`;

/** Some words with a button that copies a command. */
function command(words, text) {
  const button = el('button', {title: text, onclick: async () => {
    try {
      await navigator.clipboard.writeText(text);
      button.textContent = 'Copied';
    } catch {
      button.replaceWith(el('code', {}, text)); // to be copied by hand
    }
  }}, 'Copy');
  return el('span', {class: 'command'}, words, button);
}

/** The interval of a rate on a scale from 0 to 1. */
function intervalBar(rate, [low, high], color) {
  const width = 150, X = (v) => 4 + v * (width - 8);
  return svg('svg', {class: 'interval', width, height: 16, role: 'img', 'aria-label': `${fixed(rate, 3)}, ${intervalText([low, high])}`},
      svg('path', {d: `M4 8H${width - 4}M4 5v6M${width / 2} 6v4M${width - 4} 5v6`, stroke: 'var(--rule)'}),
      svg('path', {d: `M${X(low)} 8H${X(high)}`, stroke: color, 'stroke-width': 5, opacity: 0.45}),
      rate === null ? null : svg('circle', {cx: X(rate), cy: 8, r: 4, fill: color}));
}

export function verdict(data) {
  const {score} = data;
  const interval = score.interval_method === 'confidence_sequence' ? '95 % confidence sequence' : '95 % interval';
  const rows = score.policies.map((one, k) => [
    {value: one.policy, node: swatch(policyColor(k), one.policy)}, one.n, one.success, one.known_failure, one.unknown_failure, one.invalid,
    {value: one.rate, text: fixed(one.rate, 4)}, {value: one.interval[0], text: intervalText(one.interval)},
    intervalBar(one.rate, one.interval, policyColor(k)),
    shareBar([['Success', one.success, OUTCOMES[0].color], ['Known failure', one.known_failure, OUTCOMES[1].color], ['Unknown failure', one.unknown_failure, OUTCOMES[2].color]])]);
  const parts = [
    legend(OUTCOMES.slice(0, 3).map((one) => [one.title, one.color])),
    table({fold: 24, rows, columns: ['Policy', {name: 'N', title: 'valid traces'}, {name: 'S', title: 'successes'},
      {name: 'K', title: 'known failures: a requirement was violated'}, {name: 'U', title: 'unknown failures: objective unmet, nothing violated'},
      {name: 'Invalid', title: 'not counted in any rate'}, {name: 'Rate', title: 'S / N', align: 'right'}, {name: interval, align: 'right'}, {name: '0 … 1'}, {name: 'S, K, U'}]})];
  if (score.until) {
    parts.push(el('h3', {}, 'Questions of --until'), table({
      columns: ['Question', 'Policy', 'Answer', 'N', {name: `${100 * score.until.confidence} % interval`, align: 'right'}],
      rows: score.until.answers.map((one) => [one.question, one.policy, one.answer, one.n, intervalText(one.interval)])}));
  }
  const contacts = convergence(score);
  if (contacts) parts.push(contacts);
  if (score.pairs.length) parts.push(pairs(score.pairs));
  return {id: 'verdict', title: 'Verdict', text: 'How often each policy succeeded. Invalid traces count in no rate.', parts};
}

/** Steps whose contacts did not converge, and the traces that are flagged for it; nothing where all converged. */
function convergence(score) {
  const told = score.policies.filter((one) => one.convergence && (one.convergence.unconverged_steps > 0 || one.convergence.braked_steps > 0));
  if (!told.length) return null;
  const braked = told.some((one) => one.convergence.braked_steps > 0), flagged = told.some((one) => one.convergence.flagged.all > 0);
  const above = `more than ${short(100 * score.unconverged_limit)} % of the steps did not converge`;
  const share = (c) => ({value: c.unconverged_steps / c.steps, text: `${Number((100 * c.unconverged_steps / c.steps).toPrecision(2))} %`});
  const rows = told.map(({policy, convergence: c}) => [policy, c.steps, c.unconverged_steps, share(c), {value: c.unconverged_traces, text: `${whole(c.unconverged_traces)} of ${whole(c.traces)}`},
    c.median_change, c.largest_change, ...(braked ? [c.braked_steps, c.braked_steps ? c.most_braked : null] : []),
    ...(flagged ? [c.flagged.success, c.flagged.known_failure, c.flagged.unknown_failure, c.flagged.invalid, c.flagged.first_particle] : [])]);
  const columns = ['Policy', 'Steps', 'Unconverged', {name: 'Share', align: 'right'}, {name: 'In traces', align: 'right'},
    {name: 'Median, m/s', title: 'change of a velocity in the last sweep'}, {name: 'Most, m/s', title: 'change of a velocity in the last sweep'},
    ...(braked ? [{name: 'Braked', title: 'steps in which impulses were scaled back, because they would have given energy'}, {name: 'by, m/s', align: 'right', title: 'most that the brake has changed a velocity by'}] : []),
    ...(flagged ? [{name: 'Flagged S', title: `successes: ${above}`}, {name: 'K', title: `known failures: ${above}`}, {name: 'U', title: `unknown failures: ${above}`},
      {name: 'Invalid', title: `invalid traces: ${above}`}, {name: 'First', title: 'the lowest flagged particle'}] : [])];
  return el('div', {}, el('h3', {}, 'Steps whose contacts did not converge'), table({rows, columns}));
}

function pairs(list) {
  const signed = (x) => (x === null ? '–' : (x > 0 ? '+' : '') + fixed(x, 4));
  return el('div', {}, el('h3', {}, 'The same particles under two policies'), table({
    columns: ['a', 'b', {name: 'Pairs', title: 'particles whose traces are valid under both'}, 'Both', 'Only a', 'Only b', 'Neither', {name: 'Rate b − a', align: 'right'},
      {name: '95 % interval', title: "Newcombe's score interval for paired proportions", align: 'right'}, {name: 'McNemar p', title: 'exact', align: 'right'}],
    rows: list.map((p) => [p.a, p.b, p.n, p.both, p.only_a, p.only_b, p.neither, {value: p.difference, text: signed(p.difference)},
      {value: p.interval[0], text: `${signed(p.interval[0])} … ${signed(p.interval[1])}`}, {value: p.p_value, text: pText(p.p_value)}])}));
}

/** Success rate over the parameter in which the policies differ; else by policy. */
export function rates(data) {
  const score = new Map(data.score.policies.map((one) => [one.policy, one]));
  const index = new Map(data.score.policies.map((one, k) => [one.policy, k]));
  const parts = [], shown = new Set();
  for (const family of data.families) {
    const axis = family.axes.findLastIndex((one) => one.numeric);
    if (axis < 0) continue;
    const groups = new Map();
    for (const member of family.members) {
      const key = member.labels.filter((_, k) => k !== axis).join(', ');
      groups.set(key, [...(groups.get(key) ?? []), member]);
      shown.add(member.policy);
    }
    const curve = ([name, members]) => {
      const order = [...members].sort((a, b) => a.values[axis] - b.values[axis]);
      const of = (get) => order.map((one) => get(score.get(one.policy)));
      return {name: name ? `${family.name}: ${name}` : family.name, x: order.map((one) => one.values[axis]), y: of((s) => s.rate),
        low: of((s) => s.interval[0]), high: of((s) => s.interval[1]), marks: true};
    };
    const {key, unit} = family.axes[axis];
    const curves = [...groups.entries()].map(curve);
    const values = [...new Set(curves.flatMap((one) => one.x))].sort((a, b) => a - b);
    const xs = {title: key, unit, domain: extent([values], 0.06)};
    if (values.length <= 10) xs.labels = values.map((v) => [v, short(v)]);
    parts.push(el('h3', {}, `${family.name}: success rate over ${key}`), el('div', {class: 'narrow'}, lines({lines: curves, x: xs, y: {title: 'Success rate', domain: [-0.03, 1.03]}, height: 280})));
  }
  const rest = data.score.policies.filter((one) => !shown.has(one.policy));
  if (rest.length) parts.push(byPolicy(rest, index));
  return {id: 'rates', title: 'Success rate', text: 'Bands and bars are 95 % intervals.', parts};
}

function byPolicy(policies, index) {
  const at = policies.map((_, k) => k);
  if (policies.length > 8) {
    return bars({title: 'Success rate', domain: [0, 1.02], bars: policies.map((one) => ({label: one.policy, value: one.rate ?? 0, low: one.interval[0], high: one.interval[1]}))});
  }
  return el('div', {class: 'narrow'}, lines({height: 260, x: {title: 'Policy', labels: at.map((k) => [k, policies[k].policy]), domain: [-0.6, at.length - 0.4]}, y: {title: 'Success rate', domain: [-0.03, 1.03]},
    lines: policies.map((one, k) => ({name: one.policy, x: [k], y: [one.rate], low: [one.interval[0]], high: [one.interval[1]], errors: true, marks: true, line: false,
      color: `policy-${index.get(one.policy)}`}))}));
}

export function failures(data) {
  const n = new Map(data.score.policies.map((one) => [one.policy, one.n + one.invalid]));
  const rows = data.ways.map((one) => [one.policy, {value: one.outcome, node: swatch(outcomeOf(one.outcome).color, one.outcome)}, one.what, one.culprit || null, one.traces,
    {value: one.traces / n.get(one.policy), text: `${fixed(100 * one.traces / n.get(one.policy), 1)} %`},
    {value: one.earliest, text: withUnit(short(one.earliest), 's')}, {value: one.worst, text: withUnit(short(one.worst), one.unit)}, {value: one.earliest_particle, node: command(`particle ${one.earliest_particle}`, one.replay)}]);
  const parts = [];
  if (rows.length) {
    parts.push(table({rows, columns: ['Policy', 'Outcome', {name: 'Requirement', class: 'wrap'}, {name: 'Culprit', class: 'wrap', title: 'the part that was below 0 first, or that missed the objective'},
      'Traces', {name: 'Share', align: 'right'}, {name: 'Earliest', align: 'right', title: 'of the violation, else of the end'}, {name: 'Worst margin', align: 'right'},
      {name: 'Replay of the earliest', align: 'right'}]}));
  } else {
    parts.push(el('p', {}, 'No trace failed.'));
  }
  if (data.ways_left_out) parts.push(el('p', {class: 'note'}, `${data.ways_left_out} more ways to fail are left out, the rarest of each policy.`));
  if (data.score.measures.length) parts.push(measures(data.score));
  return {id: 'failures', title: 'Failures', text: 'Traces that failed alike, by requirement (or objective) and culprit.', parts};
}

function measures(score) {
  const rows = score.policies.flatMap((one) => score.measures.map((name) => {
    const kept = one.measures[name];
    return [one.policy, name, one.n, kept.kept, {value: kept.kept / one.n, text: fixed(one.n ? kept.kept / one.n : NaN, 4)}, {value: kept.interval[0], text: intervalText(kept.interval)},
      kept.undecided, one.objective_met, kept.kept_and_objective_met];
  }));
  return el('div', {}, el('h3', {}, 'Measures, which decide nothing'), table({rows, columns: ['Policy', 'Measure', 'N', 'Kept', {name: 'Rate', align: 'right'},
    {name: '95 % interval', align: 'right'}, 'Undecided', 'Objective met', 'Of these kept']}));
}

export function margins(data) {
  const box = el('div');
  const named = data.margins.map((one, k) => [k, one.name + (one.measure ? ' (measure)' : '')]);
  const draw = (k) => {
    const one = data.margins[k];
    const peak = Math.max(1, ...one.policies.flatMap((p) => p.bins.map((bin) => bin[0] + bin[1] + bin[2])));
    box.replaceChildren(el('div', {class: 'columns'}, one.policies.map((policy) => histogram(one, policy, peak))));
  };
  if (data.margins.length) draw(0);
  return {id: 'margins', title: 'Margins', text: 'How close traces came: a margin below 0 is a violation. All valid traces; the outer bins hold what lies beyond, too.', parts: [
    el('div', {class: 'choices'}, select('Margin of', named, 0, (k) => draw(Number(k)))), legend(OUTCOMES.slice(0, 3).map((o) => [o.title, o.color])), box]};
}

function histogram(margin, policy, peak) {
  const {edges} = margin, groups = [];
  const n = policy.bins.reduce((sum, bin) => sum + bin[0] + bin[1] + bin[2], 0);
  for (let k = 0; k < 3; ++k) groups.push({color: OUTCOMES[k].color, bins: policy.bins.map((bin) => [bin.slice(0, k).reduce((a, b) => a + b, 0), bin[k]])});
  return el('div', {}, el('h3', {}, policy.policy, el('span', {class: 'note', style: {fontWeight: 400}}, `  ${counted(n, 'trace', 'traces')}${policy.unjudged ? `, ${policy.unjudged} never judged` : ''}`)),
      stackedBins({edges, groups, peak, x: titled('Margin', margin.unit)}));
}

function stackedBins({edges, groups, peak, x}) {
  const box = el('div', {class: 'figure'});
  whenSized(box, (width) => {
    const plot = axes({width, height: 190, x: {domain: [edges[0], edges.at(-1)], title: x}, y: {domain: [0, peak * 1.05], title: 'Traces'}, label: x});
    for (const group of groups) {
      let path = '';
      group.bins.forEach(([from, count], i) => {
        if (!count) return;
        const left = plot.x(edges[i]) + 0.5, right = plot.x(edges[i + 1]) - 0.5;
        path += `M${left} ${plot.y(from)}V${plot.y(from + count)}H${right}V${plot.y(from)}Z`;
      });
      plot.layer.append(svg('path', {d: path, fill: group.color}));
    }
    if (edges[0] < 0 && edges.at(-1) > 0) plot.layer.append(svg('line', {class: 'zero', x1: plot.x(0), x2: plot.x(0), y1: plot.area.top, y2: plot.area.bottom}));
    box.replaceChildren(plot.root);
  });
  return box;
}

/** Difference of the means of successes and failures, in standard deviations of all: a first look at what matters. */
function separation(values, outcome) {
  const sums = {S: [0, 0], F: [0, 0]};
  let n = 0, sum = 0, squares = 0;
  for (let i = 0; i < values.length; ++i) {
    const x = values[i], side = outcome[i] === 'S' ? 'S' : 'KU'.includes(outcome[i]) ? 'F' : null;
    if (!side || !Number.isFinite(x)) continue;
    sums[side][0] += x;
    sums[side][1] += 1;
    n += 1;
    sum += x;
    squares += x * x;
  }
  const variance = n > 1 ? (squares - sum * sum / n) / (n - 1) : 0;
  if (!(variance > 0) || !sums.S[1] || !sums.F[1]) return 0;
  return (sums.S[0] / sums.S[1] - sums.F[0] / sums.F[1]) / Math.sqrt(variance);
}

/** How large a difference must be to be more than chance, with so many looked at. */
function chance(outcome, count) {
  const good = [...outcome].filter((one) => one === 'S').length, bad = [...outcome].filter((one) => 'KU'.includes(one)).length;
  if (!good || !bad) return el('p', {class: 'note'}, 'Under this policy there are no two outcomes to compare.');
  const limit = normalTail(0.025 / count) * Math.sqrt(1 / good + 1 / bad);
  return el('p', {class: 'note'}, `Difference of the means of ${good} successes and ${bad} failures, in standard deviations. By chance alone one of ${count} parameters would go beyond ±${fixed(limit, 2)} in 5 % of campaigns.`);
}

export function parameters(data) {
  const values = data.parameters.map((one) => column(one.values));
  const {policies} = data.traces;
  const graph = el('div'), rank = el('div'), picker = el('span');
  // The policy whose rate is nearest to one half tells most.
  const rate = (one) => Math.abs((data.score.policies.find((p) => p.policy === one.policy)?.rate ?? 0) - 0.5);
  if (!data.parameters.length) return null;  // nothing was uncertain, or the archive keeps no values
  let policy = policies.reduce((best, one, k) => (rate(one) < rate(policies[best]) ? k : best), 0), parameter = 0, against = 'rate';
  const order = () => data.parameters.map((_, k) => [k, separation(values[k], policies[policy].outcome)]).sort((a, b) => Math.abs(b[1]) - Math.abs(a[1]) || a[0] - b[0]);
  const choose = (k) => {
    parameter = k;
    draw();
  };
  function newPolicy(k) {
    policy = k;
    const list = order();
    choose(list[0][0]);
    rank.replaceChildren(chance(policies[policy].outcome, data.parameters.length), table({fold: 10, columns: ['Parameter', {name: 'Difference', title: 'mean of successes minus mean of failures, in standard deviations', align: 'right'}],
      rows: list.map(([i, d]) => [{value: data.parameters[i].name, node: el('a', {href: '#parameters', onclick: (event) => { event.preventDefault(); choose(i); }}, data.parameters[i].name)}, {value: Math.abs(d), text: fixed(d, 2)}])}));
  }
  function draw() {
    picker.replaceChildren(select('Parameter', data.parameters.map((one, k) => [k, one.name]), parameter, (k) => choose(Number(k))));
    graph.replaceChildren(against === 'rate' ? rateOver(data.parameters[parameter], values[parameter], policies[policy])
      : marginOver(data, data.parameters[parameter], values[parameter], policies[policy], against));
  }
  const vertical = [['rate', 'success rate'], ['objective', 'margin of the objective'], ...data.campaign.requirements.map((one, k) => [String(k), `margin of ${one.name}`])];
  newPolicy(policy);
  return {id: 'parameters', title: 'Parameters', text: `What the particles' true parameters did to the outcome, of the first ${whole(data.traces.count)} particles. A first look, one parameter at a time.`, parts: [
    el('div', {class: 'choices'}, select('Policy', policies.map((one, k) => [k, one.policy]), policy, (k) => newPolicy(Number(k))), picker,
        select('Against', vertical, against, (key) => { against = key; draw(); })),
    el('div', {class: 'columns'}, graph, rank)]};
}

const letters = ['S', 'K', 'U'];
const axisOf = (parameter) => ({title: parameter.name, unit: parameter.unit,
  ...(parameter.labels.length ? {labels: parameter.labels.map((label, k) => [k, label]), domain: [-0.6, parameter.labels.length - 0.4]} : {})});

function marginOver(data, parameter, values, policy, against) {
  const margin = column(against === 'objective' ? policy.objective : policy.margins[Number(against)]);
  const of = data.margins[against === 'objective' ? data.margins.length - 1 : Number(against)];
  const groups = letters.map((letter, k) => {
    const at = [...values.keys()].filter((i) => policy.outcome[i] === letter);
    return {name: OUTCOMES[k].title, color: OUTCOMES[k].name, x: at.map((i) => values[i]), y: at.map((i) => margin[i]), labels: at.map((i) => `Particle ${data.traces.first + i}: ${OUTCOMES[k].name}`)};
  }).filter((one) => one.x.length);
  return scatter({groups, x: axisOf(parameter), y: {title: `Margin of ${of.name}`, unit: of.unit, zero: true}, height: 340});
}

/** In ten classes of equal number, with intervals; choices in theirs. */
function rateOver(parameter, values, policy) {
  const there = [...values.keys()].filter((i) => letters.includes(policy.outcome[i]) && Number.isFinite(values[i])).sort((a, b) => values[a] - values[b]);
  const classes = [];
  if (parameter.labels.length) {
    for (let k = 0; k < parameter.labels.length; ++k) classes.push(there.filter((i) => Math.round(values[i]) === k));
  } else {
    const count = Math.max(1, Math.min(10, Math.floor(there.length / 10)));
    for (let k = 0; k < count; ++k) classes.push(there.slice(Math.floor(k * there.length / count), Math.floor((k + 1) * there.length / count)));
  }
  const filled = classes.filter((one) => one.length);
  const good = filled.map((one) => one.filter((i) => policy.outcome[i] === 'S').length);
  const intervals = filled.map((one, k) => wilson(good[k], one.length));
  const mean = (one) => one.reduce((sum, i) => sum + values[i], 0) / one.length;
  return el('div', {}, lines({height: 340, x: axisOf(parameter), y: {title: 'Success rate', domain: [-0.03, 1.03]}, lines: [{name: policy.policy, x: filled.map(mean),
    y: filled.map((one, k) => good[k] / one.length), low: intervals.map((one) => one[0]), high: intervals.map((one) => one[1]), marks: true, errors: parameter.labels.length > 0, line: parameter.labels.length === 0}]}),
  el('p', {class: 'note'}, parameter.labels.length ? "Wilson's 95 % intervals." : `${filled.length} classes of ${filled[0]?.length ?? 0} particles or so, at their mean; Wilson's 95 % intervals.`));
}

export function campaign(data) {
  const c = data.campaign;
  const facts = [['Archive', c.archive], ['Made by', c.command], ['Started', c.started], ['Program', `graze ${c.program}, results version ${c.results_version || 'not known'}`],
    ['Physics', `${c.physics}, steps of ${short(c.step)} s, control every ${short(c.control)} s, until ${short(c.end)} s`],
    ['Particles', `${whole(c.particles)}, ${c.parameters} scalars each, design ${c.design}, seed ${c.seed}`], ['Objective', c.objective], ['Scenario', `SHA-256 ${c.scenario_sha256}`]];
  return {id: 'campaign', title: 'Campaign', parts: [el('dl', {class: 'facts'}, facts.map(([name, value]) => [el('dt', {}, name), el('dd', {}, value)])),
    table({columns: ['Requirement', 'Kind', {name: 'Description', class: 'wrap'}, 'Unit'], rows: c.requirements.map((one) => [one.name, one.measure ? 'measure' : 'requirement', one.description, one.unit])})]};
}
