// The page of graze report, graze view, graze improve and graze drive. Its data stand in the element #graze-data; window.graze tells tests of its state.
import './hook.js';
import {drawWaiting, el} from './dom.js';
import {counted} from './data.js';
import {drive} from './drive.js';
import {campaign, failures, margins, parameters, rates, verdict} from './report.js';
import {pair} from './pair.js';
import {replay} from './replay.js';
import {phases, trajectories} from './traces.js';
import {widget} from './widgets.js';

const {graze} = window;

function others(data) {
  return (data.sections ?? []).map((one) => ({id: `section-${one.id}`, title: one.title, text: one.text, parts: (one.widgets ?? []).map(widget)}));
}

function theme() {
  const root = document.documentElement, dark = window.matchMedia('(prefers-color-scheme: dark)');
  const name = () => root.dataset.theme;
  const button = el('button', {class: 'theme', onclick: () => set(name() === 'dark' ? 'light' : 'dark')});
  function set(value) {
    root.dataset.theme = value;
    button.textContent = value === 'dark' ? 'Light' : 'Dark';
    graze.stage?.paint();
  }
  set(dark.matches ? 'dark' : 'light');
  dark.addEventListener('change', () => set(dark.matches ? 'dark' : 'light'));
  return button;
}

function header(data) {
  if (['redesign', 'drive'].includes(data.kind)) return heading(data.title, data.lead, data.notes);
  const c = data.campaign;
  const traces = data.kind === 'view' ? counted(data.trajectories.length, 'trace', 'traces')
    : `${counted(data.score.policies.reduce((sum, one) => sum + one.n + one.invalid, 0), 'trace', 'traces')}, ${counted(data.score.particles, 'particle', 'particles')} under ${counted(data.score.policies.length, 'policy', 'policies')}`;
  return heading(c.name || c.archive, `${traces}. Seed ${c.seed}. Simulated ${c.started.slice(0, 10)} by graze ${c.program.split(' ')[0]}.`, data.notes);
}

function heading(title, lead, notes) {
  return el('header', {}, el('div', {}, theme(), el('h1', {}, title), el('p', {class: 'lead'}, lead), notes.map((text) => el('p', {class: 'warning'}, text))));
}

/** A section that cannot be drawn must not take the others with it. */
function attempt(make, data) {
  try {
    return make(data);
  } catch (error) {
    graze.errors.push(String(error.stack ?? error));
    return {id: `failed-${graze.errors.length}`, title: 'A section that could not be drawn', parts: [el('p', {class: 'warning'}, String(error))]};
  }
}

/** What came of a redesign, both robots, and how it went. */
function redesign(data) {
  const [first, ...rest] = others(data);
  return [first, attempt(pair, data), ...rest];
}

function show(data) {
  const make = data.kind === 'redesign' ? [redesign] : data.kind === 'drive' ? [drive] : data.kind === 'view' ? [replay, trajectories, phases, others] : [verdict, rates, failures, replay, trajectories, phases, margins, parameters, others, campaign];
  const sections = make.flatMap((one) => attempt(one, data)).filter(Boolean);
  document.title = `${data.title ?? (data.campaign.name || data.campaign.archive)} · Graze`;
  document.getElementById('page').replaceChildren(header(data),
      ...(sections.length > 1 ? [el('nav', {}, el('div', {}, sections.map((one) => el('a', {href: `#${one.id}`}, one.short ?? one.title))))] : []),
      el('main', {}, sections.map((one) => el('section', {id: one.id}, el('h2', {}, one.title), one.text && el('p', {class: 'lead'}, one.text), one.parts))));
  drawWaiting();
  graze.sections = sections.map((one) => one.id);
  graze.times.shown = performance.now();
  // The stage after the first picture of the page.
  setTimeout(() => {
    graze.stage = sections.find((one) => one.start)?.start() ?? null;
    graze.times.ready = performance.now();
    graze.ready = true;
  }, 0);
}

const data = JSON.parse(document.getElementById('graze-data').textContent);
graze.data = data;
show(data);
