/** Bands of a range answer as map features, with colours from the outermost band to the innermost. */

// viridis (CC0) from its middle to its ends, told apart by people who are colour-blind; light to dark inwards
const RAMP = { light: ["#fde725", "#8fd744", "#35b779", "#21918c", "#31688e", "#443983"], dark: ["#f7e463", "#9adf5a", "#43c588", "#2fa5a0", "#4583b5", "#6c61bd"] };
const SURE = 0.5;
const OPACITY = { light: 0.3, dark: 0.28 };

/** Properties of all bands, the outermost first. */
export const bandsOf = (answer) => answer.features.map(({ properties }) => properties).filter(({ kind }) => kind === "band");

/** What bands are ordered by, ascending inwards: charge left, or the less that is taken. */
const levelOf = ({ soc_left: left, limit }) => (limit === null ? left : -limit);

/** The colour of one band among all. */
export function bandColour(band, bands, theme) {
  const levels = [...new Set(bands.map(levelOf))].toSorted((a, b) => a - b);
  const ramp = RAMP[theme];
  const at = levels.length < 2 ? 2 : (levels.indexOf(levelOf(band)) * (ramp.length - 1)) / (levels.length - 1);
  return ramp[Math.round(at)];
}

const sure = ({ properties }) => properties.probability === null || properties.probability === SURE;

/** The outermost band of which it is even whether a place at its edge is reached. */
export const outerBand = (answer) => answer.features.find((feature) => feature.properties.kind === "band" && sure(feature))?.properties;

/** Whether anything is left at the map's edge. */
export const endsWithMap = (answer) => Boolean(outerBand(answer)?.reaches_map_edge);

/** Where the area ends because the map does. */
export function mapEdgeFeatures(answer) {
  return endsWithMap(answer) ? [{ type: "Feature", geometry: outerBand(answer).map_edge, properties: {} }] : [];
}

/** Polygons and their edges; of areas with a probability, the even one is filled, the others are dashed edges. */
export function areaFeatures(answer, theme) {
  const bands = answer.features.filter(({ properties }) => properties.kind === "band");
  const all = bands.map(({ properties }) => properties);
  const outermost = Math.min(...all.map(levelOf));
  const drawn = (feature, more) => ({ type: "Feature", geometry: feature.geometry, properties: { colour: bandColour(feature.properties, all, theme), ...more } });
  const rings = (feature, more) => ({ ...drawn(feature, more), geometry: { type: "MultiLineString", coordinates: feature.geometry.coordinates.flat() } });
  return {
    areas: bands.filter(sure).map((feature) => drawn(feature, { opacity: OPACITY[theme] })),
    edges: [
      ...bands.filter(sure).map((feature) => rings(feature, { dashed: false })),
      ...bands.filter((feature) => !sure(feature) && levelOf(feature.properties) === outermost).map((feature) => rings(feature, { dashed: true })),
    ],
  };
}
