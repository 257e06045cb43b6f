/** What the types refuse: a request without a goal, and a property that no answer has. */

import createClient from "openapi-fetch";
import type { paths } from "./joulepath.js";

const client = createClient<paths>({ baseUrl: "/" });
// @ts-expect-error a route needs a goal
await client.POST("/route", { body: { start: { lat: 46.5, lon: 8.003 }, soc: 0.4 } });
const found = await client.GET("/graphs");
// @ts-expect-error graphs have no speed
console.log(found.data?.graphs[0]?.speed);
