/** Dotted lines from the places that were asked for to where they met a road. */

const SHOWN_FROM_M = 15;
const position = ({ lat, lon }) => [lon, lat];

/** Features of the overlay `lead`. snapped: [{asked, on_road, distance_m}] of an answer. */
export function leadFeatures(snapped) {
  return snapped
    .filter(({ distance_m: distance }) => distance > SHOWN_FROM_M)
    .map(({ asked, on_road: met }) => ({
      type: "Feature", properties: {}, geometry: { type: "LineString", coordinates: [position(asked), position(met)] },
    }));
}
