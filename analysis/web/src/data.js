// Numbers of the page's data: unpacked, and in words.

/** A column, packed or plain, as an array; NaN where there is nothing. */
export function column(packed) {
  if (!packed) return [];
  if (Array.isArray(packed)) return Float64Array.from(packed, (x) => (x === null ? NaN : x));
  const bytes = atob(packed.u16);
  const out = new Float64Array(packed.n);
  const step = packed.hi / 65534 - packed.lo / 65534;
  for (let i = 0; i < packed.n; ++i) {
    const code = bytes.charCodeAt(2 * i) | (bytes.charCodeAt(2 * i + 1) << 8);
    out[i] = code === 65535 ? NaN : code === 65534 ? packed.hi : packed.lo + code * step;
  }
  return out;
}

export const OUTCOMES = [
  {letter: 'S', name: 'success', title: 'Success', color: 'var(--success)'},
  {letter: 'K', name: 'known failure', title: 'Known failure', color: 'var(--known)'},
  {letter: 'U', name: 'unknown failure', title: 'Unknown failure', color: 'var(--unknown)'},
  {letter: 'I', name: 'invalid', title: 'Invalid', color: 'var(--invalid)'},
];
export const outcomeOf = (name) => OUTCOMES.find((one) => one.name === name) ?? OUTCOMES[3];
export const policyColor = (index) => `var(--policy-${index % 8})`;

/** With `digits` significant digits, as short as may be. */
export function short(x, digits = 4) {
  if (x === null || x === undefined || Number.isNaN(x)) return '–';
  if (x === 0) return '0';
  const size = Math.abs(x);
  const text = size >= 1e-4 && size < 1e6 ? String(Number(x.toPrecision(digits))) : Number(x.toPrecision(digits)).toExponential();
  return text.replace('e+', 'e').replaceAll('-', '−');
}
/** A p-value, as the program's text prints it: below 1e-300 doubles end, and it would come out as 0. */
export const pText = (p) => (p !== null && p < 1e-300 ? '< 1e-300' : short(p, 3));
/** "1 trace", "1 000 traces" */
export const counted = (n, one, several) => `${whole(n)} ${n === 1 ? one : several}`;
export const fixed = (x, digits) => (x === null || x === undefined || Number.isNaN(x) ? '–' : x.toFixed(digits).replace('-', '−'));
export const whole = (x) => String(x).replace(/\B(?=(\d{3})+$)/g, ' ');
export const withUnit = (text, unit) => (unit && unit !== '1' && text !== '–' ? `${text} ${unit}` : text);
export const titled = (name, unit) => (unit && unit !== '1' ? `${name} [${unit}]` : name);

/** Wilson's score interval at 95 %. */
export function wilson(k, n) {
  if (n === 0) return [0, 1];
  const z = 1.959963985, p = k / n, scale = 1 / (1 + z * z / n);
  const half = z * Math.sqrt(p * (1 - p) / n + z * z / (4 * n * n));
  return [Math.max(0, (p + z * z / (2 * n) - half) * scale), Math.min(1, (p + z * z / (2 * n) + half) * scale)];
}

/** What a standard normal variable exceeds with probability p < 1/2 (Abramowitz and Stegun 26.2.23, to 0.0005). */
export function normalTail(p) {
  const t = Math.sqrt(-2 * Math.log(p));
  return t - (2.515517 + t * (0.802853 + t * 0.010328)) / (1 + t * (1.432788 + t * (0.189269 + t * 0.001308)));
}
