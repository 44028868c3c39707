// The stage: traces overlaid in three dimensions, one in focus and the others as ghosts, with a clock.
import * as three from 'three';
import {OrbitControls} from 'three/addons/controls/OrbitControls.js';
import {checkbox, el, select} from './dom.js';
import {fixed, outcomeOf, short} from './data.js';
import {bounds, ContactArrows, Player} from './scene.js';
import {traceFate, traceName} from './traces.js';

/** A colour of the style as three.js takes it. */
const styled = (name) => new three.Color(getComputedStyle(document.documentElement).getPropertyValue(name.replace(/^var\(|\)$/g, '')).trim());

export class Stage {
  constructor(data, Kind = Player) {
    this.scene = data.scene;
    this.players = data.trajectories.filter((one) => one.bodies).map((one) => new Kind(one, data.scene));
    this.end = Math.max(...this.players.map((one) => one.end));
    Object.assign(this, {time: 0, playing: false, speed: 1, focus: 0, follow: true, contacts: true, ghosts: true, paths: true, hidden: new Set(), dirty: true});
    this.build();
  }

  build() {
    this.world = new three.Scene();
    this.measure = bounds(this.players);
    const {size} = this.measure;
    this.camera = new three.PerspectiveCamera(40, 1.6, size * 0.02, size * 400);
    this.camera.up.set(0, 0, 1);
    this.renderer = new three.WebGLRenderer({antialias: true, preserveDrawingBuffer: false});
    this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio || 1));
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.enableDamping = false;
    this.controls.addEventListener('change', () => { this.dirty = true; });
    this.lights();
    this.floor();
    for (const player of this.players) this.world.add(player.group);
    this.arrows = new ContactArrows(size, this.scene.weight);
    this.world.add(this.arrows.group);
    this.trails = this.players.map((player) => new three.Line(new three.BufferGeometry().setFromPoints(player.path()), new three.LineBasicMaterial({transparent: true})));
    this.world.add(...this.trails);
    this.environment = new three.Group();
    this.world.add(this.environment);
    this.paint();
    this.setFocus(Math.max(0, this.players.findIndex((one) => one.trace.outcome === 'success')));
    this.home();
  }

  lights() {
    const sun = new three.DirectionalLight(0xffffff, 2.1);
    sun.position.set(1.2, -1.8, 3);
    const fill = new three.DirectionalLight(0xffffff, 0.5);
    fill.position.set(-2, 1, 1);
    this.world.add(sun, fill, new three.HemisphereLight(0xffffff, 0x99a3ad, 1.3));
  }

  /** Planes: a large square of tiles of round width. */
  floor() {
    const {box, size} = this.measure;
    const step = 10 ** Math.round(Math.log10(size / 2));
    const reach = Math.max(1.5 * box.getSize(new three.Vector3()).length(), 12 * size);
    const count = 2 * Math.min(100, Math.ceil(reach / step));
    this.planes = [];
    this.gridStep = step;
    this.scene.colliders.forEach((collider, k) => {
      if (collider.kind !== 'plane') return;
      const [, , , x, y, z, qx, qy, qz, qw] = this.players[0].trace.bodies.shapes[k];
      const group = new three.Group();
      const canvas = el('canvas', {width: 256, height: 256});
      const tiles = new three.CanvasTexture(canvas);
      tiles.colorSpace = three.SRGBColorSpace;
      tiles.wrapS = tiles.wrapT = three.RepeatWrapping;
      tiles.repeat.set(count, count);
      tiles.anisotropy = this.renderer.capabilities.getMaxAnisotropy();
      const ground = new three.Mesh(new three.PlaneGeometry(count * step, count * step), new three.MeshBasicMaterial({map: tiles, side: three.DoubleSide}));
      group.add(ground);
      group.quaternion.set(qx, qy, qz, qw);
      const middle = box.getCenter(new three.Vector3());
      const normal = new three.Vector3(0, 0, 1).applyQuaternion(group.quaternion);
      const origin = new three.Vector3(x, y, z);
      if (!box.isEmpty()) origin.copy(middle.addScaledVector(normal, -middle.clone().sub(origin).dot(normal)));
      group.position.copy(origin);
      if (normal.z > 0.999) group.position.set(Math.round(origin.x / step) * step, Math.round(origin.y / step) * step, origin.z);
      this.planes.push({canvas, tiles, group});
      this.world.add(group);
    });
  }

  /** Colours by the page's theme. */
  paint() {
    this.world.background = styled('--sky');
    for (const {canvas, tiles} of this.planes) {
      const pen = canvas.getContext('2d'), {width} = canvas;
      pen.fillStyle = `#${styled('--ground').getHexString()}`;
      pen.fillRect(0, 0, width, width);
      pen.strokeStyle = `#${styled('--lines').getHexString()}`;
      pen.lineWidth = 6; // half of it on either side of a square's edge
      pen.strokeRect(0, 0, width, width);
      tiles.needsUpdate = true;
    }
    this.arrows.material.color = styled('--ink');
    // Ghosts that lie where the trace in focus lies must not tint it.
    const behind = {polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 8};
    const lit = (color, more) => new three.MeshLambertMaterial({color, ...more});
    this.materials = this.players.map((player) => {
      const color = styled(outcomeOf(player.trace.outcome).color);
      return {focus: lit(color), object: lit(styled('--body')), ghost: lit(color, {transparent: true, opacity: 0.2, depthWrite: false, ...behind})};
    });
    this.stone = lit(styled('--body'));
    this.assign();
  }

  assign() {
    this.players.forEach((player, k) => {
      const focus = k === this.focus;
      player.group.visible = focus || (this.ghosts && !this.hidden.has(k));
      player.paint(focus ? this.materials[k].focus : this.materials[k].ghost);
      if (focus) for (const mesh of player.moving) if (mesh.userData.object) mesh.material = this.materials[k].object;
      this.trails[k].visible = this.paths && player.group.visible && this.scene.floating_base;
      this.trails[k].material.color = styled(outcomeOf(player.trace.outcome).color);
      this.trails[k].material.opacity = focus ? 1 : 0.35;
    });
    for (const mesh of this.players[this.focus].fixed) mesh.material = this.stone;
    this.dirty = true;
  }

  setFocus(k) {
    this.focus = k;
    this.environment.clear();
    if (this.players[k].fixed.length) this.environment.add(...this.players[k].fixed); // particles differ in it
    this.assign();
    this.followed = null;
    this.place();
    this.changed?.();
  }

  /** The whole robot from the side, a little above. */
  home() {
    const {size} = this.measure;
    const target = this.centre();
    this.controls.target.copy(target);
    this.camera.position.copy(target).add(new three.Vector3(1.1, -1.9, 1.0).multiplyScalar(size * 1.15));
    this.controls.update();
    this.followed = target;
    this.dirty = true;
  }

  centre() {
    if (this.scene.floating_base) return this.players[this.focus].bodies[0].position.clone();
    const box = new three.Box3();
    this.players[this.focus].group.updateMatrixWorld(true);
    for (const mesh of this.players[this.focus].moving) box.expandByObject(mesh);
    return box.isEmpty() ? new three.Vector3() : box.getCenter(new three.Vector3());
  }

  /** Everything as it is at this.time. */
  place() {
    for (const player of this.players) player.show(this.time);
    this.arrows.group.visible = this.contacts;
    if (this.contacts) this.arrows.show(this.players[this.focus].contactsAt(this.time), this.scene.colliders);
    const centre = this.scene.floating_base ? this.centre() : null;
    if (centre && this.follow) {
      const moved = this.followed ? centre.clone().sub(this.followed) : centre.clone().sub(this.controls.target);
      moved.z *= 0.2; // the camera does not nod with every step
      if (moved.length() < 1e4) {
        this.controls.target.add(moved);
        this.camera.position.add(moved);
      }
      this.controls.update();
    }
    this.followed = centre;
    this.dirty = true;
  }

  seek(t) {
    this.time = Math.min(this.end, Math.max(0, t));
    this.place();
    this.changed?.();
  }

  play(on) {
    if (on && this.time >= this.end) this.seek(0);
    this.playing = on;
    this.last = null;
    this.changed?.();
  }

  /** Called for every picture of the browser. */
  tick(now) {
    if (this.playing) {
      if (this.last !== null) this.seek(this.time + this.speed * Math.min(0.1, (now - this.last) / 1000));
      this.last = now;
      if (this.time >= this.end) this.play(false);
    }
    if (!this.dirty) return;
    this.dirty = false;
    this.draw();
    this.drawn = (this.drawn ?? 0) + 1;
  }

  draw() {
    this.renderer.render(this.world, this.camera);
  }

  resize(width, height) {
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.dirty = true;
  }

  /** The trace whose robot is at a place of the stage, in -1 … 1. */
  pick(x, y) {
    const ray = new three.Raycaster();
    ray.setFromCamera(new three.Vector2(x, y), this.camera);
    const hits = ray.intersectObjects(this.players.filter((one) => one.group.visible).flatMap((one) => one.moving), false);
    return hits.length ? this.players.indexOf(hits[0].object.userData.player) : -1;
  }
}

