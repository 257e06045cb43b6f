/** Roads near the pointer: on a map that is far out, hardly anybody hits one as exactly as the service wants. */

const ALLOWED_M = 900; // a little less than the service allows between a place and its road
const NEAR_PX = 14;

/** The place at a point [px] of a map; where no road is near enough, that of the nearest road that is drawn close by. */
export function placeNear(map, point) {
  const asked = map.unproject([point.x, point.y]);
  const metresPerPx = asked.distanceTo(map.unproject([point.x + 100, point.y])) / 100;
  const found = nearestOnRoads(map, point);
  const { lat, lng: lon } = found && found.apart * metresPerPx > ALLOWED_M ? map.unproject(found.at) : asked;
  return { lat, lon };
}

/** The nearest point of roads within NEAR_PX: {apart [px], at: [x, y]}, null for none. */
function nearestOnRoads(map, { x, y }) {
  const layers = map.getStyle().layers.map(({ id }) => id).filter((id) => id.startsWith("road-") && id !== "road-names");
  const box = [[x - NEAR_PX, y - NEAR_PX], [x + NEAR_PX, y + NEAR_PX]];
  let nearest = null;
  for (const { geometry } of layers.length ? map.queryRenderedFeatures(box, { layers }) : []) {
    const lines = geometry.type === "MultiLineString" ? geometry.coordinates : [geometry.coordinates];
    for (const line of lines) {
      const points = line.map((position) => map.project(position));
      for (let i = 1; i < points.length; i += 1) {
        const at = nearestBetween(points[i - 1], points[i], { x, y });
        const apart = Math.hypot(at[0] - x, at[1] - y);
        if (apart <= NEAR_PX && apart < (nearest?.apart ?? Infinity)) nearest = { apart, at };
      }
    }
  }
  return nearest;
}

function nearestBetween(from, to, { x, y }) {
  const [dx, dy] = [to.x - from.x, to.y - from.y];
  const squared = dx * dx + dy * dy;
  const share = squared > 0 ? Math.min(1, Math.max(0, ((x - from.x) * dx + (y - from.y) * dy) / squared)) : 0;
  return [from.x + share * dx, from.y + share * dy];
}
