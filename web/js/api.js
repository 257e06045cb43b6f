/** Calls of the service; whatever goes wrong becomes an ApiError that can be shown to a reader. */

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
  const headers = { Accept: accept ?? "application/json, application/geo+json;q=0.9" };
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
    const detail = told?.detail ?? `The service answered ${response.status}.`;
    throw new ApiError(detail, { code: told?.code, status: response.status, fields: told?.errors ?? [] });
  }
  return told;
}

/**
 * Runs only the latest of many wishes: waits until none came for `delay` ms (at most `maxWait`), aborts what is still
 * under way, and drops answers that were overtaken.
 * @param {(signal: AbortSignal) => Promise<void>} work
 */
export function latest(work, { delay = 150, maxWait = 500 } = {}) {
  let timer = 0;
  let since = 0;
  let controller = null;
  const start = () => {
    timer = 0;
    controller?.abort();
    controller = new AbortController();
    const { signal } = controller;
    work(signal).catch((error) => {
      if (error.name !== "AbortError") throw error;
    });
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
      controller?.abort();
      controller = null;
    },
  };
}
