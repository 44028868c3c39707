// Elements without HTML: all that comes from an archive goes in as text, never as markup.

const SVG = 'http://www.w3.org/2000/svg';

function fill(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes ?? {})) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith('on')) element.addEventListener(name.slice(2), value);
    else if (name === 'style' && typeof value === 'object') Object.assign(element.style, value);
    else element.setAttribute(name, value === true ? '' : value);
  }
  for (const child of children.flat(Infinity)) {
    if (child !== null && child !== undefined && child !== false) element.append(child);
  }
  return element;
}

/** el('p', {class: 'note'}, 'text', …) */
export const el = (tag, attributes, ...children) => fill(document.createElement(tag), attributes, children);
export const svg = (tag, attributes, ...children) => fill(document.createElementNS(SVG, tag), attributes, children);

/** A choice of one of `options`, [[value, text], …]. */
export function select(label, options, value, change) {
  const box = el('select', {onchange: () => change(box.value), 'aria-label': label},
      options.map(([key, text]) => el('option', {value: key, selected: String(key) === String(value)}, text)));
  return el('label', {class: 'choice'}, el('span', {}, label), box);
}

export function checkbox(label, checked, change) {
  const box = el('input', {type: 'checkbox', checked, onchange: () => change(box.checked)});
  return el('label', {class: 'check'}, box, label);
}

const waiting = new Set();

/** Draws what could not be drawn while it stood in no page; to be called when it does. */
export function drawWaiting() {
  for (const look of waiting) look();
  waiting.clear();
}

/** Calls draw(width) as soon as the element has a width, and whenever that changes. */
export function whenSized(element, draw) {
  let drawn = 0;
  const look = () => {
    const width = Math.floor(element.clientWidth);
    if (width > 0 && width !== drawn) {
      drawn = width;
      draw(width);
    }
  };
  new ResizeObserver(() => requestAnimationFrame(look)).observe(element); // later: what is drawn may change the size again
  look();
  if (!drawn) waiting.add(look);
  return () => {
    drawn = 0;
    look();
  };
}

let tip = null;
/** A note beside the pointer; no text: none. */
export function tooltip(event, lines) {
  if (!tip) {
    tip = el('div', {class: 'tip'});
    document.body.append(tip);
  }
  tip.style.display = lines ? 'block' : 'none';
  if (!lines) return;
  tip.replaceChildren(...lines.map((line) => el('div', {}, line)));
  const box = tip.getBoundingClientRect();
  const left = Math.min(event.clientX + 14, window.innerWidth - box.width - 8);
  const above = event.clientY + 16 + box.height > window.innerHeight;
  tip.style.left = `${Math.max(4, left)}px`;
  tip.style.top = `${above ? event.clientY - box.height - 10 : event.clientY + 16}px`;
}