/** The list of traces beside the stage. */
function chooser(stage) {
  const items = stage.players.map(({trace}, k) => {
    const show = el('input', {type: 'checkbox', checked: true, title: 'Show as a ghost', 'aria-label': `Show ${traceName(trace)}`, onclick: (event) => {
      event.stopPropagation();
      show.checked ? stage.hidden.delete(k) : stage.hidden.add(k);
      stage.assign();
    }});
    return el('div', {class: 'item', role: 'button', tabindex: 0, onclick: () => stage.setFocus(k), onkeydown: (event) => event.key === 'Enter' && stage.setFocus(k)},
        el('span', {class: 'dot', style: {background: outcomeOf(trace.outcome).color}}),
        el('span', {}, traceName(trace), el('div', {class: 'what'}, traceFate(trace)), trace.why && el('div', {class: 'what'}, trace.why)), show);
  });
  return {list: el('div', {class: 'list', 'aria-label': 'Traces'}, items), mark: (focus) => items.forEach((one, k) => one.setAttribute('aria-current', k === focus))};
}

/** Buttons and sliders of a stage, and update(), which brings them to its time. */
export function controls(stage, one = true) {
  const play = el('button', {class: 'play', onclick: () => stage.play(!stage.playing)}, 'Play');
  const scrub = el('input', {type: 'range', min: 0, max: stage.end, step: 'any', value: 0, 'aria-label': 'Time', oninput: () => { stage.play(false); stage.seek(Number(scrub.value)); }});
  const time = el('span', {class: 'time'});
  const frame = (by) => () => {
    const {time: times} = stage.players[stage.focus];
    const at = stage.players[stage.focus].frameAt(stage.time + 1e-9);
    stage.play(false);
    stage.seek(times[Math.min(times.length - 1, Math.max(0, at + by))]);
  };
  const flag = (name) => (on) => {
    stage[name] = on;
    stage.assign();
    stage.place();
  };
  const bar = el('div', {}, el('div', {class: 'bar'}, play, el('button', {title: 'One frame back', onclick: frame(-1)}, '◂'), el('button', {title: 'One frame on', onclick: frame(1)}, '▸'), scrub, time),
      el('div', {class: 'bar'}, select('Speed', [[0.05, '1/20'], [0.1, '1/10'], [0.25, '1/4'], [0.5, '1/2'], [1, '1'], [2, '2']], 1, (v) => { stage.speed = Number(v); }),
          checkbox('Contacts', true, flag('contacts')), one && checkbox('Ghosts', true, flag('ghosts')),
          stage.scene.floating_base && [checkbox('Follow', true, flag('follow')), checkbox('Paths', true, flag('paths'))],
          el('button', {onclick: () => stage.home()}, 'Reset view')));
  return {bar, update() {
    play.textContent = stage.playing ? 'Pause' : 'Play';
    scrub.value = stage.time;
    time.textContent = `${fixed(stage.time, 2)} of ${fixed(stage.end, 2)} s`;
  }};
}

