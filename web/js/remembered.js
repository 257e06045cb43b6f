/** What this browser keeps from visit to visit; where it refuses to keep anything, defaults hold. */

const PREFIX = "joulepath.";

/** What was kept under a name, null for nothing. */
export function remembered(name) {
  try {
    return localStorage.getItem(PREFIX + name);
  } catch {
    return null;
  }
}

/** Keep a text under a name. */
export function remember(name, text) {
  try {
    localStorage.setItem(PREFIX + name, text);
  } catch {
    // it holds for this visit then
  }
}
