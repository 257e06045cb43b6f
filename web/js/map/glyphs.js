/**
 * Letters of the map's labels, drawn with the fonts of the machine, so that no font has to be fetched.
 *
 * MapLibre asks for ranges of 256 characters as signed distance fields in protocol buffers (glyphs.proto of the Mapbox
 * glyph format): 24 pixels an em, 3 pixels of border, edge at 192 of 255, 8 levels a pixel.
 */

const EM = 24;
const BORDER = 3;
const EDGE = 192;
const LEVELS_PER_PX = 32; // 255 over 8 pixels, as fontnik does
const CELL = 48;
const BASELINE = 33; // of a cell, from its top
const LEFT = 8;
const ASCENT = 27; // MapLibre counts a glyph's top from here
const FAR = 1e20;
const FAMILY = 'system-ui, "Segoe UI", Roboto, "Helvetica Neue", "DejaVu Sans", sans-serif';

export const PROTOCOL = "glyphs";
export const GLYPHS_URL = `${PROTOCOL}://{fontstack}/{range}`;

/** Let MapLibre take its letters from here. */
export function installGlyphs(maplibregl) {
  const made = new Map();
  maplibregl.addProtocol(PROTOCOL, async ({ url }) => {
    if (!made.has(url)) made.set(url, rangeOf(url));
    return { data: made.get(url).slice(0) };
  });
}

function rangeOf(url) {
  const [, stack, first, last] = url.match(/^glyphs:\/\/([^/]*)\/(\d+)-(\d+)$/);
  const draw = drawer(/bold/i.test(decodeURIComponent(stack)) ? 600 : 400);
  const glyphs = [];
  for (let code = Number(first); code <= Number(last); code += 1) {
    const glyph = code >= 32 && !(code >= 0xd800 && code <= 0xdfff) ? draw(code) : null;
    if (glyph) glyphs.push(field(3, glyph));
  }
  const fontstack = bytes(field(1, text(decodeURIComponent(stack))), field(2, text(`${first}-${last}`)), ...glyphs);
  return Uint8Array.from(field(1, fontstack)).buffer;
}

/** A function that draws one character and gives its message as bytes, null where the fonts have nothing to draw. */
function drawer(weight) {
  const canvas = new OffscreenCanvas(CELL, CELL);
  const context = canvas.getContext("2d", { willReadFrequently: true });
  context.font = `${weight} ${EM}px ${FAMILY}`;
  context.textBaseline = "alphabetic";
  return (code) => {
    const character = String.fromCodePoint(code);
    const metrics = context.measureText(character);
    const advance = Math.round(metrics.width);
    const left = Math.floor(-metrics.actualBoundingBoxLeft);
    const right = Math.ceil(metrics.actualBoundingBoxRight);
    const top = Math.ceil(metrics.actualBoundingBoxAscent);
    const bottom = Math.ceil(metrics.actualBoundingBoxDescent);
    const width = Math.min(right - left, CELL - LEFT - BORDER);
    const height = Math.min(top + bottom, CELL - 2 * BORDER);
    const sizes = (w, h) => [
      ...number(1, code), ...number(3, w), ...number(4, h),
      ...signed(5, left), ...signed(6, top - ASCENT), ...number(7, Math.max(advance, 0)),
    ];
    if (width <= 0 || height <= 0) return advance > 0 ? Uint8Array.from(sizes(0, 0)) : null;
    context.clearRect(0, 0, CELL, CELL);
    context.fillText(character, LEFT - left, BASELINE);
    const [w, h] = [width + 2 * BORDER, height + 2 * BORDER];
    const pixels = context.getImageData(LEFT - BORDER, BASELINE - top - BORDER, w, h).data;
    return bytes(number(1, code), field(2, distances(pixels, w, h)), sizes(width, height).slice(number(1, code).length));
  };
}

/** Signed distances to the edge out of the coverage of w × h pixels (Felzenszwalb and Huttenlocher 2012). */
function distances(pixels, w, h) {
  const outer = new Float64Array(w * h).fill(FAR);
  const inner = new Float64Array(w * h);
  for (let i = 0; i < w * h; i += 1) {
    const covered = pixels[4 * i + 3] / 255;
    if (covered === 0) continue;
    if (covered === 1) {
      outer[i] = 0;
      inner[i] = FAR;
    } else {
      outer[i] = Math.max(0, 0.5 - covered) ** 2;
      inner[i] = Math.max(0, covered - 0.5) ** 2;
    }
  }
  transform(outer, w, h);
  transform(inner, w, h);
  const out = new Uint8Array(w * h);
  for (let i = 0; i < out.length; i += 1) {
    const distance = Math.sqrt(outer[i]) - Math.sqrt(inner[i]);
    out[i] = Math.max(0, Math.min(255, Math.round(EDGE - LEVELS_PER_PX * distance)));
  }
  return out;
}

function transform(grid, w, h) {
  for (let x = 0; x < w; x += 1) along(grid, x, w, h);
  for (let y = 0; y < h; y += 1) along(grid, y * w, 1, w);
}

/** Squared distances along one row or column: the lower envelope of parabolas. */
function along(grid, offset, stride, length) {
  const values = Float64Array.from({ length }, (_, i) => grid[offset + i * stride]);
  const at = new Int32Array(length);
  const bounds = new Float64Array(length + 1);
  let k = 0;
  bounds[0] = -FAR;
  bounds[1] = FAR;
  for (let q = 1; q < length; q += 1) {
    let meet;
    do {
      const r = at[k];
      meet = (values[q] - values[r] + q * q - r * r) / (2 * (q - r));
    } while (meet <= bounds[k] && --k > -1);
    k += 1;
    at[k] = q;
    bounds[k] = meet;
    bounds[k + 1] = FAR;
  }
  k = 0;
  for (let q = 0; q < length; q += 1) {
    while (bounds[k + 1] < q) k += 1;
    grid[offset + q * stride] = values[at[k]] + (q - at[k]) ** 2;
  }
}

// protocol buffers, as far as glyphs need them

const varint = (value) => {
  const out = [];
  let rest = value;
  while (rest > 127) {
    out.push((rest & 127) | 128);
    rest = Math.floor(rest / 128);
  }
  return [...out, rest];
};
const number = (tag, value) => [...varint(tag << 3), ...varint(value)];
const signed = (tag, value) => number(tag, value < 0 ? -2 * value - 1 : 2 * value);
const text = (value) => new TextEncoder().encode(value);
const field = (tag, content) => bytes([...varint((tag << 3) | 2), ...varint(content.length)], content);

function bytes(...parts) {
  const out = new Uint8Array(parts.reduce((sum, part) => sum + part.length, 0));
  let at = 0;
  for (const part of parts) {
    out.set(part, at);
    at += part.length;
  }
  return out;
}
