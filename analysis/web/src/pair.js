// Two robots side by side in three dimensions: the first and the improved one of a redesign, in the same task, seen by the
// same camera.
import * as three from 'three';
import {el} from './dom.js';
import {short} from './data.js';
import {controls, Stage} from './replay.js';
import {traceFate} from './traces.js';

const NARROW = 640; // px: below this they stand one above the other

class PairStage extends Stage {
  /** Nearer than one robot alone is seen from: the larger one of both fills its half. */
  home() {
    super.home();
    const {target} = this.controls;
    this.camera.position.sub(target).multiplyScalar(0.72).add(target);
    this.controls.update();
  }

  /** How far the camera has to go for the other robot to stand where the one in focus does; the ground stays level. */
  shift(k) {
    if (!this.scene.floating_base || !this.follow) return new three.Vector3();
    const out = this.players[k].bodies[0].position.clone().sub(this.players[this.focus].bodies[0].position);
    out.z = 0;
    return out.length() < 1e4 ? out : out.set(0, 0, 0);
  }

  /** Each with the whole scene to itself, solid; what is hidden and how comes from Stage.assign() for one in focus. */
  draw() {
    const {renderer, camera} = this;
    renderer.setScissorTest(true);
    this.players.forEach((player, k) => {
      const area = this.stacked ? [0, k === 0 ? this.high : 0, this.wide, this.high] : [k * this.wide, 0, this.wide, this.high];
      renderer.setViewport(...area);
      renderer.setScissor(...area);
      this.players.forEach((one, i) => {
        one.group.visible = i === k;
        this.trails[i].visible = i === k && this.paths && this.scene.floating_base;
        this.trails[i].material.opacity = 1;
      });
      player.paint(this.materials[k].focus);
      for (const mesh of player.moving) if (mesh.userData.object) mesh.material = this.materials[k].object;
      if (this.contacts) this.arrows.show(player.contactsAt(this.time), this.scene.colliders);
      const shift = this.shift(k);
      camera.position.add(shift);
      camera.updateMatrixWorld();
      renderer.render(this.world, camera);
      camera.position.sub(shift);
    });
    renderer.setScissorTest(false);
  }

  resize(width, height) {
    this.renderer.setSize(width, height, false);
    this.stacked = width < NARROW;
    [this.wide, this.high] = this.stacked ? [width, height / 2] : [width / 2, height];
    this.camera.aspect = this.wide / this.high;
    this.camera.updateProjectionMatrix();
    this.dirty = true;
  }
}

function build(stage, box) {
  const {bar, update} = controls(stage, false);
  const said = el('div', {class: 'said'}, stage.players.map(({trace}) => el('div', {}, el('b', {}, trace.policy), `  ${traceFate(trace)}`)));
  const view = el('div', {class: 'stage', tabindex: 0}, stage.renderer.domElement, said);
  view.addEventListener('keydown', (event) => {
    if (event.key !== ' ') return;
    stage.play(!stage.playing);
    event.preventDefault();
  });
  stage.changed = update;
  const ground = stage.planes.length ? ` Squares of the ground are ${short(stage.gridStep)} m wide.` : '';
  box.replaceChildren(el('div', {class: 'replay pair'}, el('div', {}, view, bar)),
      el('p', {class: 'note'}, `Drag to turn, wheel to zoom, right button to move; space plays. Both are seen by the same camera.${ground}`));
  const resize = () => {
    if (view.clientWidth > 0) stage.resize(view.clientWidth, view.clientHeight);
    said.classList.toggle('stacked', Boolean(stage.stacked));
  };
  new ResizeObserver(() => requestAnimationFrame(resize)).observe(view);
  stage.resize(Math.max(1, view.clientWidth), Math.max(1, view.clientHeight));
  resize();
  stage.changed();
  const loop = (now) => {
    stage.tick(now);
    requestAnimationFrame(loop);
  };
  requestAnimationFrame(loop);
}

/** The section; the stage is made when the page has been drawn. */
export function pair(data) {
  const box = el('div', {}, el('p', {class: 'note'}, 'Loading …'));
  const start = () => {
    let stage;
    try {
      stage = new PairStage(data);
    } catch (error) {
      box.replaceChildren(el('p', {class: 'warning'}, `The robots need WebGL, which this browser does not offer here (${error.message}).`));
      return null;
    }
    build(stage, box);
    return stage;
  };
  return {id: 'robots', short: 'Robots', title: 'The first robot and the improved one', text: 'In the same task, by the same scale: collision shapes, which are what is simulated. Colours tell the outcome.', parts: [box], start};
}
