// The page of graze drive: one robot as it goes, and what steers it. Frames come from the program, keys go to it.
import * as three from 'three';
import {checkbox, el} from './dom.js';
import {fixed, short} from './data.js';
import {Player} from './scene.js';
import {Stage} from './replay.js';

const KEYS = {ArrowUp: 'up', ArrowDown: 'down', ArrowLeft: 'left', ArrowRight: 'right', w: 'up', s: 'down', a: 'left', d: 'right', ' ': 'space', ',': ',', '.': '.', c: 'c', q: 'q'};
const DEGREE = 180 / Math.PI;
const PATH = 4000; // points of the way behind it
const STICKS = 100; // ms between two looks at a gamepad
const SLACK = 0.08; // of a stick's way, which is no wish

/** The robot in its last two frames, between which the picture goes on. */
class LivePlayer extends Player {
  constructor(trace, scene) {
    super(trace, scene);
    this.time = [trace.time[0], trace.time[0]];
    this.poses = this.poses.map((row) => [row[0], row[0]]);
    this.way = super.path();
    this.arrived = 0;
    this.between = 50;
  }

  take({time, bodies}, now) {
    this.between = Math.min(200, Math.max(10, 0.8 * this.between + 0.2 * (now - this.arrived)));
    this.arrived = now;
    this.time = [this.time[1], time];
    bodies.poses.forEach((row, i) => { this.poses[i] = [this.poses[i][1], row[0]]; });
    this.readContacts({...bodies.contacts, frame: bodies.contacts.frame.map(() => 1)});
    this.way.push(new three.Vector3(this.poses[0][1], this.poses[1][1], this.poses[2][1]));
    if (this.way.length > PATH) this.way = this.way.filter((_, i) => i % 2 === 0);
  }

  /** The time to show: one frame late, so that there is something to go toward. */
  at(now) {
    const share = Math.min(1, Math.max(0, (now - this.arrived) / this.between)); // a picture's clock may lie behind
    return this.time[0] + share * (this.time[1] - this.time[0]);
  }

  contactsAt() {
    return super.contactsAt(this.time[1]);
  }

  path() {
    return this.way;
  }
}

class LiveStage extends Stage {
  constructor(data) {
    super(data, LivePlayer);
    this.player = this.players[0];
    this.corners = this.planes.map(({group}) => group.position.clone());
  }

  take(frame, now) {
    this.player.take(frame, now);
    this.trails[0].geometry.dispose();
    this.trails[0].geometry = new three.BufferGeometry().setFromPoints(this.player.way);
  }

  tick(now) {
    const time = this.player.at(now);
    if (time !== this.time) {
      this.time = time;
      this.place();
      this.ground();
    }
    super.tick(now);
  }

  /** The ground goes along, by whole squares. */
  ground() {
    const {x, y} = this.player.bodies[0].position, step = this.gridStep;
    this.planes.forEach(({group}, k) => {
      const corner = this.corners[k];
      if (!this.flat(group)) return;
      group.position.set(corner.x + Math.round((x - corner.x) / step) * step, corner.y + Math.round((y - corner.y) / step) * step, corner.z);
    });
  }

  flat(group) {
    return new three.Vector3(0, 0, 1).applyQuaternion(group.quaternion).z > 0.999;
  }
}

/** Where a gamepad's sticks lie, as "stick F S T"; null: there is none. */
function sticks() {
  const pad = [...(navigator.getGamepads?.() ?? [])].find((one) => one?.connected && one.axes.length >= 2);
  if (!pad) return null;
  const axis = (i) => (Math.abs(pad.axes[i] ?? 0) < SLACK ? 0 : -pad.axes[i]); // away and to the left are positive
  return `stick ${[axis(1), axis(0), axis(pad.axes.length > 2 ? 2 : 0)].map((x, i) => (i === 1 && pad.axes.length <= 2 ? 0 : x.toFixed(2))).join(' ')}`;
}

/** The section; the stage is made when the page has been drawn. */
export function drive(data) {
  const box = el('div', {}, el('p', {class: 'note'}, 'Loading …'));
  const start = () => {
    let stage = null;
    try {
      stage = new LiveStage(data);
    } catch (error) {
      box.replaceChildren(el('p', {class: 'warning'}, `The view needs WebGL, which this browser does not offer here (${error.message}); the keys work.`));
    }
    build(stage, box, data);
    return stage;
  };
  return {id: 'drive', short: 'Drive', title: 'The robot, live', parts: [box], start};
}

