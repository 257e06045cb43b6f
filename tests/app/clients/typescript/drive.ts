/** Drives a service by the types that were generated for it: node drive.js ADDRESS; prints what came back as JSON. */

import createClient from "openapi-fetch";
import type { components, paths } from "./joulepath.js";

declare const process: { argv: string[] };

const client = createClient<paths>({ baseUrl: process.argv[2] });
const trip: components["schemas"]["RouteRequest"] = {
  start: { lat: 46.5, lon: 8.003 }, goal: { lat: 46.518, lon: 8.02 }, soc: 0.4, graph: "grid",
};

const graphs = await client.GET("/graphs");
const found = await client.POST("/route", { body: trip });
const area = await client.GET("/range", { params: { query: { lat: 46.51, lon: 8.01, soc: 0.5, graph: "grid", bands: "3" } } });
const refused = await client.POST("/route", { body: { ...trip, graph: "atlantis" } });
if (!graphs.data || !found.data || !area.data || typeof area.data === "string" || !refused.error) throw new Error("not as expected");
const problem: components["schemas"]["Problem"] = refused.error;
if (typeof found.data === "string" || !("routes" in found.data)) throw new Error("GeoJSON, which was not asked for");
const route = found.data.routes[0];
if (!route?.geometry || typeof route.geometry === "string") throw new Error("no route");
console.log(JSON.stringify({
  graphs: graphs.data.graphs.map((graph) => graph.name).sort(),
  energy_kwh: route.energy_kwh,
  points: route.geometry.coordinates.length,
  bands: area.data.features.length,
  problem: [problem.code, problem.status],
}));
