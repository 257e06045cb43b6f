/** Calls of the service; whatever goes wrong becomes an ApiError that can be shown to a reader. */

import { keyHeaders } from "./key.js";

export class ApiError extends Error {
  /**
   * @param {string} message what to show
   * @param {{code?: string, status?: number, fields?: Array<{field: string, value: any, allowed: string}>}} facts
   */
  constructor(message, { code = "unreachable", status = 0, fields = [] } = {}) {
    super(message);
    this.name = "ApiError";
    this.code = code;
    this.status = status;
    this.fields = fields;
  }
}

/**
 * The answer of a call, read as JSON; null for an answer without a body.
 * @param {string} path relative to the page, so that the service may lie below a prefix
 * @param {{method?: string, body?: any, form?: FormData, signal?: AbortSignal, accept?: string}} [options]
 * @throws {ApiError} and AbortError where the signal fired
 */
export async function call(path, { method, body, form, signal, accept } = {}) {
  const headers = { Accept: accept ?? "application/json, application/geo+json;q=0.9", ...keyHeaders() };
  const options = { method: method ?? (body || form ? "POST" : "GET"), headers, signal };
  if (body !== undefined) {
    headers["Content-Type"] = "application/json";
    options.body = JSON.stringify(body);
  } else if (form) {
    options.body = form;
  }
  let response;
  try {
    response = await fetch(path, options);
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new ApiError("The service does not answer. Is it running, and reachable from here?");
  }
  if (response.status === 204) return null;
  let told = null;
  try {
    told = await response.json();
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new ApiError(`The service answered ${response.status} with something that can't be read.`, { status: response.status });
  }
  if (!response.ok) {
    const detail = typeof told?.detail === "string" ? told.detail : `The service answered ${response.status}.`;
    throw new ApiError(detail, { code: told?.code, status: response.status, fields: told?.errors ?? [] });
  }
  return told;
}

/** A page of the service as text, such as a report. @throws {ApiError} */
export async function pageText(path) {
  const response = await fetch(path, { headers: keyHeaders() });
  if (!response.ok) throw new ApiError(`The service answered ${response.status}.`, { status: response.status });
  return response.text();
}

const TAKEN_BACK_EVERY_MS = 4000; // the service works on what was taken back, and many of them would pile up there

/**
 * Runs only the latest of many wishes: waits until none came for `delay` ms (at most `maxWait`), and aborts what is still
 * under way. Where it has just aborted something else, it waits for what is under way, so that an area follows a slider
 * also where answers take longer than `maxWait`. An answer never comes after that of a later wish.
 * @param {(signal: AbortSignal) => Promise<void>} work
 */
export function latest(work, { delay = 150, maxWait = 500 } = {}) {
  let timer = 0;
  let since = 0;
  let controller = null; // of what is under way
  let held = false; // whether a wish waits for what is under way
  let takenBack = -Infinity;
  const start = () => {
    timer = 0;
    const now = performance.now();
    const wait = controller ? takenBack + TAKEN_BACK_EVERY_MS - now : 0;
    held = wait > 0;
    if (held) {
      timer = setTimeout(start, wait);
      return;
    }
    if (controller) takenBack = now;
    controller?.abort();
    controller = new AbortController();
    run(controller);
  };
  const run = async (own) => {
    try {
      await work(own.signal);
    } catch (error) {
      if (error.name !== "AbortError") throw error;
    } finally {
      if (controller === own) {
        controller = null;
        if (held) {
          clearTimeout(timer);
          start();
        }
      }
    }
  };
  return {
    ask() {
      const now = performance.now();
      if (timer) clearTimeout(timer);
      else since = now;
      timer = setTimeout(start, Math.max(0, Math.min(delay, since + maxWait - now)));
    },
    cancel() {
      if (timer) clearTimeout(timer);
      timer = 0;
      held = false;
      controller?.abort();
      controller = null;
    },
  };
}