/** The section; the stage is made when the page has been drawn. */
export function replay(data) {
  if (!data.trajectories?.some((one) => one.bodies)) return null;
  const box = el('div', {}, el('p', {class: 'note'}, 'Loading …'));
  const start = () => {
    let stage;
    try {
      stage = new Stage(data);
    } catch (error) {
      box.replaceChildren(el('p', {class: 'warning'}, `The replay needs WebGL, which this browser does not offer here (${error.message}).`));
      return null;
    }
    build(stage, box);
    return stage;
  };
  return {id: 'replay', short: 'Replay', title: 'Replay in three dimensions', text: 'Collision shapes, which are what is simulated. The trace in focus is solid, the others are ghosts; colours tell the outcome.', parts: [box], start};
}

function build(stage, box) {
  const {list, mark} = chooser(stage), {bar, update} = controls(stage);
  const said = el('div', {class: 'said'}), canvas = stage.renderer.domElement;
  const view = el('div', {class: 'stage', tabindex: 0}, canvas, said);
  const note = el('p', {class: 'note'}, `Drag to turn, wheel to zoom, right button to move, click a ghost for its trace; space plays.${stage.planes.length ? ` Squares of the ground are ${short(stage.gridStep)} m wide.` : ''} Arrows: mean contact force since the frame before, half the robot's size for its weight (${short(stage.scene.weight, 3)} N).`);
  let focus = -1;
  stage.changed = () => {
    const {trace} = stage.players[stage.focus];
    said.replaceChildren(el('b', {}, traceName(trace)), `  ${traceFate(trace)}${stage.time > trace.end + 1e-9 ? ` · ended at ${short(trace.end)} s` : ''}`);
    if (focus !== stage.focus) mark(focus = stage.focus);
    update();
  };
  let down = null;
  canvas.addEventListener('pointerdown', (event) => { down = [event.clientX, event.clientY]; });
  canvas.addEventListener('pointerup', (event) => {
    if (!down || Math.hypot(event.clientX - down[0], event.clientY - down[1]) > 4) return;
    const area = canvas.getBoundingClientRect();
    const k = stage.pick(2 * (event.clientX - area.left) / area.width - 1, 1 - 2 * (event.clientY - area.top) / area.height);
    if (k >= 0) stage.setFocus(k);
  });
  view.addEventListener('keydown', (event) => {
    if (event.key === ' ') stage.play(!stage.playing);
    else return;
    event.preventDefault();
  });
  box.replaceChildren(el('div', {class: 'replay'}, el('div', {}, view, bar), list), note);
  new ResizeObserver(() => requestAnimationFrame(() => view.clientWidth > 0 && stage.resize(view.clientWidth, view.clientHeight))).observe(view);
  stage.resize(Math.max(1, view.clientWidth), Math.max(1, view.clientHeight));
  stage.changed();
  const loop = (now) => {
    stage.tick(now);
    requestAnimationFrame(loop);
  };
  requestAnimationFrame(loop);
}
