/** A station in words. */

import { CONNECTORS } from "../journey/charging.js";
import { number } from "../units.js";
import { powerText } from "./power.js";

const ACCESS = { customers: "for customers", restricted: "restricted access", private: "private", public: "", unknown: "" };

/** Its name, or what stands for it. */
export const stationName = ({ name, operator, network }) => name || operator || network || "Charging station";

/** Who runs it, where its name does not say so: empty where it is not known. */
export const operatorText = ({ name, operator, network }) => [operator, network].filter((text, i, all) => text && text !== name && all.indexOf(text) === i).join(", ");

/** Sockets of one kind: "2 × CCS 2, 150 kW". */
export const socketText = ({ connector, output_kw: kw, count }) => `${count} × ${CONNECTORS[connector] ?? connector}${kw ? `, ${powerText(kw)}` : ""}`;

/** What charging costs, null where nothing is known. */
export function priceText({ price, fee }) {
  if (price) {
    const { currency, per_kwh: kwh, per_min: minute, per_session: session } = price;
    const parts = [[kwh, "a kWh"], [minute, "a minute"], [session, "a session"]].filter(([value]) => value !== null && value !== undefined).map(([value, of]) => `${moneyText(value, currency)} ${of}`);
    if (parts.length) return parts.join(", ");
    if (price.text) return price.text;
  }
  return { true: "costs a fee", false: "free of charge" }[String(fee)] ?? null;
}

/** An amount with its currency. */
export const moneyText = (value, currency) => `${number(value, 2)}${currency ? ` ${currency}` : ""}`;

/** What keeps one from charging there: "out of order", "private"; null for nothing. */
export const hindranceText = ({ operational, access }) => (operational === false ? "out of order" : ACCESS[access] || null);
