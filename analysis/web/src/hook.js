// What tests, and whoever writes scripts for the page, can see and do. First of all, so that it knows of every error.
const graze = {
  ready: false,
  errors: [],
  sections: [],
  data: null,
  times: {begin: performance.now()}, // ms since the page was asked for: its script begins, its sections are there, the replay, too
  stage: null,
  /** The replay as it is: time in s, which trace is in focus, where its first body is. */
  get state() {
    const {stage} = graze;
    if (!stage) return null;
    const body = stage.players[stage.focus].bodies[0];
    return {time: stage.time, playing: stage.playing, focus: stage.focus, players: stage.players.length, drawn: stage.drawn ?? 0, position: body ? body.position.toArray() : null};
  },
};
window.graze = graze;
window.addEventListener('error', (event) => graze.errors.push(String(event.error?.stack ?? event.message)));
window.addEventListener('unhandledrejection', (event) => graze.errors.push(String(event.reason)));