/** What stands beside the stage: gaits to choose, numbers. */
function panel(data, press) {
  const gaits = data.policies.map((name, k) => el('button', {onclick: () => press(String(k + 1))}, `${k + 1}  ${name}`));
  const value = () => el('dd', {});
  const facts = {time: value(), speed: value(), asked: value(), height: value(), pace: value()};
  const list = el('div', {class: 'list drive'}, el('h3', {}, 'Gaits'), el('div', {class: 'gaits'}, gaits), el('h3', {}, 'Now'),
      el('dl', {class: 'facts'}, [['Time', facts.time], ['Speed', facts.speed], ['Asked', facts.asked], ['Height, tilt', facts.height], ['Pace', facts.pace]].map(([name, where]) => [el('dt', {}, name), where])),
      el('h3', {}, 'Keys'),
      el('dl', {class: 'facts'}, [['↑ ↓, W S', 'speed by 5 cm/s'], ['← →, A D', 'turn by 0.1 rad/s'], [', .', 'strafe by 5 cm/s'], ['space', 'stop'], ['c', 'like a car'], ['q', 'end'], ['gamepad', 'speed and strafe, turn']].map(([key, what]) => [el('dt', {}, key), el('dd', {}, what)])));
  const motion = ([forward, strafe, turn]) => `${fixed(forward, 2)}, ${fixed(strafe, 2)} m/s; ${fixed(turn, 2)} rad/s`;
  return {list, update(frame) {
    gaits.forEach((button, k) => {
      button.setAttribute('aria-current', k === frame.policy);
      button.classList.toggle('tried', k === frame.tried);
    });
    facts.time.textContent = `${fixed(frame.time, 1)} s`;
    facts.speed.textContent = motion(frame.velocity);
    facts.asked.textContent = motion(frame.command) + (frame.car ? ', as a car' : '');
    facts.height.textContent = `${short(frame.height, 3)} m, ${fixed(frame.tilt * DEGREE, 1)}°`;
    facts.pace.textContent = `${Math.round(100 * frame.pace)} % of real time`;
  }};
}

function build(stage, box, data) {
  const said = el('div', {class: 'said', role: 'status'});
  let ended = false;
  const lost = () => { if (!ended) said.textContent = 'The program does not answer any more.'; };
  const press = (key) => ended || fetch('keys', {method: 'POST', body: key}).catch(lost);
  const {list, update} = panel(data, press);
  const view = el('div', {class: 'stage', tabindex: 0}, stage?.renderer.domElement, said);
  const flag = (name) => (on) => {
    stage[name] = on;
    stage.assign();
    stage.place();
  };
  box.replaceChildren(el('div', {class: 'replay'}, el('div', {}, view, stage && el('div', {class: 'bar'}, checkbox('Contacts', true, flag('contacts')), checkbox('Follow', true, flag('follow')), checkbox('Path', true, flag('paths')), el('button', {onclick: () => stage.home()}, 'Reset view'))), list),
      stage && el('p', {class: 'note'}, `Drag to turn, wheel to zoom, right button to move.${stage.planes.length ? ` Squares of the ground are ${short(stage.gridStep)} m wide.` : ''} Arrows: contact forces, half the robot's size for its weight (${short(stage.scene.weight, 3)} N).`));
  const frames = new EventSource('frames');
  window.graze.frames = 0;
  frames.onmessage = ({data: text}) => {
    const frame = JSON.parse(text);
    ++window.graze.frames;
    said.textContent = frame.message;
    update(frame);
    stage?.take(frame, performance.now());
    if (frame.ended) {
      ended = true;
      frames.close();
    }
  };
  frames.onerror = lost;
  window.addEventListener('keydown', (event) => {
    const key = KEYS[event.key.length === 1 ? event.key.toLowerCase() : event.key] ?? (/^[1-9]$/.test(event.key) ? event.key : null);
    if (!key || event.ctrlKey || event.metaKey || event.altKey || event.target.closest?.('input, select')) return;
    if (key === 'space' && event.target.closest?.('button')) event.target.blur();
    press(key);
    event.preventDefault();
  });
  let stick = null;
  setInterval(() => {
    const now = sticks();
    if (now !== null && now !== stick && (stick !== null || now !== 'stick 0.00 0.00 0.00')) press(now);
    stick = now;
  }, STICKS);
  if (!stage) return;
  new ResizeObserver(() => requestAnimationFrame(() => view.clientWidth > 0 && stage.resize(view.clientWidth, view.clientHeight))).observe(view);
  stage.resize(Math.max(1, view.clientWidth), Math.max(1, view.clientHeight));
  const loop = (now) => {
    stage.tick(now);
    requestAnimationFrame(loop);
  };
  requestAnimationFrame(loop);
}
