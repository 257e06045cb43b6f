/** Recordings sent as a form, with how much of them has gone: fetch tells nothing of that. */

import { ApiError } from "../api.js";
import { keyHeaders } from "../key.js";

/**
 * Send a form; resolves to the answer.
 * @param {FormData} form
 * @param {(share: number) => void} told share of the bytes that have gone, 0..1
 * @throws {ApiError} and AbortError where the signal fired
 */
export function sendForm(path, form, { told, signal }) {
  return new Promise((resolve, reject) => {
    const request = new XMLHttpRequest();
    request.open("POST", path);
    request.responseType = "json";
    request.setRequestHeader("Accept", "application/json");
    for (const [name, value] of Object.entries(keyHeaders())) request.setRequestHeader(name, value);
    request.upload.addEventListener("progress", ({ loaded, total }) => told(total ? loaded / total : 0));
    request.addEventListener("load", () => {
      const { status, response } = request;
      if (status >= 200 && status < 300 && response) resolve(response);
      else reject(new ApiError(response?.detail ?? `The service answered ${status}.`, { code: response?.code, status, fields: response?.errors ?? [] }));
    });
    request.addEventListener("error", () => reject(new ApiError("The recordings could not be sent. Is the service running, and reachable from here?")));
    request.addEventListener("abort", () => reject(new DOMException("Not sent", "AbortError")));
    signal.addEventListener("abort", () => request.abort(), { once: true });
    request.send(form);
  });
}

/** All files of a drop, those in dropped folders too. */
export async function droppedFiles(transfer) {
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
  const plain = [...transfer.files]; // must be read before the first wait, after which the drop is gone
  if (!entries.some((entry) => entry.isDirectory)) return plain;
  return (await Promise.all(entries.map(filesBelow))).flat();
}

async function filesBelow(entry) {
  if (entry.isFile) return [await new Promise((resolve, reject) => { entry.file(resolve, reject); })];
  const reader = entry.createReader();
  const found = [];
  for (;;) {
    const some = await new Promise((resolve, reject) => { reader.readEntries(resolve, reject); });
    if (!some.length) break;
    found.push(...some);
  }
  return (await Promise.all(found.map(filesBelow))).flat();
}
